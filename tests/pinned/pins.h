// Hashes of outputs, held against those of hashes.json. Where LODESTONE_PIN is set, what is found is written there
// instead: a commit that changes an output says why and brings the new hashes along.
#pragma once

#include <string>

#include "base/hash.h"

namespace lodestone::pins {

// Fails the running test where the hash is another than the one held for this name, or none is held.
void expect(const std::string& name, const Hash128& hash);
// Who made the processor. What a software rasteriser draws is not the same on those of AMD and of Intel.
std::string processor();
// For outputs that depend on a driver: whether hashes of this processor() were taken with `driver`, so that they can be
// expected.
bool taken_with(const std::string& driver);

}  // namespace lodestone::pins
