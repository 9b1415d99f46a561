// From a mesh and a collapse list to a progressive mesh: numbers the vertices by removal, replays the collapses once
// per order, and writes down what each ecol rewrites and each keyframe permutes.
#pragma once

#include <string>
#include <vector>

#include "base/progress.h"
#include "lod/asset/progressive_mesh.h"
#include "lod/bake/orders/face_order.h"
#include "lod/bake/simplify/collapse_list.h"
#include "mesh/limits.h"

namespace lodestone {

// A progressive mesh of all collapses of a list, with the face orders named.
// mesh: manifold, as `repair` leaves it. list: valid for it (CollapseList::validate). orders: names face_orderer_named
// knows, at least one, none twice. Errors of levels are left 0; measure_errors (error_curve.h) fills them.
// Fault::format where the mesh, or what an order has to store for it, is over a limit.
Result<ProgressiveMesh> bake_progressive_mesh(const TriMesh& mesh, const CollapseList& list,
                                              const std::vector<std::string>& orders,
                                              const OrderOptions& order_options = {}, const Progress& progress = {},
                                              const Limits& limits = {});

// Moves every position to the nearest multiple of the smallest power of two of which at most 2^bits fit along the
// longest side of the box around the mesh, and returns that power; 0 for a mesh without extent. bits: 1 .. 24.
double quantise(TriMesh& mesh, uint32_t bits);

}  // namespace lodestone
