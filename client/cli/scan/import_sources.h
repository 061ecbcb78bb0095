// What strata scan import brings into a map: files found, named, and told from what is there.
#ifndef STRATA_CLIENT_CLI_SCAN_IMPORT_SOURCES_H_
#define STRATA_CLIENT_CLI_SCAN_IMPORT_SOURCES_H_

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"

#include "client/cli/scan/scan_uploader.h"
#include "client/cli/terminal/command.h"
#include "client/formats/scan_list.h"
#include "core/geometry/pose.h"
#include "core/world/scan.h"

namespace strata::cli {

// Options of the command.
struct ImportOptions {
  std::string map;
  std::vector<std::string> paths;
  std::string format = "auto";
  std::string poses;
  std::string pose_format = "auto";
  std::optional<Pose> T_body_scan;  // for poses of a trajectory
  std::string trajectory;
  std::string align = "on";
  std::string classes;  // as ReadLabelClasses(); empty: labels are ids of the map's classes
  bool without_labels = false;
  bool level = false;
  bool far = false;  // scans may lie far from the map
  bool wait = false;
  std::string spool;  // a directory, if scans go there first
  bool as_local_maps = false;
  std::string deskew = "on";
  // Of recordings, as BagScanOptions.
  std::string topic;
  std::string poses_from;
  std::string every;
  std::optional<Pose> mount;
  std::string urdf;
  std::optional<double> sweep_s;
};

// The spacing of keyframes that `every` stands for, and without one.
inline constexpr char kDefaultEvery[] = "0.5m,30deg";

// What reading scans has found so far; by several threads.
class ReadCounts {
 public:
  std::atomic<std::uint64_t> at_sensor{0};  // returns of range 0, left out
  std::atomic<std::uint64_t> deskewed{0};   // scans

  // A scan whose points have times stays as it is.
  void NotDeskewed(const std::string& file, const absl::Status& why);
  std::uint64_t not_deskewed() const;
  std::string why_not() const;  // of the first one

 private:
  mutable std::mutex mutex_;
  std::uint64_t not_deskewed_ = 0;
  std::string why_not_;
};

// Tells which poses along a drive count by themselves.
class PriorChooser {
 public:
  // Of a prior for the scan; nullopt if its pose says nothing new.
  std::optional<Matrix6d> InformationOf(const ScanFile& scan);

 private:
  std::optional<absl::Time> last_;
};

struct ImportSources {
  std::size_t files = 0;
  std::vector<UploadSource> missing;  // in the map
  std::vector<ScanId> there;
  std::vector<std::pair<std::string, std::string>> errors;  // file, and why it cannot be uploaded
  std::optional<double> level_rad;                          // with --level
  std::shared_ptr<ReadCounts> counts;                       // of `missing`
};

// The folder's name, or that of the folder around one that is only called "scans"; of a recording
// that of its file or folder. In the letters that names may have.
std::string TrajectoryOf(const std::string& path);

// What the paths have and the map lacks. Warns where the map has other scans under the same
// numbers. INVALID_ARGUMENT if, without `far`, the pose of a scan is more than 10 km from the map
// and the scans before it, or from the first one where there is no map yet; a scan whose points
// are, which only reading it shows, says so in place of its points. REQUIRES: the trajectory has a
// name, here and below.
absl::StatusOr<ImportSources> FindImportSources(Context& context, const ImportOptions& options);
// All that the paths have, whatever a map has; labels stay as the files have them.
absl::StatusOr<ImportSources> FindImportSources(FileContext& context, const ImportOptions& options);

// What a trajectory has, by sequence.
using ScansThere = std::map<std::uint64_t, ScanHeader>;

// Scans whose poses become known bit by bit.
class ImportBatches {
 public:
  static absl::StatusOr<ImportBatches> Begin(Context& context, const ImportOptions& options);
  // What of the scans the map lacks. REQUIRES: they come in the order of their times.
  ImportSources Next(const std::vector<ScanFile>& scans);
  const ReadCounts& counts() const { return *counts_; }

 private:
  explicit ImportBatches(const ImportOptions& options) : options_(options) {}
  ImportOptions options_;
  ScansThere there_;
  PriorChooser priors_;
  std::shared_ptr<ReadCounts> counts_ = std::make_shared<ReadCounts>();
};

}  // namespace strata::cli

#endif  // STRATA_CLIENT_CLI_SCAN_IMPORT_SOURCES_H_
