#include "vgi/asset/codec/leaf_codec.h"

#include <algorithm>
#include <bit>
#include <cstdlib>
#include <map>

#include "base/check.h"
#include "base/files/range_coder.h"
#include "vgi/asset/codec/leaf_numbers.h"

namespace lodestone::vgi {

namespace {

constexpr uint32_t most_vertices = 256, most_sample_shift = 13;

// An edge of the triangles so far that none has the other way round, as the triangle that it is of has it.
struct Gate {
    uint8_t from = 0, to = 0, opposite = 0;
    bool open = true;
    uint16_t out_before = 0, in_before = 0;  // 1 + the gate before with the same `from`, the same `to`; 0: none
};

// The border of the triangles so far.
class Front {
public:
    // The newest gate, once; null where all were given. A triangle across it closes it, or whoever finds that there is
    // none.
    Gate* newest() {
        while (!stack_.empty()) {
            Gate& gate = gates_[stack_.back()];
            stack_.pop_back();
            if (gate.open) return &gate;
        }
        return nullptr;
    }
    void add(const std::array<uint8_t, 3>& t) {
        for (size_t k = 0; k < 3; ++k) {
            ++triangles_[t[k]];
            add_edge(t[k], t[(k + 1) % 3], t[(k + 2) % 3]);
        }
    }
    // Where the border goes on from a vertex, and where it comes from; -1 where it does not.
    int32_t next(uint8_t vertex) const {
        for (uint32_t g = out_[vertex]; g > 0; g = gates_[g - 1].out_before) {
            if (gates_[g - 1].open) return gates_[g - 1].to;
        }
        return -1;
    }
    int32_t previous(uint8_t vertex) const {
        for (uint32_t g = in_[vertex]; g > 0; g = gates_[g - 1].in_before) {
            if (gates_[g - 1].open) return gates_[g - 1].from;
        }
        return -1;
    }
    // Triangles around a vertex, 7 at most.
    uint32_t around(uint8_t vertex) const { return std::min<uint32_t>(triangles_[vertex], 7); }

private:
    void add_edge(uint8_t from, uint8_t to, uint8_t opposite) {
        for (uint32_t g = out_[to]; g > 0; g = gates_[g - 1].out_before) {
            Gate& other = gates_[g - 1];
            if (!other.open || other.to != from) continue;
            other.open = false;
            return;
        }
        stack_.push_back(static_cast<uint16_t>(gates_.size()));
        gates_.push_back({from, to, opposite, true, out_[from], in_[to]});
        out_[from] = in_[to] = static_cast<uint16_t>(gates_.size());
    }

    std::vector<Gate> gates_;
    std::vector<uint16_t> stack_;
    std::array<uint16_t, most_vertices> out_{}, in_{}, triangles_{};  // per vertex; 1 + the last gate, or 0
};

int64_t rounded_share(int64_t number, int64_t of) {
    if (of < 0) {
        number = -number;
        of = -of;
    }
    return number >= 0 ? (number + of / 2) / of : -((-number + of / 2) / of);
}

// How a triangle's corners make a place of the chart: what is linear on the triangle is at that place the sum of so
// many times what it is in each corner, over their sum.
struct Weights {
    std::array<int64_t, 3> of{1, 1, 0};
    int64_t sum = 2;

    // The middle of the first two where the triangle has no area in the chart, or the place is too far from it.
    Weights(const LeafVertex& a, const LeafVertex& b, const LeafVertex& c, const std::array<uint16_t, 2>& place) {
        const auto from_a = [&](const std::array<uint16_t, 2>& p, size_t k) { return int64_t{p[k]} - a.place[k]; };
        const int64_t area = from_a(b.place, 0) * from_a(c.place, 1) - from_a(b.place, 1) * from_a(c.place, 0),
                      second = from_a(place, 0) * from_a(c.place, 1) - from_a(place, 1) * from_a(c.place, 0),
                      third = from_a(b.place, 0) * from_a(place, 1) - from_a(b.place, 1) * from_a(place, 0);
        const std::array<int64_t, 3> found{area - second - third, second, third};
        const auto near = [&](int64_t weight) { return std::abs(weight) <= 4 * std::abs(area); };
        if (area == 0 || !std::ranges::all_of(found, near)) return;
        of = found;
        sum = area;
    }
    int64_t value(int64_t a, int64_t b, int64_t c) const {
        return rounded_share(a * of[0] + b * of[1] + c * of[2], sum);
    }
};

// What is known of the places and steps of vertices on the square's sides: on a side one coordinate is always the same,
// and the other tells the step.
class Sides {
public:
    explicit Sides(uint32_t sample_shift) : shift_(sample_shift) {}

