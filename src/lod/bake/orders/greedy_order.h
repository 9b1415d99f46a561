// The order `greedy`, the seed's own: after each group of collapses a few slots are permuted in place by tswaps, chosen
// by a greedy search that weighs transforms saved against slots and lines of the CPU's cache written.
// Kuzikowski, Belago, Gladky, Elykov, "Hardware Friendly Continuous Level of Details", Graphicon 2005, section 5.
//
// A face that dies waits in its slot, degenerate. At the end of a group
//   1. where too many slots are dead, the last faces of the drawn range are taken into a window of slots where their
//      neighbours are and dead slots wait; the window is ordered anew and the range gets shorter;
//   2. otherwise a window that the collapses have worn is ordered anew, if that saves more than it weighs;
//   3. where the whole range is little more than a window, it is ordered anew when three tenths of it are dead.
// So that the faces at the end have neighbours everywhere, full detail is drawn in runs by bit reversal: the second
// half of the buffer holds every other run.
#pragma once

#include <memory>

#include "lod/bake/orders/face_order.h"

namespace lodestone {

std::unique_ptr<FaceOrderer> make_greedy_orderer(const OrderOptions& options);

}  // namespace lodestone
