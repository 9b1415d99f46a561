#include "vgi/draw/buffer_sizes.h"

#include <algorithm>

#include "base/check.h"

namespace lodestone::vgi {

void BufferSizes::begin_frame(uint64_t frame, uint64_t completed) {
    frame_ = frame;
    std::erase_if(past_, [&](const Past& p) { return p.frame < completed; });
}

uint64_t BufferSizes::held() const {
    uint64_t bytes = 0;
    for (const uint32_t buffer : buffers_) bytes += recipe_.buffers[buffer].bytes;
    for (const Past& p : past_) bytes += p.bytes;
    return bytes;
}

uint64_t BufferSizes::most(uint32_t buffer) const {
    const BufferSpec& spec = recipe_.buffers[buffer];
    const uint64_t now = held(), left = budget_ > now ? budget_ - now : 0;  // beside what it has
    return std::max(spec.bytes, std::min(spec.most_bytes, left / spec.stride * spec.stride));
}

void BufferSizes::resize(uint32_t buffer, uint64_t bytes, uint64_t kept, Plan& plan) {
    BufferSpec& spec = recipe_.buffers[buffer];
    if (bytes == spec.bytes) return;
    LODE_CHECK(bytes <= most(buffer) && bytes % spec.stride == 0, spec.name, bytes, most(buffer));
    past_.push_back({frame_, spec.bytes});
    spec.bytes = bytes;
    plan.commands.push_back({Stage::update, Resize{buffer, bytes, kept}});
}

}  // namespace lodestone::vgi
