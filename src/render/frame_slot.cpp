#include "render/frame_slot.h"

#include <algorithm>
#include <cstring>

#include "base/check.h"

namespace lodestone {

VkDeviceSize Staging::put(const void* data, VkDeviceSize bytes) {
    LODE_CHECK(bytes <= free_bytes(), bytes, free_bytes());
    const VkDeviceSize offset = used_;
    std::memcpy(buffer_.mapped() + offset, data, bytes);
    used_ = std::min<VkDeviceSize>((used_ + bytes + 15) / 16 * 16, buffer_.bytes());
    return offset;
}

bool ensure_buffer(BlockAllocator& allocator, Buffer& buffer, VkDeviceSize bytes, VkBufferUsageFlags usage,
                   const char* name) {
    if (buffer.bytes() >= bytes && buffer.get() != VK_NULL_HANDLE) return false;
    buffer = Buffer(allocator, std::max<VkDeviceSize>(bytes, 2 * buffer.bytes()),
                    usage | VK_BUFFER_USAGE_TRANSFER_DST_BIT, MemoryKind::device_local, name);
    return true;
}

bool ensure_texels(BlockAllocator& allocator, TexelBuffer& texels, VkDeviceSize bytes, uint32_t words,
                   const char* name) {
    if (!ensure_buffer(allocator, texels.buffer, bytes, VK_BUFFER_USAGE_UNIFORM_TEXEL_BUFFER_BIT, name)) return false;
    texels.view = make_texel_view(allocator.device(), texels.buffer.get(), words);
    return true;
}

namespace {

// By pipeline, in the order they first ran.
std::vector<std::pair<std::string, double>> effect_times(const Device& device, const FrameSlot& slot,
                                                         double ms_per_tick) {
    std::vector<std::pair<std::string, double>> times;
    if (slot.effect_timed.empty()) return times;
    std::vector<uint64_t> ticks(slot.effect_timed.size());
    LODE_VK(vkGetQueryPoolResults(device.handle(), slot.effect_timestamps.get(), 0, static_cast<uint32_t>(ticks.size()),
                                  ticks.size() * sizeof ticks[0], ticks.data(), sizeof ticks[0],
                                  VK_QUERY_RESULT_64_BIT | VK_QUERY_RESULT_WAIT_BIT));
    for (size_t i = 0; i + 1 < ticks.size(); ++i) {
        const std::string& name = slot.effect_timed[i];
        if (name.empty()) continue;
        auto at = std::ranges::find(times, name, &std::pair<std::string, double>::first);
        if (at == times.end()) at = times.insert(at, {name, 0});
        at->second += static_cast<double>(ticks[i + 1] - ticks[i]) * ms_per_tick;
    }
    return times;
}

}  // namespace

FrameCounters read_counters(const Device& device, const FrameSlot& slot) {
    FrameCounters counters;
    counters.frame = slot.frame;
    counters.total_ms =
        std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - slot.submitted_at).count();
    if (device.has_statistics()) {
        uint64_t values[stage_count][3] = {};
        LODE_VK(vkGetQueryPoolResults(device.handle(), slot.statistics.get(), 0, stage_count, sizeof values, values,
                                      sizeof values[0], VK_QUERY_RESULT_64_BIT | VK_QUERY_RESULT_WAIT_BIT));
        for (size_t s = 0; s < stage_count; ++s) {
            // In the order of the bits in VkQueryPipelineStatisticFlags.
            counters.pass[s].input_primitives = values[s][0];
            counters.pass[s].vertex_invocations = values[s][1];
            counters.pass[s].tessellation_evaluations = values[s][2];
        }
    }
    if (device.has_timestamps()) {
        uint64_t ticks[stage_count + 1] = {};
        LODE_VK(vkGetQueryPoolResults(device.handle(), slot.timestamps.get(), 0, stage_count + 1, sizeof ticks, ticks,
                                      sizeof ticks[0], VK_QUERY_RESULT_64_BIT | VK_QUERY_RESULT_WAIT_BIT));
        const double ms_per_tick = static_cast<double>(device.limits().timestampPeriod) * 1e-6;
        for (size_t s = 0; s < stage_count; ++s)
            counters.pass[s].gpu_ms = static_cast<double>(ticks[s + 1] - ticks[s]) * ms_per_tick;
        counters.gpu_ms = static_cast<double>(ticks[stage_count] - ticks[0]) * ms_per_tick;
        counters.effect_ms = effect_times(device, slot, ms_per_tick);
    }
    return counters;
}

}  // namespace lodestone
