// What became of each mesh of a library: a line of JSON each, in files of whole lines, whoever is killed.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "base/json.h"
#include "base/result.h"

namespace lodestone {

// What tells one state of a file from another without reading it.
struct Stamp {
    int64_t bytes = -1;   // -1: it is not there
    int64_t changed = 0;  // nanoseconds since 1970
    bool operator==(const Stamp&) const = default;
};
Stamp stamp_of(const std::filesystem::path& path);

// baked: the asset is there. refused: its mesh cannot be (exit code 3). failed: it was tried, and is not tried again by
// itself. again: the machine was to blame, or the bake was killed; it is left.
enum class Outcome { baked, refused, failed, again };
const char* name_of(Outcome outcome);

struct Record {
    std::string name;
    std::filesystem::path path;
    Outcome outcome = Outcome::again;
    int code = 0;         // exit code of the last try; 128 + the signal that ended it
    std::string message;  // why there is no asset
    unsigned tries = 0;
    double seconds = 0, cpu_seconds = 0;     // of the last try
    uint64_t peak_rss_bytes = 0, bytes = 0;  // of the last try; of the asset
    std::string source_hash, recipe;
    Stamp source, asset;
    std::vector<std::pair<std::filesystem::path, Stamp>> side_files;  // relative to the mesh's folder
    std::vector<std::string> warnings;
    Json figures = Json::object();  // what the asset tells of its mesh

    bool operator==(const Record&) const = default;
    bool decided() const { return outcome == Outcome::baked || outcome == Outcome::refused; }
};
Json json_of(const Record& record);

using Records = std::map<std::string, Record>;  // by name

// Of a file of records the last of each name; lines that are cut or none are left out. A file that is not there has
// none. Fault::machine where it cannot be read. clean: whether every line was a record of a name of its own.
Result<Records> read_records(const std::filesystem::path& path, bool* clean = nullptr);
// A whole file of them, by name. It appears whole.
Result<void> write_records(const std::filesystem::path& path, const Records& records);

// Lines added to a file by one writer.
class RecordFile {
public:
    // Fault::machine where it cannot be written. A last line that is cut is taken off.
    static Result<RecordFile> open(const std::filesystem::path& path);
    // Of a name that no other has: FOLDER/NAME.N.jsonl.
    static Result<RecordFile> create(const std::filesystem::path& folder, const std::string& name);
    RecordFile(RecordFile&& other) noexcept;
    RecordFile& operator=(RecordFile&&) = delete;
    ~RecordFile();
    Result<void> add(const Record& record);

private:
    RecordFile(std::filesystem::path path, int descriptor) : path_(std::move(path)), descriptor_(descriptor) {}
    std::filesystem::path path_;
    int descriptor_;
};

}  // namespace lodestone
