// The program as scripts see it: run in a folder of the test's own, with a cache of its own.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

#include "fixtures/written_glbs.h"

namespace lodestone {

namespace fs = std::filesystem;
using nlohmann::json;
using testing::HasSubstr;

inline std::string content_of(const fs::path& path) {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
}

// Runs what follows in a display of its own, from the test's folder, where the file of who may use it lies: a folder
// that xvfb-run makes for it cannot always be taken away, and the exit code is 5 then.
inline constexpr const char* own_display = "xvfb-run -a -f permissions -s '-screen 0 800x600x24' ";

class ProgramTest : public testing::Test {
protected:
    struct Ended {
        int code;
        std::string out, err;
    };
    void SetUp() override {
        folder_ = fs::temp_directory_path() / ("lodestone_program_" + std::to_string(getpid()));
        fs::create_directories(folder_);
        setenv("XDG_CACHE_HOME", (folder_ / "cache").c_str(), 1);
    }
    void TearDown() override {
        written_.check();
        fs::remove_all(folder_);
    }

    // Arguments as a shell would take them, run in the test's folder, by another command where one is named. Khronos'
    // validator sees what GLBs it writes, at the end of the test.
    Ended run(const std::string& arguments, const std::string& by = "") const {
        const std::string command =
            "cd '" + folder_.string() + "' && " + by + LODESTONE_PROGRAM " " + arguments + " >out.txt 2>err.txt";
        const int status = std::system(command.c_str());
        const Ended ended{WIFEXITED(status) ? WEXITSTATUS(status) : -1, content_of(folder_ / "out.txt"),
                          content_of(folder_ / "err.txt")};
        if (ended.code == 0) keep_glbs_of(arguments);
        return ended;
    }
    // Of `-o NAME.glb`, and of `tile ... -o FOLDER`.
    void keep_glbs_of(const std::string& arguments) const {
        const size_t option = arguments.find("-o ");
        if (option == std::string::npos) return;
        const size_t begin = option + 3;
        const fs::path made = folder_ / arguments.substr(begin, arguments.find(' ', begin) - begin);
        const bool is_tileset = arguments.find("tile ") != std::string::npos && fs::is_directory(made);
        if (is_tileset || (made.extension() == ".glb" && fs::is_regular_file(made))) written_.keep(made);
    }
    void succeeds(const std::string& arguments) const {
        const Ended e = run(arguments);
        EXPECT_EQ(e.code, 0) << arguments << "\n" << e.err;
    }
    // Ends with this code and exactly one line, which says `what`.
    void fails(const std::string& arguments, int code, const std::string& what, const std::string& by = "") const {
        SCOPED_TRACE(arguments);
        const Ended e = run(arguments, by);
        EXPECT_EQ(e.code, code);
        EXPECT_EQ(std::count(e.err.begin(), e.err.end(), '\n'), 1) << e.err;
        EXPECT_THAT(e.err, HasSubstr(what));
        EXPECT_EQ(e.out, "");
    }
    json printed(const std::string& arguments) const {
        const Ended e = run(arguments);
        EXPECT_EQ(e.code, 0) << e.err;
        const json j = json::parse(e.out, nullptr, false);
        EXPECT_FALSE(j.is_discarded()) << e.out;
        return j;
    }
    void bake_rock(const std::string& options = "") const {
        succeeds("generate rock --triangles 3000 --seed 2 -o rock.ply");
        succeeds("bake rock.ply -o rock.lode --report report.json " + options);
    }
    bool has_device() const {
        succeeds("generate grid --triangles 2 -o probe.ply");
        const bool has = run("render probe.ply --backend full --size 32x32 -o probe.png").code == 0;
        // Nothing is left of it; what else is in the cache stays.
        for (const fs::path& where : {folder_, folder_ / "cache/lodestone"}) {
            std::error_code none;
            for (const auto& entry : fs::directory_iterator(where, none)) {
                if (entry.path().filename().string().starts_with("probe")) fs::remove(entry.path());
            }
        }
        return has;
    }
    fs::path folder_;
    mutable fixtures::WrittenGlbs written_;
};

}  // namespace lodestone
