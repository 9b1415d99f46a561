#include "vgi/bake/charts/refinement.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "base/check.h"
#include "vgi/bake/charts/clusters.h"

namespace lodestone::vgi {

namespace {

// Of clusters, where a chart was stretched too much: times as many are wanted. Where hardly any were wanted, and there
// are as few as the topology allows, so many. Of either more the more it was stretched.
constexpr double denser = 3, few_wanted = 0.5, least_wanted = 1.5 * ClusterOptions::most_wanted;
double times_more(double stretch, double bound) { return std::clamp(std::sqrt(stretch / bound), 1.0, 8.0); }

// A round was in vain where it left more than this share of what was bad. It is given up at once, or, where less than
// one cluster in few_bad is bad, at the fourth time: then a round is soon over.
constexpr double still_bad = 0.8;
constexpr size_t few_bad = 16, patience = 3;

// Little: so much of the surface, its stretch counted in orders of magnitude. Slightly: so many times more than it may
// be.
constexpr double little = 0.003, slightly = 3;

// Clusters that rounds may lead to: so many times those wanted, or so many times those there had to be, and some; or
// one for so many triangles.
constexpr uint32_t of_wanted = 8, of_first = 4, few_clusters = 256, few_triangles = 512;
// Once there are as many, only what is stretched so many times more than it may be is cut finer, so often, and a round
// adds this share at most.
constexpr double hopeless = 10, added_then = 0.125;
constexpr uint32_t most_full = 2;
// Of clusters that are wanted where bad ones are cut finer about so many times fewer come about.
constexpr double seldom_made = 2;
// Cuts make a few triangles of each that is given, but hundreds of a needle. Rounds end when all of them have made so
// many of each triangle of the source, and so many at all.
constexpr size_t most_cut_of_each = 64, most_cut_of_any = 2000000;

}  // namespace

double RoundQuality::cost(double area, double stretch, double bound) {
    return stretch > bound ? area * (1 + std::log(stretch / bound)) : 0;
}

Refinement::Refinement(uint32_t clusters, double bound, size_t triangles, uint32_t most_rounds)
    : wanted_(clusters), bound_(bound), triangles_(triangles), most_rounds_(most_rounds) {
    LODE_CHECK(most_rounds > 0);
}

void Refinement::begin(uint32_t clusters) {
    ++rounds_;
    clusters_ = clusters;
    if (rounds_ == 1)
        most_clusters_ = std::max(std::max(of_wanted * wanted_, of_first * clusters) + few_clusters,
                                  static_cast<uint32_t>(triangles_ / few_triangles));
    if (clusters >= most_clusters_ && full_++ == 0) cost_ = std::numeric_limits<double>::infinity();
}

void Refinement::cut(size_t triangles) { cut_triangles_ += triangles; }

bool Refinement::is_last() const {
    return rounds_ >= most_rounds_ || full_ > most_full ||
           cut_triangles_ > std::max(most_cut_of_any, most_cut_of_each * triangles_);
}

double Refinement::bound() const { return full_ > 0 ? hopeless * bound_ : bound_; }

bool Refinement::improves(double cost, const RoundQuality& quality) {
    const auto bad = static_cast<size_t>(std::ranges::count(quality.bad, true));
    if (cost > still_bad * cost_) ++in_vain_;
    cost_ = cost;
    return in_vain_ <= (bad * few_bad < quality.bad.size() ? patience : 0);
}

bool Refinement::leaves_little(double cost, const RoundQuality& quality) const {
    return cost <= little && std::ranges::max(quality.stretch) <= slightly * bound();
}

std::vector<double> Refinement::times_denser(const RoundQuality& quality, std::span<const double> wanted) const {
    std::vector<uint32_t> order;
    for (uint32_t c = 0; c < quality.bad.size(); ++c) {
        if (quality.bad[c]) order.push_back(c);
    }
    const auto urgency = [&](uint32_t c) {  // what could not be made comes first
        return quality.stretch[c] > bound() ? quality.stretch[c] : std::numeric_limits<double>::infinity();
    };
    std::ranges::stable_sort(order, std::greater<>(), urgency);
    std::vector<double> times(quality.bad.size(), 1);
    double room = std::max(seldom_made * most_clusters_ - clusters_, added_then * clusters_);
    for (const uint32_t c : order) {
        if (room <= 0) break;
        times[c] = (wanted[c] < few_wanted ? least_wanted / std::max(wanted[c], 1e-9) : denser) *
                   times_more(quality.stretch[c], bound_);
        room -= std::max(1.0, wanted[c] * times[c]) - 1;
    }
    return times;
}

}  // namespace lodestone::vgi
