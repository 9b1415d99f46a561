#include "tiles/reference_system.h"

#ifdef LODESTONE_WITH_PROJ

#include <proj.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include "base/text.h"

namespace lodestone::tiles {

namespace {

struct Destroyer {
    void operator()(PJ_CONTEXT* context) const { proj_context_destroy(context); }
    void operator()(PJ* object) const { proj_destroy(object); }
    void operator()(PJ_OBJ_LIST* list) const { proj_list_destroy(list); }
    void operator()(PJ_OPERATION_FACTORY_CONTEXT* factory) const { proj_operation_factory_context_destroy(factory); }
};
template <class Object>
using Owned = std::unique_ptr<Object, Destroyer>;

// WGS 84 on a map, or above the ellipsoid.
struct Geodetic {
    double longitude, latitude, height;  // degrees, metres
    bool finite() const { return std::isfinite(longitude) && std::isfinite(latitude) && std::isfinite(height); }
};

std::string with_decimals(const char* format, double value) {
    std::array<char, 64> text{};
    std::snprintf(text.data(), text.size(), format, value);
    return text.data();
}

// Where a system is used; longitudes from west to east, across the antimeridian where west is the larger.
struct Area {
    double west, south, east, north;  // degrees
    bool known;

    // Degrees, 0 inside.
    double outside(const Geodetic& place) const {
        if (!known) return 0;
        const double width = std::fmod(east - west + 720, 360);
        const double across = width == 0 ? 360 : width;
        const double from_west = std::fmod(place.longitude - west + 720, 360);
        const double sideways = from_west <= across ? 0 : std::min(from_west - across, 360 - from_west);
        return std::max({0.0, sideways, south - place.latitude, place.latitude - north});
    }
    std::string text() const {
        return with_decimals("%.2f", west) + " to " + with_decimals("%.2f", east) + " degrees east, " +
               with_decimals("%.2f", south) + " to " + with_decimals("%.2f", north) + " north";
    }
};

// An operation from x east, y north to longitude and latitude, whatever order of axes EPSG has.
Owned<PJ> east_first(PJ_CONTEXT* context, Owned<PJ> operation) {
    if (!operation) return nullptr;
    return Owned<PJ>(proj_normalize_for_visualization(context, operation.get()));
}

}  // namespace

struct ReferenceSystem::Proj {
    int code = 0;
    Owned<PJ_CONTEXT> context;
    Owned<PJ> system;      // as the code names it
    Owned<PJ> horizontal;  // its projected part
    Owned<PJ> earth;       // WGS 84: with heights where the system has them

    bool has_heights() const { return proj_get_type(system.get()) == PJ_TYPE_COMPOUND_CRS; }
    std::string title() const { return "EPSG:" + std::to_string(code); }
    Owned<PJ> of_database(int of_code) const {
        return Owned<PJ>(proj_create_from_database(context.get(), "EPSG", std::to_string(of_code).c_str(),
                                                   PJ_CATEGORY_CRS, 0, nullptr));
    }

    Area area() const {
        Area area{};
        area.known = proj_get_area_of_use(context.get(), system.get(), &area.west, &area.south, &area.east, &area.north,
                                          nullptr) != 0 &&
                     area.west > -1000;
        return area;
    }

    // Roughly, and without heights: to find out what is to be used there.
    Geodetic roughly(const glm::dvec3& at) const {
        const Owned<PJ> wgs84 = of_database(4326);
        const Owned<PJ> operation = east_first(
            context.get(),
            Owned<PJ>(proj_create_crs_to_crs_from_pj(context.get(), horizontal.get(), wgs84.get(), nullptr, nullptr)));
        if (!operation) return {HUGE_VAL, HUGE_VAL, HUGE_VAL};
        const PJ_COORD there = proj_trans(operation.get(), PJ_FWD, proj_coord(at.x, at.y, 0, 0));
        return {there.xyz.x, there.xyz.y, 0};
    }

    // The best that PROJ can do without fetching anything. What it calls ballpark, as if datums were the same, is none.
    Result<Owned<PJ>> operation_at(const Geodetic& place) const {
        const Owned<PJ_OPERATION_FACTORY_CONTEXT> factory(
            proj_create_operation_factory_context(context.get(), nullptr));
        constexpr double around = 0.05;  // degrees
        proj_operation_factory_context_set_area_of_interest(context.get(), factory.get(), place.longitude - around,
                                                            place.latitude - around, place.longitude + around,
                                                            place.latitude + around);
        proj_operation_factory_context_set_spatial_criterion(context.get(), factory.get(),
                                                             PROJ_SPATIAL_CRITERION_PARTIAL_INTERSECTION);
        proj_operation_factory_context_set_grid_availability_use(context.get(), factory.get(),
                                                                 PROJ_GRID_AVAILABILITY_USED_FOR_SORTING);
        const Owned<PJ_OBJ_LIST> found(proj_create_operations(context.get(), system.get(), earth.get(), factory.get()));
        const int count = found ? proj_list_get_count(found.get()) : 0;
        std::string grids;
        for (int i = 0; i < count; ++i) {
            Owned<PJ> operation(proj_list_get(context.get(), found.get(), i));
            if (proj_coordoperation_has_ballpark_transformation(context.get(), operation.get()) != 0) continue;
            if (proj_coordoperation_is_instantiable(context.get(), operation.get()) != 0) return operation;
            if (grids.empty()) grids = missing_grids(*operation);
        }
        return without_operation(grids);
    }

