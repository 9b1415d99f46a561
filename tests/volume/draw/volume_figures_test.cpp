// Figures of docs/volumes.md.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <ctime>
#include <map>

#include "volume/draw/volume_draw.h"

namespace lodestone {
namespace {

using volume::Emitter;

using VolumeReferenceLong = VolumeDrawTest;
TEST_F(VolumeReferenceLong, APuffIsWhatTheReferenceSaysItIs) {
    const AnalyticVolume reference({puff()}, 0, {}, 0.004);
    for (const auto& [across, least] : {std::pair(4u, 58), std::pair(8u, 68), std::pair(16u, 75)}) {
        load({puff()}, {.metavoxels = across, .voxels = 30});
        const FrameInput input = look_from({0.4f, 0.5f, 2});
        draw(input);
        const double psnr = psnr_to(reference, input.views[0]);
        std::printf("%u^3: %.1f dB\n", across * 30, psnr);
        EXPECT_GT(psnr, least);
        std::fflush(stdout);
    }
}

// Times are printed and never asserted: CPU of the process, which on a software rasteriser
// is what drawing takes.
class VolumeFiguresLong : public VolumeDrawTest {
protected:
    VolumeFiguresLong() {
        width_ = 640;
        height_ = 360;
    }
    // Milliseconds of CPU of a frame, with its plan.
    double cpu_of(const FrameInput& frame) {
        FrameInput input = frame;
        input.frame = frame_++;
        const auto start = std::clock();
        const Plan plan = volumes_->plan(input);
        EXPECT_TRUE(renderer_->submit(Plan{}, input, {}, 0, &plan));
        EXPECT_TRUE(renderer_->wait());
        bricks_ = plan.stats.more.empty() ? 0 : plan.stats.more[0].second;
        bytes_ = static_cast<double>(plan.stats.resident_bytes);
        return 1000.0 * static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
    }
    // The least of a few.
    double cpu_of_frame(const FrameInput& frame, bool filled_before = false) {
        double least = 1e9;
        for (int round = 0; round < 4; ++round) {
            if (filled_before && round == 0) volumes_->quality.refresh = 0;
            const double ms = cpu_of(frame);
            if (!filled_before || round > 0) least = std::min(least, ms);
        }
        volumes_->quality.refresh = 1;
        return least;
    }
    FrameInput seen_from(const glm::vec3& eye, const glm::vec3& target) const {
        FrameInput input = look_from(eye, target);
        Camera camera;
        camera.eye = eye;
        camera.target = target;
        camera.near_plane = 0.05f;
        camera.far_plane = 20;
        input.views[0] = view_of(camera, width_, height_);
        return input;
    }
    void make_quietly() {
        RendererOptions options;
        options.width = width_;
        options.height = height_;
        options.shadow_size = 512;
        auto made = Renderer::create(options);
        ASSERT_TRUE(made);
        renderer_ = std::move(*made);
    }
    double bricks_ = 0, bytes_ = 0;
};

Emitter tall_plume() {
    Emitter e;
    e.velocity = {0.15f, 0.5f, 0.1f};
    e.particles = 32;
    e.radius_from = 0.08f;
    e.radius_to = 0.25f;
    e.look.density_from = 6;
    e.look.density_to = 0;
    return e;
}

TEST_F(VolumeFiguresLong, WhatItTakes) {
    make_quietly();
    const FrameInput view = seen_from({1.5f, 1.4f, 3}, {0.3f, 1, 0.2f});
    double per_brick = 0;
    for (const uint32_t across : {8u, 34u}) {
        load({tall_plume()}, {.metavoxels = across, .voxels = 30, .pool_bytes = uint64_t{400} << 20});
        const double whole = cpu_of_frame(view), march = cpu_of_frame(view, true);
        const double share = 100 * bricks_ / volumes_->lattice().metavoxel_count();
        const double fill = (whole - march) / bricks_;
        std::printf("%u x 30 across: %g bricks (%.1f%%), %.0f MiB; frame %.0f ms, march %.0f ms, fill a brick %.3f ms",
                    across, bricks_, share, bytes_ / (1 << 20), whole, march, fill);
        if (per_brick > 0) std::printf(", %.2f of the other's", fill / per_brick);
        per_brick = fill;
        volumes_->quality.skips_empty = false;
        std::printf("; without skipping march %.0f ms", cpu_of_frame(view, true));
        volumes_->quality.skips_empty = true;
        volumes_->quality.divisor = 2;
        std::printf("; half-size %.0f ms\n", cpu_of_frame(view, true));
        std::fflush(stdout);
        volumes_->quality.divisor = 1;
    }
}

TEST_F(VolumeFiguresLong, OfASmallerTarget) {
    make_quietly();
    const FrameInput view = seen_from({1.5f, 1.4f, 3}, {0.3f, 1, 0.2f});
    for (const uint32_t across : {8u, 34u}) {
        load({tall_plume()}, {.metavoxels = across, .voxels = 30, .pool_bytes = uint64_t{400} << 20});
        cpu_of(view);
        volumes_->quality.refresh = 0;
        double whole = 0;
        for (const uint32_t divisor : {1u, 2u, 3u, 4u}) {
            volumes_->quality.divisor = divisor;
            // Of each pipeline, the least of a few frames.
            std::map<std::string, double> least;
            for (int round = 0; round < 8; ++round) {
                cpu_of(view);
                for (const FrameCounters& counters : renderer_->take_counters()) {
                    for (const auto& [name, ms] : counters.effect_ms)
                        least[name] = least.contains(name) ? std::min(least[name], ms) : ms;
                }
            }
            double march = 0;
            std::printf("%u x 30 across, 1/%u:", across, divisor);
            for (const char* name : {"volume march", "volume upsample", "volume misfits"}) {
                march += least[name];
                std::printf(" %s %.1f", name, least[name]);
            }
            whole = divisor == 1 ? march : whole;
            std::printf(", in all %.1f ms, %.2f of full size\n", march, march / whole);
            std::fflush(stdout);
        }
    }
}

TEST_F(VolumeFiguresLong, OfSparserOnes) {
    make_quietly();
    const FrameInput view = seen_from({1.5f, 1.4f, 3}, {0.3f, 1, 0.2f});
    for (const float radius : {0.25f, 0.18f, 0.12f}) {
        Emitter e = tall_plume();
        e.radius_to = radius;
        for (const uint32_t across : {8u, 34u}) {
            load({e}, {.metavoxels = across, .voxels = 30, .pool_bytes = uint64_t{400} << 20});
            const double whole = cpu_of_frame(view, true);
            volumes_->quality.skips_empty = false;
            const double all = cpu_of_frame(view, true);
            std::printf("%u x 30 across, %.1f%% occupied, %.0f MiB: march 1/%.2f of that without skipping\n", across,
                        100 * bricks_ / volumes_->lattice().metavoxel_count(), bytes_ / (1 << 20), all / whole);
            std::fflush(stdout);
        }
    }
}

TEST_F(VolumeFiguresLong, OfTheSourcesOwnWay) {
    make_quietly();
    const FrameInput view = seen_from({1.5f, 1.4f, 3}, {0.3f, 1, 0.2f});
    load({tall_plume()}, {.metavoxels = 8, .voxels = 30});
    const double whole = cpu_of_frame(view);
    volumes_->quality.by_metavoxel = true;
    for (const uint32_t cache : {0u, 8u, 1u}) {
        volumes_->quality.cache = cache;
        const double alone = cpu_of_frame(view);
        std::printf("240^3, %g bricks: %.0f ms; metavoxel by metavoxel, %u at a time: %.0f ms, ours is %.2f of it\n",
                    bricks_, whole, cache, alone, whole / alone);
    }
}

TEST_F(VolumeFiguresLong, OfRounds) {
    make_quietly();
    const FrameInput view = seen_from({1.5f, 1.4f, 3}, {0.3f, 1, 0.2f});
    for (const uint32_t across : {8u, 34u}) {
        double every_mean = 0, every_worst = 0;
        for (const uint32_t refresh : {1u, 4u}) {
            load({tall_plume()}, {.metavoxels = across, .voxels = 30, .pool_bytes = uint64_t{800} << 20});
            volumes_->quality.refresh = refresh;
            std::vector<double> ms;
            for (int f = 0; f < 29; ++f) {
                FrameInput input = view;
                input.time = 2 + f / 30.0;
                const double cpu = cpu_of(input);
                if (f > 4) ms.push_back(cpu);  // buffers have grown
            }
            double mean = 0;
            for (const double one : ms) mean += one / static_cast<double>(ms.size());
            const double worst = *std::ranges::max_element(ms);
            std::printf("%u x 30 across, refresh %u: mean %.0f ms, worst %.0f ms, %.0f MiB", across, refresh, mean,
                        worst, bytes_ / (1 << 20));
            if (refresh == 1) {
                every_mean = mean;
                every_worst = worst;
                std::printf("\n");
            } else {
                std::printf("; %.2f and %.2f of every frame's\n", mean / every_mean, worst / every_worst);
            }
            std::fflush(stdout);
        }
    }
}

}  // namespace
}  // namespace lodestone
