// A face order for GPUs that reuse transformed vertices within batches of a fixed number of triangles: the faces are
// cut into clusters of exactly one batch each, compact on the surface, by simulated annealing of a cellular Potts model
// (Graner and Glazier, "Simulation of biological cell sorting using a two-dimensional extended Potts model", Physical
// Review Letters 1992). What batches are: Kerbl et al., "Revisiting the vertex cache", HPG 2018.
#pragma once

#include <atomic>
#include <cstdint>
#include <span>
#include <vector>

namespace lodestone {

struct ClusterOrderOptions {
    uint32_t batch_faces = 32;     // of every cluster but the last
    uint32_t batch_vertices = 32;  // a batch closes before it would pass them
    uint32_t sweeps = 60;          // looks at every face, at falling temperature; 0: the first, greedy clusters stay
    bool careful = true;           // whether several orders are tried within each cluster
    uint32_t cache = 16;           // FIFO entries that the order of clusters, and of faces within them, has in mind
    const std::atomic<bool>* stop = nullptr;  // once it is set, sweeps end soon
};

// Faces (positions in at[0] / 3) in drawing order. at: the faces at several levels, three vertices each, all below
// `vertices`; weights: how much each level counts. A cluster costs the distinct vertices it uses. slots: per face, its
// place in an order made like this one before some faces died, to go on from its clusters; or none. The same for any
// number of threads.
std::vector<uint32_t> cluster_order(std::span<const std::vector<uint32_t>> at, std::span<const double> weights,
                                    uint32_t vertices, const ClusterOrderOptions& options,
                                    std::span<const uint32_t> slots = {});

}  // namespace lodestone
