// Assets made to hurt: every hash and checksum right, the content not. Whatever is done with them ends by itself, with
// a result or an error. LODESTONE_HOSTILE: how many are tried, 150 unless given; LODESTONE_HOSTILE_SEED: of the first.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <bit>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>

#include "apps/in_process.h"
#include "apps/scene/backends.h"
#include "apps/scene/bake.h"
#include "apps/scene/page_reader.h"
#include "apps/scene/workplace.h"
#include "base/hash.h"
#include "base/random.h"
#include "base/text.h"
#include "fixtures/block_sums.h"
#include "fixtures/crafted.h"
#include "fixtures/meshes.h"
#include "frame/plan_mirror.h"
#include "lod/asset/stored_mesh.h"
#include "mesh/limits.h"

namespace lodestone {
namespace {

namespace fs = std::filesystem;
using Bytes = std::vector<std::byte>;

int from_environment(const char* name, int otherwise) {
    const char* text = std::getenv(name);
    return text != nullptr ? std::atoi(text) : otherwise;
}

class HostileTest : public testing::Test {
protected:
    static void SetUpTestSuite() {
        folder_ = fs::temp_directory_path() / ("lodestone_hostile_" + std::to_string(getpid()));
        fs::create_directories(folder_);
        good_ = folder_ / "good.lode";
        bad_ = folder_ / "bad.lode";
        BakeOptions options;
        options.backends = {"lod", "discrete", "vgi"};
        options.orders = {"keyframe", "static", "greedy", "classic"};
        options.atlas.clusters.clusters = 3;
        options.atlas.cells = 64;
        BakeInput input;
        input.mesh = fixtures::repaired(Shape::rock, 600);
        input.mesh.material_table.resize(2);
        input.mesh.materials.assign(input.mesh.wedge_count(), 1);
        input.name = "rock";
        const auto baked = bake_asset(std::move(input), options, good_, {});
        ASSERT_TRUE(baked) << baked.error().message;
        const auto file = ChunkFile::open(good_);
        for (const ChunkInfo& info : file->chunks()) {
            if (info.bytes > 0) chunks_.push_back(info.name);
            // What most of the file is, more often.
            if (info.name == "lod/blocks") chunks_.insert(chunks_.end(), 8, info.name);
        }
    }
    static void TearDownTestSuite() { fs::remove_all(folder_); }

    // A number that is likely to hurt.
    uint32_t nasty(const Bytes& around) {
        switch (random_.below(8)) {
            case 0:
                return 0;
            case 1:
                return 1;
            case 2:
                return ~0u;
            case 3:
                return 1u << 31;
            case 4:
                return (1u << 31) - 1;
            case 5:
                return std::bit_cast<uint32_t>(std::nanf(""));
            case 6:
                return std::bit_cast<uint32_t>(3e38f);
            default: {
                uint32_t other = 0;
                if (around.size() >= 4)
                    std::memcpy(&other, &around[random_.below(static_cast<uint32_t>(around.size() / 4)) * 4], 4);
                return other + random_.below(3) - 1;
            }
        }
    }

    void spoil(Bytes& bytes) {
        const auto size = static_cast<uint32_t>(bytes.size());
        switch (random_.below(6)) {
            case 0:
                bytes[random_.below(size)] ^= static_cast<std::byte>(1u << random_.below(8));
                return;
            case 1: {  // fewer, or more
                const uint32_t element = 1u << random_.below(6);
                if (random_.below(2) == 0) {
                    bytes.resize(size / element / 2 * element);
                } else {
                    bytes.insert(bytes.end(), bytes.begin(), bytes.begin() + std::min(size, element));
                }
                return;
            }
            default:
                for (uint32_t times = 1 + random_.below(3); times > 0 && size >= 4; --times) {
                    const uint32_t number = nasty(bytes);
                    std::memcpy(&bytes[random_.below(size / 4) * 4], &number, 4);
                }
        }
    }

    // A number in text becomes another, or something is left out.
    void spoil_text(Bytes& bytes) {
        std::string text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
        const size_t from = random_.below(static_cast<uint32_t>(text.size()));
        const size_t digit = text.find_first_of("0123456789", from);
        const std::array<std::string, 10> others{"0",    "-1",   "4294967295", "1e308", "99999999999999999999",
                                                 "null", "true", "[]",         "{}",    "0.5"};
        if (digit != std::string::npos && random_.below(4) > 0) {
            const size_t end = text.find_first_not_of("0123456789.eE+-", digit);
            text.replace(digit, end - digit, others[random_.below(10)]);
        } else {
            text.erase(from, 1 + random_.below(5));
        }
        bytes.assign(reinterpret_cast<const std::byte*>(text.data()),
                     reinterpret_cast<const std::byte*>(text.data() + text.size()));
    }