    // The side whose line gives coordinate k of a vertex, 0 .. 3; -1 where none does.
    static int32_t line(uint8_t border, size_t k) {
        if (border == 0) return -1;
        const int32_t side = border < 5 ? border - 1 : border - 5;
        if (border < 5) return side % 2 == (k == 0 ? 1 : 0) ? side : -1;
        return k == 0 ? (side == 1 || side == 2 ? 1 : 3) : (side < 2 ? 0 : 2);
    }
    int32_t& at(int32_t side) { return at_[static_cast<size_t>(side)]; }

    // Of a vertex on a side that is no corner.
    int32_t expected_step(const LeafVertex& v) const { return step_of(v) + off_[v.border % 2u]; }
    void learn_step(const LeafVertex& v) { off_[v.border % 2u] = v.step - step_of(v); }

private:
    int32_t step_of(const LeafVertex& v) const {
        return (v.place[v.border % 2u == 1 ? 0 : 1] + (1 << shift_ >> 1)) >> shift_;
    }
    uint32_t shift_;
    std::array<int32_t, 4> at_{};   // by side: the coordinate that all on it have
    std::array<int32_t, 2> off_{};  // by direction: what steps are more than places say
};

// The shift from places to samples that tells the steps of most vertices from those of others.
uint32_t sample_shift_of(const LeafPart& part) {
    uint32_t best = 0;
    size_t least = part.vertices.size() + 1;
    for (uint32_t shift = 0; shift <= most_sample_shift; ++shift) {
        Sides sides(shift);
        size_t wrong = 0;
        for (const LeafVertex& v : part.vertices) {
            if (v.border == 0 || v.is_corner()) continue;
            wrong += sides.expected_step(v) != v.step;
            sides.learn_step(v);
        }
        if (wrong >= least) continue;
        least = wrong;
        best = shift;
    }
    return best;
}

// Of the triangles around each vertex, weighted by their areas, as samples have them (octahedral).
std::vector<std::array<int32_t, 2>> expected_normals(const LeafPart& part) {
    std::vector<std::array<int64_t, 3>> sums(part.vertices.size());
    for (const auto& t : part.triangles) {
        const auto side = [&](size_t corner, size_t k) {
            return int64_t{part.vertices[t[corner]].position[k]} - part.vertices[t[0]].position[k];
        };
        for (size_t k = 0; k < 3; ++k) {
            const size_t i = (k + 1) % 3, j = (k + 2) % 3;
            for (const uint8_t v : t) sums[v][k] += side(1, i) * side(2, j) - side(1, j) * side(2, i);
        }
    }
    std::vector<std::array<int32_t, 2>> normals;
    for (auto& sum : sums) {
        int64_t length = std::abs(sum[0]) + std::abs(sum[1]) + std::abs(sum[2]);
        const int32_t most_bits = 48, bits = std::bit_width(static_cast<uint64_t>(length));
        for (int64_t& x : sum) x /= int64_t{1} << std::max(bits - most_bits, 0);
        length = std::max<int64_t>(std::abs(sum[0]) + std::abs(sum[1]) + std::abs(sum[2]), 1);
        std::array<int64_t, 2> flat{sum[0], sum[1]};
        if (sum[2] < 0) {
            flat = {(length - std::abs(sum[1])) * (sum[0] < 0 ? -1 : 1),
                    (length - std::abs(sum[0])) * (sum[1] < 0 ? -1 : 1)};
        }
        normals.push_back({static_cast<int32_t>(rounded_share(127 * flat[0], length)),
                           static_cast<int32_t>(rounded_share(127 * flat[1], length))});
    }
    return normals;
}

// Codes a part by RangeEncoder, or fills one by RangeDecoder, whose numbers of vertices and triangles are set.
template <class Coder>
class LeafCoding {
public:
    LeafCoding(Coder& coder, LeafPart& part, const AtlasAttributes& has, uint32_t sample_shift)
        : coder_(coder), part_(part), has_(has), sides_(sample_shift) {}

