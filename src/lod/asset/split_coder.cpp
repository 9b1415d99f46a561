#include "lod/asset/split_coder.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "base/none.h"

namespace lodestone {

namespace {

constexpr uint32_t largest_coded_fan = 15;
// Added to a difference of sizes so that it is a byte.
constexpr uint32_t size_offset = 40;

// Floats as integers that rise as they do. Here and below nothing branches on signs, which nobody could guess.
uint32_t ordered(float value) {
    const auto bits = std::bit_cast<uint32_t>(value);
    return bits ^ ((0u - (bits >> 31)) | 0x80000000u);
}
float unordered(uint32_t number) { return std::bit_cast<float>(number ^ (((number >> 31) - 1) | 0x80000000u)); }
uint32_t magnitude(int32_t value) {
    const auto sign = static_cast<uint32_t>(value >> 31);
    return (static_cast<uint32_t>(value) ^ sign) - sign;
}

constexpr uint32_t tangent_mask = (1u << LODE_TANGENT_BITS) - 1;
// The lowest bits as a number with a sign.
int32_t as_tangent_number(uint32_t bits) {
    return static_cast<int32_t>(bits << (32 - LODE_TANGENT_BITS)) >> (32 - LODE_TANGENT_BITS);
}
// One of the two of a tangent's direction.
int32_t tangent_number(uint32_t word, uint32_t axis) { return as_tangent_number(word >> (axis * LODE_TANGENT_BITS)); }

uint32_t bits_of(uint32_t value) { return static_cast<uint32_t>(std::bit_width(uint64_t{value} << 1 | 1)) - 1; }

}  // namespace

template <class Io>
void SplitCoder<Io>::number(size_t stream, uint32_t& value) {
    if constexpr (Io::reading) {
        value = io_.number(stream);
    } else {
        io_.number(stream, value);
    }
}

template <class Io>
void SplitCoder<Io>::flag(bool& value) {
    uint32_t bit = value ? 1 : 0;
    number(split_streams::other_fan, bit);
    value = bit != 0;
}

// A number below `end`, all equally likely: the first of them take a bit less.
template <class Io>
void SplitCoder<Io>::below(uint32_t& value, uint32_t end) {
    const auto width = static_cast<uint32_t>(std::bit_width(end - 1));
    if (width == 0) {
        value = 0;
        return;
    }
    const auto shorter = static_cast<uint32_t>((uint64_t{1} << width) - end);
    constexpr size_t stream = split_streams::split_bits;
    if constexpr (!Io::reading) {
        if (value < shorter) {
            io_.bits(stream, value, width - 1);
        } else {
            const uint64_t code = uint64_t{value} + shorter;
            io_.bits(stream, static_cast<uint32_t>(code >> 1), width - 1);
            io_.bits(stream, code & 1, 1);
        }
    } else {
        value = io_.bits(stream, width - 1);
        if (value >= shorter) value = static_cast<uint32_t>((uint64_t{value} * 2 | io_.bits(stream, 1)) - shorter);
    }
}

// The number of bits of the difference, against what is expected, and the bits.
template <class Io>
void SplitCoder<Io>::difference(size_t stream, int32_t& value, uint32_t expected_bits) {
    uint32_t size = 0;
    if constexpr (!Io::reading) {
        size = static_cast<uint32_t>(std::bit_width(magnitude(value)));
        io_.byte(stream, static_cast<uint8_t>(size + size_offset - expected_bits));
        if (size == 0) return;
        io_.bits(split_streams::vertex_bits, magnitude(value), size - 1);
        io_.bits(split_streams::vertex_bits, value < 0 ? 1 : 0, 1);
    } else {
        size = std::min<uint32_t>(32, uint32_t{io_.byte(stream)} + expected_bits - size_offset);
        const uint32_t stored = io_.bits(split_streams::vertex_bits, size);
        const auto top = static_cast<uint32_t>((uint64_t{1} << size) >> 1);
        const uint32_t sign = (stored & top) != 0 ? ~0u : 0u;
        value = static_cast<int32_t>(((stored | top) ^ sign) - sign);
    }
}

template <class Io>
void SplitCoder<Io>::floating(size_t stream, float& value, float expected, float reference) {
    const uint32_t middle = ordered(expected);
    const uint32_t spread = bits_of(magnitude(static_cast<int32_t>(middle - ordered(reference))));
    auto apart = static_cast<int32_t>(ordered(value) - middle);
    difference(stream, apart, spread);
    value = unordered(middle + static_cast<uint32_t>(apart));
}

// The same of a multiple of the grid.
template <class Io>
void SplitCoder<Io>::on_grid(size_t stream, float& value, float expected, float reference) {
    const auto multiple = [&](float of) {
        return static_cast<int32_t>(
            std::clamp(std::nearbyint(static_cast<double>(of) * per_grid_), -2147483648.0, 2147483647.0));
    };
    const auto middle = static_cast<uint32_t>(multiple(expected));
    const uint32_t spread =
        bits_of(magnitude(static_cast<int32_t>(middle - static_cast<uint32_t>(multiple(reference)))));
    int32_t apart = 0;
    if constexpr (!Io::reading) apart = static_cast<int32_t>(static_cast<uint32_t>(multiple(value)) - middle);
    difference(stream, apart, spread);
    value = static_cast<float>(static_cast<int32_t>(middle + static_cast<uint32_t>(apart)) * grid_);
}

template <class Io>
void SplitCoder<Io>::base_vertex(uint32_t wedges) {
    uint32_t less = wedges - 1;
    number(split_streams::wedges, less);
    mesh_.add_vertex((less & 0xffff) + 1);
    const uint32_t v = mesh_.vertices() - 1;
    SplitStep alone;
    alone.split.parent = v == 0 ? none : v - 1;
    alone.parents.assign(mesh_.wedges_of(v), 0);
    vertex(alone);
}

template <class Io>
void SplitCoder<Io>::base_face(std::array<uint32_t, 3>& corners, std::array<uint16_t, 3>& locals_of_it) {
    for (size_t k = 0; k < 3; ++k) {
        below(corners[k], mesh_.vertices());
        uint32_t which = locals_of_it[k];
        local(which, 0, mesh_.wedges_of(corners[k]));
        locals_of_it[k] = static_cast<uint16_t>(which);
    }
    mesh_.add_base_face(corners, locals_of_it);
}

// Where the new faces are not told by what the arc meets.
template <class Io>
void SplitCoder<Io>::ends(SplitMesh::Split& split) {
    const bool empty = split.arc.empty();
    if constexpr (Io::reading) {
        split.right = split.before.face != none;
        split.left = split.after.face != none;
    }
    if (!empty && split.before.face == none) flag(split.right);
    if (!empty && split.after.face == none) flag(split.left);
}

template <class Io>
bool SplitCoder<Io>::small_fan(SplitMesh::Split& split, const SplitMesh::Fan& fan) {
    const uint32_t n = fan.size;
    uint32_t start = 0, length = 0;
    const auto index_of = [&](uint32_t face) {
        uint32_t i = 0;
        while (i < n && fan.corners[i].face != face) ++i;
        return i;
    };
    if constexpr (!Io::reading) {
        length = static_cast<uint32_t>(split.arc.size());
        start = length > 0                 ? index_of(split.arc.front().face)
                : split.after.face != none ? index_of(split.after.face)
                                           : index_of(split.before.face) + 1;
    }
    if (fan.closed && n >= 2 && n <= largest_coded_fan) {
        if constexpr (Io::reading) {
            const uint32_t code = io_.byte(split_streams::fan + n);
            start = code / (n - 1);
            length = code % (n - 1) + 1;
            if (start >= n) return false;
        } else {
            io_.byte(split_streams::fan + n, static_cast<uint8_t>(start * (n - 1) + length - 1));
        }
    } else {
        number(split_streams::other_fan, start);
        number(split_streams::other_fan, length);
        if (fan.closed ? start >= n || length == 0 || length >= n : start > n || length > n - start) return false;
    }
    if constexpr (Io::reading) {
        for (uint32_t i = 0; i < length; ++i)
            split.arc.push_back(fan.corners[start + i < n ? start + i : start + i - n]);
        if (fan.closed || start > 0) split.before = fan.corners[start > 0 ? start - 1 : n - 1];
        if (fan.closed || start + length < n)
            split.after = fan.corners[start + length < n ? start + length : start + length - n];
    }
    ends(split);
    return true;
}

template <class Io>
bool SplitCoder<Io>::large_fan(SplitMesh::Split& split) {
    bool empty = split.arc.empty(), follows = split.after.face != none;
    auto length = static_cast<uint32_t>(split.arc.size());
    const Corner given = !empty ? split.arc.front() : follows ? split.after : split.before;
    uint32_t face = given.face, k = given.k;
    below(face, mesh_.face_count());
    number(split_streams::other_fan, k);
    number(split_streams::other_fan, length);
    if (length == 0) flag(follows);
    if constexpr (Io::reading) {
        Corner c{face, k};
        if (k > 2 || mesh_.vertex(c) != split.parent) return false;
        if (length == 0) {
            (follows ? split.after : split.before) = c;
            if ((follows ? mesh_.clockwise(c) : mesh_.counter_clockwise(c)).face != none) return false;
        } else {
            split.before = mesh_.clockwise(c);
            for (uint32_t i = 0; i < length; ++i, c = mesh_.counter_clockwise(c)) {
                if (c.face == none || (i > 0 && c.face == face)) return false;
                split.arc.push_back(c);
            }
            if (c.face == face) return false;
            split.after = c;
        }
    }
    ends(split);
    return true;
}

// The parent has no face: at most one is born, and its third vertex is named.
template <class Io>
bool SplitCoder<Io>::no_fan(SplitMesh::Split& split) {
    flag(split.right);
    if (!split.right) flag(split.left);
    if (!split.right && !split.left) return true;
    below(split.opposite, mesh_.vertices());
    return split.opposite != split.parent;
}

template <class Io>
bool SplitCoder<Io>::arc(SplitMesh::Split& split) {
    mesh_.fan_of(split.parent, fan_);
    return fan_.large ? large_fan(split) : fan_.size > 0 ? small_fan(split, fan_) : no_fan(split);
}

// Which of so many wedges it is.
template <class Io>
bool SplitCoder<Io>::local(uint32_t& value, uint32_t expected, uint32_t wedges) {
    if (wedges == 1) {
        if constexpr (Io::reading) value = 0;
        return true;
    }
    uint32_t apart = value >= expected ? value - expected : value + wedges - expected;
    number(split_streams::locals, apart);
    if (apart >= wedges) return false;
    if constexpr (Io::reading) value = (apart + expected) % wedges;
    return true;
}

template <class Io>
bool SplitCoder<Io>::locals(SplitStep& step, uint32_t wedges) {
    const SplitMesh::Split& split = step.split;
    const auto of = [&](Corner c) { return c.face == none ? 0 : mesh_.local(c); };
    if (wedges == 1 && !mesh_.has_seams()) return true;  // there is nothing to choose from
    if constexpr (Io::reading) step.arc_locals.assign(split.arc.size(), 0);
    bool good = true;
    for (size_t i = 0; i < split.arc.size() && good && wedges > 1; ++i) {
        const auto expected = std::ranges::find(step.parents, mesh_.local(split.arc[i]));
        good =
            local(step.arc_locals[i],
                  expected == step.parents.end() ? 0 : static_cast<uint32_t>(expected - step.parents.begin()), wedges);
    }
    // x or y, and the wedge of it where it is known.
    const auto ring = [&](Corner c) {
        return c.face == none ? std::pair(split.opposite, 0u) : std::pair(mesh_.vertex(c), mesh_.local(c));
    };
    const auto ahead = [](Corner c) { return Corner{c.face, SplitMesh::next(c.k)}; };
    const auto behind = [](Corner c) { return Corner{c.face, SplitMesh::previous(c.k)}; };
    const bool empty = split.arc.empty();
    const uint32_t u_wedges = mesh_.wedges_of(split.parent);
    if (split.right && good) {
        const auto [x, wedge] = ring(empty ? behind(split.before) : ahead(split.arc.front()));
        good = local(step.right_locals[0], empty ? 0 : step.arc_locals.front(), wedges) &&
               local(step.right_locals[1], of(split.before), u_wedges) &&
               local(step.right_locals[2], wedge, mesh_.wedges_of(x));
    }
    if (split.left && good) {
        const auto [y, wedge] = ring(empty ? ahead(split.after) : behind(split.arc.back()));
        good = local(step.left_locals[0], empty ? 0 : step.arc_locals.back(), wedges) &&
               local(step.left_locals[1], wedge, mesh_.wedges_of(y)) &&
               local(step.left_locals[2], of(split.after), u_wedges);
    }
    return good;
}

template <class Io>
bool SplitCoder<Io>::step(SplitStep& step) {
    SplitMesh::Split& split = step.split;
    if constexpr (Io::reading) {
        split = {0, std::move(split.arc), {}, {}, false, false, none};
        split.arc.clear();
    }
    below(split.parent, mesh_.vertices());
    if constexpr (Io::reading) lookahead_.split(io_, split_streams::split_bits, mesh_, vertices_, split.parent);
    auto less = static_cast<uint32_t>(step.parents.size()) - 1;
    number(split_streams::wedges, less);
    if (less > 0xfffe) return false;
    if constexpr (Io::reading) step.parents.assign(less + 1, 0);
    const uint32_t parents = mesh_.wedges_of(split.parent);
    for (uint32_t& parent : step.parents) {
        if (parents > 1) number(split_streams::parents, parent);
        if (parent >= parents) return false;
    }
    if (!arc(split) || !locals(step, less + 1)) return false;
    mesh_.add_vertex(less + 1);
    uint32_t face = mesh_.face_count();
    mesh_.apply(split);
    if (mesh_.has_seams()) {
        for (size_t i = 0; i < split.arc.size(); ++i) mesh_.set_local(split.arc[i], step.arc_locals[i]);
        for (uint32_t k = 0; split.right && k < 3; ++k) mesh_.set_local({face, k}, step.right_locals[k]);
        face += split.right ? 1 : 0;
        for (uint32_t k = 0; split.left && k < 3; ++k) mesh_.set_local({face, k}, step.left_locals[k]);
    }
    vertex(step);
    return true;
}

// What the wedges of the newest vertex look like.
template <class Io>
void SplitCoder<Io>::vertex(const SplitStep& step) {
    const uint32_t v = mesh_.vertices() - 1, first = mesh_.first_wedge(v), wedges = mesh_.wedges_of(v);
    if constexpr (Io::reading) {
        vertices_.resize(first + wedges, MeshVertex{{0, 0, 0}, {0, 0}, {0, 0}, {255, 255, 255, 255}, 0});
        if (has_.further()) further_.resize(first + wedges, FurtherAttributes{});
    }
    for (uint32_t w = 0; w < wedges; ++w) {
        const uint32_t parent =
            step.split.parent == none ? none : mesh_.first_wedge(step.split.parent) + step.parents[w];
        around_ = {};
        if (parent != none) add_around(parent);
        Corner last;
        for (uint32_t i = 0; i < step.split.arc.size(); ++i) {
            if (wedges > 1 && step.arc_locals[i] != w) continue;
            last = step.split.arc[i];
            add_around(mesh_.wedge({last.face, SplitMesh::next(last.k)}));
        }
        if (last.face != none) add_around(mesh_.wedge({last.face, SplitMesh::previous(last.k)}));
        if (w == 0) position(first, wedges, parent);
        attributes(first + w, parent);
    }
}

template <class Io>
void SplitCoder<Io>::add_around(uint32_t wedge) {
    const MeshVertex& v = vertices_[wedge];
    ++around_.count;
    for (size_t axis = 0; axis < 3; ++axis) around_.position[axis] += static_cast<double>(v.position[axis]);
    for (size_t axis = 0; axis < 2; ++axis) around_.normal[axis] += v.normal[axis];
    for (size_t axis = 0; axis < 2 && has_.uvs; ++axis) around_.uv[axis] += static_cast<double>(v.uv[axis]);
    if (!has_.further()) return;
    const FurtherAttributes& f = further_[wedge];
    for (size_t axis = 0; axis < 2; ++axis) around_.second_uv[axis] += static_cast<double>(f.second_uv[axis]);
    if ((f.tangent & LODE_TANGENT_THERE) == 0) return;
    ++around_.tangents;
    for (uint32_t axis = 0; axis < 2; ++axis) around_.tangent[axis] += tangent_number(f.tangent, axis);
}

template <class Io>
void SplitCoder<Io>::position(uint32_t first_wedge, uint32_t wedges, uint32_t parent) {
    const double share = around_.count == 0 ? 0 : 1 / static_cast<double>(around_.count);
    for (size_t axis = 0; axis < 3; ++axis) {
        const float reference = parent == none ? 0.0f : vertices_[parent].position[axis];
        const auto expected = static_cast<float>(around_.position[axis] * share);
        float& value = vertices_[first_wedge].position[axis];
        if (grid_ > 0) {
            on_grid(split_streams::position + axis, value, expected, reference);
        } else {
            floating(split_streams::position + axis, value, expected, reference);
        }
    }
    if constexpr (Io::reading) {
        for (uint32_t w = 1; w < wedges; ++w)
            std::copy_n(vertices_[first_wedge].position, 3, vertices_[first_wedge + w].position);
    }
}

template <class Io>
void SplitCoder<Io>::attributes(uint32_t wedge, uint32_t parent) {
    static constexpr MeshVertex nothing{{0, 0, 0}, {0, 0}, {0, 0}, {255, 255, 255, 255}, 0};
    MeshVertex& made = vertices_[wedge];
    const MeshVertex& before = parent == none ? nothing : vertices_[parent];
    for (size_t axis = 0; axis < 2; ++axis) {
        const auto mean = static_cast<uint32_t>(around_.count == 0 ? 0 : around_.normal[axis] / around_.count);
        int32_t apart = static_cast<int16_t>(static_cast<uint32_t>(made.normal[axis]) - mean);
        difference(split_streams::normal + axis, apart, 0);
        made.normal[axis] = static_cast<int16_t>(mean + static_cast<uint32_t>(apart));
    }
    const double share = around_.count == 0 ? 0 : 1 / static_cast<double>(around_.count);
    for (size_t axis = 0; axis < 2 && has_.uvs; ++axis) {
        floating(split_streams::uv + axis, made.uv[axis], static_cast<float>(around_.uv[axis] * share),
                 before.uv[axis]);
    }
    if (has_.further()) further(further_[wedge], parent == none ? FurtherAttributes{} : further_[parent]);
    for (size_t channel = 0; channel < 4 && has_.colours; ++channel) {
        uint32_t apart = static_cast<uint8_t>(made.colour[channel] - before.colour[channel]);
        apart = (apart << 1 ^ (apart >= 128 ? 0xff : 0)) & 0xff;  // small ones near 0 on both sides
        if constexpr (Io::reading) {
            apart = io_.byte(split_streams::colour + channel);
            apart = (apart >> 1 ^ ((apart & 1) != 0 ? 0xff : 0)) & 0xff;
            made.colour[channel] = static_cast<uint8_t>(before.colour[channel] + apart);
        } else {
            io_.byte(split_streams::colour + channel, static_cast<uint8_t>(apart));
        }
    }
    if (has_.materials) {
        uint32_t apart = made.material - before.material;
        number(split_streams::material, apart);
        made.material = before.material + apart;
    }
}

template <class Io>
void SplitCoder<Io>::further(FurtherAttributes& made, const FurtherAttributes& before) {
    const double share = around_.count == 0 ? 0 : 1 / static_cast<double>(around_.count);
    for (size_t axis = 0; axis < 2 && has_.second_uvs; ++axis) {
        floating(split_streams::second_uv + axis, made.second_uv[axis],
                 static_cast<float>(around_.second_uv[axis] * share), before.second_uv[axis]);
    }
    if (has_.tangents) tangent(made.tangent, before.tangent);
}

// Whether there is one, and on which side its bitangent is, against the parent's; then where it points.
template <class Io>
void SplitCoder<Io>::tangent(uint32_t& made, uint32_t before) {
    const auto kind_of = [](uint32_t word) { return word >> (2 * LODE_TANGENT_BITS); };
    uint32_t apart = kind_of(made) ^ kind_of(before);
    number(split_streams::material, apart);
    const uint32_t kind = (apart ^ kind_of(before)) << (2 * LODE_TANGENT_BITS);
    if ((kind & LODE_TANGENT_THERE) == 0) {
        made = 0;
        return;
    }
    uint32_t word = kind;
    for (uint32_t axis = 0; axis < 2; ++axis) {
        const auto mean = static_cast<uint32_t>(around_.tangents == 0 ? 0 : around_.tangent[axis] / around_.tangents);
        auto difference_to_mean = as_tangent_number(static_cast<uint32_t>(tangent_number(made, axis)) - mean);
        difference(split_streams::normal + axis, difference_to_mean, 0);
        const uint32_t is = mean + static_cast<uint32_t>(difference_to_mean);
        word |= (is & tangent_mask) << (axis * LODE_TANGENT_BITS);
    }
    made = word;
}

template class SplitCoder<NumberWriter>;
template class SplitCoder<NumberReader>;

}  // namespace lodestone
