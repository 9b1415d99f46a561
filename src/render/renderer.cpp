#include "render/renderer.h"

#include <algorithm>
#include <cstring>
#include <optional>

#include "base/check.h"
#include "render/frame_recorder.h"
#include "render/frame_set.h"
#include "render/renderer_access.h"
#include "shaders/shared/light_grid.h"

namespace lodestone {

namespace {

class VulkanRenderer final : public Renderer {
public:
    explicit VulkanRenderer(const RendererOptions& options)
        : options_(options),
          device_(options.device, options.validation, options.presents),
          allocator_(device_),
          pool_(device_),
          sets_(device_, options.frames_in_flight),
          resolve_(build_resolve(device_, sets_.layout())) {
        no_light_grid_.buffer =
            Buffer(allocator_, sizeof(uint32_t) * LODE_LIGHT_GRID_HEAD, VK_BUFFER_USAGE_UNIFORM_TEXEL_BUFFER_BIT,
                   MemoryKind::device_local, "no light grid");
        no_light_grid_.view = make_texel_view(device_, no_light_grid_.buffer.get(), 1);
        slots_.resize(options.frames_in_flight);
        for (FrameSlot& slot : slots_) make_slot(slot);
        remake_targets(options.width, options.height);
    }
    ~VulkanRenderer() override { vkDeviceWaitIdle(device_.handle()); }

    const DeviceInfo& device() const override { return device_.info(); }

    Result<void> load(const Recipe& recipe, const MaterialSet& materials, uint32_t place,
                      const Recipe* effect) override {
        return guarded([&] {
            LODE_CHECK(place < most_places, place);
            finish_all();
            try {
                bring(recipe, materials, place, effect);
            } catch (const VulkanFailure& failure) {
                if (!failure.out_of_memory() || loaded(place) == 0) throw;
                loaded_[place] = {};
                bring(recipe, materials, place, effect);
            }
        });
    }

    uint64_t loaded(uint32_t place) const override { return loaded_[place].number; }

    Result<void> prepare(uint32_t place) override {
        return guarded([&] {
            Loaded& loaded = loaded_[place];
            const SceneLooks& looks = loaded.materials.looks;
            make_pipelines(loaded.backend, looks, uses_of(loaded.backend.recipe, looks, {}));
            if (!loaded.effect) return;
            const DrawnAs beside{.beside_effect = true};
            make_pipelines(loaded.backend, looks, uses_of(loaded.backend.recipe, looks, beside));
            make_pipelines(*loaded.effect, {}, uses_of(loaded.effect->recipe, {}, beside));
        });
    }

    Result<void> resize(uint32_t width, uint32_t height) override {
        return guarded([&] {
            finish_all();
            remake_targets(width, height);
        });
    }

    Result<void> submit(const Plan& plan, const FrameInput& input, const ShadingOptions& look, uint32_t place,
                        const Plan* effect) override {
        return guarded([&] {
            const auto entered = std::chrono::steady_clock::now();
            LODE_CHECK(place < most_places, place);
            LODE_CHECK(!input.views.empty() && input.views[0].kind == View::Kind::camera, input.views.size());
            Loaded& loaded = loaded_[place];
            if (loaded.number == 0) throw VulkanFailure("there is nothing to draw: what was to be loaded did not fit");
            FrameSlot& slot = slots_[next_slot_];
            if (slot.busy) finish(slot);
            next_slot_ = (next_slot_ + 1) % slots_.size();
            slot.frame = input.frame;
            slot.place = place;
            slot.submitted_at = entered;
            slot.staging.reset();
            instances_.update(input.instances);
            if (ensure_texels(allocator_, slot.instances,
                              std::max<size_t>(input.instances.size(), 1) * sizeof(gpu::InstanceConstants), 4,
                              "instances"))
                slot.instances_version = 0;
            ensure_texels(allocator_, slot.instance_ids,
                          std::max<size_t>(plan.instance_ids.size(), 1) * sizeof(uint32_t), 1, "instance ids");
            const size_t marks = look.marks != nullptr ? look.marks->of_triangles.size() : 0;
            ensure_buffer(allocator_, slot.marks, (marks + 4) / 4 * 4, VK_BUFFER_USAGE_STORAGE_BUFFER_BIT,
                          "triangle marks");
            const bool with_effect = effect != nullptr && !effect->commands.empty();
            LODE_CHECK(!with_effect || loaded.effect, place);
            sets_.write(slot, loaded.materials, targets_,
                        with_effect && loaded.light_grid ? loaded.light_grid->get() : no_light_grid_.view.get());
            try {
                record({plan, with_effect ? effect : nullptr}, input, look, loaded, slot);
            } catch (...) {
                // What was recorded has not run, or not all of it.
                slot.readbacks.clear();
                slot.effect_readbacks.clear();
                slot.instances_version = 0;
                loaded.backend.hazards.distrust();
                if (loaded.effect) loaded.effect->hazards.distrust();
                throw;
            }
            slot.busy = true;
            loaded.newest = slot.frame;
            drawn_ = true;
            colour_use_ = as_colour_target;
            depth_use_ = as_depth_read;
        });
    }

