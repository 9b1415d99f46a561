// The instances of a scene as shaders read them. Only those that changed are converted, and each slot is sent only what
// changed since it was last.
#pragma once

#include <cstdint>
#include <deque>
#include <span>
#include <vector>

#include "frame/instance_set.h"
#include "shaders/shared/frame_constants.h"

namespace lodestone {

class InstanceTable {
public:
    void update(const InstanceSet& instances);

    std::span<const gpu::InstanceConstants> all() const { return all_; }
    bool any_mirrored() const { return mirrored_ > 0; }

    struct Range {
        size_t first, count;  // instances
    };
    // What a buffer lacks that holds the table as it was at `version`, 0 for nothing of it; rising, apart from each
    // other.
    std::vector<Range> stale(uint64_t version) const;
    uint64_t version() const { return version_; }

private:
    void convert(size_t i, const Instance& instance);

    std::vector<gpu::InstanceConstants> all_;
    std::vector<uint8_t> is_mirrored_;  // per instance
    size_t mirrored_ = 0;
    uint64_t generation_ = 0;  // of the set
    uint64_t version_ = 0;
    // Instances converted since, with the version they made; what happened at `since_` or before is not told.
    std::deque<std::pair<uint64_t, uint32_t>> log_;
    uint64_t since_ = 0;
};

}  // namespace lodestone
