#include "vgi/draw/corners/chart_boxes.h"

#include <algorithm>
#include <glm/common.hpp>
#include <numeric>
#include <span>

#include "mesh/limits.h"
#include "shaders/shared/vgi_texels.h"

namespace lodestone::vgi {

namespace {

static_assert(Limits{}.charts < uint64_t{1} << LODE_VGI_BOX_DEPTH && 2 * Limits{}.charts < LODE_VGI_BOX_OF_CHART);

class Boxes {
public:
    explicit Boxes(const Atlas& about) {
        for (const std::array<uint32_t, 4>& corners : about.chart_corners) {
            Box box;
            for (const uint32_t corner : corners) {
                const auto& at = about.corners[corner].position;
                box.add({glm::uvec3(at[0], at[1], at[2]), glm::uvec3(at[0], at[1], at[2])});
            }
            boxes_.push_back(box);
        }
    }

    std::vector<CornerRecord> table() {
        std::vector<uint32_t> charts(boxes_.size());
        std::iota(charts.begin(), charts.end(), 0u);
        table_.resize(1);
        put(0, charts);
        return std::move(table_);
    }

private:
    struct Box {
        glm::uvec3 low{65535}, high{0};  // lattice units
        void add(const Box& other) {
            low = glm::min(low, other.low);
            high = glm::max(high, other.high);
        }
        glm::uvec3 middle() const { return low + high; }  // twice
    };

    // charts: at least one; put into another order.
    void put(size_t number, std::span<uint32_t> charts) {
        Box box, middles;
        for (const uint32_t chart : charts) {
            box.add(boxes_[chart]);
            middles.add({boxes_[chart].middle(), boxes_[chart].middle()});
        }
        const auto first = static_cast<uint32_t>(table_.size());
        table_[number] = {box.low.x | box.high.x << 16, box.low.y | box.high.y << 16, box.low.z | box.high.z << 16,
                          charts.size() == 1 ? LODE_VGI_BOX_OF_CHART | charts[0] : first};
        if (charts.size() == 1) return;
        const glm::uvec3 size = middles.high - middles.low;
        const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
        const size_t half = charts.size() / 2;
        std::nth_element(charts.begin(), charts.begin() + static_cast<ptrdiff_t>(half), charts.end(),
                         [&](uint32_t a, uint32_t b) {
                             return std::pair(boxes_[a].middle()[axis], a) < std::pair(boxes_[b].middle()[axis], b);
                         });
        table_.resize(table_.size() + 2);
        put(first, charts.first(half));
        put(first + 1, charts.subspan(half));
    }

    std::vector<Box> boxes_;  // of charts
    std::vector<CornerRecord> table_;
};

}  // namespace

std::vector<CornerRecord> chart_boxes(const Atlas& about) {
    return about.corners.empty() ? std::vector<CornerRecord>{} : Boxes(about).table();
}

}  // namespace lodestone::vgi
