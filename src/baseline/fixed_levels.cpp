#include "baseline/fixed_levels.h"

#include <algorithm>
#include <cmath>

#include "base/check.h"
#include "frame/indexed_mesh.h"

namespace lodestone {

namespace {

constexpr uint32_t vertex_buffer = 0, index_buffer = 1, further_buffer = 2;
constexpr double most_pixel_error = 1e12;  // that a budget of triangles raises errors to: coarser than any level

class FixedLevelsSource final : public FrameSource {
public:
    explicit FixedLevelsSource(std::vector<FixedLevels> assets) {
        uint64_t vertex_bytes = 0, index_bytes = 0;
        FurtherBuffer further;
        for (FixedLevels& levels : assets) {
            Asset asset;
            asset.sphere = bounding_sphere(levels.vertices);
            asset.vertex_offset = vertex_bytes;
            vertex_bytes += levels.vertices.size_bytes();
            LODE_CHECK(levels.further.empty() || levels.further.size() == levels.vertices.size());
            asset.further_word = further.add(levels.further);
            for (const FixedLevel& level : levels.levels) {
                asset.index_offsets.push_back(index_bytes);
                index_bytes += level.indices.size_bytes();
            }
            asset.levels = std::move(levels);
            assets_.push_back(std::move(asset));
        }
        instances_ = InstanceTree(assets_, &Asset::sphere);
        recipe_.buffers = {{"level vertices", std::max<uint64_t>(vertex_bytes, 4), use_vertex, 4},
                           {"level indices", std::max<uint64_t>(index_bytes, 4), use_index, 4}};
        if (!further.empty()) recipe_.buffers.push_back(further.spec());
        recipe_.pipelines = {indexed_mesh_pipeline(further, further_buffer)};
    }

    const Recipe& recipe() const override { return recipe_; }

    Plan plan(const FrameInput& input) override {
        LODE_CHECK(!input.views.empty());
        Plan plan;
        plan.generation = recipe_.generation;
        if (!uploaded_) upload(plan);
        instances_.update(input.instances);
        Chosen chosen = choose(input);
        std::vector<IndexedRange> ranges;
        for (size_t a = 0; a < assets_.size(); ++a) {
            const Asset& asset = assets_[a];
            for (size_t l = 0; l < chosen[a].size(); ++l) {
                if (chosen[a][l].empty()) continue;
                IndexedRange range;
                range.vertex_buffer = vertex_buffer;
                range.index_buffer = index_buffer;
                range.vertex_offset = asset.vertex_offset;
                range.index_offset = asset.index_offsets[l];
                range.index_count = static_cast<uint32_t>(asset.levels.levels[l].indices.size());
                range.triangles = range.index_count / 3;
                range.level = static_cast<uint32_t>(l);
                range.error = asset.levels.levels[l].error;
                range.levels = static_cast<uint32_t>(chosen[a].size());
                range.words[LODE_MESH_WORD_FURTHER] = asset.further_word;
                range.instances = std::move(chosen[a][l]);
                ranges.push_back(std::move(range));
            }
        }
        draw_ranges(plan, input, ranges);
        for (const BufferSpec& buffer : recipe_.buffers) plan.stats.resident_bytes += buffer.bytes;
        plan.stats.index_bytes = recipe_.buffers[index_buffer].bytes;
        return plan;
    }

    Result<void> validate() const override {
        if (auto good = instances_.validate(); !good) return good;
        for (const Asset& asset : assets_) {
            double error = 0;
            for (const FixedLevel& level : asset.levels.levels) {
                if (level.error < error)
                    return fail(Fault::invariant, "fixed levels: errors fall from one level to the next");
                error = level.error;
                for (const uint32_t index : level.indices) {
                    if (index >= asset.levels.vertices.size())
                        return fail(Fault::invariant, "fixed levels: an index is out of range");
                }
            }
        }
        return {};
    }

private:
    struct Asset {
        FixedLevels levels;
        Sphere sphere;
        uint64_t vertex_offset = 0;
        uint32_t further_word = 0;  // LODE_MESH_WORD_FURTHER
        std::vector<uint64_t> index_offsets;
    };

