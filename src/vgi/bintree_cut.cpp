#include "vgi/bintree_cut.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <optional>

#include "base/check.h"
#include "base/threads.h"
#include "frame/screen_error.h"
#include "shaders/shared/vgi_texels.h"
#include "vgi/sample_errors.h"
#include "vgi/visibility.h"

namespace lodestone::vgi {

namespace {

constexpr float unseen = 0.25f;  // what a missing page counts where no camera sees it

// Whether a sample is wanted, as a pure function of its texel.
class Wanted {
public:
    Wanted(const CutRequest& request, const Atlas& about) {
        const View& view = request.sets_levels();
        scale_ = largest_scale(request.object_to_world);
        margin_ = request.margin.distance;
        to_world_ = request.object_to_world;
        eye_ = view.eye;
        const auto magnification = static_cast<float>(magnification_of(view, request.pixel_error));
        const ErrorCodes codes(about.extent());
        for (size_t code = 0; code < 256; ++code) {
            errors_[code] = codes.error(static_cast<uint8_t>(code)) * magnification * scale_;
            // A sample without error is wanted by no eye, however near.
            reach_[code] = errors_[code] > 0 ? errors_[code] + request.margin.distance : 0;
            radii_[code] = codes.radius(static_cast<uint8_t>(code)) * scale_;
        }
        // Lattice to world, seen from the eye.
        const glm::dmat4 to_world(request.object_to_world);
        lattice_ = glm::mat3(glm::dmat3(to_world) * about.step);
        offset_ = glm::vec3(glm::dvec3(to_world * glm::dvec4(about.origin, 1)) - glm::dvec3(view.eye));
    }
    bool operator()(const GeometryTexel& t) const {
        const glm::vec3 p = offset_ + lattice_[0] * static_cast<float>(t.x) + lattice_[1] * static_cast<float>(t.y) +
                            lattice_[2] * static_cast<float>(t.z);
        const float reach = reach_[t.error] + radii_[t.radius];
        return reach * reach > glm::dot(p, p);
    }
    // The same of a page whose samples are not there: of the most there can be in it. Returns how many times larger
    // than the pixel error leaving it out would be on screen, at least 1 where a sample may be wanted.
    float excess(const PageBounds& bounds) const {
        const float away = glm::distance(glm::vec3(to_world_ * glm::vec4(bounds.centre, 1)), eye_) -
                           bounds.radius * scale_ - radii_[bounds.sample_radius] - margin_;
        const float error = errors_[bounds.sample_error];
        return error > 0 ? error / std::max(away, 1e-3f * error) : 0;
    }

private:
    std::array<float, 256> errors_, reach_, radii_;
    float scale_, margin_;
    glm::mat4 to_world_;
    glm::vec3 eye_;
    glm::mat3 lattice_;
    glm::vec3 offset_;
};

struct Corner {
    int32_t x, y;
    uint32_t index;
};

class ChartCut {
public:
    using Parts = std::vector<std::pair<uint32_t, std::vector<uint32_t>>>;

    // touched: as PageDemand's, of which only the pages of the charts run here are written.
    ChartCut(const Residency& residency, const Visibility& visibility, const Wanted& wanted, int64_t forced_level,
             std::vector<uint8_t>& touched)
        : residency_(residency),
          visibility_(visibility),
          wanted_(wanted),
          forced_level_(forced_level),
          touched_(touched),
          tree_(residency.tree()),
          n_(static_cast<int32_t>(tree_.cells_per_page())),
          page_shift_(static_cast<uint32_t>(std::countr_zero(tree_.cells_per_page()))),
          base_(tree_.base_level()) {}

    void run(uint32_t chart) {
        first_page_ = residency_.number(chart, 0);
        const uint32_t mask = visibility_.seen(visibility_.all(), first_page_);
        if (mask == 0) return;
        touched_[first_page_] = 1;
        const auto cells = static_cast<int32_t>(tree_.cells);
        const auto corner = [&](int32_t x, int32_t y) {
            const Entry& e = residency_.entry(first_page_);
            return Corner{x * cells, y * cells,
                          e.slot * LODE_VGI_PAGE_TEXELS + static_cast<uint32_t>((y * n_) * (n_ + 1) + x * n_)};
        };
        const Corner a = corner(0, 0), b = corner(1, 0), c = corner(1, 1), d = corner(0, 1);
        const uint32_t depth = Bintree{cells}.depths();
        split(b, c, a, depth, mask);
        split(d, a, c, depth, mask);
    }

