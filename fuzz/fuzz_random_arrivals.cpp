// Random arrivals through the owner of pages: answers that come late, twice, wrong, cut or not at all, while the camera
// jumps and the pools are small. What the backend keeps is valid after every frame, and every plan can be carried out.
#include <map>

#include "frame/plan_mirror.h"
#include "fuzz/atlas_file.h"
#include "fuzz/random_mesh.h"
#include "fuzz/watch.h"
#include "mesh/generate.h"
#include "mesh/repair.h"
#include "vgi/bake/bake.h"
#include "vgi/draw/vgi_source.h"

using namespace lodestone;
using namespace lodestone::fuzz;

namespace {

std::shared_ptr<const vgi::AtlasFile> small_atlas() {
    TriMesh mesh = generate(Shape::rock, 2000, 1);
    require_good(repair(mesh), "a rock is repaired");
    vgi::AtlasOptions options;
    options.clusters.clusters = 4;
    options.error_samples = 500;
    vgi::AtlasReport report;
    const auto atlas = vgi::make_atlas(mesh, options, report);
    require_good(atlas, "a rock becomes an atlas");
    auto opened = vgi::AtlasFile::open(in_a_file(*atlas));
    require_good(opened, "an atlas is opened");
    return std::make_shared<const vgi::AtlasFile>(std::move(*opened));
}

// An answer to a request, right or not.
Blob answer(const vgi::AtlasFile& file, const PageRequest& request, FuzzedDataProvider& from) {
    const int kind = from.ConsumeIntegralInRange<int>(0, 11);
    if (kind == 0) return {};
    std::vector<std::byte> bytes(request.bytes);
    require_good(file.file().read_part(request.chunk, request.offset, bytes), "a part of a file is read");
    if (kind == 1 && !bytes.empty()) bytes[from.ConsumeIntegralInRange<size_t>(0, bytes.size() - 1)] ^= std::byte{1};
    if (kind == 2) bytes.resize(from.ConsumeIntegralInRange<size_t>(0, bytes.size()));
    if (kind == 3) bytes.resize(bytes.size() + from.ConsumeIntegralInRange<size_t>(1, 9));
    return Blob(std::move(bytes));
}

std::vector<Arrival> random_arrivals(const vgi::AtlasFile& file, std::map<uint64_t, PageRequest>& waiting,
                                     FuzzedDataProvider& from) {
    std::vector<Arrival> arrivals;
    for (auto count = from.ConsumeIntegralInRange<int>(0, 8); count > 0; --count) {
        const int kind = from.ConsumeIntegralInRange<int>(0, 9);
        if (kind == 0) {  // nobody asked for it
            arrivals.push_back({from.ConsumeIntegral<uint64_t>(), Blob(std::vector<std::byte>(16))});
        } else if (kind == 1 && !arrivals.empty()) {  // twice
            arrivals.push_back(arrivals[from.ConsumeIntegralInRange<size_t>(0, arrivals.size() - 1)]);
        } else if (!waiting.empty()) {
            const auto at =
                std::next(waiting.begin(), from.ConsumeIntegralInRange<long>(0, static_cast<long>(waiting.size()) - 1));
            arrivals.push_back({at->first, answer(file, at->second, from)});
            waiting.erase(at);
        }
    }
    return arrivals;
}

View random_view(FuzzedDataProvider& from) {
    Camera camera;
    const auto at = [&] { return static_cast<float>(from.ConsumeIntegralInRange<int>(-40, 40)) / 10; };
    camera.eye = {at(), at(), at()};
    camera.near_plane = 0.05f;
    return view_of(camera, 320, 200);
}

size_t bytes_of(const Recipe& recipe) {
    size_t bytes = 0;
    for (const BufferSpec& buffer : recipe.buffers) bytes += buffer.bytes;
    return bytes;
}

// Returns what counts for up to 24 frames: the bytes of what arrives, and of buffers as they are in the end.
size_t check_frames(const std::shared_ptr<const vgi::AtlasFile>& file, FuzzedDataProvider& from) {
    const uint64_t budget = (uint64_t{1} << 20) + from.ConsumeIntegralInRange<uint64_t>(0, uint64_t{16} << 20);
    auto opened = vgi::open_vgi({file}, {budget, 2});
    if (!opened) return 0;  // too little for the coarsest pages
    FrameSource& source = **opened;
    size_t bytes = 0;
    PlanMirror mirror(source.recipe());
    std::map<uint64_t, PageRequest> waiting;
    FrameInput input;
    input.views = {random_view(from)};
    input.instances.resize(1);
    for (auto frames = from.ConsumeIntegralInRange<uint64_t>(1, 24); frames > 0; --frames) {
        if (from.ConsumeBool()) input.views = {random_view(from)};
        if (from.ConsumeIntegralInRange<int>(0, 7) == 0)
            input.instances.resize(from.ConsumeIntegralInRange<size_t>(1, 2));
        input.budget.pixel_error = from.ConsumeIntegralInRange<int>(1, 40) / 8.0;
        input.budget.upload_bytes = uint64_t{1} << from.ConsumeIntegralInRange<int>(10, 30);
        input.arrivals = random_arrivals(*file, waiting, from);
        for (const Arrival& arrival : input.arrivals) bytes += arrival.blob.size();
        const Plan plan = source.plan(input);
        require_good(mirror.execute(plan, input), "a plan can be carried out");
        require_good(source.validate(), "what is known of pages is valid");
        for (const PageRequest& request : plan.requests)
            require(waiting.emplace(request.id, request).second, "no two requests have one number");
        ++input.frame;
        const uint64_t late = from.ConsumeIntegralInRange<uint64_t>(0, 3);
        input.completed_frame = std::max(input.completed_frame, input.frame - std::min(input.frame, late));
    }
    return bytes + bytes_of(mirror.recipe());
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    static const auto file = small_atlas();
    FuzzedDataProvider from(data, size);
    const Watch watch;
    watch.check(size + check_frames(file, from));
    return 0;
}
