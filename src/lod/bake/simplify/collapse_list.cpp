#include "lod/bake/simplify/collapse_list.h"

#include <algorithm>
#include <array>

namespace lodestone {

std::string describe(StopReason reason) {
    switch (reason) {
        case StopReason::target_reached:
            return "the wanted number of triangles was reached";
        case StopReason::topology:
            return "every collapse left would change the topology or tear a boundary or seam";
        case StopReason::flips:
            return "every collapse left would turn a triangle over";
    }
    return "";
}

namespace {

// The connectivity a list is replayed on: plain vectors, nothing shared with any simplifier.
class Connectivity {
public:
    explicit Connectivity(const TriMesh& mesh)
        : mesh_(mesh), faces_(mesh.triangles), faces_of_(mesh.vertex_count()), gone_(mesh.vertex_count(), false) {
        for (uint32_t f = 0; f < faces_.size(); ++f) {
            for (int k = 0; k < 3; ++k) faces_of_[vertex(f, k)].push_back(f);
        }
    }

    // What is wrong with the collapse, empty if nothing; then it has been made.
    std::string collapse(const Collapse& c, const std::vector<WedgePair>& pairs) {
        if (c.removed >= gone_.size() || c.kept >= gone_.size() || c.removed == c.kept)
            return "its vertices are out of range";
        if (gone_[c.removed] || gone_[c.kept]) return "a vertex of it is gone already";
        if (c.wedge_count == 0 || uint64_t{c.first_wedge} + c.wedge_count > pairs.size())
            return "its wedge pairs are out of range";
        bool joined = false;
        for (const uint32_t f : faces_of_[c.removed]) joined |= has(f, c.kept);
        if (!joined) return "its vertices share no edge";
        std::vector<uint32_t>& moved = faces_of_[c.removed];
        for (const uint32_t f : moved) {
            for (uint32_t& w : faces_[f]) {
                if (mesh_.wedge_vertex[w] != c.removed) continue;
                const auto* pair = std::find_if(&pairs[c.first_wedge], &pairs[c.first_wedge] + c.wedge_count,
                                                [&](const WedgePair& p) { return p.removed == w; });
                if (pair == &pairs[c.first_wedge] + c.wedge_count)
                    return "wedge " + std::to_string(w) + " is in use and has no pair";
                if (pair->kept >= mesh_.wedge_count() || mesh_.wedge_vertex[pair->kept] != c.kept)
                    return "a pair leads to another vertex";
                w = pair->kept;
            }
        }
        for (const uint32_t f : moved) {
            const bool dies =
                vertex(f, 0) == vertex(f, 1) || vertex(f, 1) == vertex(f, 2) || vertex(f, 2) == vertex(f, 0);
            if (!dies) {
                faces_of_[c.kept].push_back(f);
                continue;
            }
            for (int k = 0; k < 3; ++k) std::erase(faces_of_[vertex(f, k)], f);
        }
        moved.clear();
        gone_[c.removed] = true;
        if (faces_of_[c.kept].empty()) return "nothing is left of the component";
        return check_around(c.kept);
    }

private:
    uint32_t vertex(uint32_t face, int corner) const {
        return mesh_.wedge_vertex[faces_[face][static_cast<size_t>(corner)]];
    }
    bool has(uint32_t face, uint32_t v) const {
        return vertex(face, 0) == v || vertex(face, 1) == v || vertex(face, 2) == v;
    }

