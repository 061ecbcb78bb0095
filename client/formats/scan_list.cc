#include "client/formats/scan_list.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "absl/strings/string_view.h"
#include "absl/strings/strip.h"
#include "absl/time/time.h"

#include "client/formats/camera_poses.h"
#include "client/formats/parsing/range_zero.h"
#include "client/formats/parsing/text_cursor.h"
#include "client/formats/pcd_reader.h"
#include "client/formats/scan_folder.h"
#include "core/common/status.h"

namespace strata {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kMaxSequence = std::uint64_t{1} << 53;
constexpr absl::Duration kSameTime = absl::Milliseconds(1);

// Runs of digits compare as numbers, so that s2 comes before s10.
bool NaturalLess(absl::string_view a, absl::string_view b) {
  std::size_t i = 0;
  std::size_t k = 0;
  const auto digits = [](absl::string_view text, std::size_t& from) {
    while (from + 1 < text.size() && text[from] == '0' && absl::ascii_isdigit(text[from + 1]))
      ++from;
    std::size_t end = from;
    while (end < text.size() && absl::ascii_isdigit(text[end])) ++end;
    return text.substr(from, end - from);
  };
  while (i < a.size() && k < b.size()) {
    if (absl::ascii_isdigit(a[i]) && absl::ascii_isdigit(b[k])) {
      const absl::string_view left = digits(a, i);
      const absl::string_view right = digits(b, k);
      if (left.size() != right.size()) return left.size() < right.size();
      if (left != right) return left < right;
      i += left.size();
      k += right.size();
    } else {
      if (a[i] != b[k]) return a[i] < b[k];
      ++i;
      ++k;
    }
  }
  if ((i < a.size()) != (k < b.size())) return k < b.size();
  return a < b;
}

// The run of digits that `text` ends with, which is taken off; empty where it ends with none.
absl::string_view TakeDigits(absl::string_view& text) {
  std::size_t begin = text.size();
  while (begin > 0 && absl::ascii_isdigit(text[begin - 1])) --begin;
  const absl::string_view digits = text.substr(begin);
  text.remove_suffix(digits.size());
  return digits;
}

// Of ten digits, seconds since 1970 are those of 2001 to 2286: what else has as many.
constexpr std::size_t kDigitsOfSeconds = 10;

// The moment that a name ends with, in decimals: seconds and a fraction of them behind a point or,
// of six or nine digits, an underscore; or whole milli-, micro- or nanoseconds.
std::optional<absl::Time> StampAtEndOf(absl::string_view stem) {
  const absl::string_view last = TakeDigits(stem);
  absl::string_view seconds = last.substr(0, kDigitsOfSeconds);
  absl::string_view fraction = last.substr(seconds.size());
  const bool is_after_point = absl::ConsumeSuffix(&stem, ".");
  if (is_after_point ||
      ((last.size() == 6 || last.size() == 9) && absl::ConsumeSuffix(&stem, "_"))) {
    seconds = TakeDigits(stem);
    fraction = last;
  } else if (fraction.size() != 3 && fraction.size() != 6 && fraction.size() != 9) {
    return std::nullopt;
  }
  if (seconds.size() != kDigitsOfSeconds || seconds[0] == '0' || fraction.empty()) {
    return std::nullopt;
  }
  std::int64_t whole_s = 0, billionths = 0;
  const std::string nanoseconds = absl::StrCat(fraction.substr(0, 9), std::string(9, '0'));
  if (!absl::SimpleAtoi(seconds, &whole_s) ||
      !absl::SimpleAtoi(nanoseconds.substr(0, 9), &billionths)) {
    return std::nullopt;
  }
  return absl::FromUnixSeconds(whole_s) + absl::Nanoseconds(billionths);
}

// Whether the numbers that names end with are those of the scans: each another, and growing with
// what stands before them. Nanoseconds behind seconds are not.
bool AreNumbered(const std::vector<fs::path>& natural) {
  std::set<std::uint64_t> seen;
  bool grows = true;
  std::set<std::string> digits_before;
  for (const fs::path& file : natural) {
    const std::optional<std::uint64_t> sequence = SequenceOfName(file);
    if (!sequence.has_value()) return false;
    grows = grows && (seen.empty() || *seen.rbegin() < *sequence);
    if (!seen.insert(*sequence).second) return false;
    std::string before = file.stem().string();
    while (!absl::ascii_isdigit(before.back())) before.pop_back();
    while (!before.empty() && absl::ascii_isdigit(before.back())) before.pop_back();
    std::erase_if(before, [](char c) { return !absl::ascii_isdigit(c); });
    digits_before.insert(before);
  }
  return grows || digits_before.size() == 1;
}

std::vector<ScanFile> Ordered(std::vector<fs::path> files, ScanFormat format) {
  std::sort(files.begin(), files.end(), [](const fs::path& a, const fs::path& b) {
    return NaturalLess(a.string(), b.string());
  });
  files.erase(std::unique(files.begin(), files.end()), files.end());
  const bool timed = std::all_of(files.begin(), files.end(), [](const fs::path& file) {
    return TimeOfName(file).has_value();
  });
  if (timed) {
    std::stable_sort(files.begin(), files.end(), [](const fs::path& a, const fs::path& b) {
      return *TimeOfName(a) < *TimeOfName(b);
    });
  }
  const bool numbered = !timed && AreNumbered(files);
  std::vector<ScanFile> scans;
  for (const fs::path& file : files) {
    ScanFile& scan = scans.emplace_back();
    scan.path = file;
    scan.format = format;
    scan.sequence = numbered ? *SequenceOfName(file) : scans.size() - 1;
  }
  std::stable_sort(scans.begin(), scans.end(), [](const ScanFile& a, const ScanFile& b) {
    return a.sequence < b.sequence;
  });
  return scans;
}

ScanFormat FormatOf(const ScanFile& scan) {
  return scan.format == ScanFormat::kAuto ? ScanFormatOfName(scan.path) : scan.format;
}

// When it was taken: what the file says, else what its name does.
std::optional<absl::Time> TimeOf(const ScanFile& scan) {
  return scan.time.has_value() ? scan.time : TimeOfName(scan.path);
}

// One of the scans of a file.
ScanFile ScanOf(const ScanFile& file, const Station& station, bool with_pose) {
  ScanFile scan = file;
  scan.format = FormatOf(file);
  if (with_pose) scan.T_map_scan = station.T_file_scan;
  scan.time = station.time;
  scan.read = [path = file.path,
               read = station.read](std::size_t* at_sensor) -> absl::StatusOr<PointCloud> {
    absl::StatusOr<PointCloud> cloud = read();
    if (cloud.ok()) cloud = WithoutRangeZero(*std::move(cloud), at_sensor);
    if (!cloud.ok()) return Annotate(cloud.status(), path.string());
    return cloud;
  };
  return scan;
}

// Adds the scans of a file that may hold several, or the file itself with why it holds none.
absl::Status AddStations(const ScanFile& file,
                         const ScanListOptions& options,
                         std::vector<ScanFile>& scans) {
  const auto stations = ListStations(file.path, FormatOf(file));
  if (!stations.ok()) {
    scans.push_back(file);
    scans.back().pose_status = stations.status();
    return absl::OkStatus();
  }
  if (stations->size() > 1 && StationsHavePoses(FormatOf(file)) && !options.poses.empty() &&
      options.poses != kNoPoses) {
    return absl::InvalidArgumentError(
        absl::StrCat(file.path.string(),
                     ": holds ",
                     stations->size(),
                     " scans with poses of their own, for which a file of poses has no names; "
                     "leave out --poses"));
  }
  for (std::size_t i = 0; i < stations->size(); ++i) {
    ScanFile& scan = scans.emplace_back(ScanOf(file, (*stations)[i], options.poses != kNoPoses));
    if (stations->size() > 1) scan.path += absl::StrCat(":", i);
  }
  return absl::OkStatus();
}

// Each scan of files that hold several by itself, all numbered from 0 where there is such a file.
absl::StatusOr<std::vector<ScanFile>> WithStations(const std::vector<ScanFile>& files,
                                                   const ScanListOptions& options) {
  std::vector<ScanFile> scans;
  for (const ScanFile& file : files) {
    if (HoldsStations(FormatOf(file))) {
      STRATA_RETURN_IF_ERROR(AddStations(file, options, scans));
    } else {
      scans.push_back(file);
    }
  }
  if (scans.size() == files.size()) return scans;
  for (std::size_t i = 0; i < scans.size(); ++i) scans[i].sequence = i;
  return scans;
}

absl::Status NoPose(const fs::path& poses, absl::string_view of) {
  return absl::NotFoundError(absl::StrCat(poses.string(), ": no pose of ", of));
}

void Assign(const FilePose& pose, ScanFile& scan) {
  scan.T_map_scan = pose.T_map_scan;
  scan.time = pose.time;
}

void AssignByIndex(const PoseList& list, const fs::path& file, std::vector<ScanFile>& scans) {
  std::map<std::uint64_t, const FilePose*> by_index;
  for (const FilePose& pose : list.poses) by_index[*pose.index] = &pose;
  for (ScanFile& scan : scans) {
    const std::optional<std::uint64_t> index =
        FormatOf(scan) == ScanFormat::kVelodyne ? scan.sequence : SequenceOfName(scan.path);
    const auto found = index.has_value() ? by_index.find(*index) : by_index.end();
    if (found != by_index.end()) {
      Assign(*found->second, scan);
    } else {
      scan.pose_status = NoPose(file,
                                index.has_value() ? absl::StrCat("index ", *index)
                                                  : std::string("a file without a number"));
    }
  }
}

void AssignByTime(const std::vector<FilePose>& sorted,
                  const fs::path& file,
                  std::vector<ScanFile>& scans) {
  for (ScanFile& scan : scans) {
    const absl::Time time = *TimeOf(scan);
    const auto found = std::lower_bound(
        sorted.begin(), sorted.end(), time - kSameTime, [](const FilePose& pose, absl::Time t) {
          return *pose.time < t;
        });
    if (found != sorted.end() && *found->time <= time + kSameTime) {
      Assign(*found, scan);
    } else {
      scan.pose_status = NoPose(
          file, absl::StrFormat("time %.6f", absl::ToDoubleSeconds(time - absl::UnixEpoch())));
    }
    scan.time = time;
  }
}

void AssignInOrder(const std::vector<FilePose>& sorted,
                   const fs::path& file,
                   std::vector<ScanFile>& scans) {
  for (std::size_t i = 0; i < scans.size(); ++i) {
    if (i < sorted.size()) {
      Assign(sorted[i], scans[i]);
    } else {
      scans[i].pose_status =
          NoPose(file, absl::StrCat("scan ", i + 1, "; the file has ", sorted.size()));
    }
  }
}

void AssignTum(PoseList list, const ScanListOptions& options, std::vector<ScanFile>& scans) {
  std::stable_sort(list.poses.begin(), list.poses.end(), [](const FilePose& a, const FilePose& b) {
    return *a.time < *b.time;
  });
  const bool timed = std::all_of(
      scans.begin(), scans.end(), [](const ScanFile& scan) { return TimeOf(scan).has_value(); });
  if (!timed && list.poses.size() > scans.size() && options.tell) {
    options.tell(absl::StrCat("warning: ",
                              options.poses.string(),
                              " has ",
                              list.poses.size(),
                              " poses for ",
                              scans.size(),
                              " scans, whose names are no times: the first are taken in order; "
                              "index-tum says which is whose"));
  }
  timed ? AssignByTime(list.poses, options.poses, scans)
        : AssignInOrder(list.poses, options.poses, scans);
}

// Poses in `folder`, or beside the scans where it is empty; where nobody asked for them and there
// is none, nothing, and false.
bool Assign3dtk(bool asked, const fs::path& folder, std::vector<ScanFile>& scans) {
  std::vector<absl::StatusOr<Pose>> poses;
  bool any = asked;
  for (const ScanFile& scan : scans) {
    const bool is_3dtk =
        scan.format == ScanFormat::k3dtk || ScanFormatOfName(scan.path) == ScanFormat::k3dtk;
    const fs::path named = folder.empty() ? scan.path : folder / scan.path.filename();
    poses.push_back(asked || is_3dtk ? Read3dtkPoseOf(named)
                                     : absl::StatusOr<Pose>(scan.T_map_scan));
    any = any || (is_3dtk && !absl::IsNotFound(poses.back().status()));
  }
  for (std::size_t i = 0; any && i < scans.size(); ++i) {
    scans[i].pose_status = poses[i].status();
    if (poses[i].ok()) scans[i].T_map_scan = *poses[i];
  }
  return any;
}

// Whether its points lie in a frame of the whole survey.
bool LiesWhereItBelongs(const ScanFile& scan) {
  if (FormatOf(scan) == ScanFormat::kLas || StationsHavePoses(FormatOf(scan))) return true;
  if (scan.format != ScanFormat::kPcd && ScanFormatOfName(scan.path) != ScanFormat::kPcd) {
    return false;
  }
  std::string beginning(std::size_t{1} << 16, '\0');
  std::ifstream file(scan.path, std::ios::binary);
  file.read(beginning.data(), static_cast<std::streamsize>(beginning.size()));
  beginning.resize(static_cast<std::size_t>(file.gcount()));
  return HasPcdViewpoint(beginning);
}

std::string Joined(const std::vector<fs::path>& files) {
  return absl::StrJoin(
      files, ", ", [](std::string* out, const fs::path& file) { out->append(file.string()); });
}

std::vector<fs::path> PoseFilesOf(const std::vector<fs::path>& folders) {
  std::vector<fs::path> files;
  for (const fs::path& folder : folders) {
    for (const fs::path& file : PoseFilesIn(folder)) files.push_back(file);
  }
  return files;
}

absl::Status NoPoses(const std::vector<fs::path>& paths, std::size_t scans) {
  std::set<fs::path> around;  // up to the folder above that of the scans
  for (const fs::path& path : paths) {
    std::error_code error;
    const fs::path above = fs::canonical(path, error).parent_path();
    around.insert(above);
    if (!fs::is_directory(path, error)) around.insert(above.parent_path());
  }
  const std::vector<fs::path> near = PoseFilesOf({around.begin(), around.end()});
  return absl::InvalidArgumentError(
      absl::StrCat(scans,
                   " scans and no poses: all of them would lie at the origin; name the file of "
                   "poses with --poses FILE",
                   near.empty() ? "" : absl::StrCat(" (there is ", Joined(near), ")"),
                   ", or say --poses none if their points are in one frame already"));
}

// The file of poses of several scans for which none is named; empty if they need none.
absl::StatusOr<fs::path> ChoosePoses(const std::vector<fs::path>& paths,
                                     const std::vector<ScanFile>& scans,
                                     const ScanListOptions& options) {
  const std::vector<fs::path> files = PoseFilesOf(paths);
  if (files.size() == 1) {
    if (options.tell) options.tell(absl::StrCat("poses of ", files.front().string()));
    return files.front();
  }
  if (scans.size() == 1 || std::any_of(scans.begin(), scans.end(), LiesWhereItBelongs)) {
    return fs::path();
  }
  if (files.empty()) return NoPoses(paths, scans.size());
  return absl::InvalidArgumentError(absl::StrCat(
      "several files of poses: ", Joined(files), "; choose one of them with --poses FILE"));
}

// Poses of a camera become those of the lidar that took the scans, where a calib.txt with the
// scans, above them or with the poses says how they are to each other.
absl::Status TakeFromCamera(const ScanListOptions& options,
                            const std::vector<ScanFile>& scans,
                            std::vector<FilePose>& poses) {
  if (scans.empty() || !MoveAsCameras(poses)) return absl::OkStatus();
  std::error_code error;
  const fs::path folder = fs::absolute(scans.front().path, error).parent_path();
  const fs::path beside = fs::absolute(options.poses, error).parent_path();
  STRATA_ASSIGN_OR_RETURN(const std::optional<Pose> T_camera_lidar,
                          LidarInCamera({folder, folder.parent_path(), beside}));
  if (T_camera_lidar.has_value()) poses = PosesOfLidar(std::move(poses), *T_camera_lidar);
  if (!options.tell) return absl::OkStatus();
  options.tell(absl::StrCat(
      T_camera_lidar.has_value() ? "" : "warning: ",
      options.poses.string(),
      " are poses of a camera, which looks along z; ",
      T_camera_lidar.has_value()
          ? "taken to the lidar by the Tr of calib.txt"
          : "the map will lie on its side, unless the Tr of KITTI's calib.txt is beside them"));
  return absl::OkStatus();
}

absl::Status AssignFromFile(const ScanListOptions& options, std::vector<ScanFile>& scans) {
  STRATA_ASSIGN_OR_RETURN(PoseList list, ReadPoses(options.poses, options.pose_format));
  if (list.format == PoseFormat::kKitti) {
    STRATA_RETURN_IF_ERROR(TakeFromCamera(options, scans, list.poses));
  }
  if (list.format == PoseFormat::kTum) {
    AssignTum(std::move(list), options, scans);
  } else {
    AssignByIndex(list, options.poses, scans);
  }
  return absl::OkStatus();
}

}  // namespace

