// Which files of a command line or a folder are scans, in which order, and with which poses.
#ifndef STRATA_CLIENT_FORMATS_SCAN_LIST_H_
#define STRATA_CLIENT_FORMATS_SCAN_LIST_H_

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"

#include "client/formats/pose_reader.h"
#include "client/formats/scan_reader.h"
#include "core/cloud/point_cloud.h"
#include "core/geometry/pose.h"

namespace strata {

// In place of a file of poses: there is none, and every scan is at the origin.
inline constexpr char kNoPoses[] = "none";

struct ScanListOptions {
  ScanFormat format = ScanFormat::kAuto;
  // The file of poses, or a folder of 3DTK's .pose files, or kNoPoses; empty: what lies there, see
  // below.
  std::filesystem::path poses = {};
  PoseFormat pose_format = PoseFormat::kAuto;
  // Told, if set, what was chosen, and, after "warning: ", what is no error but may not be what was
  // meant.
  std::function<void(const std::string&)> tell = {};
};

// One scan to import.
struct ScanFile {
  std::filesystem::path path;
  ScanFormat format = ScanFormat::kAuto;  // for ReadScan
  std::uint64_t sequence = 0;
  std::optional<absl::Time> time;
  Pose T_map_scan = Pose::Identity();  // identity where no poses were given
  absl::Status pose_status;            // NOT_FOUND, saying what was looked for, without a pose
  // Of a right-hand step [rotation, translation] of T_map_scan, where the pose is known by itself,
  // as by GPS, and not from those before.
  std::optional<Matrix6d> pose_covariance;
  // As ReadScanFile(), where the scan is no file of its own; may be called by several threads.
  std::function<absl::StatusOr<PointCloud>(std::size_t* at_sensor)> read = {};
  // T_map_scan so many seconds after `time`, where poses are known over time; may be called by
  // several threads.
  std::function<absl::StatusOr<Pose>(double offset_s)> pose_after = {};
};

// By `read`, or else as ReadScan().
absl::StatusOr<PointCloud> ReadScanFile(const ScanFile& scan, std::size_t* at_sensor = nullptr);

// The last run of digits in the stem of a file's name ("scan012_3.pcd": 3); nullopt without digits
// or beyond 2^53.
std::optional<std::uint64_t> SequenceOfName(const std::filesystem::path& path);

// The time that the stem of a file's name is: seconds since 1970 with a decimal point
// ("1432235498.028276.pcd"); or that it ends with, where those have ten digits: with a point, or as
// seconds_nanoseconds ("cloud_1583836591_200000048.pcd"; six digits: microseconds), or in whole
// milli-, micro- or nanoseconds ("1583836591200000048.bin"). nullopt for other names.
std::optional<absl::Time> TimeOfName(const std::filesystem::path& path);

// Scans of `paths`, each as ScansAt() has it, in the order of their sequence numbers.
//
// The sequence number is SequenceOfName where every file has one, no two are equal, and they grow
// with the digits before them, if those differ ("a12_3.pcd"); else the files are numbered from 0 in
// natural order of their names (s2 before s10). Files whose names are all times are numbered in the
// order of those: the last digits of a time say nothing.
//
// A file that holds several scans (HoldsStations) gives each of them, its path with ":0", ":1", …
// behind it; then all scans are numbered from 0 in that order. Their poses are those in the file,
// if it has any (StationsHavePoses): then a file of poses can be named only for files of one scan
// each. Else their numbers and times say whose a pose is.
//
// Poses: index-tum and kitti by index = SequenceOfName; kitti's of a camera are taken to the lidar
// where a calib.txt says how (LidarInCamera), else `tell` is warned. tum has no index: where every
// name is a time (TimeOfName) by that, to a millisecond; else one after the other, the scans in
// order and the poses in order of time; `tell` is told where the file has more poses. 3dtk: the
// .pose file beside each scan or in the folder named.
//
// Where none are named: those beside 3DTK scans; else the one file of poses (PoseFilesIn) in the
// folder that is named; else none for a single scan, for LAS files, for files with poses of
// their own and for PCD files with a VIEWPOINT, whose points lie in one frame already. Several
// scans that nothing is said of would all lie at the origin.
//
// INVALID_ARGUMENT, NOT_FOUND: no scan at all, a path that is not there, several scans and no poses
// or several files of them, a file of poses that cannot be read. A scan without a pose is in its
// `pose_status`.
absl::StatusOr<std::vector<ScanFile>> ListScans(const std::vector<std::filesystem::path>& paths,
                                                const ScanListOptions& options);

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_SCAN_LIST_H_
