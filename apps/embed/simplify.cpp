#include "apps/embed/simplify.h"

#include <cmath>

#include "lod/asset/cursor.h"
#include "lod/bake/bake.h"
#include "lod/bake/error_curve.h"
#include "lod/bake/simplify/simplifier.h"
#include "mesh/repair.h"

namespace lodestone {

namespace {

Result<void> check_target(const SimplifyTarget& target) {
    if (!(target.error >= 0) || !std::isfinite(target.error))
        return fail(Fault::usage, "simplify: the error must be a number of object units, 0 or more");
    if ((target.triangles > 0) == (target.error > 0))
        return fail(Fault::usage, "simplify: give either a number of triangles or an error");
    if (target.simplifier != "quadric" && target.simplifier != "openmesh")
        return fail(Fault::usage,
                    "simplify: there is no simplifier '" + target.simplifier + "'; choose quadric or openmesh");
    return {};
}

}  // namespace

Result<TriMesh> simplify(TriMesh mesh, const SimplifyTarget& target, const Progress& progress) {
    if (auto good = check_target(target); !good) return tl::unexpected(good.error());
    progress.at("repair", 0);
    if (auto repaired = repair(mesh, {}, progress); !repaired) return tl::unexpected(repaired.error());
    if (target.triangles >= mesh.triangle_count()) return mesh;
    if (progress.stopped()) return fail(Fault::interrupted, "interrupted");
    progress.at("simplify", 0);
    SimplifyOptions options;
    options.target_triangles = target.triangles;
    const auto simplifier = target.simplifier == "openmesh" ? make_openmesh_simplifier() : make_quadric_simplifier();
    const auto list = simplifier->simplify(mesh, options, progress);
    if (!list) return tl::unexpected(list.error());
    auto pm = bake_progressive_mesh(mesh, *list, {"classic"}, {}, progress);
    if (!pm) return tl::unexpected(pm.error());
    uint32_t level = pm->levels() - 1;
    if (target.error > 0) {
        auto errors = measure_errors(*pm, {}, progress);
        if (!errors) return tl::unexpected(errors.error());
        pm->set_errors(std::move(*errors));
        level = pm->level_for_error(target.error);
    } else {
        level = pm->level_for_triangles(target.triangles);
    }
    auto simplified = extract_level(*pm, level);
    if (!simplified) return simplified;
    drop_unreferenced(*simplified);
    simplified->material_table = std::move(mesh.material_table);
    simplified->images = std::move(mesh.images);
    return simplified;
}

}  // namespace lodestone