    Result<uint64_t> completed_frame(uint32_t place) override {
        return guarded([&] {
            const auto& newest = loaded_[place].newest;
            uint64_t completed = newest ? *newest + 1 : 0;
            for (size_t i = 0; i < slots_.size(); ++i) {
                FrameSlot& slot = slots_[(next_slot_ + i) % slots_.size()];  // oldest first
                if (!slot.busy) continue;
                const VkResult status = vkGetFenceStatus(device_.handle(), slot.fence.get());
                if (status == VK_SUCCESS) {
                    finish(slot);
                } else if (status != VK_NOT_READY) {
                    vulkan_check(status, "vkGetFenceStatus");  // it will never be signalled
                } else if (slot.place == place) {
                    completed = std::min(completed, slot.frame);  // later ones have not left either
                }
            }
            return completed;
        });
    }

    bool lost() const override { return vkDeviceWaitIdle(device_.handle()) == VK_ERROR_DEVICE_LOST; }
    Result<void> wait() override {
        return guarded([&] { finish_all(); });
    }

    std::vector<FrameCounters> take_counters(uint32_t place) override {
        return std::exchange(loaded_[place].counters, {});
    }
    std::vector<ReadbackResult> take_readbacks(uint32_t place) override {
        return std::exchange(loaded_[place].readbacks, {});
    }
    std::vector<ReadbackResult> take_effect_readbacks(uint32_t place) override {
        return std::exchange(loaded_[place].effect_readbacks, {});
    }

    Result<Picture> read_picture() override {
        return guarded([&] { return copy_picture(); });
    }

    uint64_t allocated_bytes() const override { return allocator_.allocated_bytes(); }
    Result<void> trim() override {
        return guarded([&] {
            finish_all();
            // Drivers may keep what was destroyed until something is submitted again (lavapipe its pipelines).
            pool_.run([](VkCommandBuffer) {});
            allocator_.trim();
        });
    }
    uint64_t buffer_bytes(uint32_t place) const override {
        const auto held = [](const SplitBuffer& buffer) {
            uint64_t bytes = 0;
            for (const Buffer& segment : buffer.segments) bytes += segment.held_bytes();
            return bytes;
        };
        uint64_t bytes = 0;
        for (const SplitBuffer& buffer : loaded_[place].backend.built.buffers) bytes += held(buffer);
        if (loaded_[place].effect) {
            for (const SplitBuffer& buffer : loaded_[place].effect->built.buffers) bytes += held(buffer);
        }
        for (const FrameSlot& slot : slots_) {
            if (slot.place != place) continue;
            for (const Replaced& replaced : slot.replaced) bytes += held(replaced.buffer);
        }
        return bytes;
    }
    std::vector<std::string> validation_messages() const override { return device_.messages(); }
    RendererAccess access() override { return {device_, pool_, allocator_, targets_, colour_use_}; }

private:
    // A place and what is in it.
    struct Loaded {
        uint64_t number = 0;  // of the load; 0: nothing is there
        struct Part {
            Recipe recipe;
            BuiltRecipe built;
            BufferHazards hazards;
        };
        Part backend;
        std::optional<Part> effect;
        std::optional<OwnedBufferView> light_grid;  // of the effect, where it has one
        MaterialImages materials;
        std::optional<uint64_t> newest;  // the last frame submitted
        // Of frames completed, not yet taken.
        std::vector<FrameCounters> counters;
        std::vector<ReadbackResult> readbacks, effect_readbacks;
    };
    // The plans of a frame.
    struct Plans {
        const Plan& backend;
        const Plan* effect;
    };