    // False where what is decoded is no part.
    bool run() {
        for (size_t i = 0; i < part_.triangles.size() && good_; ++i) {
            const Gate* gate = across(part_.triangles[i]);
            if (gate == nullptr) {
                for (uint8_t& v : part_.triangles[i]) code_corner(v);
            } else {
                code_third(*gate, part_.triangles[i]);
            }
            front_.add(part_.triangles[i]);
        }
        good_ = good_ && known_ == part_.vertices.size();
        if (good_) code_normals();
        return good_;
    }

private:
    // The gate that the triangle lies across, which has the triangle's first edge; null where it lies across none.
    const Gate* across(std::array<uint8_t, 3>& triangle) {
        while (Gate* gate = front_.newest()) {
            bool is_there = triangle[0] == gate->to && triangle[1] == gate->from;
            coder_.bit(models_.across[kind_of(*gate)], is_there);
            gate->open = is_there;
            if (!is_there) continue;
            triangle[0] = gate->to;
            triangle[1] = gate->from;
            return gate;
        }
        return nullptr;
    }
    uint32_t kind_of(const Gate& gate) const {
        const LeafVertex &a = part_.vertices[gate.from], &b = part_.vertices[gate.to];
        if (a.border == 0 || b.border == 0) return 0;
        for (uint32_t s = 0; s < 4; ++s) {
            if (a.on_side(s) && b.on_side(s)) return 1;
        }
        return 2;
    }

    void code_third(const Gate& gate, std::array<uint8_t, 3>& triangle) {
        uint8_t& third = triangle[2];
        bool is_new = third == known_;
        if (known_ == part_.vertices.size()) {
            is_new = false;
        } else {
            coder_.bit(models_.fresh[8 * front_.around(gate.from) + front_.around(gate.to)], is_new);
        }
        if (is_new) {
            third = static_cast<uint8_t>(known_);
            code_vertex(&gate);
            return;
        }
        const int32_t next = front_.next(gate.to), previous = front_.previous(gate.from);
        const size_t there = (next >= 0 ? 1u : 0u) + (previous >= 0 ? 2u : 0u);
        if (next >= 0 && is_that(next, models_.next[there], third)) return;
        if (previous >= 0 && previous != next && is_that(previous, models_.previous[there], third)) return;
        code_known(third);
    }
    bool is_that(int32_t vertex, BitModel& model, uint8_t& third) {
        bool is = third == vertex;
        coder_.bit(model, is);
        if (is) third = static_cast<uint8_t>(vertex);
        return is;
    }
    // Of a triangle across no gate.
    void code_corner(uint8_t& corner) {
        bool is_new = corner == known_;
        if (known_ == 0 || known_ == part_.vertices.size()) {
            is_new = known_ == 0;
        } else {
            coder_.bit(models_.fresh_corner, is_new);
        }
        if (is_new) {
            corner = static_cast<uint8_t>(known_);
            code_vertex(nullptr);
        } else {
            code_known(corner);
        }
    }
    void code_known(uint8_t& vertex) {
        uint32_t decoded = vertex;
        coder_.even_bits(static_cast<uint32_t>(std::bit_width(known_ - 1)), decoded);
        good_ = good_ && decoded < known_;
        vertex = static_cast<uint8_t>(good_ ? decoded : 0);
    }