    // Pages whose checksums are right for what they are now.
    void with_right_sums(const std::string& layer, const Bytes& pages) {
        const Bytes raw = fixtures::chunk_of(good_, "vgi/" + layer + "_ends");
        std::vector<uint64_t> ends(raw.size() / 8);
        std::memcpy(ends.data(), raw.data(), raw.size());
        std::vector<uint32_t> sums;
        uint64_t before = 0;
        for (const uint64_t end : ends) {
            sums.push_back(checksum(std::span(pages).subspan(before, end - before)));
            before = end;
        }
        fixtures::replace_chunk(bad_, "vgi/" + layer + "_sums", std::as_bytes(std::span(sums)), bad_);
    }

    // Blocks of a progressive mesh, likewise; as far as they go.
    void with_right_block_sums(const Bytes& blocks) {
        const auto table = fixtures::with_right_sums(fixtures::chunk_of(good_, "lod/table"), blocks);
        fixtures::replace_chunk(bad_, "lod/table", std::as_bytes(std::span(table)), bad_);
    }

    // Makes bad_ from good_; what was spoilt.
    std::string craft() {
        const std::string chunk = chunks_[random_.below(static_cast<uint32_t>(chunks_.size()))];
        Bytes bytes = fixtures::chunk_of(good_, chunk);
        const bool pages = chunk.ends_with("_pages"), blocks = chunk == "lod/blocks";
        if (pages || blocks) {
            for (uint32_t times = 1 + random_.below(4); times > 0; --times)
                bytes[random_.below(static_cast<uint32_t>(bytes.size()))] = static_cast<std::byte>(random_.below(256));
        } else if (chunk.ends_with("about") || chunk == "lod/mesh" || chunk == "vgi/atlas" ||
                   chunk == "mesh/materials") {
            spoil_text(bytes);
        } else {
            spoil(bytes);
        }
        fixtures::replace_chunk(good_, chunk, bytes, bad_);
        if (pages) with_right_sums(chunk.substr(4, chunk.size() - 10), bytes);
        if (blocks) with_right_block_sums(bytes);
        return chunk;
    }

    // Draws it by every technique of a backend; errors are as good as pictures.
    void draw(const std::string& backend) {
        auto scene = read_scene(bad_);
        ASSERT_TRUE(scene);
        scene->budget.resident_bytes = uint64_t{4} << 20;
        auto ready = ready_scene(std::move(*scene), needs_of({backend}), {});
        if (!ready) return;
        for (const Technique& way : techniques_of(backend, *ready)) {
            SCOPED_TRACE(way.backend + " " + way.order + " " + way.raster);
            auto source = open_backend(way, *ready, {});
            if (source) fly(*ready, **source, way);
        }
    }

    void fly(const ReadyScene& ready, FrameSource& source, const Technique& way) {
        PlanMirror mirror(source.recipe(), puller_of(way.backend));
        PageReader reader([&] {
            std::vector<ChunkFile> files;
            for (const Asset& asset : ready.assets) files.push_back(asset.file);
            return files;
        }());
        for (uint64_t frame = 0; frame < 8; ++frame) {
            FrameInput input;
            Camera camera = ready.camera.at(0.12 * static_cast<double>(frame));
            if (!(camera.near_plane > 0) || !(camera.far_plane > camera.near_plane)) return;
            input.views = {view_of(camera, 160, 90)};
            input.instances = ready.instances;
            input.frame = frame;
            input.completed_frame = frame > 1 ? frame - 1 : 0;
            if (frame == 5) input.budget.forced_level = 0;
            if (frame == 6) input.budget.pixel_error = 20;
            reader.wait();
            input.arrivals = reader.arrivals();
            const Plan plan = source.plan(input);
            reader.request(plan.requests);
            // The mirror refuses what would be read from outside of buffers; a device reads zeros there.
            if (!mirror.execute(plan, input)) return;
        }
    }

    void use() {
        const std::string path = bad_.string(), out = (folder_ / "out.ply").string();
        for (const auto& arguments : {std::vector<std::string>{"verify", path},
                                      {"info", path},
                                      {"info", path, "--json"},
                                      {"extract", path, "--backend", "lod", "--level", "0", "-o", out},
                                      {"extract", path, "--backend", "lod", "--triangles", "100", "-o", out},
                                      {"extract", path, "--backend", "vgi", "--level", "1", "-o", out}}) {
            const Ran ran = run_in_process(arguments);
            if (ran.message.empty()) continue;
            ++errors_[ran.message.substr(ran.message.find(": ") + 2)];
            EXPECT_TRUE(ran.code >= 1 && ran.code <= 4) << ran.code;
            EXPECT_THAT(ran.message, testing::Not(testing::HasSubstr("\n")));
        }
        for (const std::string& backend : backend_names()) draw(backend);
    }

