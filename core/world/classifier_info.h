// A classifier that a map keeps, without its bytes.
#ifndef STRATA_CORE_WORLD_CLASSIFIER_INFO_H_
#define STRATA_CORE_WORLD_CLASSIFIER_INFO_H_

#include <cstdint>
#include <map>
#include <string>

#include "absl/time/time.h"

namespace strata {

// Never changes once it is there; another training makes another one.
struct ClassifierInfo {
  std::uint64_t id = 0;  // in the map, never used twice
  std::string name;      // unique in the map; ValidateName
  absl::Time created;
  std::uint64_t job = 0;                          // that trained it; 0: imported
  std::string description;                        // where it comes from, for people
  std::map<std::string, std::string> parameters;  // of its training; classes as "1=ground,2=wall"
  // How good it was, by validation while it was trained; empty where that was not possible.
  std::map<std::string, double> scores;
  std::uint64_t bytes = 0;  // what Export gives

  friend bool operator==(const ClassifierInfo&, const ClassifierInfo&) = default;
};

// Larger ones are refused.
inline constexpr std::uint64_t kMaxClassifierBytes = std::uint64_t{64} << 20;

}  // namespace strata

#endif  // STRATA_CORE_WORLD_CLASSIFIER_INFO_H_