    // The next vertex, of a triangle across a gate or across none.
    void code_vertex(const Gate* gate) {
        static const LeafVertex nothing;
        const LeafVertex& last = known_ == 0 ? nothing : part_.vertices[known_ - 1];
        const LeafVertex &a = gate == nullptr ? last : part_.vertices[gate->from],
                         &b = gate == nullptr ? last : part_.vertices[gate->to],
                         &c = gate == nullptr ? last : part_.vertices[gate->opposite];
        LeafVertex& v = part_.vertices[known_++];
        code_border(gate == nullptr, a, b, v);
        if (!good_) return;
        for (size_t k = 0; k < 2; ++k) code_place(k, int32_t{a.place[k]} + b.place[k] - c.place[k], v);
        if (v.border > 0 && !v.is_corner()) {
            v.step = static_cast<uint8_t>(coded(models_.step, sides_.expected_step(v), v.step, 255));
            sides_.learn_step(v);
        }
        const Weights weights(a, b, c, v.place);
        for (size_t k = 0; k < 3; ++k) {
            const int64_t expected = weights.value(a.position[k], b.position[k], c.position[k]);
            v.position[k] = static_cast<uint32_t>(coded(models_.position, static_cast<int32_t>(expected),
                                                        static_cast<int32_t>(v.position[k]), (1 << leaf_bits) - 1));
        }
        code_attributes(a.attributes, b.attributes, c.attributes, v.attributes);
    }
    void code_border(bool alone, const LeafVertex& a, const LeafVertex& b, LeafVertex& v) {
        const size_t kind = alone                            ? 0
                            : a.border == 0 && b.border == 0 ? 1
                            : a.border == 0 || b.border == 0 ? 2
                            : a.is_corner() || b.is_corner() ? 3
                            : a.border == b.border           ? 4
                                                             : 5;
        v.border = models_.border[kind].code(coder_, v.border);
        good_ = good_ && v.border <= 8;
    }
    void code_place(size_t k, int32_t expected, LeafVertex& v) {
        const int32_t line = Sides::line(v.border, k);
        NumberModel& model = line >= 0 ? models_.line : v.border > 0 ? models_.along : models_.place;
        if (line >= 0) expected = sides_.at(line);
        v.place[k] = static_cast<uint16_t>(coded(model, expected, v.place[k], int32_t{leaf_places}));
        if (line >= 0) sides_.at(line) = v.place[k];
    }
    void code_attributes(const TexelAttributes& a, const TexelAttributes& b, const TexelAttributes& c,
                         TexelAttributes& is) {
        for (size_t k = 0; k < 2 && has_.uvs; ++k)
            code_wrapped<int16_t>(models_.uv, a.uv[k] + b.uv[k] - c.uv[k], is.uv[k]);
        for (int k = 0; k < 4 && has_.colours && !has_.baked; ++k)
            code_wrapped<int8_t>(models_.colour, (a.colour[k] + b.colour[k]) / 2, is.colour[k]);
        if (has_.materials) code_wrapped<int16_t>(models_.material, a.material, is.material);
    }
    // They follow from the triangles around, so they come last.
    void code_normals() {
        const auto expected = expected_normals(part_);
        for (size_t v = 0; v < part_.vertices.size(); ++v) {
            LeafVertex& vertex = part_.vertices[v];
            NumberModel& model = models_.normal[vertex.border == 0 ? 0 : 1];
            for (size_t k = 0; k < 2; ++k) code_wrapped<int8_t>(model, expected[v][k], vertex.attributes.normal[k]);
        }
    }

    // A number of 0 .. most by what it is more than was expected; 0 where what is decoded is out of range.
    int32_t coded(NumberModel& model, int32_t expected, int32_t number, int32_t most) {
        int32_t more = number - expected;
        model.code(coder_, more);
        const int64_t is = int64_t{expected} + more;
        good_ = good_ && is >= 0 && is <= most;
        return good_ ? static_cast<int32_t>(is) : 0;
    }
    // A number that wraps around.
    template <class Difference, class Number>
    void code_wrapped(NumberModel& model, int32_t expected, Number& number) {
        int32_t more = int32_t{static_cast<Difference>(number - expected)};
        model.code(coder_, more);
        number = static_cast<Number>(static_cast<uint32_t>(expected) + static_cast<uint32_t>(more));
    }

    Coder& coder_;
    LeafPart& part_;
    const AtlasAttributes& has_;
    Sides sides_;
    LeafModels models_;
    Front front_;
    uint32_t known_ = 0;  // vertices so far
    bool good_ = true;
};

tl::unexpected<Error> broken() { return fail(Fault::format, "cannot be unpacked"); }

// Triangles in an order in which each lies across the newest gate that has one.
class CodingOrder {
public:
    explicit CodingOrder(const LeafPart& part) : part_(part), numbers_(part.vertices.size(), -1) {
        for (size_t i = 0; i < part.triangles.size(); ++i) {
            for (uint32_t k = 0; k < 3; ++k) edges_.emplace(edge(part.triangles[i], k), 3 * i + k);
        }
    }

