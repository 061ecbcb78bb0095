#include "client/formats/survey/ptx_reader.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <ios>
#include <optional>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include <Eigen/Geometry>

#include "client/formats/parsing/cloud_builder.h"
#include "client/formats/parsing/text_cursor.h"
#include "core/common/status.h"

namespace strata {
namespace {

constexpr std::size_t kMostColumns = 7;  // x y z intensity red green blue
// Poses are written with six decimals or so.
constexpr double kRotationTolerance = 1e-3;

// Where in a file a scan begins.
struct PtxPlace {
  std::int64_t byte = 0;
  std::size_t line = 0;  // that were read before it
};

// The lines of a file that are not empty.
class PtxLines {
 public:
  PtxLines(const std::filesystem::path& path, const PtxPlace& from)
      : file_(path, std::ios::binary), place_(from) {
    file_.seekg(from.byte);
  }

  // Whether there is a further line; it lasts until the next.
  absl::StatusOr<bool> Next() {
    do {
      file_.getline(buffer_.data(), static_cast<std::streamsize>(buffer_.size()));
      const std::streamsize got = file_.gcount();
      if (file_.bad() || !file_.is_open()) return absl::UnavailableError("cannot be read");
      if (got == 0) return false;
      ++place_.line;
      if (file_.fail()) return Error(absl::StrCat("longer than ", buffer_.size() - 1, " bytes"));
      place_.byte += got;
      line_ =
          absl::string_view(buffer_.data(), static_cast<std::size_t>(got) - (file_.eof() ? 0 : 1));
    } while (line_.find_first_not_of(" \t\r") == absl::string_view::npos);
    return true;
  }
  absl::StatusOr<bool> Next(absl::string_view expected) {
    STRATA_ASSIGN_OR_RETURN(const bool more, Next());
    if (!more) return Error(absl::StrCat("expected ", expected, ", found the end of the file"));
    return true;
  }

  absl::string_view line() const { return line_; }
  const PtxPlace& place() const { return place_; }  // after the line
  absl::Status Error(absl::string_view what) const {
    return absl::InvalidArgumentError(absl::StrCat("line ", place_.line, ": ", what));
  }

