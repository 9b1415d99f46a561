#include "apps/scene/scene_volumes.h"

#include <algorithm>
#include <charconv>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>

#include "base/files/file.h"
#include "base/random.h"

namespace lodestone {

namespace {

// A colour, or one for each end.
Result<void> colours(const Node& node, volume::Look& look) {
    const auto found = node.json.find("colour");
    if (found == node.json.end()) return {};
    const bool two = found->is_array() && !found->empty() && (*found)[0].is_array();
    const Json ends = two ? *found : Json::array({*found, *found});
    if (ends.size() != 2) return node.wrong("colour must be three numbers, or two times three");
    glm::vec3* const into[] = {&look.colour_from, &look.colour_to};
    for (size_t end = 0; end < 2; ++end) {
        const Json colour{{"colour", ends[end]}};
        if (auto done = vector(Node{colour, node.place}, "colour", *into[end]); !done) return done;
        for (int c = 0; c < 3; ++c) {
            if ((*into[end])[c] < 0 || (*into[end])[c] > 1) return node.wrong("colour must have numbers from 0 to 1");
        }
    }
    return {};
}

// A number, or one for each end.
Result<void> ends(const Node& node, const char* key, float& from, float& to, float low, float high) {
    const auto found = node.json.find(key);
    if (found == node.json.end()) return {};
    const Json both = found->is_array() ? *found : Json::array({*found, *found});
    const auto wrong = [&] {
        return node.wrong(std::string(key) + " must be a number from " + std::to_string(low) + " to " +
                          std::to_string(high) + ", or two of them");
    };
    if (both.size() != 2) return wrong();
    for (size_t k = 0; k < 2; ++k) {
        const Json one{{"end", both[k]}};
        if (!number(Node{one, node.place}, "end", k == 0 ? from : to, low, high)) return wrong();
    }
    return {};
}

Result<void> table(const Node& node, volume::Look& look) {
    const auto found = node.json.find("table");
    if (found == node.json.end()) return {};
    const auto wrong = [&] {
        return node.wrong("table must be 2 to 256 times [red, green, blue, density], each from 0 to 1");
    };
    if (!found->is_array() || found->size() < 2 || found->size() > 256) return wrong();
    for (const Json& entry : *found) {
        if (!entry.is_array() || entry.size() != 4) return wrong();
        glm::vec4 value;
        for (size_t c = 0; c < 4; ++c) {
            if (!entry[c].is_number() || !(entry[c].get<float>() >= 0) || !(entry[c].get<float>() <= 1)) return wrong();
            value[static_cast<int>(c)] = entry[c].get<float>();
        }
        look.table.push_back(value);
    }
    return {};
}

Result<volume::Look> look_from(const Node& node) {
    std::string name = "smoke", by;
    auto done = all([&] { return text(node, "look", name); }, [&] { return text(node, "colour_by", by); });
    if (!done) return tl::unexpected(done.error());
    if (name != "smoke" && name != "fire") return node.wrong("look '" + name + "' is not known; take smoke or fire");
    volume::Look look = name == "fire" ? volume::fire_look() : volume::smoke_look();
    constexpr std::pair<const char*, volume::ColourBy> choices[] = {{"radius", volume::ColourBy::radius},
                                                                    {"displacement", volume::ColourBy::displacement},
                                                                    {"heat", volume::ColourBy::heat}};
    if (!by.empty()) {
        const auto* choice = std::ranges::find(choices, by, [](const auto& c) { return std::string(c.first); });
        if (choice == std::end(choices))
            return node.wrong("colour_by '" + by + "' is not known; take radius, displacement or heat");
        look.colour_by = choice->second;
    }
    done = all([&] { return colours(node, look); },
               [&] { return ends(node, "density", look.density_from, look.density_to, 0, 1e6f); },
               [&] { return number(node, "scatter_share", look.scatter, 0, 1); },
               [&] { return number(node, "emission", look.emission, 0, 1000); }, [&] { return table(node, look); });
    if (!done) return tl::unexpected(done.error());
    return look;
}

Result<volume::Emitter> emitter_from(const Node& node) {
    volume::Emitter e;
    uint64_t particles = e.particles;
    auto done = all([&] { return vector(node, "position", e.position); },
                    [&] { return number(node, "spread", e.spread, 0, 1e6f); },
                    [&] { return vector(node, "velocity", e.velocity); },
                    [&] { return number(node, "velocity_spread", e.velocity_spread, 0, 1e6f); },
                    [&] { return vector(node, "acceleration", e.acceleration); },
                    [&] { return whole(node, "particles", particles, 1, 4096); },
                    [&] { return number(node, "lifetime", e.lifetime, 0.01f, 1e6f); },
                    [&] { return ends(node, "radius", e.radius_from, e.radius_to, 1e-6f, 1e6f); },
                    [&] { return number(node, "displacement", e.displacement, 0, 0.9f); },
                    [&] { return number(node, "turning", e.turning, 0, 100); },
                    [&] { return number(node, "fade", e.fade, 0, 0.5f); },
                    [&] { return whole(node, "seed", e.seed, 0, ~uint64_t{0}); });
    if (!done) return tl::unexpected(done.error());
    e.particles = static_cast<uint32_t>(particles);
    auto look = look_from(node);
    if (!look) return tl::unexpected(look.error());
    e.look = std::move(*look);
    return e;
}

const std::set<std::string> members_of_all = {"comment",  "look",  "colour",   "density", "scatter_share",
                                              "emission", "table", "position", "scatter"};
const std::set<std::string> members_of_particles = {"colour_by",    "spread",    "velocity", "velocity_spread",
                                                    "acceleration", "particles", "lifetime", "radius",
                                                    "displacement", "turning",   "fade",     "seed"};
const std::set<std::string> members_of_grids = {"grid", "scale", "axis", "angle_degrees"};

// Those that are known, of particles or of a grid.
Result<void> known_members(const Node& node) {
    std::set<std::string> known = members_of_all;
    const bool has_grid = node.json.is_object() && node.json.contains("grid");
    const auto& own = has_grid ? members_of_grids : members_of_particles;
    const auto& others = has_grid ? members_of_particles : members_of_grids;
    for (const std::string& name : others) {
        if (node.json.is_object() && node.json.contains(name))
            return node.wrong(has_grid ? name + " is of particles; a volume with a grid has none"
                                       : name + " is of grids; the volume has none");
    }
    known.insert(own.begin(), own.end());
    return only_members(node, known);
}

// A volume that is a grid: which one, and how it stands there.
Result<volume::Emitter> grid_from(const Node& node, const Beside& beside, SceneGrid& grid) {
    volume::Emitter e;
    e.particles = 1;
    const Json& given = node.json["grid"];
    std::string file;
    const Json named = given.is_string() ? Json{{"file", given}} : given;
    const Node of{named, node.place + ".grid"};
    if (!named.is_object()) return of.wrong("must be the name of a file, or an object with its file and name");
    glm::vec3 axis(0, 1, 0);
    float angle = 0;
    auto done = all(
        [&] {
            return only_members(of, {"file", "name"});
        },
        [&] { return text(of, "file", file); }, [&] { return text(of, "name", grid.name); },
        [&] { return vector(node, "position", e.position); },
        [&] { return number(node, "scale", e.grid_scale, 1e-6f, 1e6f); }, [&] { return vector(node, "axis", axis); },
        [&] { return number(node, "angle_degrees", angle, -36000, 36000); });
    if (!done) return tl::unexpected(done.error());
    if (file.empty()) return of.wrong("file is missing");
    if (glm::length(axis) == 0) return node.wrong("axis must not be zero");
    auto path = path_named_by(beside.scene, file, beside.allow_outside);
    if (!path) return tl::unexpected(path.error());
    grid.file = *path;
    e.grid_turn = glm::angleAxis(glm::radians(angle), glm::normalize(axis));
    auto look = look_from(node);
    if (!look) return tl::unexpected(look.error());
    // Other than a particle, a grid is thinner outside by itself.
    if (!node.json.contains("density")) look->density_to = look->density_from;
    e.look = std::move(*look);
    return e;
}

// The volume itself, or many of it.
Result<void> place(const Node& node, const volume::Emitter& emitter, std::vector<volume::Emitter>& into) {
    const auto found = node.json.find("scatter");
    if (found == node.json.end()) {
        into.push_back(emitter);
        return {};
    }
    const Node scatter{*found, node.place + ".scatter"};
    uint64_t count = 0, seed = 1;
    glm::vec2 area(1);
    auto done = all(
        [&] {
            return only_members(scatter, {"count", "area", "seed"});
        },
        [&] { return whole(scatter, "count", count, 1, 4096); },
        [&] { return whole(scatter, "seed", seed, 0, ~uint64_t{0}); },
        [&] { return pair(scatter, "area", area, true); });
    if (!done) return done;
    if (count == 0) return scatter.wrong("count is missing");
    const ScatteredPlaces places(count, area);
    Random random(mix64(seed));
    for (uint64_t i = 0; i < count; ++i) {
        volume::Emitter one = emitter;
        one.position += places.place(i, random);
        one.seed = mix64(emitter.seed + i);
        into.push_back(std::move(one));
    }
    return {};
}

Result<void> read_options(const Node& node, SceneVolumes& into) {
    uint64_t metavoxels = into.options.metavoxels, voxels = into.options.voxels, pool_mib = 256;
    uint64_t divisor = into.quality.divisor, refresh = into.quality.refresh, cache = into.quality.cache;
    std::string absorption = "exp";
    auto done = all(
        [&] {
            return only_members(node, {"metavoxels", "voxels", "pool_mib", "forward", "steps", "divisor", "refresh",
                                       "absorption", "cache"});
        },
        [&] { return whole(node, "metavoxels", metavoxels, 1, volume::most_metavoxels); },
        [&] { return whole(node, "voxels", voxels, 8, 32); },
        [&] { return whole(node, "pool_mib", pool_mib, 2, 1024); },
        [&] { return number(node, "forward", into.options.forward, 0, 0.95f); },
        [&] { return number(node, "steps", into.quality.steps, 0.125f, 4); },
        [&] { return whole(node, "divisor", divisor, 1, 4); }, [&] { return whole(node, "refresh", refresh, 0, 1000); },
        [&] { return whole(node, "cache", cache, 0, 1000000); }, [&] { return text(node, "absorption", absorption); });
    if (!done) return done;
    if (absorption != "exp" && absorption != "rational")
        return node.wrong("absorption '" + absorption + "' is not known; take exp or rational");
    into.options.metavoxels = static_cast<uint32_t>(metavoxels);
    into.options.voxels = static_cast<uint32_t>(voxels);
    into.options.pool_bytes = pool_mib << 20;
    into.quality.divisor = static_cast<uint32_t>(divisor);
    into.quality.refresh = static_cast<uint32_t>(refresh);
    into.quality.cache = static_cast<uint32_t>(cache);
    if (absorption == "rational") into.quality.absorption = volume::Absorption::rational;
    return {};
}

}  // namespace

Result<void> read_volumes(const Node& root, const Beside& beside, SceneVolumes& into) {
    const auto volumes = root.json.find("volumes"), options = root.json.find("volume_options");
    if (volumes == root.json.end() && options != root.json.end()) return root.wrong("volume_options need volumes");
    if (volumes == root.json.end()) return {};
    if (!volumes->is_array() || volumes->empty()) return root.wrong("volumes must be an array of at least one");
    uint64_t particles = 0;
    for (size_t i = 0; i < volumes->size(); ++i) {
        const Node node{(*volumes)[i], root.place + ": volumes[" + std::to_string(i) + "]"};
        if (auto known = known_members(node); !known) return known;
        SceneGrid grid;
        const bool has_grid = node.json.contains("grid");
        const auto emitter = has_grid ? grid_from(node, beside, grid) : emitter_from(node);
        if (!emitter) return tl::unexpected(emitter.error());
        grid.first = into.emitters.size();
        if (auto placed = place(node, *emitter, into.emitters); !placed) return placed;
        grid.count = into.emitters.size() - grid.first;
        if (has_grid) into.grids.push_back(std::move(grid));
        particles = 0;
        for (const volume::Emitter& e : into.emitters) particles += e.particles;
        if (particles > most_particles)
            return node.wrong("with it there are " + std::to_string(particles) + " particles; a scene takes " +
                              std::to_string(most_particles));
    }
    if (options == root.json.end()) return {};
    return read_options({*options, root.place + ": volume_options"}, into);
}

Result<void> choose_volumes(const std::string& option, const std::string& word, volume::Quality& quality) {
    quality.by_metavoxel = word == "reference";
    if (quality.by_metavoxel || word == "on") return {};
    uint32_t level = 0;
    const auto read = std::from_chars(word.data(), word.data() + word.size(), level);
    if (read.ptr != word.data() + word.size() || level < volume::lowest_level || level > volume::highest_level)
        return fail(Fault::usage, option + " " + word + ": choose on, off, reference, or a quality from " +
                                      std::to_string(volume::lowest_level) + " to " +
                                      std::to_string(volume::highest_level));
    quality = volume::at_level(quality, level);
    return {};
}

}  // namespace lodestone
