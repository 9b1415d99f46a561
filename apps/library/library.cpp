#include "apps/library/library.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <set>
#include <utility>

#include "base/files/file.h"
#include "base/json.h"
#include "report/page.h"

namespace lodestone {

namespace fs = std::filesystem;

namespace {

Json row_of(const Record& record) {
    Json row = {{"name", record.name},
                {"outcome", name_of(record.outcome)},
                {"seconds", record.seconds},
                {"peak_rss_bytes", record.peak_rss_bytes}};
    if (record.outcome == Outcome::baked) row["bytes"] = record.bytes;
    if (!record.message.empty()) row["message"] = record.message;
    if (!record.warnings.empty()) row["warnings"] = record.warnings;
    for (const char* figure : {"triangles", "components", "levels", "repaired"})
        if (record.figures.contains(figure)) row[figure] = record.figures[figure];
    return row;
}

Result<void> write_whole(const fs::path& path, const std::string& text) {
    auto file = OutputFile::create(path);
    if (!file) return tl::unexpected(file.error());
    if (auto done = file->write(text); !done) return done;
    return file->commit();
}

}  // namespace

Tally tally_of(const Records& records, uint64_t meshes) {
    Tally tally;
    tally.meshes = meshes;
    for (const auto& record : records) {
        switch (record.second.outcome) {
            case Outcome::baked:
                ++tally.baked;
                break;
            case Outcome::refused:
                ++tally.refused;
                break;
            case Outcome::failed:
                ++tally.failed;
                break;
            case Outcome::again:
                break;
        }
    }
    tally.left = meshes - tally.baked - tally.refused - tally.failed;
    return tally;
}

Result<FolderLock> FolderLock::take(const fs::path& folder) {
    std::error_code error;
    fs::create_directories(folder, error);
    if (error) return fail(Fault::machine, folder.string() + ": cannot be made: " + error.message());
    const int descriptor = ::open((folder / ".lock").c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
    if (descriptor >= 0 && ::flock(descriptor, LOCK_EX | LOCK_NB) == 0) return FolderLock(descriptor);
    const std::string why = errno == EWOULDBLOCK ? "another lodestone works there; wait until it has ended"
                                                 : std::string("cannot be locked: ") + std::strerror(errno);
    if (descriptor >= 0) ::close(descriptor);
    return fail(Fault::machine, folder.string() + ": " + why);
}

FolderLock::FolderLock(FolderLock&& other) noexcept : descriptor_(std::exchange(other.descriptor_, -1)) {}

FolderLock::~FolderLock() {
    if (descriptor_ >= 0) ::close(descriptor_);
}

Result<void> estimate_all(std::vector<Item>& items, const Recipes& recipes) {
    for (Item& item : items) {
        const auto recipe = recipes(item.words);
        if (!recipe) return fail_at(item.name, recipe.error());
        estimate(item, **recipe);
    }
    return {};
}

Result<std::vector<Job>> what_is_left(const std::vector<Item>& items, const Recipes& recipes, const Shelf& shelf,
                                      const Records& known, Records& records, const Progress& progress) {
    std::vector<Job> left;
    double done = 0;
    for (const Item& item : items) {
        if (progress.stopped()) return fail(Fault::interrupted, "interrupted");
        const auto recipe = recipes(item.words);
        if (!recipe) return fail_at(item.name, recipe.error());
        const auto found = known.find(item.name);
        auto current = shelf.current(item, **recipe, found == known.end() ? nullptr : &found->second);
        if (current)
            records.insert_or_assign(item.name, std::move(*current));
        else
            left.push_back({&item, *recipe});
        progress.at("look", ++done / static_cast<double>(items.size()));
    }
    return left;
}

Result<void> finish(const Shelf& shelf, const Records& records, bool as_recorded, const Progress& progress) {
    for (const fs::path& part : shelf.sweep()) progress.warning(part.string() + ": left by a killed bake; removed");
    std::error_code error;
    if (as_recorded && fs::exists(shelf.page(), error)) return {};
    Json rows = Json::array();
    for (const auto& record : records) rows.push_back(row_of(record.second));
    if (auto done = write_records(shelf.results(), records); !done) return done;
    return write_whole(shelf.page(), library_page(text_of(rows)));
}

Result<Tally> bake_library(std::vector<Item> items, const Recipes& recipes, const Shelf& shelf, const Crew& crew,
                           const Progress& progress) {
    const auto lock = FolderLock::take(shelf.folder());
    if (!lock) return tl::unexpected(lock.error());
    bool clean = false;
    const auto known = read_records(shelf.results(), &clean);
    if (!known) return tl::unexpected(known.error());
    Records records;
    const auto jobs = what_is_left(items, recipes, shelf, *known, records, progress);
    if (!jobs) return tl::unexpected(jobs.error());
    const uint64_t there = tally_of(records, records.size()).baked;
    const bool as_recorded = clean && jobs->empty() && records == *known;
    Result<void> baked;
    if (!jobs->empty()) {
        for (const Job& job : *jobs) estimate(items[static_cast<size_t>(job.item - items.data())], *job.recipe);
        auto file = RecordFile::open(shelf.results());
        if (!file) return tl::unexpected(file.error());
        const auto done = [&](Record record) {
            auto added = file->add(record);
            records.insert_or_assign(record.name, std::move(record));
            return added;
        };
        baked = bake_all(crew, shelf, *jobs, done, progress);
    }
    if (auto finished = finish(shelf, records, as_recorded, progress); !finished)
        return tl::unexpected(finished.error());
    if (!baked) return tl::unexpected(baked.error());
    Tally tally = tally_of(records, items.size());
    tally.there = there;
    tally.baked -= there;
    return tally;
}

Result<std::vector<std::string>> check_library(const std::vector<Item>& items, const Recipes& recipes,
                                               const Shelf& shelf, const Progress& progress) {
    const auto known = read_records(shelf.results());
    if (!known) return tl::unexpected(known.error());
    std::vector<std::string> lines;
    std::set<fs::path> ours;
    double done = 0;
    for (const Item& item : items) {
        if (progress.stopped()) return fail(Fault::interrupted, "interrupted");
        const auto recipe = recipes(item.words);
        if (!recipe) return fail_at(item.name, recipe.error());
        ours.insert(shelf.asset_of(item.name));
        const auto found = known->find(item.name);
        const bool refused = found != known->end() && found->second.outcome == Outcome::refused &&
                             same_sources(found->second, item, **recipe);
        std::error_code error;
        if (!fs::exists(shelf.asset_of(item.name), error)) {
            if (!refused) lines.push_back("missing " + item.name);
        } else if (const std::string fault = fault_of_asset(shelf, item, **recipe); !fault.empty()) {
            lines.push_back("stale " + item.name + ": " + fault);
        }
        progress.at("check", ++done / static_cast<double>(items.size()));
    }
    std::error_code error;
    std::set<std::string> foreign;
    for (const auto& entry : fs::recursive_directory_iterator(shelf.assets(), error)) {
        if (!entry.is_directory() && !ours.contains(entry.path()))
            foreign.insert("foreign " + entry.path().lexically_relative(shelf.folder()).string());
    }
    lines.insert(lines.end(), foreign.begin(), foreign.end());
    return lines;
}

}  // namespace lodestone
