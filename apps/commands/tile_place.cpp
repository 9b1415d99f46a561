#include "apps/commands/tile_place.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <glm/ext/matrix_transform.hpp>
#include <limits>
#include <utility>

#include "base/text.h"

namespace lodestone {

namespace {

namespace fs = std::filesystem;

// Transformations between datums are good to a metre, most of them: a plane that is off by no more changes little.
constexpr double most_off = 1;  // metres

// Half of what floats are apart: what is lost is a hundredth of a unit at most up to coordinates of 2^18.
constexpr double most_rounding = 0.01;

std::string with_decimals(const char* format, double value) {
    char text[64];
    std::snprintf(text, sizeof text, format, value);
    return text;
}

Result<glm::dvec3> origin_named(const std::string& text) {
    const auto wrong = [&] {
        return fail(Fault::usage, "--epsg-origin " + text + ": must be EAST,NORTH or EAST,NORTH,UP, numbers each");
    };
    glm::dvec3 origin(0);
    const char *at = text.data(), *end = at + text.size();
    int count = 0;
    for (;; ++at) {
        if (count == 3) return wrong();
        const auto [next, error] = std::from_chars(at, end, origin[count]);
        if (error != std::errc() || !std::isfinite(origin[count])) return wrong();
        ++count;
        at = next;
        if (at == end) break;
        if (*at != ',') return wrong();
    }
    if (count < 2) return wrong();
    return origin;
}

// Which axis a format has up, where it says so: glTF, and height maps as they are read.
std::optional<tiles::UpAxis> up_of_format(const std::string& input) {
    fs::path path = input;
    if (path.extension() == ".gz") path = path.stem();
    std::string extension = path.extension().string();
    for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    for (const char* y_up : {".gltf", ".glb", ".png", ".tif", ".tiff"}) {
        if (extension == y_up) return tiles::UpAxis::y;
    }
    if (extension == ".lode" || extension == ".json") return std::nullopt;
    return tiles::UpAxis::z;
}

Result<glm::dmat4> plane_of(const PlaceOptions& o) {
    if (!o.longitude && !o.latitude) {
        if (o.height) return fail(Fault::usage, "--height: give --lon and --lat with it");
        return glm::dmat4(1);
    }
    if (!o.longitude || !o.latitude) return fail(Fault::usage, "tile: give both of --lon and --lat, or neither");
    return tiles::east_north_up(*o.longitude, *o.latitude, o.height.value_or(0));
}

}  // namespace

Result<TilePlace> TilePlace::of(const PlaceOptions& o, const std::string& input) {
    TilePlace place;
    if (!o.up.empty()) place.up_ = o.up == "z" ? tiles::UpAxis::z : tiles::UpAxis::y;
    if (!o.epsg) {
        if (o.origin) return fail(Fault::usage, "--epsg-origin: give --epsg with it");
        const auto plane = plane_of(o);
        if (!plane) return tl::unexpected(plane.error());
        place.plane_ = *plane;
        return place;
    }
    if (o.longitude || o.latitude || o.height)
        return fail(Fault::usage, "tile: --epsg says where the mesh stands; leave out --lon, --lat and --height");
    place.epsg_ = *o.epsg;
    if (o.origin) {
        const auto origin = origin_named(*o.origin);
        if (!origin) return tl::unexpected(origin.error());
        place.origin_ = *origin;
    }
    if (o.up.empty()) {
        const auto up = up_of_format(input);
        if (!up)
            return fail(Fault::usage,
                        printable(input) + ": does not say which axis is up; give --up y or --up z with --epsg");
        place.up_ = *up;
    }
    auto system = tiles::ReferenceSystem::of(*o.epsg);
    if (!system) return tl::unexpected(system.error());
    place.system_ = std::move(*system);
    return place;
}

Result<glm::dmat4> TilePlace::transform(const tiles::TileBox& box, const Progress& progress) {
    if (!system_) return plane_;
    const auto placement = system_->place({box.centre + origin_, box.half});
    if (!placement) return tl::unexpected(placement.error());
    placement_ = *placement;
    const glm::dvec3 farthest = glm::abs(box.centre) + box.half;
    const auto largest = static_cast<float>(std::max({farthest.x, farthest.y, farthest.z}));
    const double rounding = (std::nextafter(largest, std::numeric_limits<float>::infinity()) - largest) / 2;
    if (rounding > most_rounding)
        progress.warning("coordinates as large as " + with_decimals("%.0f", largest) +
                         " are floats, rounded by up to " + with_decimals("%.2g", rounding) +
                         "; take a round number off them in the file, and give it as --epsg-origin");
    if (placement_.outside > 0)
        progress.warning("the middle of the mesh is " + with_decimals("%.2g", placement_.outside) +
                         " degrees outside of the area that EPSG:" + std::to_string(epsg_) + " is used in");
    if (placement_.off > most_off)
        progress.warning("the mesh is placed as if the map were flat, up to " + with_decimals("%.3g", placement_.off) +
                         " m from where EPSG:" + std::to_string(epsg_) + " has it; tile it in smaller pieces");
    return placement_.to_earth * glm::translate(glm::dmat4(1), origin_);
}

std::optional<Json> TilePlace::json() const {
    if (!system_) return std::nullopt;
    Json json = {{"epsg", epsg_},
                 {"system", system_->name()},
                 {"longitude", placement_.longitude},
                 {"latitude", placement_.latitude},
                 {"height", placement_.height},
                 {"flat_off_metres", placement_.off},
                 {"operation", placement_.operation},
                 {"accuracy_metres", nullptr}};
    if (placement_.accuracy) json["accuracy_metres"] = *placement_.accuracy;
    return json;
}

std::string TilePlace::summary() const {
    if (!system_) return {};
    std::string text = "EPSG:" + std::to_string(epsg_) + " (" + printable(system_->name()) + "), heights ";
    text += system_->has_heights() ? "as it has them" : "above the ellipsoid of WGS 84";
    text += ": around " + with_decimals("%.6f", placement_.longitude) + " degrees east, " +
            with_decimals("%.6f", placement_.latitude) + " north; a flat frame is off by " +
            with_decimals("%.3g", placement_.off) + " m at most";
    if (placement_.accuracy && *placement_.accuracy > 0)
        text += "; PROJ's way to WGS 84 is good to " + with_decimals("%.3g", *placement_.accuracy) + " m";
    return text;
}

void add_place_options(CLI::App& command, PlaceOptions& o) {
    command.add_option("--lon", o.longitude, "Degrees east (WGS 84) where the mesh's origin stands on the Earth")
        ->check(CLI::Range(-180.0, 180.0));
    command.add_option("--lat", o.latitude, "Degrees north where it stands")->check(CLI::Range(-90.0, 90.0));
    command.add_option("--height", o.height, "Metres above the ellipsoid where it stands; 0 unless given")
        ->check(CLI::Range(-1e7, 1e9));
    command
        .add_option(
            "--epsg", o.epsg,
            "In place of these: code of the projected reference system that the mesh's coordinates are of, such as "
            "32632; heights are metres above the ellipsoid of WGS 84, or those of a compound system")
        ->check(CLI::Range(1, 999999));
    command.add_option("--epsg-origin", o.origin,
                       "EAST,NORTH or EAST,NORTH,UP of the mesh's origin in that system, added to its coordinates");
    command
        .add_option(
            "--up", o.up,
            "Axis of the mesh that points up: y (x is east, z south) or z (x is east, y north). Unless given y; with "
            "--epsg z, but y of glTF and height maps")
        ->check(CLI::IsMember({"y", "z"}));
}

}  // namespace lodestone
