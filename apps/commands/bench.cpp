#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <iterator>
#include <map>
#include <tuple>
#include <utility>

#include "apps/commands/commands.h"
#include "apps/drawing/flight.h"
#include "apps/drawing/stage.h"
#include "apps/options/common_options.h"
#include "apps/terminal.h"
#include "base/files/file.h"
#include "base/statistics.h"
#include "mesh/distance/distance.h"
#include "mesh/io/image_file.h"
#include "report/error_search.h"
#include "report/image_metrics.h"
#include "report/markdown.h"
#include "report/page.h"
#include "report/rows.h"

namespace lodestone {

namespace {

struct BenchArguments {
    StageOptions stage;
    std::string backends = "full,discrete,lod,vgi", orders, rasters, pixel_errors = "1", out;
    std::string equal_error;  // a metric, or empty
    uint32_t frames = 120, quality_frames = 5, rounds = 1;
    double fps = 0;
    bool json = false;
};

constexpr uint32_t supersampling = 4;
constexpr int page_quality = 88;  // of JPEG pictures in the page

// A picture to compare with, kept with what is needed to compare.
struct Reference {
    Camera camera;
    View view;
    Picture supersampled;                     // at the small size: colour averaged over 4x4, alpha the covered share
    Picture full;                             // `full` at the small size
    std::unique_ptr<ClosestSurface> surface;  // of `full` as drawn, world space
    std::vector<glm::vec3> corners;           // of that, three per triangle
};

// The triangles the last frame drew, in world space: three corners each.
std::vector<glm::vec3> drawn_corners(const PlanMirror& mirror, const ReadyScene& scene) {
    std::vector<glm::vec3> corners;
    for (uint32_t i = 0; i < scene.instances.size(); ++i) {
        const glm::mat4& to_world = scene.instances[i].object_to_world;
        for (const auto& triangle : mirror.triangles_of(i)) {
            for (const glm::vec3& p : triangle) corners.emplace_back(to_world * glm::vec4(p, 1));
        }
    }
    return corners;
}

std::unique_ptr<ClosestSurface> surface_of(const std::vector<glm::vec3>& corners) {
    if (corners.empty()) return nullptr;
    std::vector<uint32_t> indices(corners.size());
    for (uint32_t i = 0; i < indices.size(); ++i) indices[i] = i;
    return std::make_unique<ClosestSurface>(corners, indices);
}

// Each time over the median of the 15 around it.
std::vector<double> jolts(const std::vector<double>& ms) {
    std::vector<double> result;
    for (size_t i = 0; i < ms.size(); ++i) {
        const size_t begin = i < 7 ? 0 : i - 7, end = std::min(ms.size(), i + 8);
        result.push_back(ms[i] / median(std::span(ms).subspan(begin, end - begin)));
    }
    return result;
}

class Bench {
public:
    Bench(const BenchArguments& options, ReadyScene& scene, Renderer& renderer, uint32_t width, uint32_t height,
          const Progress& progress)
        : options_(options), scene_(scene), renderer_(renderer), width_(width), height_(height), progress_(progress) {}

    // Pictures of `full` for the frames at which quality is measured; it is the ruler, and has no budget.
    Result<void> make_references() {
        const Budget budget = std::exchange(scene_.scene.budget, Budget{.resident_bytes = uint64_t{1} << 40});
        auto done = draw_references();
        scene_.scene.budget = budget;
        return done;
    }

    // Adds a row. Fault::machine where the backend cannot draw the scene within its budget.
    Result<void> measure(const Technique& way, double pixel_error) {
        Row row;
        static_cast<Technique&>(row) = way;
        row.pixel_error = pixel_error;
        row.frames = options_.frames;
        row.bake_seconds = scene_.bake_seconds;
        row.asset_bytes = scene_.asset_bytes;
        if (auto done = measure_times(row); !done) return done;
        if (auto done = measure_quality(row, true); !done) return done;
        report.rows.push_back(std::move(row));
        return {};
    }

