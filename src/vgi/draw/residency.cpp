#include "vgi/draw/residency.h"

#include <algorithm>
#include <bit>
#include <string>
#include <utility>

#include "base/check.h"
#include "vgi/draw/leaves/leaf_morph.h"
#include "vgi/draw/leaves/leaf_runs.h"

namespace lodestone::vgi {

GeometryPage packed_geometry(const Page& page, const PageTree& tree) {
    const size_t count = size_t{tree.samples_per_side()} * tree.samples_per_side();
    LODE_CHECK(page.values.size() == 5 * count, page.values.size());
    GeometryPage packed(count);
    for (size_t i = 0; i < count; ++i) {
        packed[i] = {page.values[i], page.values[count + i], page.values[2 * count + i],
                     static_cast<uint8_t>(page.values[3 * count + i]),
                     static_cast<uint8_t>(page.values[4 * count + i])};
    }
    return packed;
}

Page unpacked_geometry(const GeometryPage& page) {
    const size_t count = page.size();
    Page plain;
    plain.values.resize(5 * count);
    for (size_t i = 0; i < count; ++i) {
        plain.values[i] = page[i].x;
        plain.values[count + i] = page[i].y;
        plain.values[2 * count + i] = page[i].z;
        plain.values[3 * count + i] = page[i].error;
        plain.values[4 * count + i] = page[i].radius;
    }
    return plain;
}

namespace {

void raise(SampleCodes& codes, SampleCodes to) {
    codes = {std::max(codes.error, to.error), std::max(codes.radius, to.radius)};
}

}  // namespace

PageTopology::PageTopology(const Atlas& about, bool leaves) : about_(&about), tree_{about.cells}, corners_(about) {
    const uint32_t per_chart = tree_.pages();
    neighbours_.resize(size_t{about.charts()} * per_chart);
    below_.resize(neighbours_.size());
    for (uint32_t i = static_cast<uint32_t>(below_.size()); i-- > 0;) {
        raise(below_[i], {about.bounds[i].sample_error, about.bounds[i].sample_radius});
        if (i % per_chart > 0) raise(below_[parent(i)], below_[i]);
    }
    for (uint32_t chart = 0; chart < about.charts(); ++chart) {
        for (uint32_t page = 0; page < per_chart; ++page) {
            uint32_t level = 0, x = 0, y = 0;
            tree_.place(page, &level, &x, &y);
            for (uint32_t side = 0; side < 4; ++side) {
                const Atlas::Tile to = about.across({chart, x, y}, side, tree_.pages_per_side(level));
                neighbours_[chart * per_chart + page][side] =
                    to.chart == ~0u ? ~0u : to.chart * per_chart + tree_.page(level, to.x, to.y);
            }
        }
    }
    if (leaves && !about.leaves.empty()) place_leaves();
}

void PageTopology::place_leaves() {
    square_.assign(neighbours_.size(), ~0u);
    leaves_below_.resize(neighbours_.size());
    page_of_leaf_.assign(about_->leaves.size(), ~0u);
    for (uint32_t chart = 0; chart < about_->charts(); ++chart) {
        const PageTree own = tree_of(*about_, Layer::geometry, chart);
        const uint32_t per_side = own.pages_per_side(0);
        for (uint32_t i = 0; i < per_side * per_side; ++i) {
            const uint32_t leaf = about_->first_leaf[chart] + i,
                           number = chart * tree_.pages() + own.page(0, i % per_side, i / per_side);
            page_of_leaf_[leaf] = number;
            square_[number] = leaf;
            const Leaf& of = about_->leaves[leaf];
            leaves_below_[number] = {of.error, of.radius};
            leaf_of_part_.insert(leaf_of_part_.end(), of.parts_end - about_->first_part(leaf), leaf);
        }
    }
    for (uint32_t i = static_cast<uint32_t>(leaves_below_.size()); i-- > 0;) {
        if (i % tree_.pages() > 0) raise(leaves_below_[parent(i)], leaves_below_[i]);
    }
    leaf_neighbours_ = LeafNeighbours(*about_);
    leaf_demands_ = LeafDemands(*about_, leaf_neighbours_);
    depths_ = SampleDepths(*about_);
    beside_leaves_ = SamplesBesideLeaves(*about_, depths_);
}

namespace {

std::array<uint32_t, 4> packed_vertex(const LeafVertex& v, uint32_t chart) {
    const auto& p = v.position;
    const auto& n = v.attributes.normal;
    return {p[0] | p[1] << 21, p[1] >> 11 | p[2] << 10,
            uint32_t{v.place[0]} | uint32_t{v.place[1]} << 14 | (chart & 15u) << 28,
            uint32_t{static_cast<uint8_t>(n[0])} | uint32_t{static_cast<uint8_t>(n[1])} << 8 | (chart >> 4) << 16};
}

uint32_t packed_uv(const std::array<uint16_t, 2>& uv) { return uint32_t{uv[0]} | uint32_t{uv[1]} << 16; }

// Puts the leaf and those across its sides into the beginning of what is drawn.
void put_leaves(const std::array<Leaf, 5>& leaves, DrawnLeafPart& drawn) {
    for (size_t i = 0; i < leaves.size(); ++i) {
        const auto [low, high] = std::bit_cast<std::array<uint32_t, 2>>(texel_of(leaves[i]));
        drawn.words[i / 2][i % 2 * 2] = low;
        drawn.words[i / 2][i % 2 * 2 + 1] = high;
    }
}

}  // namespace

DrawnLeafPart packed_leaf(const PageTopology& topology, uint32_t number, LeafPart part, const GeometryPage& samples,
                          bool uvs) {
    const Atlas& about = topology.about();
    const uint32_t block = LODE_VGI_LEAF_BLOCK(uvs ? 1u : 0u);
    const uint32_t leaf = topology.leaf_of_part(number), chart = topology.page_of_leaf(leaf) / topology.tree().pages(),
                   in_chart = leaf - about.first_leaf[chart], per_side = about.leaves_per_side(chart);
    std::vector<LeafSample> points;
    points.reserve(samples.size());
    for (const GeometryTexel& t : samples) points.push_back({{t.x, t.y, t.z}, t.error});
    const Atlas::Tile square{chart, in_chart % per_side, in_chart / per_side};
    const auto morphs = leaf_morphs(about, square, part, points);
    DrawnLeafPart drawn;
    drawn.words.resize(LODE_VGI_LEAF_TEXEL(0u, block) + (part.vertices.size() + 3) / 4 * block);
    put_leaves(leaf_and_across(about, square), drawn);
    for (uint32_t v = 0; v < part.vertices.size(); ++v) {
        const LeafVertex& vertex = part.vertices[v];
        const uint32_t words = LODE_VGI_LEAF_MORPHS(v, block);
        drawn.words[LODE_VGI_LEAF_TEXEL(v, block)] = packed_vertex(vertex, chart);
        drawn.words[words][v % 4] = morphs[v].packed();
        if (uvs) drawn.words[words + 1][v % 4] = packed_uv(vertex.attributes.uv);
    }
    drawn.runs = leaf_runs(about, part);
    drawn.part = std::move(part);
    return drawn;
}

Residency::Residency(std::shared_ptr<const PageTopology> topology)
    : topology_(std::move(topology)),
      entries_(topology_->pages()),
      parts_(topology_->leaf_parts()),
      changed_at_(topology_->pages()) {}

void Residency::put(uint32_t number, std::shared_ptr<const GeometryPage> texels, uint32_t slot) {
    Entry& entry = entries_[number];
    LODE_CHECK(texels != nullptr && entry.texels == nullptr, number);
    entry.first = texels->data();
    entry.texels = std::move(texels);
    entry.slot = slot;
    entry.state = PageState::resident;
    came_or_went_.push_back(number);
}

void Residency::drop(uint32_t number) {
    Entry& entry = entries_[number];
    LODE_CHECK(entry.texels != nullptr, number);
    entry.texels = nullptr;
    entry.first = nullptr;
    entry.slot = ~0u;
    entry.state = PageState::absent;
    came_or_went_.push_back(number);
}

void Residency::set_state(uint32_t number, PageState state) {
    LODE_CHECK(!holds(number) && state != PageState::resident, number);
    entries_[number].state = state;
}

bool Residency::all_parts_there(uint32_t leaf) const {
    for (uint32_t p = about().first_part(leaf); p < about().leaves[leaf].parts_end; ++p) {
        if (!holds_leaf_part(p)) return false;
    }
    return true;
}

void Residency::leaf_part_changed(uint32_t part) {
    const uint32_t leaf = topology_->leaf_of_part(part);
    entries_[topology_->page_of_leaf(leaf)].leaf_there = all_parts_there(leaf);
    leaves_changed_.push_back(leaf);
}

void Residency::put_leaf_part(uint32_t part, std::shared_ptr<const DrawnLeafPart> drawn, uint32_t slot) {
    LODE_CHECK(drawn != nullptr && !holds_leaf_part(part), part);
    parts_[part] = {std::move(drawn), slot, PageState::resident};
    leaf_part_changed(part);
}

void Residency::drop_leaf_part(uint32_t part) {
    LODE_CHECK(holds_leaf_part(part), part);
    parts_[part] = {};
    leaf_part_changed(part);
}

void Residency::set_leaf_state(uint32_t part, PageState state) {
    LODE_CHECK(!holds_leaf_part(part) && state != PageState::resident, part);
    parts_[part].state = state;
}

bool Residency::usable_by_definition(uint32_t number) const {
    if (entries_[number].texels == nullptr) return false;
    const uint32_t page = number % tree().pages();
    if (page == 0) return true;
    uint32_t level = 0, x = 0, y = 0;
    tree().place(page, &level, &x, &y);
    const uint32_t parent = topology_->parent(number);
    if (!usable(parent)) return false;
    for (const uint32_t side : {y % 2 == 0 ? 0u : 2u, x % 2 == 0 ? 3u : 1u}) {
        const uint32_t across = neighbour(parent, side);
        if (across != ~0u && !usable(across)) return false;
    }
    return true;
}

// From which neighbours are usable.
uint8_t Residency::usable_bits(uint32_t number) const {
    if (!usable(number)) return 0;
    uint8_t bits = 1;
    for (uint32_t side = 0; side < 4; ++side) {
        const uint32_t across = neighbour(number, side);
        if (across == ~0u || usable(across)) bits |= static_cast<uint8_t>(2u << side);
    }
    return bits;
}

// Sets whether pages are usable, coarsest first: a page follows from its parent and its parent's neighbours. Returns
// those for which it changed.
std::vector<uint32_t> Residency::spread_usable() {
    const uint32_t per_chart = tree().pages();
    std::vector<std::vector<uint32_t>> by_level(tree().base_level() + 1);
    for (const uint32_t number : came_or_went_) by_level[tree().level(number % per_chart)].push_back(number);
    std::vector<uint32_t> changed;
    for (size_t level = by_level.size(); level-- > 0;) {
        std::vector<uint32_t>& looked_at = by_level[level];
        std::ranges::sort(looked_at);
        looked_at.erase(std::unique(looked_at.begin(), looked_at.end()), looked_at.end());
        for (const uint32_t number : looked_at) {
            const bool now = usable_by_definition(number);
            if (now == usable(number)) continue;
            entries_[number].usable ^= 1;
            changed.push_back(number);
            if (level == 0) continue;
            const auto look_below = [&](uint32_t coarse) {
                const uint32_t page = coarse % per_chart;
                for (uint32_t k = 0; k < 4; ++k)
                    by_level[level - 1].push_back(coarse - page + tree().member(page + 1, k));
            };
            look_below(number);
            for (uint32_t side = 0; side < 4; ++side) {
                if (neighbour(number, side) != ~0u) look_below(neighbour(number, side));
            }
        }
    }
    return changed;
}

void Residency::update() {
    if (!owes_update()) return;
    ++updates_;
    for (const uint32_t leaf : leaves_changed_) mark_changed(topology_->page_of_leaf(leaf));
    leaves_changed_.clear();
    for (const uint32_t number : spread_usable()) {
        entries_[number].usable = usable_bits(number);
        mark_changed(number);
        for (uint32_t side = 0; side < 4; ++side) {
            const uint32_t across = neighbour(number, side);
            if (across == ~0u || !usable(across)) continue;
            const uint8_t before = std::exchange(entries_[across].usable, usable_bits(across));
            if (entries_[across].usable != before) mark_changed(across);
        }
    }
    for (const uint32_t number : came_or_went_) mark_changed(number);
    came_or_went_.clear();
}

void Residency::mark_changed(uint32_t number) {
    const uint32_t per_chart = tree().pages();
    const auto mark_up = [&](uint32_t n) {
        for (;;) {
            if (std::exchange(changed_at_[n], updates_) == updates_) return;
            if (n % per_chart == 0) return;
            n = topology_->parent(n);
        }
    };
    mark_up(number);
    for (uint32_t side = 0; side < 4; ++side) {
        if (neighbour(number, side) != ~0u) mark_up(neighbour(number, side));
    }
    const uint32_t leaf = topology_->leaf(number);
    if (leaf == ~0u) return;
    for (uint32_t k = 0; k < 4; ++k) {
        for (const uint32_t other : topology_->leaf_neighbours().around(leaf, k))
            mark_up(topology_->page_of_leaf(other));
    }
}

Result<void> Residency::validate() const {
    for (uint32_t number = 0; number < entries_.size(); ++number) {
        const std::string place = "residency: page " + std::to_string(number);
        const uint32_t leaf = topology_->leaf(number);
        if (entries_[number].leaf_there != (leaf != ~0u && all_parts_there(leaf)))
            return fail(Fault::invariant, place + ": its leaf is not as its parts are");
        const uint8_t bits = usable_by_definition(number) ? usable_bits(number) : 0;
        if (came_or_went_.empty() && entries_[number].usable != bits)
            return fail(Fault::invariant, place + ": is stale");
        for (uint32_t side = 0; side < 4; ++side) {
            const uint32_t across = neighbour(number, side);
            if (across == ~0u) continue;
            uint32_t back = 0;
            while (back < 4 && neighbour(across, back) != number) ++back;
            if (back == 4) return fail(Fault::invariant, place + ": is not its neighbour's neighbour");
        }
    }
    return {};
}

}  // namespace lodestone::vgi
