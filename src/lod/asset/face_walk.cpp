#include "lod/asset/face_walk.h"

#include <algorithm>
#include <array>
#include <bit>

#include "base/none.h"
#include "lod/asset/split_coder.h"

namespace lodestone {

namespace {

// Of a step: across the first or the second edge of the last face, 2 + n to the nth open face, or anywhere.
constexpr uint32_t first_open = 2, most_open = 250, anywhere = 255;
constexpr size_t contexts = 12;

// Faces that can be gone on to are told by their edges towards the face they were seen from: codes of SplitMesh.
constexpr uint32_t face_of(uint32_t edge) { return edge / 3; }

// The numbers of a walk: the streams of its contexts, with what is read of them at hand.
template <class Io>
class WalkNumbers {
public:
    explicit WalkNumbers(Io& io) : io_(io) {
        if constexpr (Io::reading) {
            for (size_t c = 0; c < contexts; ++c) {
                const auto rest = io_.rest(split_streams::walk + c);
                next_[c] = begin_[c] = rest.data();
                end_[c] = rest.data() + rest.size();
            }
        }
    }
    // Past the end it is 0, and the reader is broken.
    uint32_t take(size_t context) {
        if (next_[context] == end_[context]) return io_.past_end();
        return *next_[context]++;
    }
    void put(size_t context, uint32_t code) { io_.byte(split_streams::walk + context, static_cast<uint8_t>(code)); }
    void finish() {
        for (size_t c = 0; c < contexts; ++c)
            io_.took(split_streams::walk + c, static_cast<size_t>(next_[c] - begin_[c]));
    }

private:
    Io& io_;
    std::array<const uint8_t*, contexts> next_{}, begin_{}, end_{};
};

template <class Io>
class FaceWalk {
public:
    FaceWalk(Io& io, const SplitMesh& mesh, std::vector<uint32_t>& order)
        : io_(io), faces_(mesh.face_count()), order_(order), across_(mesh.across()), taken_(faces_ / 64 + 1, 0) {
        take(faces_);  // stands for what is behind a border
    }

    bool run() {
        if constexpr (Io::reading) order_.resize(faces_);
        WalkNumbers<Io> numbers(io_);
        uint32_t before = 2;  // the kind of the last step
        for (uint32_t i = 0; i < faces_; ++i) {
            const uint32_t can = (is_open(first_) ? 1 : 0) + (is_open(second_) ? 2 : 0);
            const uint32_t context = can * 3 + before;
            uint32_t code = 0, next = none;
            if constexpr (Io::reading) {
                code = numbers.take(context);
            } else {
                code = code_of(order_[i], can, next);
                numbers.put(context, code);
            }
            if (open_count_ + 3 > room_) open_.resize(room_ *= 2);
            before = std::min(code, first_open);
            if (code < first_open) {
                // Chosen by bits, not by a branch. The side that is left aside is opened, if it is not the same face.
                const uint32_t swap = (first_ ^ second_) & (0u - code), other = second_ ^ swap;
                next = first_ ^ swap;
                open_[open_count_] = other;
                open_count_ += (can >> (1 - code) & 1) & (face_of(other) != face_of(next) ? 1 : 0);
                if ((can >> code & 1) == 0) return false;
            } else if (!leap(code, can, next, Io::reading ? none : order_[i])) {
                return false;
            }
            if constexpr (Io::reading) order_[i] = face_of(next);
            enter(next);
            // Of a face that was come to from nowhere the third neighbour is open, too.
            if (code == anywhere && is_open(across_[next])) open_[open_count_++] = across_[next];
        }
        if constexpr (Io::reading) numbers.finish();
        return true;
    }

private:
    bool is_open(uint32_t edge) const {
        const uint32_t face = std::min(face_of(edge), faces_);
        return (taken_[face / 64] >> (face % 64) & 1) == 0;
    }
    void take(uint32_t face) { taken_[face / 64] |= uint64_t{1} << (face % 64); }

    // How a face that is written is gone on to, and where it is an open one, its edge.
    uint32_t code_of(uint32_t wanted, uint32_t can, uint32_t& edge) {
        if ((can & 1) != 0 && face_of(first_) == wanted) return 0;
        if ((can & 2) != 0 && face_of(second_) == wanted) return 1;
        uint32_t rank = 0;
        return find(rank, wanted, edge) ? first_open + rank : anywhere;
    }

