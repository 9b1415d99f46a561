#include "lod/asset/stored_mesh.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <glm/geometric.hpp>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "base/random.h"
#include "fixtures/crafted.h"
#include "fixtures/faces.h"
#include "fixtures/materials.h"
#include "fixtures/meshes.h"
#include "lod/asset/cursor.h"
#include "lod/asset/number_streams.h"
#include "lod/bake/bake.h"
#include "lod/bake/error_curve.h"
#include "lod/bake/simplify/simplifier.h"
#include "mesh/generate.h"
#include "mesh/repair.h"

namespace lodestone {
namespace {

namespace fs = std::filesystem;
using fixtures::Fixture;

ProgressiveMesh baked(const TriMesh& mesh, const std::vector<std::string>& orders) {
    const auto list = make_quadric_simplifier()->simplify(mesh, {});
    EXPECT_TRUE(list) << list.error().message;
    auto pm = bake_progressive_mesh(mesh, *list, orders);
    EXPECT_TRUE(pm) << pm.error().message;
    const auto errors = measure_errors(*pm, {2000, 1});
    EXPECT_TRUE(errors);
    pm->set_errors(*errors);
    return std::move(*pm);
}

// What its second texture coordinates are.
glm::vec2 second_at(const glm::vec3& p) { return {p.x - p.z, 3 * p.y}; }
TriMesh of_two_sets(TriMesh mesh) {
    for (const uint32_t v : mesh.wedge_vertex) mesh.second_uvs.push_back(second_at(mesh.positions[v]));
    return mesh;
}

// Round an axis; mirrored on one half, and none on a part of it.
glm::vec4 tangent_at(const glm::vec3& p) {
    if (p.z > 0.7f) return glm::vec4(0);
    return {glm::normalize(glm::vec3(p.y, -p.x, 0.1f)), p.x < 0 ? -1 : 1};
}
TriMesh of_tangents(TriMesh mesh) {
    if (mesh.normals.empty()) compute_normals(mesh);
    for (const uint32_t v : mesh.wedge_vertex) mesh.tangents.push_back(tangent_at(mesh.positions[v]));
    return mesh;
}

// Closed and open, with seams, in pieces, with colours and materials, a second set of texture coordinates, and
// tangents.
std::vector<Fixture> all_meshes() {
    std::vector<Fixture> all = fixtures::manifold_meshes();
    for (const auto& [name, shape, seed] :
         {std::tuple("rock", Shape::rock, 5), {"terrain", Shape::terrain, 6}, {"torus with seams", Shape::torus, 1}})
        all.push_back({name, generate(shape, 2500, static_cast<uint64_t>(seed))});
    all.push_back({"grid", generate(Shape::grid, 1000, 1)});
    TriMesh painted = fixtures::repaired(Shape::rock, 1500);
    painted.material_table.resize(3);
    for (size_t w = 0; w < painted.wedge_count(); ++w) {
        painted.materials.push_back(static_cast<uint16_t>(w % 7 / 3));
        painted.colours.emplace_back(w % 256, 3 * w % 256, 128, 255);
    }
    all.push_back({"painted rock", std::move(painted)});
    all.push_back({"torus of two sets", of_two_sets(generate(Shape::torus, 1500, 1))});
    all.push_back({"rock of tangents", of_tangents(generate(Shape::rock, 1500, 1))});
    all.push_back({"torus of both", of_tangents(of_two_sets(generate(Shape::torus, 1500, 1)))});
    all.push_back({"cube of tangents", fixtures::mesh_of_tangents()});
    return all;
}

std::multiset<Triangle> drawn(const ProgressiveMesh& pm, uint32_t level, uint32_t order) {
    PmCursor cursor(pm, order);
    cursor.goto_level(level);
    EXPECT_TRUE(cursor.validate());
    return fixtures::faces_of(cursor.drawn_indices());
}

template <class T>
bool equal(std::span<const T> a, std::span<const T> b) {
    return std::ranges::equal(a, b);
}

class StoredMeshTest : public testing::Test {
protected:
    void TearDown() override { fs::remove(path_); }
    void write(const ProgressiveMesh& pm) const {
        auto writer = ChunkWriter::create(path_, {});
        ASSERT_TRUE(pm.write_chunks(*writer));
        ASSERT_TRUE(writer->add_text("behind", "it"));
        ASSERT_TRUE(writer->commit());
    }
    Result<ProgressiveMesh> open(Extent extent = Extent::whole) const {
        const auto file = ChunkFile::open(path_, extent);
        if (!file) return tl::unexpected(file.error());
        return ProgressiveMesh::open(*file);
    }
    // What is said where the chunk that tells of attributes says something else of one.
    std::string said_of(const char* attribute, bool there) const {
        const auto bytes = fixtures::chunk_of(path_, "lod/mesh");
        auto told = nlohmann::json::parse(std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
        told["attributes"][attribute] = there;
        const std::string text = told.dump();
        const fs::path bad = path_.string() + ".bad";
        fixtures::replace_chunk(path_, "lod/mesh", std::as_bytes(std::span(text)), bad);
        const auto opened = ProgressiveMesh::open(*ChunkFile::open(bad));
        fs::remove(bad);
        return opened ? "nothing" : opened.error().message;
    }
    const fs::path path_ = fs::temp_directory_path() / ("lodestone-stored-test-" + std::to_string(getpid()) + ".lode");
};

TEST_F(StoredMeshTest, EveryOrderComesBackBitForBit) {
    for (const Fixture& f : all_meshes()) {
        SCOPED_TRACE(f.name);
        const ProgressiveMesh pm = baked(f.mesh, {"keyframe", "static", "classic", "greedy"});
        write(pm);
        const auto read = open();
        ASSERT_TRUE(read) << read.error().message;
        EXPECT_TRUE(equal(read->vertices, pm.vertices));
        EXPECT_TRUE(equal(read->further, pm.further));
        EXPECT_TRUE(equal(read->wedge_vertex, pm.wedge_vertex));
        EXPECT_TRUE(equal(read->ecols, pm.ecols));
        EXPECT_TRUE(equal(read->parents, pm.parents));
        EXPECT_TRUE(equal(read->errors, pm.errors));
        EXPECT_EQ(read->attributes, pm.attributes);
        EXPECT_EQ(read->levels_missing, 0u);
        ASSERT_EQ(read->orders.size(), pm.orders.size());
        for (size_t o = 0; o < pm.orders.size(); ++o) {
            const FaceOrder &a = read->orders[o], &b = pm.orders[o];
            SCOPED_TRACE(b.name);
            EXPECT_EQ(a.name, b.name);
            EXPECT_EQ(a.drops_dead, b.drops_dead);
            EXPECT_TRUE(equal(a.indices, b.indices));
            EXPECT_TRUE(equal(a.first_corner, b.first_corner));
            EXPECT_TRUE(equal(a.corners, b.corners));
            EXPECT_TRUE(equal(a.tswaps, b.tswaps));
            EXPECT_TRUE(equal(a.cycle_lengths, b.cycle_lengths));
            EXPECT_TRUE(equal(a.cycle_slots, b.cycle_slots));
            EXPECT_TRUE(equal(a.keyframes, b.keyframes));
            EXPECT_TRUE(equal(a.block_ends, b.block_ends));
            EXPECT_TRUE(equal(a.block_bytes, b.block_bytes));
        }
        EXPECT_TRUE(read->validate());
    }
}

// The mesh that is baked is one that was unpacked; this is the source's, by another way.
TEST_F(StoredMeshTest, FullDetailIsTheSource) {
    for (const Fixture& f : all_meshes()) {
        SCOPED_TRACE(f.name);
        write(baked(f.mesh, {"keyframe"}));
        const TriMesh level = *extract_level(*open(), 0);
        const auto corners = [](const TriMesh& mesh) {
            std::multiset<std::array<float, 15>> all;
            for (const Triangle& t : mesh.triangles) {
                std::array<std::array<float, 5>, 3> c{};
                for (size_t k = 0; k < 3; ++k) {
                    const glm::vec3 p = mesh.positions[mesh.wedge_vertex[t[k]]];
                    const glm::vec2 uv = mesh.uvs.empty() ? glm::vec2(0) : mesh.uvs[t[k]];
                    c[k] = {p.x, p.y, p.z, uv.x, uv.y};
                }
                std::rotate(c.begin(), std::min_element(c.begin(), c.end()), c.end());
                std::array<float, 15> flat{};
                for (size_t k = 0; k < 15; ++k) flat[k] = c[k / 5][k % 5];
                all.insert(flat);
            }
            return all;
        };
        EXPECT_EQ(corners(level), corners(f.mesh));
    }
}

TEST_F(StoredMeshTest, SecondTextureCoordinatesGoWithTheirWedges) {
    const TriMesh mesh = of_two_sets(generate(Shape::torus, 1500, 1));
    write(baked(mesh, {"static"}));
    const auto read = open();
    ASSERT_TRUE(read) << read.error().message;
    EXPECT_TRUE(read->attributes.second_uvs);
    for (const uint32_t level : {0u, read->levels() / 2, read->levels() - 1}) {
        const auto shown = extract_level(*read, level);
        ASSERT_TRUE(shown);
        ASSERT_TRUE(shown->validate());
        ASSERT_EQ(shown->second_uvs.size(), shown->wedge_count());
        for (size_t w = 0; w < shown->wedge_count(); ++w)
            ASSERT_EQ(shown->second_uvs[w], second_at(shown->positions[shown->wedge_vertex[w]])) << level;
    }
    EXPECT_THAT(said_of("uvs", false), testing::HasSubstr("second texture coordinates without first ones"));
    EXPECT_THAT(said_of("second_uvs", false), testing::HasSubstr("holds something else"));
}

TEST_F(StoredMeshTest, TangentsGoWithTheirWedges) {
    const TriMesh mesh = of_tangents(generate(Shape::torus, 1500, 1));
    write(baked(mesh, {"static"}));
    const auto read = open();
    ASSERT_TRUE(read) << read.error().message;
    EXPECT_TRUE(read->attributes.tangents);
    for (const uint32_t level : {0u, read->levels() / 2, read->levels() - 1}) {
        const auto shown = extract_level(*read, level);
        ASSERT_TRUE(shown);
        ASSERT_TRUE(shown->validate()) << shown->validate().error().message;
        ASSERT_EQ(shown->tangents.size(), shown->wedge_count());
        for (size_t w = 0; w < shown->wedge_count(); ++w) {
            const glm::vec4 is = shown->tangents[w], was = tangent_at(shown->positions[shown->wedge_vertex[w]]);
            ASSERT_EQ(is.w, was.w);
            ASSERT_LE(glm::distance(glm::vec3(is), glm::vec3(was)), 2e-4f) << level;
        }
    }
    EXPECT_THAT(said_of("normals", false), testing::HasSubstr("there are tangents without normals"));
    EXPECT_THAT(said_of("tangents", false), testing::HasSubstr("bake the asset again"));
    EXPECT_THAT(said_of("second_uvs", true), testing::Not("nothing"));
}

// A level's tangents of mirrored frames are never those of one triangle.
TEST_F(StoredMeshTest, MirroredFramesStayApart) {
    TriMesh mesh = generate(Shape::sphere, 3000, 1);
    TriMesh halves = mesh;
    halves.uvs.clear();
    halves.wedge_vertex.clear();
    halves.normals.clear();
    std::map<std::pair<uint32_t, bool>, uint32_t> wedges;
    for (size_t t = 0; t < mesh.triangle_count(); ++t) {
        const bool mirrored = mesh.position_of(t, 0).x + mesh.position_of(t, 1).x + mesh.position_of(t, 2).x < 0;
        for (size_t k = 0; k < 3; ++k) {
            const uint32_t v = mesh.vertex_of(t, static_cast<int>(k));
            const auto [at, fresh] =
                wedges.try_emplace({v, mirrored}, static_cast<uint32_t>(halves.wedge_vertex.size()));
            if (fresh) {
                const glm::vec3 n = glm::normalize(mesh.positions[v]);
                halves.wedge_vertex.push_back(v);
                halves.normals.push_back(n);
                halves.tangents.emplace_back(glm::normalize(glm::cross(n, glm::vec3(0.9f, 0.1f, 0.2f))),
                                             mirrored ? -1 : 1);
            }
            halves.triangles[t][k] = at->second;
        }
    }
    ASSERT_TRUE(repair(halves));
    ASSERT_TRUE(halves.has_seams());
    const ProgressiveMesh pm = baked(halves, {"static"});
    EXPECT_GT(pm.levels(), mesh.vertex_count() / 2);
    for (const uint32_t level : {pm.levels() / 2, pm.levels() * 9 / 10, pm.levels() - 1}) {
        const TriMesh shown = *extract_level(pm, level);
        size_t mixed = 0;
        for (const Triangle& t : shown.triangles) {
            mixed +=
                shown.tangents[t[0]].w != shown.tangents[t[1]].w || shown.tangents[t[0]].w != shown.tangents[t[2]].w;
        }
        EXPECT_EQ(mixed, 0u) << level;
    }
}

// Multiples of a power of two come back as they are, and take less.
TEST_F(StoredMeshTest, PositionsOnAGridTakeLess) {
    TriMesh mesh = fixtures::repaired(Shape::rock, 3000);
    const auto bytes = [&] {
        write(baked(mesh, {"keyframe"}));
        return open()->parts.vertices;
    };
    const uint64_t any = bytes();
    const double step = quantise(mesh, 12);
    EXPECT_GT(step, 0);
    EXPECT_LT(bytes(), any * 3 / 4);
    const auto rounded = open();
    ASSERT_TRUE(rounded);
    for (const MeshVertex& v : rounded->vertices) {
        for (const float x : v.position) EXPECT_EQ(std::remainder(x, step), 0) << x;
    }
    mesh.positions[0].x = -0.0f;  // no multiple of a grid, for it has a sign
    write(baked(mesh, {"keyframe"}));
    const auto signed_zero = open();
    ASSERT_TRUE(signed_zero);
    const auto has_it = [](const MeshVertex& v) { return v.position[0] == 0 && std::signbit(v.position[0]); };
    EXPECT_EQ(std::ranges::count_if(signed_zero->vertices, has_it), std::ranges::count(mesh.wedge_vertex, 0u));
}

TEST_F(StoredMeshTest, APrefixIsTheLevelsThatAreThere) {
    for (const Shape shape : {Shape::rock, Shape::terrain, Shape::torus}) {
        SCOPED_TRACE(static_cast<int>(shape));
        write(baked(fixtures::repaired(shape, 5000), {"keyframe", "static", "classic", "greedy"}));
        const auto whole = open();
        ASSERT_TRUE(whole);
        std::ifstream in(path_, std::ios::binary);
        const std::string bytes{std::istreambuf_iterator<char>(in), {}};
        const auto file = ChunkFile::open(path_);
        const auto blocks = *file->array<StoredBlock>("lod/table");
        const auto chunk = std::ranges::find(file->chunks(), "lod/blocks", &ChunkInfo::name);
        ASSERT_GE(blocks.size(), 3u);
        uint64_t end = chunk->offset;
        for (const StoredBlock& block : blocks) {
            end += block.bytes + block.error_bytes;
            for (const uint64_t more : {0u, 1u}) {
                fs::resize_file(path_, 0);
                std::ofstream(path_, std::ios::binary) << bytes.substr(0, end + more);
                const auto refused = open();
                ASSERT_FALSE(refused);
                EXPECT_EQ(refused.error().fault, Fault::format);
                const auto part = open(Extent::prefix);
                ASSERT_TRUE(part) << part.error().message;
                EXPECT_EQ(part->levels_missing, block.level);
                ASSERT_EQ(part->levels() + block.level, whole->levels());
                EXPECT_TRUE(equal(part->vertices, whole->vertices.first(block.wedges)));
                EXPECT_TRUE(equal(part->errors, whole->errors.subspan(block.level)));
                const auto valid = part->validate();
                EXPECT_TRUE(valid) << valid.error().message;
                for (const uint32_t level : {0u, part->levels() / 2, part->levels() - 1}) {
                    for (uint32_t order = 0; order < part->orders.size(); ++order)
                        EXPECT_EQ(drawn(*part, level, order), drawn(*whole, level + block.level, 0));
                }
            }
        }
        // Less than a block, and less than the table.
        for (const uint64_t least : {chunk->offset + 1, chunk->offset - 100}) {
            fs::resize_file(path_, 0);
            std::ofstream(path_, std::ios::binary) << bytes.substr(0, least);
            const auto nothing = open(Extent::prefix);
            ASSERT_FALSE(nothing);
            EXPECT_EQ(nothing.error().fault, Fault::format);
        }
    }
}

// At a keyframe a prefix draws in the same order as the whole file.
TEST_F(StoredMeshTest, APrefixThatEndsAtAKeyframeHasItsOrder) {
    write(baked(fixtures::repaired(Shape::rock, 5000), {"keyframe"}));
    const auto whole = open();
    std::ifstream in(path_, std::ios::binary);
    const std::string bytes{std::istreambuf_iterator<char>(in), {}};
    const auto file = ChunkFile::open(path_);
    const auto blocks = *file->array<StoredBlock>("lod/table");
    uint64_t end = std::ranges::find(file->chunks(), "lod/blocks", &ChunkInfo::name)->offset;
    int at_keyframes = 0;
    for (const StoredBlock& block : blocks) {
        end += block.bytes + block.error_bytes;
        if (!std::ranges::count(whole->orders[0].keyframes, block.level, &Keyframe::level)) continue;
        std::ofstream(path_, std::ios::binary) << bytes.substr(0, end);
        const auto part = open(Extent::prefix);
        ASSERT_TRUE(part);
        PmCursor cursor(*whole);
        cursor.goto_level(block.level);
        EXPECT_TRUE(equal(part->orders[0].indices, cursor.drawn_indices()));
        ++at_keyframes;
    }
    EXPECT_GT(at_keyframes, 0);
}

TEST_F(StoredMeshTest, ADamagedBlockIsRefusedByOneLine) {
    write(baked(fixtures::repaired(Shape::rock, 1500), {"keyframe"}));
    const auto file = ChunkFile::open(path_);
    const auto chunk = std::ranges::find(file->chunks(), "lod/blocks", &ChunkInfo::name);
    std::fstream(path_, std::ios::in | std::ios::out | std::ios::binary)
        .seekp(static_cast<std::streamoff>(chunk->offset + chunk->bytes / 2))
        .put('\xa5');
    for (const Extent extent : {Extent::whole, Extent::prefix}) {
        const auto read = open(extent);
        ASSERT_FALSE(read);
        EXPECT_EQ(read.error().fault, Fault::format);
        EXPECT_THAT(read.error().message, testing::HasSubstr("lod/blocks: block"));
        EXPECT_THAT(read.error().message, testing::Not(testing::HasSubstr("\n")));
    }
}

TEST(NumberStreams, GiveBackWhatWasWritten) {
    Random random(4);
    NumberWriter to(3, 2);
    std::vector<std::pair<uint32_t, uint32_t>> written;
    for (int i = 0; i < 50000; ++i) {
        const uint32_t kind = random.below(5),
                       number = kind < 3 ? random.below(kind == 0 ? 4 : 70000) : random.below(1u << 20);
        written.emplace_back(kind, number);
        if (kind < 3) {
            to.number(kind, number);
        } else {
            to.bits(kind - 3, number, 20);
        }
    }
    to.bits(0, ~0u, 32);
    const auto packed = to.packed();
    auto from = NumberReader::unpack(packed, 3, 2, 1 << 20);
    ASSERT_TRUE(from);
    for (const auto& [kind, number] : written)
        ASSERT_EQ(kind < 3 ? from->number(kind) : from->bits(kind - 3, 20), number);
    EXPECT_FALSE(from->finished());
    EXPECT_EQ(from->bits(0, 32), ~0u);
    EXPECT_TRUE(from->finished());
    EXPECT_EQ(from->number(0), 0u);
    EXPECT_TRUE(from->broken());
    EXPECT_FALSE(NumberReader::unpack(packed, 3, 2, 1000));  // more than there may be
    EXPECT_FALSE(NumberReader::unpack(packed, 4, 2, 1 << 20));
}

// However few or many are asked for at once, and where the stream ends.
TEST(NumberStreams, BitsOfAnyWidthComeBackAndNoMore) {
    Random random(3);
    for (uint32_t count = 0; count < 200; ++count) {
        NumberWriter to(1, 1);
        std::vector<std::pair<uint32_t, uint32_t>> written;  // width, bits
        for (uint32_t i = 0; i < count; ++i) {
            const auto width = static_cast<uint32_t>(random.below(33));
            const auto bits = static_cast<uint32_t>(random.below(1u << 31) & ((uint64_t{1} << width) - 1));
            to.bits(0, bits, width);
            to.byte(0, static_cast<uint8_t>(i));
            written.emplace_back(width, bits);
        }
        const auto packed = to.packed();
        auto from = NumberReader::unpack(packed, 1, 1, 1 << 20, std::vector<uint8_t>(7, 5));
        ASSERT_TRUE(from);
        EXPECT_EQ(from->finished(), count == 0);
        for (const auto& [width, bits] : written) ASSERT_EQ(from->bits(0, width), bits) << count;
        const auto rest = from->rest(0);
        ASSERT_EQ(rest.size(), count);
        for (uint32_t i = 0; i < count; ++i) ASSERT_EQ(rest[i], static_cast<uint8_t>(i));
        from->took(0, count);
        EXPECT_TRUE(from->finished()) << count;
        EXPECT_EQ(from->bits(0, 32), 0u);
        EXPECT_TRUE(from->broken());
    }
}

}  // namespace
}  // namespace lodestone