    // Adds a row of `way` at the largest pixel error at which it is no worse than `like`. None where it never is.
    Result<void> measure_like(const Technique& way, const Row& like, const ErrorMetric& metric) {
        const double worst = metric.worse(like);
        const auto at = largest_good({.start = like.pixel_error}, [&](double pixel_error) -> Result<bool> {
            if (progress_.stopped()) return fail(Fault::interrupted, "interrupted");
            const auto [tried, is_new] = tried_.try_emplace({way, metric.name, pixel_error});
            if (is_new) {
                Row row;
                static_cast<Technique&>(row) = way;
                row.pixel_error = pixel_error;
                if (auto done = measure_quality(row, false); !done) return tl::unexpected(done.error());
                tried->second = metric.worse(row);
            }
            return tried->second <= worst;
        });
        if (!at) return tl::unexpected(at.error());
        if (!*at) {
            progress_.warning(name_of(way) + ": no " + metric.name + " as good as that of " + name_of(like) + " at " +
                              std::to_string(like.pixel_error) + " px");
            return {};
        }
        const bool measured = std::ranges::any_of(report.rows, [&](const Row& row) {
            return static_cast<const Technique&>(row) == way && row.pixel_error == **at;
        });
        return measured ? Result<void>{} : measure(way, **at);
    }

    // Flies once more with the pixel error steered to hold a frame rate.
    Result<void> steer(const Technique& way, double fps, double pixel_error) {
        if (auto done = renderer_.resize(width_, height_); !done) return done;
        auto session = DrawSession::open(scene_, renderer_, way, false, progress_);
        if (!session) return tl::unexpected(session.error());
        const Budget& budget = scene_.scene.budget;
        ErrorController controller(1000 / fps, pixel_error);
        const auto flown = fly(**session, {&scene_.camera, options_.frames, budget, width_, height_, &controller, true},
                               name_of(way) + " steered", progress_);
        if (!flown) return tl::unexpected(flown.error());
        report.steered.push_back({way, 1000 / fps, of_frames(*flown, [](const FlownFrame& f) { return f.period_ms; }),
                                  of_frames(*flown, [](const FlownFrame& f) { return f.pixel_error; })});
        return {};
    }

    // The page: what was measured, with the pictures.
    Result<void> write() const {
        const std::filesystem::path folder(options_.out);
        if (auto done = write_json((folder / "report.json").string(), json_of(report).dump(2)); !done) return done;
        for (const auto& [name, text] : {std::pair("report.html", report_page(report, images_)),
                                         std::pair("report.md", report_markdown(report))}) {
            auto file = OutputFile::create(folder / name);
            if (!file) return tl::unexpected(file.error());
            if (auto done = file->write(text); !done) return done;
            if (auto done = file->commit(); !done) return done;
        }
        return {};
    }

    Report report;

private:
    Result<void> draw_references() {
        if (options_.quality_frames == 0) return {};
        auto session = DrawSession::open(scene_, renderer_, {"full", "", ""}, true, progress_);
        if (!session) return tl::unexpected(session.error());
        for (uint32_t i = 0; i < options_.quality_frames; ++i) {
            progress_.at("reference pictures", static_cast<double>(i) / options_.quality_frames);
            Reference reference;
            reference.camera = quality_camera(i);
            if (auto done = draw_at(**session, reference.camera, width_ * supersampling, height_ * supersampling,
                                    reference.supersampled);
                !done)
                return done;
            reference.supersampled = downsampled(reference.supersampled, supersampling);
            if (auto done = draw_at(**session, reference.camera, width_, height_, reference.full); !done) return done;
            reference.view = (*session)->view();
            reference.corners = drawn_corners(*(*session)->mirror(), scene_);
            reference.surface = surface_of(reference.corners);
            auto name = save(reference.supersampled, "reference-" + std::to_string(i), true);
            if (!name) return tl::unexpected(name.error());
            report.references.push_back(*name);
            references_.push_back(std::move(reference));
        }
        return {};
    }

    Camera quality_camera(uint32_t i) const { return scene_.camera.at((i + 0.5) / options_.quality_frames); }

