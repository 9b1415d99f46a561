// Executes plans with Vulkan 1.3 and gives back pictures and counters. The only room that knows Vulkan; it knows no
// backend and no mesh. No Vulkan type appears here, so what includes this header builds without Vulkan's.
#pragma once

#include <array>
#include <cstdint>
#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>
#include <memory>
#include <string>
#include <vector>

#include "base/result.h"
#include "frame/frame_source.h"
#include "frame/materials.h"
#include "frame/picture.h"

namespace lodestone {

// What a renderer is made for.
struct RendererOptions {
    std::string
        device;  // a number from list_devices(), or part of a device's name; empty: the first real GPU, else the first
    uint32_t width = 1280, height = 720;  // pixels of the camera views, 1 .. 16384
    uint32_t shadow_size = 2048;          // texels a side; 0 for no shadow map
    uint32_t frames_in_flight = 2;        // 1 .. 4
    bool validation = false;  // core and synchronisation validation; messages are collected in validation_messages()
    bool presents = false;    // to a window (window.h); needs a display
    // Tests: split storage buffers that all pipelines take in pieces above this size, 0 takes the device's limit.
    uint32_t segment_bytes_limit = 0;
};

// What a device is and can.
struct DeviceInfo {
    std::string name, driver;         // as the driver names them
    bool software = false;            // a CPU rasteriser
    uint64_t device_local_bytes = 0;  // of all its memory heaps together
    bool tessellates = false;         // rasters of `vgi` that tessellate need it
};
// Devices with Vulkan, by the numbers that RendererOptions::device takes; those that create() would refuse, too.
// Fault::machine where there is no Vulkan.
Result<std::vector<DeviceInfo>> list_devices();

// What colours say in place of the material.
enum class DebugView : uint32_t {
    none,      // nothing: materials are shown
    level,     // the level drawn, from finest to coarsest
    triangle,  // a colour for each triangle
    normal,    // the normal as a colour, unlit
    uv,        // texture coordinates
    material,  // a colour for each material
    chart,     // a colour for each chart of `vgi`
    page,      // a colour for each page of `vgi`
    missing,   // `vgi`: where pages that are wanted are not there
    error,     // the error in pixels
    stretch,   // `vgi`: how unevenly a chart is sampled
    misses,    // vertex-cache misses of each triangle (TriangleMarks)
    // Of volumes; surfaces are lit as ever.
    volume_bricks,     // a colour for each metavoxel
    volume_occupancy,  // how many of a ray's steps found something
    volume_light,      // what comes towards the eye, without how dense it is
    volume_steps,      // samples along a ray, up to 256
    leaf,              // `vgi`: where the source's own triangles are drawn
    base_colour,       // of the material, times texture and vertex colour
    alpha,             // of it; 1 where it is opaque
    metallic,          // of the material
    roughness,         // of the material
    occlusion,         // how much of the light from all around reaches the surface, by the material's texture
    emission           // what shines by itself
};

// A number for every triangle of some of a plan's draws, for DebugView::misses: 0 blue .. 3 red.
struct TriangleMarks {
    std::vector<uint8_t> of_triangles;         // draw after draw; every instance of a draw has the same
    std::vector<uint32_t> first;               // by command of the plan, into of_triangles; no_marks where it has none
    static constexpr uint32_t no_marks = ~0u;  // the command has no marks
};

// How a frame is lit and shown; the same for every backend.
struct ShadingOptions {
    glm::vec3 light_direction{-0.4f, -0.8f, -0.45f};  // from the light towards the scene, any length
    glm::vec3 light_colour{2.1f, 2.0f, 1.85f};        // linear
    glm::vec3 sky_colour{0.5f, 0.56f, 0.65f};         // hemisphere from above, linear
    glm::vec3 ground_colour{0.22f, 0.2f, 0.18f};      // and from below
    glm::vec3 background{0.05f, 0.06f, 0.08f};        // linear
    bool environment = true;                          // where one was loaded, it is in the place of both and is seen
    bool double_sided = false;                        // false culls back faces, but of materials that have two sides
    bool wireframe = false;                           // lines only; where RendererOptions::presents
    DebugView debug = DebugView::none;                // what colours say
    std::shared_ptr<const TriangleMarks> marks;       // of the plan that is drawn; may be null
};

// What the GPU counted in one frame. Counts are of all passes together and per stage.
struct FrameCounters {
    uint64_t frame = 0;  // FrameInput::frame
    // Counts of one stage. 0 where the device cannot count.
    struct Pass {
        uint64_t vertex_invocations = 0;        // vertex shader runs
        uint64_t tessellation_evaluations = 0;  // tessellation evaluation shader runs
        // Of which triangles were made: what tessellates makes its vertices in evaluations.
        uint64_t vertices() const {
            return tessellation_evaluations > 0 ? tessellation_evaluations : vertex_invocations;
        }
        uint64_t input_primitives = 0;  // degenerate ones included
        double gpu_ms = 0;              // between timestamps around the stage, 0 where the device has none
    };
    std::array<Pass, stage_count> pass;  // by Stage
    // Of one pass over the camera's triangles: the one that every backend makes of them.
    uint64_t camera_vertices() const { return pass[static_cast<size_t>(Stage::depth)].vertices(); }
    double gpu_ms = 0;  // first timestamp to last
    // Of an effect, by the names of its pipelines; empty where the device has no timestamps.
    std::vector<std::pair<std::string, double>> effect_ms;
    double total_ms = 0;  // wall clock, from submit() entered to fence seen signalled
};

struct RendererAccess;  // for the window

// A device with everything that is drawn on it. One thread at a time uses it. Every Result is Fault::machine where
// memory, device or driver fail.
class Renderer {
public:
    // Fault::machine where there is no Vulkan 1.3 device or a needed feature is missing; the message names it.
    static Result<std::unique_ptr<Renderer>> create(const RendererOptions& options);
    virtual ~Renderer() = default;

