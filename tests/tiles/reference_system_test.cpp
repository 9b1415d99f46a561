// Where projected reference systems stand on the Earth, against formulas of the projections and published places.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <numbers>
#include <random>

#include "tiles/reference_system.h"

namespace lodestone::tiles {
namespace {

using testing::HasSubstr;

constexpr double degrees = 180 / std::numbers::pi;
constexpr double equator = 6378137.0, wgs84_flattening = 1 / 298.257223563;

struct Place {
    double longitude, latitude;  // degrees
};

// Spherical formulas on an ellipsoid's latitude. EPSG method 1024.
Place web_mercator(double x, double y) {
    return {x / equator * degrees, 2 * std::atan(std::exp(y / equator)) * degrees - 90};
}

// Krueger's series, to the fourth order of n: good to less than a micrometre here. GRS 80 differs from WGS 84 by less.
// Source: Karney, "Transverse Mercator with an accuracy of a few nanometers", 2011, equations 11 to 15, 25 and 36.
Place utm_north(double central_meridian, double x, double y) {
    const double f = wgs84_flattening, n = f / (2 - f), n2 = n * n, e = std::sqrt(f * (2 - f));
    const double radius = equator / (1 + n) * (1 + n2 / 4 + n2 * n2 / 64) * 0.9996;
    const std::array<double, 4> beta = {n / 2 - 2 * n2 / 3 + 37 * n * n2 / 96 - n2 * n2 / 360,
                                        n2 / 48 + n * n2 / 15 - 437 * n2 * n2 / 1440,
                                        17 * n * n2 / 480 - 37 * n2 * n2 / 840, 4397 * n2 * n2 / 161280};
    const double xi = y / radius, eta = (x - 500000) / radius;
    double xi_sphere = xi, eta_sphere = eta;
    for (size_t j = 0; j < beta.size(); ++j) {
        const double k = 2.0 * static_cast<double>(j + 1);
        xi_sphere -= beta[j] * std::sin(k * xi) * std::cosh(k * eta);
        eta_sphere -= beta[j] * std::cos(k * xi) * std::sinh(k * eta);
    }
    const double conformal = std::sin(xi_sphere) / std::cosh(eta_sphere);  // sine of the conformal latitude
    double sine = conformal;
    for (int i = 0; i < 20; ++i) sine = std::tanh(std::atanh(conformal) + e * std::atanh(e * sine));
    return {central_meridian + std::atan2(std::sinh(eta_sphere), std::cos(xi_sphere)) * degrees,
            std::asin(sine) * degrees};
}

glm::dvec3 on_earth(const Place& place, double height) {
    return glm::dvec3(east_north_up(place.longitude, place.latitude, height)[3]);
}
glm::dvec3 placed(const FlatPlacement& placement, const glm::dvec3& at) {
    return glm::dvec3(placement.to_earth * glm::dvec4(at, 1));
}

class ReferenceSystemTest : public testing::Test {
protected:
    void SetUp() override {
        if (!ReferenceSystem::is_built_in()) GTEST_SKIP() << "built without PROJ";
    }
    static FlatPlacement place(int code, const glm::dvec3& centre, const glm::dvec3& half = {100, 50, 10}) {
        const auto system = ReferenceSystem::of(code);
        if (!system) {
            ADD_FAILURE() << system.error().message;
            return {};
        }
        const auto placement = system->place({centre, half});
        EXPECT_TRUE(placement) << placement.error().message;
        return placement ? *placement : FlatPlacement{};
    }
    static Error error_of(int code, const glm::dvec3& centre = {0, 0, 0}) {
        const auto system = ReferenceSystem::of(code);
        if (!system) return system.error();
        const auto placement = system->place({centre, glm::dvec3(10)});
        EXPECT_FALSE(placement);
        return placement ? Error{} : placement.error();
    }
    // Largest distance of the placement from the projection, over random points of the box and its corners.
    template <class Exact>
    static double farthest(const FlatPlacement& placement, const TileBox& box, const Exact& exact) {
        std::mt19937 random(7);
        std::uniform_real_distribution<double> sideways(-1, 1);
        double off = 0;
        for (int i = 0; i < 20008; ++i) {
            const glm::dvec3 corner(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1);
            const glm::dvec3 at = i < 8 ? corner : glm::dvec3(sideways(random), sideways(random), sideways(random));
            const glm::dvec3 point = box.centre + at * box.half;
            off = std::max(off, glm::distance(placed(placement, point), on_earth(exact(point.x, point.y), point.z)));
        }
        return off;
    }
};

// The example of EPSG Guidance Note 7-2 for method 1024: 24 22'54.433" north, 100 20' west.
TEST_F(ReferenceSystemTest, WebMercatorStandsWhereItsExampleDoes) {
    const Place published{-(100 + 20 / 60.0), 24 + 22 / 60.0 + 54.433 / 3600};
    const FlatPlacement is = place(3857, {-11169055.58, 2800000, 120});
    EXPECT_NEAR(is.longitude, published.longitude, 1e-7);
    EXPECT_NEAR(is.latitude, published.latitude, 1e-7);
    EXPECT_NEAR(is.height, 120, 1e-9);
    EXPECT_LT(glm::distance(placed(is, {-11169055.58, 2800000, 120}), on_earth(published, 120)), 0.02);
    // A metre of this map is shorter on the ground, by the ellipsoid's two radii of curvature, and a metre of height is
    // one.
    const double latitude = published.latitude / degrees;
    const double e2 = wgs84_flattening * (2 - wgs84_flattening), w2 = 1 - e2 * std::pow(std::sin(latitude), 2);
    const double across = equator / std::sqrt(w2), along = equator * (1 - e2) / std::pow(w2, 1.5);
    const glm::dmat4 enu = east_north_up(published.longitude, published.latitude, 120);
    const double to_ground = std::cos(latitude) / equator;
    EXPECT_LT(glm::distance(glm::dvec3(is.to_earth[0]), glm::dvec3(enu[0]) * ((across + 120) * to_ground)), 1e-8);
    EXPECT_LT(glm::distance(glm::dvec3(is.to_earth[1]), glm::dvec3(enu[1]) * ((along + 120) * to_ground)), 1e-8);
    EXPECT_LT(glm::distance(glm::dvec3(is.to_earth[2]), glm::dvec3(enu[2])), 1e-8);
}

TEST_F(ReferenceSystemTest, UtmStandsWhereItsSeriesSays) {
    for (const glm::dvec3 at : {glm::dvec3(500000, 5300000, 0), glm::dvec3(700000, 5300000, 400),
                                glm::dvec3(312345.5, 4523456.25, -20), glm::dvec3(420000, 8800000, 3000)}) {
        for (const int code : {32632, 25832}) {
            const FlatPlacement is = place(code, at);
            EXPECT_LT(glm::distance(placed(is, at), on_earth(utm_north(9, at.x, at.y), at.z)), 1e-3)
                << code << " " << at.x;
            EXPECT_LT(is.off, 0.01);
            EXPECT_GT(is.off, 1e-5);
            EXPECT_EQ(is.accuracy, code == 25832 ? 1.0 : 0.0);  // ETRS89 to WGS 84; none
        }
    }
}

// Grid north is turned from north by the convergence, to the east where the central meridian is to the west; the scale
// is that of the projection.
TEST_F(ReferenceSystemTest, FrameIsThatOfTheProjectionAndNotOfNorth) {
    const FlatPlacement is = place(32632, {700000, 5300000, 0});
    const glm::dmat4 enu = east_north_up(is.longitude, is.latitude, 0);
    const double convergence =
        std::atan(std::tan((is.longitude - 9) / degrees) * std::sin(is.latitude / degrees));  // to 1e-5
    const double scale = 0.9996 * (1 + std::pow(200000 / 0.9996 / 6.381e6, 2) / 2);           // to 1e-6
    const auto along = [&](int column, int axis) {
        return glm::dot(glm::dvec3(is.to_earth[column]), glm::dvec3(enu[axis]));
    };
    EXPECT_GT(convergence, 0.03);
    EXPECT_NEAR(along(1, 0), std::sin(convergence) / scale, 2e-5);
    EXPECT_NEAR(along(1, 1), std::cos(convergence) / scale, 2e-6);
    EXPECT_NEAR(along(0, 0), std::cos(convergence) / scale, 2e-6);
    EXPECT_NEAR(along(0, 1), -std::sin(convergence) / scale, 2e-5);
    EXPECT_NEAR(along(0, 2), 0, 1e-9);
    EXPECT_NEAR(along(2, 2), 1, 1e-9);
    EXPECT_NEAR(glm::determinant(glm::dmat3(is.to_earth)), 1 / (scale * scale), 2e-6);
}

TEST_F(ReferenceSystemTest, SaysHowFarAFlatFrameIsOff) {
    for (const glm::dvec3 half : {glm::dvec3(10000, 7000, 500), glm::dvec3(300, 2000, 0), glm::dvec3(1, 2, 3)}) {
        const TileBox box{{650000, 5250000, 600}, half};
        const FlatPlacement is = place(32632, box.centre, box.half);
        const auto exact = [](double x, double y) { return utm_north(9, x, y); };
        const double off = farthest(is, box, exact);
        EXPECT_NEAR(is.off, off, 1e-3 * off + 1e-7) << half.x;
        // What the Earth falls off from a plane that touches it.
        EXPECT_NEAR(is.off, (half.x * half.x + half.y * half.y) / (2 * 6.38e6), 0.1 * is.off + 1e-6) << half.x;
    }
    const TileBox box{{1000000, 6000000, 0}, {3000, 2000, 100}};
    const FlatPlacement is = place(3857, box.centre, box.half);
    const double off = farthest(is, box, web_mercator);
    EXPECT_NEAR(is.off, off, 1e-3 * off);
}

// LV95 has its origin, 2,600,000 / 1,200,000, at the old observatory of Bern: on the ellipsoid of Bessel at 7 26'22.50"
// and 46 57'08.66", geocentric places of which are 674.374, 15.056 and 405.346 metres from those of WGS 84, and the
// ellipsoid 49.55 m above the other. Source: swisstopo, "Formulas and constants for the calculation of the Swiss
// conformal cylindrical projection and for the transformation between coordinate systems", 2016; 49.55 and the
// approximate longitude and latitude, good to a metre, from "Approximate solution for the transformation CH1903 -
// WGS84" there.
TEST_F(ReferenceSystemTest, Lv95StandsAtTheObservatoryOfBern) {
    const glm::dvec3 bern(2600000, 1200000, 49.55);
    const FlatPlacement is = place(2056, bern);
    EXPECT_NEAR(is.longitude, 2.6779094 * 100 / 36, 1e-5);
    EXPECT_NEAR(is.latitude, 16.9023892 * 100 / 36, 1e-5);
    const double a = 6377397.155, f = 1 / 299.1528128, e2 = f * (2 - f);  // Bessel 1841
    const double longitude = (7 + 26 / 60.0 + 22.50 / 3600) / degrees;
    const double latitude = (46 + 57 / 60.0 + 8.66 / 3600) / degrees;
    const double normal = a / std::sqrt(1 - e2 * std::pow(std::sin(latitude), 2));
    const glm::dvec3 wanted(normal * std::cos(latitude) * std::cos(longitude) + 674.374,
                            normal * std::cos(latitude) * std::sin(longitude) + 15.056,
                            normal * (1 - e2) * std::sin(latitude) + 405.346);
    const glm::dvec3 from = placed(is, bern) - wanted, up = glm::normalize(wanted);
    EXPECT_NEAR(glm::dot(from, up), 0, 0.1);  // 49.55 is rounded
    EXPECT_LT(glm::length(from - up * glm::dot(from, up)), 0.01);
}

TEST_F(ReferenceSystemTest, XIsEastWhateverOrderEpsgHasItsAxesIn) {
    for (const auto& [code, at] : {std::pair{31467, glm::dvec3(3600000, 5300000, 0)},  // northing first
                                   std::pair{6677, glm::dvec3(20000, -10000, 0)},      // x north, y east
                                   std::pair{2056, glm::dvec3(2700000, 1100000, 0)}}) {
        const FlatPlacement is = place(code, at);
        const glm::dmat4 enu = east_north_up(is.longitude, is.latitude, 0);
        for (int axis = 0; axis < 3; ++axis)
            EXPECT_GT(glm::dot(glm::dvec3(is.to_earth[axis]), glm::dvec3(enu[axis])), 0.99) << code << " " << axis;
    }
    // To the west and to the south, which is a turn; and to the south and the west, which is a mirror.
    const FlatPlacement lo29 = place(2053, {-50000, 3000000, 0});
    EXPECT_GT(lo29.longitude, 29);
    EXPECT_LT(glm::dot(glm::dvec3(lo29.to_earth[0]), glm::dvec3(east_north_up(lo29.longitude, lo29.latitude, 0)[0])),
              -0.99);
    EXPECT_GT(glm::determinant(glm::dmat3(lo29.to_earth)), 0.99);
    EXPECT_THAT(error_of(5513, {1040000, 740000, 0}).message, HasSubstr("mirrored"));
}

// EPSG 2263 is in feet of the US survey, 1200/3937 m; its heights here are metres.
TEST_F(ReferenceSystemTest, FeetAreFeet) {
    const FlatPlacement is = place(2263, {1000000, 200000, 30});
    EXPECT_NEAR(glm::length(glm::dvec3(is.to_earth[0])), 1200 / 3937.0, 3e-5);
    EXPECT_NEAR(glm::length(glm::dvec3(is.to_earth[1])), 1200 / 3937.0, 3e-5);
    EXPECT_NEAR(glm::length(glm::dvec3(is.to_earth[2])), 1, 1e-9);
}

TEST_F(ReferenceSystemTest, StandsWhereItsMapIsUsedOrALittleBeside) {
    EXPECT_EQ(place(32632, {500000, 5300000, 0}).outside, 0);
    EXPECT_NEAR(place(32632, {794328, 5546440, 0}).outside, 1.1, 0.05);  // 13.1 degrees east
    const Error far = error_of(32632, {1100000, 5300000, 0});
    EXPECT_EQ(far.fault, Fault::format);
    EXPECT_THAT(far.message, HasSubstr("6.00 to 12.00 degrees east"));
    EXPECT_THAT(error_of(2056, {600000, 200000, 0}).message, HasSubstr("not where it is used"));  // LV03
    // Zone 1 begins at the antimeridian, and is used a little to the west of it.
    EXPECT_NEAR(place(32601, {230000, 100000, 0}).outside, 0, 0);
    EXPECT_NEAR(place(32601, {100000, 100000, 0}).outside, 0.6, 0.1);
    EXPECT_EQ(error_of(32632, {1e30, 1e30, 0}).fault, Fault::format);
}

TEST_F(ReferenceSystemTest, OtherCodesAreRefused) {
    for (const auto& [code, says] : {std::pair{4326, "is geographic, in degrees"}, std::pair{4979, "is geographic"},
                                     std::pair{4978, "no map projection"}, std::pair{5703, "no map projection"},
                                     std::pair{9518, "no map projection"}, std::pair{99999, "of this code"}}) {
        const Error error = error_of(code);
        EXPECT_EQ(error.fault, Fault::usage) << code;
        EXPECT_THAT(error.message, HasSubstr(says));
        EXPECT_THAT(error.message, HasSubstr("--epsg " + std::to_string(code) + ": "));
    }
}

// Heights of a vertical system are not taken for those above the ellipsoid.
TEST_F(ReferenceSystemTest, HeightsThatPROJCannotConvertAreRefused) {
    const Error error = error_of(5555, {500000, 5700000, 0});  // DHHN92, of which PROJ 9.1 has no grid
    EXPECT_EQ(error.fault, Fault::machine);
    EXPECT_THAT(error.message, HasSubstr("give --epsg 25832 and heights above the ellipsoid"));
}

}  // namespace
}  // namespace lodestone::tiles
