#include "client/formats/scan_list.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
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
#include "absl/strings/str_cat.h"
#include "absl/time/time.h"

#include "client/formats/text_cursor.h"
#include "core/common/status.h"

namespace strata {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kMaxSequence = std::uint64_t{1} << 53;
constexpr absl::Duration kSameTime = absl::Milliseconds(1);

bool IsScanOfFolder(const fs::path& path, ScanFormat format) {
  const ScanFormat named = ScanFormatOfName(path);
  if (format != ScanFormat::kAuto) return named == format;
  // Folders of scans also hold read-me and pose files.
  return named != ScanFormat::kAuto && absl::AsciiStrToLower(path.extension().string()) != ".txt";
}

absl::Status AddPath(const fs::path& path, ScanFormat format, std::vector<fs::path>& files) {
  std::error_code error;
  if (!fs::exists(path, error)) {
    return absl::NotFoundError(absl::StrCat(path.string(), ": no such file or folder"));
  }
  if (!fs::is_directory(path, error)) {
    files.push_back(path);
    return absl::OkStatus();
  }
  for (fs::directory_iterator it(path, error), end; !error && it != end; it.increment(error)) {
    std::error_code ignored;
    // Neither a link to nothing nor what cannot be read is passed over: reading it will say so.
    if (!it->is_directory(ignored) && IsScanOfFolder(it->path(), format)) {
      files.push_back(it->path());
    }
  }
  if (!error) return absl::OkStatus();
  return absl::UnavailableError(absl::StrCat(path.string(), ": ", error.message()));
}

absl::Status NoScans(const std::vector<fs::path>& paths, ScanFormat format) {
  const std::string where = paths.empty() ? std::string("nowhere") : paths.front().string();
  if (format == ScanFormat::kAuto) {
    return absl::NotFoundError(absl::StrCat(where,
                                            ": no scan by its ending (.pcd .ply .bin .vtk .3d .xyz "
                                            ".csv .asc .pts); say --format xyz for "
                                            "points in .txt files"));
  }
  return absl::NotFoundError(
      absl::StrCat(where, ": no scan of format ", ScanFormatName(format), " by its ending"));
}

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

std::vector<ScanFile> Ordered(std::vector<fs::path> files, ScanFormat format) {
  std::sort(files.begin(), files.end(), [](const fs::path& a, const fs::path& b) {
    return NaturalLess(a.string(), b.string());
  });
  files.erase(std::unique(files.begin(), files.end()), files.end());
  std::set<std::uint64_t> seen;
  const bool numbered = std::all_of(files.begin(), files.end(), [&seen](const fs::path& file) {
    const std::optional<std::uint64_t> sequence = SequenceOfName(file);
    return sequence.has_value() && seen.insert(*sequence).second;
  });
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
    const std::optional<std::uint64_t> index = SequenceOfName(scan.path);
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

// The time that a file's stem is.
std::optional<absl::Time> TimeOfName(const fs::path& path) {
  const std::string stem = path.stem().string();
  const std::optional<double> seconds = ParseNumber(stem);
  if (!absl::StrContains(stem, ".") || !seconds.has_value()) return std::nullopt;
  if (!(*seconds >= 0.0 && *seconds < 9e12)) return std::nullopt;
  return absl::FromUnixMicros(std::llround(*seconds * 1e6));
}

void AssignByTime(const std::vector<FilePose>& sorted,
                  const fs::path& file,
                  std::vector<ScanFile>& scans) {
  for (ScanFile& scan : scans) {
    const absl::Time time = *TimeOfName(scan.path);
    const auto found = std::lower_bound(
        sorted.begin(), sorted.end(), time - kSameTime, [](const FilePose& pose, absl::Time t) {
          return *pose.time < t;
        });
    if (found != sorted.end() && *found->time <= time + kSameTime) {
      Assign(*found, scan);
    } else {
      scan.pose_status = NoPose(file, absl::StrCat("time ", scan.path.stem().string()));
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
  const bool timed = std::all_of(scans.begin(), scans.end(), [](const ScanFile& scan) {
    return TimeOfName(scan.path).has_value();
  });
  if (!timed && list.poses.size() > scans.size() && options.warn) {
    options.warn(absl::StrCat(options.poses.string(),
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
// is none, nothing.
void Assign3dtk(bool asked, const fs::path& folder, std::vector<ScanFile>& scans) {
  std::vector<absl::StatusOr<Pose>> poses;
  bool any = asked;
  for (const ScanFile& scan : scans) {
    const bool is_3dtk =
        scan.format == ScanFormat::k3dtk || ScanFormatOfName(scan.path) == ScanFormat::k3dtk;
    const fs::path named = folder.empty() ? scan.path : folder / scan.path.filename();
    poses.push_back(asked || is_3dtk ? Read3dtkPoseOf(named)
                                     : absl::StatusOr<Pose>(Pose::Identity()));
    any = any || (is_3dtk && !absl::IsNotFound(poses.back().status()));
  }
  for (std::size_t i = 0; any && i < scans.size(); ++i) {
    scans[i].pose_status = poses[i].status();
    if (poses[i].ok()) scans[i].T_map_scan = *poses[i];
  }
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

absl::StatusOr<std::vector<ScanFile>> ListScans(const std::vector<fs::path>& paths,
                                                const ScanListOptions& options) {
  std::vector<fs::path> files;
  for (const fs::path& path : paths) {
    STRATA_RETURN_IF_ERROR(AddPath(path, options.format, files));
  }
  if (files.empty()) {
    return NoScans(paths, options.format);
  }
  std::vector<ScanFile> scans = Ordered(std::move(files), options.format);
  std::error_code error;
  const bool folder =
      fs::is_directory(options.poses, error) &&
      (options.pose_format == PoseFormat::kAuto || options.pose_format == PoseFormat::k3dtk);
  if (options.poses.empty() || folder) {
    Assign3dtk(folder || options.pose_format == PoseFormat::k3dtk, options.poses, scans);
    return scans;
  }
  STRATA_ASSIGN_OR_RETURN(PoseList list, ReadPoses(options.poses, options.pose_format));
  if (list.format == PoseFormat::kTum) {
    AssignTum(std::move(list), options, scans);
  } else {
    AssignByIndex(list, options.poses, scans);
  }
  return scans;
}

}  // namespace strata
