// Where `tile` puts a tileset: on a plane at a place, or where a projected reference system says that it stands.
#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>

#include "base/json.h"
#include "base/progress.h"
#include "base/result.h"
#include "tiles/reference_system.h"
#include "tiles/tile_glb.h"

namespace lodestone {

struct PlaceOptions {
    std::optional<double> longitude, latitude, height;
    std::optional<int> epsg;
    std::optional<std::string> origin;  // EAST,NORTH[,UP]
    std::string up;                     // y, z, or empty where it was not given
};
void add_place_options(CLI::App& command, PlaceOptions& o);

class TilePlace {
public:
    // input: the file, whose format may say which axis is up. Fault::usage where options contradict each other.
    static Result<TilePlace> of(const PlaceOptions& o, const std::string& input);

    tiles::UpAxis up() const { return up_; }
    // The root's transform, for a mesh in axes of tiles with that box around. Warns where the Earth is not as flat as
    // that, or the mesh's floats are coarse.
    Result<glm::dmat4> transform(const tiles::TileBox& box, const Progress& progress);

    // What is known of the place after transform(), of a reference system alone.
    std::optional<Json> json() const;
    std::string summary() const;  // a line; empty without a reference system

private:
    tiles::UpAxis up_ = tiles::UpAxis::y;
    glm::dmat4 plane_{1};  // without a reference system: the transform itself
    std::optional<tiles::ReferenceSystem> system_;
    int epsg_ = 0;
    glm::dvec3 origin_{0};  // of the mesh, in the system
    tiles::FlatPlacement placement_;
};

}  // namespace lodestone
