#include <sys/sysinfo.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <map>
#include <thread>

#include "apps/commands/commands.h"
#include "apps/library/library.h"
#include "apps/library/plan.h"
#include "apps/machine.h"
#include "apps/options/bake_options.h"
#include "apps/options/common_options.h"
#include "apps/terminal.h"
#include "base/json.h"
#include "base/process/process.h"

namespace lodestone {

namespace {

namespace fs = std::filesystem;

struct LibraryArguments {
    std::vector<std::string> sources;
    std::string out, plan, shard_of, merge, tmp;
    std::vector<std::string> shard;  // folder and number
    uint64_t memory_mib = 0;         // 0: three quarters of what is free
    unsigned jobs = 0;               // 0: one per core
    bool check = false, resume = false, json = false;
    PlanOptions planning;
    BakeWords bake;
    CLI::App* command = nullptr;
    std::vector<CLI::Option*> bake_options;
};

// Bake options as they were given, by name, so that those of a mesh take the place of those of all.
using Given = std::map<std::string, std::vector<std::string>>;

Given given_of(const std::vector<CLI::Option*>& options) {
    Given given;
    for (const CLI::Option* option : options) {
        if (option->count() == 0) continue;
        const bool flag = option->get_expected_min() == 0;
        given["--" + option->get_lnames().at(0)] = flag ? std::vector<std::string>() : option->results();
    }
    return given;
}

std::vector<std::string> words_of(const Given& given) {
    std::vector<std::string> words;
    for (const auto& [name, values] : given) {
        words.push_back(name);
        words.insert(words.end(), values.begin(), values.end());
    }
    return words;
}

// Recipes by what a mesh asks for besides what all have.
class RecipeBook {
public:
    explicit RecipeBook(std::vector<std::string> common) : common_(std::move(common)) {}

    Result<const BakeRecipe*> operator()(const std::vector<std::string>& own) {
        const auto known = recipes_.find(own);
        if (known != recipes_.end()) return &known->second;
        auto all = parsed(common_);
        if (!all) return tl::unexpected(all.error());
        auto more = parsed(own);
        if (!more) return tl::unexpected(more.error());
        for (auto& [name, values] : more->given) all->given[name] = values;
        auto both = parsed(words_of(all->given));
        if (!both) return tl::unexpected(both.error());
        BakeRecipe recipe;
        recipe.hash = recipe_hash(both->options);
        recipe.words = words_of(both->given);
        const BakeOptions& options = both->options;
        recipe.error_samples = options.error_samples;
        recipe.parts = options.backends;
        if (std::ranges::count(options.backends, "lod") > 0)
            recipe.parts.insert(recipe.parts.end(), options.orders.begin(), options.orders.end());
        recipe.read = both->options.read;
        return &recipes_.emplace(own, std::move(recipe)).first->second;
    }

private:
    struct Parsed {
        Given given;
        BakeOptions options;
    };
    static Result<Parsed> parsed(std::vector<std::string> words) {
        CLI::App app;
        BakeWords into;
        add_bake_options(app, into);
        std::reverse(words.begin(), words.end());
        try {
            app.parse(words);
        } catch (const CLI::ParseError& error) {
            return fail(Fault::usage, std::string("bake options: ") + error.what());
        }
        std::vector<CLI::Option*> options = app.get_options();
        std::erase_if(options, [](const CLI::Option* o) { return o->get_lnames().empty() || o->count() == 0; });
        auto asked = bake_options_of(into);
        if (!asked) return tl::unexpected(asked.error());
        return Parsed{given_of(options), std::move(*asked)};
    }

