// The null renderer: carries out plans on the CPU as far as a CPU can. It keeps a copy of every buffer, checks every
// command against the recipe and the contract, and tells what each draw would read. Tests, image metrics and cache
// simulations look at frames through it, with no GPU and no trust in what a backend says about itself.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <deque>
#include <functional>
#include <glm/vec3.hpp>
#include <span>
#include <utility>
#include <vector>

#include "base/result.h"
#include "frame/frame_source.h"

namespace lodestone {

// Carries out the plans of one recipe.
class PlanMirror {
public:
    // What the shaders of pipelines without a vertex layout do, done on the CPU; either may be empty.
    struct Puller {
        // Object-space position of a vertex.
        std::function<glm::vec3(const PlanMirror& mirror, const Draw& draw, const FrameInput& input, uint32_t instance,
                                uint32_t index)>
            position;
        // The index list of a draw that has none: of patches, what tessellation makes of them.
        std::function<std::vector<uint32_t>(const PlanMirror& mirror, const Draw& draw)> indices;
    };

    // With empty buffers. A recipe of another generation needs a new mirror.
    explicit PlanMirror(Recipe recipe, Puller puller = {});

    // Checks the plan, then applies its uploads and copies. Fault::invariant names the command and what is wrong with
    // it: ranges outside buffers, wrong stages or uses, indices past the vertex buffer, bytes drawn that nothing has
    // written. Buffers that a compute pipeline may write are not followed past that point.
    Result<void> execute(const Plan& plan, const FrameInput& input);

    // Buffers that indirect draws of a plan look at and that a device may have written, in ascending order.
    std::vector<uint32_t> computed_for_draws(const Plan& plan) const;
    // What a device that carried out the last plan executed has in such a buffer, from its first byte on.
    void learn(uint32_t buffer, std::span<const std::byte> bytes);

    // A draw and what it reads.
    struct MirroredDraw {
        size_t command = 0;                   // of the plan
        Stage stage = Stage::colour;          // of the command
        Draw draw;                            // of an indirect one, a record of its buffer
        std::span<const uint32_t> indices;    // empty where not indexed, and where the puller tells none
        std::span<const std::byte> vertices;  // from vertex 0 on; empty for pipelines that pull
        std::span<const uint32_t> instances;  // numbers into FrameInput::instances
    };
    // Draws of the last plan; of indirect ones those whose buffers all have been learnt of since. Valid until the next
    // execute() or learn().
    const std::vector<MirroredDraw>& draws() const { return draws_; }
    // All bytes of a buffer; zero where nothing was written.
    std::span<const std::byte> buffer(uint32_t number) const { return buffers_[number].bytes; }
    // The number-th T of the storage buffer that the draw's pipeline has at a binding.
    template <class T>
    T stored(const Draw& draw, uint32_t binding, uint64_t number) const {
        const auto& storage = recipe_.pipelines[draw.pipeline].storage;
        const auto at = std::ranges::find(storage, binding, &StorageBinding::binding);
        T value;
        std::memcpy(&value, buffers_[at->buffer].bytes.data() + number * sizeof(T), sizeof(T));
        return value;
    }
    const Recipe& recipe() const { return recipe_; }  // as given, with the sizes that buffers have now

    // Whether a draw puts triangles into the picture: in views[0], in the stage that decides what is seen of them.
    bool is_shown(const MirroredDraw& draw) const {
        const PipelineSpec& pipeline = recipe_.pipelines[draw.draw.pipeline];
        return draw.stage == (pipeline.visibility.empty() ? Stage::colour : Stage::depth) && draw.draw.view == 0 &&
               !pipeline.whole_view;
    }
    // Object-space triangles that instance `instance` shows in views[0], from draws whose pipeline has
    // its position (three floats) at location 0, or pulls it and a puller was given. Three corners per triangle,
    // degenerate ones left out.
    std::vector<std::array<glm::vec3, 3>> triangles_of(uint32_t instance) const;

private:
    struct Buffer {
        std::vector<std::byte> bytes;
        std::vector<bool> written;  // per 4 bytes
        bool gpu_written = false;   // contents unknown
        bool learnt = false;        // since the last plan
    };
    Result<void> check(const Command& command, const Plan& plan, const FrameInput& input) const;
    Result<void> check_draw(Stage stage, const Draw& draw, bool indirect, const Plan& plan,
                            const FrameInput& input) const;
    Result<void> check_dispatch(const Dispatch& dispatch, const FrameInput& input) const;
    Result<void> check_resize(Stage stage, const Resize& resize) const;
    Result<void> check_range(uint32_t buffer, uint64_t offset, uint64_t bytes, uint32_t use, bool read) const;
    void apply(const Command& command);
    std::vector<uint32_t> read_by(const DrawIndirect& draw) const;
    void mirror_draws();
    void mirror(size_t command, Stage stage, const Draw& draw);

    Recipe recipe_;
    Puller puller_;
    FrameInput input_;                                 // views and instances of the last plan
    std::vector<std::pair<size_t, Command>> drawing_;  // draws of the last plan, by their numbers
    std::vector<Buffer> buffers_;
    std::vector<MirroredDraw> draws_;
    std::deque<std::vector<uint32_t>> pulled_indices_;  // that draws_ refer to
    std::vector<uint32_t> instance_ids_;
};

}  // namespace lodestone
