// Meshes for Python: from arrays, files and shapes; simplified, unwrapped, compared; and the simulated cache.
#include "apps/embed/arrays.h"
#include "apps/embed/levels.h"
#include "apps/embed/simplify.h"
#include "apps/embed/unwrap.h"
#include "apps/python/binding.h"
#include "base/text.h"
#include "mesh/distance/distance.h"
#include "mesh/generate.h"
#include "mesh/io/write.h"
#include "mesh/repair.h"

namespace lodestone::python {

namespace {

// As it is where it has the type and lies as it must; else a copy.
template <class Number>
using Given = py::array_t<Number, py::array::c_style | py::array::forcecast>;

// count: rows there must be; 0: any number. Rows of `columns` numbers; 0: plain numbers.
template <class Element, class Number>
std::span<const Element> rows_of(const Given<Number>& array, const char* name, py::ssize_t columns) {
    const bool fits = columns == 0 ? array.ndim() == 1 : array.ndim() == 2 && array.shape(1) == columns;
    if (!fits) {
        refuse(std::string(name) + ": must have the shape " +
               (columns == 0 ? "(n,)" : "(n, " + std::to_string(columns) + ")"));
    }
    return {reinterpret_cast<const Element*>(array.data()), static_cast<size_t>(array.shape(0))};
}

// Whole numbers below 2^32. Those of 32 bits are taken as they are: a negative one is then no vertex.
Given<uint32_t> indices_of(const py::object& numbers, const char* name) {
    const py::array given = py::array::ensure(numbers);
    if (!given) throw py::error_already_set();
    const char kind = given.dtype().kind();
    if (kind != 'i' && kind != 'u') refuse(std::string(name) + ": must be whole numbers");
    if (given.itemsize() == 4 && kind == 'i') return Given<uint32_t>(given.attr("view")("uint32"));
    if (given.itemsize() == 8 && given.size() > 0) {
        const py::object least = given.attr("min")(), most = given.attr("max")();
        if (least < py::int_(0) || most > py::int_(0xffffffffu))
            refuse(std::string(name) + ": " + py::str(least < py::int_(0) ? least : most).cast<std::string>() +
                   " is no vertex");
    }
    return Given<uint32_t>(given);
}

template <class Number, class Element>
struct Optional {
    Given<Number> array;
    std::span<const Element> rows;
    Optional(const py::object& given, const char* name, py::ssize_t columns) {
        if (given.is_none()) return;
        array = Given<Number>::ensure(given);
        if (!array) throw py::error_already_set();
        rows = rows_of<Element>(array, name, columns);
        if (rows.empty()) refuse(std::string(name) + ": is empty; leave it out");
    }
};

Given<uint8_t> colours_of(const py::object& given) {
    const py::array array = py::array::ensure(given);
    if (!array || array.dtype().kind() != 'u' || array.itemsize() != 1) refuse("colours: must be of the type uint8");
    return Given<uint8_t>(array);
}

std::shared_ptr<Mesh> make_mesh(const Given<float>& positions, const py::object& triangles, const py::object& normals,
                                const py::object& uvs, const py::object& colours, const std::string& name) {
    const Given<uint32_t> indices = indices_of(triangles, "triangles");
    const Optional<float, glm::vec3> normal(normals, "normals", 3);
    const Optional<float, glm::vec2> uv(uvs, "uvs", 2);
    const Optional<uint8_t, glm::u8vec4> colour(colours.is_none() ? colours : py::object(colours_of(colours)),
                                                "colours", 4);
    MeshArrays arrays;
    arrays.positions = rows_of<glm::vec3>(positions, "positions", 3);
    arrays.triangles = rows_of<Triangle>(indices, "triangles", 3);
    arrays.normals = normal.rows;
    arrays.uvs = uv.rows;
    arrays.colours = colour.rows;
    const py::gil_scoped_release unlocked;
    return mesh_object({value_of(mesh_of(std::move(arrays))), as_utf8(name)});
}

std::shared_ptr<Mesh> read(const py::object& path, const py::kwargs& options) {
    const std::filesystem::path file = py::str(py::module_::import("os").attr("fspath")(path)).cast<std::string>();
    const BakeOptions bake = value_of(bake_options_of(words_of(options)));
    ReadReport report;
    TriMesh mesh = run_long(py::none(), [&](const Progress&) { return read_mesh(file, bake.read, &report); });
    for (const std::string& line : report.warnings) {
        if (PyErr_WarnEx(PyExc_UserWarning, line.c_str(), 1) != 0) throw py::error_already_set();
    }
    return mesh_object({std::move(mesh), as_utf8(file.filename().string())});
}

void write(const Mesh& mesh, const py::object& path) {
    const std::string file = py::str(py::module_::import("os").attr("fspath")(path)).cast<std::string>();
    run_long(py::none(), [&](const Progress&) { return write_mesh(mesh.named->mesh, file); });
}

std::shared_ptr<Mesh> generated(const std::string& shape, uint64_t triangles, uint64_t seed) {
    const Shape made = value_of(shape_named(shape));
    if (triangles < 1 || triangles > uint64_t{1} << 31) refuse("triangles: must be 1 .. 2147483648");
    const py::gil_scoped_release unlocked;
    return mesh_object({generate(made, triangles, seed), shape});
}

std::shared_ptr<Mesh> simplified(const Mesh& mesh, const py::object& triangles, const py::object& error,
                                 const std::string& simplifier, const py::object& progress) {
    SimplifyTarget target;
    if (!triangles.is_none()) target.triangles = triangles.cast<uint64_t>();
    if (!error.is_none()) target.error = error.cast<double>();
    target.simplifier = simplifier;
    TriMesh made = run_long(progress, [&](const Progress& p) { return simplify(mesh.named->mesh, target, p); });
    return mesh_object({std::move(made), mesh.named->name});
}

// The new mesh, and what `unwrap --json` tells of it, as text.
py::tuple unwrapped(const Mesh& mesh, const py::object& progress, const py::kwargs& options) {
    const UnwrapChoices choices = value_of(unwrap_choices_of(words_of(options)));
    UnwrapDone made = run_long(progress, [&](const Progress& p) { return unwrap(mesh.named->mesh, choices, p); });
    const std::string report = unwrap_report(made.report, choices).dump();
    return py::make_tuple(mesh_object({std::move(made.unwrapped.mesh), mesh.named->name}), report);
}

py::tuple cache_cost(const py::object& triangles, const std::string& cache) {
    const Given<uint32_t> indices = indices_of(triangles, "triangles");
    const auto rows = rows_of<Triangle>(indices, "triangles", 3);
    const CacheStatistics cost = [&] {
        const py::gil_scoped_release unlocked;
        return value_of(simulated_cost({reinterpret_cast<const uint32_t*>(rows.data()), rows.size() * 3}, cache));
    }();
    return py::make_tuple(cost.acmr(), cost.atvr(), cost.transforms, cost.triangles, cost.vertices);
}

py::tuple distance(const Mesh& a, const Mesh& b, size_t samples) {
    if (samples < 1 || samples > 100000000) refuse("samples: must be 1 .. 100000000");
    for (const Mesh* mesh : {&a, &b}) {
        if (mesh->named->mesh.triangles.empty()) refuse("distance: a mesh has no triangle");
    }
    const py::gil_scoped_release unlocked;
    DistanceOptions options;
    options.samples = samples;
    const TwoSidedDistance found = surface_distance(a.named->mesh, b.named->mesh, options);
    const py::gil_scoped_acquire lock;
    return py::make_tuple(found.rms(), found.max());
}

// An attribute of a mesh: None where it has none. columns: 0 for plain numbers.
template <class Number, class Values>
py::object attribute(const py::object& self, const Values& values, py::ssize_t columns) {
    if (values.empty()) return py::none();
    const auto rows = static_cast<py::ssize_t>(values.size());
    return view_of<Number>(values.data(), columns == 0 ? std::vector{rows} : std::vector{rows, columns}, self);
}

py::list images_of(const py::object& self) {
    py::list images;
    for (const Image& image : self.cast<const Mesh&>().named->mesh.images)
        images.append(view_of<uint8_t>(image.texels.data(), {image.height, image.width, 4}, self));
    return images;
}

py::object texture_of(const Texture& t) {
    if (!t.there()) return py::none();
    const auto word = [](Wrap wrap) {
        return wrap == Wrap::repeat ? "repeat" : wrap == Wrap::clamp ? "clamp" : "mirror";
    };
    py::dict texture;
    texture["image"] = t.image;
    texture["wrap"] = py::make_tuple(word(t.wrap[0]), word(t.wrap[1]));
    texture["place"] = py::make_tuple(py::make_tuple(t.place[0].x, t.place[1].x, t.place[2].x),
                                      py::make_tuple(t.place[0].y, t.place[1].y, t.place[2].y));
    texture["second"] = t.second;
    return texture;
}

py::dict textures_of(const Material& m) {
    py::dict textures;
    textures["base_colour"] = texture_of(m.base_colour_texture);
    textures["metallic_roughness"] = texture_of(m.metallic_roughness_texture);
    textures["normal"] = texture_of(m.normal_texture);
    textures["occlusion"] = texture_of(m.occlusion_texture);
    textures["emission"] = texture_of(m.emission_texture);
    return textures;
}

py::list materials_of(const std::vector<Material>& table) {
    py::list materials;
    for (const Material& m : table) {
        py::dict material;
        material["name"] = m.name;
        material["base_colour"] = py::make_tuple(m.base_colour.r, m.base_colour.g, m.base_colour.b, m.base_colour.a);
        material["image"] =
            m.base_colour_texture.image < 0 ? py::object(py::none()) : py::int_(m.base_colour_texture.image);
        material["double_sided"] = m.double_sided;
        material["shading"] = m.shading == Shading::plain   ? "plain"
                              : m.shading == Shading::unlit ? "unlit"
                                                            : "metallic_roughness";
        material["alpha_mode"] = m.alpha_mode == AlphaMode::opaque ? "opaque"
                                 : m.alpha_mode == AlphaMode::mask ? "mask"
                                                                   : "blend";
        material["alpha_cutoff"] = m.alpha_cutoff;
        material["metallic"] = m.metallic;
        material["roughness"] = m.roughness;
        material["normal_scale"] = m.normal_scale;
        material["occlusion_strength"] = m.occlusion_strength;
        material["emission"] = py::make_tuple(m.emission.x, m.emission.y, m.emission.z);
        material["textures"] = textures_of(m);
        materials.append(material);
    }
    return materials;
}

template <class Get>
auto of_mesh(Get get) {
    return [get](const py::object& self) { return get(self, self.cast<const Mesh&>().named->mesh); };
}

constexpr const char* mesh_text = R"doc(A triangle mesh; never changes. Its arrays look into its memory.

Mesh(positions, triangles, *, normals=None, uvs=None, colours=None, name="arrays")
  positions  (n, 3) numbers, object units, finite
  triangles  (m, 3) whole numbers below n, counter-clockwise seen from outside
  normals    (n, 3) numbers of any length, or None
  uvs        (n, 2) numbers, origin at the top left, or None
  colours    (n, 4) uint8, sRGB and alpha, or None
Where a normal, a texture coordinate or a colour jumps, several vertices have one position. Arrays of float32 and
uint32 are copied once.)doc";
constexpr const char* read_text =
    R"doc(A Mesh from a PLY, OBJ, STL, OFF, glTF or GLB file or a height map; also .gz. Options are those of
`lodestone bake` for reading: height_scale, pixel_size, void_height, fill_voids, allow_outside.)doc";
constexpr const char* generate_text =
    R"doc(A Mesh of about so many triangles: "rock", "terrain", "grid", "sphere", "torus", "cliff", "vase" or "scan".)doc";
