// Coefficients are measured (docs/library.md); the order of bakes, the sizes of shards and the time left follow from
// them, results do not.
#include "apps/scene/bake_cost.h"

#include <zlib.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <string_view>

#include "apps/machine.h"

namespace lodestone {

namespace fs = std::filesystem;

namespace {

// Bytes of a file to a triangle where its first bytes do not say how many it has: what our own writers make.
constexpr uint64_t bytes_per_triangle = 60;
constexpr uint64_t packed_ratio = 3;  // of .gz

// Of a backend or a face order: seconds + per_triangle * triangles ^ power; bytes for each triangle, and what charts
// are made in: `work` for each triangle, most_work at most.
struct Cost {
    const char* part;
    double seconds, per_triangle, power, bytes, work = 0, most_work = 0;
};
constexpr Cost costs[] = {
    {"lod", 0.02, 1.4e-5, 1, 480}, {"keyframe", 0, 2.5e-5, 1.14, 0},   {"greedy", 0, 1e-4, 1, 0},
    {"full", 0, 5e-7, 1, 150},     {"discrete", 0.05, 1.5e-5, 1, 300}, {"vgi", 0.35, 1.25e-5, 1, 140, 1000, 1.2e8},
};
constexpr double least_seconds = 0.02, seconds_per_error_sample = 2.6e-6;
constexpr uint64_t least_bytes = uint64_t{28} << 20;
constexpr double least_share = 0.6;  // of the memory reckoned, that any mesh takes

// The number behind `key` in a text header.
uint64_t number_after(std::string_view text, std::string_view key) {
    const size_t at = text.find(key);
    if (at == std::string_view::npos) return 0;
    uint64_t number = 0;
    const char* begin = text.data() + at + key.size();
    std::from_chars(begin, text.data() + text.size(), number);
    return number;
}

uint64_t triangles_of_off(std::string_view text) {
    std::string_view rest = text.substr(std::min(text.size(), text.find('\n') + 1));
    while (rest.starts_with("#")) rest.remove_prefix(std::min(rest.size(), rest.find('\n') + 1));
    return number_after(rest, " ");
}

// Zero where they do not say.
uint64_t triangles_in(std::string_view begin, uint64_t bytes) {
    if (begin.starts_with("ply")) return number_after(begin, "element face ");
    if (begin.starts_with("OFF")) return triangles_of_off(begin);
    uint32_t count = 0;
    if (begin.size() >= 84) std::memcpy(&count, begin.data() + 80, sizeof count);
    if (bytes == 84 + uint64_t{50} * count) return count;  // binary STL
    return 0;
}

std::string first_bytes(const fs::path& path) {
    std::string begin(4096, '\0');
    gzFile file = gzopen(path.c_str(), "rb");
    if (file == nullptr) return "";
    const int got = gzread(file, begin.data(), static_cast<unsigned>(begin.size()));
    gzclose(file);
    begin.resize(static_cast<size_t>(std::max(0, got)));
    return begin;
}

uint64_t unpacked_bytes(const fs::path& path, uint64_t bytes) {
    return path.extension() == ".gz" ? bytes * packed_ratio : bytes;
}

// Zero where its first bytes do not say. A header that lies does not make a bake larger than its file.
uint64_t triangles_told(const fs::path& path, uint64_t bytes) {
    if (bytes == 0) return 0;
    constexpr uint64_t least_bytes_of_a_face = 4;
    return std::min(triangles_in(first_bytes(path), bytes), unpacked_bytes(path, bytes) / least_bytes_of_a_face);
}

}  // namespace

uint64_t triangles_about(const fs::path& path, uint64_t bytes) {
    const uint64_t told = triangles_told(path, bytes);
    return told > 0 ? told : unpacked_bytes(path, bytes) / bytes_per_triangle;
}

BakeCost cost_of_bake(uint64_t triangles, uint64_t file_bytes, std::span<const std::string> parts,
                      uint64_t error_samples) {
    BakeCost whole{least_seconds, 0};
    if (std::ranges::count(parts, "lod") > 0)
        whole.seconds += seconds_per_error_sample * static_cast<double>(error_samples);
    const auto count = static_cast<double>(triangles);
    double memory = 0;
    for (const Cost& cost : costs) {
        if (std::ranges::count(parts, cost.part) == 0) continue;
        whole.seconds += cost.seconds + cost.per_triangle * std::pow(count, cost.power);
        memory = std::max(memory, count * cost.bytes + std::min(count * cost.work, cost.most_work));
    }
    whole.memory = least_bytes + file_bytes + static_cast<uint64_t>(memory);
    return whole;
}

Result<void> check_room_for_bake(const fs::path& mesh, const BakeOptions& options) {
    std::error_code error;
    const uint64_t bytes = fs::file_size(mesh, error);
    if (error) return {};  // whoever reads it says why
    const uint64_t triangles = triangles_told(mesh, bytes);
    const double least = least_share * static_cast<double>(cost_of_bake(triangles, 0, options.backends, 0).memory);
    const auto available = static_cast<double>(available_memory());
    if (least <= available) return {};
    const auto gib = [](double of) {
        return std::to_string(static_cast<uint64_t>(std::ceil(of / (1 << 30)))) + " GiB";
    };
    return fail(Fault::machine, mesh.string() + ": " + std::to_string(triangles) + " triangles take at least " +
                                    gib(least) + " of memory to bake, and " + gib(available) +
                                    " are free; bake it with --memory, which keeps the rest in files");
}

}  // namespace lodestone
