#include "apps/scene/scene_node.h"

#include <algorithm>
#include <cmath>

#include "base/random.h"

namespace lodestone {

Result<void> only_members(const Node& node, const std::set<std::string>& known) {
    if (!node.json.is_object()) return node.wrong("must be an object; see docs/scenes.md");
    for (const auto& [key, value] : node.json.items()) {
        if (known.count(key) > 0) continue;
        std::string choices;
        for (const std::string& k : known) choices += (choices.empty() ? "" : ", ") + k;
        return node.wrong("has no member '" + key + "'; known are " + choices);
    }
    return {};
}

Result<void> number(const Node& node, const char* key, float& into, float low, float high) {
    const auto found = node.json.find(key);
    if (found == node.json.end()) return {};
    if (!found->is_number() || found->get<double>() < static_cast<double>(low) ||
        found->get<double>() > static_cast<double>(high)) {
        return node.wrong(std::string(key) + " must be a number from " + std::to_string(low) + " to " +
                          std::to_string(high));
    }
    into = found->get<float>();
    return {};
}

Result<void> whole(const Node& node, const char* key, uint64_t& into, uint64_t low, uint64_t high) {
    const auto found = node.json.find(key);
    if (found == node.json.end()) return {};
    if (!found->is_number_unsigned() || found->get<uint64_t>() < low || found->get<uint64_t>() > high) {
        return node.wrong(std::string(key) + " must be a whole number from " + std::to_string(low) + " to " +
                          std::to_string(high));
    }
    into = found->get<uint64_t>();
    return {};
}

Result<void> vector(const Node& node, const char* key, glm::vec3& into, bool required) {
    const auto found = node.json.find(key);
    if (found == node.json.end()) return required ? node.wrong(std::string(key) + " is missing") : Result<void>{};
    if (!found->is_array() || found->size() != 3) return node.wrong(std::string(key) + " must be three numbers");
    for (size_t k = 0; k < 3; ++k) {
        if (!(*found)[k].is_number() || !std::isfinite((*found)[k].get<float>()))
            return node.wrong(std::string(key) + " must be three numbers");
        into[static_cast<int>(k)] = (*found)[k].get<float>();
    }
    return {};
}

Result<void> text(const Node& node, const char* key, std::string& into) {
    const auto found = node.json.find(key);
    if (found == node.json.end()) return {};
    if (!found->is_string()) return node.wrong(std::string(key) + " must be a string");
    into = found->get<std::string>();
    return {};
}

Result<void> pair(const Node& node, const char* key, glm::vec2& into, bool required) {
    const auto found = node.json.find(key);
    if (found == node.json.end()) return required ? node.wrong(std::string(key) + " is missing") : Result<void>{};
    if (!found->is_array() || found->size() != 2) return node.wrong(std::string(key) + " must be two numbers above 0");
    for (size_t k = 0; k < 2; ++k) {
        if (!(*found)[k].is_number() || !((*found)[k].get<float>() > 0) || !std::isfinite((*found)[k].get<float>()))
            return node.wrong(std::string(key) + " must be two numbers above 0");
        into[static_cast<int>(k)] = (*found)[k].get<float>();
    }
    return {};
}

// Cells about as wide as deep.
ScatteredPlaces::ScatteredPlaces(uint64_t count, const glm::vec2& area)
    : columns_(static_cast<uint64_t>(
          std::max(1.0, std::ceil(std::sqrt(static_cast<double>(count) * static_cast<double>(area.x / area.y)))))),
      rows_((count + columns_ - 1) / columns_),
      area_(area) {}

glm::vec3 ScatteredPlaces::place(uint64_t number, Random& random) const {
    const auto within = [&](uint64_t cell, uint64_t cells, float length) {
        return length * (static_cast<float>((static_cast<double>(cell) + 0.2 + 0.6 * random.unit()) /
                                            static_cast<double>(cells)) -
                         0.5f);
    };
    const float x = within(number % columns_, columns_, area_.x), z = within(number / columns_, rows_, area_.y);
    return {x, 0, z};
}

}  // namespace lodestone
