// How many faces of each cluster are around each vertex.
#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "lod/bake/orders/faces_around.h"

namespace lodestone {

// Kept while faces change clusters. Most vertices have one to three clusters around them, so a look at them is shorter
// than one at all their faces.
class LabelCounts {
public:
    struct Entry {
        uint32_t label, faces;  // faces: above 0
    };

    // label: the cluster of each face.
    LabelCounts(const FacesAround& around, std::span<const uint32_t> label)
        : first_(around.first), used_(around.first.size() - 1, 0), entries_(around.faces.size()) {
        for (uint32_t v = 0; v < used_.size(); ++v) {
            for (const uint32_t f : around.of(v)) add(v, label[f]);
        }
    }
    // The clusters around a vertex, each once.
    std::span<const Entry> of(uint32_t v) const { return {entries_.data() + first_[v], used_[v]}; }
    // Faces around v in cluster a and in b, a != b.
    std::pair<uint32_t, uint32_t> of(uint32_t v, uint32_t a, uint32_t b) const {
        uint32_t in_a = 0, in_b = 0;
        for (const Entry& e : of(v)) {
            in_a = e.label == a ? e.faces : in_a;
            in_b = e.label == b ? e.faces : in_b;
        }
        return {in_a, in_b};
    }
    // A face around v goes from cluster a to b.
    void move(uint32_t v, uint32_t a, uint32_t b) {
        Entry* entry = entries_.data() + first_[v];
        while (entry->label != a) ++entry;
        if (--entry->faces == 0) *entry = entries_[first_[v] + --used_[v]];
        add(v, b);
    }

private:
    void add(uint32_t v, uint32_t label) {
        Entry *entry = entries_.data() + first_[v], *const end = entry + used_[v];
        while (entry != end && entry->label != label) ++entry;
        if (entry == end) {
            *entry = {label, 1};
            ++used_[v];
        } else {
            ++entry->faces;
        }
    }

    std::vector<uint32_t> first_, used_;  // per vertex: place of its first entry; how many it has
    std::vector<Entry> entries_;          // room for as many as the vertex has faces
};

}  // namespace lodestone
