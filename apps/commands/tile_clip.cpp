#include "apps/commands/tile_clip.h"

#include <charconv>
#include <cmath>
#include <glm/geometric.hpp>
#include <optional>
#include <utility>

#include "base/text.h"
#include "mesh/io/read.h"
#include "mesh/repair.h"

namespace lodestone {

namespace {

// All of a text, as finite numbers between commas.
std::optional<std::vector<double>> numbers_of(const std::string& text) {
    std::vector<double> numbers;
    const char *at = text.data(), *end = at + text.size();
    for (;; ++at) {
        double number = 0;
        const auto [next, error] = std::from_chars(at, end, number);
        if (error != std::errc() || !std::isfinite(number)) return std::nullopt;
        numbers.push_back(number);
        at = next;
        if (at == end) return numbers;
        if (*at != ',') return std::nullopt;
    }
}

// A plane with the numbers that it has whichever side of it is kept, and however it was given.
ClipPlane canonical(ClipPlane plane) {
    for (int axis = 0; axis < 3; ++axis) {
        if (plane.normal[axis] == 0) continue;
        if (plane.normal[axis] < 0) {
            plane.normal = -plane.normal;
            plane.offset = -plane.offset;
            plane.above = !plane.above;
        }
        break;
    }
    plane.normal += 0.0;  // no -0
    // Vertices of the mesh are floats: of an axis, those on the plane can be exactly there.
    if (plane.normal.x + plane.normal.y + plane.normal.z == 1) plane.offset = double{static_cast<float>(plane.offset)};
    return plane;
}

std::optional<ClipPlane> axis_plane(const std::string& word) {
    if (word.size() < 3 || word[0] < 'x' || word[0] > 'z' || (word[1] != '<' && word[1] != '>')) return std::nullopt;
    const auto numbers = numbers_of(word.substr(2));
    if (!numbers || numbers->size() != 1) return std::nullopt;
    ClipPlane plane{glm::dvec3(0), numbers->front(), word[1] == '>'};
    plane.normal[word[0] - 'x'] = 1;
    return canonical(plane);
}

// Kept is what is left of the way from one point to the other, seen from above.
std::optional<ClipPlane> line_plane(const std::string& word, tiles::UpAxis up) {
    const auto numbers = numbers_of(word);
    if (!numbers || numbers->size() != 4) return std::nullopt;
    std::pair from((*numbers)[0], (*numbers)[1]), to((*numbers)[2], (*numbers)[3]);
    if (from == to) return std::nullopt;
    // Rounding is the same whichever way it is given.
    const bool turned = to < from;
    if (turned) std::swap(from, to);
    const glm::dvec2 way(to.first - from.first, to.second - from.second);
    const glm::dvec2 left = glm::dvec2(-way.y, way.x) / glm::length(way);
    ClipPlane plane;
    plane.normal = up == tiles::UpAxis::z ? glm::dvec3(left.x, left.y, 0) : glm::dvec3(left.x, 0, -left.y);
    plane.offset = left.x * from.first + left.y * from.second;
    plane.above = !turned;
    return canonical(plane);
}

}  // namespace

void add_clip_option(CLI::App& command, std::vector<std::string>& words) {
    command
        .add_option(
            "--clip", words,
            "Cut a piece out of a mesh that closes with the pieces beside it: x<NUMBER or x>NUMBER (or y, z), or "
            "EAST,NORTH,EAST,NORTH for what is left of the line from the one place to the other; all of those "
            "given")
        ->allow_extra_args(false);
}

Result<std::vector<ClipPlane>> clip_planes_of(const std::vector<std::string>& words, tiles::UpAxis up) {
    std::vector<ClipPlane> planes;
    for (const std::string& word : words) {
        auto plane = axis_plane(word);
        if (!plane) plane = line_plane(word, up);
        if (!plane)
            return fail(Fault::usage, "--clip " + printable(word) +
                                          ": must be x<NUMBER, x>NUMBER (or y, z), or the two places of a line, "
                                          "EAST,NORTH,EAST,NORTH");
        planes.push_back(*plane);
    }
    return planes;
}

Result<Scene> scene_of_piece(Scene scene, const std::vector<ClipPlane>& planes, const std::string& input) {
    const std::filesystem::path file = input;
    const bool is_mesh = !scene.assets.empty() && std::ranges::all_of(scene.assets, [&](const SceneAsset& asset) {
        return !asset.generated && !asset.is_lode() && asset.file.filename() == file.filename();
    });
    if (!is_mesh) return fail(Fault::usage, printable(input) + ": --clip cuts a mesh; give the file of the mesh");
    SceneAsset whole = scene.assets.front();
    whole.gltf_mesh = -1;
    scene.assets = {whole};
    scene.instances.assign(1, SceneInstance{});
    scene.clip = planes;
    return scene;
}

Result<tiles::PieceOfSource> read_piece(const Scene& scene, const Progress& progress) {
    progress.at("the line of --clip", 0);
    ReadOptions read = scene.heights;
    read.allow_outside = scene.allow_outside;
    read.load_images = false;
    auto mesh = read_mesh(scene.assets.front().file, read);
    if (!mesh) return tl::unexpected(mesh.error());
    tiles::PieceOfSource piece;
    piece.whole = bounding_box(mesh->positions);
    piece.planes = scene.clip;
    piece.mesh = std::move(*mesh);
    if (auto done = clip(piece.mesh, scene.clip); !done) return tl::unexpected(done.error());
    if (auto done = repair(piece.mesh, {}, progress); !done) return tl::unexpected(done.error());
    return piece;
}

}  // namespace lodestone
