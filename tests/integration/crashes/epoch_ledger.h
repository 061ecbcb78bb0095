// What many clients were told of the epochs of a map, held against each other.
#ifndef STRATA_TESTS_INTEGRATION_EPOCH_LEDGER_H_
#define STRATA_TESTS_INTEGRATION_EPOCH_LEDGER_H_

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/synchronization/mutex.h"

#include "core/geometry/pose.h"
#include "core/world/plan.h"
#include "core/world/scan.h"
#include "tests/integration/marked_yard.h"

namespace strata::testing {

// Within an epoch a scan that is in the map has one pose, and so has its mark: answers that differ
// were not of one epoch. Contradictions become test failures at once. Thread-safe.
class EpochLedger {
 public:
  // An integrated scan's pose; `who` was told so.
  void SawPose(const std::string& who, std::uint64_t epoch, const ScanId& id, const Pose& pose);
  // All marks of all tiles of one answer.
  void SawMarks(const std::string& who, std::uint64_t epoch, const std::map<ScanId, Mark>& marks);
  void SawPlan(const PlanResult& plan);

  // Holds the marks and plans of every epoch against its poses.
  struct Compared {
    std::size_t epochs = 0;
    std::size_t marks = 0;
    std::size_t plans = 0;
    std::size_t poses_unknown = 0;  // marks and plans of scans whose pose nobody asked for in time
  };
  Compared Compare() const;
  // How far scan `id` moved in height between two epochs that follow each other, at least [m].
  double SmallestLift(const ScanId& id) const;

 private:
  using Key = std::pair<std::uint64_t, ScanId>;  // epoch first
  struct Heights {
    double lowest = 0.0, highest = 0.0;
  };

  mutable absl::Mutex mutex_;
  std::map<Key, Pose> poses_ ABSL_GUARDED_BY(mutex_);
  std::map<Key, Mark> marks_ ABSL_GUARDED_BY(mutex_);
  std::multimap<std::uint64_t, Heights> plans_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace strata::testing

#endif  // STRATA_TESTS_INTEGRATION_EPOCH_LEDGER_H_