 private:
  std::ifstream file_;
  PtxPlace place_;
  std::array<char, 4096> buffer_;
  absl::string_view line_;
};

// Numbers of a line; nullopt where there is something else.
struct PtxNumbers {
  std::array<double, kMostColumns> values{};
  std::size_t count = 0;
};

std::optional<PtxNumbers> NumbersOf(absl::string_view line) {
  PtxNumbers numbers;
  for (const absl::string_view word : SplitWords(line)) {
    const std::optional<double> number = ParseNumber(word);
    if (!number.has_value() || numbers.count == kMostColumns) return std::nullopt;
    numbers.values[numbers.count++] = *number;
  }
  return numbers;
}

absl::StatusOr<PtxNumbers> NextRow(std::size_t count, absl::string_view what, PtxLines& lines) {
  STRATA_RETURN_IF_ERROR(lines.Next(what).status());
  const std::optional<PtxNumbers> row = NumbersOf(lines.line());
  if (!row.has_value() || row->count != count) {
    return lines.Error(absl::StrCat(
        "expected ", what, " (", count, " numbers), found '", lines.line().substr(0, 40), "'"));
  }
  return *row;
}

absl::StatusOr<std::uint64_t> NextCount(absl::string_view what, PtxLines& lines) {
  constexpr std::uint64_t kMost = std::uint64_t{1} << 31;
  const std::vector<absl::string_view> words = SplitWords(lines.line());
  const std::optional<std::size_t> count = words.size() == 1 ? ParseCount(words[0]) : std::nullopt;
  if (!count.has_value() || *count > kMost) {
    return lines.Error(
        absl::StrCat("expected ", what, ", found '", lines.line().substr(0, 40), "'"));
  }
  return *count;
}

// Of the four rows of a matrix M with [p 1] M = [p' 1].
absl::StatusOr<Pose> NextPose(PtxLines& lines) {
  Eigen::Matrix4d M;
  for (int k = 0; k < 4; ++k) {
    STRATA_ASSIGN_OR_RETURN(const PtxNumbers row, NextRow(4, "a row of the transformation", lines));
    M.row(k) = Eigen::Map<const Eigen::RowVector4d>(row.values.data());
  }
  const Eigen::Matrix3d R = M.topLeftCorner<3, 3>().transpose();
  const double skew = (R * R.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  const bool rigid = skew <= kRotationTolerance && R.determinant() > 0.0 &&
                     M.col(3).isApprox(Eigen::Vector4d::UnitW(), kRotationTolerance);
  if (!rigid || !M.allFinite()) {
    return lines.Error(absl::StrCat(
        "the transformation is no rotation and translation (|R Rᵀ − I| = ", skew, ")"));
  }
  return MakePose(Eigen::Quaterniond(R), M.row(3).head<3>().transpose());
}

struct PtxHeader {
  std::uint64_t points = 0;  // with those that have no return
  Pose T_file_scan = Pose::Identity();
};

// The line at hand is the first of it.
absl::StatusOr<PtxHeader> ReadPtxHeader(PtxLines& lines) {
  STRATA_ASSIGN_OR_RETURN(const std::uint64_t columns, NextCount("the number of columns", lines));
  STRATA_RETURN_IF_ERROR(lines.Next("the number of rows").status());
  STRATA_ASSIGN_OR_RETURN(const std::uint64_t rows, NextCount("the number of rows", lines));
  STRATA_RETURN_IF_ERROR(NextRow(3, "where the scanner stood", lines).status());
  for (int k = 0; k < 3; ++k) {
    STRATA_RETURN_IF_ERROR(NextRow(3, "an axis of the scanner", lines).status());
  }
  STRATA_ASSIGN_OR_RETURN(const Pose T_file_scan, NextPose(lines));
  return PtxHeader{columns * rows, T_file_scan};
}

absl::Status TooFewPoints(std::uint64_t expected, std::uint64_t found, const PtxLines& lines) {
  return lines.Error(
      absl::StrCat("expected ", expected, " points, found ", found, ": the file is cut short"));
}

std::vector<Meaning> PtxColumns(std::size_t count) {
  using enum Meaning;
  switch (count) {
    case 3:
      return {kX, kY, kZ};
    case 4:
      return {kX, kY, kZ, kIntensity};
    case 6:
      return {kX, kY, kZ, kRed, kGreen, kBlue};
    case 7:
      return {kX, kY, kZ, kIntensity, kRed, kGreen, kBlue};
    default:
      return {};
  }
}

// Adds the point of a line. Of no return there may be fewer numbers.
absl::Status AddPtxPoint(const PtxLines& lines,
                         std::size_t columns,
                         std::optional<CloudBuilder>& builder) {
  const std::optional<PtxNumbers> numbers = NumbersOf(lines.line());
  const bool no_return = numbers.has_value() && numbers->count >= 3 && numbers->values[0] == 0.0 &&
                         numbers->values[1] == 0.0 && numbers->values[2] == 0.0;
  if (!numbers.has_value() || (numbers->count != columns && !no_return)) {
    return lines.Error(absl::StrCat(
        "expected the ", columns, " numbers of a point, found '", lines.line().substr(0, 60), "'"));
  }
  builder->Add(numbers->values.data());
  return absl::OkStatus();
}

// The most numbers that a line of the scan has, which are its columns.
absl::StatusOr<std::size_t> FindColumns(const std::filesystem::path& path,
                                        const PtxPlace& place,
                                        std::uint64_t points) {
  PtxLines lines(path, place);
  std::size_t most = 0;
  for (std::uint64_t i = 0; i < points; ++i) {
    STRATA_RETURN_IF_ERROR(lines.Next("a point").status());
    const std::size_t words = SplitWords(lines.line()).size();
    if (PtxColumns(words).empty()) {
      return lines.Error(absl::StrCat(
          "expected x y z intensity [red green blue], found '", lines.line().substr(0, 60), "'"));
    }
    most = std::max(most, words);
    // No return may be a shorter line: go on to a point.
    const std::optional<PtxNumbers> numbers = NumbersOf(lines.line());
    if (numbers.has_value() && (numbers->values[0] != 0.0 || numbers->values[1] != 0.0)) break;
  }
  return most;
}

absl::StatusOr<PointCloud> ReadPtxPoints(const std::filesystem::path& path,
                                         const PtxPlace& place,
                                         std::uint64_t points) {
  if (points == 0) return absl::InvalidArgumentError("a scan of 0 points");
  STRATA_ASSIGN_OR_RETURN(const std::size_t columns, FindColumns(path, place, points));
  STRATA_ASSIGN_OR_RETURN(std::optional<CloudBuilder> builder,
                          CloudBuilder::Create(PtxColumns(columns)));
  PtxLines lines(path, place);
  for (std::uint64_t i = 0; i < points; ++i) {
    STRATA_RETURN_IF_ERROR(lines.Next("a point").status());
    STRATA_RETURN_IF_ERROR(AddPtxPoint(lines, columns, builder));
  }
  return std::move(*builder).Build();
}

}  // namespace

absl::StatusOr<std::vector<Station>> ListPtxStations(const std::filesystem::path& path) {
  PtxLines lines(path, {});
  std::vector<Station> stations;
  while (true) {
    STRATA_ASSIGN_OR_RETURN(const bool more, lines.Next());
    if (!more) break;
    STRATA_ASSIGN_OR_RETURN(const PtxHeader header, ReadPtxHeader(lines));
    const PtxPlace place = lines.place();
    for (std::uint64_t i = 0; i < header.points; ++i) {
      STRATA_ASSIGN_OR_RETURN(const bool there, lines.Next());
      if (!there) return TooFewPoints(header.points, i, lines);
    }
    stations.push_back(
        {.T_file_scan = header.T_file_scan, .read = [path, place, points = header.points] {
           return ReadPtxPoints(path, place, points);
         }});
  }
  if (stations.empty()) return lines.Error("expected the number of columns of a scan");
  return stations;
}

}  // namespace strata