    LeafPart run() {
        std::vector<bool> done(part_.triangles.size());
        const auto put = [&](size_t triangle, uint32_t first) {
            done[triangle] = true;
            add(part_.triangles[triangle], first);
        };
        for (size_t i = 0; i < done.size(); ++i) {
            if (done[i]) continue;
            put(i, 0);
            while (Gate* gate = front_.newest()) {
                const auto [begin, end] = edges_.equal_range(key(old_[gate->to], old_[gate->from]));
                const auto found = std::find_if(begin, end, [&](const auto& at) { return !done[at.second / 3]; });
                gate->open = found != end;
                if (gate->open) put(found->second / 3, static_cast<uint32_t>(found->second % 3));
            }
        }
        return std::move(result_);
    }

private:
    static uint32_t key(uint8_t from, uint8_t to) { return uint32_t{from} << 8 | to; }
    static uint32_t edge(const std::array<uint8_t, 3>& t, uint32_t k) { return key(t[k], t[(k + 1) % 3]); }

    void add(const std::array<uint8_t, 3>& triangle, uint32_t first) {
        std::array<uint8_t, 3> t{};
        for (uint32_t k = 0; k < 3; ++k) {
            const uint8_t v = triangle[(first + k) % 3];
            if (numbers_[v] < 0) {
                numbers_[v] = static_cast<int32_t>(old_.size());
                old_.push_back(v);
                result_.vertices.push_back(part_.vertices[v]);
            }
            t[k] = static_cast<uint8_t>(numbers_[v]);
        }
        result_.triangles.push_back(t);
        front_.add(t);
    }

    const LeafPart& part_;
    std::multimap<uint32_t, size_t> edges_;  // to 3 triangle + k
    std::vector<int32_t> numbers_;           // by vertex of the part, -1: none yet
    std::vector<uint8_t> old_;               // the other way round
    LeafPart result_;
    Front front_;
};

}  // namespace

LeafPart in_coding_order(const LeafPart& part) { return CodingOrder(part).run(); }

std::vector<std::byte> encode_leaf(const LeafPart& part, const AtlasAttributes& attributes) {
    LODE_CHECK(!part.vertices.empty() && part.vertices.size() <= most_leaf_vertices, part.vertices.size());
    LODE_CHECK(!part.triangles.empty() && part.triangles.size() <= most_leaf_triangles, part.triangles.size());
    const auto triangles = static_cast<uint32_t>(part.triangles.size()), shift = sample_shift_of(part);
    std::vector<std::byte> packed{static_cast<std::byte>(part.vertices.size() - 1),
                                  static_cast<std::byte>(triangles & 255), static_cast<std::byte>(triangles >> 8),
                                  static_cast<std::byte>(shift)};
    RangeEncoder encoder;
    LeafPart copy = part;
    const bool good = LeafCoding(encoder, copy, attributes, shift).run();
    LODE_CHECK(good, part.vertices.size());
    encoder.finish(packed);
    return packed;
}

Result<LeafPart> decode_leaf(std::span<const std::byte> bytes, const AtlasAttributes& attributes) {
    if (bytes.size() < leaf_header_bytes) return broken();
    const size_t vertices = static_cast<size_t>(bytes[0]) + 1, triangles = triangles_in_leaf(bytes);
    const auto shift = std::to_integer<uint32_t>(bytes[3]);
    if (triangles == 0 || triangles > most_leaf_triangles || vertices > most_leaf_vertices || shift > most_sample_shift)
        return broken();
    LeafPart part;
    part.vertices.resize(vertices);
    part.triangles.resize(triangles);
    RangeDecoder decoder(bytes.subspan(leaf_header_bytes));
    if (!LeafCoding(decoder, part, attributes, shift).run() || !decoder.at_end()) return broken();
    return part;
}

}  // namespace lodestone::vgi
