// The short life of a map (disk_history.h) on disks that fail, fill up and lose power, at every
// moment of it.
#ifndef STRATA_TESTS_CORE_ENGINE_DISK_CAMPAIGN_H_
#define STRATA_TESTS_CORE_ENGINE_DISK_CAMPAIGN_H_

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"

#include "tests/core/engine/disk_history.h"
#include "tests/support/faults/faulty_disk.h"
#include "tests/support/temp_dir.h"

namespace strata::testing {

struct Sweep {
  std::int64_t first = 0;  // moment of the first trial
  std::int64_t every = 1;  // moments from trial to trial
  std::uint64_t seed = 1;
  // Told of each trial as it ends.
  std::function<void(const std::string& trial)> progress;
};

struct SweepResult {
  std::int64_t moments = 0;       // there are, in an undisturbed run
  std::int64_t trials = 0;        // in which the disk failed
  std::int64_t steps_failed = 0;  // that said so
  std::int64_t restarts = 0;      // without which the map would not have gone on
  std::vector<std::string> violations;
};

class DiskCampaign {
 public:
  // Lives the life undisturbed and notes what the map is after each step, which a new map of the
  // same scans confirms.
  static absl::StatusOr<DiskCampaign> Prepare();

  // Of the undisturbed life: operations of a kind, bytes that files grew by, moments for a cut.
  std::int64_t moments(DiskFault fault) const {
    return operations_[static_cast<std::size_t>(fault)];
  }
  std::int64_t moments_of_opening(DiskFault fault) const {
    return opening_[static_cast<std::size_t>(fault)];
  }
  std::int64_t bytes() const { return grown_; }
  std::int64_t cuts() const { return cuts_; }

  // From operation n of the kind on, one or all fail. What answered OK is there; what failed has
  // happened as a whole or not at all; the map goes on by itself once the disk does, and ends as
  // the undisturbed one.
  SweepResult FailOnce(DiskFault fault, const Sweep& sweep) const;
  SweepResult FailUntilMended(DiskFault fault, const Sweep& sweep) const;
  // After byte n the disk is full until it is mended.
  SweepResult FillUp(const Sweep& sweep) const;
  // The map is opened after its power was cut, and operation n of that fails. It opens, or says
  // what is wrong and opens the next time.
  SweepResult FailOnOpening(DiskFault fault, const Sweep& sweep) const;
  // Power is cut at operation n. `lying`: of a disk that ignores syncs, whose violations show that
  // this can tell.
  SweepResult CutPower(bool lying, const Sweep& sweep) const;

 private:
  struct Trial {
    std::string violation;
    bool failed = false;  // the disk did
    std::int64_t steps_failed = 0;
    std::int64_t restarts = 0;
  };
  using Arm = std::function<void(FaultyDisk&)>;

  DiskCampaign() = default;
  Trial RunOnFaultyDisk(const Arm& arm, bool until_mended, bool reopen) const;
  Trial RunOpening(const Arm& arm) const;
  Trial RunUntilCut(std::int64_t moment, std::uint64_t seed, bool lying) const;
  // Empty, or how the map is neither as after `steps` steps nor as after one more.
  std::string CompareAfter(api::Database& database, std::size_t steps) const;
  static SweepResult Run(const Sweep& sweep,
                         std::int64_t moments,
                         const std::function<Trial(std::int64_t)>& trial);

  std::vector<WorldState> states_;  // after so many steps
  std::array<std::int64_t, kDiskFaults> operations_{};
  std::int64_t grown_ = 0;
  std::int64_t cuts_ = 0;
  std::shared_ptr<const TempDir> cut_;  // the map after its last step, its power cut
  std::array<std::int64_t, kDiskFaults> opening_{};
};

}  // namespace strata::testing

#endif  // STRATA_TESTS_CORE_ENGINE_DISK_CAMPAIGN_H_
