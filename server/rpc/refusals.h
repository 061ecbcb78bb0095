// When refusing is not enough.
#ifndef STRATA_SERVER_RPC_REFUSALS_H_
#define STRATA_SERVER_RPC_REFUSALS_H_

#include "absl/time/time.h"

namespace strata::server {

// Counts the calls of somebody that are refused where they come in. Not thread-safe.
class Refusals {
 public:
  Refusals() = default;

  void Add(absl::Time now) {
    // A clock that was set back begins anew as well.
    if (absl::AbsDuration(now - since_) > kCounted) *this = Refusals(now);
    ++count_;
  }
  bool many() const { return count_ >= kMany; }
  // True once for each five hundred within a second: a connection they come by must be cut.
  // Hundreds of clients that pause between their attempts stay below.
  bool TakeMany() {
    const bool taken = many();
    if (taken) count_ = 0;
    return taken;
  }

 private:
  static constexpr int kMany = 500;
  static constexpr absl::Duration kCounted = absl::Seconds(1);

  explicit Refusals(absl::Time since) : since_(since) {}

  absl::Time since_;
  int count_ = 0;
};

}  // namespace strata::server

#endif  // STRATA_SERVER_RPC_REFUSALS_H_
