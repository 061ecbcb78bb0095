// The quarantine of a map that nobody has open: what to do with a map that kills the server.
#ifndef STRATA_CORE_ENGINE_MAP_QUARANTINE_FILE_H_
#define STRATA_CORE_ENGINE_MAP_QUARANTINE_FILE_H_

#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

#include "core/engine/map/idle_map.h"
#include "core/storage/records.h"

namespace strata {

// Work that is in quarantine, waits under suspicion, or was under way when the process died.
struct QuarantineEntry {
  Attempt attempt;  // a death that no start has counted yet is counted
  bool held = false;
  std::string name;  // "scan robot/7", "job 3 (fade)", "rebuild", "look": as ParseWork() reads it
  std::string message;  // of the scan or job
};

// All of them act on the map `name` of `place`, as OnIdleMap() does.
absl::StatusOr<std::vector<QuarantineEntry>> ListQuarantine(const MapPlace& place,
                                                            absl::string_view name);
// `what`: "scan TRAJECTORY/SEQUENCE" or "job ID", that wait; to take back also "rebuild", "look".
absl::Status AddToQuarantine(const MapPlace& place, absl::string_view name, absl::string_view what);
absl::Status ReleaseFromQuarantine(const MapPlace& place,
                                   absl::string_view name,
                                   absl::string_view what);

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_MAP_QUARANTINE_FILE_H_
