// For how long scans have waited for integration.
#ifndef STRATA_CORE_ENGINE_INGEST_WAITING_SCANS_H_
#define STRATA_CORE_ENGINE_INGEST_WAITING_SCANS_H_

#include <cstddef>
#include <vector>

#include "absl/time/time.h"

#include "core/storage/records.h"

namespace strata {

// When which scans were acknowledged, in a few kilobytes however many wait: to the second, and once
// they wait for long to some hundredth of that. One thread at a time.
class WaitingScans {
 public:
  // What is not added waits since then.
  explicit WaitingScans(absl::Time begun) : begun_(begun) { marks_.reserve(kMost); }

  // Later ones have larger numbers. Takes no memory.
  void Add(ScanNumber number, absl::Time acknowledged);
  // Since when `oldest` waits, or a little before; those before it are forgotten.
  absl::Time Since(ScanNumber oldest);
  // None waits.
  void Clear();

 private:
  static constexpr std::size_t kMost = 256;
  // Scans of a number from `first` on, up to the next mark's.
  struct Mark {
    ScanNumber first;
    absl::Time acknowledged;
  };
  void Thin();

  absl::Time begun_;
  absl::Duration step_ = absl::Seconds(1);  // between marks, at least
  std::vector<Mark> marks_;                 // ascending
};

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_INGEST_WAITING_SCANS_H_
