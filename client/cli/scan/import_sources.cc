#include "client/cli/scan/import_sources.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <iterator>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/time/time.h"
#include <Eigen/Cholesky>
#include <Eigen/Geometry>

#include "client/cli/classifier/label_classes.h"
#include "client/cli/scan/level_trajectory.h"
#include "client/cli/terminal/progress.h"
#include "client/formats/bags/bag_scans.h"
#include "client/formats/bags/keyframes.h"
#include "client/formats/bags/recording.h"
#include "client/formats/motion/placed_scans.h"
#include "client/formats/scan_list.h"
#include "client/formats/scan_reader.h"
#include "core/cloud/deskew.h"
#include "core/common/status.h"
#include "core/common/stop.h"
#include "core/world/map_class.h"

namespace strata::cli {
namespace {

// What is said of a recording and not of files, or the other way round, would be passed over.
absl::Status CheckOptionsFor(bool recording, const ImportOptions& options) {
  const std::pair<const char*, bool> given[] = {
      {"--topic", !options.topic.empty()},
      {"--poses-from", !options.poses_from.empty()},
      {"--every", !options.every.empty()},
      {"--mount", options.mount.has_value()},
      {"--urdf", !options.urdf.empty()},
      {"--sweep", options.sweep_s.has_value()},
      {"--format", options.format != "auto"},
      {"--poses", !options.poses.empty()},
      {"--pose-format", options.pose_format != "auto"},
  };
  constexpr std::size_t kOfRecordings = 6;  // the first ones
  for (std::size_t i = 0; i < std::size(given); ++i) {
    const auto& [name, is_given] = given[i];
    if (!is_given || recording == (i < kOfRecordings)) continue;
    return absl::InvalidArgumentError(
        recording ? absl::StrCat(name,
                                 " is for files of scans; of a recording say --topic and "
                                 "--poses-from")
                  : absl::StrCat(name,
                                 " is for recordings (.mcap, .db3, .bag, folders of rosbag2), and ",
                                 options.paths.front(),
                                 " is none"));
  }
  return absl::OkStatus();
}

absl::StatusOr<std::vector<ScanFile>> FindRecordedScans(const ImportOptions& options,
                                                        const Stop& stop,
                                                        Output& output) {
  Progress progress(output.talk(), TalksToTerminal(), "reading");
  BagScanOptions bag;
  bag.topic = options.topic;
  bag.poses_from = options.poses_from;
  STRATA_ASSIGN_OR_RETURN(
      bag.every, ParseKeyframeSpacing(options.every.empty() ? kDefaultEvery : options.every));
  bag.T_base_cloud = options.mount;
  bag.urdf = options.urdf;
  bag.sweep_s = options.sweep_s;
  bag.tell = [&output, &progress](const std::string& text) {
    progress.Clear();
    output.Talk(text);
  };
  bag.progress = [&stop, &progress](double share) {
    progress.Update(share, "the recording");
    return stop.status();
  };
  return ListBagScans({options.paths.begin(), options.paths.end()}, bag);
}

absl::StatusOr<std::vector<ScanFile>> FindScans(const ImportOptions& options,
                                                const Stop& stop,
                                                Output& output) {
  const bool recording = std::any_of(options.paths.begin(),
                                     options.paths.end(),
                                     [](const std::string& path) { return IsRecording(path); });
  STRATA_RETURN_IF_ERROR(CheckOptionsFor(recording, options));
  if (recording) return FindRecordedScans(options, stop, output);
  ScanListOptions list;
  list.tell = [&output](const std::string& text) { output.Talk(text); };
  STRATA_ASSIGN_OR_RETURN(list.format, ParseScanFormat(options.format));
  STRATA_ASSIGN_OR_RETURN(list.pose_format, ParsePoseFormat(options.pose_format));
  const bool on_trajectory = options.pose_format == "auto" && IsTrajectory(options.poses);
  list.poses = on_trajectory ? kNoPoses : options.poses;
  STRATA_ASSIGN_OR_RETURN(std::vector<ScanFile> scans,
                          ListScans({options.paths.begin(), options.paths.end()}, list));
  if (on_trajectory) {
    STRATA_RETURN_IF_ERROR(
        PlaceOnTrajectory(options.poses, options.T_body_scan.value_or(Pose::Identity()), scans));
  } else if (options.T_body_scan.has_value()) {
    return absl::InvalidArgumentError(
        "--sensor needs --poses with a trajectory of strata egomotion: other poses are those of "
        "the scans themselves");
  }
  return scans;
}

absl::StatusOr<ScansThere> FindScansThere(Context& context, const ImportOptions& options) {
  ScansThere there;
  api::ScanFilter filter;
  filter.trajectory = options.trajectory;
  STRATA_RETURN_IF_ERROR(
      context.database.scans().List(context.call, options.map, filter, [&](const ScanInfo& info) {
        there.emplace(info.header.id.sequence, info.header);
        return absl::OkStatus();
      }));
  return there;
}

// Whether the file cannot be what is there, as far as its time and pose tell.
bool Differs(const ScanFile& scan, const ScanHeader& there) {
  constexpr double kRounding = 1e-6;
  return absl::ToUnixMicros(scan.time.value_or(absl::UnixEpoch())) !=
             absl::ToUnixMicros(there.time) ||
         (scan.pose_status.ok() && !scan.T_map_scan.isApprox(there.T_map_scan, kRounding));
}

// Scans without poses and times are told apart by the points of the first one.
bool HasOtherPoints(const ScanFile& scan, const ScanHeader& there) {
  if (there.point_count == 0) return false;  // sent as a local map, without points
  const absl::StatusOr<PointCloud> cloud = ReadScanFile(scan);
  return cloud.ok() && cloud->size() != there.point_count;
}

// Folders of the same name have the same trajectory unless it is given: what is skipped then is
// not what the map has.
void WarnOfOtherScans(const std::vector<ScanFile>& scans,
                      const ScansThere& there,
                      const ImportOptions& options,
                      Output& output) {
  std::size_t skipped = 0;
  std::size_t other = 0;
  for (const ScanFile& scan : scans) {
    const auto it = there.find(scan.sequence);
    if (it == there.end()) continue;
    const bool first = skipped++ == 0;
    if (Differs(scan, it->second) || (first && HasOtherPoints(scan, it->second))) ++other;
  }
  if (other == 0) return;
  output.Talk(absl::StrCat("warning: trajectory ",
                           options.trajectory,
                           " has other scans under these numbers (",
                           other,
                           " of ",
                           skipped,
                           " skipped files differ in time, pose or points); --trajectory NAME "
                           "uploads these as a run of their own"));
}

// What labels of files become in a map.
using LabelsToMap = std::function<absl::Status(PointCloud&)>;

// Without --classes.
LabelsToMap PlainLabels(const ImportOptions& options) {
  if (options.without_labels) {
    return [](PointCloud& cloud) {
      cloud.label.clear();
      return absl::OkStatus();
    };
  }
  return [](PointCloud& cloud) {
    const absl::Status valid = ValidateLabels(cloud.label);
    if (valid.ok()) return valid;
    return absl::InvalidArgumentError(absl::StrCat(
        valid.message(),
        "; say with --classes which labels are which class, or leave them out with --no-labels"));
  };
}

absl::StatusOr<LabelsToMap> LabelsFor(Context& context, const ImportOptions& options) {
  if (options.without_labels || options.classes.empty()) return PlainLabels(options);
  STRATA_ASSIGN_OR_RETURN(const LabelClasses given, ReadLabelClasses(options.classes));
  STRATA_ASSIGN_OR_RETURN(
      const LabelClasses labels,
      ForClassesOfMap(context.database.maps(), context.call, options.map, given));
  return [labels](PointCloud& cloud) {
    labels.Apply(cloud);
    return absl::OkStatus();
  };
}

// Each point where it was at the scan's stamp, where times and poses say so.
PointCloud WithoutMotion(PointCloud cloud, const ScanFile& scan, ReadCounts& counts) {
  if (cloud.time.empty() || !scan.pose_after || !scan.time.has_value()) return cloud;
  const double stamp_s = absl::ToDoubleSeconds(*scan.time - absl::UnixEpoch());
  absl::StatusOr<PointCloud> deskewed = Deskew(cloud, stamp_s, scan.pose_after);
  if (!deskewed.ok()) {
    counts.NotDeskewed(scan.path.string(), deskewed.status());
    return cloud;
  }
  ++counts.deskewed;
  return *std::move(deskewed);
}

absl::StatusOr<PointCloud> ReadForMap(const ScanFile& scan,
                                      const LabelsToMap& labels,
                                      bool deskew,
                                      ReadCounts& counts) {
  std::size_t dropped = 0;
  STRATA_ASSIGN_OR_RETURN(PointCloud cloud, ReadScanFile(scan, &dropped));
  counts.at_sensor += dropped;
  if (deskew) cloud = WithoutMotion(std::move(cloud), scan, counts);
  cloud.time.clear();
  STRATA_RETURN_IF_ERROR(labels(cloud));
  return cloud;
}

ImportSources SourcesOf(const std::vector<ScanFile>& scans,
                        const ScansThere& there,
                        const ImportOptions& options,
                        const LabelsToMap& labels,
                        PriorChooser& priors,
                        std::shared_ptr<ReadCounts> counts = std::make_shared<ReadCounts>()) {
  ImportSources sources;
  sources.counts = std::move(counts);
  sources.files = scans.size();
  for (const ScanFile& scan : scans) {
    const ScanId id = {options.trajectory, scan.sequence};
    if (there.count(scan.sequence) > 0) {
      sources.there.push_back(id);
      continue;
    }
    if (!scan.pose_status.ok()) {
      sources.errors.emplace_back(scan.path.string(), scan.pose_status.message());
      continue;
    }
    UploadSource source;
    source.file = scan.path.string();
    source.header.id = id;
    source.header.time = scan.time.value_or(absl::UnixEpoch());
    source.header.T_map_scan = scan.T_map_scan;
    source.header.alignment = options.align == "on" ? Alignment::kOn : Alignment::kOff;
    source.read = [scan, labels, deskew = options.deskew == "on", counts = sources.counts] {
      return ReadForMap(scan, labels, deskew, *counts);
    };
    source.pose_information = priors.InformationOf(scan);
    sources.missing.push_back(std::move(source));
  }
  return sources;
}

using Box = Eigen::AlignedBox3d;

constexpr double kFarM = 10e3;

absl::Status CheckNear(const Eigen::Vector3d& place, const Box& world, absl::string_view file) {
  const double distance_m = world.isEmpty() ? 0.0 : world.exteriorDistance(place);
  if (distance_m <= kFarM) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrFormat(
      "%s: lies at (%.1f, %.1f, %.1f), %.1f km from all else in the map; are these the --poses of "
      "other scans, or coordinates of a survey (UTM)? --far takes the scan all the same; "
      "strata map create --origin makes a map of its own",
      file,
      place.x(),
      place.y(),
      place.z(),
      distance_m / 1000.0));
}

// Where the points lie of the first scan to upload that can be read. Both in the same order.
Eigen::Vector3d MiddleOfFirst(const std::vector<ScanFile>& scans,
                              const std::vector<UploadSource>& sources) {
  auto scan = scans.begin();
  for (const UploadSource& source : sources) {
    scan = std::find_if(scan, scans.end(), [&source](const ScanFile& file) {
      return file.sequence == source.header.id.sequence;
    });
    if (scan == scans.end()) break;
    const absl::StatusOr<PointCloud> cloud = ReadScanFile(*scan);
    if (cloud.ok()) return cloud->origin;
  }
  return Eigen::Vector3d::Zero();
}

// Errors of GPS last for tens of seconds: a pose oftener than that says nothing new.
constexpr absl::Duration kPriorEvery = absl::Seconds(10);

// Without --far: checks all poses, with the points of the first scan that can be read, before
// anything is sent, and the points of each scan when it is read. `world`: what the map has; it
// grows along the way.
absl::Status CheckPlaces(Box world,
                         const std::vector<ScanFile>& scans,
                         std::vector<UploadSource>& sources) {
  const Eigen::Vector3d middle = MiddleOfFirst(scans, sources);
  for (const UploadSource& source : sources) {
    const Eigen::Vector3d place = source.header.T_map_scan * middle;
    const absl::Status near = CheckNear(place, world, source.file);
    if (!near.ok()) {
      return absl::InvalidArgumentError(absl::StrCat(near.message(), "; nothing was uploaded"));
    }
    world.extend(place);
  }
  for (UploadSource& source : sources) {
    source.read = [read = source.read,
                   T = source.header.T_map_scan,
                   file = source.file,
                   world]() -> absl::StatusOr<PointCloud> {
      STRATA_ASSIGN_OR_RETURN(PointCloud cloud, read());
      STRATA_RETURN_IF_ERROR(CheckNear(T * cloud.origin, world, file));
      return cloud;
    };
  }
  return absl::OkStatus();
}

// Empty if nothing says where the map is.
absl::StatusOr<Box> WorldOf(Context& context, const std::string& map, const ScansThere& there) {
  STRATA_ASSIGN_OR_RETURN(const MapStats stats, context.database.maps().Stats(context.call, map));
  Box world;
  if (stats.box_min != stats.box_max) world = Box(stats.box_min, stats.box_max);
  for (const auto& [sequence, header] : there) world.extend(header.T_map_scan.translation());
  return world;
}

// With --level: turns their poses.
absl::StatusOr<std::optional<double>> Level(std::vector<ScanFile>& scans,
                                            const ImportOptions& options,
                                            Output& output) {
  if (!options.level) return std::nullopt;
  STRATA_ASSIGN_OR_RETURN(const double level_rad, LevelTrajectory(scans));
  output.Talk(absl::StrFormat("levelled by %.4f rad", level_rad));
  return level_rad;
}

}  // namespace