    static fs::path folder_, good_, bad_;
    static std::vector<std::string> chunks_;
    Random random_{0};
    std::map<std::string, int> errors_;  // how often each was told
};
fs::path HostileTest::folder_, HostileTest::good_, HostileTest::bad_;
std::vector<std::string> HostileTest::chunks_;

TEST_F(HostileTest, WhateverAnAssetHoldsIsDrawnOrRefused) {
    const int count = from_environment("LODESTONE_HOSTILE", 150), first = from_environment("LODESTONE_HOSTILE_SEED", 0);
    for (int seed = first; seed < first + count; ++seed) {
        random_ = Random(static_cast<uint64_t>(seed));
        const std::string what = craft();
        SCOPED_TRACE("seed " + std::to_string(seed) + ", " + what);
        if (std::getenv("LODESTONE_HOSTILE_SEED") != nullptr) std::fprintf(stderr, "%d %s\n", seed, what.c_str());
        use();
        if (HasFailure()) return;
    }
    EXPECT_GT(errors_.size(), 10u) << "hardly anything was found wrong";
}

TEST_F(HostileTest, WordsNestedDeeplyAreRefused) {
    const std::string about =
        "{\"name\":\"x\",\"input\":{},\"bounds\":[0,0,0,1],\"options\":" + std::string(200000, '[') +
        std::string(200000, ']') + "}";
    fixtures::replace_chunk(good_, "about", std::as_bytes(std::span(about)), bad_);
    const Ran ran = run_in_process({"info", bad_.string()});
    EXPECT_EQ(ran.code, 3);
    EXPECT_THAT(ran.message, testing::HasSubstr("about"));
}

// Found by fuzz_scene: what a scene says that it is, is a list.
TEST_F(HostileTest, WhatAFileIsIsToldByAWord) {
    const std::filesystem::path path = folder_ / "list.scene.json";
    std::ofstream(path) << R"({"lodestone": [{"asset": "vase"}], "version": 1})";
    const auto scene = read_scene(path);
    ASSERT_FALSE(scene);
    EXPECT_EQ(scene.error().fault, Fault::format);
    EXPECT_THAT(scene.error().message, testing::HasSubstr("list.scene.json: lodestone must be \"scene\""));
}

// Found by fuzz_scene: a member that is not known has a line end in its name.
TEST_F(HostileTest, WhatIsWrongWithASceneIsOneLine) {
    const std::filesystem::path path = folder_ / "lines.json";
    const auto check = [&](const auto& read, const char* text) {
        std::ofstream(path) << text;
        const auto result = read(path);
        ASSERT_FALSE(result) << text;
        EXPECT_EQ(result.error().fault, Fault::format);
        EXPECT_EQ(result.error().message, printable(result.error().message));
        EXPECT_THAT(result.error().message, testing::HasSubstr("a\\x0ab"));
    };
    const auto scene = [](const std::filesystem::path& from) { return read_scene(from); };
    check(scene, R"({"lodestone": "scene", "version": 1, "a\nb": 1})");
    check(scene, R"({"lodestone": "scene", "version": 1, "assets": [{"name": "a", "a\nb": 1}]})");
    check(read_camera_path, R"({"lodestone": "camera-path", "version": 1, "a\nb": 1})");
}

// A file without blocks: it takes no room on the disk, and may take none in memory.
TEST_F(HostileTest, ScenesAndCameraPathsOverTheLimitAreNotRead) {
    const std::filesystem::path path = folder_ / "long.json";
    std::ofstream(path) << "{";
    std::filesystem::resize_file(path, Limits{}.scene_bytes + 1);
    const auto check = [&](const auto& result) {
        ASSERT_FALSE(result);
        EXPECT_EQ(result.error().fault, Fault::format);
        EXPECT_EQ(result.error().message,
                  path.string() + ": has 1073741825 bytes; the limit is 1073741824; cut it into pieces");
    };
    check(read_scene(path));
    check(read_camera_path(path));
}

// The source lies beside it, and whether that may name files elsewhere is not told by yes or no.
TEST_F(HostileTest, OptionsOfAnotherKindCountForNone) {
    const std::string about =
        R"({"name": "x.ply", "input": {}, "bounds": [0, 0, 0, 1], "options": {"allow_outside": "yes"}})";
    fixtures::replace_chunk(good_, "about", std::as_bytes(std::span(about)), bad_);
    std::ofstream(folder_ / "x.ply") << "ply";
    auto scene = read_scene(bad_);
    ASSERT_TRUE(scene);
    const auto ready = ready_scene(std::move(*scene), needs_of({"lod"}), {});
    EXPECT_TRUE(ready) << ready.error().message;
}

}  // namespace
}  // namespace lodestone
