// What the handles of the C interface are, and how its functions end.
#pragma once

#include <atomic>
#include <exception>
#include <functional>
#include <new>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "apps/c/lodestone.h"
#include "apps/embed/arrays.h"
#include "apps/embed/bake.h"
#include "apps/embed/cutter.h"
#include "apps/scene/asset.h"
#include "base/progress.h"
#include "base/result.h"

struct lodestone_mesh {
    lodestone::NamedMesh named;
    std::vector<glm::vec3> room;  // of positions of wedges, where there are seams
    lodestone_arrays arrays{};    // all but struct_size
    std::vector<lodestone_material> table;
    std::vector<lodestone_image> images;
};

struct lodestone_asset {
    lodestone::Asset asset;
    std::string about;
    std::vector<lodestone_material> table;
    std::vector<lodestone_image> images;
};

struct lodestone_cutter {
    std::unique_ptr<lodestone::Cutter> cutter;
};

struct lodestone_cancel {
    std::atomic<bool> set{false};
};

namespace lodestone::c {

// Keeps the message for lodestone_error(). Never throws.
lodestone_status failed(const Error& error) noexcept;
// The same of an argument: "function: what is wrong".
lodestone_status refused(const char* function, const char* what) noexcept;
// Of the exception that is being handled.
lodestone_status thrown() noexcept;

// The status of work() -> Result<void>; what it throws becomes a status.
template <class Work>
lodestone_status status_of(Work&& work) noexcept {
    try {
        const Result<void> done = work();
        return done ? LODESTONE_OK : failed(done.error());
    } catch (...) { return thrown(); }
}

// Copies to a struct of the caller, who may know fewer members. size: at least that of the first version.
template <class Struct>
void fill(Struct* into, Struct filled) {
    filled.struct_size = into->struct_size;
    std::copy_n(reinterpret_cast<const char*>(&filled), std::min(into->struct_size, sizeof filled),
                reinterpret_cast<char*>(into));
}
// The members that the caller knows; the others as in an empty struct.
template <class Struct>
Struct taken(const Struct* from) {
    Struct all{};
    std::copy_n(reinterpret_cast<const char*>(from), std::min(from->struct_size, sizeof all),
                reinterpret_cast<char*>(&all));
    return all;
}
// Whether a struct's struct_size can be that of any version.
template <class Struct>
bool is_sized(const Struct* given) {
    return given != nullptr && given->struct_size >= sizeof(Struct) && given->struct_size <= 65536;
}

// What is wrong with the caller's progress; null where nothing is. given: may be null.
const char* fault_of(const lodestone_progress* given);
// given: null, or without fault. stop: set where the caller cancels, for callers without a flag of their own.
Progress progress_of(const lodestone_progress* given, std::atomic<bool>& stop);

// A handle of a mesh, whole.
lodestone_mesh* handle_of(NamedMesh named);
// The same of an asset.
lodestone_asset* handle_of(Asset asset);
// Materials and images as C has them; they refer to those given.
void describe_looks(const std::vector<Material>& table, const std::vector<Image>& images,
                    std::vector<lodestone_material>& c_table, std::vector<lodestone_image>& c_images);

}  // namespace lodestone::c