    std::vector<std::string> common_;
    std::map<std::vector<std::string>, BakeRecipe> recipes_;
};

Result<Crew> crew_of(const LibraryArguments& given) {
    Crew crew;
    auto program = this_program();
    if (!program) return tl::unexpected(program.error());
    crew.program = std::move(*program);
    crew.cores = given.jobs > 0 ? given.jobs : std::max(1u, std::thread::hardware_concurrency());
    crew.memory_given = given.memory_mib > 0;
    crew.memory = crew.memory_given ? given.memory_mib << 20 : available_memory() / 4 * 3;
    if (!given.tmp.empty()) crew.words.insert(crew.words.end(), {"--tmp", given.tmp});
    if (given.resume) crew.words.push_back("--resume");
    return crew;
}

void print_tally(const LibraryArguments& given, const Tally& tally, const fs::path& page) {
    if (given.json) {
        print_line(Json({{"meshes", tally.meshes},
                         {"baked", tally.baked},
                         {"there", tally.there},
                         {"refused", tally.refused},
                         {"failed", tally.failed},
                         {"left", tally.left}})
                       .dump(2));
    } else if (verbosity() != Verbosity::quiet) {
        std::printf("%llu meshes: %llu baked, %llu were there, %llu refused, %llu failed, %llu left%s\n",
                    static_cast<unsigned long long>(tally.meshes), static_cast<unsigned long long>(tally.baked),
                    static_cast<unsigned long long>(tally.there), static_cast<unsigned long long>(tally.refused),
                    static_cast<unsigned long long>(tally.failed), static_cast<unsigned long long>(tally.left),
                    page.empty() ? "" : ("; " + page.string()).c_str());
    }
}

Result<int> ended(const LibraryArguments& given, const Result<Tally>& tally, const fs::path& page) {
    if (!tally) return tl::unexpected(tally.error());
    end_progress();
    print_tally(given, *tally, page);
    return tally->exit_code();
}

Result<int> check(const std::vector<Item>& items, const Recipes& recipes, const Shelf& shelf) {
    const auto lines = check_library(items, recipes, shelf, terminal_progress());
    if (!lines) return tl::unexpected(lines.error());
    end_progress();
    for (const std::string& line : *lines) print_line(line);
    return lines->empty() ? 0 : static_cast<int>(Fault::invariant);
}

Result<int> plan(const LibraryArguments& given, std::vector<Item> items, const Recipes& recipes, const Shelf& shelf) {
    const auto made = make_plan(std::move(items), recipes, shelf, words_of(given_of(given.bake_options)), given.plan,
                                given.planning, terminal_progress());
    if (!made) return tl::unexpected(made.error());
    end_progress();
    if (verbosity() != Verbosity::quiet) {
        std::printf("%zu meshes, %llu shards; arrays of them and the MiB that each takes: %s\n", made->items.size(),
                    static_cast<unsigned long long>(made->shards), (fs::path(given.plan) / "arrays").c_str());
    }
    return 0;
}

Result<int> shard(const LibraryArguments& given) {
    uint64_t number = 0;
    if (!CLI::detail::lexical_cast(given.shard.at(1), number))
        return fail(Fault::usage, "--shard " + given.shard.at(1) + ": must be a number");
    const auto plan = read_plan(given.shard.at(0));
    if (!plan) return tl::unexpected(plan.error());
    RecipeBook recipes(plan->words);
    const auto crew = crew_of(given);
    if (!crew) return tl::unexpected(crew.error());
    return ended(given, bake_shard(*plan, number, std::ref(recipes), *crew, terminal_progress()), {});
}

Result<int> merge(const LibraryArguments& given) {
    const auto plan = read_plan(given.merge);
    if (!plan) return tl::unexpected(plan.error());
    RecipeBook recipes(plan->words);
    const auto merged = merge_plan(*plan, std::ref(recipes), terminal_progress());
    if (!merged) return tl::unexpected(merged.error());
    end_progress();
    print_tally(given, merged->tally, Shelf(plan->out).page());
    if (merged->shards_left.empty()) return merged->tally.exit_code();
    std::string shards;
    for (const uint64_t one : merged->shards_left) shards += (shards.empty() ? "" : ",") + std::to_string(one);
    announce("shards with meshes left: " + shards + "; go on with: sbatch --array=" + shards +
             " scripts/library.sbatch " + given.merge + ", or for each: lodestone library --shard " + given.merge +
             " NUMBER");
    return merged->tally.exit_code();
}

Result<int> library(const LibraryArguments& given) {
    if (!given.shard.empty()) return shard(given);
    if (!given.merge.empty()) return merge(given);
    if (given.sources.empty() || given.out.empty())
        return fail(Fault::usage, "library: give SOURCE... and -o OUT, or --shard, or --merge; see library --help");
    const auto options = bake_options_of(given.bake);
    if (!options) return tl::unexpected(options.error());
    const Shelf shelf(given.out);
    auto items = find_items(given.sources, given.out);
    if (!items) return tl::unexpected(items.error());
    RecipeBook recipes(words_of(given_of(given.bake_options)));
    if (given.check) return check(*items, std::ref(recipes), shelf);
    if (!given.plan.empty()) return plan(given, std::move(*items), std::ref(recipes), shelf);
    const auto crew = crew_of(given);
    if (!crew) return tl::unexpected(crew.error());
    return ended(given, bake_library(std::move(*items), std::ref(recipes), shelf, *crew, terminal_progress()),
                 shelf.page());
}

void add_library_options(CLI::App& command, LibraryArguments& o) {
    command.add_option("sources", o.sources,
                       "Folders, globs, meshes, or manifests: .jsonl with an object a line, {\"path\": ..., \"name\": "
                       "..., \"options\": [...]}, the last two where wanted");
    command.add_option("-o,--out", o.out,
                       "Folder of the library: assets, thumbnails, results.jsonl with a line a mesh, index.html");
    command
        .add_option("--memory", o.memory_mib,
                    "Memory for all bakes together, in MiB, about; three quarters of what is free unless given. A mesh "
                    "that needs more is baked alone and kept to it")
        ->check(CLI::Range(192, 1 << 30));
    command.add_option("--jobs", o.jobs, "Cores for all bakes together; 0 takes all")->check(CLI::Range(0, 4096));
    command.add_flag("--check", o.check,
                     "Bake nothing; compare the library with its sources by every hash, and print what is missing, "
                     "stale or foreign; exit with 1 where something is");
    command.add_flag("--resume", o.resume, "As of bake, for each");
    command.add_option("--tmp", o.tmp, "As of bake, for all")->check(CLI::ExistingDirectory);
    command.add_flag("--json", o.json, "Print how many were baked, were there, are left, ... as JSON");
}

void add_plan_options(CLI::App& command, LibraryArguments& o) {
    command.add_option("--plan", o.plan, "Bake nothing; write a plan of shards for a scheduler to this folder");
    command.add_option("--shard", o.shard, "Bake a shard of the plan in a folder: FOLDER NUMBER, from 0")->expected(2);
    command.add_option("--merge", o.merge,
                       "Merge what the shards of the plan in this folder wrote into the library, and say what is left");
    command
        .add_option("--shard-minutes", o.planning.minutes, "Time of one core, estimated, at which a shard is closed")
        ->check(CLI::Range(0.001, 1e6))
        ->capture_default_str();
    command.add_option("--shard-meshes", o.planning.most_meshes, "Meshes at which a shard is closed")
        ->check(CLI::Range(1, 1000000))
        ->capture_default_str();
}

}  // namespace

void add_library(CLI::App& app, Run& run) {
    const auto o = std::make_shared<LibraryArguments>();
    CLI::App* command = app.add_subcommand(
        "library", "Bake many meshes, each in a process of its own, over one machine or any scheduler");
    add_library_options(*command, *o);
    add_plan_options(*command, *o);
    const size_t before = command->get_options().size();
    add_bake_options(*command, o->bake);
    const std::vector<CLI::Option*> all = command->get_options();
    o->bake_options.assign(all.begin() + static_cast<std::ptrdiff_t>(before), all.end());
    command->footer(
        "Exit codes: 0 all are decided, be they baked or refused; 1 some failed; 4 some are left, and the same command "
        "goes on.\n" +
        examples("lodestone library scans -o library --backends lod,vgi --memory 16000\n"
                 "lodestone library scans -o library --check\n"
                 "lodestone library scans -o library --plan plan   # then, for each shard and at the end:\n"
                 "lodestone library --shard plan 0\n"
                 "lodestone library --merge plan"));
    command->callback([o, &run] { run = [o] { return library(*o); }; });
}

}  // namespace lodestone
