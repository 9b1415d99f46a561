// Buffers that are as large as what is in them needs, and grow within a budget of memory. What a buffer had before is
// counted until the frames that may read it have left the GPU.
#pragma once

#include <cstdint>
#include <vector>

#include "frame/plan.h"
#include "frame/recipe.h"

namespace lodestone::vgi {

class BufferSizes {
public:
    // recipe: must outlive this; its sizes are kept up to date. buffers: of it, that share the budget. budget: bytes of
    // all of these together, at any time.
    BufferSizes(Recipe& recipe, std::vector<uint32_t> buffers, uint64_t budget)
        : recipe_(recipe), buffers_(std::move(buffers)), budget_(budget) {}

    // A new frame is planned; frames before `completed` have left the GPU.
    void begin_frame(uint64_t frame, uint64_t completed);

    uint64_t bytes(uint32_t buffer) const { return recipe_.buffers[buffer].bytes; }
    // What a buffer can have from this frame on, if the budget is to be kept; no less than it has.
    uint64_t most(uint32_t buffer) const;
    // Gives it so many bytes, no more than most(); the first `kept` stay.
    void resize(uint32_t buffer, uint64_t bytes, uint64_t kept, Plan& plan);

    uint64_t held() const;  // by all buffers, with what they had before

private:
    struct Past {
        uint64_t frame, bytes;
    };
    Recipe& recipe_;
    const std::vector<uint32_t> buffers_;
    const uint64_t budget_;
    uint64_t frame_ = 0;
    std::vector<Past> past_;  // the frame that replaced it, and what it had
};

}  // namespace lodestone::vgi
