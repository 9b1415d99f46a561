#include "apps/c/handles.h"

#include <algorithm>
#include <array>
#include <cstring>

#include "base/text.h"
#include "base/threads.h"

namespace lodestone::c {

namespace {

thread_local std::array<char, 4096> t_message{};

void keep(const char* text) noexcept {
    const size_t bytes = std::min(std::strlen(text), t_message.size() - 1);
    std::copy_n(text, bytes, t_message.begin());
    t_message[bytes] = 0;
}

}  // namespace

lodestone_status failed(const Error& error) noexcept {
    try {
        keep(printable(error.message).c_str());
    } catch (...) { keep("out of memory"); }
    return static_cast<lodestone_status>(error.fault);
}

lodestone_status refused(const char* function, const char* what) noexcept {
    try {
        keep((std::string(function) + ": " + what).c_str());
    } catch (...) { keep(what); }
    return LODESTONE_USAGE;
}

lodestone_status thrown() noexcept {
    try {
        throw;
    } catch (const std::bad_alloc&) { keep("out of memory; use a smaller mesh"); } catch (const std::length_error&) {
        keep("out of memory; use a smaller mesh");
    } catch (const std::exception& e) {
        return failed({Fault::machine, std::string("an operation of the system failed: ") + e.what()});
    } catch (...) { keep("an operation failed for a reason that is not known"); }
    return LODESTONE_MACHINE;
}

const char* fault_of(const lodestone_progress* given) {
    return given != nullptr && !is_sized(given) ? "progress->struct_size is not sizeof(lodestone_progress)" : nullptr;
}

Progress progress_of(const lodestone_progress* given, std::atomic<bool>& stop) {
    Progress progress;
    if (given == nullptr) return progress;
    const lodestone_progress told = taken(given);
    std::atomic<bool>& flag = told.cancel != nullptr ? told.cancel->set : stop;
    progress.stop = &flag;
    if (told.report != nullptr) {
        progress.report = [told, &flag](const std::string& stage, double fraction) {
            if (told.report(told.user, stage.c_str(), fraction) != 0) flag = true;
        };
    }
    if (told.warn != nullptr) {
        progress.warn = [told](const std::string& line) { told.warn(told.user, printable(line).c_str()); };
    }
    return progress;
}

void describe_looks(const std::vector<Material>& table, const std::vector<Image>& images,
                    std::vector<lodestone_material>& c_table, std::vector<lodestone_image>& c_images) {
    for (const Material& m : table) {
        c_table.push_back({m.name.c_str(),
                           {m.base_colour.r, m.base_colour.g, m.base_colour.b, m.base_colour.a},
                           m.base_colour_texture.image,
                           m.double_sided ? 1u : 0u});
    }
    for (const Image& image : images)
        c_images.push_back({image.width, image.height, reinterpret_cast<const uint8_t*>(image.texels.data())});
}

namespace {

template <class To, class From>
const To* first_of(const From& values) {
    return values.empty() ? nullptr : reinterpret_cast<const To*>(values.data());
}

}  // namespace

lodestone_mesh* handle_of(NamedMesh named) {
    auto handle = std::make_unique<lodestone_mesh>();
    handle->named = std::move(named);
    const TriMesh& mesh = handle->named.mesh;
    const auto positions = wedge_positions(mesh, handle->room);
    describe_looks(mesh.material_table, mesh.images, handle->table, handle->images);
    lodestone_arrays& arrays = handle->arrays;
    arrays.vertex_count = mesh.wedge_count();
    arrays.triangle_count = mesh.triangle_count();
    arrays.positions = first_of<float>(positions);
    arrays.triangles = first_of<uint32_t>(mesh.triangles);
    arrays.normals = first_of<float>(mesh.normals);
    arrays.uvs = first_of<float>(mesh.uvs);
    arrays.colours = first_of<uint8_t>(mesh.colours);
    arrays.materials = first_of<uint16_t>(mesh.materials);
    arrays.material_table = first_of<lodestone_material>(handle->table);
    arrays.material_count = static_cast<uint32_t>(handle->table.size());
    arrays.images = first_of<lodestone_image>(handle->images);
    arrays.image_count = static_cast<uint32_t>(handle->images.size());
    return handle.release();
}

lodestone_asset* handle_of(Asset asset) {
    auto handle = std::make_unique<lodestone_asset>(lodestone_asset{std::move(asset), {}, {}, {}});
    handle->about = text_of(handle->asset.about);
    describe_looks(handle->asset.material_table(), handle->asset.images(), handle->table, handle->images);
    return handle.release();
}

}  // namespace lodestone::c

const char* lodestone_version(void) { return LODESTONE_VERSION; }

const char* lodestone_error(void) { return lodestone::c::t_message.data(); }

lodestone_status lodestone_set_threads(uint32_t threads) {
    if (threads > 1024) return lodestone::c::refused(__func__, "threads must be 0 .. 1024");
    return lodestone::c::status_of([&] {
        lodestone::set_thread_count(threads);
        return lodestone::Result<void>{};
    });
}

lodestone_cancel* lodestone_cancel_create(void) { return new (std::nothrow) lodestone_cancel; }
void lodestone_cancel_set(lodestone_cancel* cancel) {
    if (cancel != nullptr) cancel->set = true;
}
void lodestone_cancel_free(lodestone_cancel* cancel) { delete cancel; }
