#include "render/material_images.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <map>
#include <set>
#include <tuple>
#include <utility>

#include "base/check.h"
#include "render/targets.h"
#include "shaders/shared/materials.h"

namespace lodestone {

namespace {

static_assert(static_cast<int>(Shading::metallic_roughness) == LODE_SHADING_METALLIC_ROUGHNESS);
static_assert(static_cast<int>(Shading::unlit) == LODE_SHADING_UNLIT);
static_assert(static_cast<int>(AlphaMode::mask) == LODE_ALPHA_MASK);
static_assert(static_cast<int>(AlphaMode::blend) == LODE_ALPHA_BLEND);
static_assert(static_cast<int>(Wrap::clamp) == LODE_WRAP_CLAMP);
static_assert(static_cast<int>(Wrap::mirror) == LODE_WRAP_MIRROR);
static_assert(texture_names.size() == LODE_MATERIAL_TEXTURES);

bool is_moved(const Texture& texture) { return texture.place != Texture{}.place; }

uint32_t looks_of(const MaterialSet& set) {
    uint32_t looks = set.mirrors ? LODE_LOOKS_MIRRORS : 0;
    if (set.environment != nullptr) looks |= LODE_LOOKS_ENVIRONMENT;
    for (const Material& m : set.materials) {
        const auto textures = m.textures();
        for (uint32_t t = 0; t < textures.size(); ++t) {
            const Texture& texture = *textures[t];
            if (!texture.there()) continue;
            looks |= 1u << t;
            if (is_moved(texture)) looks |= LODE_LOOKS_PLACES;
            if (texture.second) looks |= LODE_LOOKS_SECOND_UVS;
            if (texture.wrap != Texture{}.wrap) looks |= LODE_LOOKS_WRAPS;
        }
        if (m.shading == Shading::metallic_roughness) looks |= LODE_LOOKS_METALLIC_ROUGHNESS;
        if (m.shading == Shading::unlit) looks |= LODE_LOOKS_UNLIT;
        if (m.emission != glm::vec3(0)) looks |= LODE_LOOKS_EMISSION;
        looks |= m.double_sided ? LODE_LOOKS_TWO_SIDED : LODE_LOOKS_ONE_SIDED;
        if (m.alpha_mode == AlphaMode::mask) looks |= LODE_LOOKS_MASK;
        if (m.alpha_mode == AlphaMode::blend) looks |= LODE_LOOKS_BLEND;
    }
    return looks;
}

// An image of the set, and whether it is looked up as colours; as both it is there twice.
using UsedImage = std::pair<int32_t, bool>;

// Images that share an array.
struct ArrayPlan {
    uint32_t width = 1, height = 1;
    bool srgb = true;
    std::vector<int32_t> images;  // of the set, by layer
    uint64_t texels() const { return uint64_t{width} * height; }
};

// The smallest of a kind that has several go together, until there are few enough.
void join_smallest(std::vector<ArrayPlan>& arrays) {
    std::ranges::stable_sort(arrays, {}, &ArrayPlan::texels);
    const auto first = std::ranges::find_if(
        arrays, [&](const ArrayPlan& a) { return std::ranges::count(arrays, a.srgb, &ArrayPlan::srgb) > 1; });
    const auto second =
        std::find_if(first + 1, arrays.end(), [&](const ArrayPlan& a) { return a.srgb == first->srgb; });
    second->width = std::max(first->width, second->width);
    second->height = std::max(first->height, second->height);
    second->images.insert(second->images.end(), first->images.begin(), first->images.end());
    arrays.erase(first);
}

std::vector<ArrayPlan> plan_arrays(const MaterialSet& set) {
    std::set<UsedImage> used;
    for (const Material& m : set.materials) {
        const auto textures = m.textures();
        for (size_t t = 0; t < textures.size(); ++t) {
            LODE_CHECK(textures[t]->image < static_cast<int64_t>(set.images.size()), textures[t]->image);
            if (textures[t]->there()) used.emplace(textures[t]->image, holds_colours(t));
        }
    }
    std::map<std::tuple<uint32_t, uint32_t, bool>, ArrayPlan> alike;
    for (const auto& [number, srgb] : used) {
        const Image& image = set.images[static_cast<size_t>(number)];
        LODE_CHECK(image.texels.size() == size_t{image.width} * image.height && !image.texels.empty(), number);
        ArrayPlan& array = alike[{image.width, image.height, srgb}];
        array.width = image.width;
        array.height = image.height;
        array.srgb = srgb;
        array.images.push_back(number);
    }
    std::vector<ArrayPlan> arrays;
    for (auto& [key, array] : alike) arrays.push_back(std::move(array));
    while (arrays.size() > LODE_MOST_TEXTURE_ARRAYS) join_smallest(arrays);
    return arrays;
}

void check_limits(const VkPhysicalDeviceLimits& limits, const ArrayPlan& array) {
    if (array.images.size() > limits.maxImageArrayLayers ||
        std::max(array.width, array.height) > limits.maxImageDimension2D) {
        throw VulkanFailure("the scene has " + std::to_string(array.images.size()) + " textures of " +
                            std::to_string(array.width) + " x " + std::to_string(array.height) +
                            " texels; the device takes " + std::to_string(limits.maxImageArrayLayers) + " of " +
                            std::to_string(limits.maxImageDimension2D) + " a side");
    }
}

// Levels are copied to, then the next is made of them.
constexpr ImageUse as_landing = {VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, VK_PIPELINE_STAGE_2_ALL_TRANSFER_BIT,
                                 VK_ACCESS_2_TRANSFER_WRITE_BIT};
constexpr ImageUse as_blitted = {VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL, VK_PIPELINE_STAGE_2_ALL_TRANSFER_BIT,
                                 VK_ACCESS_2_TRANSFER_READ_BIT};

VkFormat format_of(bool srgb) { return srgb ? VK_FORMAT_R8G8B8A8_SRGB : VK_FORMAT_R8G8B8A8_UNORM; }

// A level of a layer of an image.
struct Level {
    const TargetImage& image;
    uint32_t layer, mip;
    VkImageSubresourceLayers resource() const { return {VK_IMAGE_ASPECT_COLOR_BIT, mip, layer, 1}; }
    ImageLevels range() const { return {mip, 1, layer, 1}; }
    VkOffset3D end() const {
        const auto side = [&](uint32_t whole) { return static_cast<int32_t>(std::max(whole >> mip, 1u)); };
        return {side(image.spec().width), side(image.spec().height), 1};
    }
};

// Filtered, in linear light where the format is sRGB. `from` was as_landing and becomes as_blitted.
void blit(VkCommandBuffer commands, const Level& from, const Level& to) {
    change_use(commands, from.image, as_landing, as_blitted, from.range());
    VkImageBlit region{};
    region.srcSubresource = from.resource();
    region.srcOffsets[1] = from.end();
    region.dstSubresource = to.resource();
    region.dstOffsets[1] = to.end();
    vkCmdBlitImage(commands, from.image.get(), as_blitted.layout, to.image.get(), as_landing.layout, 1, &region,
                   VK_FILTER_LINEAR);
}

class Uploader {
public:
    Uploader(BlockAllocator& allocator, const CommandPool& pool) : allocator_(allocator), pool_(pool) {}

