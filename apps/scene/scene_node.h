// What reading a scene's JSON is made of: places that know their names, and members of one kind each.
#pragma once

#include <cstdint>
#include <filesystem>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <set>
#include <string>

#include "base/json.h"
#include "base/result.h"
#include "base/text.h"

namespace lodestone {

// A place in a JSON document that knows its name, so that every error can say where it is.
struct Node {
    const Json& json;
    std::string place;

    tl::unexpected<Error> wrong(const std::string& what) const {
        return fail(Fault::format, place + ": " + printable(what));
    }
};

// Where a scene's files are looked for.
struct Beside {
    std::filesystem::path scene;
    bool allow_outside = false;
};

// Fault::format unless it is an object with members of these alone.
Result<void> only_members(const Node& node, const std::set<std::string>& known);

// Each reads an optional member into `into`; a wrong type or value is an error.
Result<void> number(const Node& node, const char* key, float& into, float low, float high);
Result<void> whole(const Node& node, const char* key, uint64_t& into, uint64_t low, uint64_t high);
Result<void> vector(const Node& node, const char* key, glm::vec3& into, bool required = false);
Result<void> text(const Node& node, const char* key, std::string& into);
// Two numbers above 0.
Result<void> pair(const Node& node, const char* key, glm::vec2& into, bool required);

// Runs steps until one fails.
template <class... Steps>
Result<void> all(Steps&&... steps) {
    Result<void> done;
    ((done = done ? steps() : done), ...);
    return done;
}

// Places on the ground, one in each of `count` cells of a grid over the area (x by z, around the origin), away from its
// edges. Numbers are drawn from `random`, two a place.
class ScatteredPlaces {
public:
    ScatteredPlaces(uint64_t count, const glm::vec2& area);
    glm::vec3 place(uint64_t number, class Random& random) const;

private:
    uint64_t columns_, rows_;
    glm::vec2 area_;
};

}  // namespace lodestone
