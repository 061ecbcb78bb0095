// Calls that are refused where they come in.
#ifndef STRATA_SERVER_RPC_REFUSALS_H_
#define STRATA_SERVER_RPC_REFUSALS_H_

#include <set>
#include <utility>
#include <vector>

#include "absl/time/time.h"

namespace strata::server {

// What becomes of a call where it comes in.
struct Arrival {
  bool in = true;              // false: it is refused
  std::vector<int> cut_lanes;  // of which the connections must be cut; see Connections
};

// Counts the calls of somebody. Not thread-safe.
class Refusals {
 public:
  Refusals() = default;

  // With the five hundredth within a second all lanes are cut that they came by. Hundreds of
  // clients that pause between their attempts stay below.
  Arrival Add(int lane, absl::Time now) {
    // A clock that was set back begins anew as well.
    if (absl::AbsDuration(now - since_) > kCounted) *this = Refusals(now);
    lanes_.insert(lane);
    if (++count_ < kMany) return {.in = false, .cut_lanes = {}};
    count_ = 0;
    const std::set<int> lanes = std::exchange(lanes_, {});
    return {.in = false, .cut_lanes = {lanes.begin(), lanes.end()}};
  }

 private:
  static constexpr int kMany = 500;
  static constexpr absl::Duration kCounted = absl::Seconds(1);

  explicit Refusals(absl::Time since) : since_(since) {}

  absl::Time since_;
  int count_ = 0;
  std::set<int> lanes_;
};

}  // namespace strata::server

#endif  // STRATA_SERVER_RPC_REFUSALS_H_
