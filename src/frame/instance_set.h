// The instances of a scene as a value that frames share: it is handed on without being copied, and tells what has
// changed since the set before.
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <glm/mat4x4.hpp>
#include <initializer_list>
#include <iterator>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "base/structures/former_holders.h"

namespace lodestone {

// An asset as it stands in the scene.
struct Instance {
    uint32_t asset = 0;            // into the assets given to open()
    uint32_t first_material = 0;   // added to the material numbers of the asset's vertices
    glm::mat4 object_to_world{1};  // affine, any non-zero scale
    bool operator==(const Instance&) const = default;
};

// Copies share one set. Writing through one handle never changes what another sees, and copies no more than the blocks
// written to.
class InstanceSet {
public:
    // Goes through a set, which must stay where it is. What it shows is constant; edit() changes.
    class Iterator {
    public:
        using value_type = Instance;             // what it shows
        using difference_type = std::ptrdiff_t;  // instances between two
        Iterator() = default;
        Iterator(const InstanceSet* set, size_t at) : set_(set), at_(at) {}  // at: number of an instance, or size()
        const Instance& operator*() const { return (*set_)[at_]; }           // valid until the set is changed
        const Instance* operator->() const { return &(*set_)[at_]; }         // likewise
        // To the next.
        Iterator& operator++() {
            ++at_;
            return *this;
        }
        // To the next; returns where it was.
        Iterator operator++(int) { return {set_, at_++}; }
        bool operator==(const Iterator&) const = default;

    private:
        const InstanceSet* set_ = nullptr;
        size_t at_ = 0;
    };

    InstanceSet() : state_(std::make_shared<State>()) {}
    // A set of these.
    InstanceSet(std::span<const Instance> instances) : InstanceSet() {
        resize(instances.size());
        for (size_t i = 0; i < instances.size(); ++i) slot(i) = instances[i];
    }
    // A set of these.
    InstanceSet(const std::vector<Instance>& instances) : InstanceSet(std::span(instances)) {}
    // A set of these.
    InstanceSet(std::initializer_list<Instance> instances) : InstanceSet(std::span(instances)) {}

    size_t size() const { return state_->size; }     // how many there are
    bool empty() const { return size() == 0; }       // whether there are none
    Iterator begin() const { return {this, 0}; }     // at the first
    Iterator end() const { return {this, size()}; }  // behind the last
    // i: below size().
    const Instance& operator[](size_t i) const { return (*state_->blocks[i / block_size])[i % block_size]; }

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

    // The instance, to be changed. What another handle shares, or has been told the generation of, stays as it is.
    Instance& edit(size_t i) {
        own(true);
        state_->changed.push_back(static_cast<uint32_t>(i));
        return slot(i);
    }
    // Drops the last instances or adds default ones.
    void resize(size_t count) {
        own(false);
        const size_t before = state_->size;
        state_->size = count;
        state_->blocks.resize((count + block_size - 1) / block_size);
        for (size_t b = (before + block_size - 1) / block_size; b < state_->blocks.size(); ++b)
            state_->blocks[b] = std::make_shared<Block>();
        // What a smaller set left in its last block is not seen again.
        for (size_t i = before; i < std::min(count, (before + block_size - 1) / block_size * block_size); ++i)
            slot(i) = Instance{};
    }
    // Adds one at the end.
    void push_back(const Instance& instance) {
        resize(size() + 1);
        slot(size() - 1) = instance;
    }
    // Makes it a set of so many equal instances.
    void assign(size_t count, const Instance& instance) { *this = std::vector<Instance>(count, instance); }

    bool operator==(const InstanceSet& other) const {
        return state_ == other.state_ ||
               (size() == other.size() && std::equal(begin(), end(), other.begin(), other.end()));
    }

private:
    static constexpr size_t block_size = 16;
    using Block = std::array<Instance, block_size>;
    struct State {
        std::vector<std::shared_ptr<Block>> blocks;  // shared by the states before and after
        size_t size = 0;
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
        fresh->blocks = state_->blocks;
        fresh->size = state_->size;
        if (counted) fresh->base = state_->generation;
        state_ = std::move(fresh);
    }
    // The instance in a block of this state alone.
    Instance& slot(size_t i) {
        std::shared_ptr<Block>& block = state_->blocks[i / block_size];
        if (block.use_count() > 1) block = std::make_shared<Block>(*block);
        synchronise_with_former_holders(block);
        return (*block)[i % block_size];
    }
    std::shared_ptr<State> state_;
};

}  // namespace lodestone
