// JSON, by the one name it has here. Who includes it links nlohmann_json.
#pragma once

#include <cmath>
#include <concepts>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>

namespace lodestone {

// Converts values as nlohmann's own does, except for whole numbers, which it casts whatever they are: 5e23 and 3.5, -1
// and true. Here such a value is a Json::out_of_range or a Json::type_error where T does not hold it.
template <class T, class = void>
struct JsonSerializer : nlohmann::adl_serializer<T> {};

template <std::integral T>
requires(!std::same_as<T, bool>) struct JsonSerializer<T> {
    template <class J>
    static void to_json(J& json, T value) {
        nlohmann::to_json(json, value);
    }
    template <class J>
    static void from_json(const J& json, T& value) {
        if (json.is_number_unsigned()) {
            value = fitting(json, *json.template get_ptr<const typename J::number_unsigned_t*>());
        } else if (json.is_number_integer()) {
            value = fitting(json, *json.template get_ptr<const typename J::number_integer_t*>());
        } else if (json.is_number_float()) {
            const double number = *json.template get_ptr<const double*>();
            // All whole numbers to 2^53 are doubles, and beyond a double does not tell which one is meant.
            if (!(std::abs(number) <= 9007199254740992.0) || std::trunc(number) != number) refuse(json);
            value = fitting(json, static_cast<int64_t>(number));
        } else {
            throw J::type_error::create(302, std::string("type must be number, but is ") + json.type_name(), &json);
        }
    }

private:
    template <class J>
    [[noreturn]] static void refuse(const J& json) {
        throw J::out_of_range::create(406, json.dump() + " is no whole number in the range that is asked for", &json);
    }
    template <class J>
    static T fitting(const J& json, auto number) {
        if (!std::in_range<T>(number)) refuse(json);
        return static_cast<T>(number);
    }
};

using Json = nlohmann::basic_json<std::map, std::vector, std::string, bool, int64_t, uint64_t, double, std::allocator,
                                  JsonSerializer>;

// In one line. Bytes of texts that are no UTF-8 are replaced.
inline std::string text_of(const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace); }

}  // namespace lodestone
