#include "core/engine/engine.h"

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"

#include "core/common/status.h"
#include "core/engine/doors/classifiers.h"
#include "core/engine/doors/jobs.h"
#include "core/engine/doors/maps.h"
#include "core/engine/doors/planning.h"
#include "core/engine/doors/posegraph.h"
#include "core/engine/doors/scans.h"
#include "core/engine/doors/tiles.h"
#include "core/engine/map/numbers.h"

namespace strata {
namespace {

class Engine final : public api::Database, public NumbersSource {
 public:
  explicit Engine(std::unique_ptr<EngineMaps> maps) : maps_(std::move(maps)) {}

  api::Maps& maps() override { return *maps_; }
  api::Scans& scans() override { return scans_; }
  api::Tiles& tiles() override { return tiles_; }
  api::Planning& planning() override { return planning_; }
  api::Jobs& jobs() override { return jobs_; }
  api::PoseGraph& posegraph() override { return posegraph_; }
  api::Classifiers& classifiers() override { return classifiers_; }
  EngineNumbers Numbers() override { return maps_->Numbers(); }
  EngineHealth Health() override { return maps_->Health(); }

 private:
  std::unique_ptr<EngineMaps> maps_;
  EngineScans scans_{*maps_};
  EngineTiles tiles_{*maps_};
  EnginePlanning planning_{*maps_};
  EngineJobs jobs_{*maps_};
  EnginePoseGraph posegraph_{*maps_};
  EngineClassifiers classifiers_{*maps_};
};

}  // namespace

absl::Status EngineOptions::Validate() const {
  std::vector<std::string> faults;
  if (directory.empty()) faults.emplace_back("directory is empty");
  if (queue_bytes < (std::size_t{1} << 20)) faults.emplace_back("queue_bytes is below 1 MiB");
  if (max_points_per_scan == 0) faults.emplace_back("max_points_per_scan is 0");
  if (max_maps == 0) faults.emplace_back("max_maps is 0");
  if (max_pending_scans == 0) faults.emplace_back("max_pending_scans is 0");
  if (worker_threads < 1 || worker_threads > 64) {
    faults.push_back(absl::StrCat("worker_threads = ", worker_threads, " is not in [1, 64]"));
  }
  if (max_batch_scans < 1 || max_batch_scans > 1000) {
    faults.push_back(absl::StrCat("max_batch_scans = ", max_batch_scans, " is not in [1, 1000]"));
  }
  if (optimize_interval < absl::ZeroDuration()) {
    faults.push_back(absl::StrCat(
        "optimize_interval = ", absl::FormatDuration(optimize_interval), " is negative"));
  }
  if (prepare_after < absl::ZeroDuration()) {
    faults.push_back(
        absl::StrCat("prepare_after = ", absl::FormatDuration(prepare_after), " is negative"));
  }
  if (upload_keep < absl::ZeroDuration()) {
    faults.push_back(
        absl::StrCat("upload_keep = ", absl::FormatDuration(upload_keep), " is negative"));
  }
  if (faults.empty()) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat("engine: ", absl::StrJoin(faults, "; ")));
}

absl::StatusOr<std::unique_ptr<api::Database>> OpenEngine(const EngineOptions& options) {
  STRATA_RETURN_IF_ERROR(options.Validate());
  STRATA_ASSIGN_OR_RETURN(std::unique_ptr<EngineMaps> maps, EngineMaps::Open(options));
  return std::make_unique<Engine>(std::move(maps));
}

}  // namespace strata
