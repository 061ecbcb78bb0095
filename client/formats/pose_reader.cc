#include "client/formats/pose_reader.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "absl/strings/string_view.h"
#include "absl/strings/strip.h"
#include "absl/time/time.h"
#include <Eigen/Geometry>

#include "client/formats/file_bytes.h"
#include "client/formats/parsing/text_cursor.h"
#include "client/formats/plain_readers.h"
#include "core/common/status.h"

namespace strata {
namespace {

struct NamedFormat {
  absl::string_view name;
  PoseFormat format;
  std::size_t numbers;  // a line
};

constexpr NamedFormat kFormats[] = {
    {"auto", PoseFormat::kAuto, 0},
    {"tum", PoseFormat::kTum, 8},
    {"index-tum", PoseFormat::kIndexTum, 9},
    {"kitti", PoseFormat::kKitti, 12},
    {"3dtk", PoseFormat::k3dtk, 0},
};

constexpr double kMaxSeconds = 9e12;              // microseconds fit 64 bits
constexpr double kMaxIndex = 9007199254740992.0;  // 2^53: exact in a double
constexpr double kRotationTolerance = 0.01;

absl::StatusOr<std::vector<double>> LineNumbers(const TextCursor& cursor,
                                                const std::vector<absl::string_view>& words) {
  std::vector<double> numbers;
  for (const absl::string_view word : words) {
    const std::optional<double> number = ParseNumber(word);
    if (!number.has_value() || !std::isfinite(*number)) {
      return cursor.Error(absl::StrCat("expected a number, found '", word.substr(0, 40), "'"));
    }
    numbers.push_back(*number);
  }
  return numbers;
}

absl::StatusOr<Pose> PoseOfQuaternion(const TextCursor& cursor, const double* v) {
  const Eigen::Quaterniond q(v[6], v[3], v[4], v[5]);  // w first
  if (!(std::abs(q.norm() - 1.0) <= kRotationTolerance)) {
    return cursor.Error(absl::StrCat("quaternion has length ", q.norm(), ", expected 1"));
  }
  return MakePose(q.normalized(), Eigen::Vector3d(v[0], v[1], v[2]));
}

absl::StatusOr<Pose> PoseOfMatrix(const TextCursor& cursor, const double* v) {
  Eigen::Matrix3d R;
  R << v[0], v[1], v[2], v[4], v[5], v[6], v[8], v[9], v[10];
  const bool rotates =
      (R * R.transpose() - Eigen::Matrix3d::Identity()).norm() <= kRotationTolerance &&
      R.determinant() > 0.0;
  if (!rotates) return cursor.Error("the 12 numbers hold no rotation");
  return MakePose(Eigen::Quaterniond(R).normalized(), Eigen::Vector3d(v[3], v[7], v[11]));
}

absl::StatusOr<absl::Time> TimeOf(const TextCursor& cursor, double seconds) {
  if (std::abs(seconds) > kMaxSeconds) {
    return cursor.Error(absl::StrCat("time ", seconds, " s is beyond ±", kMaxSeconds));
  }
  return absl::FromUnixMicros(std::llround(seconds * 1e6));
}

absl::StatusOr<FilePose> ParseLine(const TextCursor& cursor,
                                   PoseFormat format,
                                   const std::vector<double>& numbers,
                                   std::size_t lines_before) {
  FilePose pose;
  const double* v = numbers.data();
  if (format == PoseFormat::kKitti) {
    pose.index = lines_before;
    STRATA_ASSIGN_OR_RETURN(pose.T_map_scan, PoseOfMatrix(cursor, v));
    return pose;
  }
  if (format == PoseFormat::kIndexTum) {
    if (*v < 0.0 || *v > kMaxIndex || *v != std::floor(*v)) {
      return cursor.Error(absl::StrCat("index ", *v, " is no whole number"));
    }
    pose.index = static_cast<std::uint64_t>(*v++);
  }
  STRATA_ASSIGN_OR_RETURN(pose.time, TimeOf(cursor, *v));
  STRATA_ASSIGN_OR_RETURN(pose.T_map_scan, PoseOfQuaternion(cursor, v + 1));
  return pose;
}

// The format of a first line of so many numbers, or an error.
absl::StatusOr<NamedFormat> Choose(const TextCursor& cursor,
                                   PoseFormat asked,
                                   std::size_t numbers) {
  for (const NamedFormat& named : kFormats) {
    const bool fits = asked == PoseFormat::kAuto ? named.numbers == numbers : named.format == asked;
    if (fits) return named;
  }
  return cursor.Error(
      absl::StrCat("expected 8 (tum), 9 (index-tum) or 12 (kitti) numbers, found ", numbers));
}

// A line that names the columns, or a comment, which may: some programs put w first.
absl::Status CheckHeading(const TextCursor& cursor, const std::vector<absl::string_view>& words) {
  const auto place = [&words](absl::string_view name) {
    return std::ranges::find_if(words, [name](absl::string_view word) {
      return absl::StrReplaceAll(absl::AsciiStrToLower(word), {{"_", ""}, {"#", ""}}) == name;
    });
  };
  const auto qw = place("qw");
  const auto qx = place("qx");
  if (qx == words.end() || qw > qx) return absl::OkStatus();
  return cursor.Error("columns qw qx qy qz; expected qx qy qz qw: write w last");
}

absl::StatusOr<PoseList> Parse(absl::string_view text, PoseFormat asked) {
  TextCursor cursor(absl::StripPrefix(text, "\xef\xbb\xbf"));  // of UTF-8
  std::optional<NamedFormat> format;
  PoseList list;
  std::set<std::uint64_t> seen;
  while (const std::optional<absl::string_view> line = cursor.NextLine()) {
    const std::vector<absl::string_view> words = SplitWords(*line, true);
    if (words.empty()) continue;
    const bool is_heading = !format.has_value() && !ParseNumber(words[0]).has_value() &&
                            absl::ascii_isalpha(words[0][0]);
    if (words[0][0] == '#' || is_heading) {
      STRATA_RETURN_IF_ERROR(CheckHeading(cursor, words));
      continue;
    }
    STRATA_ASSIGN_OR_RETURN(const std::vector<double> numbers, LineNumbers(cursor, words));
    if (!format.has_value()) {
      STRATA_ASSIGN_OR_RETURN(format, Choose(cursor, asked, numbers.size()));
    }
    if (numbers.size() != format->numbers) {
      return cursor.Error(absl::StrCat(
          format->name, " expects ", format->numbers, " numbers, found ", numbers.size()));
    }
    STRATA_ASSIGN_OR_RETURN(const FilePose pose,
                            ParseLine(cursor, format->format, numbers, list.poses.size()));
    if (pose.index.has_value() && !seen.insert(*pose.index).second) {
      return cursor.Error(absl::StrCat("index ", *pose.index, " comes twice"));
    }
    list.poses.push_back(pose);
  }
  if (!format.has_value()) return cursor.Error("expected poses, found the end of the file");
  list.format = format->format;
  return list;
}

}  // namespace

absl::StatusOr<Pose> ParseKittiPose(const TextCursor& cursor,
                                    const std::vector<absl::string_view>& twelve) {
  if (twelve.size() != 12) {
    return cursor.Error(absl::StrCat("expected 12 numbers, found ", twelve.size()));
  }
  STRATA_ASSIGN_OR_RETURN(const std::vector<double> numbers, LineNumbers(cursor, twelve));
  return PoseOfMatrix(cursor, numbers.data());
}

absl::StatusOr<PoseFormat> ParsePoseFormat(absl::string_view name) {
  for (const NamedFormat& named : kFormats) {
    if (named.name == name) return named.format;
  }
  return absl::InvalidArgumentError(absl::StrCat(
      "pose format '", name.substr(0, 40), "' is none of auto, tum, index-tum, kitti, 3dtk"));
}

absl::StatusOr<PoseList> ReadPoses(const std::filesystem::path& path, PoseFormat format) {
  if (format == PoseFormat::k3dtk) {
    return absl::InvalidArgumentError(
        absl::StrCat(path.string(),
                     ": 3DTK keeps poses in a .pose file a scan; name their folder, or nothing if "
                     "they lie beside "
                     "the scans"));
  }
  STRATA_ASSIGN_OR_RETURN(const std::string text, ReadFileBytes(path));
  absl::StatusOr<PoseList> list = Parse(text, format);
  if (!list.ok()) return Annotate(list.status(), path.string());
  return list;
}

absl::StatusOr<Pose> Read3dtkPoseOf(const std::filesystem::path& scan) {
  std::filesystem::path path = scan;
  path.replace_extension(".pose");
  STRATA_ASSIGN_OR_RETURN(const std::string text, ReadFileBytes(path));
  absl::StatusOr<Pose> pose = Parse3dtkPose(text);
  if (!pose.ok()) return Annotate(pose.status(), path.string());
  return pose;
}

}  // namespace strata