    Result<void> draw_at(DrawSession& session, const Camera& camera, uint32_t width, uint32_t height,
                         Picture& picture) {
        if (auto done = renderer_.resize(width, height); !done) return done;
        const Budget& budget = scene_.scene.budget;
        session.time = 0;  // as of the pictures that are compared
        auto drawn = session.settle(camera, budget, width, height);
        if (!drawn) return tl::unexpected(drawn.error());
        auto read = renderer_.read_picture();
        if (!read) return tl::unexpected(read.error());
        picture = std::move(*read);
        return {};
    }

    Budget budget_of(const Row& row) const {
        Budget budget = scene_.scene.budget;
        budget.pixel_error = row.pixel_error;
        return budget;
    }

    // Every round twice, with one frame in flight and with several; the row is told how often the latter are drawn.
    // Returns the former.
    Result<std::vector<FlownFrame>> fly_rounds(DrawSession& session, const Budget& budget, Row& row) {
        const std::string name = name_of(row);
        std::vector<FlownFrame> alone, overlapped;
        for (uint32_t round = 0; round < options_.rounds; ++round) {
            for (const bool overlaps : {false, true}) {
                const Flight flight{&scene_.camera, options_.frames, budget, width_, height_, nullptr, overlaps};
                auto frames = fly(session, flight, name, progress_);
                if (!frames) return tl::unexpected(frames.error());
                auto& all = overlaps ? overlapped : alone;
                all.insert(all.end(), frames->begin(), frames->end());
            }
        }
        BudgetUse use = use_of(alone);
        use.add(use_of(overlapped));
        for (const std::string& line : beyond(budget, use, name)) progress_.warning(line);
        const FrameRates rates = frame_rates(overlapped);
        row.throughput_fps = rates.mean;
        row.throughput_fps_min = rates.least;
        row.throughput_fps_max = rates.most;
        row.frames_in_flight = frames_in_flight;
        return alone;
    }

    Result<void> measure_times(Row& row) {
        const Technique& way = row;
        const Budget budget = budget_of(row);
        if (auto done = renderer_.resize(width_, height_); !done) return done;
        auto session = DrawSession::open(scene_, renderer_, way, false, progress_);
        if (!session) return tl::unexpected(session.error());
        auto frames = fly_rounds(**session, budget, row);
        if (!frames) return tl::unexpected(frames.error());
        const std::vector<FlownFrame>& flown = *frames;
        std::vector<double> floor_ms;
        for (uint32_t f = 0; f < std::max(3u, options_.frames / 10); ++f) {
            auto drawn = (*session)->draw(scene_.camera.frame(0, options_.frames), budget, width_, height_, true);
            if (!drawn) return tl::unexpected(drawn.error());
            floor_ms.push_back(drawn->ms);
        }
        const auto ms = of_frames(flown, [](const FlownFrame& f) { return f.ms; });
        std::vector<double> acmr;
        for (const FlownFrame& f : flown) {
            if (f.triangles > 0)
                acmr.push_back(static_cast<double>(f.camera_invocations) / static_cast<double>(f.triangles));
        }
        row.resident_bytes = flown.back().resident_bytes;
        row.ms_median = median(ms);
        row.ms_p95 = percentile(ms, 0.95);
        row.ms_p99 = percentile(ms, 0.99);
        row.ms_max = percentile(ms, 1);
        row.ms_floor = median(floor_ms);
        row.ms_jolt = percentile(jolts(ms), 0.99);
        row.flight_ms = ms;
        row.flight_triangles = of_frames(flown, [](const FlownFrame& f) { return f.triangles; });
        row.fps_mean = 1000 / mean(ms);
        row.fps_min = 1000 / percentile(ms, 1);
        row.fps_max = 1000 / percentile(ms, 0);
        row.cpu_plan_ms = mean(of_frames(flown, [](const FlownFrame& f) { return f.plan_cpu_ms; }));
        row.cpu_ms = mean(of_frames(flown, [](const FlownFrame& f) { return f.cpu_ms; }));
        row.gpu_ms = median(of_frames(flown, [](const FlownFrame& f) { return f.gpu_ms; }));
        for (size_t s = 0; s < stage_count; ++s) {
            row.stages_gpu_ms.emplace_back(
                name_of(static_cast<Stage>(s)),
                median(of_frames(flown, [s](const FlownFrame& f) { return f.stage_gpu_ms[s]; })));
        }
        row.triangles = mean(of_frames(flown, [](const FlownFrame& f) { return f.triangles; }));
        row.vertex_invocations = mean(of_frames(flown, [](const FlownFrame& f) { return f.vertex_invocations; }));
        row.uploaded_bytes = mean(of_frames(flown, [](const FlownFrame& f) { return f.uploaded_bytes; }));
        row.acmr = mean(acmr);
        row.volume = volume_of(flown);
        return {};
    }

