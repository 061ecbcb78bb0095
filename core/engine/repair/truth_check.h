// Checks truth itself: every piece of every scan, every pose, every constraint.
#ifndef STRATA_CORE_ENGINE_REPAIR_TRUTH_CHECK_H_
#define STRATA_CORE_ENGINE_REPAIR_TRUTH_CHECK_H_

#include <cstdint>
#include <string>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"

#include "core/engine/map/job_context.h"
#include "core/engine/map/map_core.h"
#include "core/engine/map/steady_view.h"
#include "core/storage/storage.h"

namespace strata {

class TruthCheck {
 public:
  using Report = absl::FunctionRef<void(const std::string&)>;

  // Checks the scans that `view` shows.
  TruthCheck(MapCore& core, const SteadyView& view, JobContext& context)
      : core_(core), view_(view), context_(context) {}

  // Calls `report` with every thing that is not as it was written. An error is one of the store or
  // of the job being ended.
  absl::Status Run(Report report);

  std::uint64_t scans() const { return scans_; }
  std::uint64_t pieces() const { return pieces_; }

 private:
  void CheckScan(StorageReader& reader, const PosedScan& posed, Report report);
  void CheckPoints(StorageReader& reader, const ScanRecord& scan, Report report);
  void CheckLabels(StorageReader& reader, const ScanRecord& scan, Report report);
  absl::Status CheckDecisions(StorageReader& reader, ScanNumber last, Report report);
  void CheckClassifiers(StorageReader& reader, Report report);

  MapCore& core_;
  const SteadyView& view_;
  JobContext& context_;
  std::uint64_t scans_ = 0;
  std::uint64_t pieces_ = 0;
};

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_REPAIR_TRUTH_CHECK_H_