    using Chosen = std::vector<std::vector<std::vector<InstanceTree::Seen>>>;  // by asset and level

    // The levels of all instances that are seen. A budget of triangles raises the error for all alike, by steps of an
    // eighth of an octave, until it is kept or nothing is left to make coarser.
    Chosen choose(const FrameInput& input) const {
        const auto seen = seen_instances(instances_, input.views);
        double pixel_error = input.budget.pixel_error;
        for (;; pixel_error *= std::exp2(0.125)) {
            Chosen chosen;
            for (const Asset& asset : assets_) chosen.emplace_back(asset.levels.levels.size());
            uint64_t triangles = 0;
            bool coarsest = true;
            for (const InstanceTree::Seen& s : seen) {
                const Instance& instance = input.instances[s.instance];
                const Asset& asset = assets_[instance.asset];
                const size_t level = level_for(asset, input, instance, pixel_error);
                chosen[instance.asset][level].push_back(s);
                if (s.views & 1) triangles += asset.levels.levels[level].indices.size() / 3;
                coarsest = coarsest && level + 1 == asset.levels.levels.size();
            }
            if (triangles <= input.budget.max_triangles || coarsest || input.budget.forced_level >= 0 ||
                pixel_error > most_pixel_error)
                return chosen;
        }
    }

    static size_t level_for(const Asset& asset, const FrameInput& input, const Instance& instance, double pixel_error) {
        const auto& levels = asset.levels.levels;
        if (input.budget.forced_level >= 0)
            return std::min<size_t>(static_cast<size_t>(input.budget.forced_level), levels.size() - 1);
        const double error = error_under(input.sets_levels(), asset.sphere, instance.object_to_world, pixel_error);
        const auto past = std::upper_bound(levels.begin(), levels.end(), error,
                                           [](double e, const FixedLevel& level) { return e < level.error; });
        return past == levels.begin() ? 0 : static_cast<size_t>(past - levels.begin()) - 1;
    }

    void upload(Plan& plan) {
        const auto add = [&](uint32_t buffer, uint64_t offset, const FixedLevels& levels,
                             std::span<const std::byte> bytes) {
            if (bytes.empty()) return;
            plan.commands.push_back(
                {Stage::update, Upload{buffer, offset, Blob(levels.owner, bytes.data(), bytes.size())}});
            plan.stats.uploaded_bytes += bytes.size();
        };
        for (const Asset& asset : assets_) {
            add(vertex_buffer, asset.vertex_offset, asset.levels, std::as_bytes(asset.levels.vertices));
            if (asset.further_word > 0)
                add(further_buffer, FurtherBuffer::offset(asset.further_word), asset.levels,
                    std::as_bytes(asset.levels.further));
            for (size_t l = 0; l < asset.index_offsets.size(); ++l) {
                add(index_buffer, asset.index_offsets[l], asset.levels, std::as_bytes(asset.levels.levels[l].indices));
            }
        }
        uploaded_ = true;
    }

    std::vector<Asset> assets_;
    InstanceTree instances_;
    Recipe recipe_;
    bool uploaded_ = false;
};

}  // namespace

Result<std::unique_ptr<FrameSource>> open_fixed_levels(std::vector<FixedLevels> assets, uint64_t resident_bytes) {
    LODE_CHECK(!assets.empty());
    uint64_t bytes = 0;
    for (const FixedLevels& asset : assets) {
        LODE_CHECK(!asset.levels.empty());
        bytes += asset.vertices.size_bytes() + asset.further.size_bytes();
        for (const FixedLevel& level : asset.levels) bytes += level.indices.size_bytes();
    }
    if (bytes > resident_bytes) return over_budget("the levels", bytes, resident_bytes);
    return std::make_unique<FixedLevelsSource>(std::move(assets));
}

}  // namespace lodestone