    std::string missing_grids(const PJ& operation) const {
        std::string names;
        const int count = proj_coordoperation_get_grid_used_count(context.get(), &operation);
        for (int i = 0; i < count; ++i) {
            const char* name = nullptr;
            int there = 0;
            proj_coordoperation_get_grid_used(context.get(), &operation, i, &name, nullptr, nullptr, nullptr, nullptr,
                                              nullptr, &there);
            if (there == 0 && name != nullptr) names += (names.empty() ? "" : ", ") + std::string(name);
        }
        return names;
    }

    tl::unexpected<Error> without_operation(const std::string& grids) const {
        const std::string ways = has_heights() ? "from its places and heights" : "from its places";
        std::string message = title() + ": PROJ knows no way " + ways + " to WGS 84";
        if (!grids.empty()) {
            message = title() + ": the way " + ways + " to WGS 84 needs " + grids +
                      ", which PROJ does not find; put it into PROJ's folder of grids";
        }
        const char* code_of_horizontal = proj_get_id_code(horizontal.get(), 0);
        if (has_heights() && code_of_horizontal != nullptr)
            message += std::string(grids.empty() ? "; " : ", or ") + "give --epsg " + code_of_horizontal +
                       " and heights above the ellipsoid";
        return fail(Fault::machine, message);
    }