    Parts& parts() { return parts_; }
    // Pages asked for, with PageDemand::wanted.
    const std::vector<std::pair<uint32_t, float>>& asked() const { return asked_; }

private:
    using Entry = Residency::Entry;

    // The triangle with its right angle at `apex`, counter-clockwise apex, a, b. depth: of the sample that would split
    // it, plus one.
    void split(const Corner& apex, const Corner& a, const Corner& b, uint32_t depth, uint32_t mask) {
        if (depth > 0) {
            Corner m{(a.x + b.x) / 2, (a.y + b.y) / 2, 0};
            const uint32_t level = (depth - 1) / 2;
            // The centre of a page's square: what is finer lies in the page.
            if (depth % 2 == 0 && level + 1 < base_ + page_shift_ && level + 1 >= page_shift_) {
                const uint32_t page_level = level + 1 - page_shift_;
                mask = visibility_.seen(mask,
                                        first_page_ + tree_.page(page_level, static_cast<uint32_t>(m.x) >> (level + 1),
                                                                 static_cast<uint32_t>(m.y) >> (level + 1)));
                if (mask == 0) return;
            }
            if (take(m, level, mask)) {
                split(m, apex, a, depth - 1, mask);
                split(m, b, apex, depth - 1, mask);
                return;
            }
        }
        std::vector<uint32_t>& out = list(mask);
        out.insert(out.end(), {apex.index, a.index, b.index});
    }

    // Whether the sample is in the cut; then also its index.
    bool take(Corner& m, uint32_t level, uint32_t mask) {
        const uint32_t page_level = std::min(level, base_);
        const uint32_t side_shift = base_ - page_level;  // log2 of pages along a side
        const int32_t last = (1 << side_shift) - 1;
        const int32_t sx = m.x >> page_level, sy = m.y >> page_level;
        const int32_t px = std::min(sx >> page_shift_, last), py = std::min(sy >> page_shift_, last);
        const int32_t lx = sx - (px << page_shift_), ly = sy - (py << page_shift_);
        const uint32_t number =
            first_page_ + PageTree::page_of(side_shift, static_cast<uint32_t>(px), static_cast<uint32_t>(py));
        const Entry& entry = residency_.entry(number);
        // On a border the page across is needed as well.
        const uint32_t needed =
            1u | (ly == 0 ? 2u : 0u) | (lx == n_ ? 4u : 0u) | (ly == n_ ? 8u : 0u) | (lx == 0 ? 16u : 0u);
        if (entry.first == nullptr) {
            guess(number, level, mask);
            return false;
        }
        const GeometryTexel& texel = entry.first[ly * (n_ + 1) + lx];
        const bool want = forced_level_ >= 0 ? static_cast<int64_t>(level) >= forced_level_ : wanted_(texel);
        if (!want) return false;
        touched_[number] = 1;
        if ((entry.usable & needed) != needed) {
            for (uint32_t side = 0; side < 4; ++side) {
                if ((needed >> (side + 1) & 1) != 0) need(residency_.neighbour(number, side), mask);
            }
            need(number, mask);
            return false;
        }
        m.index = entry.slot * LODE_VGI_PAGE_TEXELS + static_cast<uint32_t>(ly * (n_ + 1) + lx);
        return true;
    }

    // What a page that is not there holds is not known, but what its parent leaves out is.
    void guess(uint32_t number, uint32_t level, uint32_t mask) {
        const uint32_t parent = first_page_ + tree_.parent(number - first_page_);
        if (residency_.entry(parent).texels == nullptr) return;  // its turn comes first
        const float excess = wanted_.excess(residency_.about().bounds[number]);
        const bool want = forced_level_ >= 0 ? static_cast<int64_t>(level) >= forced_level_ : excess > 1;
        if (want) ask(number, excess, mask);
    }
    // Something that makes the page usable is missing: the first such thing is asked for.
    void need(uint32_t number, uint32_t mask) {
        if (number == ~0u || residency_.usable(number)) return;
        const uint32_t per_chart = tree_.pages(), page = number % per_chart, first = number - page;
        const uint32_t parent = first + tree_.parent(page);  // base pages are always usable
        if (!residency_.usable(parent)) return need(parent, mask);
        if (residency_.entry(number).texels == nullptr)
            return ask(number, wanted_.excess(residency_.about().bounds[number]), mask);
        uint32_t level = 0, x = 0, y = 0;
        tree_.place(page, &level, &x, &y);
        need(residency_.neighbour(parent, y % 2 == 0 ? 0 : 2), mask);
        need(residency_.neighbour(parent, x % 2 == 0 ? 3 : 1), mask);
    }
    void ask(uint32_t number, float excess, uint32_t mask) {
        asked_.emplace_back(number, std::max(excess, 1e-6f) * ((mask & 1) != 0 ? 1.0f : unseen));
    }

