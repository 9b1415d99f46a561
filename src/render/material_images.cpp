#include "render/material_images.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include "base/check.h"
#include "base/srgb.h"
#include "render/targets.h"
#include "shaders/shared/frame_constants.h"

namespace lodestone {

namespace {

const std::array<float, 256>& linear_of_byte() {
    static const auto table = [] {
        std::array<float, 256> t{};
        for (size_t i = 0; i < 256; ++i) t[i] = static_cast<float>(linear_from_srgb(static_cast<double>(i) / 255));
        return t;
    }();
    return table;
}

// The next mip level of a square layer: means of 2x2 texels.
std::vector<glm::u8vec4> halved(const std::vector<glm::u8vec4>& texels, uint32_t size) {
    const uint32_t half = size / 2;
    const auto& linear = linear_of_byte();
    std::vector<glm::u8vec4> out(size_t{half} * half);
    for (uint32_t y = 0; y < half; ++y) {
        for (uint32_t x = 0; x < half; ++x) {
            double sum[4] = {};
            for (uint32_t k = 0; k < 4; ++k) {
                const glm::u8vec4 t = texels[size_t{2 * y + k / 2} * size + 2 * x + k % 2];
                for (int c = 0; c < 3; ++c) sum[c] += static_cast<double>(linear[t[c]]);
                sum[3] += t[3];
            }
            glm::u8vec4& o = out[size_t{y} * half + x];
            for (int c = 0; c < 3; ++c) o[c] = static_cast<uint8_t>(std::lround(255 * srgb_from_linear(sum[c] / 4)));
            o[3] = static_cast<uint8_t>(std::lround(sum[3] / 4));
        }
    }
    return out;
}

// The texels of all levels: levels one after the other, all layers of a level together.
struct MipLevels {
    uint32_t size = 1, layers = 1, mips = 1;
    std::vector<glm::u8vec4> texels;
    std::vector<VkBufferImageCopy> regions;  // one per level

    // White where there are no textures.
    explicit MipLevels(const MaterialSet& set) {
        const bool textured = set.layers > 0 && set.texture_size > 0;
        if (textured) {
            size = set.texture_size;
            layers = set.layers;
        }
        LODE_CHECK(std::has_single_bit(size), size);
        mips = static_cast<uint32_t>(std::countr_zero(size)) + 1;
        std::vector<std::vector<glm::u8vec4>> level(layers);
        for (uint32_t l = 0; l < layers; ++l) {
            const size_t count = size_t{size} * size;
            if (textured) {
                level[l].assign(set.texels.begin() + static_cast<ptrdiff_t>(l * count),
                                set.texels.begin() + static_cast<ptrdiff_t>((l + 1) * count));
            } else {
                level[l].assign(count, glm::u8vec4(255));
            }
        }
        for (uint32_t mip = 0; mip < mips; ++mip) add(mip, level);
    }

private:
    void add(uint32_t mip, std::vector<std::vector<glm::u8vec4>>& level) {
        VkBufferImageCopy region{};
        region.bufferOffset = texels.size() * sizeof(glm::u8vec4);
        region.imageSubresource = {VK_IMAGE_ASPECT_COLOR_BIT, mip, 0, layers};
        region.imageExtent = {size >> mip, size >> mip, 1};
        regions.push_back(region);
        for (auto& layer : level) {
            texels.insert(texels.end(), layer.begin(), layer.end());
            if (mip + 1 < mips) layer = halved(layer, size >> mip);
        }
    }
};

void check_limits(const VkPhysicalDeviceLimits& limits, const MaterialSet& set) {
    if (set.layers == 0 || set.texture_size == 0) return;
    if (set.layers > limits.maxImageArrayLayers || set.texture_size > limits.maxImageDimension2D) {
        throw VulkanFailure("the scene has " + std::to_string(set.layers) + " textures of " +
                            std::to_string(set.texture_size) + " texels a side; the device takes " +
                            std::to_string(limits.maxImageArrayLayers) + " of " +
                            std::to_string(limits.maxImageDimension2D));
    }
}

}  // namespace

MaterialImages make_material_images(BlockAllocator& allocator, const CommandPool& pool, const MaterialSet& set) {
    LODE_CHECK(!set.materials.empty());
    std::vector<gpu::MaterialConstants> table;
    for (const SurfaceMaterial& m : set.materials) table.push_back({m.base_colour, m.layer, 0, 0, 0});
    check_limits(allocator.device().limits(), set);
    const MipLevels levels(set);

    MaterialImages made;
    const VkDeviceSize table_bytes = table.size() * sizeof table[0],
                       texel_bytes = levels.texels.size() * sizeof levels.texels[0];
    made.table.buffer =
        Buffer(allocator, table_bytes, VK_BUFFER_USAGE_UNIFORM_TEXEL_BUFFER_BIT | VK_BUFFER_USAGE_TRANSFER_DST_BIT,
               MemoryKind::device_local, "materials");
    made.table.view = make_texel_view(allocator.device(), made.table.buffer.get(), 4);
    made.textures = TargetImage(allocator,
                                {VK_FORMAT_R8G8B8A8_SRGB, levels.size, levels.size, levels.layers, levels.mips,
                                 VK_IMAGE_USAGE_SAMPLED_BIT | VK_IMAGE_USAGE_TRANSFER_DST_BIT, true},
                                "textures");
    const Buffer staged_table(allocator, table_bytes, VK_BUFFER_USAGE_TRANSFER_SRC_BIT, MemoryKind::staging,
                              "staged materials");
    const Buffer staged_texels(allocator, texel_bytes, VK_BUFFER_USAGE_TRANSFER_SRC_BIT, MemoryKind::staging,
                               "staged textures");
    std::memcpy(staged_table.mapped(), table.data(), table_bytes);
    std::memcpy(staged_texels.mapped(), levels.texels.data(), texel_bytes);
    pool.run([&](VkCommandBuffer commands) {
        const VkBufferCopy copy{0, 0, table_bytes};
        vkCmdCopyBuffer(commands, staged_table.get(), made.table.buffer.get(), 1, &copy);
        memory_barrier(commands, VK_PIPELINE_STAGE_2_COPY_BIT, VK_ACCESS_2_TRANSFER_WRITE_BIT,
                       VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT, VK_ACCESS_2_SHADER_SAMPLED_READ_BIT);
        change_use(commands, made.textures, {}, as_copy_destination);
        vkCmdCopyBufferToImage(commands, staged_texels.get(), made.textures.get(), VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL,
                               static_cast<uint32_t>(levels.regions.size()), levels.regions.data());
        change_use(commands, made.textures, as_copy_destination, as_sampled);
    });
    return made;
}

}  // namespace lodestone
