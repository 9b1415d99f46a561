#include "apps/embed/cutter.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <glm/matrix.hpp>

#include "lod/asset/vertex_places.h"
#include "lod/draw/lod_source.h"
#include "mesh/packed_vertices.h"
#include "vgi/draw/pulled_vertex.h"
#include "vgi/draw/vgi_source.h"

namespace lodestone {

namespace {

constexpr uint32_t most_frames = 4096;  // until a cut is settled
// Frames that only put pages in the place of others, after which it is taken that the budget never holds all.
constexpr uint32_t most_swaps = 128;

tl::unexpected<Error> wrong_view(const std::string& what) { return fail(Fault::usage, "view: " + what); }

bool is_finite(const glm::vec3& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

Result<void> check_transform(const glm::mat4& m) {
    for (int c = 0; c < 4; ++c) {
        for (int r = 0; r < 4; ++r) {
            if (!std::isfinite(m[c][r])) return wrong_view("object_to_world has a number that is not finite");
        }
        if (m[c][3] != (c == 3 ? 1.0f : 0.0f))
            return wrong_view("object_to_world is not affine: its last row must be 0 0 0 1");
    }
    const double volume = std::abs(glm::determinant(glm::dmat3(glm::mat3(m))));
    if (!(volume > 1e-30 && volume < 1e30))
        return wrong_view("object_to_world flattens the object, or is out of range");
    return {};
}

uint64_t pages_evicted(const PlanStats& stats) {
    for (const auto& [name, value] : stats.more) {
        if (name == "pages_evicted") return static_cast<uint64_t>(value);
    }
    return 0;
}

CutVertex unpacked(const MeshVertex& packed) {
    CutVertex vertex{};
    const glm::vec3 normal = unpack_normal({packed.normal[0], packed.normal[1]});
    std::memcpy(vertex.position, packed.position, sizeof vertex.position);
    std::memcpy(vertex.normal, &normal, sizeof vertex.normal);
    std::memcpy(vertex.uv, packed.uv, sizeof vertex.uv);
    std::memcpy(vertex.colour, packed.colour, sizeof vertex.colour);
    vertex.material = packed.material;
    return vertex;
}

Result<std::unique_ptr<FrameSource>> open_source(const Asset& asset, const std::string& backend, uint64_t bytes) {
    if (backend == "lod") {
        if (asset.lod == nullptr)
            return fail(Fault::format,
                        asset.file.path().string() + ": holds no progressive mesh; bake it with --backends lod");
        LodOptions options;
        options.resident_bytes = bytes;
        return open_lod({asset.lod}, options);
    }
    if (asset.atlas_file == nullptr)
        return fail(Fault::format, asset.file.path().string() + ": holds no atlas; bake it with --backends vgi");
    vgi::VgiOptions options;
    options.resident_bytes = bytes;
    return vgi::open_vgi({asset.atlas_file}, options);
}

}  // namespace

Result<void> check_view(const CutView& view) {
    const Camera& c = view.camera;
    constexpr float far_away = 1e15f;
    for (const auto& [name, v] : {std::pair("eye", c.eye), std::pair("target", c.target), std::pair("up", c.up)}) {
        if (!is_finite(v) || glm::length(v) > far_away)
            return wrong_view(std::string(name) + " is not finite, or farther away than 1e15");
    }
    if (!(glm::length(c.target - c.eye) > 0))
        return wrong_view("eye and target are one point, so there is no direction");
    if (!(glm::length(c.up) > 0)) return wrong_view("up has no length");
    if (!(c.fov_y >= 0.001f && c.fov_y <= 3.14f)) return wrong_view("fov_y must be 0.001 .. 3.14 radians");
    if (!(c.near_plane > 0 && c.far_plane > c.near_plane && c.far_plane <= far_away && c.near_plane >= 1e-15f))
        return wrong_view("near_plane and far_plane must be 1e-15 <= near < far <= 1e15");
    if (view.width < 1 || view.width > 16384 || view.height < 1 || view.height > 16384)
        return wrong_view("width and height must be 1 .. 16384 pixels");
    if (!(view.pixel_error >= 1e-6 && view.pixel_error <= 1e6)) return wrong_view("pixel_error must be 1e-6 .. 1e6");
    return check_transform(view.object_to_world);
}

Cutter::Cutter(std::string backend, std::unique_ptr<FrameSource> source, const ChunkFile& file,
               std::shared_ptr<const ProgressiveMesh> lod)
    : backend_(std::move(backend)),
      source_(std::move(source)),
      mirror_(source_->recipe(), {vgi::pulled_vertex, {}}),
      reader_({file}),
      lod_(std::move(lod)) {}

Result<std::unique_ptr<Cutter>> Cutter::open(const Asset& asset, const std::string& backend, uint64_t resident_bytes) {
    auto source = open_source(asset, backend, resident_bytes);
    if (!source) return tl::unexpected(source.error());
    return std::unique_ptr<Cutter>(
        new Cutter(backend, std::move(*source), asset.file, backend == "lod" ? asset.lod : nullptr));
}

Result<PlanStats> Cutter::draw_frame(const CutView& view) {
    input_ = {};
    input_.views = {view_of(view.camera, view.width, view.height)};
    input_.views[0].culls_back_faces = view.culls_back_faces;
    input_.instances = {Instance{0, 0, view.object_to_world}};
    input_.budget.pixel_error = view.pixel_error;
    if (view.max_triangles > 0) input_.budget.max_triangles = view.max_triangles;
    if (view.wait) input_.budget.page_requests = Budget::page_requests_waiting;
    input_.arrivals = reader_.arrivals();
    input_.frame = input_.completed_frame = next_frame_++;
    const Plan plan = source_->plan(input_);
    outstanding_ = !plan.requests.empty() || !input_.arrivals.empty();
    reader_.request(plan.requests);
    if (auto done = mirror_.execute(plan, input_); !done) return tl::unexpected(done.error());
    return plan.stats;
}

// The same frame until all pages have come, as long as it makes sense.
Result<PlanStats> Cutter::settle(const CutView& view) {
    uint32_t swaps = 0;
    bool late = false;  // the frame before was not yet whole
    for (uint32_t frames = most_frames;; --frames) {
        auto stats = draw_frame(view);
        if (!stats || !view.wait || frames == 1) return stats;
        if (pages_evicted(*stats) > 0 && ++swaps == most_swaps) return stats;
        reader_.wait();
        // What arrived with this frame is decoded by the next, and shown by it.
        if (!outstanding_ && !late) return stats;
        late = outstanding_;
    }
}

void Cutter::gather_lod(const PlanMirror::MirroredDraw& draw) {
    if (version_ == 0) {
        const std::vector<uint32_t> places = vertex_places(*lod_, 0);  // the order that was opened
        vertices_.resize(places.size());
        for (size_t w = 0; w < places.size(); ++w) vertices_[places[w]] = unpacked(lod_->vertices[w]);
        version_ = 1;
    }
    for (size_t i = 0; i + 2 < draw.indices.size(); i += 3) {
        const uint32_t a = draw.indices[i], b = draw.indices[i + 1], c = draw.indices[i + 2];
        if (a != b && b != c && c != a) indices_.insert(indices_.end(), {a, b, c});
    }
}

void Cutter::gather_vgi(const PlanMirror::MirroredDraw& draw) {
    const size_t first = indices_.size();
    for (size_t i = 0; i + 2 < draw.indices.size(); i += 3) {
        const uint32_t a = draw.indices[i], b = draw.indices[i + 1], c = draw.indices[i + 2];
        if (a != b && b != c && c != a) indices_.insert(indices_.end(), {a, b, c});
    }
    pulled_.assign(indices_.begin() + static_cast<ptrdiff_t>(first), indices_.end());
    std::ranges::sort(pulled_);
    pulled_.erase(std::unique(pulled_.begin(), pulled_.end()), pulled_.end());
    const auto base = static_cast<uint32_t>(vertices_.size());
    for (size_t i = first; i < indices_.size(); ++i)
        indices_[i] = base + static_cast<uint32_t>(std::ranges::lower_bound(pulled_, indices_[i]) - pulled_.begin());
    for (const uint32_t index : pulled_) {
        const glm::vec3 position = vgi::pulled_vertex(mirror_, draw.draw, input_, 0, index);
        const vgi::PulledAttributes looks = vgi::pulled_attributes(mirror_, draw.draw, input_, 0, index);
        CutVertex vertex{};
        std::memcpy(vertex.position, &position, sizeof vertex.position);
        std::memcpy(vertex.normal, &looks.normal, sizeof vertex.normal);
        std::memcpy(vertex.uv, &looks.uv, sizeof vertex.uv);
        std::memcpy(vertex.colour, &looks.colour, sizeof vertex.colour);
        vertex.material = looks.material;
        vertices_.push_back(vertex);
    }
}

void Cutter::gather(Cut& cut) {
    indices_.clear();
    if (lod_ == nullptr) {
        vertices_.clear();
        ++version_;
    }
    for (const PlanMirror::MirroredDraw& draw : mirror_.draws()) {
        if (!mirror_.is_shown(draw)) continue;
        if (lod_ == nullptr) {
            gather_vgi(draw);
        } else {
            cut.level = draw.draw.words[0];
            gather_lod(draw);
        }
    }
    cut.vertices = vertices_;
    cut.indices = indices_;
    cut.vertices_version = version_;
}

Result<Cut> Cutter::cut(const CutView& view) {
    if (auto good = check_view(view); !good) return tl::unexpected(good.error());
    if (broken_) return fail(Fault::invariant, "the cutter failed before; make another");
    broken_ = true;
    const auto stats = settle(view);
    if (!stats) return tl::unexpected(stats.error());
    Cut cut;
    gather(cut);
    cut.pixel_error = view.pixel_error;
    for (const auto& [name, value] : stats->more) {
        if (name == "raised_error") cut.pixel_error *= std::max(1.0, value);
    }
    cut.resident_bytes = stats->resident_bytes;
    cut.settled = !outstanding_;
    broken_ = false;
    return cut;
}

}  // namespace lodestone
