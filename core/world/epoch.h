// The history of a map: each epoch is one globally consistent state of poses and tiles.
#ifndef STRATA_CORE_WORLD_EPOCH_H_
#define STRATA_CORE_WORLD_EPOCH_H_

#include <cstdint>
#include <string>

#include "absl/time/time.h"

namespace strata {

struct EpochInfo {
  std::uint64_t epoch = 0;
  absl::Time created;
  std::string reason;         // for people: what made it
  std::uint64_t job = 0;      // that made it; 0: none
  std::uint64_t decided = 0;  // scans that got a pose in it
  bool current = false;
  bool kept = true;  // false: its poses are no longer all known, it cannot be reverted to
};

}  // namespace strata

#endif  // STRATA_CORE_WORLD_EPOCH_H_