    TargetImage array_of(const ArrayPlan& plan, const MaterialSet& set) {
        check_limits(allocator_.device().limits(), plan);
        TargetImage array = image_of(plan.width, plan.height, static_cast<uint32_t>(plan.images.size()), plan.srgb);
        pool_.run([&](VkCommandBuffer commands) { change_use(commands, array, {}, as_landing); });
        for (uint32_t layer = 0; layer < plan.images.size(); ++layer)
            put(set.images[static_cast<size_t>(plan.images[layer])], array, layer);
        return array;
    }

    TexelBuffer table_of(const std::vector<gpu::MaterialConstants>& table) {
        const VkDeviceSize bytes = table.size() * sizeof table[0];
        TexelBuffer made;
        made.buffer =
            Buffer(allocator_, bytes, VK_BUFFER_USAGE_UNIFORM_TEXEL_BUFFER_BIT | VK_BUFFER_USAGE_TRANSFER_DST_BIT,
                   MemoryKind::device_local, "materials");
        made.view = make_texel_view(allocator_.device(), made.buffer.get(), 4);
        const Buffer staged = stage(table.data(), bytes);
        pool_.run([&](VkCommandBuffer commands) {
            const VkBufferCopy copy{0, 0, bytes};
            vkCmdCopyBuffer(commands, staged.get(), made.buffer.get(), 1, &copy);
            memory_barrier(commands, VK_PIPELINE_STAGE_2_COPY_BIT, VK_ACCESS_2_TRANSFER_WRITE_BIT,
                           VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT, VK_ACCESS_2_SHADER_SAMPLED_READ_BIT);
        });
        return made;
    }

private:
    TargetImage image_of(uint32_t width, uint32_t height, uint32_t layers, bool srgb) {
        const auto mips = static_cast<uint32_t>(std::bit_width(std::max(width, height)));
        return {allocator_,
                {format_of(srgb), width, height, layers, mips,
                 VK_IMAGE_USAGE_SAMPLED_BIT | VK_IMAGE_USAGE_TRANSFER_DST_BIT | VK_IMAGE_USAGE_TRANSFER_SRC_BIT,
                 VK_IMAGE_VIEW_TYPE_2D_ARRAY},
                "textures"};
    }

