// Clusters of faces in an order, and their faces within, that a FIFO vertex cache likes: a walk over the surface from
// cluster to cluster, so that an order made for batches serves older caches too.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "lod/bake/orders/faces_around.h"

namespace lodestone {

// Faces in drawing order. indices, around: of the faces. label: cluster of face. late, per cluster: those to draw last,
// where they move no other one. careful: whether several orders are tried within each cluster.
std::vector<uint32_t> draw_clusters(std::span<const uint32_t> indices, const FacesAround& around,
                                    std::span<const uint32_t> label, const std::vector<bool>& late, uint32_t cache,
                                    bool careful);

}  // namespace lodestone
