// Uploads many scans, several at once, and commits them in their order.
#ifndef STRATA_CLIENT_CLI_SCAN_SCAN_UPLOADER_H_
#define STRATA_CLIENT_CLI_SCAN_SCAN_UPLOADER_H_

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "core/api/database.h"
#include "core/cloud/point_cloud.h"
#include "core/world/map_info.h"
#include "core/world/scan.h"

namespace strata::cli {

// A scan to upload. `header` has id, time, alignment and the pose of the points as `read` returns
// them; what depends on the points is filled in by the uploader.
struct UploadSource {
  std::string file;
  ScanHeader header;
  std::function<absl::StatusOr<PointCloud>()> read;
  // What is known of the pose by itself, as by GPS: a prior that may be false.
  std::optional<Matrix6d> pose_information;
  // The parameters of the map, if its points are to stay here: the local map that is made of them
  // is sent in their place.
  std::optional<MapParameters> as_local_map;
};

// The whole header of a source whose points are `cloud`, for points relative to the cloud's origin.
ScanHeader HeaderFor(const UploadSource& source, const PointCloud& cloud);

struct UploadResult {
  absl::Status status;  // of reading and uploading
  std::uint64_t points = 0;
  std::uint64_t local_map_bytes = 0;  // of what was sent in their place
  bool pose_as_said = true;           // not moved to where the points are
};

struct UploadProgress {
  std::uint64_t scans = 0;  // done, with or without success
  std::uint64_t points = 0;
};

// One result a source, in the same order. Scans are read and sent by `workers` threads but finished
// one after the other, so that their commit order, and with it what alignment makes of them, is
// that of the sources. A busy or unreachable server is tried again for kPatience without progress;
// after that, or where the caller has no right to upload, the rest fails at once. `report` is
// called some ten times a second on this thread.
std::vector<UploadResult> UploadScans(api::Database& database,
                                      const api::Call& call,
                                      const std::string& map,
                                      const std::vector<UploadSource>& sources,
                                      int workers,
                                      const std::function<void(const UploadProgress&)>& report);

}  // namespace strata::cli

#endif  // STRATA_CLIENT_CLI_SCAN_SCAN_UPLOADER_H_
