// Reference systems of EPSG, by PROJ: where a mesh stands on the Earth whose coordinates are those of a map projection.
//
// A tileset has one matrix for all of it, so the map is taken as flat: the matrix agrees with the projection in place
// and first derivatives at one point, the centre of the mesh. So scale, the turn of grid north from true north and what
// shear the projection has are right there, and what is left grows with the square of the distance.
//
// Nothing is fetched from the network.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "base/result.h"
#include "tiles/placement.h"

namespace lodestone::tiles {

// How a map stands on the Earth.
struct FlatPlacement {
    glm::dmat4 to_earth{1};  // from east, north and up of the system to EPSG 4978
    double off = 0;  // metres: how far that is from the projection itself, the largest of 17 x 17 x 3 points of the box
    double longitude = 0, latitude = 0, height = 0;  // of the box's centre: WGS 84, degrees and metres
    std::string operation;                           // how PROJ comes from the system to WGS 84
    std::optional<double> accuracy;                  // metres, of that, as EPSG has it; absent where it is not known
    double outside = 0;  // degrees that the centre is outside of the system's area of use, 0 .. most_outside
};

// A map is often used beyond the borders of its zone: so far its centre may be outside, half the width of a UTM zone.
inline constexpr double most_outside = 3;

class ReferenceSystem {
public:
    // Whether this build has PROJ. Without, of() fails.
    static bool is_built_in();
    // A projected system, or a compound one of that and heights. Fault::usage for another code; Fault::machine where
    // PROJ or its database is not there. Messages begin with "--epsg CODE: ".
    static Result<ReferenceSystem> of(int code);

    ReferenceSystem(ReferenceSystem&&) noexcept;
    ReferenceSystem& operator=(ReferenceSystem&&) noexcept;
    ~ReferenceSystem();

    const std::string& name() const { return name_; }
    // Whether heights are those of a vertical system. Else they are metres above the ellipsoid of WGS 84.
    bool has_heights() const { return has_heights_; }

    // box: around the mesh, in the system's units to the east, to the north (whatever order EPSG has them in) and up.
    // Fault::format where it does not lie in the system's area of use, or the system has its axes mirrored;
    // Fault::machine where PROJ lacks a grid of shifts or heights without which places would be wrong.
    Result<FlatPlacement> place(const TileBox& box) const;

private:
    struct Proj;
    explicit ReferenceSystem(std::unique_ptr<Proj> proj);

    std::unique_ptr<Proj> proj_;
    std::string name_;
    bool has_heights_ = false;
};

}  // namespace lodestone::tiles
