// Derives the barriers between uses of buffers from what each use reads and writes. One instance follows all buffers of
// a recipe through all frames of a queue, so frames in flight need no other care.
#pragma once

#include <vector>

#include "render/vulkan/vulkan.h"

namespace lodestone {

struct BufferUseNow {
    VkPipelineStageFlags2 stages = 0;
    VkAccessFlags2 access = 0;
    bool writes = false;
};

class BufferHazards {
public:
    void reset(size_t buffers) { states_.assign(buffers, {}); }
    // The buffer is about to be used so; remembers what must be waited for.
    void use(size_t buffer, const BufferUseNow& now);
    // What was recorded may not have been carried out, or only in part: the next use of each buffer waits for all that
    // was submitted.
    void distrust();
    // Records one barrier for all uses since the last flush, if any is needed. Outside of rendering.
    void flush(VkCommandBuffer commands);

private:
    struct State {
        VkPipelineStageFlags2 write_stages = 0,
                              read_stages = 0;  // since the last write: the write itself, the reads after it
        VkAccessFlags2 write_access = 0;
        VkPipelineStageFlags2 visible_stages = 0;  // reads the last write was made visible to
        VkAccessFlags2 visible_access = 0;
    };
    std::vector<State> states_;
    VkMemoryBarrier2 pending_{};
    bool needed_ = false;
};

}  // namespace lodestone
