// Scenes and camera paths: read, or refused in one line that names the file, or one that it names.
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "apps/scene/scene.h"
#include "fuzz/random_mesh.h"

using namespace lodestone;
using namespace lodestone::fuzz;

namespace {

template <class T>
void check_refusal(const Result<T>& result, const std::filesystem::path& path) {
    if (result) return;
    check_error(result.error());
    // Or one beside it that it names: a camera path.
    require(result.error().message.starts_with(path.parent_path().string() + "/"), "an error names the file");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    const std::filesystem::path path = "/dev/shm/lodestone-fuzz-" + std::to_string(getpid()) + ".scene.json";
    std::ofstream(path, std::ios::binary)
        .write(reinterpret_cast<const char*>(data), static_cast<std::streamsize>(size));
    check_refusal(read_scene(path), path);
    check_refusal(read_camera_path(path), path);
    std::filesystem::remove(path);
    return 0;
}
