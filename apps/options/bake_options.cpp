#include "apps/options/bake_options.h"

#include <algorithm>
#include <charconv>

#include "apps/options/common_options.h"
#include "apps/options/probed_cache.h"
#include "lod/bake/orders/face_order.h"
#include "lod/bake/simplify/simplifier.h"

namespace lodestone {

namespace {

Result<void> check_backends(const std::vector<std::string>& backends) {
    for (const std::string& b : backends) {
        if (b != "lod" && b != "vgi" && b != "discrete" && b != "full")
            return fail(Fault::usage,
                        "--backends " + b + ": there is no such backend; choose from lod, vgi, discrete, full");
    }
    return {};
}

// 0 for without loss.
Result<uint32_t> parse_quality(const std::string& text) {
    if (text == "lossless") return 0;
    uint32_t quality = 0;
    const char* end = text.data() + text.size();
    const auto [rest, error] = std::from_chars(text.data(), end, quality);
    if (error != std::errc() || rest != end || quality < 1 || quality > 100)
        return fail(Fault::usage, "--texture-quality " + text + ": give a number from 1 to 100, or lossless");
    return quality;
}

Result<std::vector<std::string>> parse_orders(const std::string& text) {
    auto orders = parse_list("--order", text);
    if (!orders) return orders;
    for (auto order = orders->begin(); order != orders->end(); ++order) {
        if (auto orderer = face_orderer_named(*order); !orderer) return fail_at("--order", orderer.error());
        if (std::find(orders->begin(), order, *order) != order)
            return fail(Fault::usage, "--order " + text + ": names " + *order + " twice");
    }
    return orders;
}

void add_backend_options(CLI::App& command, BakeWords& o) {
    command
        .add_option("--backends", o.backends,
                    "What to bake, separated by commas: lod (a progressive mesh), vgi (an atlas of geometry images), "
                    "discrete (a chain of simplified meshes), full (the mesh itself)")
        ->capture_default_str();
    add_outside_option(command, o.bake.read.allow_outside);
}

void add_order_options(CLI::App& command, BakeWords& o) {
    command
        .add_option(
            "--order", o.orders,
            "lod: face orders to bake, separated by commas: keyframe, greedy, static, classic; the first is drawn "
            "unless another is asked for")
        ->capture_default_str();
    command
        .add_option("--cache", o.cache,
                    "lod: vertex cache that face orders are optimised for: fifoN, lruN, nvidia, amd, intel or auto; "
                    "auto is the model that probe found last, or nvidia before any probe")
        ->capture_default_str();
    command
        .add_option(
            "--order-seconds", o.bake.order.seconds,
            "lod: longest search for a face order, in seconds, about; it is estimated from the size of the mesh, so "
            "that every machine makes the same asset")
        ->check(CLI::Range(0.0, 1e6))
        ->capture_default_str();
    command
        .add_option("--moves-per-ecol", o.bake.order.moves_per_ecol,
                    "lod: slots that keyframe and greedy write per edge collapse, about, at most; more give fewer "
                    "vertex transforms")
        ->check(CLI::Range(0.1, 100.0))
        ->capture_default_str();
}

void add_greedy_options(CLI::App& command, GreedyOptions& greedy) {
    const auto add = [&](const char* name, auto& value, auto least, auto most, const char* text) {
        command.add_option(name, value, text)->check(CLI::Range(least, most))->capture_default_str();
    };
    add("--greedy-group", greedy.group, 1, 100000,
        "lod: edge collapses to a group of the order greedy; tswaps come at its end");
    add("--greedy-window", greedy.window, 32, 100000,
        "lod: slots that a group of the order greedy rearranges; more give fewer vertex transforms");
    add("--greedy-step", greedy.step, 2, 100000,
        "lod: slots that the order greedy writes between two levels at most; the rest of a group's tswaps follow at "
        "the next levels");
    add("--greedy-in-place", greedy.in_place, 0.0, 1000.0,
        "lod: vertex transforms that the order greedy must save for each slot that it writes");
    add("--greedy-line", greedy.line, 0.0, 1000.0,
        "lod: vertex transforms that the order greedy must save for each line of the CPU's cache that it writes and "
        "the collapses of the group do not");
    add("--greedy-line-bytes", greedy.line_bytes, 16, 4096, "lod: bytes of a line of the CPU's cache, for the same");
    add("--greedy-waiting", greedy.waiting, 1.05, 100.0,
        "lod: drawn slots to a living face that the order greedy allows; dead slots wait until there are more");
    add("--look-ahead", greedy.look_ahead, 0, 1000,
        "lod: faces that the order greedy looks ahead for each choice; 0 for none");
}

void add_form_options(CLI::App& command, BakeWords& o) {
    command
        .add_option("--quantise", o.bake.quantise,
                    "lod: round positions to this many bits along the longest side of the mesh, for a smaller file; "
                    "errors of levels are then those to the rounded mesh. Unless given they are kept as they are")
        ->check(CLI::Range(6, 24));
}

void add_chart_options(CLI::App& command, BakeWords& o) {
    command
        .add_option("--clusters", o.clusters,
                    "vgi: clusters wanted; each becomes one quad chart for each of its sides. Unless given 130, but "
                    "one for each 1,000 triangles of the mesh at most, and one for each 50,000 at least")
        ->check(CLI::Range(1, 1 << 20));
    command
        .add_option("--target-error", o.bake.target_error,
                    "vgi: double --clusters until the error of the finest level is at most this, in object units")
        ->check(CLI::PositiveNumber);
    command
        .add_option(
            "--resolution", o.resolution,
            "vgi: samples along each side of a chart, 2^n + 1; unless given about a sample for each triangle of the "
            "mesh, 129 at most, and 129 with --no-leaves")
        ->check(CLI::IsMember({3, 5, 9, 17, 33, 65, 129, 257, 513, 1025}));
    command
        .add_option(
            "--attribute-resolution", o.attribute_resolution,
            "vgi: samples of normals, colours and texture coordinates along each side; at least --resolution, which "
            "must be given with it. Unless given what the mesh asks for: as fine as 129 where there are textures")
        ->check(CLI::IsMember({3, 5, 9, 17, 33, 65, 129, 257, 513, 1025, 2049, 4097}));
}

void add_cluster_weights(CLI::App& command, BakeWords& o) {
    const auto cluster_weight = [&](const char* name, double& value, const char* what) {
        command.add_option(name, value, std::string("vgi: weight, in the cost of a cluster, of ") + what)
            ->check(CLI::Range(0.0, 1e6))
            ->capture_default_str();
    };
    vgi::ClusterWeights& weights = o.bake.atlas.clusters.weights;
    cluster_weight("--planarity-weight", weights.planarity, "its distance from a plane");
    cluster_weight("--compactness-weight", weights.compactness, "the length of its border");
    cluster_weight("--irregularity-weight", weights.irregularity, "how much less round a merge makes it");
    cluster_weight("--size-weight", weights.size, "its area");
    cluster_weight("--curvature-weight", weights.curvature, "how far its normals differ");
    cluster_weight("--feature-weight", weights.feature, "creases and edges of colour or material inside it");
    cluster_weight("--bulge-weight", weights.bulge, "how far it bulges beyond its border");
}

void add_sampling_options(CLI::App& command, BakeWords& o) {
    command.add_flag(
        "--keep-uv", o.keep_uv,
        "vgi: keep texture coordinates, by which textures are looked up, if all are on one set of them. "
        "Unless given, what textures hold is kept by chart and place, as fine as their texels, in place of "
        "texture coordinates");
    command
        .add_option("--texture-quality", o.texture_quality,
                    "vgi: how well what textures hold is kept, 1 to 100; or lossless, for several times the bytes")
        ->capture_default_str();
    command.add_flag("--no-leaves", o.no_leaves,
                     "vgi: leave out leaves, the source's own triangles below the finest samples: then nothing is "
                     "finer than --resolution");
    command
        .add_option(
            "--worst-stretch", o.bake.atlas.worst_stretch,
            "vgi: largest stretch of a chart; where a chart has more, clusters are made finer. With leaves, 0.3% of "
            "the surface may have up to three times as much")
        ->check(CLI::Range(1.1, 1e6))
        ->capture_default_str();
    command
        .add_option(
            "--curvature-importance", o.bake.atlas.parameterise.curvature_importance,
            "vgi: samples are denser where the surface bends, by its curvature to this power; 0 spreads them evenly")
        ->check(CLI::Range(0.0, 1.0))
        ->capture_default_str();
    command
        .add_option(
            "--rounding-share", o.bake.atlas.rounding_share,
            "vgi: error that the rounding of positions may add, as a share of the error of sampling; a smaller share "
            "takes more bytes")
        ->check(CLI::Range(0.0, 10.0))
        ->capture_default_str();
}

void add_simplifier_options(CLI::App& command, BakeWords& o) {
    command.add_flag(
        "--retexture", o.bake.retexture,
        "Lay the textures out anew before anything is baked, as unwrap --bake does: in one square with few "
        "cuts, so that seams of fragments no longer stop the simplifier");
    command
        .add_option("--simplifier", o.bake.simplifier,
                    "lod: simplifier: quadric (our own) or openmesh (OpenMesh's decimater)")
        ->check(CLI::IsMember({"quadric", "openmesh"}))
        ->capture_default_str();
    const auto attribute_weight = [&](const char* name, double& value, const char* what, double otherwise) {
        command
            .add_option(name, value, std::string("lod: weight of ") + what + " in the error that the simplifier counts")
            ->check(CLI::Range(0.0, 1e6))
            ->default_str(CLI::detail::to_string(otherwise));
    };
    const SimplifyOptions simplify;
    attribute_weight("--normal-weight", o.bake.normal_weight, "normals", simplify.normal_weight);
    attribute_weight("--uv-weight", o.bake.uv_weight, "texture coordinates", simplify.uv_weight);
    attribute_weight("--colour-weight", o.bake.colour_weight, "colours", simplify.colour_weight);
    command
        .add_option("--error-samples", o.bake.error_samples,
                    "lod: points on each surface from which the error of a level is measured")
        ->check(CLI::Range(1000, 100000000))
        ->capture_default_str();
}

}  // namespace

void add_height_options(CLI::App& command, ReadOptions& read) {
    command.add_option("--height-scale", read.height_scale, "Height maps: object units per height unit")
        ->capture_default_str();
    command
        .add_option("--pixel-size", read.pixel_size, "Height maps: object units between samples; 0 takes the file's")
        ->capture_default_str();
    command.add_option("--void-height", read.void_height,
                       "Height maps: samples of this height (before scaling) hold no data");
    command.add_flag("--fill-voids", read.fill_voids,
                     "Height maps: fill samples that hold no data from around them, instead of leaving holes");
}

Result<BakeOptions> bake_options_of(const BakeWords& given) {
    BakeOptions options = given.bake;
    auto backends = parse_list("--backends", given.backends);
    if (!backends) return tl::unexpected(backends.error());
    if (auto good = check_backends(*backends); !good) return tl::unexpected(good.error());
    auto orders = parse_orders(given.orders);
    if (!orders) return tl::unexpected(orders.error());
    const auto quality = parse_quality(given.texture_quality);
    if (!quality) return tl::unexpected(quality.error());
    options.atlas.bake_textures = !given.keep_uv;
    options.atlas.texture_quality = *quality;
    if (given.no_leaves) {
        options.atlas.leaves = false;
        options.atlas.samples_per_triangle = 0;
    }
    if (given.clusters > 0) {
        options.atlas.clusters.clusters = given.clusters;
        options.triangles_per_cluster.reset();
    }
    if (given.resolution > 0) {
        options.atlas.cells = given.resolution - 1;
        options.atlas.samples_per_triangle = 0;
    }
    if (given.attribute_resolution > 0) {
        if (given.resolution == 0) return fail(Fault::usage, "--attribute-resolution: give --resolution with it");
        if (given.attribute_resolution < given.resolution) {
            return fail(Fault::usage, "--attribute-resolution " + std::to_string(given.attribute_resolution) +
                                          ": must not be below --resolution, " + std::to_string(given.resolution));
        }
        options.atlas.attribute_ratio = (given.attribute_resolution - 1) / options.atlas.cells;
    }
    const auto model = given.cache == "auto" ? auto_cache_model() : cache_model_named(given.cache);
    if (!model) return fail_at("--cache", model.error());
    options.order.cache = *model;
    options.backends = *backends;
    options.orders = *orders;
    return options;
}

void add_bake_options(CLI::App& command, BakeWords& o) {
    add_backend_options(command, o);
    add_order_options(command, o);
    add_greedy_options(command, o.bake.order.greedy);
    add_form_options(command, o);
    add_chart_options(command, o);
    add_cluster_weights(command, o);
    add_sampling_options(command, o);
    add_simplifier_options(command, o);
    add_height_options(command, o.bake.read);
}

}  // namespace lodestone