    std::vector<uint32_t>& list(uint32_t mask) {
        if (mask != listed_) {
            listed_ = mask;
            auto at = std::ranges::find(parts_, mask, [](const auto& part) { return part.first; });
            if (at == parts_.end()) {
                parts_.emplace_back(mask, std::vector<uint32_t>{});
                at = parts_.end() - 1;
            }
            list_ = static_cast<size_t>(at - parts_.begin());
        }
        return parts_[list_].second;
    }

    const Residency& residency_;
    const Visibility& visibility_;
    const Wanted& wanted_;
    const int64_t forced_level_;
    std::vector<uint8_t>& touched_;
    Parts parts_;
    std::vector<std::pair<uint32_t, float>> asked_;
    const PageTree tree_;
    const int32_t n_;
    const uint32_t page_shift_, base_;
    uint32_t first_page_ = 0, listed_ = 0;
    size_t list_ = 0;
};

}  // namespace

double magnification_of(const View& view, double pixel_error) {
    LODE_CHECK(view.focal_px > 0 && pixel_error > 0, view.focal_px, pixel_error);
    return std::max(least_magnification, static_cast<double>(view.focal_px) / pixel_error);
}

Cut cut_bintree(const Residency& residency, const CutRequest& request, PageDemand& demand) {
    LODE_CHECK(!request.views.empty() && request.views.size() < 32 && demand.touched.size() == residency.pages());
    const Visibility visibility(request, residency.about());
    const Wanted wanted(request, residency.about());
    constexpr size_t charts_at_once = 16;
    const size_t charts = residency.about().charts();
    std::vector<std::optional<ChartCut>> done((charts + charts_at_once - 1) / charts_at_once);
    parallel_for(charts, charts_at_once, [&](size_t begin, size_t end) {
        ChartCut& cut =
            done[begin / charts_at_once].emplace(residency, visibility, wanted, request.forced_level, demand.touched);
        for (size_t c = begin; c < end; ++c) cut.run(static_cast<uint32_t>(c));
    });
    Cut result;
    for (auto& part_of : done) {
        for (auto& [mask, indices] : part_of->parts()) {
            auto at = std::ranges::find(result.parts, mask, [](const auto& part) { return part.first; });
            if (at == result.parts.end()) at = result.parts.insert(at, {mask, {}});
            at->second.insert(at->second.end(), indices.begin(), indices.end());
            if ((mask & 1) != 0) result.triangles += indices.size() / 3;
        }
        for (const auto& [page, pixels] : part_of->asked()) demand.wanted[page] = std::max(demand.wanted[page], pixels);
    }
    std::ranges::sort(result.parts, {}, [](const auto& part) { return part.first; });
    return result;
}

void foresee(const Residency& residency, const CutRequest& request, std::span<const float> wanted_now,
             std::vector<float>& foreseen) {
    const Visibility visibility(request, residency.about());
    const Wanted wanted(request, residency.about());
    const uint32_t per_chart = residency.tree().pages();
    for (uint32_t number = 0; number < residency.pages(); ++number) {
        const uint32_t page = number % per_chart;
        if (residency.entry(number).texels != nullptr || wanted_now[number] > 0 ||
            residency.entry(number - page + residency.tree().parent(page)).texels == nullptr)
            continue;
        const float excess = wanted.excess(residency.about().bounds[number]);
        if (excess > 1 && visibility.seen(1, number) != 0)
            foreseen[number] = std::max(foreseen[number], std::min(excess * 1e-3f, 1e-2f));
    }
}

}  // namespace lodestone::vgi
