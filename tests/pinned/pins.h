// Hashes of outputs, held against those of hashes.json. Where LODESTONE_PIN is set, what is found is written there
// instead: a commit that changes an output says why and brings the new hashes along.
#pragma once

#include <string>

#include "base/hash.h"

namespace lodestone::pins {

// Fails the running test where the hash is another than the one held for this name, or none is held.
void expect(const std::string& name, const Hash128& hash);
// The same for outputs that depend on a driver: skipped where `driver` is not the one the hashes were taken with.
bool taken_with(const std::string& driver);

}  // namespace lodestone::pins
