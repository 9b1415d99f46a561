// The rooms of the house (docs/architecture.md): what each may include, told from the #include lines of src and apps.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <string>
#include <vector>

namespace {

namespace fs = std::filesystem;

struct Include {
    std::string file, header;  // both from src or from the project's root, as includes are written
};

// What a folder may include besides itself; folders below one that is named are meant, too. A folder that is not named
// has the rule of the one it lies in. Headers shared with shaders are everybody's.
const std::map<std::string, std::vector<std::string>> rules = {
    {"base", {}},
    {"base/files", {"base"}},
    {"base/structures", {"base"}},
    {"mesh", {"base"}},
    {"mesh/cache", {"base", "mesh"}},
    {"mesh/distance", {"base", "mesh"}},
    {"mesh/io", {"base", "mesh"}},
    {"frame", {"base"}},
    {"lod/asset", {"base", "mesh", "frame"}},
    {"lod/bake", {"base", "mesh", "lod/asset"}},
    {"lod/draw", {"base", "mesh", "frame", "lod/asset"}},
    {"vgi/asset", {"base", "mesh", "frame"}},
    {"vgi/bake/charts", {"base", "mesh", "vgi/asset"}},
    {"vgi/bake/quads", {"base", "mesh", "vgi/asset", "vgi/bake/charts"}},
    {"vgi/bake/images", {"base", "mesh", "vgi/asset", "vgi/bake/charts"}},
    {"vgi/bake", {"base", "mesh", "vgi/asset"}},
    {"vgi/unwrap", {"base", "mesh", "vgi/asset", "vgi/bake"}},
    {"vgi/extract", {"base", "mesh", "vgi/asset"}},
    {"vgi/draw", {"base", "mesh", "frame", "vgi/asset"}},
    {"vgi/study", {"base", "mesh", "frame", "vgi/asset", "vgi/draw"}},
    {"tiles", {"base", "mesh", "vgi/asset"}},
    {"tiles/check", {"base", "mesh"}},
    {"baseline", {"base", "mesh", "frame"}},
    {"light", {"base"}},
    {"volume", {"base", "frame"}},
    {"report", {"base", "mesh", "frame"}},
    {"render", {"base", "frame"}},
    {"apps/library", {"base", "mesh", "report", "apps/scene"}},
    {"apps/options", {"base", "mesh", "lod", "apps/scene"}},
    {"apps/embed", {"base", "mesh", "frame", "lod", "vgi", "apps/scene", "apps/options"}},
    {"apps/c", {"base", "mesh", "apps/embed", "apps/scene"}},
    {"apps/python",
     {"base", "mesh", "frame", "vgi/asset", "render", "apps/embed", "apps/scene", "apps/drawing", "apps"}},
    {"apps", {"base", "mesh", "frame", "lod", "vgi", "tiles", "baseline", "volume", "light", "report", "render"}},
};
// Files that may include more, with the reason.
const std::map<std::string, std::string> exceptions = {
    {"vgi/draw/vgi_source.cpp", "vgi/study"},  // the one place that knows all techniques
};

bool within(const std::string& path, const std::string& folder) { return path.starts_with(folder + "/"); }

// The most particular rule for a file.
const std::pair<const std::string, std::vector<std::string>>* rule_of(const std::string& file) {
    const std::pair<const std::string, std::vector<std::string>>* best = nullptr;
    for (const auto& rule : rules) {
        if (within(file, rule.first) && (best == nullptr || rule.first.size() > best->first.size())) best = &rule;
    }
    return best;
}

std::vector<std::string> broken(const std::vector<Include>& includes) {
    std::vector<std::string> faults;
    for (const auto& [file, header] : includes) {
        if (header.starts_with("shaders/shared/")) continue;
        const auto* rule = rule_of(file);
        if (rule == nullptr) {
            faults.push_back(file + ": lies in no room");
            continue;
        }
        const auto allowed = [&header = header](const std::string& folder) { return within(header, folder); };
        const auto exception = exceptions.find(file);
        if (allowed(rule->first) || std::ranges::any_of(rule->second, allowed) ||
            (exception != exceptions.end() && allowed(exception->second)))
            continue;
        faults.push_back(file + " includes " + header);
    }
    return faults;
}

std::vector<std::string> lines_of(const fs::path& path) {
    std::ifstream in(path);
    std::vector<std::string> lines;
    for (std::string line; std::getline(in, line);) lines.push_back(line);
    return lines;
}

// Quoted includes, of files below src named from src, of those below apps from the root.
std::vector<Include> includes_of_project() {
    const fs::path root = LODESTONE_SOURCE_DIR;
    std::vector<Include> all;
    for (const char* top : {"src", "apps"}) {
        for (const auto& entry : fs::recursive_directory_iterator(root / top)) {
            if (entry.path().extension() != ".h" && entry.path().extension() != ".cpp") continue;
            const std::string name =
                fs::relative(entry.path(), std::string(top) == "src" ? root / "src" : root).string();
            for (const std::string& line : lines_of(entry.path())) {
                if (line.starts_with("#include \"")) all.push_back({name, line.substr(10, line.find('"', 10) - 10)});
            }
        }
    }
    return all;
}

TEST(Rooms, IncludeOnlyWhatTheyMay) {
    const auto includes = includes_of_project();
    EXPECT_GT(includes.size(), 500u);
    EXPECT_THAT(broken(includes), testing::IsEmpty());
}

TEST(Rooms, BreakingARuleIsNoticed) {
    EXPECT_THAT(broken({{"vgi/asset/pages.cpp", "vgi/draw/residency.h"}}), testing::SizeIs(1));
    EXPECT_THAT(broken({{"vgi/draw/page_cache.cpp", "vgi/bake/bake.h"}}), testing::SizeIs(1));
    EXPECT_THAT(broken({{"vgi/draw/cut/frame_cuts.cpp", "vgi/study/grid_cut.h"}}), testing::SizeIs(1));
    EXPECT_THAT(broken({{"vgi/bake/charts/clusters.cpp", "vgi/bake/images/resample.h"}}), testing::SizeIs(1));
    EXPECT_THAT(broken({{"lod/draw/lod_source.cpp", "vgi/asset/atlas.h"}}), testing::SizeIs(1));
    EXPECT_THAT(broken({{"frame/view.cpp", "mesh/tri_mesh.h"}}), testing::SizeIs(1));
    EXPECT_THAT(broken({{"apps/c/cuts.cpp", "apps/drawing/session.h"}}), testing::SizeIs(1));
    EXPECT_THAT(broken({{"base/hash.cpp", "base/files/file.h"}}), testing::IsEmpty()) << "a room and its closets";
    EXPECT_THAT(broken({{"tiles/tile_mesh.cpp", "vgi/draw/residency.h"}}), testing::SizeIs(1));
    EXPECT_THAT(broken({{"attic/old.cpp", "base/hash.h"}}), testing::SizeIs(1));
}

TEST(Rooms, ExceptionsAreNeeded) {
    const auto includes = includes_of_project();
    for (const auto& exception : exceptions) {
        const auto needs_it = [&](const Include& i) {
            return i.file == exception.first && within(i.header, exception.second);
        };
        EXPECT_TRUE(std::ranges::any_of(includes, needs_it)) << exception.first << " needs no exception any more";
    }
}

// A room and a closet in it may know each other; all else is one-way.
TEST(Rooms, HaveNoCircles) {
    std::map<std::string, std::set<std::string>> knows;
    for (const auto& [file, header] : includes_of_project()) {
        const auto *from = rule_of(file), *to = rule_of(header);
        if (from == nullptr || to == nullptr || from == to || exceptions.contains(file)) continue;
        if (!within(from->first, to->first) && !within(to->first, from->first)) knows[from->first].insert(to->first);
    }
    EXPECT_TRUE(knows["vgi/draw"].contains("vgi/asset"));
    std::set<std::string> done, open;
    const auto leads_back = [&](const auto& self, const std::string& room) -> bool {
        if (done.contains(room)) return false;
        if (!open.insert(room).second) return true;
        for (const std::string& other : knows[room]) {
            if (self(self, other)) return true;
        }
        open.erase(room);
        done.insert(room);
        return false;
    };
    for (const auto& [room, unused] : rules) EXPECT_FALSE(leads_back(leads_back, room)) << room;
}

TEST(Rooms, EveryIncludedHeaderIsThere) {
    const fs::path root = LODESTONE_SOURCE_DIR;
    for (const auto& [file, header] : includes_of_project())
        EXPECT_TRUE(fs::exists(root / "src" / header) || fs::exists(root / header)) << file << " includes " << header;
}

TEST(Rooms, RenderAloneKnowsVulkanAndGlfw) {
    const fs::path root = LODESTONE_SOURCE_DIR;
    for (const char* top : {"src", "apps"}) {
        for (const auto& entry : fs::recursive_directory_iterator(root / top)) {
            const std::string name = fs::relative(entry.path(), root).string();
            if (!entry.is_regular_file() || name.starts_with("src/render/")) continue;
            for (const std::string& line : lines_of(entry.path())) {
                EXPECT_FALSE(line.starts_with("#include <vulkan/") || line.starts_with("#include <GLFW/"))
                    << name << ": " << line;
            }
        }
    }
}

TEST(Rooms, NoneHoldsMoreThanAGlanceTakesIn) {
    constexpr size_t most_files = 24;
    const fs::path root = LODESTONE_SOURCE_DIR;
    for (const char* top : {"src", "apps", "bench", "shaders", "tests"}) {
        std::map<std::string, size_t> files;
        for (const auto& entry : fs::recursive_directory_iterator(root / top)) {
            if (entry.is_regular_file()) ++files[entry.path().parent_path().string()];
        }
        for (const auto& [folder, count] : files) EXPECT_LE(count, most_files) << folder;
    }
}

// The longest function of a file laid out by clang-format: from a line to the "}" alone at the same indentation, with
// none between that is indented alike. Blocks within functions are told, too, but are shorter.
struct Extent {
    size_t lines = 0;
    std::string first;
};
Extent longest_function(const std::vector<std::string>& lines) {
    Extent longest;
    std::map<size_t, size_t> last;  // by indentation: the last line that has it
    for (size_t i = 0; i < lines.size(); ++i) {
        const size_t indentation = lines[i].find_first_not_of(' ');
        if (indentation == std::string::npos || lines[i][indentation] == '#') continue;
        const auto open = last.find(indentation);
        if (lines[i].substr(indentation) == "}" && open != last.end() && i - open->second + 1 > longest.lines)
            longest = {i - open->second + 1, lines[open->second].substr(indentation)};
        last[indentation] = i;
    }
    return longest;
}

TEST(Rooms, HaveFunctionsThatAGlanceTakesIn) {
    constexpr size_t most_lines = 50;
    const fs::path root = LODESTONE_SOURCE_DIR;
    size_t longest_of_all = 0;
    for (const char* top : {"src", "apps"}) {
        for (const auto& entry : fs::recursive_directory_iterator(root / top)) {
            if (entry.path().extension() != ".h" && entry.path().extension() != ".cpp") continue;
            const std::string name = fs::relative(entry.path(), root).string();
            const Extent longest = longest_function(lines_of(entry.path()));
            longest_of_all = std::max(longest_of_all, longest.lines);
            EXPECT_LE(longest.lines, most_lines) << name << ": " << longest.first;
        }
    }
    EXPECT_GT(longest_of_all, 30u) << "functions were not found";
}

TEST(Rooms, LongFunctionsAreNoticed) {
    const auto function = [](const std::string& indentation, size_t lines) {
        std::vector<std::string> text = {"namespace {", "", indentation + "int f(int a,",
                                         indentation + "      int b) {"};
        for (size_t i = 0; i + 3 < lines; ++i)
            text.push_back(i == 2 ? "#ifdef A" : i == 3 ? "" : indentation + "    if (a) {");
        text.insert(text.end(), {indentation + "}", "", "}  // namespace"});
        return longest_function(text);
    };
    for (const std::string indentation : {"", "    "}) {
        EXPECT_EQ(function(indentation, 51).lines, 51u);
        EXPECT_EQ(function(indentation, 51).first, "int f(int a,");
    }
    std::vector<std::string> type(60, "    int a;");
    type.insert(type.begin(), "struct S {");
    type.push_back("};");
    EXPECT_EQ(longest_function(type).lines, 0u) << "a type is no function";
}

}  // namespace