    void make_slot(FrameSlot& slot) {
        slot.commands = pool_.allocate();
        VkFenceCreateInfo fence_info{};
        fence_info.sType = VK_STRUCTURE_TYPE_FENCE_CREATE_INFO;
        VkFence fence = VK_NULL_HANDLE;
        LODE_VK(vkCreateFence(device_.handle(), &fence_info, nullptr, &fence));
        slot.fence = OwnedFence(device_.handle(), fence);
        slot.staging = Staging(allocator_, staging_bytes);
        slot.constants = Buffer(allocator_, sizeof(gpu::FrameConstants),
                                VK_BUFFER_USAGE_UNIFORM_BUFFER_BIT | VK_BUFFER_USAGE_TRANSFER_DST_BIT,
                                MemoryKind::device_local, "frame constants");
        slot.frame_set = sets_.allocate();
        const auto make_queries = [&](VkQueryType type, uint32_t count, VkQueryPipelineStatisticFlags statistics) {
            VkQueryPoolCreateInfo info{};
            info.sType = VK_STRUCTURE_TYPE_QUERY_POOL_CREATE_INFO;
            info.queryType = type;
            info.queryCount = count;
            info.pipelineStatistics = statistics;
            VkQueryPool queries = VK_NULL_HANDLE;
            LODE_VK(vkCreateQueryPool(device_.handle(), &info, nullptr, &queries));
            return OwnedQueryPool(device_.handle(), queries);
        };
        if (device_.has_statistics()) {
            slot.statistics =
                make_queries(VK_QUERY_TYPE_PIPELINE_STATISTICS, stage_count,
                             VK_QUERY_PIPELINE_STATISTIC_INPUT_ASSEMBLY_PRIMITIVES_BIT |
                                 VK_QUERY_PIPELINE_STATISTIC_VERTEX_SHADER_INVOCATIONS_BIT |
                                 VK_QUERY_PIPELINE_STATISTIC_TESSELLATION_EVALUATION_SHADER_INVOCATIONS_BIT);
        }
        if (device_.has_timestamps()) {
            slot.timestamps = make_queries(VK_QUERY_TYPE_TIMESTAMP, stage_count + 1, 0);
            slot.effect_timestamps = make_queries(VK_QUERY_TYPE_TIMESTAMP, most_effect_timestamps, 0);
        }
    }

    Loaded::Part part_of(const Recipe& recipe) {
        const uint64_t limit = options_.segment_bytes_limit > 0 ? options_.segment_bytes_limit : ~uint64_t{0};
        Loaded::Part part;
        part.recipe = recipe;
        part.built = build_recipe(allocator_, recipe, sets_.layout(), limit);
        part.hazards.reset(recipe.buffers.size());
        return part;
    }
    void make_pipelines(Loaded::Part& part, const SceneLooks& looks, std::vector<PipelineUse> uses) {
        build_pipelines(device_, part.recipe, looks, std::move(uses), part.built);
    }

    // All is made before anything that was there goes.
    void bring(const Recipe& recipe, const MaterialSet& materials, uint32_t place, const Recipe* effect) {
        Loaded made;
        made.materials = make_material_images(allocator_, pool_, materials);
        made.backend = part_of(recipe);
        if (effect != nullptr) made.effect = part_of(*effect);
        if (effect != nullptr && effect->light_grid != no_light_grid) {
            const SplitBuffer& grid = made.effect->built.buffers[effect->light_grid];
            LODE_CHECK(grid.most_segments == 1, effect->buffers[effect->light_grid].name);
            made.light_grid = make_texel_view(device_, grid.whole(), 1);
        }
        if (made.materials.environment.levels > 0 && background_.layout.get() == VK_NULL_HANDLE)
            background_ = build_background(device_, sets_.layout());
        made.number = ++loads_;
        Extra wanted = wanted_by(made);
        for (uint32_t p = 0; p < most_places; ++p) {
            if (p != place) wanted.add(wanted_by(loaded_[p]));
        }
        remake_extra(wanted, targets_);
        loaded_[place] = std::move(made);  // frames may be counted from 0 again
    }

