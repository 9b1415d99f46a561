// Assets for Python: baked, opened, their levels, cuts and pictures.
#include <cstring>

#include "apps/embed/cutter.h"
#include "apps/embed/levels.h"
#include "apps/python/binding.h"
#include "apps/python/draw.h"
#include "base/text.h"

namespace lodestone::python {

namespace {

std::string path_of(const py::object& path) {
    return py::str(py::module_::import("os").attr("fspath")(path)).cast<std::string>();
}

// A Python value as the word that stands for it on the command line.
std::string word_of(const std::string& name, const py::handle& value) {
    if (py::isinstance<py::str>(value)) return value.cast<std::string>();
    if (py::isinstance<py::bool_>(value)) refuse(name + ": must be a number or a text");
    if (py::isinstance<py::int_>(value) || py::isinstance<py::float_>(value) || py::hasattr(value, "__index__"))
        return py::str(value).cast<std::string>();
    if (py::isinstance<py::sequence>(value)) {
        std::string words;
        for (const py::handle& each : value) words += (words.empty() ? "" : ",") + word_of(name, each);
        return words;
    }
    return py::str(value).cast<std::string>();
}

Camera camera_of(const py::object& eye, const py::object& target, const py::object& up, double fov_y,
                 const Sphere& around) {
    const auto vector = [](const py::object& given, const char* name) {
        const auto numbers = py::array_t<float, py::array::c_style | py::array::forcecast>::ensure(given);
        if (!numbers || numbers.ndim() != 1 || numbers.shape(0) != 3) {
            PyErr_Clear();
            refuse(std::string(name) + ": must be three numbers");
        }
        return glm::vec3(numbers.at(0), numbers.at(1), numbers.at(2));
    };
    Camera camera;
    camera.eye = vector(eye, "eye");
    camera.target = target.is_none() ? around.centre : vector(target, "target");
    camera.up = vector(up, "up");
    camera.fov_y = static_cast<float>(fov_y);
    const float away = glm::distance(camera.eye, around.centre);
    camera.far_plane = 2 * (away + around.radius);
    camera.near_plane = std::max(away - around.radius, 1e-3f * around.radius) / 2;
    return camera;
}

std::shared_ptr<Asset> bake(const Mesh& mesh, const py::object& path, const py::object& progress,
                            const py::kwargs& options) {
    const BakeOptions bake_options = value_of(bake_options_of(words_of(options)));
    std::optional<std::filesystem::path> out;
    if (!path.is_none()) out = path_of(path);
    BakedAsset baked =
        run_long(progress, [&](const Progress& p) { return bake_mesh(*mesh.named, bake_options, out, true, p); });
    return std::make_shared<Asset>(std::move(*baked.asset));
}

std::shared_ptr<Asset> open(const py::object& source) {
    if (py::isinstance<py::buffer>(source)) {
        const py::buffer_info bytes = source.cast<py::buffer>().request();
        if (bytes.itemsize != 1 || bytes.ndim != 1 || bytes.strides[0] != 1) refuse("open: give the bytes of a file");
        return std::make_shared<Asset>(value_of(
            open_asset_in_memory({static_cast<const std::byte*>(bytes.ptr), static_cast<size_t>(bytes.size)})));
    }
    const std::string path = path_of(source);
    const py::gil_scoped_release unlocked;
    return std::make_shared<Asset>(value_of(open_asset(std::filesystem::path(path))));
}

// Triangles and errors by level.
py::tuple levels(const Asset& asset, const std::string& backend) {
    const Levels found = value_of(levels_of(asset, backend));
    std::vector<uint64_t> triangles(found.count());
    std::vector<double> errors(found.count());
    for (uint32_t level = 0; level < found.count(); ++level) {
        triangles[level] = found.triangles(level);
        errors[level] = found.error(level);
    }
    const auto count = static_cast<py::ssize_t>(triangles.size());
    return py::make_tuple(taken_over<uint64_t>(std::move(triangles), {count}),
                          taken_over<double>(std::move(errors), {count}));
}

// Which level is meant; exactly one of the three is given.
uint32_t chosen_level(const Asset& asset, const std::string& backend, const py::object& level,
                      const py::object& triangles, const py::object& error) {
    const Levels found = value_of(levels_of(asset, backend));
    if (!level.is_none() + !triangles.is_none() + !error.is_none() != 1)
        refuse("give exactly one of level, triangles and error");
    if (!triangles.is_none()) return found.for_triangles(triangles.cast<uint64_t>());
    if (error.is_none()) return level.cast<uint32_t>();
    if (!(error.cast<double>() >= 0)) refuse("error: must be 0 or more");
    return found.for_error(error.cast<double>());
}

std::shared_ptr<Mesh> extracted(const Asset& asset, const std::string& backend, uint32_t level,
                                const std::string& order) {
    TriMesh mesh = run_long(py::none(), [&](const Progress& p) { return extract(asset, backend, level, order, p); });
    return mesh_object({std::move(mesh), asset.about["name"].get<std::string>()});
}

py::array picture(const Asset& asset, const py::kwargs& given) {
    PictureOptions options;
    options.backend = given["backend"].cast<std::string>();
    options.order = given["order"].cast<std::string>();
    options.raster = given["raster"].cast<std::string>();
    options.device = given["device"].cast<std::string>();
    options.debug = given["debug"].cast<std::string>();
    options.width = given["width"].cast<uint32_t>();
    options.height = given["height"].cast<uint32_t>();
    options.pixel_error = given["pixel_error"].cast<double>();
    options.level = given["level"].is_none() ? -1 : int64_t{given["level"].cast<uint32_t>()};
    options.shadows = given["shadows"].cast<bool>();
    options.environment = given["environment"].cast<std::string>();
    if (!given["eye"].is_none()) {
        CutView view;
        options.camera =
            camera_of(given["eye"], given["target"], given["up"], given["fov_y"].cast<double>(), asset.bounds());
        view.camera = *options.camera;
        value_of(check_view(view));
    }
    CutView size;
    size.camera = {{0, 0, 3}, {0, 0, 0}, {0, 1, 0}, 1, 0.1f, 10};
    size.width = options.width;
    size.height = options.height;
    size.pixel_error = options.pixel_error;
    value_of(check_view(size));
    Picture drawn = run_long(given["progress"], [&](const Progress& p) { return draw_picture(asset, options, p); });
    return taken_over<uint8_t>(std::move(drawn.colour), {drawn.height, drawn.width, 4});
}

// Vertices as a structured array, and triangles.
py::tuple cut(Cutter& cutter, const py::kwargs& given) {
    CutView view;
    const Sphere around{
        {given["centre"].cast<std::array<float, 3>>()[0], given["centre"].cast<std::array<float, 3>>()[1],
         given["centre"].cast<std::array<float, 3>>()[2]},
        given["radius"].cast<float>()};
    view.camera = camera_of(given["eye"], given["target"], given["up"], given["fov_y"].cast<double>(), around);
    view.width = given["width"].cast<uint32_t>();
    view.height = given["height"].cast<uint32_t>();
    view.pixel_error = given["pixel_error"].cast<double>();
    view.max_triangles = given["max_triangles"].cast<uint64_t>();
    view.culls_back_faces = given["culls_back_faces"].cast<bool>();
    view.wait = given["wait"].cast<bool>();
    const Cut made = run_long(py::none(), [&](const Progress&) { return cutter.cut(view); });
    const auto indices = static_cast<py::ssize_t>(made.indices.size());
    return py::make_tuple(
        taken_over<CutVertex>(std::vector<CutVertex>(made.vertices.begin(), made.vertices.end()),
                              {static_cast<py::ssize_t>(made.vertices.size())}),
        taken_over<uint32_t>(std::vector<uint32_t>(made.indices.begin(), made.indices.end()), {indices / 3, 3}),
        made.level < 0 ? py::object(py::none()) : py::int_(made.level), made.pixel_error, made.settled);
}

std::vector<std::string> backends_of(const Asset& asset) {
    std::vector<std::string> names;
    if (asset.full != nullptr) names.emplace_back("full");
    if (asset.discrete != nullptr) names.emplace_back("discrete");
    if (asset.lod != nullptr) names.emplace_back("lod");
    if (asset.atlas_file != nullptr) names.emplace_back("vgi");
    return names;
}

}  // namespace

std::vector<std::string> words_of(const py::kwargs& options) {
    std::vector<std::string> words;
    for (const auto& [key, value] : options) {
        std::string name = key.cast<std::string>();
        std::ranges::replace(name, '_', '-');
        if (py::isinstance<py::bool_>(value)) {
            if (value.cast<bool>()) words.push_back("--" + name);
        } else if (!value.is_none()) {
            words.push_back("--" + name);
            words.push_back(word_of(name, value));
        }
    }
    return words;
}

void bind_assets(py::module_& module) {
    PYBIND11_NUMPY_DTYPE(CutVertex, position, normal, uv, colour, material);
    py::class_<Asset, std::shared_ptr<Asset>>(module, "Asset")
        .def_property_readonly("about_text", [](const Asset& asset) { return text_of(asset.about); })
        .def_property_readonly("backends", backends_of)
        .def_property_readonly("bounds",
                               [](const Asset& asset) {
                                   const Sphere s = asset.bounds();
                                   return py::make_tuple(py::make_tuple(s.centre.x, s.centre.y, s.centre.z), s.radius);
                               })
        .def("levels", levels, py::arg("backend"))
        .def("chosen_level", chosen_level, py::arg("backend"), py::arg("level"), py::arg("triangles"), py::arg("error"))
        .def("extract", extracted, py::arg("backend"), py::arg("level"), py::arg("order"))
        .def("verify", [](const Asset& asset) { run_long(py::none(), [&](const Progress&) { return verify(asset); }); })
        .def("render", picture);
    py::class_<Cutter>(module, "Cutter").def("cut", cut);
    module.def("open_cutter", [](const Asset& asset, const std::string& backend, uint64_t resident_bytes) {
        if (backend != "lod" && backend != "vgi") refuse("backend " + backend + ": has no cuts; choose lod or vgi");
        return value_of(Cutter::open(asset, backend, resident_bytes));
    });
    module.def("bake", bake, py::arg("mesh"), py::arg("path") = py::none(), py::kw_only(),
               py::arg("progress") = py::none());
    module.def("open", open, py::arg("source"));
}

}  // namespace lodestone::python
