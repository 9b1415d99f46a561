// What others do meanwhile: a second program that fills the same cache, a source or an asset that is replaced while it
// is read or drawn. What comes of it is of the one or of the other, or refused; never mixed.
#include <cstdio>

#include "apps/fault.h"

namespace lodestone {
namespace {

using TogetherTest = FaultTest;

TEST_F(TogetherTest, TwoThatFillTheSameCacheBothDraw) {
    succeeds("generate rock --triangles 6000 -o rock.ply");
    const auto draw = [](const std::string& out) {
        return "exec " LODESTONE_PROGRAM " render rock.ply --backend lod --size 96x64 -o " + out;
    };
    if (exit_code(start(draw("reference.png"))) != 0) GTEST_SKIP() << "no Vulkan driver";
    const auto known = files();
    for (int round = 0; round < std::max(2, moments() / 4); ++round) {
        fs::remove_all(folder_ / "cache");
        const pid_t first = start(draw("first.png"));
        std::this_thread::sleep_for(std::chrono::milliseconds(40 * round));
        const pid_t second = start(draw("second.png"));
        EXPECT_EQ(exit_code(first), 0);
        EXPECT_EQ(exit_code(second), 0);
        for (const char* name : {"first.png", "second.png"}) {
            EXPECT_EQ(content_of(folder_ / name), content_of(folder_ / "reference.png"));
            fs::remove(folder_ / name);
        }
        EXPECT_EQ(files(), known);
    }
}

// What is replaced while it is read: as a whole file by another, or in place, as editors and copies do it.
void replace(const fs::path& path, const std::string& content, bool in_place) {
    const fs::path written = in_place ? path : fs::path(path.string() + ".new");
    std::ofstream(written, std::ios::binary) << content;
    if (!in_place) fs::rename(written, path);
}

TEST_F(TogetherTest, ABakeWhoseSourceChangesIsOfOneOfThemOrRefused) {
    const std::string options = " --backends lod,vgi --clusters 8 --resolution 33 -o ";
    Clock::duration whole{};
    for (const auto& [name, seed] : {std::pair("first", " --seed 1"), std::pair("second", " --seed 2")}) {
        succeeds("generate rock --triangles 20000 -o rock.ply" + std::string(seed));
        fs::copy_file(folder_ / "rock.ply", folder_ / (std::string(name) + ".ply"));
        const auto begin = Clock::now();
        succeeds("bake rock.ply" + options + name + ".lode");
        whole = Clock::now() - begin;
    }
    const std::string first = content_of(folder_ / "first.ply"), second = content_of(folder_ / "second.ply");
    int of_first = 0, of_second = 0, refused = 0;
    for (int k = 0; k < moments(); ++k) {
        fs::remove(folder_ / "now.lode");
        replace(folder_ / "rock.ply", first, false);
        const pid_t child = start("exec " LODESTONE_PROGRAM " bake rock.ply" + options + "now.lode");
        // Most of the moments are while it is read.
        const double share = static_cast<double>(k) / moments();
        std::this_thread::sleep_for(whole * (share * share * share));
        replace(folder_ / "rock.ply", second, k % 2 == 1);
        const int code = exit_code(child);
        if (code == 0) {
            const std::string now = content_of(folder_ / "now.lode");
            const bool is_first = now == content_of(folder_ / "first.lode");
            ASSERT_TRUE(is_first || now == content_of(folder_ / "second.lode")) << k;
            ++(is_first ? of_first : of_second);
        } else {
            EXPECT_TRUE(code == 3 || code == 4) << k << ": " << code;
            EXPECT_FALSE(fs::exists(folder_ / "now.lode")) << k;
            ++refused;
        }
    }
    std::printf("%d of the first, %d of the second, %d refused\n", of_first, of_second, refused);
    EXPECT_GT(of_first + of_second, 0);
}

TEST_F(TogetherTest, AnAssetThatIsReplacedWhileItIsDrawnIsNotMixedWithTheNext) {
    if (!has_device()) GTEST_SKIP() << "no Vulkan device; install mesa-vulkan-drivers to run this test";
    for (const auto& [name, seed] : {std::pair("first", " --seed 1"), std::pair("second", " --seed 2")}) {
        const std::string mesh = std::string(name) + ".ply";
        succeeds("generate rock --triangles 20000 -o " + mesh + seed);
        succeeds("bake " + mesh + " --backends vgi,full --clusters 8 -o " + name + ".lode");
    }
    const auto flight = [](const std::string& asset, const std::string& report) {
        return "bench " + asset + " --backends vgi --frames 20 --quality-frames 2 --size 96x64 -o " + report;
    };
    const auto picture = [&](const std::string& report) {
        return content_of(folder_ / report / "vgi-bintree-1px-0.png");
    };
    const auto begin = Clock::now();
    succeeds(flight("first.lode", "of_first"));
    const auto whole = Clock::now() - begin;
    succeeds(flight("second.lode", "of_second"));
    ASSERT_FALSE(picture("of_first").empty() || picture("of_first") == picture("of_second"));
    for (int k = 0; k < moments(); ++k) {
        SCOPED_TRACE(k);
        const std::string report = "report" + std::to_string(k);
        replace(folder_ / "now.lode", content_of(folder_ / "first.lode"), false);
        const pid_t child = start("exec " LODESTONE_PROGRAM " " + flight("now.lode", report) + " 2>told.txt");
        std::this_thread::sleep_for(whole * k / moments());
        const bool in_place = k % 2 == 1;
        replace(folder_ / "now.lode", content_of(folder_ / "second.lode"), in_place);
        const int code = exit_code(child);
        const std::string told = content_of(folder_ / "told.txt");
        EXPECT_TRUE(code == 0 || code == 3) << code << " " << told;
        // A line for what ended it, after one, at most, for what was drawn coarser.
        const auto lines = std::count(told.begin(), told.end(), '\n');
        EXPECT_LE(lines, told.starts_with("lodestone: warning") ? 2 : 1) << told;
        // Another file by that name is not looked at; what is written into this one is noticed, or was read before.
        if (!in_place) { EXPECT_EQ(code, 0) << told; }
        if (code == 0 && (!in_place || told.empty())) {
            EXPECT_TRUE(picture(report) == picture("of_first") || picture(report) == picture("of_second")) << told;
        }
    }
}

}  // namespace
}  // namespace lodestone