constexpr const char* simplify_text = R"doc(A Mesh of fewer triangles; the mesh is repaired first. One of:
  triangles  at most so many, or as few as topology allows
  error      object units: the coarsest level within this two-sided distance of the source, which is measured
simplifier: "quadric", with attributes, or "openmesh", positions alone. progress: called with a stage and a
fraction; what it raises stops the work.)doc";

}  // namespace

std::shared_ptr<Mesh> mesh_object(NamedMesh named) {
    auto mesh = std::make_shared<Mesh>();
    mesh->named = std::make_shared<const NamedMesh>(std::move(named));
    mesh->positions = wedge_positions(mesh->named->mesh, mesh->room);
    return mesh;
}

void bind_meshes(py::module_& module) {
    using TheMesh = const TriMesh&;
    using Self = const py::object&;
    py::class_<Mesh, std::shared_ptr<Mesh>>(module, "Mesh", mesh_text)
        .def(py::init(&make_mesh), py::arg("positions"), py::arg("triangles"), py::kw_only(),
             py::arg("normals") = py::none(), py::arg("uvs") = py::none(), py::arg("colours") = py::none(),
             py::arg("name") = "arrays", mesh_text)
        .def_property_readonly(
            "positions", [](Self self) { return attribute<float>(self, self.cast<const Mesh&>().positions, 3); },
            "(n, 3) float32, object units.")
        .def_property_readonly("triangles",
                               of_mesh([](Self s, TheMesh m) { return attribute<uint32_t>(s, m.triangles, 3); }),
                               "(m, 3) uint32, vertices of each triangle, counter-clockwise seen from outside.")
        .def_property_readonly("normals", of_mesh([](Self s, TheMesh m) { return attribute<float>(s, m.normals, 3); }),
                               "(n, 3) float32 of unit length, or None.")
        .def_property_readonly("uvs", of_mesh([](Self s, TheMesh m) { return attribute<float>(s, m.uvs, 2); }),
                               "(n, 2) float32, origin at the top left, or None.")
        .def_property_readonly("second_uvs",
                               of_mesh([](Self s, TheMesh m) { return attribute<float>(s, m.second_uvs, 2); }),
                               "The second set of them, of a mesh that was read or made from one, or None.")
        .def_property_readonly("tangents",
                               of_mesh([](Self s, TheMesh m) { return attribute<float>(s, m.tangents, 4); }),
                               "(n, 4) float32, likewise, or None: glTF's TANGENT; zeros where a vertex has none.")
        .def_property_readonly("colours",
                               of_mesh([](Self s, TheMesh m) { return attribute<uint8_t>(s, m.colours, 4); }),
                               "(n, 4) uint8, sRGB and alpha, or None.")
        .def_property_readonly("materials",
                               of_mesh([](Self s, TheMesh m) { return attribute<uint16_t>(s, m.materials, 0); }),
                               "(n,) uint16 into material_table, or None.")
        .def_property_readonly(
            "material_table", of_mesh([](Self, TheMesh m) { return materials_of(m.material_table); }),
            "A list of dicts: name, base_colour (linear RGBA, 0 .. 1), image (of the base colour, into images, or "
            "None), "
            "double_sided; shading, alpha_mode, alpha_cutoff, metallic, roughness, normal_scale, occlusion_strength, "
            "emission (linear RGB), textures (docs/materials.md): a dict of base_colour, metallic_roughness, normal, "
            "occlusion, emission, each None or a dict of image, wrap, place, 2 x 3 numbers by which (u, v, 1) is "
            "where it is looked up, and second, whether (u, v) are of second_uvs.")
        .def_property_readonly("images", images_of, "Textures: a list of (height, width, 4) uint8; colours are sRGB.")
        .def_property_readonly(
            "name", [](const Mesh& mesh) { return mesh.named->name; }, "What it is called: of a file, its name.")
        .def("write", write, py::arg("path"), "Writes a .ply, .obj or .glb file, which appears whole or not at all.");
    module.def("read", read, py::arg("path"), read_text);
    module.def("generate", generated, py::arg("shape"), py::arg("triangles"), py::arg("seed") = 1, generate_text);
    module.def("simplify", simplified, py::arg("mesh"), py::kw_only(), py::arg("triangles") = py::none(),
               py::arg("error") = py::none(), py::arg("simplifier") = "quadric", py::arg("progress") = py::none(),
               simplify_text);
    module.def("unwrap", unwrapped, py::arg("mesh"), py::arg("progress"));
    module.def("cache_cost", cache_cost, py::arg("triangles"), py::arg("cache"));
    module.def("distance", distance, py::arg("a"), py::arg("b"), py::arg("samples"));
}

}  // namespace lodestone::python
