// Cuts that instances share. Which samples of an instance are wanted is told from how far away it is, and instances of
// an atlas that are about as far are drawn with one list, each once. It holds whatever any of them wants, seen from
// wherever. What one of them does not want is drawn in the middle of the edge that it halves, as vertices move by their
// own instance: on the coarser level, or off it by less than the pixel error where the edge's ends are not wanted
// either. Such a list is as it was for as long as no page comes or goes, wherever the camera flies.
//
// Where instances are so far away that no chart of them may be whole, lists are of corners alone (distant_cuts.h).
#pragma once

#include <compare>
#include <cstdint>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "vgi/draw/corners/distant_cuts.h"
#include "vgi/draw/cut/cut.h"
#include "vgi/draw/cut/incremental_cut.h"
#include "vgi/draw/cut/vertex_kinds.h"
#include "vgi/draw/open_atlas.h"

namespace lodestone::vgi {

// Of samples and leaves, and what it needs of the pages.
class SharedCut {
public:
    // Whether make() would change nothing.
    bool is_good(const Residency& residency, double magnification) const {
        return made_at_ == residency.updates() && magnification == magnification_;
    }
    // request: for a distance. demand: empty; what is in it afterwards is of no use.
    void make(const Cutter& cutter, const Residency& residency, const CutRequest& request, double magnification,
              PageDemand& demand);
    // The pages that it uses and misses. seen: whether views[0] sees an instance of it.
    void add_to(PageDemand& demand, bool seen) const;
    uint64_t taken_over() const { return kept_.taken_over; }  // triangles of the cut before, by the last make()

    const std::vector<uint32_t>& words() const { return words_; }            // as Cut::parts has them
    const std::vector<TrianglesByKind::Run>& runs() const { return runs_; }  // that they are in

private:
    std::optional<uint64_t> made_at_;  // Residency::updates
    double magnification_ = 0;
    IncrementalCut kept_;
    std::vector<uint32_t> words_, touched_;
    std::vector<TrianglesByKind::Run> runs_;
    std::vector<std::pair<uint32_t, float>> asked_;  // with PageDemand::wish
};

// Those of one atlas.
class SharedCuts {
public:
    // What instances are drawn with that are about as far away, and no nearer than nearest().
    struct Step {
        bool of_samples;  // if not, of corners alone
        int32_t number;
        auto operator<=>(const Step&) const = default;
    };
    // Instances of a step with samples that are worth it: one alone is seen from one side, and a cut of its own is half
    // as large.
    static constexpr size_t fewest = 2;

    // The atlas must outlive this.
    explicit SharedCuts(const OpenAtlas& atlas);

    // For which errors: magnification_of. What was made for others is made anew.
    void begin(double magnification);
    // Of an instance whose nearest point counts to be so far away, object units; nothing where it has a cut of its own.
    std::optional<Step> step_of(double nearest) const;
    static double nearest(Step step) { return DistantCuts::reach_of(step.number); }
    // For all instances of a step. view: sets the levels; must outlive the request.
    CutRequest request_for(Step step, const View& view, double pixel_error) const;

    const std::vector<uint32_t>& of_corners(int32_t number) { return distant_.triangles(number); }
    SharedCut& of_samples(int32_t number) { return near_[number]; }
    // Forgets all with samples but those of these steps, rising.
    void keep(const std::vector<int32_t>& numbers);
    double magnification() const { return magnification_; }

private:
    // Radii of the atlas from which on its points are about as far away as the nearest.
    static constexpr double least_radii = 4;

    DistantCuts distant_;
    int32_t least_of_corners_, least_of_samples_;  // the first steps of each
    double magnification_ = 0;
    std::map<int32_t, SharedCut> near_;
};

}  // namespace lodestone::vgi
