// Damaged assets through `verify` and `extract`: each refuses them by one line and exit code 3, or gives the same bytes
// as of the whole asset. Through `render`: it refuses them so, or draws the same picture, or says by one line that it
// drew something coarser. LODESTONE_DAMAGED: how many of each kind of damage and asset, 100 unless given; one for
// each 200 of them is drawn, at least four.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "apps/in_process.h"
#include "apps/scene/bake.h"
#include "base/random.h"
#include "fixtures/meshes.h"
#include "vgi/asset/atlas_chunks.h"

namespace lodestone {
namespace {

namespace fs = std::filesystem;

std::string content_of(const fs::path& path) {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
}

// Where the pages of an atlas, or pieces of 4 kB as a disk knows them, lie in a file: first byte and number.
using Piece = std::pair<uint64_t, uint64_t>;

class IntegrityTest : public testing::TestWithParam<const char*> {
protected:
    void SetUp() override {
        folder_ = fs::temp_directory_path() / ("lodestone_integrity_" + std::to_string(getpid()));
        fs::create_directories(folder_);
        setenv("XDG_CACHE_HOME", (folder_ / "cache").c_str(), 1);
        BakeOptions options;
        options.backends =
            backend() == "vgi" ? std::vector<std::string>{"vgi"} : std::vector<std::string>{"lod", "discrete"};
        options.atlas.clusters.clusters = 3;
        options.atlas.cells = 64;
        BakeInput input;
        input.mesh = fixtures::repaired(Shape::rock, 600);
        input.name = "rock";
        const auto baked = bake_asset(std::move(input), options, asset_, {});
        ASSERT_TRUE(baked) << baked.error().message;
        good_ = content_of(asset_);
        ASSERT_EQ(run_in_process({"verify", asset_.string()}).code, 0);
        ASSERT_EQ(extract(asset_).code, 0);
        level_ = content_of(out());
        find_pieces();
    }
    void TearDown() override { fs::remove_all(folder_); }

    static int count() {
        const char* asked = std::getenv("LODESTONE_DAMAGED");
        return asked != nullptr ? std::atoi(asked) : 100;
    }
    static std::string backend() { return GetParam(); }
    fs::path out() const { return folder_ / "level.ply"; }
    Ran extract(const fs::path& asset) const {
        fs::remove(out());
        return run_in_process(
            {"extract", asset.string(), "--backend", backend(), "--level", "0", "-o", out().string()});
    }
    void find_pieces() {
        const auto file = ChunkFile::open(asset_);
        for (uint64_t at = 0; at + 8192 <= good_.size(); at += 4096) pieces_.emplace_back(at, 4096);
        if (backend() != "vgi") return;
        const auto atlas = vgi::AtlasFile::open(*file);
        ASSERT_TRUE(atlas);
        for (const vgi::Layer layer : {vgi::Layer::geometry, vgi::Layer::attributes}) {
            for (uint32_t chart = 0; chart < atlas->about().charts(); ++chart) {
                const vgi::PageTree tree = vgi::tree_of(atlas->about(), layer, chart);
                for (uint32_t f = 0; f < tree.families(); ++f) {
                    const auto place = atlas->place(layer, chart, tree.member(f, 0));
                    const auto chunk = std::ranges::find(file->chunks(), place.chunk, &ChunkInfo::name);
                    pages_.emplace_back(chunk->offset + place.offset, place.bytes);
                }
            }
        }
    }

    struct Drawn {
        int code;
        std::string message, picture;  // picture: empty where there is none
    };
    // By the program itself: what crashes is a process of its own.
    Drawn draw(const fs::path& asset) const {
        const fs::path picture = folder_ / "picture.png", message = folder_ / "message.txt";
        fs::remove(picture);
        const int status = std::system((LODESTONE_PROGRAM " render '" + asset.string() + "' --backend " + backend() +
                                        " --size 96x72 --pixel-error 0.2 -o '" + picture.string() + "' >/dev/null 2>'" +
                                        message.string() + "'")
                                           .c_str());
        return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, content_of(message),
                fs::exists(picture) ? content_of(picture) : ""};
    }

    uint64_t below(uint64_t end) { return random_.below(static_cast<uint32_t>(end)); }

