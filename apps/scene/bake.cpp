#include "apps/scene/bake.h"

#include <algorithm>

#include "apps/scene/bake_atlas.h"
#include "apps/scene/bake_cost.h"
#include "apps/scene/unwrap.h"
#include "apps/terminal.h"
#include "base/clock.h"
#include "base/files/chunk_file.h"
#include "base/files/file.h"
#include "base/json.h"
#include "base/spill.h"
#include "base/text.h"
#include "baseline/discrete.h"
#include "frame/screen_error.h"
#include "lod/bake/bake.h"
#include "lod/bake/error_curve.h"
#include "lod/bake/simplify/simplifier.h"
#include "mesh/io/material_chunks.h"
#include "mesh/repair.h"
#include "mesh/topology.h"
#include "vgi/asset/atlas_chunks.h"

namespace lodestone {

namespace {

bool wants(const BakeOptions& options, const std::string& backend) {
    return std::find(options.backends.begin(), options.backends.end(), backend) != options.backends.end();
}

Json to_json(const Topology& t) {
    return {{"triangles", t.triangles},           {"vertices", t.vertices}, {"components", t.components},
            {"boundary_loops", t.boundary_loops}, {"genus", t.genus},       {"seam_edges", t.seam_edges}};
}

Json to_json(const RepairReport& r) {
    return {{"welded_vertices", r.welded_vertices},
            {"degenerate_triangles", r.degenerate_triangles},
            {"duplicate_triangles", r.duplicate_triangles},
            {"flipped_triangles", r.flipped_triangles},
            {"non_manifold_edges", r.non_manifold_edges},
            {"non_orientable_edges", r.non_orientable_edges},
            {"non_manifold_vertices", r.non_manifold_vertices},
            {"unreferenced_vertices", r.unreferenced_vertices}};
}

SimplifyOptions simplify_options(const BakeOptions& options) {
    SimplifyOptions simplify;
    if (options.normal_weight >= 0) simplify.normal_weight = options.normal_weight;
    if (options.uv_weight >= 0) simplify.uv_weight = options.uv_weight;
    if (options.colour_weight >= 0) simplify.colour_weight = options.colour_weight;
    return simplify;
}

struct Simplified {
    CollapseList list;
    double cpu = 0;  // seconds
};
Result<Simplified> load_or_simplify(const TriMesh& mesh, const BakeOptions& options, const Progress& progress,
                                    const CheckpointFolder* work) {
    return load_or_make<Simplified>(
        work, "lod-collapses",
        [](const ChunkFile& file) -> std::optional<Simplified> {
            auto list = CollapseList::open(file);
            const auto cpu = file.array<double>("cpu");
            if (!list || !cpu || cpu->size() != 1) return std::nullopt;
            return Simplified{std::move(*list), (*cpu)[0]};
        },
        [&]() -> Result<Simplified> {
            const auto simplifier =
                options.simplifier == "openmesh" ? make_openmesh_simplifier() : make_quadric_simplifier();
            const Stopwatch watch;
            auto list = simplifier->simplify(mesh, simplify_options(options), progress);
            if (!list) return tl::unexpected(list.error());
            return Simplified{std::move(*list), watch.cpu()};
        },
        [](const Simplified& made, ChunkWriter& writer) {
            auto done = made.list.write_chunks(writer);
            return done ? writer.add_array("cpu", std::span(&made.cpu, 1)) : done;
        });
}

// The progressive mesh with its measured errors. Figures that are not told by it go into `report`.
Result<ProgressiveMesh> make_lod(const TriMesh& mesh, const BakeOptions& options, Json& report,
                                 const Progress& progress, const CheckpointFolder* work) {
    progress.at("simplify", 0);
    const auto simplified = load_or_simplify(mesh, options, progress, work);
    if (!simplified) return tl::unexpected(simplified.error());
    const CollapseList& list = simplified->list;
    report["simplify_cpu_seconds"] = simplified->cpu;
    const Stopwatch order_watch;
    auto pm = bake_progressive_mesh(mesh, list, options.orders, options.order, progress);
    if (!pm) return tl::unexpected(pm.error());
    report["order_seconds"] = order_watch.wall();
    const Stopwatch error_watch;
    ErrorCurveOptions curve;
    curve.samples = options.error_samples;
    auto errors = measure_errors(*pm, curve, progress);
    if (!errors) return tl::unexpected(errors.error());
    pm->set_errors(std::move(*errors));
    report["error_seconds"] = error_watch.wall();
    report["error_cpu_seconds"] = error_watch.cpu();
    report["stopped_because"] = describe(list.stop);
    report["blocked_by_topology"] = list.blocked_by_topology;
    report["blocked_by_flips"] = list.blocked_by_flips;
    report["search_stopped_early"] =
        std::ranges::any_of(pm->orders, [](const FaceOrder& order) { return order.searched_less; });
    return pm;
}

Result<ProgressiveMesh> bake_lod(const TriMesh& mesh, const BakeOptions& options, Json& report,
                                 const Progress& progress, const CheckpointFolder* work) {
    auto pm = load_or_make<ProgressiveMesh>(
        work, "lod",
        [&](const ChunkFile& file) -> std::optional<ProgressiveMesh> {
            auto kept = ProgressiveMesh::open(file);
            const auto figures = file.text("figures");
            if (!kept || !figures) return std::nullopt;
            report = Json::parse(*figures);
            return std::move(*kept);
        },
        [&] { return make_lod(mesh, options, report, progress, work); },
        [&](const ProgressiveMesh& made, ChunkWriter& writer) {
            auto done = made.write_chunks(writer);
            return done ? writer.add_text("figures", report.dump()) : done;
        });
    if (!pm) return pm;
    const uint32_t base = pm->triangles_at(pm->levels() - 1);
    report["levels"] = pm->levels();
    report["base_triangles"] = base;
    uint64_t most_permutation_bytes = 0;
    for (const FaceOrder& order : pm->orders)
        most_permutation_bytes = std::max(most_permutation_bytes, order.permutation_bytes());
    report["permutation_bytes"] = most_permutation_bytes;
    report["moved_per_ecol"] = pm->orders[0].moved_per_ecol(pm->ecols.size());
    if (mesh.triangle_count() >= 64 && base > mesh.triangle_count() / 2) {
        progress.warning("the hierarchy is of little use: the coarsest level still has " + std::to_string(base) +
                         " of " + std::to_string(mesh.triangle_count()) + " triangles, because " +
                         report["stopped_because"].get<std::string>());
    }
    return pm;
}

void add_atlas_options(Json& json, const vgi::AtlasOptions& atlas) {
    const vgi::ClusterWeights& weights = atlas.clusters.weights;
    json["clusters"] = atlas.clusters.clusters;
    json["cluster_weights"] = {weights.planarity, weights.compactness, weights.size,   weights.irregularity,
                               weights.curvature, weights.bulge,       weights.feature};
    json["bucket_triangles"] = atlas.clusters.bucket_triangles;
    json["resolution"] = atlas.cells + 1;
    json["most_texels_per_triangle"] = atlas.most_texels_per_triangle;
    json["rounding_share"] = atlas.rounding_share;
    json["attribute_ratio"] = atlas.attribute_ratio;
    json["worst_stretch"] = atlas.worst_stretch;
    json["most_rounds"] = atlas.most_rounds;
    json["recentre_passes"] = atlas.recentre_passes;
    json["atlas_error_samples"] = atlas.error_samples;
    json["leaves"] = atlas.leaves;
    json["samples_per_triangle"] = atlas.samples_per_triangle;
    json["bake_textures"] = atlas.bake_textures;
    json["texture_quality"] = atlas.texture_quality;
    json["curvature_importance"] = atlas.parameterise.curvature_importance;
    json["most_solves"] = atlas.parameterise.most_solves;
    json["least_gain"] = atlas.parameterise.least_gain;
}

}  // namespace

static Json to_json(const GreedyOptions& greedy) {
    return {{"group", greedy.group},     {"window", greedy.window},
            {"step", greedy.step},       {"in_place", greedy.in_place},
            {"line", greedy.line},       {"line_bytes", greedy.line_bytes},
            {"waiting", greedy.waiting}, {"look_ahead", greedy.look_ahead}};
}

Json BakeOptions::to_json() const {
    Json json = {{"backends", backends},
                 {"orders", orders},
                 {"cache", name_of(order.cache)},
                 {"moves_per_ecol", order.moves_per_ecol},
                 {"order_seconds", order.seconds},
                 {"greedy", lodestone::to_json(order.greedy)},
                 {"simplifier", simplifier},
                 {"normal_weight", normal_weight},
                 {"uv_weight", uv_weight},
                 {"colour_weight", colour_weight},
                 {"error_samples", error_samples},
                 {"triangles_per_cluster",
                  triangles_per_cluster ? Json{triangles_per_cluster->fewest, triangles_per_cluster->most} : Json()},
                 {"target_error", target_error},
                 {"load_images", read.load_images},
                 {"height_scale", read.height_scale},
                 {"pixel_size", read.pixel_size}};
    add_atlas_options(json, atlas);
    if (quantise > 0) json["quantise"] = quantise;
    if (retexture) json["retexture"] = true;
    if (read.fill_voids) json["fill_voids"] = true;
    if (read.void_height) json["void_height"] = *read.void_height;
    if (read.gltf_mesh >= 0) json["gltf_mesh"] = read.gltf_mesh;
    if (read.allow_outside) json["allow_outside"] = true;
    for (const ClipPlane& p : clip)
        json["clip"].push_back({{"normal", {p.normal.x, p.normal.y, p.normal.z}},
                                {"offset", p.offset},
                                {"keeps", p.above ? "above" : "below"}});
    return json;
}

Result<BakeInput> read_bake_input(const std::filesystem::path& path, const BakeOptions& options,
                                  const Progress& progress) {
    progress.at("read", 0);
    if (!spilling()) {
        if (auto room = check_room_for_bake(path, options); !room) return tl::unexpected(room.error());
    }
    BakeInput input;
    input.name = as_utf8(path.filename().string());
    ReadOptions read = options.read;
    read.hash_source = true;
    auto mesh = read_mesh(path, read, &input.read);
    if (!mesh) return tl::unexpected(mesh.error());
    input.source = input.read.source;
    for (const std::string& line : input.read.warnings) progress.warning(line);
    input.mesh = std::move(*mesh);
    if (!options.clip.empty()) {
        if (auto done = clip(input.mesh, options.clip); !done) return fail_at(path.string(), done.error());
    }
    return input;
}

Result<BakeInput> collect_bake_input(MeshStream& stream, std::string name, const Hash128& source,
                                     const Progress& progress) {
    auto mesh = collect(stream, progress);
    if (!mesh) return tl::unexpected(mesh.error());
    BakeInput input;
    input.name = std::move(name);
    input.source = source;
    input.mesh = std::move(*mesh);
    return input;
}

namespace {

// What an asset tells of itself, as far as it is known before its backends are baked.
Json about_of(const BakeInput& input, const Json& options, const RepairReport& repaired) {
    Json about;
    about["name"] = input.name;
    about["program"] = "lodestone " LODESTONE_VERSION;
    about["options"] = options;
    about["input"] = to_json(topology_of(input.mesh));
    about["input"]["attributes"] = Json::array();
    const PresentAttributes has = attributes_of(input.mesh);
    if (has.normals) about["input"]["attributes"].push_back("normals");
    if (has.uvs) about["input"]["attributes"].push_back("uvs");
    if (has.second_uvs) about["input"]["attributes"].push_back("second_uvs");
    if (has.tangents) about["input"]["attributes"].push_back("tangents");
    if (has.colours) about["input"]["attributes"].push_back("colours");
    if (has.materials) about["input"]["attributes"].push_back("materials");
    about["repair"] = to_json(repaired);
    const Sphere bounds = bounding_sphere_of(input.mesh.positions);
    about["bounds"] = {bounds.centre.x, bounds.centre.y, bounds.centre.z, bounds.radius};
    return about;
}

// What --retexture makes of the mesh, and what the report tells of it. Nothing where there is no texture.
Result<Json> retexture_input(BakeInput& input, const Progress& progress) {
    if (input.mesh.images.empty()) {
        progress.warning("there is no texture that --retexture could lay out anew");
        return Json();
    }
    const Stopwatch watch;
    const auto done = retexture(input.mesh, progress);
    if (!done) return fail_at(input.name, done.error());
    return Json{{"charts", done->charts},
                {"seam_edges", done->seam_edges},
                {"triangles", done->triangles},
                {"resolution", input.mesh.images[0].width},
                {"seconds", watch.wall()}};
}

// One asset in the making: each add_... bakes a backend, writes its chunks and tells of it.
class AssetBake {
public:
    AssetBake(const BakeInput& input, const BakeOptions& options, const Progress& progress,
              const CheckpointFolder* work)
        : input_(input), options_(options), progress_(progress), work_(work) {}

