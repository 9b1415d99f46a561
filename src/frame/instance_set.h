// The instances of a scene as a value that frames share: it is handed on without being copied, and tells what has
// changed since the set before.
#pragma once

#include <atomic>
#include <cstdint>
#include <glm/mat4x4.hpp>
#include <initializer_list>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace lodestone {

// An asset as it stands in the scene.
struct Instance {
    uint32_t asset = 0;            // into the assets given to open()
    uint32_t first_material = 0;   // added to the material numbers of the asset's vertices
    glm::mat4 object_to_world{1};  // affine, any non-zero scale
    bool operator==(const Instance&) const = default;
};

// Copies share one set. Writing through one handle never changes what another sees.
class InstanceSet {
public:
    InstanceSet() : state_(std::make_shared<State>()) {}
    // A set of these.
    InstanceSet(std::vector<Instance> instances) : InstanceSet() { state_->all = std::move(instances); }
    // A set of these.
    InstanceSet(std::initializer_list<Instance> instances) : InstanceSet(std::vector<Instance>(instances)) {}

    size_t size() const { return state_->all.size(); }                     // how many there are
    bool empty() const { return state_->all.empty(); }                     // whether there are none
    const Instance& operator[](size_t i) const { return state_->all[i]; }  // i: below size()
    auto begin() const { return state_->all.cbegin(); }                    // constant; edit() changes
    auto end() const { return state_->all.cend(); }                        // constant, too
    operator std::span<const Instance>() const { return state_->all; }     // valid until the set is changed or goes

    // A number for what the set holds: sets of one generation are equal. Never 0.
    uint64_t generation() const {
        state_->told = true;
        return state_->generation;
    }
    // Numbers of the instances that may differ from the set of that generation, some perhaps twice; nothing where that
    // is not known, or where instances came or went.
    std::optional<std::span<const uint32_t>> changed_since(uint64_t generation) const {
        if (generation == state_->generation) return std::span<const uint32_t>();
        if (generation == state_->base) return std::span<const uint32_t>(state_->changed);
        return std::nullopt;
    }

    // The instance, to be changed. Copies the set if another handle shares it or its generation has been told.
    Instance& edit(size_t i) {
        own(true);
        state_->changed.push_back(static_cast<uint32_t>(i));
        return state_->all[i];
    }
    // Drops the last instances or adds default ones.
    void resize(size_t count) {
        own(false);
        state_->all.resize(count);
    }
    // Adds one at the end.
    void push_back(const Instance& instance) {
        own(false);
        state_->all.push_back(instance);
    }
    // Makes it a set of so many equal instances.
    void assign(size_t count, const Instance& instance) { *this = std::vector<Instance>(count, instance); }

    bool operator==(const InstanceSet& other) const {
        return state_ == other.state_ || state_->all == other.state_->all;
    }

private:
    struct State {
        std::vector<Instance> all;
        uint64_t generation = next_generation();
        uint64_t base = 0;              // the generation that `changed` is since; 0 for none
        std::vector<uint32_t> changed;  // numbers
        std::atomic<bool> told = false;
    };
    static uint64_t next_generation() {
        static std::atomic<uint64_t> last = 0;
        return ++last;
    }
    // counted: all that will change is told.
    void own(bool counted) {
        if (!state_->told && state_.use_count() == 1) {
            if (!counted) state_->base = 0;
            return;
        }
        auto fresh = std::make_shared<State>();
        fresh->all = state_->all;
        if (counted) fresh->base = state_->generation;
        state_ = std::move(fresh);
    }
    std::shared_ptr<State> state_;
};

}  // namespace lodestone