    std::string damaged(const std::string& kind) {
        std::string bad = good_;
        if (kind == "a bit flipped") {
            bad[below(bad.size())] ^= static_cast<char>(1 << below(8));
        } else if (kind == "a range zeroed") {
            const uint64_t first = below(bad.size()), count = 1 + below(std::min<uint64_t>(8192, bad.size() - first));
            std::fill_n(bad.begin() + static_cast<ptrdiff_t>(first), count, '\0');
        } else if (kind == "a bit of a page flipped") {
            const Piece page = pages_[below(pages_.size())];
            bad[page.first + below(page.second)] ^= static_cast<char>(1 << below(8));
        } else if (kind == "a tail cut") {
            bad.resize(bad.size() - 1 - below(bad.size()));
        } else {
            const auto& among = pages_.empty() || below(4) == 0 ? pieces_ : pages_;
            const Piece a = among[below(among.size())], b = among[below(among.size())];
            const uint64_t bytes = std::min(a.second, b.second);
            std::swap_ranges(bad.begin() + static_cast<ptrdiff_t>(a.first),
                             bad.begin() + static_cast<ptrdiff_t>(a.first + bytes),
                             bad.begin() + static_cast<ptrdiff_t>(b.first));
        }
        return bad;
    }

    fs::path folder_,
        asset_ = fs::temp_directory_path() / ("lodestone_integrity_" + std::to_string(getpid())) / "a.lode";
    std::string good_, level_;
    std::vector<Piece> pieces_, pages_;
    Random random_{7};
};

TEST_P(IntegrityTest, DamageIsRefusedOrHarmless) {
    const fs::path bad_path = folder_ / "bad.lode";
    for (const std::string kind : {"a bit flipped", "a range zeroed", "a tail cut", "two pages exchanged"}) {
        SCOPED_TRACE(kind);
        int refused = 0, refused_by_extract = 0, harmless = 0, same = 0;
        for (int i = 0; i < count(); ++i) {
            const std::string bad = damaged(kind);
            if (bad == good_) {
                ++same;
                continue;
            }
            std::ofstream(bad_path, std::ios::binary) << bad;
            const Ran verified = run_in_process({"verify", bad_path.string()});
            const Ran extracted = extract(bad_path);
            for (const Ran& ran : {verified, extracted}) {
                ASSERT_TRUE(ran.code == 0 || ran.code == 3) << i << ": " << ran.code << " " << ran.message;
                if (ran.code == 0) continue;
                EXPECT_THAT(ran.message, testing::HasSubstr(bad_path.string()));
                EXPECT_THAT(ran.message, testing::Not(testing::HasSubstr("\n")));
            }
            if (extracted.code == 0) {
                ASSERT_EQ(content_of(out()), level_) << i;
            } else {
                ASSERT_FALSE(fs::exists(out())) << i;
                ASSERT_EQ(verified.code, 3) << "verify lets pass what extract refuses: " << extracted.message;
            }
            refused += verified.code == 3;
            refused_by_extract += extracted.code == 3;
            harmless += verified.code == 0;
        }
        std::printf("%s, %s: %d damaged; verify refuses %d, %d are harmless; extract refuses %d; %d unchanged\n",
                    GetParam(), kind.c_str(), count() - same, refused, harmless, refused_by_extract, same);
        EXPECT_GT(refused, 0);
    }
}

TEST_P(IntegrityTest, DamageIsToldOfWhereItIsDrawn) {
    const Drawn good = draw(asset_);
    if (good.code != 0) GTEST_SKIP() << "no Vulkan device; install mesa-vulkan-drivers to run this test";
    std::vector<std::string> kinds{"a bit flipped", "a range zeroed", "a tail cut", "two pages exchanged"};
    if (!pages_.empty()) kinds.insert(kinds.end(), 4, "a bit of a page flipped");
    int refused = 0, coarser = 0, same = 0;
    const fs::path bad_path = folder_ / "bad.lode";
    for (const std::string& kind : kinds) {
        SCOPED_TRACE(kind);
        for (int i = 0; i < std::max(4, count() / 200); ++i) {
            std::ofstream(bad_path, std::ios::binary) << damaged(kind);
            const Drawn drawn = draw(bad_path);
            ASSERT_TRUE(drawn.code == 0 || drawn.code == 3) << i << ": " << drawn.code << " " << drawn.message;
            EXPECT_EQ(drawn.picture.empty(), drawn.code == 3) << i;
            if (drawn.message.empty()) {
                ASSERT_TRUE(drawn.picture == good.picture) << i;
                ++same;
                continue;
            }
            EXPECT_EQ(std::ranges::count(drawn.message, '\n'), 1) << drawn.message;
            EXPECT_THAT(drawn.message, testing::HasSubstr(bad_path.string()));
            ++(drawn.code == 3 ? refused : coarser);
        }
    }
    std::printf("%s: %d refused, %d coarser, %d drawn the same\n", GetParam(), refused, coarser, same);
    EXPECT_GT(refused, 0);
    if (!pages_.empty()) { EXPECT_GT(coarser, 0); }
}

INSTANTIATE_TEST_SUITE_P(, IntegrityTest, testing::Values("lod", "vgi"));

}  // namespace
}  // namespace lodestone