    virtual const DeviceInfo& device() const = 0;  // the one that was chosen

    static constexpr uint32_t most_places = 2;  // recipes loaded at once
    // Builds buffers of a recipe and textures of the scene. Waits for the device. An equal recipe with a
    // new generation empties the buffers. Frames are counted anew. place: several recipes can be loaded, each in a
    // place of its own, 0 .. most_places - 1; what was there goes, once the new one is built. Where both at once are
    // too much for the device it goes before. After an error the place holds what it held, or nothing: see loaded().
    // effect: is drawn beside it, in frames that say so; may be null.
    virtual Result<void> load(const Recipe& recipe, const MaterialSet& materials, uint32_t place = 0,
                              const Recipe* effect = nullptr) = 0;

    // Makes every pipeline that a frame of the place may have, but for debug views and lines. Pipelines that a plan has
    // and that were not made are when it is submitted, and the frame waits for them.
    virtual Result<void> prepare(uint32_t place = 0) = 0;

    // Another number for everything that was ever loaded into the place; 0 where nothing is.
    virtual uint64_t loaded(uint32_t place) const = 0;

    // Changes the size of the camera targets; after an error they are as they were.
    virtual Result<void> resize(uint32_t width, uint32_t height) = 0;

    // Records and submits one frame; waits only when frames_in_flight frames are under way, or when more bytes are
    // uploaded than are staged at once. views[0] is drawn to the target that read_picture() reads; at most one shadow
    // view is drawn and used for lighting. Other cameras have no target yet: draws of them are an error. Where an
    // instance is mirrored, back faces are not culled in that frame. After an error the frame was not drawn, and what
    // it uploads may be lost: whoever made the plan is to be loaded anew. Every function tells of a lost device so.
    // effect: a plan of the effect that was loaded with the recipe, for the same input. Null, or one without commands,
    // draws the frame as if none was loaded. Otherwise colours are half floats until the effect has been laid over
    // them.
    virtual Result<void> submit(const Plan& plan, const FrameInput& input, const ShadingOptions& look,
                                uint32_t place = 0, const Plan* effect = nullptr) = 0;

    // Every frame of the place before this number has left the GPU.
    virtual Result<uint64_t> completed_frame(uint32_t place = 0) = 0;
    // Waits for every submitted frame.
    virtual Result<void> wait() = 0;
    // Counters of the place's frames that were seen to complete since the last call, oldest first.
    virtual std::vector<FrameCounters> take_counters(uint32_t place = 0) = 0;
    // Readbacks of the same frames.
    virtual std::vector<ReadbackResult> take_readbacks(uint32_t place = 0) = 0;
    // And those of the effect.
    virtual std::vector<ReadbackResult> take_effect_readbacks(uint32_t place = 0) = 0;
    // The last submitted frame's picture of views[0]; waits for it.
    virtual Result<Picture> read_picture() = 0;

    virtual uint64_t allocated_bytes() const = 0;  // device memory held, all kinds
    // Gives back what of it is kept for what may come; waits for every submitted frame.
    virtual Result<void> trim() = 0;
    // Whether the device is lost: nothing draws on it any more, and a new renderer is to be made. Waits for the device.
    virtual bool lost() const = 0;
    // Of that, what buffers of the place's recipes take, with those replaced that frames under way read.
    virtual uint64_t buffer_bytes(uint32_t place = 0) const = 0;
    // Everything the validation layers said so far; empty when they are silent or off.
    virtual std::vector<std::string> validation_messages() const = 0;

    // For window.h alone.
    virtual RendererAccess access() = 0;
};

}  // namespace lodestone