    Json report;  // what the caller is told

    Result<void> add_backends(ChunkWriter& writer) {
        for (const auto& [name, add] :
             {std::pair("lod", &AssetBake::add_lod), std::pair("vgi", &AssetBake::add_vgi),
              std::pair("discrete", &AssetBake::add_discrete), std::pair("full", &AssetBake::add_full)}) {
            if (wants(options_, name)) {
                const uint64_t before = writer.bytes();
                if (auto done = (this->*add)(writer); !done) return done;
                report[name]["bytes"] = writer.bytes() - before;
            }
            if (progress_.stopped()) return fail(Fault::interrupted, "interrupted");
        }
        return {};
    }

private:
    Result<void> add_lod(ChunkWriter& writer) {
        TriMesh rounded;
        if (options_.quantise > 0) {
            rounded = input_.mesh;
            quantise(rounded, options_.quantise);
        }
        auto pm = bake_lod(options_.quantise > 0 ? rounded : input_.mesh, options_, report["lod"], progress_, work_);
        if (!pm) return tl::unexpected(pm.error());
        const Json words = {{"levels", report["lod"]["levels"]},
                            {"base_triangles", report["lod"]["base_triangles"]},
                            {"stopped_because", report["lod"]["stopped_because"]}};
        report["lod"]["triangles"] = pm->full_triangles();
        auto done = writer.add_text("lod/about", words.dump());
        return done ? pm->write_chunks(writer) : done;
    }