    // Of flights whose every frame has volumes.
    static std::optional<Row::Volume> volume_of(const std::vector<FlownFrame>& flown) {
        if (!std::ranges::all_of(flown, [](const FlownFrame& f) { return f.volume.has_value(); })) return std::nullopt;
        const auto mean_of = [&](auto figure) {
            return mean(of_frames(flown, [&](const FlownFrame& f) { return (*f.volume).*figure; }));
        };
        Row::Volume v;
        v.bin_ms = mean_of(&VolumeFigures::bin_ms);
        v.fill_ms = mean_of(&VolumeFigures::fill_ms);
        v.light_ms = mean_of(&VolumeFigures::light_ms);
        v.march_ms = mean_of(&VolumeFigures::march_ms);
        v.composite_ms = mean_of(&VolumeFigures::composite_ms);
        v.bricks = mean_of(&VolumeFigures::bricks);
        for (const FlownFrame& f : flown) v.bytes = std::max(v.bytes, f.volume->bytes);
        return v;
    }

    // keep: the pictures go into the report, with the row that is added next.
    Result<void> measure_quality(Row& row, bool keep) {
        row.compared = !references_.empty();
        if (!row.compared) return {};
        const Technique& way = row;
        const Budget budget = budget_of(row);
        if (auto done = renderer_.resize(width_, height_); !done) return done;
        auto session = DrawSession::open(scene_, renderer_, way, true, progress_);
        if (!session) return tl::unexpected(session.error());
        std::vector<double> psnrs, ssims, acmrs;
        for (size_t i = 0; i < references_.size(); ++i) {
            progress_.at(name_of(way) + " quality", static_cast<double>(i) / static_cast<double>(references_.size()));
            const Reference& reference = references_[i];
            if (auto drawn = (*session)->settle(reference.camera, budget, width_, height_); !drawn)
                return tl::unexpected(drawn.error());
            auto picture = renderer_.read_picture();
            if (!picture) return tl::unexpected(picture.error());
            if (keep) {
                if (auto done = save_compared(*picture, reference, row, static_cast<uint32_t>(i)); !done) return done;
            }
            const auto mask = covered_union(*picture, reference.supersampled);
            psnrs.push_back(psnr_db(*picture, reference.supersampled, mask));
            ssims.push_back(ssim(*picture, reference.supersampled, mask));
            acmrs.push_back(simulated_acmr(*(*session)->mirror()));
            const auto surface = surface_of(drawn_corners(*(*session)->mirror(), scene_));
            const uint64_t leaks = background_leaks(*picture, reference.full, row.pixel_error);
            row.background_leaks += leaks;
            if (reference.surface == nullptr) continue;
            if (leaks > 0) {
                const auto rims = rims_of(reference.corners);
                row.cracks +=
                    cracks(*picture, reference.full, *reference.surface, rims.get(), reference.view, row.pixel_error);
            }
            if (surface == nullptr) continue;
            row.max_pixel_deviation =
                std::max(row.max_pixel_deviation,
                         max_pixel_deviation(*picture, *surface, reference.full, *reference.surface, reference.view));
        }
        row.psnr_db = mean(psnrs);
        row.ssim = mean(ssims);
        row.acmr_fifo16 = mean(acmrs);
        return {};
    }

