#include "vgi/draw/cut/shared_cuts.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <span>

#include "base/check.h"

namespace lodestone::vgi {

void SharedCut::make(const Cutter& cutter, const Residency& residency, const CutRequest& request, double magnification,
                     PageDemand& demand) {
    LODE_CHECK(request.distance.has_value());
    std::vector<uint32_t> charts(residency.about().charts());
    std::iota(charts.begin(), charts.end(), 0u);
    const Cut cut = cutter.cut(residency, request, charts, demand, kept_);
    LODE_CHECK(cut.parts.size() <= 1, cut.parts.size());
    const auto words = cut.parts.empty() ? std::span<const uint32_t>() : std::span(cut.parts[0].second);
    TrianglesByKind by_kind(words, residency.tree().cells_per_page());
    for (size_t c = 0; c < by_kind.chunks(); ++c) by_kind.look_at(c);
    runs_ = by_kind.runs();
    words_.resize(words.size());
    for (size_t c = 0; c < by_kind.chunks(); ++c) by_kind.copy(c, words_.data());
    touched_ = demand.all_touched();
    asked_.clear();
    for (const uint32_t unit : demand.all_asked()) asked_.emplace_back(unit, demand.wish(unit));
    made_at_ = residency.updates();
    magnification_ = magnification;
}

void SharedCut::add_to(PageDemand& demand, bool seen) const {
    for (const uint32_t unit : touched_) demand.touch(unit);
    for (const auto& [unit, wish] : asked_) demand.ask(unit, wish_for(wish, seen ? 1 : 0));
}

SharedCuts::SharedCuts(const OpenAtlas& atlas)
    : distant_(atlas.topology->corners(), atlas.file->about()),
      least_of_corners_(std::numeric_limits<int32_t>::max()),
      least_of_samples_(DistantCuts::step_from(least_radii * double{atlas.charts.sphere().radius})) {}

void SharedCuts::begin(double magnification) {
    if (magnification == magnification_) return;
    distant_.begin(magnification);
    least_of_corners_ = DistantCuts::step_from(distant_.least());
    magnification_ = magnification;
}

std::optional<SharedCuts::Step> SharedCuts::step_of(double nearest) const {
    if (!(nearest > 0) || !std::isfinite(nearest)) return std::nullopt;
    const int32_t number = DistantCuts::step_within(nearest);
    if (number >= least_of_corners_) return Step{false, number};
    return number >= least_of_samples_ ? std::optional(Step{true, number}) : std::nullopt;
}

CutRequest SharedCuts::request_for(Step step, const View& view, double pixel_error) const {
    CutRequest request;
    request.views = std::span(&view, 1);
    request.pixel_error = pixel_error;
    request.distance = static_cast<float>((1 - DistantCuts::rounded) * nearest(step));
    return request;
}

void SharedCuts::keep(const std::vector<int32_t>& numbers) {
    std::erase_if(near_, [&](const auto& kept) { return !std::ranges::binary_search(numbers, kept.first); });
}

}  // namespace lodestone::vgi
