// What may befall the program from outside: killed at any moment, a disk that is full at any write, memory that ends
// anywhere, another that fills the same cache. LODESTONE_FAULTS sets how many moments are tried (8 unless set).
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <functional>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "apps/machine.h"
#include "apps/program.h"
#include "base/sanitized.h"

namespace lodestone {
namespace {

using Clock = std::chrono::steady_clock;

int moments() {
    const char* given = std::getenv("LODESTONE_FAULTS");
    return given != nullptr ? std::atoi(given) : 8;
}

class FaultTest : public ProgramTest {
protected:
    // A shell line in the test's folder, as a process of its own.
    pid_t start(const std::string& line) const {
        const pid_t child = fork();
        if (child == 0) {
            if (chdir(folder_.c_str()) != 0) _exit(99);
            if (freopen("/dev/null", "w", stdout) == nullptr || freopen("/dev/null", "w", stderr) == nullptr) _exit(99);
            execl("/bin/sh", "sh", "-c", line.c_str(), static_cast<char*>(nullptr));
            _exit(98);
        }
        return child;
    }
    static int exit_code(pid_t child) {
        int status = 0;
        waitpid(child, &status, 0);
        return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
    }
    std::set<std::string> files() const {
        std::set<std::string> found;
        for (const auto& entry : fs::recursive_directory_iterator(folder_)) {
            const std::string name = fs::relative(entry.path(), folder_).string();
            if (entry.is_regular_file() && name != "out.txt" && name != "err.txt") found.insert(name);
        }
        return found;
    }
    // Runs it once to its end for the time that it takes, then kills it at moments spread over that time.
    void kill_at_moments(const std::string& arguments, const std::function<void()>& after) {
        const auto begin = Clock::now();
        succeeds(arguments);
        const auto whole = Clock::now() - begin;
        for (int k = 0; k < moments(); ++k) {
            after();
            const pid_t child = start("exec " LODESTONE_PROGRAM " " + arguments);
            std::this_thread::sleep_for(whole * (2 * k + 1) / (2 * moments()));
            kill(child, SIGKILL);
            int status = 0;
            waitpid(child, &status, 0);
        }
        after();
    }
};

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
    const auto known = files();
    for (const auto& [command, out] :
         {std::pair("bake rock.ply --backends lod,vgi,discrete --clusters 4 --resolution 33 -o ", "x.lode"),
          std::pair("generate terrain --triangles 9000 -o ", "x.ply"),
          std::pair("extract whole.lode --backend lod --level 0 -o ", "x.glb"),
          std::pair("extract whole.lode --backend lod --level 0 -o ", "x.obj")}) {
        int refused = 0;
        // No file may be larger than so many blocks of 512 bytes: where the next write ends there, it fails.
        for (int blocks = 4;; blocks = blocks * 3 / 2) {
            SCOPED_TRACE(std::string(out) + " in " + std::to_string(blocks) + " blocks");
            const Ended e =
                run(std::string("-q ") + command + out, "trap '' XFSZ; ulimit -f " + std::to_string(blocks) + "; ");
            if (e.code == 0) break;
            ++refused;
            EXPECT_EQ(e.code, 4);
            EXPECT_EQ(std::count(e.err.begin(), e.err.end(), '\n'), 1) << e.err;
            EXPECT_THAT(e.err, HasSubstr(out));
            ASSERT_EQ(files(), known);
        }
        EXPECT_GT(refused, 3) << out;
        fs::remove(folder_ / out);
    }
}

#if !LODE_SANITIZED  // which take terabytes of addresses
TEST_F(FaultTest, MemoryThatEndsAnywhereIsOneLineAndLeavesNothing) {
    succeeds("generate rock --triangles 20000 -o rock.ply");
    const auto known = files();
    const auto within = [](uint64_t kib) { return "ulimit -v " + std::to_string(kib) + "; "; };
    // What the program needs to begin at all.
    uint64_t kib = 8 << 10;
    while (run("--version", within(kib)).code != 0) kib = kib * 11 / 10;
    int refused = 0;
    for (;; kib += kib * 2 / (5 + static_cast<uint64_t>(moments()))) {
        SCOPED_TRACE(std::to_string(kib) + " KiB");
        const Ended e =
            run("-q bake rock.ply --backends lod,vgi --clusters 8 --resolution 33 --threads 2 -o x.lode", within(kib));
        if (e.code == 0) break;
        ++refused;
        EXPECT_EQ(e.code, 4);
        EXPECT_EQ(std::count(e.err.begin(), e.err.end(), '\n'), 1) << e.err;
        ASSERT_EQ(files(), known);
    }
    EXPECT_GT(refused, 3);
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

TEST_F(FaultTest, TwoThatFillTheSameCacheBothDraw) {
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

}  // namespace
}  // namespace lodestone