std::optional<Matrix6d> PriorChooser::InformationOf(const ScanFile& scan) {
  if (!scan.pose_covariance.has_value() || !scan.time.has_value()) return std::nullopt;
  if (last_.has_value() && absl::AbsDuration(*scan.time - *last_) < kPriorEvery) {
    return std::nullopt;
  }
  const Eigen::LLT<Matrix6d> root(*scan.pose_covariance);
  if (root.info() != Eigen::Success) return std::nullopt;  // a pose without errors is none
  last_ = scan.time;
  const Matrix6d information = root.solve(Matrix6d::Identity());
  return 0.5 * (information + information.transpose());
}

absl::StatusOr<ImportBatches> ImportBatches::Begin(Context& context, const ImportOptions& options) {
  ImportBatches batches(options);
  STRATA_ASSIGN_OR_RETURN(batches.there_, FindScansThere(context, options));
  return batches;
}

ImportSources ImportBatches::Next(const std::vector<ScanFile>& scans) {
  return SourcesOf(scans, there_, options_, PlainLabels(options_), priors_, counts_);
}

void ReadCounts::NotDeskewed(const std::string& file, const absl::Status& why) {
  const std::lock_guard lock(mutex_);
  if (++not_deskewed_ == 1) why_not_ = absl::StrCat(file, ": ", why.message());
}

