#include "pinned/pins.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>

namespace lodestone::pins {

namespace {

const char* const path = LODESTONE_SOURCE_DIR "/tests/pinned/hashes.json";

nlohmann::json held() {
    std::ifstream in(path);
    auto all = nlohmann::json::parse(in, nullptr, false);
    return all.is_object()
               ? all
               : nlohmann::json{{"drivers", nlohmann::json::object()}, {"hashes", nlohmann::json::object()}};
}

bool pinning() { return std::getenv("LODESTONE_PIN") != nullptr; }

void write(const nlohmann::json& all) { std::ofstream(path) << all.dump(1) << "\n"; }

}  // namespace

void expect(const std::string& name, const Hash128& hash) {
    nlohmann::json all = held();
    if (pinning()) {
        all["hashes"][name] = hash.hex();
        return write(all);
    }
    EXPECT_EQ(all["hashes"].value(name, "none held"), hash.hex())
        << name << " is not what it was. If that is meant, run this test with LODESTONE_PIN=1 and say why.";
}

std::string processor() {
#ifdef __x86_64__
    if (__builtin_cpu_is("amd")) return "AMD";
    if (__builtin_cpu_is("intel")) return "Intel";
#endif
    return "other";
}

bool taken_with(const std::string& driver) {
    nlohmann::json all = held();
    if (pinning()) {
        all["drivers"][processor()] = driver;
        write(all);
    }
    return all["drivers"].value(processor(), "") == driver;
}

}  // namespace lodestone::pins
