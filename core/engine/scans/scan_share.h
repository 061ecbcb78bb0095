// Memory for work on large scans.
#ifndef STRATA_CORE_ENGINE_SCANS_SCAN_SHARE_H_
#define STRATA_CORE_ENGINE_SCANS_SCAN_SHARE_H_

#include <cstddef>
#include <memory>

#include "core/common/cache_budget.h"
#include "core/storage/storage.h"

namespace strata {

// Taken from what caches may hold for as long as a scan is worked on whole. A large scan takes more
// than a third of that, so that one is worked on at a time, whatever maps and jobs there are; a
// small one (some 180,000 points) nothing, and waits for nobody. Of a thread that has one already
// another takes nothing either. Hold it for steps that end by themselves, on the thread that took
// it, and wait for no other thread's meanwhile.
class ScanShare {
 public:
  // Whether the scan takes nothing.
  static bool IsSmall(const ScanRecord& scan);
  // Waits for its turn.
  ScanShare(const std::shared_ptr<CacheBudget>& budget, const ScanRecord& scan);
  ~ScanShare();
  ScanShare(const ScanShare&) = delete;
  ScanShare& operator=(const ScanShare&) = delete;

 private:
  const std::shared_ptr<CacheBudget> budget_;
  std::size_t bytes_ = 0;
};

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_SCANS_SCAN_SHARE_H_
