#include "apps/options/probed_cache.h"

#include <filesystem>
#include <fstream>

#include "apps/options/common_options.h"
#include "apps/scene/workplace.h"
#include "base/json.h"

namespace lodestone {

namespace {
std::filesystem::path probe_file() { return cache_folder() / "probe.json"; }
}  // namespace

Result<void> remember_probe(const ProbedCache& probed) {
    std::error_code error;
    std::filesystem::create_directories(cache_folder(), error);
    const Json json = {{"device", probed.device}, {"driver", probed.driver}, {"cache", name_of(probed.model)}};
    return write_json(probe_file().string(), json.dump(2));
}

std::optional<ProbedCache> remembered_probe() {
    std::ifstream in(probe_file());
    if (!in) return std::nullopt;
    const Json json = Json::parse(in, nullptr, false);
    if (!json.is_object()) return std::nullopt;
    const auto model = cache_model_named(json.value("cache", ""));
    if (!model) return std::nullopt;
    return ProbedCache{json.value("device", ""), json.value("driver", ""), *model};
}

Result<CacheModel> auto_cache_model() {
    if (const auto probed = remembered_probe()) return probed->model;
    return cache_model_named("nvidia");
}

}  // namespace lodestone
