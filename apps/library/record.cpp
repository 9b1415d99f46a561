#include "apps/library/record.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <optional>
#include <string_view>
#include <utility>

#include "apps/library/item.h"
#include "base/files/file.h"
#include "base/json.h"

namespace lodestone {

namespace fs = std::filesystem;

namespace {

constexpr std::array<const char*, 4> outcome_names = {"baked", "refused", "failed", "again"};

std::string line_of(const Record& record) { return text_of(json_of(record)) + "\n"; }

Json json_of(const Stamp& stamp) { return Json::array({stamp.bytes, stamp.changed}); }
Stamp stamp_from(const Json& json) { return {json.at(0).get<int64_t>(), json.at(1).get<int64_t>()}; }

Record record_from(const Json& json) {
    Record record;
    record.name = json.at("name").get<std::string>();
    record.path = path_of_json(json.at("path"));
    const auto outcome = json.at("outcome").get<std::string>();
    for (size_t i = 0; i < outcome_names.size(); ++i)
        if (outcome == outcome_names[i]) record.outcome = static_cast<Outcome>(i);
    record.code = json.at("code").get<int>();
    record.message = json.value("message", "");
    record.tries = json.value("tries", 0u);
    record.seconds = json.value("seconds", 0.0);
    record.cpu_seconds = json.value("cpu_seconds", 0.0);
    record.peak_rss_bytes = json.value("peak_rss_bytes", uint64_t{0});
    record.bytes = json.value("bytes", uint64_t{0});
    record.source_hash = json.value("source_hash", "");
    record.recipe = json.value("recipe", "");
    record.source = stamp_from(json.at("source_stamp"));
    record.asset = stamp_from(json.at("asset_stamp"));
    for (const Json& file : json.value("side_files", Json::array()))
        record.side_files.emplace_back(path_of_json(file.at("path")), stamp_from(file.at("stamp")));
    record.warnings = json.value("warnings", std::vector<std::string>());
    record.figures = json.value("figures", Json::object());
    return record;
}

// Nothing where the line is none.
std::optional<Record> parse_record(std::string_view line) {
    const Json json = Json::parse(line, nullptr, false);
    if (!json.is_object()) return std::nullopt;
    try {
        return record_from(json);
    } catch (const Json::exception&) { return std::nullopt; }
}

tl::unexpected<Error> not_written(const fs::path& path) {
    return fail(Fault::machine, path.string() + ": cannot be written: " + std::strerror(errno));
}

// Bytes of a file up to its last end of a line.
off_t whole_lines(int descriptor) {
    off_t end = ::lseek(descriptor, 0, SEEK_END);
    for (char last = 0; end > 0; --end) {
        if (::pread(descriptor, &last, 1, end - 1) != 1 || last == '\n') break;
    }
    return end;
}

}  // namespace

const char* name_of(Outcome outcome) { return outcome_names[static_cast<size_t>(outcome)]; }

Stamp stamp_of(const fs::path& path) {
    struct stat status {};
    if (::stat(path.c_str(), &status) != 0) return {};
    return {status.st_size, int64_t{status.st_mtim.tv_sec} * 1000000000 + status.st_mtim.tv_nsec};
}

Json json_of(const Record& record) {
    Json json = {{"name", record.name},
                 {"path", json_of_path(record.path)},
                 {"outcome", name_of(record.outcome)},
                 {"code", record.code},
                 {"tries", record.tries},
                 {"seconds", record.seconds},
                 {"cpu_seconds", record.cpu_seconds},
                 {"peak_rss_bytes", record.peak_rss_bytes},
                 {"bytes", record.bytes},
                 {"source_hash", record.source_hash},
                 {"recipe", record.recipe},
                 {"source_stamp", json_of(record.source)},
                 {"asset_stamp", json_of(record.asset)}};
    if (!record.message.empty()) json["message"] = record.message;
    if (!record.warnings.empty()) json["warnings"] = record.warnings;
    if (!record.figures.empty()) json["figures"] = record.figures;
    for (const auto& file : record.side_files)
        json["side_files"].push_back({{"path", json_of_path(file.first)}, {"stamp", json_of(file.second)}});
    return json;
}

Result<Records> read_records(const fs::path& path, bool* clean) {
    Records records;
    bool all = true;
    std::error_code error;
    if (!fs::exists(path, error)) return records;
    const auto file = read_file(path);
    if (!file) return fail(Fault::machine, file.error().message);
    std::string_view rest(reinterpret_cast<const char*>(file->bytes.data()), file->bytes.size());
    for (size_t end = 0; (end = rest.find('\n')) != std::string_view::npos; rest.remove_prefix(end + 1)) {
        auto record = parse_record(rest.substr(0, end));
        all = all && record && !records.contains(record->name);
        if (record) records.insert_or_assign(record->name, std::move(*record));
    }
    if (clean != nullptr) *clean = all && rest.empty();
    return records;
}

Result<void> write_records(const fs::path& path, const Records& records) {
    auto file = OutputFile::create(path);
    if (!file) return tl::unexpected(file.error());
    for (const auto& record : records) {
        if (auto done = file->write(line_of(record.second)); !done) return done;
    }
    return file->commit();
}

Result<RecordFile> RecordFile::open(const fs::path& path) {
    const int descriptor = ::open(path.c_str(), O_RDWR | O_CREAT | O_APPEND | O_CLOEXEC, 0666);
    if (descriptor < 0 || ::ftruncate(descriptor, whole_lines(descriptor)) != 0) return not_written(path);
    return RecordFile(path, descriptor);
}

Result<RecordFile> RecordFile::create(const fs::path& folder, const std::string& name) {
    std::error_code error;
    fs::create_directories(folder, error);
    for (unsigned i = 0;; ++i) {
        const fs::path path = folder / (name + "." + std::to_string(i) + ".jsonl");
        const int descriptor = ::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_APPEND | O_CLOEXEC, 0666);
        if (descriptor >= 0) return RecordFile(path, descriptor);
        if (errno != EEXIST) return not_written(path);
    }
}

RecordFile::RecordFile(RecordFile&& other) noexcept
    : path_(std::move(other.path_)), descriptor_(std::exchange(other.descriptor_, -1)) {}

RecordFile::~RecordFile() {
    if (descriptor_ >= 0) ::close(descriptor_);
}

// At once: a line is there whole, or what is there of it is taken off by the next writer and not read by anybody.
Result<void> RecordFile::add(const Record& record) {
    const std::string line = line_of(record);
    const ssize_t written = ::write(descriptor_, line.data(), line.size());
    if (written == static_cast<ssize_t>(line.size())) return {};
    if (written >= 0) errno = ENOSPC;
    return not_written(path_);
}

}  // namespace lodestone
