#include "render/environment_images.h"

#include <cstring>
#include <span>
#include <vector>

#include "base/check.h"

namespace lodestone {

namespace {

constexpr VkFormat half_floats = VK_FORMAT_R16G16B16A16_SFLOAT;

TargetImage sampled_image(BlockAllocator& allocator, const ImageSpec& size, const char* name) {
    ImageSpec spec = size;
    spec.format = half_floats;
    spec.usage = VK_IMAGE_USAGE_SAMPLED_BIT | VK_IMAGE_USAGE_TRANSFER_DST_BIT;
    return {allocator, spec, name};
}

// Texels of each mip level, layer after layer.
void put(BlockAllocator& allocator, const CommandPool& pool, const TargetImage& image,
         std::span<const std::vector<uint64_t>> levels) {
    std::vector<Buffer> staged;
    for (const auto& texels : levels) {
        const VkDeviceSize bytes = texels.size() * sizeof texels[0];
        staged.emplace_back(allocator, bytes, VK_BUFFER_USAGE_TRANSFER_SRC_BIT, MemoryKind::staging,
                            "staged environment");
        std::memcpy(staged.back().mapped(), texels.data(), bytes);
    }
    pool.run([&](VkCommandBuffer commands) {
        change_use(commands, image, {}, as_copy_destination);
        for (uint32_t mip = 0; mip < levels.size(); ++mip) {
            const ImageSpec& spec = image.spec();
            const uint32_t width = spec.width >> mip, height = spec.height >> mip;
            LODE_CHECK(levels[mip].size() == size_t{width} * height * spec.layers, mip, levels[mip].size());
            VkBufferImageCopy region{};
            region.imageSubresource = {VK_IMAGE_ASPECT_COLOR_BIT, mip, 0, spec.layers};
            region.imageExtent = {width, height, 1};
            vkCmdCopyBufferToImage(commands, staged[mip].get(), image.get(), as_copy_destination.layout, 1, &region);
        }
        change_use(commands, image, as_copy_destination, as_sampled);
    });
}

}  // namespace

EnvironmentImages make_environment_images(BlockAllocator& allocator, const CommandPool& pool,
                                          const Environment* environment) {
    static const Environment none{1, {std::vector<uint64_t>(6)}, {}, 1, 1, {0}};
    const Environment& e = environment != nullptr ? *environment : none;
    const auto mips = static_cast<uint32_t>(e.levels.size());
    LODE_CHECK(mips > 0 && e.side >> (mips - 1) > 0, mips, e.side);
    EnvironmentImages made;
    made.cube = sampled_image(allocator, {{}, e.side, e.side, 6, mips, 0, VK_IMAGE_VIEW_TYPE_CUBE}, "environment");
    put(allocator, pool, made.cube, e.levels);
    made.shares = sampled_image(allocator, {{}, e.shares_across, e.shares_down, 1, 1, 0, VK_IMAGE_VIEW_TYPE_2D},
                                "reflected shares");
    put(allocator, pool, made.shares, {&e.shares, 1});
    made.levels = environment != nullptr ? mips : 0;
    made.matte = e.matte;
    return made;
}

}  // namespace lodestone
