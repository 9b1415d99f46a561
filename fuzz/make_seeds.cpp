// make_seeds FOLDER: what each driver begins with, in a folder of its name. Small files of every kind that the readers
// know, made here so that none is kept.
#include <meshoptimizer.h>
#include <tiffio.h>
#include <zlib.h>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

#include "mesh/generate.h"
#include "mesh/io/image_file.h"
#include "mesh/io/write.h"
#include "tests/fixtures/gltf_files.h"

namespace lodestone::fuzz {
namespace {

namespace fs = std::filesystem;

std::string content_of(const fs::path& path) {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
}

class Seeds {
public:
    explicit Seeds(fs::path folder) : folder_(std::move(folder)) {}

    void put(const std::string& driver, const std::string& name, const std::string& content) {
        fs::create_directories(folder_ / driver);
        std::ofstream(folder_ / driver / name, std::ios::binary) << content;
    }
    // Also packed, for the driver that unpacks.
    void put_packed(const std::string& driver, const std::string& name, const std::string& content) {
        put(driver, name, content);
        const fs::path path = folder_ / "packed.gz";
        const gzFile zip = gzopen(path.c_str(), "wb1");
        gzwrite(zip, content.data(), static_cast<unsigned>(content.size()));
        gzclose(zip);
        put("gzip", driver + "-" + name + ".gz", content_of(path));
        fs::remove(path);
    }
    std::string written(const TriMesh& mesh, const std::string& name, const WriteOptions& options = {}) {
        const fs::path path = folder_ / name;
        fs::create_directories(folder_);
        if (!write_mesh(mesh, path, options)) return "";
        std::string content = content_of(path);
        fs::remove(path);
        return content;
    }

private:
    fs::path folder_;
};

TriMesh painted(TriMesh mesh) {
    mesh.uvs.resize(mesh.wedge_count(), glm::vec2(0.25f, 0.75f));
    mesh.colours.resize(mesh.wedge_count(), glm::u8vec4(1, 2, 3, 255));
    mesh.normals.resize(mesh.wedge_count(), glm::vec3(0, 0, 1));
    mesh.materials.resize(mesh.wedge_count(), 0);
    Material material;
    material.name = "paint";
    material.shading = Shading::metallic_roughness;
    material.alpha_mode = AlphaMode::mask;
    material.double_sided = true;
    material.metallic = material.roughness = material.normal_scale = material.occlusion_strength = 0.5f;
    material.emission = {3, 2, 1};
    for (Texture* texture : material.textures()) *texture = {0, {Wrap::clamp, Wrap::mirror}, {{0, -2}, {3, 0}, {1, 1}}};
    material.base_colour_texture.place = Texture{}.place;
    mesh.material_table = {material, material};
    mesh.material_table[1].shading = Shading::unlit;
    mesh.material_table[1].alpha_mode = AlphaMode::blend;
    for (const uint32_t w : mesh.triangles[0]) mesh.materials[w] = 1;
    mesh.images = {Image{2, 2, std::vector<glm::u8vec4>(4, {9, 8, 7, 255})}};
    return mesh;
}

// A GLB of a document that has yet to tell of its version and of its buffer.
std::string glb(nlohmann::json document, const std::string& bytes) {
    document["asset"] = {{"version", "2.0"}};
    document["buffers"] = {{{"byteLength", (bytes.size() + 3) / 4 * 4}}};
    return fixtures::glb_of(document, bytes);
}

// Kinds of numbers and primitives that writers of ours do not make, and materials with what is left out.
std::string odd_glb() {
    using nlohmann::json;
    std::string bytes(96, '\1');
    for (size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<char>(i * 37 % 120);
    const auto accessor = [](int kind, const char* type, bool normalised) {
        return json{
            {"bufferView", 0}, {"componentType", kind}, {"count", 4}, {"type", type}, {"normalized", normalised}};
    };
    json accessors = {accessor(5122, "VEC3", false), accessor(5120, "VEC3", true),   accessor(5121, "VEC2", true),
                      accessor(5123, "VEC2", true),  accessor(5121, "VEC4", true),   accessor(5123, "SCALAR", false),
                      accessor(5120, "VEC3", false), accessor(5121, "SCALAR", false)};
    json primitives = json::array();
    for (int mode = 0; mode <= 6; ++mode)
        primitives.push_back(
            {{"attributes", {{"POSITION", 0}, {"NORMAL", 1}, {"TEXCOORD_0", 2}, {"TEXCOORD_1", 3}, {"COLOR_0", 4}}},
             {"material", mode % 3},
             {"mode", mode}});
    const auto texture = [](int set, json transform) {
        json made = {{"index", 0}, {"texCoord", set}};
        if (!transform.is_null()) made["extensions"] = {{"KHR_texture_transform", transform}};
        return made;
    };
    json materials = {
        {{"name", "a"},
         {"pbrMetallicRoughness",
          {{"baseColorTexture", texture(0, {{"scale", {0, 0}}, {"texCoord", 1}})},
           {"metallicRoughnessTexture", texture(1, {{"offset", {1, 2}}})}}},
         {"normalTexture", texture(0, nullptr)},
         {"alphaMode", "BLEND"}},
        {{"alphaMode", "OTHER"}, {"emissiveTexture", texture(1, nullptr)}, {"occlusionTexture", texture(0, nullptr)}},
        {{"extensions", {{"KHR_materials_clearcoat", json::object()}, {"KHR_materials_unlit", json::object()}}},
         {"alphaMode", "MASK"},
         {"normalTexture", {{"index", 1}}}}};
    return glb({{"extensionsUsed", {"KHR_materials_clearcoat", "KHR_texture_basisu", "KHR_animation_pointer"}},
                {"extensionsRequired", {"KHR_texture_basisu", "KHR_mesh_quantization"}},
                {"bufferViews", {{{"buffer", 0}, {"byteLength", 96}, {"byteStride", 12}}}},
                {"accessors", accessors},
                {"images", {{{"bufferView", 0}, {"mimeType", "image/ktx2"}}, {{"uri", "b.webp"}}}},
                {"textures",
                 {{{"extensions", {{"KHR_texture_basisu", {{"source", 0}}}}}},
                  {{"extensions", {{"EXT_texture_webp", {{"source", 1}}}}}}}},
                {"materials", materials},
                {"meshes", {{{"primitives", primitives}}}},
                {"nodes",
                 {{{"mesh", 0}, {"matrix", {1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1, 0, 1, 2, 3, 1}}},
                  {{"children", {0}}, {"translation", {1, 0, 0}}}}},
                {"scenes", {{{"nodes", {1}}}}}},
               bytes);
}

// With all textures but that of base colour on a second set of texture coordinates.
TriMesh of_two_sets(TriMesh mesh) {
    for (const glm::vec2& uv : mesh.uvs) mesh.second_uvs.emplace_back(uv.y, 2 * uv.x);
    for (Material& material : mesh.material_table) {
        for (Texture* texture : material.textures()) texture->second = texture != &material.base_colour_texture;
    }
    return mesh;
}

// In a frame of its own, where a map of normals is.
TriMesh of_tangents(TriMesh mesh) {
    for (size_t w = 0; w < mesh.wedge_count(); ++w)
        mesh.tangents.emplace_back(w % 3 == 0 ? 1 : 0, w % 3 == 1 ? 1 : 0, w % 3 == 2 ? 1 : 0, w % 2 == 0 ? 1 : -1);
    for (Material& material : mesh.material_table) material.normal_texture.image = 0;
    return mesh;
}

void make_gltf(Seeds& seeds, const TriMesh& plain, const TriMesh& rich) {
    seeds.put_packed("gltf", "plain.glb", seeds.written(plain, "a.glb"));
    seeds.put("gltf", "rich.glb", seeds.written(rich, "b.glb"));
    seeds.put("gltf", "two_sets.glb", seeds.written(of_two_sets(rich), "t.glb"));
    seeds.put("gltf", "tangents.glb", seeds.written(of_tangents(rich), "n.glb"));
    seeds.put("gltf", "text.gltf",
              "{\"asset\":{\"version\":\"2.0\"},\"buffers\":[{\"byteLength\":60,\"uri\":\"data:application/"
              "octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAAAAAAAAAAAAAIA/"
              "AAAAAAAAAAAAAIA/\"}],\"bufferViews\":[{\"buffer\":0,\"byteLength\":36},{\"buffer\":0,\"byteOffset\":36,"
              "\"byteLength\":24}],\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":3,\"type\":"
              "\"VEC3\",\"sparse\":{\"count\":1,\"indices\":{\"bufferView\":0,\"componentType\":5121},\"values\":{"
              "\"bufferView\":0}}},{\"bufferView\":1,\"componentType\":5126,\"count\":3,\"type\":\"VEC2\"}],"
              "\"extensionsUsed\":[\"KHR_texture_transform\"],\"materials\":[{\"pbrMetallicRoughness\":{"
              "\"baseColorTexture\":{\"index\":0,\"extensions\":{\"KHR_texture_transform\":{\"offset\":[0,1],"
              "\"rotation\":1,\"scale\":[2,3]}}}}}],\"textures\":[{\"source\":0}],\"images\":[{\"uri\":\"a.png\"}],"
              "\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0,\"TEXCOORD_0\":1},\"material\":0,\"mode\":"
              "5}]}],\"nodes\":[{\"mesh\":0,\"rotation\":[0,0,0,1]},{\"children\":[0],\"scale\":[1,2,3]}],\"scenes\":[{"
              "\"nodes\":[1]}],\"scene\":0}");
    WriteOptions options;
    options.encoding = WriteOptions::Encoding::quantised;
    seeds.put("gltf", "quantised.glb", seeds.written(rich, "q.glb", options));
    options.encoding = WriteOptions::Encoding::meshopt;
    seeds.put("gltf", "meshopt.glb", seeds.written(rich, "m.glb", options));
    seeds.put("gltf", "draco.glb", fixtures::draco_glb(plain, fixtures::draco_of(plain)));
    seeds.put("gltf", "odd.glb", odd_glb());
}

// For the driver of Draco: what fuzz_draco.cpp takes for a promise, then what is packed. method: edgebreaker or
// sequential; speed: 0 .. 10, which chooses among ways of predicting numbers.
std::string draco_input(const TriMesh& mesh, draco::MeshEncoderMethod method, int speed) {
    draco::TriangleSoupMeshBuilder builder;
    builder.Start(static_cast<int>(mesh.triangle_count()));
    const int position = builder.AddAttribute(draco::GeometryAttribute::POSITION, 3, draco::DT_FLOAT32),
              normal = builder.AddAttribute(draco::GeometryAttribute::NORMAL, 3, draco::DT_FLOAT32),
              uv = builder.AddAttribute(draco::GeometryAttribute::TEX_COORD, 2, draco::DT_FLOAT32),
              colour = builder.AddAttribute(draco::GeometryAttribute::COLOR, 4, draco::DT_UINT8);
    for (uint32_t t = 0; t < mesh.triangle_count(); ++t) {
        const auto set = [&](int attribute, const auto& of) {
            builder.SetAttributeValuesForFace(attribute, draco::FaceIndex(t), &of(0), &of(1), &of(2));
        };
        const auto wedge = [&](int k) { return mesh.triangles[t][static_cast<size_t>(k)]; };
        set(
            position, [&](int k) -> const auto& { return mesh.position_of(t, k).x; });
        set(
            normal, [&](int k) -> const auto& { return mesh.normals[wedge(k)].x; });
        set(
            uv, [&](int k) -> const auto& { return mesh.uvs[wedge(k)].x; });
        set(
            colour, [&](int k) -> const auto& { return mesh.colours[wedge(k)].x; });
    }
    draco::Encoder encoder;
    encoder.SetEncodingMethod(method);
    encoder.SetSpeedOptions(speed, speed);
    encoder.SetTrackEncodedProperties(true);
    for (const auto kind :
         {draco::GeometryAttribute::POSITION, draco::GeometryAttribute::NORMAL, draco::GeometryAttribute::TEX_COORD})
        encoder.SetAttributeQuantization(kind, 10);
    draco::EncoderBuffer buffer;
    if (!encoder.EncodeMeshToBuffer(*builder.Finalize(), &buffer).ok()) return "";
    const size_t points = encoder.num_encoded_points(), triangles = encoder.num_encoded_faces();
    std::string input;
    for (const size_t number : {points, points >> 8, triangles, triangles >> 8})
        input.push_back(static_cast<char>(number & 255));
    // Four attributes by their numbers: three floats, three, two, and four that stand for 0 .. 1.
    input += "\4\x20\x21\x12\x73";
    return input.append(buffer.data(), buffer.size());
}

void make_draco(Seeds& seeds, const TriMesh& flat, const TriMesh& closed) {
    for (const int speed : {0, 5, 10}) {
        const std::string name = std::to_string(speed);
        for (const TriMesh* mesh : {&flat, &closed}) {
            const std::string of = (mesh == &flat ? "-flat-" : "-closed-") + name;
            seeds.put("draco", "edgebreaker" + of, draco_input(*mesh, draco::MESH_EDGEBREAKER_ENCODING, speed));
            seeds.put("draco", "sequential" + of, draco_input(*mesh, draco::MESH_SEQUENTIAL_ENCODING, speed));
        }
    }
}

void make_meshes(Seeds& seeds) {
    const TriMesh plain = generate(Shape::grid, 8, 1), rich = painted(generate(Shape::grid, 8, 1));
    make_gltf(seeds, plain, rich);
    make_draco(seeds, rich, painted(generate(Shape::torus, 64, 1)));
    seeds.put_packed("ply", "plain.ply", seeds.written(plain, "a.ply"));
    seeds.put("ply", "rich.ply", seeds.written(rich, "b.ply"));
    seeds.put("ply", "text.ply",
              "ply\nformat ascii 1.0\ncomment c\nelement vertex 4\nproperty float x\nproperty double y\nproperty float "
              "z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nproperty float s\nproperty float "
              "t\nelement face 1\nproperty list uchar int vertex_indices\nelement edge 1\nproperty int a\nend_header\n"
              "0 0 0 255 0 0 0 0\n1 0 0 0 255 0 1 0\n1 1 0 0 0 255 1 1\n0 1 0 9 9 9 0 1\n4 0 1 2 3\n0\n");
    seeds.put("ply", "big.ply",
              "ply\nformat binary_big_endian 1.0\nelement vertex 3\nproperty short x\nproperty short y\nproperty short "
              "z\nelement tristrips 1\nproperty list int int vertex_indices\nend_header\n" +
                  std::string(18, '\1') + std::string("\0\0\0\3\0\0\0\0\0\0\0\1\0\0\0\2", 16));
    seeds.put_packed(
        "ply", "faces.ply",
        "ply\nformat ascii 1.0\ncomment TextureFile a.png\nelement vertex 3\nproperty float x\nproperty "
        "float y\nproperty float z\nelement face 1\nproperty list uchar int vertex_indices\nproperty list "
        "uchar float texcoord\nproperty int texnumber\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2 6 0 0 1 0 0 "
        "1 0\n");
    seeds.put("ply", "kinds.ply",
              "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement "
              "face 1\nproperty list uchar int vertex_indices\nproperty list uchar float texcoord\nelement face 1\n"
              "property list uchar int vertex_indices\nelement tristrips 1\nproperty list int int vertex_indices\n"
              "end_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2 6 0 0 1 0 0 1\n3 0 1 2\n4 0 1 2 0\n");
    const std::vector<float> corners = {0, 0, 0, 1, 0, 0, 0, 1, 0};
    std::string stream(meshopt_encodeVertexBufferBound(3, 12), 0);
    stream.resize(meshopt_encodeVertexBuffer(reinterpret_cast<unsigned char*>(stream.data()), stream.size(),
                                             corners.data(), 3, 12));
    seeds.put("meshopt", "attributes", std::string("\0\x0c\3\0", 4) + stream);
    const std::string library =
        "newmtl red\nKd 1 0 0\nd 0.5\nPm 1\nPr 0.5\nKe 3 2 1\nmap_Kd -s 1 1 1 a.png\nmap_d a.png\nmap_Ke a.png\nnorm "
        "-bm 0.5 a.png\n";
    const std::string obj =
        "mtllib a.mtl\nv 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 1 1 0 0 0 1\nv 0 1 0 0 0 1\nvt 0 0\nvn 0 0 1\ng a\nusemtl red\n"
        "f 1/1/1 2/1/1 \\\n3//1 4/1\nf -1 -2 -3\n";
    seeds.put("obj", "rich.obj", obj + std::string(1, '\0') + library);
    seeds.put_packed("obj", "plain.obj", seeds.written(plain, "a.obj"));
    seeds.put_packed("off", "plain.off", "OFF\n4 2 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2\n3 0 2 3\n");
    seeds.put("off", "rich.off",
              "STCNOFF\n3 1 0\n0 0 0 0 0 1 255 0 0 255 0 0\n1 0 0 0 0 1 0.5 0 0 1 0 1\n1 1 0 0 0 1 0 0 0 1 1 1\n3 0 1 "
              "2 9 9\n");
    seeds.put_packed("stl", "text.stl",
                     "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\n"
                     "endfacet\nendsolid\n");
    seeds.put("stl", "binary.stl", std::string(80, ' ') + std::string("\1\0\0\0", 4) + std::string(50, '\1'));
}

std::string tiff(const fs::path& path, bool tiled, uint16_t compression) {
    TIFF* file = TIFFOpen(path.c_str(), "w");
    std::vector<float> samples(16 * 16);
    for (size_t i = 0; i < samples.size(); ++i) samples[i] = static_cast<float>(i % 7);
    for (const auto& [tag, value] : {std::pair(TIFFTAG_IMAGEWIDTH, 16), std::pair(TIFFTAG_IMAGELENGTH, 16)})
        TIFFSetField(file, static_cast<uint32_t>(tag), value);
    TIFFSetField(file, TIFFTAG_BITSPERSAMPLE, 32);
    TIFFSetField(file, TIFFTAG_SAMPLEFORMAT, SAMPLEFORMAT_IEEEFP);
    TIFFSetField(file, TIFFTAG_SAMPLESPERPIXEL, 1);
    TIFFSetField(file, TIFFTAG_COMPRESSION, compression);
    TIFFSetField(file, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK);
    if (tiled) {
        TIFFSetField(file, TIFFTAG_TILEWIDTH, 16);
        TIFFSetField(file, TIFFTAG_TILELENGTH, 16);
        TIFFWriteTile(file, samples.data(), 0, 0, 0, 0);
    } else {
        TIFFSetField(file, TIFFTAG_ROWSPERSTRIP, 4);
        for (uint32_t y = 0; y < 16; ++y) TIFFWriteScanline(file, samples.data() + y * 16, y, 0);
    }
    TIFFClose(file);
    std::string content = content_of(path);
    fs::remove(path);
    return content;
}

// A grey PNG of 16 bits, 4 by 4 samples.
std::string png_heights() {
    std::string rows;
    for (int y = 0; y < 4; ++y) rows += std::string(1, '\0') + std::string("\0\1\0\2\0\3\x80\0", 8);
    uLongf size = compressBound(static_cast<uLong>(rows.size()));
    std::string packed(size, 0);
    compress(reinterpret_cast<Bytef*>(packed.data()), &size, reinterpret_cast<const Bytef*>(rows.data()),
             static_cast<uLong>(rows.size()));
    packed.resize(size);
    const auto big = [](size_t value) {
        return std::string{static_cast<char>(value >> 24), static_cast<char>(value >> 16),
                           static_cast<char>(value >> 8), static_cast<char>(value)};
    };
    std::string png("\x89PNG\r\n\x1a\n");
    for (const auto& [name, content] :
         {std::pair<std::string, std::string>("IHDR", big(4) + big(4) + std::string("\x10\0\0\0\0", 5)),
          {"IDAT", packed},
          {"IEND", ""}}) {
        const std::string body = name + content;
        png += big(content.size()) + body +
               big(crc32(0, reinterpret_cast<const Bytef*>(body.data()), static_cast<uInt>(body.size())));
    }
    return png;
}

void make_images(Seeds& seeds, const fs::path& folder) {
    Image image{9, 7, {}};
    for (uint32_t i = 0; i < 63; ++i)
        image.texels.emplace_back(static_cast<uint8_t>(i * 4), static_cast<uint8_t>(i), uint8_t{77}, uint8_t{255});
    const auto text = [](const Result<std::vector<std::byte>>& bytes) {
        return std::string(reinterpret_cast<const char*>(bytes->data()), bytes->size());
    };
    seeds.put("images", "a.png", text(encode_png(image)));
    seeds.put("images", "a.jpg", text(encode_jpeg(image, 80)));
    seeds.put("images", "a.webp",
              std::string("RIFF\x1a\0\0\0WEBPVP8L\x0d\0\0\0\x2f\0\0\0\x10\x07\x10\x11\x11\x88\x88\xfe\x07\0", 34));
    const std::string hdr = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\nEXPOSURE=2\n\n-Y 4 +X 8\n";
    std::string packed = hdr;
    const std::string row("\2\2\0\10\210\1\4abcd\204e\210\2\210\200", 17);
    for (int y = 0; y < 4; ++y) packed += row;
    seeds.put("panorama", "packed.hdr", packed);
    seeds.put("panorama", "flat.hdr", hdr + std::string(96, 'a') + std::string("aaab\1\1\1\7aaab\1\1\1\7", 16));
    seeds.put_packed("heights", "a.png", png_heights());
    seeds.put_packed("heights", "tiled.tif", tiff(folder / "a.tif", true, COMPRESSION_NONE));
    seeds.put("heights", "rows.tif", tiff(folder / "a.tif", false, COMPRESSION_NONE));
    seeds.put("heights", "lzw.tif", tiff(folder / "a.tif", false, COMPRESSION_LZW));
    seeds.put("heights", "deflate.tif", tiff(folder / "a.tif", true, COMPRESSION_ADOBE_DEFLATE));
}

// Camera paths, and what the project's own scenes, which scripts/fuzz.sh puts beside these, do not say
// (docs/scenes.md).
void make_scenes(Seeds& seeds) {
    const std::string path = R"({"lodestone": "camera-path", "version": 1, "fov_y_degrees": 45, "near": 0.1, "far": 400,
        "frames": 60, "up": [0, 1, 0], "keys": [{"eye": [9, 6, 0], "target": [0, 0, 0]}]})";
    seeds.put("scene", "a.path.json", path);
    seeds.put("scene", "files.scene.json",
              R"({"lodestone": "scene", "version": 1, "assets": [{"name": "a", "file": "a.ply"}],
        "instances": [{"asset": "a", "position": [2, 0, 0], "axis": [0, 1, 0], "angle_degrees": 30, "scale": 0.5}],
        "light": {"direction": [-0.4, -0.8, -0.4], "shadows": false}, "environment": "sky", "resident_mib": 64,
        "upload_mib": 1, "max_triangles": 1000, "camera": "a.path.json"})");
    seeds.put("scene", "grids.scene.json",
              R"({"lodestone": "scene", "version": 1, "assets": [{"name": "a", "generate": {"shape": "vase"}}],
        "volumes": [{"grid": {"file": "a.vdb", "name": "flames"}, "look": "fire", "axis": [0, 1, 0], "angle_degrees": 90,
        "scale": 0.01, "density": [8, 1], "scatter": {"count": 4, "area": [6, 6]}},
        {"colour_by": "heat", "colour": [[1, 1, 1], [0, 0, 0]], "scatter_share": 0.5, "emission": 2, "fade": 0.1},
        {"table": [[1, 1, 1, 1], [0, 0, 0, 0]], "turning": 1}], "volume_options": {"steps": 1, "refresh": 2, "cache": 4,
        "absorption": "rational", "forward": 0.5}, "camera": )" +
                  path + "}");
}

}  // namespace
}  // namespace lodestone::fuzz

int main(int argc, char** argv) {
    if (argc != 2) {
        std::fprintf(stderr, "make_seeds FOLDER\n");
        return 2;
    }
    lodestone::fuzz::Seeds seeds(argv[1]);
    lodestone::fuzz::make_meshes(seeds);
    lodestone::fuzz::make_images(seeds, argv[1]);
    lodestone::fuzz::make_scenes(seeds);
}
