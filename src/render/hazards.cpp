#include "render/hazards.h"

namespace lodestone {

void BufferHazards::use(size_t buffer, const BufferUseNow& now) {
    State& s = states_[buffer];
    const auto wait = [&](VkPipelineStageFlags2 stages, VkAccessFlags2 access) {
        pending_.srcStageMask |= stages;
        pending_.srcAccessMask |= access;
        pending_.dstStageMask |= now.stages;
        pending_.dstAccessMask |= now.access;
        needed_ = true;
    };
    if (now.writes) {
        if (s.read_stages != 0) wait(s.read_stages, 0);
        if (s.write_stages != 0) wait(s.write_stages, s.write_access);
        s = {now.stages, 0, now.access, 0, 0};
        return;
    }
    const bool visible = (s.visible_stages & now.stages) == now.stages && (s.visible_access & now.access) == now.access;
    if (s.write_stages != 0 && !visible) {
        wait(s.write_stages, s.write_access);
        s.visible_stages |= now.stages;
        s.visible_access |= now.access;
    }
    s.read_stages |= now.stages;
}

void BufferHazards::distrust() {
    const State anything{VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT, 0, VK_ACCESS_2_MEMORY_WRITE_BIT, 0, 0};
    states_.assign(states_.size(), anything);
    pending_ = {};
    needed_ = false;
}

void BufferHazards::flush(VkCommandBuffer commands) {
    if (!needed_) return;
    pending_.sType = VK_STRUCTURE_TYPE_MEMORY_BARRIER_2;
    VkDependencyInfo dependency{};
    dependency.sType = VK_STRUCTURE_TYPE_DEPENDENCY_INFO;
    dependency.memoryBarrierCount = 1;
    dependency.pMemoryBarriers = &pending_;
    vkCmdPipelineBarrier2(commands, &dependency);
    pending_ = {};
    needed_ = false;
}

}  // namespace lodestone