    // Writes NAME.png, and keeps a copy for the page; returns the file's name.
    Result<std::string> save(const Picture& picture, const std::string& name, bool photograph) {
        const Image image = opaque_image(picture);
        const std::string file = name + ".png";
        if (auto done = write_png(image, std::filesystem::path(options_.out) / file); !done)
            return tl::unexpected(done.error());
        auto bytes = photograph ? encode_jpeg(image, page_quality) : encode_png(image);
        if (!bytes) return tl::unexpected(bytes.error());
        images_.push_back({file, photograph ? "image/jpeg" : "image/png", std::move(*bytes)});
        return file;
    }

    Result<void> save_compared(const Picture& picture, const Reference& reference, const Row& row, uint32_t frame) {
        char error_text[32];
        std::snprintf(error_text, sizeof error_text, "%gpx", row.pixel_error);
        const std::string name = name_of(row, '-') + "-" + error_text + "-" + std::to_string(frame);
        auto shown = save(picture, name, true);
        if (!shown) return tl::unexpected(shown.error());
        auto difference = save(difference_map(picture, reference.supersampled), name + "-difference", false);
        if (!difference) return tl::unexpected(difference.error());
        report.pictures.push_back({static_cast<uint32_t>(report.rows.size()), frame, *shown, *difference});
        return {};
    }