std::uint64_t ReadCounts::not_deskewed() const {
  const std::lock_guard lock(mutex_);
  return not_deskewed_;
}

std::string ReadCounts::why_not() const {
  const std::lock_guard lock(mutex_);
  return why_not_;
}

std::string TrajectoryOf(const std::string& path) {
  std::filesystem::path folder = std::filesystem::absolute(path).lexically_normal();
  if (!folder.has_filename()) {
    folder = folder.parent_path();
  }
  if (!std::filesystem::is_directory(folder)) {
    folder = IsRecording(folder) ? folder.replace_extension() : folder.parent_path();
  }
  if (folder.filename() == "scans") {
    folder = folder.parent_path();
  }
  std::string name;
  for (const char c : folder.filename().string()) {
    const bool allowed = absl::ascii_isalnum(static_cast<unsigned char>(c)) || c == '_' ||
                         (!name.empty() && (c == '-' || c == '.'));
    name += allowed ? c : '_';
  }
  return name.empty() ? "scans" : name.substr(0, 100);
}

absl::StatusOr<ImportSources> FindImportSources(Context& context, const ImportOptions& options) {
  STRATA_ASSIGN_OR_RETURN(std::vector<ScanFile> scans,
                          FindScans(options, context.call.stop, context.output));
  STRATA_ASSIGN_OR_RETURN(const ScansThere there, FindScansThere(context, options));
  STRATA_ASSIGN_OR_RETURN(const LabelsToMap labels, LabelsFor(context, options));
  STRATA_ASSIGN_OR_RETURN(const std::optional<double> level_rad,
                          Level(scans, options, context.output));
  WarnOfOtherScans(scans, there, options, context.output);
  PriorChooser priors;
  ImportSources sources = SourcesOf(scans, there, options, labels, priors);
  sources.level_rad = level_rad;
  if (options.far) return sources;
  STRATA_ASSIGN_OR_RETURN(const Box world, WorldOf(context, options.map, there));
  STRATA_RETURN_IF_ERROR(CheckPlaces(world, scans, sources.missing));
  return sources;
}

absl::StatusOr<ImportSources> FindImportSources(FileContext& context,
                                                const ImportOptions& options) {
  STRATA_ASSIGN_OR_RETURN(std::vector<ScanFile> scans,
                          FindScans(options, context.stop, context.output));
  STRATA_ASSIGN_OR_RETURN(const std::optional<double> level_rad,
                          Level(scans, options, context.output));
  PriorChooser priors;
  ImportSources sources = SourcesOf(scans, {}, options, PlainLabels(options), priors);
  sources.level_rad = level_rad;
  if (!options.far) STRATA_RETURN_IF_ERROR(CheckPlaces(Box(), scans, sources.missing));
  return sources;
}

}  // namespace strata::cli