    void record(const Plans& plans, const FrameInput& input, const ShadingOptions& look, Loaded& loaded,
                FrameSlot& slot) {
        const DrawnAs as = drawn_as(look, device_, plans.effect != nullptr);
        const SceneLooks& looks = loaded.materials.looks;
        make_pipelines(loaded.backend, looks, uses_of(plans.backend, loaded.backend.recipe, looks, as));
        if (plans.effect != nullptr)
            make_pipelines(*loaded.effect, {}, uses_of(*plans.effect, loaded.effect->recipe, {}, as));
        CommandPool::begin(slot.commands);
        const auto recorded = [&](const Plan& plan, Loaded::Part& part, auto& readbacks) {
            return RecordedPlan{plan, part.recipe, part.built, part.hazards, slot.replaced, readbacks};
        };
        const RecordedPlan backend = recorded(plans.backend, loaded.backend, slot.readbacks);
        std::optional<RecordedPlan> effect;
        if (plans.effect != nullptr) effect.emplace(recorded(*plans.effect, *loaded.effect, slot.effect_readbacks));
        FrameRecorder({device_, pool_, allocator_, targets_, options_.shadow_size, slot, instances_, resolve_,
                       background_, loaded.materials.looks, loaded.materials.environment},
                      backend, effect ? &*effect : nullptr, input, look)
            .record();
        const VkFence fence = slot.fence.get();
        LODE_VK(vkResetFences(device_.handle(), 1, &fence));
        pool_.submit(slot.commands, fence);
    }

    void remake_targets(uint32_t width, uint32_t height) {
        const uint32_t most = device_.limits().maxImageDimension2D;
        if (width == 0 || height == 0 || width > most || height > most) {
            throw VulkanFailure("a picture of " + std::to_string(width) + "x" + std::to_string(height) +
                                " pixels; the device draws 1 to " + std::to_string(most) + " a side");
        }
        Targets made = make_targets(allocator_, width, height, options_.shadow_size);
        Extra wanted;
        for (const Loaded& loaded : loaded_) wanted.add(wanted_by(loaded));
        remake_extra(wanted, made);
        targets_ = std::move(made);
        colour_use_ = depth_use_ = {};
    }

    // Targets that are as large as the others where something that is loaded asks for them.
    struct Extra {
        uint32_t visibility = 0;
        bool radiance = false;
        void add(const Extra& more) {
            visibility = std::max(visibility, more.visibility);
            radiance = radiance || more.radiance;
        }
    };
    static Extra wanted_by(const Loaded& loaded) {
        return {loaded.backend.recipe.visibility_targets(), loaded.effect.has_value()};
    }
    void remake_extra(const Extra& asked, Targets& targets) {
        const ImageSpec& whole = targets.depth.spec();
        const auto remake = [&](bool wanted, TargetImage& image, auto&& make) {
            const uint32_t width = wanted ? whole.width : 1, height = wanted ? whole.height : 1;
            const ImageSpec& now = image.spec();
            if (image.get() != VK_NULL_HANDLE && now.width == width && now.height == height) return;
            image = make(allocator_, width, height);
        };
        for (uint32_t k = 0; k < targets.visibility.size(); ++k)
            remake(k < asked.visibility, targets.visibility[k], make_visibility);
        remake(asked.radiance, targets.radiance, make_radiance);
    }

