// One upload of a robot, its identity and what became of it.
#ifndef STRATA_CORE_WORLD_SCAN_H_
#define STRATA_CORE_WORLD_SCAN_H_

#include <compare>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"

#include "core/cloud/point_cloud.h"
#include "core/cloud/sensor_model.h"
#include "core/geometry/pose.h"

namespace strata {

// Chosen by the client: a trajectory's name and a number that grows along it.
struct ScanId {
  std::string trajectory;
  std::uint64_t sequence = 0;

  friend auto operator<=>(const ScanId&, const ScanId&) = default;
  template <typename H>
  friend H AbslHashValue(H h, const ScanId& id) {
    return H::combine(std::move(h), id.trajectory, id.sequence);
  }
  // "trajectory/sequence", as users write it.
  std::string ToString() const;
};

// Parses "trajectory/sequence"; INVALID_ARGUMENT otherwise.
absl::Status ParseScanId(absl::string_view text, ScanId& id);

// How the pose of a new scan is found.
enum class Alignment : std::uint8_t {  // stored
  kOn = 1,                             // registered to what the map has around it
  kOff = 2,                            // taken as uploaded
};

// What comes before the points.
struct ScanHeader {
  ScanId id;
  absl::Time time = absl::UnixEpoch();  // of the scan's reference frame; microseconds are kept
  Pose T_map_scan = Pose::Identity();   // rough pose; never overwritten
  Eigen::Vector3f sensor_origin = Eigen::Vector3f::Zero();  // in the scan frame [m]
  std::optional<SensorModel> sensor;                        // default: the map's
  Alignment alignment = Alignment::kOn;
  std::uint64_t point_count = 0;  // announced size; the upload must bring exactly so many
  std::uint32_t rows = 0;         // > 0: organised, rows * columns == point_count
  std::uint32_t columns = 0;
  bool has_intensity = false;
  bool has_colour = false;
  bool has_label = false;
  // In an upload the scan's ScanHasher digest if its sender has announced it, else empty. In what
  // the map says of a scan always empty: see ScanInfo.
  std::string content_hash;
};

// What of a header the points say. Its pose, that of the frame that the points came in, becomes
// that of points relative to the cloud's origin, which whoever sends them sets to zero.
void AnnouncePoints(const PointCloud& cloud, ScanHeader& header);

// INVALID_ARGUMENT naming the field, its value and the bound.
absl::Status ValidateScanHeader(const ScanHeader& header);

enum class ScanState : std::uint8_t {  // stored
  kPending = 1,                        // durable, waiting for integration
  kIntegrated = 2,                     // in the tiles
  kFailed = 3,  // durable, but its contribution could not be made; ScanInfo::message says why
};

// How the pose came about.
struct AlignmentReport {
  bool aligned = false;  // false: pose is the guess (alignment off, first scan, or no match)
  std::string message;   // why not, or "converged" and the like
  double overlap = 0.0;  // share of the scan's features with a partner, in [0, 1]
  double rms_m = 0.0;    // residual of the partners
  std::uint32_t iterations = 0;
};

struct ScanInfo {
  ScanHeader header;  // header.T_map_scan is the uploaded pose
  ScanState state = ScanState::kPending;
  Pose T_map_scan = Pose::Identity();  // current epoch; the uploaded one until integrated
  std::uint64_t commit_sequence = 0;   // order of acknowledgement
  std::uint64_t point_bytes = 0;       // as stored
  std::string content_hash;            // of the uploaded points and header
  std::string message;                 // why it failed, or which points are not in the map
  AlignmentReport alignment;
  bool person_labels = false;      // a person gave some of its points labels
  std::uint64_t label_model = 0;   // id of the classifier that labelled it last; 0: none
  std::uint64_t faded_points = 0;  // later scans looked through where they were: not in the tiles
};

// Answer to an upload: durable now.
struct ScanAck {
  ScanId id;
  std::uint64_t commit_sequence = 0;
  bool already_present = false;  // the same scan was there; nothing changed
  std::string content_hash;      // of the points and header that are durable
};

// What the server has of a trajectory.
struct UploadState {
  bool exists = false;              // any scan of the trajectory committed
  std::uint64_t last_sequence = 0;  // highest committed sequence number
  std::uint64_t scans = 0;
};

}  // namespace strata

#endif  // STRATA_CORE_WORLD_SCAN_H_
