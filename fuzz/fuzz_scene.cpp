// Scenes and camera paths: read, or refused in one line that names the file, or one that it names.
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "apps/scene/scene.h"
#include "base/json.h"
#include "fuzz/promise.h"
#include "fuzz/watch.h"

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

// The sum of what `count` says in each of a list.
double sum_of_counts(const Json& list, double most) {
    double sum = 0;
    for (const Json& one : list) {
        const auto count = one.is_object() ? one.find("count") : one.end();
        if (one.is_object() && count != one.end() && count->is_number())
            sum += std::clamp(count->get<double>(), 0.0, most);
    }
    return sum;
}

// Bytes of what a scene says is scattered, whether it is refused after that or not: few characters state many.
size_t scattered_bytes(std::span<const uint8_t> text) {
    const Json json = Json::parse(text.begin(), text.end(), nullptr, false, true);
    if (!json.is_object()) return 0;
    double emitters = 0;
    for (const Json& volume : json.value("volumes", Json::array())) {
        if (volume.is_object() && volume.contains("scatter"))
            emitters += sum_of_counts(Json::array({volume["scatter"]}), 4096);
    }
    emitters = std::min(emitters, static_cast<double>(most_particles));
    const double instances = sum_of_counts(json.value("scatter", Json::array()), 1e5);
    return static_cast<size_t>(instances) * sizeof(SceneInstance) +
           static_cast<size_t>(emitters) * sizeof(volume::Emitter);
}

size_t bytes_of(const Scene& scene) {
    return scene.assets.size() * sizeof(SceneAsset) + scene.instances.size() * sizeof(SceneInstance) +
           scene.volumes.emitters.size() * sizeof(volume::Emitter);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    const std::filesystem::path path = "/dev/shm/lodestone-fuzz-" + std::to_string(getpid()) + ".scene.json";
    std::ofstream(path, std::ios::binary)
        .write(reinterpret_cast<const char*>(data), static_cast<std::streamsize>(size));
    const Watch watch;
    size_t bytes = size;
    {
        const auto scene = read_scene(path);
        check_refusal(scene, path);
        if (scene) bytes = std::max(bytes, bytes_of(*scene));
    }
    check_refusal(read_camera_path(path), path);
    watch.check(std::max(bytes, scattered_bytes({data, size})));
    std::filesystem::remove(path);
    return 0;
}
