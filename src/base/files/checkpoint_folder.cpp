#include "base/files/checkpoint_folder.h"

namespace lodestone {

namespace fs = std::filesystem;

Result<CheckpointFolder> CheckpointFolder::open(const fs::path& parent, const Hash128& key) {
    CheckpointFolder folder(parent / ("lodestone-" + key.hex().substr(0, 16)), key);
    std::error_code error;
    fs::create_directories(folder.path_, error);
    if (error)
        return fail(Fault::machine, folder.path_.string() + ": cannot be made: " + error.message() +
                                        "; name another folder with --tmp");
    return folder;
}

bool CheckpointFolder::begun() const {
    std::error_code error;
    for (const auto& entry : fs::directory_iterator(path_, error)) {
        if (entry.path().extension() == ".stage") return true;
    }
    return false;
}

std::optional<ChunkFile> CheckpointFolder::find(const std::string& stage) const {
    auto file = ChunkFile::open(file_of(stage));
    if (!file || !(file->provenance().source == key_) || !file->verify()) return std::nullopt;
    return std::move(*file);
}

Result<void> CheckpointFolder::keep(const std::string& stage,
                                    const std::function<Result<void>(ChunkWriter&)>& write) const {
    auto writer = ChunkWriter::create(file_of(stage), {key_, key_});
    if (!writer) return tl::unexpected(writer.error());
    if (auto done = write(*writer); !done) return done;
    if (auto done = writer->commit(); !done) return tl::unexpected(done.error());
    return {};
}

void CheckpointFolder::remove() const {
    std::error_code error;
    fs::remove_all(path_, error);
}

}  // namespace lodestone
