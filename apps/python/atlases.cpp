// The images of an atlas for Python, as arrays that look into it.
#include "apps/python/binding.h"
#include "vgi/asset/atlas.h"

namespace lodestone::python {

namespace {

using vgi::Atlas;

void check_chart(const Atlas& atlas, uint32_t chart) {
    if (chart >= atlas.charts())
        throw Failure{{Fault::usage, "chart " + std::to_string(chart) + ": the atlas has charts 0 to " +
                                         std::to_string(atlas.charts() - 1)}};
}

py::ssize_t side_of(const Atlas& atlas, uint32_t chart, bool attributes) {
    return (attributes ? atlas.attribute_cells_of(chart) : atlas.cells_of(chart)) + py::ssize_t{1};
}

// The texels of a chart in an image of `per` numbers a texel, without a copy; None where the atlas has no such image.
template <class Number, class Texels>
py::object image(const py::object& self, uint32_t chart, const Texels& texels, py::ssize_t per, bool attributes) {
    const auto& atlas = self.cast<const Atlas&>();
    check_chart(atlas, chart);
    if (texels.empty()) return py::none();
    const py::ssize_t side = side_of(atlas, chart, attributes);
    const size_t first = attributes ? atlas.first_attribute_texel[chart] : atlas.first_texel[chart];
    return view_of<Number>(&texels[first], per == 0 ? std::vector{side, side} : std::vector{side, side, per}, self);
}

template <class Value>
py::array made(const Atlas& atlas, uint32_t chart, bool attributes, Value&& value) {
    check_chart(atlas, chart);
    const py::ssize_t side = side_of(atlas, chart, attributes);
    const size_t first = attributes ? atlas.first_attribute_texel[chart] : atlas.first_texel[chart];
    using Vector = decltype(value(first));
    std::vector<Vector> values(static_cast<size_t>(side * side));
    for (size_t i = 0; i < values.size(); ++i) values[i] = value(first + i);
    return taken_over<float>(std::move(values), {side, side, Vector::length()});
}

py::object uvs(const Atlas& atlas, uint32_t chart) {
    check_chart(atlas, chart);
    if (atlas.uvs.empty()) return py::none();
    return made(atlas, chart, true, [&](size_t texel) {
        return atlas.uv_low + atlas.uv_step * glm::vec2(atlas.uvs[texel][0], atlas.uvs[texel][1]);
    });
}

py::array sides(const Atlas& atlas) {
    std::vector<std::array<int32_t, 2>> sides;
    for (const vgi::GluedSide& side : atlas.sides)
        sides.push_back({static_cast<int32_t>(side.chart), static_cast<int32_t>(side.side)});
    return taken_over<int32_t>(std::move(sides), {static_cast<py::ssize_t>(atlas.charts()), 4, 2});
}

using Self = const py::object&;

const Atlas& atlas_of(Self self) { return self.cast<const Atlas&>(); }

py::object lattice(Self self, uint32_t chart) {
    return image<uint16_t>(self, chart, atlas_of(self).positions, 3, false);
}
py::object error_codes(Self self, uint32_t chart) {
    return image<uint8_t>(self, chart, atlas_of(self).sample_errors, 0, false);
}
py::object colours(Self self, uint32_t chart) { return image<uint8_t>(self, chart, atlas_of(self).colours, 4, true); }
py::object materials(Self self, uint32_t chart) {
    return image<uint16_t>(self, chart, atlas_of(self).materials, 0, true);
}
py::array positions(const Atlas& a, uint32_t chart) {
    return made(a, chart, false, [&](size_t texel) { return a.position(texel); });
}
py::array normals(const Atlas& a, uint32_t chart) {
    return made(a, chart, true, [&](size_t texel) { return a.normal(texel); });
}
py::array errors(Self self) {
    const auto& errors = atlas_of(self).errors;
    return view_of<float>(errors.data(), {static_cast<py::ssize_t>(errors.size())}, self);
}
py::array clusters(Self self) {
    const auto& clusters = atlas_of(self).cluster;
    return view_of<uint32_t>(clusters.data(), {static_cast<py::ssize_t>(clusters.size())}, self);
}
std::shared_ptr<Atlas> decoded(const Asset& asset) {
    return std::make_shared<Atlas>(run_long(py::none(), [&](const Progress&) { return asset.atlas(); }));
}

}  // namespace

void bind_atlases(py::module_& module) {
    py::class_<Atlas, std::shared_ptr<Atlas>>(
        module, "Atlas",
        "The images of an atlas: charts, each a square of samples, glued along their sides into one surface.")
        .def_property_readonly("charts", &Atlas::charts, "How many charts there are.")
        .def_property_readonly("levels", &Atlas::levels, "How many levels there are; level 0 is the finest.")
        .def_property_readonly(
            "cells", [](const Atlas& a) { return a.cells; },
            "Per side of a whole chart's positions: a chart has (cells + 1)^2 samples, fewer where it leaves out its "
            "finest levels.")
        .def_property_readonly(
            "attribute_cells", [](const Atlas& a) { return a.attribute_cells; }, "The same of its attributes.")
        .def_property_readonly(
            "step", [](const Atlas& a) { return a.step; }, "Object units between lattice points.")
        .def_property_readonly(
            "origin", [](const Atlas& a) { return py::make_tuple(a.origin.x, a.origin.y, a.origin.z); },
            "(x, y, z): a position is origin + step * lattice point; object units.")
        .def_property_readonly("errors", errors, "(levels,) float32: two-sided distance to the source, object units.")
        .def_property_readonly("clusters", clusters, "(charts,) uint32: the cluster that a chart is part of.")
        .def_property_readonly("sides", sides,
                               "(charts, 4, 2) int32: the chart, -1 where the surface ends, and the side that each "
                               "side is glued to. Sides run counter-clockwise from that of y = 0.")
        .def("lattice", lattice, py::arg("chart"),
             "(s, s, 3) uint16: lattice points of a chart, y first; looks into the atlas.")
        .def("error_codes", error_codes, py::arg("chart"),
             "(s, s) uint8: codes of the errors of samples, which rise with the error; looks into the atlas.")
        .def("colours", colours, py::arg("chart"), "(t, t, 4) uint8, sRGB and alpha, or None; looks into the atlas.")
        .def("materials", materials, py::arg("chart"), "(t, t) uint16, or None; looks into the atlas.")
        .def("positions", positions, py::arg("chart"),
             "(s, s, 3) float32: positions of a chart, y first, object units; a copy.")
        .def("normals", normals, py::arg("chart"), "(t, t, 3) float32 of unit length; a copy.")
        .def("uvs", uvs, py::arg("chart"), "(t, t, 2) float32, texture coordinates, or None; a copy.");
    module.def("atlas_of", decoded);
}

}  // namespace lodestone::python