    Buffer stage(const void* data, VkDeviceSize bytes) {
        Buffer staged(allocator_, bytes, VK_BUFFER_USAGE_TRANSFER_SRC_BIT, MemoryKind::staging, "staged materials");
        std::memcpy(staged.mapped(), data, bytes);
        return staged;
    }

    // The image, enlarged to the size of the array, and its mip levels.
    void put(const Image& image, const TargetImage& array, uint32_t layer) {
        const Buffer staged = stage(image.texels.data(), image.texels.size() * sizeof image.texels[0]);
        TargetImage own;
        const bool fits = image.width == array.spec().width && image.height == array.spec().height;
        if (!fits) own = image_of(image.width, image.height, 1, array.spec().format == format_of(true));
        pool_.run([&](VkCommandBuffer commands) {
            const TargetImage& landing = fits ? array : own;
            if (!fits) change_use(commands, own, {}, as_landing);
            VkBufferImageCopy region{};
            region.imageSubresource = Level{landing, fits ? layer : 0, 0}.resource();
            region.imageExtent = {image.width, image.height, 1};
            vkCmdCopyBufferToImage(commands, staged.get(), landing.get(), as_landing.layout, 1, &region);
            if (!fits) blit(commands, {own, 0, 0}, {array, layer, 0});
            for (uint32_t mip = 1; mip < array.spec().mips; ++mip)
                blit(commands, {array, layer, mip - 1}, {array, layer, mip});
            const uint32_t last = array.spec().mips - 1;
            if (last > 0) change_use(commands, array, as_blitted, as_sampled, {0, last, layer, 1});
            change_use(commands, array, as_landing, as_sampled, {last, 1, layer, 1});
        });
    }

    BlockAllocator& allocator_;
    const CommandPool& pool_;
};

// Where images lie: array << 24 | layer.
using Places = std::map<UsedImage, uint32_t>;

gpu::TextureConstants constants_of(const Texture& texture, bool srgb, const Places& places) {
    gpu::TextureConstants c{};
    c.turn = glm::vec4(texture.place[0], texture.place[1]);
    c.move_x = texture.place[2].x;
    c.move_y = texture.place[2].y;
    c.array_and_layer = texture.there() ? places.at({texture.image, srgb}) : LODE_NO_TEXTURE;
    c.wrap = static_cast<uint32_t>(texture.wrap[0]) | static_cast<uint32_t>(texture.wrap[1]) << 8 |
             (is_moved(texture) ? LODE_TEXTURE_MOVED : 0) | (texture.second ? LODE_TEXTURE_SECOND : 0);
    return c;
}

gpu::MaterialConstants constants_of(const Material& m, const Places& places) {
    gpu::MaterialConstants c{};
    c.base_colour = m.base_colour;
    c.emission = m.emission;
    c.occlusion_strength = m.occlusion_strength;
    c.metallic = m.metallic;
    c.roughness = m.roughness;
    c.normal_scale = m.normal_scale;
    c.alpha_cutoff = m.alpha_cutoff;
    c.shading = static_cast<uint32_t>(m.shading);
    c.alpha_mode = static_cast<uint32_t>(m.alpha_mode) | (m.double_sided ? LODE_TWO_SIDED : 0u);
    const auto textures = m.textures();
    for (uint32_t t = 0; t < textures.size(); ++t) {
        c.texture[t] = constants_of(*textures[t], holds_colours(t), places);
        if (textures[t]->there()) c.textures |= 1u << t;
    }
    c.base_array_and_layer = c.texture[LODE_TEXTURE_BASE_COLOUR].array_and_layer;
    return c;
}

}  // namespace

MaterialImages make_material_images(BlockAllocator& allocator, const CommandPool& pool, const MaterialSet& set) {
    LODE_CHECK(!set.materials.empty());
    Uploader uploader(allocator, pool);
    MaterialImages made;
    Places places;
    for (const ArrayPlan& plan : plan_arrays(set)) {
        for (uint32_t layer = 0; layer < plan.images.size(); ++layer)
            places[{plan.images[layer], plan.srgb}] = static_cast<uint32_t>(made.arrays.size()) << 24 | layer;
        made.arrays.push_back(uploader.array_of(plan, set));
    }
    if (made.arrays.empty()) {
        const MaterialSet white{{}, {{1, 1, {glm::u8vec4(255)}}}};
        made.arrays.push_back(uploader.array_of({1, 1, true, {0}}, white));
    }
    std::vector<gpu::MaterialConstants> table;
    for (const Material& m : set.materials) table.push_back(constants_of(m, places));
    made.table = uploader.table_of(table);
    made.environment = make_environment_images(allocator, pool, set.environment.get());
    made.looks = {looks_of(set), static_cast<uint32_t>(made.arrays.size())};
    return made;
}

}  // namespace lodestone
