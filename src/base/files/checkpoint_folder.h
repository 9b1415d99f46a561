// What stages of a long computation have made, kept as files, so that the same computation, begun again after it was
// stopped or killed, goes on from there.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "base/files/chunk_file.h"
#include "base/hash.h"
#include "base/result.h"

namespace lodestone {

// A folder of kept stages, locked as long as this object or a copy of it lives: no other has it open. Copies name the
// same folder.
class CheckpointFolder {
public:
    // Makes PARENT/lodestone-KEY unless it is there, and removes what is left of one whose removal was cut short. key:
    // a hash of everything that results depend on, and of what they are for. Fault::machine where it cannot be made, or
    // somebody has it open.
    static Result<CheckpointFolder> open(const std::filesystem::path& parent, const Hash128& key);

    const std::filesystem::path& path() const { return path_; }  // where the stages lie
    // Whether some stage was kept before.
    bool begun() const;
    // What a stage has kept; nothing where it has not, or where the file is damaged.
    std::optional<ChunkFile> find(const std::string& stage) const;
    // Keeps a stage: `write` adds its chunks. The file appears whole or not at all; it replaces what was kept before.
    // Fault::machine where it cannot be written.
    Result<void> keep(const std::string& stage, const std::function<Result<void>(ChunkWriter&)>& write) const;
    // Removes the folder and all that is in it. What cannot be removed is left there, without an error.
    void remove() const;

private:
    CheckpointFolder(std::filesystem::path path, const Hash128& key) : path_(std::move(path)), key_(key) {}
    Result<bool> lock();
    std::filesystem::path file_of(const std::string& stage) const { return path_ / (stage + ".stage"); }
    std::filesystem::path path_;
    Hash128 key_;
    std::shared_ptr<const int> lock_;  // a descriptor
};

// The result of a stage: what was kept of it, or else made now and kept. work: null keeps nothing. read: from a
// ChunkFile, std::optional of the result; write: the result to a ChunkWriter.
template <class Value, class Read, class Make, class Write>
Result<Value> load_or_make(const CheckpointFolder* work, const std::string& stage, Read&& read, Make&& make,
                           Write&& write) {
    if (work == nullptr) return make();
    if (const auto file = work->find(stage)) {
        if (std::optional<Value> value = read(*file)) return std::move(*value);
    }
    Result<Value> made = make();
    if (!made) return made;
    auto kept = work->keep(stage, [&](ChunkWriter& writer) { return write(*made, writer); });
    if (!kept) return tl::unexpected(kept.error());
    return made;
}

}  // namespace lodestone
