// Whether the reader of a stream keeps up.
#ifndef STRATA_SERVER_RPC_READER_PACE_H_
#define STRATA_SERVER_RPC_READER_PACE_H_

#include <algorithm>
#include <cstddef>

#include "absl/time/time.h"

namespace strata::server {

// How far a reader is behind one that takes kLeastBytesPerSecond, in time. What it took faster than
// that counts for nothing later. One thread at a time.
class ReaderPace {
 public:
  static constexpr std::size_t kLeastBytesPerSecond = std::size_t{32} << 10;

  // `limit`: by how much it may be behind.
  explicit ReaderPace(absl::Duration limit) : limit_(limit) {}

  // How long the next message may be waited for.
  absl::Duration patience() const { return limit_ - behind_; }
  void Took(std::size_t bytes, absl::Duration waited) {
    const absl::Duration allowed =
        absl::Seconds(static_cast<double>(bytes) / static_cast<double>(kLeastBytesPerSecond));
    behind_ = std::max(absl::ZeroDuration(), behind_ + waited - allowed);
  }

 private:
  const absl::Duration limit_;
  absl::Duration behind_;
};

}  // namespace strata::server

#endif  // STRATA_SERVER_RPC_READER_PACE_H_
