#include "lod/asset/face_walk.h"

#include <algorithm>
#include <bit>

#include "base/none.h"
#include "lod/asset/split_coder.h"

namespace lodestone {

namespace {

// Of a step: across the first or the second edge of the last face, 2 + n to the nth open face, or anywhere.
constexpr uint32_t first_open = 2, most_open = 250, anywhere = 255;
constexpr size_t contexts = 12;

// Faces that can be gone on to are told by their edges towards the face they were seen from: codes of SplitMesh.
constexpr uint32_t face_of(uint32_t edge) { return edge / 4; }

template <class Io>
class FaceWalk {
public:
    FaceWalk(Io& io, const SplitMesh& mesh, std::vector<uint32_t>& order)
        : io_(io), mesh_(mesh), order_(order), across_(mesh.across()), marks_(mesh.face_count(), Mark::open) {}

    bool run() {
        const uint32_t faces = mesh_.face_count();
        if constexpr (Io::reading) order_.resize(faces);
        for (uint32_t i = 0; i < faces; ++i) {
            const uint32_t next = step(Io::reading ? none : order_[i]), face = face_of(next);
            if (face >= faces || marks_[face] != Mark::open) return false;
            if constexpr (Io::reading) order_[i] = face;
            enter(next);
        }
        return true;
    }

private:
    // No type that may be any other's bytes: writing one is no reason to read everything else again.
    enum class Mark : uint8_t { open, taken };

    bool is_open(uint32_t edge) const { return edge != none && marks_[face_of(edge)] == Mark::open; }

    // The edge to go on to; its face given where it is written.
    uint32_t step(uint32_t wanted) {
        const uint32_t can = (is_open(ahead_[0]) ? 1 : 0) + (is_open(ahead_[1]) ? 2 : 0);
        const size_t stream = split_streams::walk + can * 3 + before_;
        uint32_t code = anywhere, next = none, rank = 0;
        if constexpr (Io::reading) {
            code = io_.byte(stream);
            rank = code - first_open;
            if (code >= first_open && code != anywhere && !find(rank, none, next)) return none;
        } else {
            if ((can & 1) != 0 && face_of(ahead_[0]) == wanted) {
                code = 0;
            } else if ((can & 2) != 0 && face_of(ahead_[1]) == wanted) {
                code = 1;
            } else if (find(rank, wanted, next)) {
                code = first_open + rank;
            }
            io_.byte(stream, static_cast<uint8_t>(code));
        }
        if (code < first_open) next = ahead_[code];
        if (code == anywhere) next = any(wanted) * 4;
        for (const uint32_t side : {1u, 0u}) {
            if ((can >> side & 1) != 0 && face_of(ahead_[side]) != face_of(next)) open_.push_back(ahead_[side]);
        }
        before_ = std::min(code, first_open);
        return next;
    }

    uint32_t any(uint32_t wanted) {
        const auto width = static_cast<uint32_t>(std::bit_width(mesh_.face_count() - 1));
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
        while (!open_.empty() && !is_open(open_.back())) open_.pop_back();
        if (!open_.empty() && (wanted == none ? rank == 0 : face_of(open_.back()) == wanted)) {
            found = open_.back();
            rank = 0;
            return true;
        }
        size_t kept = open_.size(), at = open_.size();  // those from `kept` on are open and passed
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
            std::copy(open_.begin() + static_cast<ptrdiff_t>(kept), open_.end(),
                      open_.begin() + static_cast<ptrdiff_t>(at));
            open_.resize(at + passed);
        }
        return is_found;
    }

    void enter(uint32_t edge) {
        marks_[face_of(edge)] = Mark::taken;
        const uint32_t k = edge % 4, *across = across_ + (edge - k);
        ahead_[0] = across[SplitMesh::next(k)];
        ahead_[1] = across[SplitMesh::previous(k)];
        // Mostly the walk goes on to one of the two; both are fetched before it is known to which.
        for (const uint32_t seen : ahead_) {
            if (seen != none) __builtin_prefetch(across_ + seen);
        }
        // Of a face that was come to from nowhere the third neighbour is open, too.
        if (is_open(across[k])) open_.push_back(across[k]);
    }

    Io& io_;
    const SplitMesh& mesh_;
    std::vector<uint32_t>& order_;
    const uint32_t* across_;
    std::vector<Mark> marks_;
    std::vector<uint32_t> open_;
    uint32_t ahead_[2] = {none, none};
    uint32_t before_ = 2;  // the kind of the last step
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
