#include "core/engine/map/engine_options.h"

#include <cstddef>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/time/time.h"

namespace strata {

absl::Status EngineOptions::Validate() const {
  std::vector<std::string> faults;
  if (directory.empty()) faults.emplace_back("directory is empty");
  if (!store.empty() && max_map_bytes > 0) {
    faults.emplace_back("max_map_bytes is set, but the maps are in a database");
  }
  if (store.empty() && !(integrates && works)) {
    faults.emplace_back(
        "integrates and works are not set, but nobody else has the directory's maps");
  }
  if (map_lease < absl::Seconds(1) || map_lease > absl::Hours(1)) {
    faults.push_back(
        absl::StrCat("map_lease = ", absl::FormatDuration(map_lease), " is not in [1s, 1h]"));
  }
  if (queue_bytes < (std::size_t{1} << 20)) faults.emplace_back("queue_bytes is below 1 MiB");
  if (max_points_per_scan == 0) faults.emplace_back("max_points_per_scan is 0");
  if (max_maps == 0) faults.emplace_back("max_maps is 0");
  if (max_open_maps == 0) faults.emplace_back("max_open_maps is 0");
  if (map_idle < absl::ZeroDuration()) {
    faults.push_back(absl::StrCat("map_idle = ", absl::FormatDuration(map_idle), " is negative"));
  }
  if (look_interval <= absl::ZeroDuration()) {
    faults.push_back(absl::StrCat(
        "look_interval = ", absl::FormatDuration(look_interval), " is not above zero"));
  }
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

std::string RolesOf(const EngineOptions& options) {
  return absl::StrCat(
      "gateway", options.integrates ? ",integrator" : "", options.works ? ",worker" : "");
}

}  // namespace strata
