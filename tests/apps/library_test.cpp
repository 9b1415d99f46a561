// Many meshes at once: what is found, what is skipped, what becomes of bad ones, and of a run that is killed.
// LODESTONE_LIBRARY_KILLS sets at how many moments (8 unless set).
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <map>
#include <random>
#include <string>
#include <thread>

#include "apps/program.h"

namespace lodestone {
namespace {

const std::string quick = " --order static --error-samples 1000 ";

class LibraryTest : public ProgramTest {
protected:
    void generate(const std::string& shape, int triangles, const std::string& name) const {
        fs::create_directories((folder_ / name).parent_path());
        succeeds("generate " + shape + " --triangles " + std::to_string(triangles) + " -o '" + name + "'");
    }
    void put(const std::string& name, const std::string& content) const {
        fs::create_directories((folder_ / name).parent_path());
        std::ofstream(folder_ / name, std::ios::binary) << content;
    }
    // Six that can be baked, two of one content, and four that cannot.
    void make_scans() const {
        generate("rock", 800, "scans/rock.ply");
        generate("rock", 800, "scans/again/same.ply");
        generate("vase", 600, "scans/a b/mit Leerzeichen \xc3\xbc.obj");
        generate("torus", 500, "scans/torus.glb");
        generate("cliff", 3000, "scans/cliff.ply");
        generate("rock", 900, "scans/latin1 \xfc.ply");
        put("scans/empty.ply", "");
        put("scans/text.obj", "hello\n");
        put("scans/cut.ply", content_of(folder_ / "scans/rock.ply").substr(0, 2000));
        fs::create_symlink("nowhere.ply", folder_ / "scans/link.ply");
    }
    std::map<std::string, json> results(const std::string& out) const {
        std::map<std::string, json> all;
        std::ifstream in(folder_ / out / "results.jsonl");
        for (std::string line; std::getline(in, line);) {
            const json one = json::parse(line, nullptr, false);
            EXPECT_TRUE(one.is_object()) << line;
            EXPECT_TRUE(all.emplace(one.value("name", ""), one).second) << line;
        }
        return all;
    }
    // Content of what a library has, by place.
    std::map<std::string, std::string> assets(const std::string& out) const {
        std::map<std::string, std::string> all;
        for (const auto& entry : fs::recursive_directory_iterator(folder_ / out / "assets")) {
            if (entry.is_regular_file())
                all[fs::relative(entry.path(), folder_ / out).string()] = content_of(entry.path());
        }
        return all;
    }
    json tally(const std::string& arguments, int code = 0) const {
        const Ended e = run("library --json " + arguments);
        EXPECT_EQ(e.code, code) << arguments << "\n" << e.err;
        return json::parse(e.out, nullptr, false);
    }
    pid_t start(const std::string& arguments) const {
        const pid_t child = fork();
        if (child == 0) {
            if (chdir(folder_.c_str()) != 0) _exit(99);
            if (freopen("/dev/null", "w", stdout) == nullptr || freopen("/dev/null", "w", stderr) == nullptr) _exit(99);
            execl("/bin/sh", "sh", "-c", ("exec " LODESTONE_PROGRAM " " + arguments).c_str(),
                  static_cast<char*>(nullptr));
            _exit(98);
        }
        return child;
    }
};

TEST_F(LibraryTest, BakesWhatCanBeAndSaysWhatCannot) {
    make_scans();
    const json first = tally("scans -o lib" + quick);
    EXPECT_EQ(first, json({{"meshes", 10}, {"baked", 6}, {"there", 0}, {"refused", 4}, {"failed", 0}, {"left", 0}}));
    const auto all = results("lib");
    EXPECT_EQ(all.size(), 10u);
    EXPECT_EQ(all.at("cut.ply")["outcome"], "refused");
    EXPECT_EQ(all.at("cut.ply")["code"], 3);
    EXPECT_THAT(all.at("cut.ply")["message"].get<std::string>(), HasSubstr("the file is cut"));
    const json& vase = all.at("a b/mit Leerzeichen \xc3\xbc.obj");
    EXPECT_EQ(vase["outcome"], "baked");
    EXPECT_GE(vase["figures"]["triangles"].get<int>(), 500);
    EXPECT_EQ(all.at("latin1 \xc3\xbc.ply")["outcome"], "baked");
    EXPECT_EQ(all.at("rock.ply")["source_hash"], all.at("again/same.ply")["source_hash"]);
    // The same bytes as by hand.
    succeeds("bake 'scans/a b/mit Leerzeichen \xc3\xbc.obj' -o alone.lode" + quick);
    EXPECT_EQ(content_of(folder_ / "alone.lode"),
              content_of(folder_ / "lib/assets/a b/mit Leerzeichen \xc3\xbc.obj.lode"));
    EXPECT_TRUE(fs::exists(folder_ / "lib/thumbnails/rock.ply.png"));
    EXPECT_THAT(content_of(folder_ / "lib/index.html"), HasSubstr("mit Leerzeichen"));
}

TEST_F(LibraryTest, ASecondRunBakesWhatHasChangedAlone) {
    make_scans();
    tally("scans -o lib" + quick);
    const auto before = fs::last_write_time(folder_ / "lib/results.jsonl");
    const auto written = [&](const std::string& name) {
        return fs::last_write_time(folder_ / "lib/assets" / (name + ".lode"));
    };
    const auto cliff = written("cliff.ply");
    EXPECT_EQ(tally("scans -o lib" + quick)["there"], 6);
    EXPECT_EQ(written("cliff.ply"), cliff);
    // Its content changes; another is touched, and has the same content; one asset is lost, one source goes.
    generate("rock", 1000, "scans/rock.ply");
    fs::last_write_time(folder_ / "scans/cliff.ply", fs::file_time_type::clock::now());
    fs::remove(folder_ / "lib/assets/torus.glb.lode");
    fs::remove(folder_ / "scans/again/same.ply");
    const json second = tally("scans -o lib" + quick);
    EXPECT_EQ(second["baked"], 2);
    EXPECT_EQ(second["there"], 3);
    EXPECT_EQ(written("cliff.ply"), cliff);
    EXPECT_GT(fs::last_write_time(folder_ / "lib/results.jsonl"), before);
    // Records lost: assets tell of themselves.
    fs::remove(folder_ / "lib/results.jsonl");
    EXPECT_EQ(tally("scans -o lib" + quick)["there"], 5);
    EXPECT_EQ(tally("scans -o lib --quantise 12" + quick)["baked"], 5) << "other options";
}

TEST_F(LibraryTest, ChecksByEveryHash) {
    make_scans();
    tally("scans -o lib" + quick);
    EXPECT_EQ(run("library scans -o lib --check" + quick).code, 0);
    generate("vase", 700, "scans/new.ply");
    std::fstream asset(folder_ / "lib/assets/rock.ply.lode", std::ios::in | std::ios::out | std::ios::binary);
    asset.seekp(-3, std::ios::end);
    asset.put('\x5a');
    asset.close();
    fs::remove(folder_ / "scans/torus.glb");
    put("scans/cliff.ply", content_of(folder_ / "scans/rock.ply"));
    const Ended e = run("library scans -o lib --check" + quick);
    EXPECT_EQ(e.code, 1);
    EXPECT_THAT(e.out, HasSubstr("missing new.ply\n"));
    EXPECT_THAT(e.out, HasSubstr("stale rock.ply: "));
    EXPECT_THAT(e.out, HasSubstr("stale cliff.ply: its source has changed"));
    EXPECT_THAT(e.out, HasSubstr("foreign assets/torus.glb.lode\n"));
    EXPECT_EQ(std::count(e.out.begin(), e.out.end(), '\n'), 4) << e.out;
}

TEST_F(LibraryTest, AManifestGivesNamesAndOptions) {
    generate("rock", 800, "scans/rock.ply");
    put("scans/list.jsonl",
        "{\"path\": \"rock.ply\"}\n\n{\"path\": \"rock.ply\", \"name\": \"fine/rock\", \"options\": [\"--quantise\", "
        "\"14\", \"--error-samples\", \"2000\"]}\n");
    EXPECT_EQ(tally("scans/list.jsonl -o lib" + quick)["baked"], 2);
    succeeds("bake scans/rock.ply -o alone.lode --order static --error-samples 2000 --quantise 14");
    EXPECT_EQ(content_of(folder_ / "alone.lode"), content_of(folder_ / "lib/assets/fine/rock.lode"));
    for (const auto& [line, what] : std::map<std::string, std::string>{
             {"{\"path\": \"rock.ply\", \"name\": \"../out\"}", "below the library"},
             {"{\"name\": \"x\"}", "line 1"},
             {"{\"path\": \"rock.ply\", \"options\": [\"--no-such\"]}", "rock.ply: bake options"},
             {"{\"path\": \"rock.ply\"}\n{\"path\": \"./rock.ply\"}", "have one name"}}) {
        put("scans/list.jsonl", line + "\n");
        fails("library scans/list.jsonl -o lib2", 2, what);
    }
    fails("library nothing -o lib2", 2, "is no file");
    fails("library", 2, "give SOURCE");
}

TEST_F(LibraryTest, ShardsMakeWhatOneRunMakes) {
    make_scans();
    tally("scans -o serial" + quick);
    succeeds("library scans -o lib --plan plan --shard-meshes 3" + quick);
    const json head = json::parse(content_of(folder_ / "plan/plan.json"));
    ASSERT_EQ(head["shards"], 4);
    EXPECT_EQ(run("library --merge plan").code, 4) << "all are left";
    for (const char* shard : {"3", "0", "2"}) tally(std::string("--shard plan ") + shard);
    const Ended partly = run("library --merge plan --json");
    EXPECT_EQ(partly.code, 4);
    EXPECT_THAT(partly.err, HasSubstr("--array=1 "));
    tally("--shard plan 1");
    tally("--shard plan 1");
    put("plan/results/00002.9.jsonl", "{\"name\": \"rock.ply\", \"outco");  // cut by a kill
    EXPECT_EQ(tally("--merge plan")["baked"], 6);
    EXPECT_EQ(assets("lib"), assets("serial"));
    EXPECT_EQ(results("lib").size(), 10u);
    // What is current is planned to no shard; a link to nothing is looked at again.
    succeeds("library scans -o lib --plan next" + quick);
    EXPECT_EQ(json::parse(content_of(folder_ / "next/plan.json"))["shards"], 1);
    fails("library --shard plan 4", 2, "counted from 0");
    fails("library --merge nothing", 2, "holds no plan");
    for (const char* wrong : {R"({"out": "lib", "shards": 1e30})", R"({"out": {"bytes": [1e9]}, "shards": 1})"}) {
        put("next/plan.json", wrong);
        fails("library --merge next", 2, "holds no plan");
    }
}

TEST_F(LibraryTest, ARunKilledAtAnyMomentLosesNothing) {
    make_scans();
    tally("scans -o whole" + quick);
    const auto begin = std::chrono::steady_clock::now();
    tally("scans -o timed" + quick);
    const auto whole = std::chrono::steady_clock::now() - begin;
    const char* given = std::getenv("LODESTONE_LIBRARY_KILLS");
    const int moments = given != nullptr ? std::atoi(given) : 8;
    std::minstd_rand random(7);
    for (int k = 0; k < moments; ++k) {
        SCOPED_TRACE(k);
        const pid_t child = start("library scans -o lib" + quick);
        std::this_thread::sleep_for(whole * (random() % 1000) / 1000);
        kill(child, k % 4 == 3 ? SIGINT : SIGKILL);
        int status = 0;
        waitpid(child, &status, 0);
        if (k % 3 == 2) {
            tally("scans -o lib" + quick);
            EXPECT_EQ(assets("lib"), assets("whole"));
            EXPECT_EQ(results("lib").size(), 10u);
            if (k % 2 == 0) fs::remove_all(folder_ / "lib");
        }
    }
    tally("scans -o lib" + quick);
    EXPECT_EQ(assets("lib"), assets("whole"));
}

TEST_F(LibraryTest, ABakeThatIsKilledIsTriedAgain) {
    generate("rock", 20000, "scans/rock.ply");
    const pid_t library = start("library scans -o lib --error-samples 1000");
    // Its bake is the one child it has.
    const fs::path children = "/proc/" + std::to_string(library) + "/task/" + std::to_string(library) + "/children";
    int killed = 0;
    pid_t last = 0, bake = 0;
    while (killed < 2 && waitpid(library, nullptr, WNOHANG) == 0) {
        bake = 0;
        std::ifstream(children) >> bake;
        if (bake > 0 && bake != last) {
            last = bake;
            kill(bake, SIGKILL);
            ++killed;
        }
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    int status = 0;
    waitpid(library, &status, 0);
    EXPECT_EQ(WEXITSTATUS(status), 0);
    const json rock = results("lib").at("rock.ply");
    EXPECT_EQ(rock["outcome"], "baked");
    EXPECT_EQ(rock["tries"], 3);
}

TEST_F(LibraryTest, OneWorksInAFolderAtATime) {
    generate("rock", 20000, "scans/rock.ply");
    const pid_t first = start("library scans -o lib --error-samples 1000");
    while (!fs::exists(folder_ / "lib/thumbnails")) std::this_thread::sleep_for(std::chrono::milliseconds(5));
    fails("library scans -o lib", 4, "another lodestone works there");
    kill(first, SIGTERM);
    int status = 0;
    waitpid(first, &status, 0);
    EXPECT_EQ(WEXITSTATUS(status), 130);
}

TEST_F(LibraryTest, SweepsWhatKilledBakesHaveLeft) {
    generate("rock", 800, "scans/rock.ply");
    tally("scans -o lib" + quick);
    const fs::path part = folder_ / "lib/assets/rock.ply.lode.part-aB3dE6";
    std::ofstream(part) << "half";
    fs::last_write_time(part, fs::file_time_type::clock::now() - std::chrono::minutes(1));
    const Ended e = run("library scans -o lib" + quick);
    EXPECT_EQ(e.code, 0);
    EXPECT_THAT(e.err, HasSubstr("rock.ply.lode.part-aB3dE6: left by a killed bake"));
    EXPECT_FALSE(fs::exists(part));
}

}  // namespace
}  // namespace lodestone