std::optional<std::uint64_t> SequenceOfName(const fs::path& path) {
  const std::string stem = path.stem().string();
  std::size_t end = stem.size();
  while (end > 0 && !absl::ascii_isdigit(stem[end - 1])) --end;
  std::size_t begin = end;
  while (begin > 0 && absl::ascii_isdigit(stem[begin - 1])) --begin;
  const std::optional<std::size_t> number =
      ParseCount(absl::string_view(stem).substr(begin, end - begin));
  if (!number.has_value() || *number > kMaxSequence) return std::nullopt;
  return *number;
}

std::optional<absl::Time> TimeOfName(const fs::path& path) {
  const std::string stem = path.stem().string();
  if (const std::optional<absl::Time> stamp = StampAtEndOf(stem)) return stamp;
  const std::optional<double> seconds = ParseNumber(stem);
  if (!absl::StrContains(stem, ".") || !seconds.has_value()) return std::nullopt;
  if (!(*seconds >= 0.0 && *seconds < 9e12)) return std::nullopt;
  return absl::FromUnixMicros(std::llround(*seconds * 1e6));
}

absl::StatusOr<PointCloud> ReadScanFile(const ScanFile& scan, std::size_t* at_sensor) {
  return scan.read ? scan.read(at_sensor) : ReadScan(scan.path, scan.format, at_sensor);
}

