#include "core/engine/ingest/waiting_scans.h"

#include <algorithm>
#include <cstddef>

namespace strata {

void WaitingScans::Add(ScanNumber number, absl::Time acknowledged) {
  if (!marks_.empty() && acknowledged - marks_.back().acknowledged < step_) return;
  if (marks_.size() == kMost) Thin();
  marks_.push_back({number, acknowledged});
}

// Every other mark stands for the next one, too.
void WaitingScans::Thin() {
  for (std::size_t i = 0; i < kMost / 2; ++i) marks_[i] = marks_[2 * i];
  marks_.resize(kMost / 2);
  step_ *= 2;
}

absl::Time WaitingScans::Since(ScanNumber oldest) {
  const auto after =
      std::find_if(marks_.begin(), marks_.end(), [&](const Mark& m) { return m.first > oldest; });
  if (after == marks_.begin()) return begun_;
  marks_.erase(marks_.begin(), after - 1);
  return marks_.front().acknowledged;
}

void WaitingScans::Clear() {
  marks_.clear();
  step_ = absl::Seconds(1);
}

}  // namespace strata