    const BenchArguments& options_;
    ReadyScene& scene_;
    Renderer& renderer_;
    uint32_t width_, height_;
    const Progress& progress_;
    std::vector<Reference> references_;
    std::vector<PageImage> images_;
    std::map<std::tuple<Technique, std::string, double>, double> tried_;  // by way, metric and pixel error: how bad
};

// What is compared, as asked for.
struct Compared {
    std::vector<std::string> backends, orders, rasters, volumes;
    std::vector<double> pixel_errors;
    const ErrorMetric* metric = nullptr;  // of --equal-error; null for none
};

Result<std::vector<double>> parse_pixel_errors(const std::string& text) {
    const auto words = parse_list("--pixel-error", text);
    if (!words) return tl::unexpected(words.error());
    std::vector<double> pixel_errors;
    for (const std::string& word : *words) {
        double value = 0;
        if (std::from_chars(word.data(), word.data() + word.size(), value).ptr != word.data() + word.size() ||
            !(value > 0)) {
            return fail(Fault::usage, "--pixel-error " + word + ": must be pixels above 0, separated by commas");
        }
        pixel_errors.push_back(value);
    }
    return pixel_errors;
}

Result<Compared> compared_of(const BenchArguments& o) {
    Compared compared;
    auto backends = parse_list("--backends", o.backends);
    if (!backends) return tl::unexpected(backends.error());
    compared.backends = std::move(*backends);
    for (const std::string& backend : compared.backends) {
        if (auto known = check_backend("--backends", backend); !known) return tl::unexpected(known.error());
    }
    auto pixel_errors = parse_pixel_errors(o.pixel_errors);
    if (!pixel_errors) return tl::unexpected(pixel_errors.error());
    compared.pixel_errors = std::move(*pixel_errors);
    const auto metric = std::ranges::find(error_metrics(), o.equal_error, &ErrorMetric::name);
    if (metric != error_metrics().end()) {
        compared.metric = &*metric;
        if (o.quality_frames == 0)
            return fail(Fault::usage, "--equal-error compares pictures: give --quality-frames 1 or more");
    } else if (!o.equal_error.empty()) {
        return fail(Fault::usage, "--equal-error " + o.equal_error + ": choose ssim or max_pixel_deviation");
    }
    for (const auto& [option, text, wanted] : {std::tuple("--orders", &o.orders, &compared.orders),
                                               std::tuple("--rasters", &o.rasters, &compared.rasters)}) {
        if (text->empty()) continue;
        auto words = parse_list(option, *text);
        if (!words) return tl::unexpected(words.error());
        *wanted = std::move(*words);
    }
    for (const std::string& raster : compared.rasters) {
        if (auto known = check_raster("--rasters", raster, ""); !known) return tl::unexpected(known.error());
    }
    auto volumes = parse_list("--volumes", o.stage.volumes);
    if (!volumes) return tl::unexpected(volumes.error());
    for (const std::string& way : *volumes) {
        volume::Quality none;
        if (way == "off") continue;
        if (auto known = choose_volumes("--volumes", way, none); !known) return tl::unexpected(known.error());
    }
    // One holds for reference pictures, too.
    if (volumes->size() > 1) compared.volumes = std::move(*volumes);
    return compared;
}

// The techniques of a backend that the orders and rasters asked for choose.
Result<std::vector<Technique>> chosen_techniques(const std::string& backend, const ReadyScene& scene,
                                                 const Compared& compared) {
    std::vector<Technique> techniques = techniques_of(backend, scene);
    for (const std::string& order : compared.orders) {
        if (backend != "lod" || std::ranges::find(techniques, order, &Technique::order) != techniques.end()) continue;
        return fail(Fault::usage, "--orders " + order + ": the scene's meshes are not baked with it");
    }
    // If the list names none of the backend's techniques, it is for other backends, and this one draws as usual.
    const auto is_chosen = [&](const std::vector<std::string>& wanted, std::string Technique::*what,
                               const Technique& technique) {
        const auto is_wanted = [&](const Technique& t) { return std::ranges::find(wanted, t.*what) != wanted.end(); };
        return std::ranges::any_of(techniques, is_wanted) ? is_wanted(technique)
                                                          : technique.*what == techniques.front().*what;
    };
    std::vector<Technique> chosen;
    for (Technique& technique : techniques) {
        if (!is_chosen(compared.orders, &Technique::order, technique) ||
            !is_chosen(compared.rasters, &Technique::raster, technique))
            continue;
        if (compared.volumes.empty()) chosen.push_back(technique);
        for (const std::string& volumes : compared.volumes) {
            chosen.push_back(technique);
            chosen.back().volumes = volumes;
        }
    }
    return chosen;
}

// Rows of a technique at every pixel error. A technique that the machine cannot draw has no more rows.
Result<void> measure_technique(Bench& bench, const Technique& technique, const Compared& compared, double fps,
                               const Progress& progress) {
    for (const double pixel_error : compared.pixel_errors) {
        auto done = bench.measure(technique, pixel_error);
        if (!done && done.error().fault == Fault::machine) {
            progress.warning(technique.backend + ": no row: " + done.error().message);
            break;
        }
        if (!done) return done;
        if (technique.backend == "full") break;  // it has one level
        if (fps <= 0 || pixel_error != compared.pixel_errors.front()) continue;
        if (auto steered = bench.steer(technique, fps, pixel_error); !steered) return steered;
    }
    return {};
}

// Rows of the other backends with levels that are as good as those of lod and vgi.
Result<void> measure_equal_errors(Bench& bench, const Compared& compared) {
    if (compared.metric == nullptr) return {};
    const std::vector<Row> rows = bench.report.rows;
    std::vector<Technique> ways;
    for (const Row& row : rows) {
        if (row.backend != "full" && std::ranges::find(ways, static_cast<const Technique&>(row)) == ways.end())
            ways.push_back(row);
    }
    for (const Row& like : rows) {
        if (like.backend == "full" || like.backend == "discrete") continue;
        for (const Technique& way : ways) {
            if (way.backend == like.backend || way.volumes != like.volumes) continue;
            if (auto done = bench.measure_like(way, like, *compared.metric); !done) return done;
        }
    }
    return {};
}

Result<int> bench(const BenchArguments& o) {
    const auto compared = compared_of(o);
    if (!compared) return tl::unexpected(compared.error());
    const Progress progress = terminal_progress();
    SceneNeeds needs = needs_of(compared->backends);
    note_rasters(compared->rasters, needs);
    if (o.quality_frames > 0) needs.full = Need::must;  // pictures are compared with it
    StageOptions of_stage = o.stage;
    if (!compared->volumes.empty()) of_stage.volumes = "on";
    auto stage = set_stage(of_stage, needs, progress);
    if (!stage) return tl::unexpected(stage.error());
    if (!compared->volumes.empty() && stage->scene.scene.volumes.emitters.empty())
        return fail(Fault::usage, "--volumes " + o.stage.volumes + ": the scene has no smoke or fire to compare");
    std::error_code error;
    std::filesystem::create_directories(o.out, error);
    if (error) return fail(Fault::machine, o.out + ": cannot be made: " + error.message());

    Bench bench(o, stage->scene, *stage->renderer, stage->width, stage->height, progress);
    if (auto done = bench.make_references(); !done) return tl::unexpected(done.error());
    bench.report.machine = stage->machine();
    bench.report.scene = stage->scene.scene.name;
    bench.report.size = o.stage.size;
    for (const std::string& backend : compared->backends) {
        const auto techniques = chosen_techniques(backend, stage->scene, *compared);
        if (!techniques) return tl::unexpected(techniques.error());
        for (const Technique& technique : *techniques) {
            if (auto done = measure_technique(bench, technique, *compared, o.fps, progress); !done)
                return tl::unexpected(done.error());
        }
    }
    if (auto done = measure_equal_errors(bench, *compared); !done) return tl::unexpected(done.error());
    if (auto done = bench.write(); !done) return tl::unexpected(done.error());
    end_progress();
    if (o.json) {
        print_line(json_of(bench.report).dump(2));
    } else {
        print_line(stage->device_text() + ", " + o.stage.size + ", " + std::to_string(o.frames) + " frames");
        print_line(report_table(bench.report.rows));
        print_line((std::filesystem::path(o.out) / "report.html").string());
    }
    return stage->exit_code();
}

}  // namespace

void add_bench(CLI::App& app, Run& run) {
    const auto o = std::make_shared<BenchArguments>();
    CLI::App* command = app.add_subcommand("bench", "Fly through a scene with every backend; figures side by side");
    add_stage_options(*command, o->stage);
    command->add_option("--backends", o->backends, "Backends to compare, separated by commas")->capture_default_str();
    command->add_option("--orders", o->orders,
                        "lod: face orders to draw, separated by commas; the first of the asset unless given");
    command->add_option("--rasters", o->rasters,
                        "How triangles are made, separated by commas. vgi: bintree (unless given), grid, grid-area, "
                        "tess or device; lod: geomorph (vertices move gradually)");
    command->add_option("--pixel-error", o->pixel_errors, "Largest errors on screen, in pixels, separated by commas")
        ->capture_default_str();
    command->add_option("--frames", o->frames, "Frames of each flight")
        ->check(CLI::Range(1u, 1000000u))
        ->capture_default_str();
    command
        ->add_option(
            "--quality-frames", o->quality_frames,
            "Pictures along the flight that are compared with the whole mesh; 0 for none, where the whole of a "
            "scene is too much to draw")
        ->check(CLI::Range(0u, 1000u))
        ->capture_default_str();
    command->add_option("--equal-error", o->equal_error,
                        "Also draw each other backend that is compared and has levels at the pixel error at which it "
                        "is as good as each row of lod and vgi, by this "
                        "metric: ssim or max_pixel_deviation");
    command
        ->add_option("--fps", o->fps, "Also fly with the pixel error steered, frame by frame, to hold this frame rate")
        ->check(CLI::Range(0.1, 100000.0));
    command->add_option("--rounds", o->rounds, "How often each flight is flown; times are over all rounds")
        ->check(CLI::Range(1u, 1000u))
        ->capture_default_str();
    command->add_option("-o,--out", o->out, "Folder for report.html, report.md, report.json and pictures")->required();
    command->add_flag("--json", o->json, "Print the report as JSON");
    command->footer(
        examples("lodestone bench assets/rock.scene.json --pixel-error 1,2,4 -o report\n"
                 "lodestone bench scan.lode --backends vgi --rasters bintree,grid,tess -o report\n"
                 "lodestone bench assets/cliff.scene.json --backends lod,vgi --fps 30 -o report"));
    command->callback([o, &run] { run = [o] { return bench(*o); }; });
}

}  // namespace lodestone
