#include "apps/library/plan.h"

#include <algorithm>
#include <fstream>
#include <set>

#include "base/files/file.h"
#include "base/json.h"

namespace lodestone {

namespace fs = std::filesystem;

namespace {

constexpr uint64_t memory_step_mib = 1024;  // shards whose memory is the same in these steps go together

fs::path manifest_of(const fs::path& folder) { return folder / "manifest.jsonl"; }
fs::path results_of(const fs::path& folder) { return folder / "results"; }

std::string number_of(uint64_t shard) {
    const std::string digits = std::to_string(shard);
    return std::string(digits.size() < 5 ? 5 - digits.size() : 0, '0') + digits;
}

// Shards closed where their cost would pass `target`, or at a number of meshes. Returns how many.
uint64_t close_at(double target, uint64_t most_meshes, std::vector<Item*>& items) {
    uint64_t shards = 0, meshes = 0;
    double cost = 0;
    for (Item* item : items) {
        if (meshes > 0 && (meshes >= most_meshes || cost + item->cost > target)) {
            ++shards;
            cost = 0;
            meshes = 0;
        }
        item->shard = static_cast<int64_t>(shards);
        cost += item->cost;
        ++meshes;
    }
    return items.empty() ? 0 : shards + 1;
}

// As many shards as the options ask for, or as there may be, and then as equal as so many can be.
uint64_t deal(std::vector<Item*>& items, const PlanOptions& options) {
    // Half of the shards that may be hold all meshes where their number alone closes them, so this comes to an end.
    const uint64_t most_meshes = std::max(options.most_meshes, items.size() * 2 / options.most_shards + 1);
    double enough = options.minutes * 60;
    uint64_t shards = close_at(enough, most_meshes, items);
    while (shards > options.most_shards) shards = close_at(enough *= 2, most_meshes, items);
    double too_little = 0;
    for (int step = 0; step < 30; ++step) {
        const double middle = (too_little + enough) / 2;
        (close_at(middle, most_meshes, items) <= shards ? enough : too_little) = middle;
    }
    return close_at(enough, most_meshes, items);
}

uint64_t mib_of(uint64_t bytes) { return (bytes >> 20) + 1; }

Json line_of(const Item& item) {
    return {{"name", item.name},
            {"path", json_of_path(item.path)},
            {"options", item.words},
            {"shard", item.shard},
            {"bytes", item.bytes},
            {"seconds", item.cost},
            {"memory_mib", mib_of(item.memory)}};
}

Result<void> write_text(const fs::path& path, const std::string& text) {
    auto file = OutputFile::create(path);
    if (!file) return tl::unexpected(file.error());
    if (auto done = file->write(text); !done) return done;
    return file->commit();
}

// Runs of shards by the memory that the dearest mesh of each takes.
std::string arrays_of(const LibraryPlan& plan) {
    std::vector<uint64_t> memory(plan.shards, 0);
    for (const Item& item : plan.items) {
        if (item.shard < 0) continue;
        uint64_t& most = memory[static_cast<size_t>(item.shard)];
        most = std::max(most, (mib_of(item.memory) + memory_step_mib - 1) / memory_step_mib * memory_step_mib);
    }
    std::string text;
    for (size_t first = 0, end = 0; first < memory.size(); first = end) {
        while (end < memory.size() && memory[end] == memory[first]) ++end;
        text += std::to_string(first) + "-" + std::to_string(end - 1) + " " + std::to_string(memory[first]) + "\n";
    }
    return text;
}

Result<void> write_plan(const LibraryPlan& plan) {
    const Json head = {{"out", json_of_path(plan.out)}, {"options", plan.words}, {"shards", plan.shards}};
    std::string lines;
    for (const Item& item : plan.items) lines += line_of(item).dump() + "\n";
    for (const auto& [name, text] : {std::pair("arrays", arrays_of(plan)), std::pair("manifest.jsonl", lines),
                                     std::pair("plan.json", head.dump(2) + "\n")}) {
        if (auto done = write_text(plan.folder / name, text); !done) return done;
    }
    return {};
}

Result<Item> item_from(const std::string& line, const fs::path& manifest) {
    const Json json = Json::parse(line, nullptr, false);
    try {
        Item item;
        item.name = json.at("name").get<std::string>();
        item.path = path_of_json(json.at("path"));
        item.words = json.at("options").get<std::vector<std::string>>();
        item.shard = json.at("shard").get<int64_t>();
        item.bytes = json.at("bytes").get<uint64_t>();
        item.cost = json.at("seconds").get<double>();
        item.memory = json.at("memory_mib").get<uint64_t>() << 20;
        return item;
    } catch (const Json::exception&) {
        return fail(Fault::usage, manifest.string() + ": has a line that no plan writes; make the plan anew");
    }
}

Result<std::vector<fs::path>> files_of_results(const LibraryPlan& plan, const std::string& begin) {
    std::vector<fs::path> files;
    std::error_code error;
    for (const auto& entry : fs::directory_iterator(results_of(plan.folder), error)) {
        if (entry.path().filename().string().starts_with(begin)) files.push_back(entry.path());
    }
    std::ranges::sort(files);
    return files;
}

// What is known of every mesh: what the library had, and what shards wrote later. A result is not undone by a try that
// came to none.
Result<Records> gather(const LibraryPlan& plan, const Shelf& shelf, const std::string& begin) {
    auto known = read_records(shelf.results());
    if (!known) return known;
    const auto files = files_of_results(plan, begin);
    if (!files) return tl::unexpected(files.error());
    for (const fs::path& file : *files) {
        auto more = read_records(file);
        if (!more) return more;
        for (auto& record : *more) {
            const auto held = known->find(record.first);
            if (held == known->end() || record.second.decided() || !held->second.decided())
                known->insert_or_assign(record.first, std::move(record.second));
        }
    }
    return known;
}

}  // namespace

Result<LibraryPlan> make_plan(std::vector<Item> items, const Recipes& recipes, const Shelf& shelf,
                              const std::vector<std::string>& words, const fs::path& folder, const PlanOptions& options,
                              const Progress& progress) {
    std::error_code error;
    fs::create_directories(results_of(folder), error);
    if (error) return fail(Fault::machine, folder.string() + ": cannot be made: " + error.message());
    const auto known = read_records(shelf.results());
    if (!known) return tl::unexpected(known.error());
    for (Item& item : items) item.path = fs::absolute(item.path);
    if (auto done = estimate_all(items, recipes); !done) return tl::unexpected(done.error());
    Records current;
    const auto jobs = what_is_left(items, recipes, shelf, *known, current, progress);
    if (!jobs) return tl::unexpected(jobs.error());
    std::vector<Item*> left;
    for (const Job& job : *jobs) left.push_back(&items[static_cast<size_t>(job.item - items.data())]);
    std::ranges::stable_sort(left, [](const Item* a, const Item* b) { return a->cost > b->cost; });
    LibraryPlan plan;
    plan.folder = folder;
    plan.out = fs::absolute(shelf.folder());
    plan.words = words;
    plan.shards = deal(left, options);
    // What shards of an older plan wrote is by that plan's shards. Its assets tell of themselves.
    plan.items = std::move(items);
    for (const auto& entry : fs::directory_iterator(results_of(folder), error)) fs::remove(entry.path(), error);
    if (auto done = write_plan(plan); !done) return tl::unexpected(done.error());
    return plan;
}

Result<LibraryPlan> read_plan(const fs::path& folder) {
    const auto bad = [&] {
        return fail(Fault::usage, folder.string() + ": holds no plan; make one by library --plan");
    };
    LibraryPlan plan;
    plan.folder = folder;
    std::ifstream head(folder / "plan.json");
    const Json json = Json::parse(head, nullptr, false);
    if (!json.is_object()) return bad();
    try {
        plan.out = path_of_json(json.value("out", Json()));
        plan.words = json.value("options", std::vector<std::string>());
        plan.shards = json.value("shards", uint64_t{0});
    } catch (const Json::exception&) { return bad(); }
    if (plan.out.empty()) return bad();
    std::ifstream in(manifest_of(folder));
    for (std::string line; std::getline(in, line);) {
        auto item = item_from(line, manifest_of(folder));
        if (!item) return tl::unexpected(item.error());
        plan.items.push_back(std::move(*item));
    }
    return plan;
}

Result<Tally> bake_shard(const LibraryPlan& plan, uint64_t shard, const Recipes& recipes, const Crew& crew,
                         const Progress& progress) {
    if (shard >= plan.shards) {
        return fail(Fault::usage, "--shard " + std::to_string(shard) + ": the plan has " + std::to_string(plan.shards) +
                                      ", counted from 0");
    }
    const Shelf shelf(plan.out);
    const auto known = gather(plan, shelf, number_of(shard) + ".");
    if (!known) return tl::unexpected(known.error());
    std::vector<Item> items;
    for (const Item& item : plan.items)
        if (item.shard == static_cast<int64_t>(shard)) items.push_back(item);
    Records records;
    const auto jobs = what_is_left(items, recipes, shelf, *known, records, progress);
    if (!jobs) return tl::unexpected(jobs.error());
    auto file = RecordFile::create(results_of(plan.folder), number_of(shard));
    if (!file) return tl::unexpected(file.error());
    Tally tally = tally_of(records, records.size());
    const uint64_t there = tally.baked;
    for (const auto& record : records)
        if (auto added = file->add(record.second); !added) return tl::unexpected(added.error());
    const auto done = [&](Record record) {
        auto added = file->add(record);
        records.insert_or_assign(record.name, std::move(record));
        return added;
    };
    if (auto baked = bake_all(crew, shelf, *jobs, done, progress); !baked) return tl::unexpected(baked.error());
    tally = tally_of(records, items.size());
    tally.there = there;
    tally.baked -= there;
    return tally;
}

Result<Merged> merge_plan(const LibraryPlan& plan, const Recipes& recipes, const Progress& progress) {
    const Shelf shelf(plan.out);
    const auto lock = FolderLock::take(shelf.folder());
    if (!lock) return tl::unexpected(lock.error());
    const auto known = gather(plan, shelf, "");
    if (!known) return tl::unexpected(known.error());
    Records records;
    const auto jobs = what_is_left(plan.items, recipes, shelf, *known, records, progress);
    if (!jobs) return tl::unexpected(jobs.error());
    std::set<uint64_t> shards;
    for (const Job& job : *jobs) {
        const auto tried = known->find(job.item->name);
        // A refusal stands here even where there was no file: it was looked for by a shard.
        const bool stands = tried != known->end() && (tried->second.outcome == Outcome::refused
                                                          ? same_sources(tried->second, *job.item, *job.recipe)
                                                          : tried->second.outcome == Outcome::failed);
        const bool lost = tried != known->end() && tried->second.decided() && !stands;
        if (tried != known->end() && !lost) records.insert_or_assign(tried->first, tried->second);
        if (!stands && job.item->shard >= 0) shards.insert(static_cast<uint64_t>(job.item->shard));
    }
    if (auto done = finish(shelf, records, false, progress); !done) return tl::unexpected(done.error());
    return Merged{tally_of(records, plan.items.size()), {shards.begin(), shards.end()}};
}

}  // namespace lodestone