    Geodetic geodetic(PJ& operation, const glm::dvec3& at) const {
        const double height = has_heights() ? at.z : 0;
        const PJ_COORD there = proj_trans(&operation, PJ_FWD, proj_coord(at.x, at.y, height, 0));
        return {there.xyz.x, there.xyz.y, has_heights() ? there.xyz.z : at.z};
    }
};

bool ReferenceSystem::is_built_in() { return true; }

ReferenceSystem::ReferenceSystem(std::unique_ptr<Proj> proj) : proj_(std::move(proj)) {
    name_ = as_utf8(proj_get_name(proj_->system.get()));
    has_heights_ = proj_->has_heights();
}

Result<ReferenceSystem> ReferenceSystem::of(int code) {
    const std::string option = "--epsg " + std::to_string(code) + ": ";
    auto proj = std::make_unique<Proj>();
    proj->code = code;
    proj->context.reset(proj_context_create());
    PJ_CONTEXT* context = proj->context.get();
    proj_log_level(context, PJ_LOG_NONE);
    proj_context_set_enable_network(context, 0);
    if (proj_context_get_database_metadata(context, "EPSG.VERSION") == nullptr) {
        return fail(Fault::machine, option +
                                        "PROJ does not find its database, proj.db; install it (Debian: proj-data), or "
                                        "let PROJ_DATA name its folder");
    }
    proj->system = proj->of_database(code);
    if (!proj->system) return fail(Fault::usage, option + "PROJ knows no reference system of this code");
    const std::string named = option + printable(proj_get_name(proj->system.get())) + " ";
    const PJ_TYPE type = proj_get_type(proj->system.get());
    if (type == PJ_TYPE_GEOGRAPHIC_2D_CRS || type == PJ_TYPE_GEOGRAPHIC_3D_CRS) {
        return fail(Fault::usage, named +
                                      "is geographic, in degrees; project the mesh and give the code of that, or put "
                                      "its origin somewhere by --lon and --lat");
    }
    proj->horizontal.reset(type == PJ_TYPE_COMPOUND_CRS ? proj_crs_get_sub_crs(context, proj->system.get(), 0)
                                                        : proj_clone(context, proj->system.get()));
    if (!proj->horizontal || proj_get_type(proj->horizontal.get()) != PJ_TYPE_PROJECTED_CRS)
        return fail(Fault::usage, named + "is no map projection; give the code of one, such as 32632 for UTM zone 32N");
    proj->earth = proj->of_database(proj->has_heights() ? 4979 : 4326);
    return ReferenceSystem(std::move(proj));
}

namespace {

// The map that `exact` is, by its place and first derivatives at a point.
template <class Exact>
glm::dmat4 tangent(const Exact& exact, const glm::dvec3& at) {
    constexpr double step = 100;  // the system's units: PROJ is good to nanometres, derivatives so to 1e-10
    glm::dmat4 matrix(1);
    for (int axis = 0; axis < 3; ++axis) {
        glm::dvec3 ahead(0);
        ahead[axis] = step;
        matrix[axis] = glm::dvec4((exact(at + ahead) - exact(at - ahead)) / (2 * step), 0);
    }
    matrix[3] = glm::dvec4(exact(at) - glm::dmat3(matrix) * at, 1);
    return matrix;
}

// How far two maps are apart in a box, at most. They differ most at corners; if not, near one of the points.
template <class Exact>
double farthest_apart(const Exact& exact, const glm::dmat4& flat, const TileBox& box) {
    constexpr int steps = 16, layers = 2;
    double off = 0;
    for (int z = 0; z <= layers; ++z) {
        for (int y = 0; y <= steps; ++y) {
            for (int x = 0; x <= steps; ++x) {
                const glm::dvec3 at(2.0 * x / steps - 1, 2.0 * y / steps - 1, 2.0 * z / layers - 1);
                const glm::dvec3 point = box.centre + at * box.half;
                const double apart = glm::distance(exact(point), glm::dvec3(flat * glm::dvec4(point, 1)));
                if (!(apart <= off)) off = apart;
            }
        }
    }
    return off;
}

}  // namespace

Result<FlatPlacement> ReferenceSystem::place(const TileBox& box) const {
    const auto wrong = [&](const std::string& what) { return fail(Fault::format, proj_->title() + ": " + what); };
    const std::string there = with_decimals("%.0f", box.centre.x) + " east, " + with_decimals("%.0f", box.centre.y) +
                              " north, the middle of the mesh, ";
    const std::string advice = "; look at the code, at --up and at --epsg-origin";
    const Geodetic rough = proj_->roughly(box.centre);
    if (!rough.finite()) return wrong(there + "is no place on its map" + advice);
    const Area area = proj_->area();
    FlatPlacement placement;
    placement.outside = area.outside(rough);
    if (placement.outside > most_outside)
        return wrong(there + "is not where it is used (" + area.text() + ")" + advice);

    auto found = proj_->operation_at(rough);
    if (!found) return tl::unexpected(found.error());
    const char* name = proj_get_name(found->get());
    placement.operation = as_utf8(name == nullptr ? "" : name);
    const double accuracy = proj_coordoperation_get_accuracy(proj_->context.get(), found->get());
    if (accuracy >= 0) placement.accuracy = accuracy;
    // Where no datum is changed nothing is lost, which PROJ does not say of each.
    if (proj_get_type(found->get()) == PJ_TYPE_CONVERSION) placement.accuracy = 0;
    const Owned<PJ> operation = east_first(proj_->context.get(), std::move(*found));
    if (!operation) return wrong("PROJ cannot take its axes in the order of east and north");

    const Geodetic centre = proj_->geodetic(*operation, box.centre);
    placement.longitude = centre.longitude;
    placement.latitude = centre.latitude;
    placement.height = centre.height;
    const auto exact = [&](const glm::dvec3& at) {
        const Geodetic place = proj_->geodetic(*operation, at);
        return earth_centred(place.longitude, place.latitude, place.height);
    };
    placement.to_earth = tangent(exact, box.centre);
    placement.off = farthest_apart(exact, placement.to_earth, box);
    if (!std::isfinite(placement.off)) return wrong("parts of the mesh are no place on its map" + advice);
    if (!(glm::determinant(glm::dmat3(placement.to_earth)) > 0))
        return wrong(
            "its axes are mirrored, seen from above; give the code of the same map with axes to the east and north");
    return placement;
}

}  // namespace lodestone::tiles

#else

namespace lodestone::tiles {

struct ReferenceSystem::Proj {};

bool ReferenceSystem::is_built_in() { return false; }
ReferenceSystem::ReferenceSystem(std::unique_ptr<Proj> proj) : proj_(std::move(proj)) {}
Result<ReferenceSystem> ReferenceSystem::of(int code) {
    return fail(
        Fault::machine,
        "--epsg " + std::to_string(code) +
            ": this build was made without PROJ; install libproj-dev and configure again, or give --lon and --lat");
}
Result<FlatPlacement> ReferenceSystem::place(const TileBox&) const {
    return fail(Fault::machine, "this build was made without PROJ");
}

}  // namespace lodestone::tiles

#endif

namespace lodestone::tiles {

ReferenceSystem::ReferenceSystem(ReferenceSystem&&) noexcept = default;
ReferenceSystem& ReferenceSystem::operator=(ReferenceSystem&&) noexcept = default;
ReferenceSystem::~ReferenceSystem() = default;

}  // namespace lodestone::tiles