    Result<void> add_vgi(ChunkWriter& writer) {
        auto atlas = bake_atlas(input_.mesh, options_, report["vgi"], progress_, work_);
        if (!atlas) return fail_at(input_.name, atlas.error());
        if (atlas->attributes.baked && !options_.atlas.bake_textures)
            progress_.warning(input_.name +
                              ": its textures lie on two sets of texture coordinates, and an atlas keeps one; they are "
                              "baked into it");
        if (!atlas->attributes.baked && atlas->attributes.uvs && !input_.mesh.tangents.empty())
            progress_.warning(input_.name +
                              ": an atlas keeps no tangents, so vgi draws normal maps in the frame of the texture "
                              "coordinates; bake without --keep-uv, and they are baked by the tangents");
        if (atlas->attributes.baked && options_.backends.size() == 1) leave_out_textures(*atlas);
        Json words;
        for (const char* figure :
             {"clusters", "charts", "resolution", "l2_stretch_rms", "l2_stretch_worst", "rms_error", "max_error"})
            words[figure] = report["vgi"][figure];
        progress_.at("pages", 0);
        auto done = writer.add_text("vgi/about", words.dump());
        return done ? vgi::write_chunks(*atlas, writer) : done;
    }

    // What is baked is in the atlas; other backends would need the textures.
    static void leave_out_textures(vgi::Atlas& atlas) {
        for (Material& material : atlas.material_table) {
            for (Texture* texture : material.textures()) *texture = {};
        }
        atlas.images.clear();
    }