absl::StatusOr<std::vector<ScanFile>> ListScans(const std::vector<fs::path>& paths,
                                                const ScanListOptions& given) {
  ScanListOptions options = given;
  std::vector<fs::path> files;
  for (const fs::path& path : paths) {
    STRATA_ASSIGN_OR_RETURN(const auto found, ScansAt(path, options.format, options.tell));
    files.insert(files.end(), found.begin(), found.end());
  }
  if (files.empty()) return absl::NotFoundError("no scan: name files or folders of scans");
  STRATA_ASSIGN_OR_RETURN(std::vector<ScanFile> scans,
                          WithStations(Ordered(std::move(files), options.format), options));
  if (options.poses == kNoPoses) return scans;
  if (options.poses.empty() && std::all_of(scans.begin(), scans.end(), [](const ScanFile& scan) {
        return StationsHavePoses(FormatOf(scan));
      })) {
    return scans;
  }
  std::error_code error;
  const bool folder =
      fs::is_directory(options.poses, error) &&
      (options.pose_format == PoseFormat::kAuto || options.pose_format == PoseFormat::k3dtk);
  if (options.poses.empty() || folder) {
    if (Assign3dtk(folder || options.pose_format == PoseFormat::k3dtk, options.poses, scans)) {
      return scans;
    }
    STRATA_ASSIGN_OR_RETURN(options.poses, ChoosePoses(paths, scans, options));
  }
  if (!options.poses.empty()) STRATA_RETURN_IF_ERROR(AssignFromFile(options, scans));
  return scans;
}

}  // namespace strata