    // On to an open face, or to any. False where there is none of that rank, or it is taken.
    bool leap(uint32_t code, uint32_t can, uint32_t& next, uint32_t wanted) {
        if (code == anywhere) {
            next = any(wanted) * 3;
            if (!is_open(next)) return false;
        } else if constexpr (Io::reading) {
            uint32_t rank = code - first_open;
            if (!near(rank, next) && !find(rank, none, next)) return false;
        }
        open_[open_count_] = second_;
        open_count_ += can >> 1 & (face_of(second_) != face_of(next) ? 1 : 0);
        open_[open_count_] = first_;
        open_count_ += can & 1 & (face_of(first_) != face_of(next) ? 1 : 0);
        return true;
    }

    // The open face of this rank, if it is among the last few of the list, which are rid of what is open no more.
    // Without branches, for nobody could guess them.
    bool near(uint32_t rank, uint32_t& found) {
        constexpr size_t few = 12;
        if (open_count_ < few) return false;
        uint32_t* last = open_.data() + (open_count_ - few);
        size_t count = 0;
        for (size_t i = 0; i < few; ++i) {
            const uint32_t seen = last[i];
            last[count] = seen;
            count += is_open(seen) ? 1 : 0;
        }
        open_count_ -= few - count;
        if (rank >= count) return false;
        found = last[count - 1 - rank];
        return true;
    }

    uint32_t any(uint32_t wanted) {
        const auto width = static_cast<uint32_t>(std::bit_width(faces_ - 1));
        if constexpr (Io::reading) {
            return io_.bits(split_streams::order_bits, width);
        } else {
            io_.bits(split_streams::order_bits, wanted, width);
            return wanted;
        }
    }

    // Where `wanted` is none, the open face of this rank, the last opened first; otherwise the rank of the one wanted.
    // Leaves out of the list what it passes and is no longer open.
    bool find(uint32_t& rank, uint32_t wanted, uint32_t& found) {
        // What is on top is what is mostly wanted.
        while (open_count_ > 0 && !is_open(open_[open_count_ - 1])) --open_count_;
        if (open_count_ > 0) {
            const uint32_t top = open_[open_count_ - 1];
            if (wanted == none ? rank == 0 : face_of(top) == wanted) {
                found = top;
                rank = 0;
                return true;
            }
        }
        size_t kept = open_count_, at = open_count_;  // those from `kept` on are open and passed
        uint32_t passed = 0;
        bool is_found = false;
        while (at > 0 && passed < most_open && !is_found) {
            const uint32_t seen = open_[--at];
            if (!is_open(seen)) continue;
            is_found = wanted == none ? passed == rank : face_of(seen) == wanted;
            if (is_found) {
                found = seen;
                rank = passed;
            }
            open_[--kept] = seen;
            ++passed;
        }
        if (kept != at) {
            std::copy(open_.begin() + static_cast<ptrdiff_t>(kept), open_.begin() + static_cast<ptrdiff_t>(open_count_),
                      open_.begin() + static_cast<ptrdiff_t>(at));
            open_count_ = at + passed;
        }
        return is_found;
    }

    void enter(uint32_t edge) {
        take(face_of(edge));
        const uint32_t k = edge % 3, *across = across_ + (edge - k);
        first_ = across[SplitMesh::next(k)];
        second_ = across[SplitMesh::previous(k)];
        // Mostly the walk goes on to one of the two; both are fetched before it is known to which.
        __builtin_prefetch(across_ + (first_ == none ? 0 : first_));
        __builtin_prefetch(across_ + (second_ == none ? 0 : second_));
    }

    Io& io_;
    const uint32_t faces_;
    std::vector<uint32_t>& order_;
    const uint32_t* across_;
    std::vector<uint64_t> taken_;  // a bit per face
    size_t room_ = 1024;
    std::vector<uint32_t> open_ = std::vector<uint32_t>(room_);  // the first so many are used
    size_t open_count_ = 0;
    uint32_t first_ = none, second_ = none;  // edges to go on to
};

}  // namespace

template <class Io>
bool code_walk(Io& io, const SplitMesh& mesh, std::vector<uint32_t>& order) {
    static_assert(split_streams::walk + contexts == split_streams::count);
    return FaceWalk<Io>(io, mesh, order).run();
}

template bool code_walk(NumberWriter&, const SplitMesh&, std::vector<uint32_t>&);
template bool code_walk(NumberReader&, const SplitMesh&, std::vector<uint32_t>&);

}  // namespace lodestone