    Result<void> add_discrete(ChunkWriter& writer) {
        const Stopwatch watch;
        auto chain = load_or_make<DiscreteChain>(
            work_, "discrete",
            [&](const ChunkFile& file) -> std::optional<DiscreteChain> {
                auto kept = DiscreteChain::open(file, std::max<size_t>(1, input_.mesh.material_table.size()));
                return kept ? std::optional(std::move(*kept)) : std::nullopt;
            },
            [&] { return make_discrete_chain(input_.mesh, progress_); },
            [](const DiscreteChain& made, ChunkWriter& to) { return made.write_chunks(to); });
        if (!chain) return tl::unexpected(chain.error());
        report["discrete"] = {{"levels", chain->levels.size()}, {"seconds", watch.wall()}};
        return add_chain(*chain, "discrete", writer);
    }

    Result<void> add_full(ChunkWriter& writer) { return add_chain(source_chain(input_.mesh), "full", writer); }

    Result<void> add_chain(const DiscreteChain& chain, const char* room, ChunkWriter& writer) {
        auto done = chain.write_chunks(writer, room);
        return done ? write_materials(writer, input_.mesh.material_table, input_.mesh.images) : done;
    }

    const BakeInput& input_;
    const BakeOptions& options_;
    const Progress& progress_;
    const CheckpointFolder* const work_;
};

}  // namespace

Result<Json> bake_asset(BakeInput input, const BakeOptions& options, const std::filesystem::path& out,
                        const Progress& progress, const CheckpointFolder* work) {
    const Stopwatch watch;
    const Json option_json = options.to_json();
    progress.at("repair", 0);
    auto repaired = repair(input.mesh, {}, progress);
    if (!repaired) return fail_at(input.name, repaired.error());
    AssetBake bake(input, options, progress, work);
    bake.report = about_of(input, option_json, *repaired);
    const std::string about = bake.report.dump();
    if (options.retexture) {
        auto told = retexture_input(input, progress);
        if (!told) return tl::unexpected(told.error());
        if (!told->is_null()) bake.report["retexture"] = std::move(*told);
    }
    auto writer = ChunkWriter::create(out, {input.source, recipe_hash(options)});
    if (!writer) return tl::unexpected(writer.error());
    if (auto done = writer->add_text("about", about); !done) return tl::unexpected(done.error());
    if (auto done = bake.add_backends(*writer); !done) return tl::unexpected(done.error());
    auto bytes = writer->commit();
    if (!bytes) return tl::unexpected(bytes.error());
    Json& report = bake.report;
    report["source_hash"] = input.source.hex();
    report["warnings"] = input.read.warnings;
    report["seconds"] = watch.wall();
    report["peak_rss_bytes"] = peak_rss_bytes();
    report["out_bytes"] = *bytes;
    return report;
}

Hash128 recipe_hash(const BakeOptions& options) {
    const std::string text = options.to_json().dump() + LODESTONE_VERSION + "." + std::to_string(bake_revision);
    return hash_of(std::span(text.data(), text.size()));
}

Hash128 bake_key(const Hash128& source, const BakeOptions& options) {
    const std::string text = source.hex() + recipe_hash(options).hex();
    return hash_of(std::span(text.data(), text.size()));
}

}  // namespace lodestone
