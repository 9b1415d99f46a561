// Clusters: stages 1 to 3 of the atlas. Triangles are merged into disks by a greedy search over a heap of neighbouring
// pairs, first inside spatial buckets side by side, then everywhere. The cluster heuristics are those of the seed
// ("virtual geometry images"; planarity and irregularity after Garland, Willmott, Heckbert, "Hierarchical face
// clustering on polygonal surfaces", I3D 2001), made scale-free.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "base/progress.h"
#include "base/result.h"
#include "vgi/bake/charts/cell_complex.h"
#include "vgi/bake/charts/surface.h"

namespace lodestone::vgi {

// Costs of a cluster of area A, perimeter P, vector area N, squared distance F to its plane, against a wanted area L^2.
struct ClusterWeights {
    double planarity = 1.7;     // 12 F / L^2
    double compactness = 1;     // P^2 / 16 L^2
    double size = 1;            // (A / L^2)^2
    double irregularity = 0.3;  // how much P^2 / 4 pi A grows, as a share
    double curvature = 1;       // (A - |N|) / L^2
    double feature = 2;         // length of creases and seams that a merge takes from borders, over L
    double bulge = 1;           // 4 pi A / P^2 - 1 where that is positive: a cap on a neck, which flattens badly
};

// How much a triangle counts for where so many times as many clusters are wanted as usual, with a cluster's usual area:
// it cannot be more than one, and what it asks for beyond that would only be made elsewhere.
double wanted_of_triangle(double area, float density, double cluster);
// Per cluster (label: per triangle): how many are wanted where it is, of `clusters` in all.
std::vector<double> wanted_where(const Surface& surface, std::span<const float> density,
                                 std::span<const uint32_t> label, size_t count, double clusters);
// Of the clusters there were (label: per triangle) the marked ones, and those that meet one of them in a vertex.
std::vector<bool> with_neighbours(const Surface& surface, std::span<const uint32_t> label, std::vector<bool> marked);
// For ClusterOptions::kept: all stay but the bad ones and their neighbours.
std::vector<uint32_t> kept_clusters(const Surface& surface, std::span<const uint32_t> label,
                                    const std::vector<bool>& bad);

// How a surface is divided.
struct ClusterOptions {
    // Wanted in all. A component has at least 4 where it is closed, 3 with a boundary, or, where its share of the area
    // comes to two clusters or to one at most, is made of templates (templates.h). What small components have beyond
    // their share is not taken from others.
    uint32_t clusters = 130;
    ClusterWeights weights;              // which merges come first
    uint32_t bucket_triangles = 200000;  // about so many to a bucket
    // A cluster is not made of what this many are wanted for.
    static constexpr double most_wanted = 4;
    // Per triangle of the surface: how many times as many clusters are wanted there as elsewhere, > 0; `clusters` is
    // then how many there would be without. Empty for 1 everywhere.
    std::vector<float> density;
    FeatureLines features;  // that borders prefer
    // Per triangle: the cluster of before that it stays in, none where clusters are made anew; empty where there were
    // none before.
    std::vector<uint32_t> kept;
};

// A cluster that is a quad as it is.
struct ReadyQuad {
    uint32_t cluster = 0;               // its number
    std::array<uint32_t, 4> corners{};  // vertices of the surface, counter-clockwise seen from outside
};

// A surface divided.
struct Clusters {
    std::vector<uint32_t> label;                  // per triangle, 0 .. count - 1, by the lowest triangle
    uint32_t count = 0;                           // of clusters
    std::vector<ReadyQuad> ready;                 // by their clusters
    std::vector<uint32_t> ready_corners() const;  // of all ready quads, four each
    uint32_t buckets = 0;                         // that the surface was cut into
    double cut_seconds = 0, bucket_seconds = 0, merge_seconds = 0;  // into buckets; inside them; everywhere
};
// The surface must be valid and have no inner edge between boundary vertices (surface_of sees to it). Deterministic for
// any number of threads. Fault::interrupted when progress says stop.
Result<Clusters> make_clusters(const Surface& surface, const ClusterOptions& options, const Progress& progress = {});

}  // namespace lodestone::vgi
