// The order `keyframe`: faces are ordered anew whenever a share of them has died, each time in the order that costs
// least over all the levels until the next time.
#pragma once

#include <memory>

#include "lod/bake/orders/face_order.h"

namespace lodestone {

std::unique_ptr<FaceOrderer> make_keyframe_orderer(const OrderOptions& options);

}  // namespace lodestone
