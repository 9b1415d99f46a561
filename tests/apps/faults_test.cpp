// What may befall the program from outside: killed at any moment, a disk that is full at any write, memory that ends
// anywhere, reads that fail.
#include <map>
#include <string>

#include "apps/fault.h"
#include "apps/machine.h"
#include "base/sanitized.h"

namespace lodestone {
namespace {

TEST_F(FaultTest, ABakeKilledAnywhereLeavesNothingHalfDone) {
    succeeds("generate rock --triangles 6000 -o rock.ply");
    const std::string options = "bake rock.ply --backends lod,vgi,discrete --clusters 8 --resolution 33 -o ";
    succeeds(options + "whole.lode");
    const auto known = files();
    kill_at_moments(options + "killed.lode", [&] {
        std::set<std::string> now = files();
        if (now.erase("killed.lode") > 0) {
            EXPECT_EQ(content_of(folder_ / "killed.lode"), content_of(folder_ / "whole.lode"));
            fs::remove(folder_ / "killed.lode");
        }
        EXPECT_EQ(now, known);
    });
}

TEST_F(FaultTest, ACacheWhoseWriterIsKilledAnywhereIsFilledByTheNext) {
    succeeds("generate rock --triangles 6000 -o rock.ply");
    const std::string draw = "render rock.ply --backend lod --order keyframe --size 96x64 -o a.png";
    if (run(draw).code != 0) GTEST_SKIP() << "no Vulkan driver";
    const std::string picture = content_of(folder_ / "a.png");
    const auto known = files();
    fs::remove_all(folder_ / "cache");
    kill_at_moments(draw, [&] {
        // Whatever it left, the next draws the same, and leaves what a first one leaves.
        succeeds(draw);
        EXPECT_EQ(content_of(folder_ / "a.png"), picture);
        EXPECT_EQ(files(), known);
        fs::remove_all(folder_ / "cache");
        fs::remove(folder_ / "a.png");
    });
}

TEST_F(FaultTest, AFullDiskIsOneLineAndLeavesNothing) {
    succeeds("generate rock --triangles 3000 -o rock.ply");
    succeeds("bake rock.ply --backends lod,vgi,discrete --clusters 4 --resolution 33 -o whole.lode");
    const bool has_driver = has_device();
    const auto known = files();
    struct Written {
        const char *command, *out;
        const char* first;  // what is written first
        bool draws = false;
    };
    const std::string cached = (folder_ / "cache").string() + "/lodestone/rock-";
    for (const auto& [command, out, first, draws] :
         {Written{"bake rock.ply --backends lod,vgi,discrete --clusters 4 --resolution 33 -o ", "x.lode", "x.lode"},
          {"generate terrain --triangles 9000 -o ", "x.ply", "x.ply"},
          {"extract whole.lode --backend lod --level 0 -o ", "x.glb", "x.glb"},
          {"extract whole.lode --backend lod --level 0 -o ", "x.obj", "x.obj"},
          {"unwrap rock.ply -o ", "x.glb", "x.glb"},
          {"tile rock.ply -o ", "tiles", cached.c_str()},
          {"render whole.lode --backend lod --debug triangle --size 640x480 -o ", "x.png", "x.png", true},
          {"render rock.ply --backend discrete --size 96x64 -o ", "x.png", cached.c_str(), true}}) {
        if (draws && !has_driver) continue;
        int refused = 0;
        // No file may be larger than so many blocks of 512 bytes: where the next write ends there, it fails.
        for (int blocks = 4;; blocks = blocks * 7 / 4) {
            SCOPED_TRACE(std::string(out) + " in " + std::to_string(blocks) + " blocks");
            const Ended e =
                run(std::string("-q ") + command + out, "trap '' XFSZ; ulimit -f " + std::to_string(blocks) + "; ");
            if (e.code == 0) break;
            ++refused;
            EXPECT_EQ(e.code, 4);
            EXPECT_EQ(std::count(e.err.begin(), e.err.end(), '\n'), 1) << e.err;
            EXPECT_THAT(e.err, HasSubstr(first));
            ASSERT_EQ(files(), known);
        }
        EXPECT_GT(refused, 3) << out;
        fs::remove_all(folder_ / out);
        fs::remove_all(folder_ / "cache/lodestone");
    }
}

#if !LODE_SANITIZED  // which take terabytes of addresses
TEST_F(FaultTest, MemoryThatEndsAnywhereIsOneLineAndLeavesNothing) {
    succeeds("generate rock --triangles 20000 -o rock.ply");
    for (const char* large : {"large.ply", "large.obj", "large.glb"})
        succeeds("generate rock --triangles 200000 -o " + std::string(large));
    ASSERT_EQ(std::system(("gzip -1 -k '" + (folder_ / "large.ply").string() + "'").c_str()), 0);
    const auto known = files();
    const auto within = [](uint64_t kib) { return "ulimit -v " + std::to_string(kib) + "; "; };
    // What the program needs to begin at all.
    uint64_t begin = 8 << 10;
    while (run("--version", within(begin)).code != 0) begin = begin * 11 / 10;
    // Readers: the mesh itself is what an asset of full holds.
    struct Bake {
        const char* arguments;
        uint64_t step_kib;  // 0: a share of what there is
    };
    for (const auto& [arguments, step_kib] : {Bake{"rock.ply --backends lod,vgi --clusters 8 --resolution 33", 0},
                                              {"large.ply --backends full", 3 << 10},
                                              {"large.ply.gz --backends full", 3 << 10},
                                              {"large.obj --backends full", 3 << 10},
                                              {"large.glb --backends full", 3 << 10}}) {
        int refused = 0;
        for (uint64_t kib = begin;; kib += step_kib > 0 ? step_kib : kib * 2 / (5 + static_cast<uint64_t>(moments()))) {
            SCOPED_TRACE(std::string(arguments) + " in " + std::to_string(kib) + " KiB");
            const Ended e = run("-q bake " + std::string(arguments) + " --threads 2 -o x.lode", within(kib));
            if (e.code == 0) break;
            ++refused;
            EXPECT_EQ(e.code, 4);
            EXPECT_EQ(std::count(e.err.begin(), e.err.end(), '\n'), 1) << e.err;
            ASSERT_EQ(files(), known);
        }
        EXPECT_GT(refused, 3) << arguments;
        fs::remove(folder_ / "x.lode");
    }
}
#endif

#if !LODE_SANITIZED  // which bring an allocation of their own
// One allocation fails, whichever it is, and those after it do not.
class AllocationTest : public FaultTest {
protected:
    static std::string failing(int64_t at) {
        return "env LD_PRELOAD=" LODESTONE_FAIL_SYSTEM " LODESTONE_FAIL_MALLOC=" + std::to_string(at) + " timeout 300 ";
    }
    // Of outputs, whose names begin with made.
    std::map<std::string, std::string> made() const {
        std::map<std::string, std::string> all;
        for (const std::string& name : files()) {
            if (name.starts_with("made")) all[name] = content_of(folder_ / name);
        }
        return all;
    }
    void forget() const {
        for (const char* name : {"made", "made.glb", "made.obj", "made.png", "made.lode", "cache/lodestone"})
            fs::remove_all(folder_ / name);
    }
    // From the first allocation on that is main()'s. same: what is made is the same each time.
    void fail_each_of(const std::string& command, int64_t begin, bool same) {
        succeeds(command);
        const auto whole = made();
        int failed = 0, passed = 0;
        for (int64_t at = begin; passed < 3; at += at / (2 + moments() / 4)) {
            SCOPED_TRACE(command + ", " + std::to_string(at));
            forget();
            const Ended e = run(command, failing(at));
            passed = e.code == 0 ? passed + 1 : 0;
            failed += e.code != 0;
            if (e.code != 0) {
                ASSERT_EQ(e.code, 4) << e.err;
                EXPECT_EQ(std::count(e.err.begin(), e.err.end(), '\n'), 1) << e.err;
                EXPECT_THAT(e.err, HasSubstr("out of memory"));
                EXPECT_TRUE(!same || made().empty());
            } else if (same && e.err.empty()) {
                // What could not be had was done without.
                EXPECT_TRUE(made() == whole);
            }
        }
        EXPECT_GT(failed, 3) << command;
        forget();
    }
};

TEST_F(AllocationTest, AnyOneMayFail) {
    succeeds("generate rock --triangles 3000 -o rock.ply");
    succeeds("bake rock.ply --backends lod,vgi,discrete --clusters 4 --resolution 33 -o whole.lode");
    // Those before main() are the end.
    int64_t begin = 500;
    for (int code = 0; code != 4; begin = begin * 21 / 20) {
        code = run("--version", failing(begin)).code;
        ASSERT_NE(code, 0) << "no allocation of main() was met";
    }
    for (const char* command : {"verify whole.lode --json", "unwrap rock.ply -o made.obj",
                                "bake rock.ply --backends lod,vgi --clusters 4 --resolution 33 -o made.lode",
                                "extract whole.lode --backend vgi --level 1 -o made.glb", "tile rock.ply -o made"})
        fail_each_of(command, begin, true);
    if (!has_device()) GTEST_SKIP() << "no Vulkan device; install mesa-vulkan-drivers to run this test";
    fail_each_of("render whole.lode --backend vgi --size 96x64 -o made.png", begin, true);
    fail_each_of("bench whole.lode --backends lod,vgi --frames 3 --quality-frames 0 --size 96x64 -o made", begin,
                 false);
}
#endif

// What cannot fit is refused before it is read; a file of zeros that has no blocks on the disk stands for it.
TEST_F(FaultTest, AMeshThatDoesNotFitIntoMemoryIsRefusedBeforeItIsRead) {
    constexpr uint32_t triangles = 1'400'000'000;
    if (available_memory() > uint64_t{100} << 30) GTEST_SKIP() << "more than 100 GiB of memory are free";
    {
        std::ofstream scan(folder_ / "scan.stl", std::ios::binary);
        scan << std::string(80, ' ') << std::string(reinterpret_cast<const char*>(&triangles), sizeof triangles);
    }
    std::error_code error;
    fs::resize_file(folder_ / "scan.stl", 84 + uint64_t{50} * triangles, error);
    if (error) GTEST_SKIP() << "no file of 70 GB can be made here: " << error.message();
    const auto begin = Clock::now();
    for (const char* backend : {"lod", "discrete", "vgi"})
        fails(std::string("bake scan.stl -o scan.lode --backends ") + backend, 4,
              "scan.stl: 1400000000 triangles take at least");
    EXPECT_LT(Clock::now() - begin, std::chrono::seconds(20)) << "to read it takes minutes";
    EXPECT_EQ(files(), std::set<std::string>{"scan.stl"});
}

#if !LODE_SANITIZED  // which bring an allocation of their own, and want to be loaded first
// A disk that cannot be read here and there, or that takes its time, is no end and no other picture.
TEST_F(FaultTest, ReadsThatFailOrStallAreToldOf) {
    succeeds("generate rock --triangles 20000 -o rock.ply");
    succeeds("bake rock.ply --backends vgi --clusters 8 -o rock.lode");
    const std::string failing = "LD_PRELOAD=" LODESTONE_FAIL_SYSTEM " LODESTONE_FAIL_READS=/rock.lode ";
    const auto known = files();
    int refused = 0;
    for (int read = 1;; read = read * 5 / 4 + 1) {
        SCOPED_TRACE(read);
        const Ended e = run("-q extract rock.lode --backend vgi --level 1 -o x.ply",
                            "env " + failing + "LODESTONE_FAIL_FROM=" + std::to_string(read) + " ");
        if (e.code == 0) break;
        ++refused;
        EXPECT_EQ(e.code, 4);
        EXPECT_EQ(std::count(e.err.begin(), e.err.end(), '\n'), 1) << e.err;
        EXPECT_THAT(e.err, HasSubstr("rock.lode"));
        EXPECT_EQ(files(), known);
    }
    EXPECT_GT(refused, 5);
    if (!has_device()) GTEST_SKIP() << "no Vulkan device; install mesa-vulkan-drivers to run this test";
    const auto drawn = [&](const std::string& by) {
        fs::remove(folder_ / "x.png");
        return run("render rock.lode --backend vgi --size 96x64 --pixel-error 0.2 -o x.png", by);
    };
    const auto picture = [&] { return content_of(folder_ / "x.png"); };
    EXPECT_EQ(drawn("").err, "");
    const std::string whole = picture();
    const std::string always = "env " + failing + "LODESTONE_FAIL_TIMES=100000 ";
    EXPECT_EQ(drawn(always + "LODESTONE_STALL_MS=20 ").err, "");
    EXPECT_TRUE(picture() == whole);
    // From some read on nothing can be read: what is refused first, then drawn coarser, then whole.
    int coarser = 0;
    for (int read = 1;; read = read * 5 / 4 + 1) {
        SCOPED_TRACE(read);
        const Ended e = drawn(always + "LODESTONE_FAIL_FROM=" + std::to_string(read) + " ");
        if (e.code == 0 && e.err.empty()) break;
        EXPECT_EQ(std::count(e.err.begin(), e.err.end(), '\n'), 1) << e.err;
        EXPECT_THAT(e.err, HasSubstr("rock.lode"));
        EXPECT_TRUE(e.code == 0 || e.code == 4) << e.code << " " << e.err;
        coarser += e.code == 0;
        EXPECT_EQ(picture().empty(), e.code != 0);
    }
    EXPECT_TRUE(picture() == whole);
    EXPECT_GT(coarser, 0);
}
#endif

}  // namespace
}  // namespace lodestone
