// The seed's own optimiser: a greedy search that adds one face after another, each time the one that uses the vertex
// cache best, with preference for faces that are in place already and for lines of the CPU cache that are written
// anyway. Kuzikowski, Belago, Gladky, Elykov, "Hardware Friendly Continuous Level of Details", Graphicon 2005,
// section 5.
#pragma once

#include <memory>

#include "lod/bake/orders/face_order.h"

namespace lodestone {

std::unique_ptr<FaceOrderer> make_greedy_orderer(const OrderOptions& options);

}  // namespace lodestone
