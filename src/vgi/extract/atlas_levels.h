// The levels of an atlas as one list, finest first: the source where there are leaves, then those of samples. Errors
// never fall, and triangles never rise from the finest samples on; samples may be denser than the source.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "vgi/asset/atlas.h"

namespace lodestone::vgi {

// Triangles and error of each level.
class AtlasLevels {
public:
    // about: only its description is used. errors: of levels of samples, object units, finest first.
    // leaf_triangles: of all leaves; 0 where there are none.
    AtlasLevels(const Atlas& about, std::span<const float> errors, uint64_t leaf_triangles);

    bool has_source() const { return leaf_triangles_ > 0; }                    // whether level 0 is the source
    uint32_t levels() const { return static_cast<uint32_t>(errors_.size()); }  // at least 1
    // level: below levels().
    uint64_t triangles_at(uint32_t level) const {
        return is_source(level) ? leaf_triangles_ : triangles_[of_samples(level)];
    }
    float error_at(uint32_t level) const { return errors_[level]; }  // object units; never falls
    uint32_t level_for_triangles(uint64_t triangles) const;          // the finest of at most so many; else the last
    // The coarsest within it, or the source if it has fewer triangles; 0 where none is.
    uint32_t level_for_error(double error) const;
    // Whether a level is the source.
    bool is_source(uint32_t level) const { return has_source() && level == 0; }
    uint32_t of_samples(uint32_t level) const { return has_source() ? level - 1 : level; }  // Atlas's number of it

private:
    uint64_t leaf_triangles_;
    std::vector<uint64_t> triangles_;  // per level of samples
    std::vector<float> errors_;
};

// Of an atlas that is there whole.
AtlasLevels levels_of(const Atlas& whole);
// A level of it as a mesh, without what textures held that are baked into it, but for colours of samples. levels:
// levels_of() it; level: below levels.levels().
TriMesh extract_level(const Atlas& whole, const AtlasLevels& levels, uint32_t level);
// The same of an atlas of baked textures, with textures of its own. most_texels: along their sides. Fault::usage,
// without the option's name, where charts do not fit.
Result<TriMesh> extract_with_textures(const Atlas& whole, const AtlasLevels& levels, uint32_t level,
                                      uint32_t most_texels);

}  // namespace lodestone::vgi