    void finish(FrameSlot& slot) {
        const VkFence fence = slot.fence.get();
        LODE_VK(vkWaitForFences(device_.handle(), 1, &fence, VK_TRUE, UINT64_MAX));
        slot.busy = false;
        Loaded& loaded = loaded_[slot.place];
        loaded.counters.push_back(read_counters(device_, slot));
        for (const FrameSlot::PendingReadback& r : slot.readbacks)
            loaded.readbacks.push_back({r.tag, slot.frame, Blob::copy_of(r.buffer.mapped(), r.buffer.bytes())});
        for (const FrameSlot::PendingReadback& r : slot.effect_readbacks)
            loaded.effect_readbacks.push_back({r.tag, slot.frame, Blob::copy_of(r.buffer.mapped(), r.buffer.bytes())});
        slot.readbacks.clear();
        slot.effect_readbacks.clear();
        slot.replaced.clear();
    }

    void finish_all() {
        for (size_t i = 0; i < slots_.size(); ++i) {
            FrameSlot& slot = slots_[(next_slot_ + i) % slots_.size()];
            if (slot.busy) finish(slot);
            slot.replaced.clear();  // of a frame that was not drawn
        }
    }

    Picture copy_picture() {
        LODE_CHECK(drawn_);
        finish_all();
        Picture picture;
        picture.width = targets_.colour.spec().width;
        picture.height = targets_.colour.spec().height;
        if (colour_use_.layout == VK_IMAGE_LAYOUT_UNDEFINED)
            throw VulkanFailure("no frame was drawn since the picture's size changed");
        const VkDeviceSize bytes = VkDeviceSize{4} * picture.width * picture.height;
        const Buffer colour(allocator_, bytes, VK_BUFFER_USAGE_TRANSFER_DST_BIT, MemoryKind::readback,
                            "picture colour");
        const Buffer depth(allocator_, bytes, VK_BUFFER_USAGE_TRANSFER_DST_BIT, MemoryKind::readback, "picture depth");
        pool_.run([&](VkCommandBuffer commands) {
            const auto copy = [&](const TargetImage& image, ImageUse& use, const Buffer& to) {
                change_use(commands, image, use, as_copy_source);
                use = as_copy_source;
                VkBufferImageCopy region{};
                region.imageSubresource = {image.aspect(), 0, 0, 1};
                region.imageExtent = {picture.width, picture.height, 1};
                vkCmdCopyImageToBuffer(commands, image.get(), VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL, to.get(), 1,
                                       &region);
            };
            copy(targets_.colour, colour_use_, colour);
            copy(targets_.depth, depth_use_, depth);
            memory_barrier(commands, VK_PIPELINE_STAGE_2_COPY_BIT, VK_ACCESS_2_TRANSFER_WRITE_BIT,
                           VK_PIPELINE_STAGE_2_HOST_BIT, VK_ACCESS_2_HOST_READ_BIT);
        });
        picture.colour.resize(bytes);
        picture.depth.resize(bytes / 4);
        std::memcpy(picture.colour.data(), colour.mapped(), bytes);
        std::memcpy(picture.depth.data(), depth.mapped(), bytes);
        return picture;
    }

    RendererOptions options_;
    Device device_;
    BlockAllocator allocator_;
    CommandPool pool_;
    FrameSets sets_;
    BuiltPipeline resolve_;
    BuiltPipeline background_;   // once an environment was loaded
    TexelBuffer no_light_grid_;  // in the place of one
    Targets targets_;
    std::array<Loaded, most_places> loaded_;
    uint64_t loads_ = 0;
    std::vector<FrameSlot> slots_;
    InstanceTable instances_;  // of the last frame submitted
    size_t next_slot_ = 0;
    bool drawn_ = false;  // a frame was submitted
    ImageUse colour_use_, depth_use_;
};

}  // namespace

Result<std::unique_ptr<Renderer>> Renderer::create(const RendererOptions& options) {
    LODE_CHECK(options.frames_in_flight >= 1 && options.frames_in_flight <= 4, options.frames_in_flight);
    return guarded([&]() -> std::unique_ptr<Renderer> { return std::make_unique<VulkanRenderer>(options); });
}

Result<std::vector<DeviceInfo>> list_devices() {
    return guarded([] { return Device::list(); });
}

}  // namespace lodestone