    // Manifold at the vertex: every edge at it has at most two faces, which run opposite ways; no face twice; one fan.
    std::string check_around(uint32_t v) const {
        std::vector<uint32_t> outgoing, incoming;  // at each face: the vertex after v, the vertex before
        for (const uint32_t f : faces_of_[v]) {
            const int k = vertex(f, 0) == v ? 0 : vertex(f, 1) == v ? 1 : 2;
            outgoing.push_back(vertex(f, (k + 1) % 3));
            incoming.push_back(vertex(f, (k + 2) % 3));
        }
        for (const auto* list : {&outgoing, &incoming}) {
            std::vector<uint32_t> sorted = *list;
            std::sort(sorted.begin(), sorted.end());
            if (std::adjacent_find(sorted.begin(), sorted.end()) != sorted.end())
                return "an edge gets more than two faces or two that run the same way";
        }
        // One fan: following incoming -> outgoing visits every face. Begin at the open end if there is one.
        uint32_t at = outgoing[0];
        for (const uint32_t o : outgoing) {
            if (std::find(incoming.begin(), incoming.end(), o) == incoming.end()) at = o;
        }
        size_t visited = 0;
        for (; visited < outgoing.size(); ++visited) {
            const auto found = std::find(outgoing.begin(), outgoing.end(), at);
            if (found == outgoing.end()) break;
            at = incoming[static_cast<size_t>(found - outgoing.begin())];
        }
        if (visited != outgoing.size()) return "a vertex gets more than one fan of faces";
        if (outgoing.size() == 2 && outgoing[0] == incoming[1] && incoming[0] == outgoing[1])
            return "two faces get the same three vertices";
        for (const uint32_t f : faces_of_[v]) {
            for (int k = 0; k < 3; ++k) {
                const uint32_t n = vertex(f, k);
                if (n != v && faces_of_[n].size() == 2 && same_faces(faces_of_[n][0], faces_of_[n][1]))
                    return "two faces get the same three vertices";
            }
        }
        return "";
    }
    bool same_faces(uint32_t f, uint32_t g) const {
        return has(g, vertex(f, 0)) && has(g, vertex(f, 1)) && has(g, vertex(f, 2));
    }

    const TriMesh& mesh_;
    std::vector<Triangle> faces_;
    std::vector<std::vector<uint32_t>> faces_of_;
    std::vector<bool> gone_;
};

}  // namespace

Result<void> CollapseList::write_chunks(ChunkWriter& writer) const {
    if (auto done = writer.add_array("lod/collapses", std::span(collapses)); !done) return done;
    if (auto done = writer.add_array("lod/wedge_pairs", std::span(wedge_pairs)); !done) return done;
    const std::array<uint64_t, 3> counts{static_cast<uint64_t>(stop), blocked_by_topology, blocked_by_flips};
    return writer.add_array("lod/collapse_counts", std::span<const uint64_t>(counts));
}

Result<CollapseList> CollapseList::open(const ChunkFile& file) {
    const auto collapses = file.array<Collapse>("lod/collapses");
    if (!collapses) return tl::unexpected(collapses.error());
    const auto pairs = file.array<WedgePair>("lod/wedge_pairs");
    if (!pairs) return tl::unexpected(pairs.error());
    const auto counts = file.array<uint64_t>("lod/collapse_counts");
    if (!counts) return tl::unexpected(counts.error());
    if (counts->size() != 3 || (*counts)[0] > static_cast<uint64_t>(StopReason::flips))
        return fail(Fault::format, file.path().string() + ": its collapses are not counted");
    CollapseList list;
    list.collapses.assign(collapses->begin(), collapses->end());
    list.wedge_pairs.assign(pairs->begin(), pairs->end());
    list.stop = static_cast<StopReason>((*counts)[0]);
    list.blocked_by_topology = (*counts)[1];
    list.blocked_by_flips = (*counts)[2];
    return list;
}

Result<void> CollapseList::validate(const TriMesh& mesh) const {
    Connectivity connectivity(mesh);
    for (size_t i = 0; i < collapses.size(); ++i) {
        const std::string what = connectivity.collapse(collapses[i], wedge_pairs);
        if (what.empty()) continue;
        return fail(Fault::invariant, "collapse " + std::to_string(i) + " (" + std::to_string(collapses[i].removed) +
                                          " to " + std::to_string(collapses[i].kept) + "): " + what);
    }
    return {};
}

}  // namespace lodestone
