#include "client/formats/plain_readers.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "absl/strings/strip.h"
#include <Eigen/Geometry>

#include "client/formats/parsing/cloud_builder.h"
#include "client/formats/parsing/point_fields.h"
#include "client/formats/parsing/scalar.h"
#include "client/formats/parsing/text_cursor.h"
#include "core/common/status.h"

namespace strata {
namespace {

constexpr double kMetresPerCentimetre = 0.01;

// The axes of 3DTK's left-handed frame in ours.
Eigen::Matrix3d AxesOf3dtk() {
  Eigen::Matrix3d axes;
  axes << 0, 0, 1,  //
      -1, 0, 0,     //
      0, 1, 0;
  return axes;
}

std::vector<Meaning> UnnamedColumns(std::size_t columns) {
  using enum Meaning;
  switch (columns) {
    case 4:
      return {kX, kY, kZ, kIntensity};
    case 6:
      return {kX, kY, kZ, kRed, kGreen, kBlue};
    case 7:
      return {kX, kY, kZ, kIntensity, kRed, kGreen, kBlue};
    default: {
      std::vector<Meaning> meanings(columns, kIgnored);
      for (std::size_t k = 0; k < 3 && k < columns; ++k) meanings[k] = std::vector{kX, kY, kZ}[k];
      return meanings;
    }
  }
}

std::vector<Meaning> OaklandColumns(std::size_t columns) {
  std::vector<Meaning> meanings = UnnamedColumns(std::max<std::size_t>(columns, 8));
  meanings[3] = Meaning::kLabel;
  meanings.resize(columns);
  return meanings;
}

std::vector<Meaning> NamedColumns(const std::vector<absl::string_view>& names, std::size_t first) {
  std::vector<Meaning> meanings;
  for (std::size_t i = first; i < names.size(); ++i) meanings.push_back(MeaningOf(names[i]));
  return meanings;
}

// Where "x y z" stand in a row of words; none if nowhere.
std::optional<std::size_t> FindXyz(const std::vector<absl::string_view>& words) {
  for (std::size_t i = 0; i + 2 < words.size(); ++i) {
    if (MeaningOf(words[i]) == Meaning::kX && MeaningOf(words[i + 1]) == Meaning::kY &&
        MeaningOf(words[i + 2]) == Meaning::kZ) {
      return i;
    }
  }
  return std::nullopt;
}

std::optional<std::vector<double>> Numbers(const std::vector<absl::string_view>& words) {
  std::vector<double> numbers;
  for (const absl::string_view word : words) {
    const std::optional<double> number = ParseNumber(word);
    if (!number.has_value()) return std::nullopt;
    numbers.push_back(*number);
  }
  return numbers;
}

constexpr absl::string_view kByteOrderMark = "\xef\xbb\xbf";

// A word that may head a column: none that begins as numbers do, but "nan" is a number too.
bool IsName(absl::string_view word) {
  return !ParseNumber(word).has_value() &&
         !absl::ascii_isdigit(static_cast<unsigned char>(word[0])) && word[0] != '-' &&
         word[0] != '+' && word[0] != '.';
}

// Reads the points of a text, finding out at its beginning what the columns are.
class ColumnText {
 public:
  using Columns = std::vector<Meaning> (*)(std::size_t count);

  // `unnamed`: what so many columns are if the text names none.
  ColumnText(absl::string_view bytes, Columns unnamed)
      : cursor_(absl::StripPrefix(bytes, kByteOrderMark)), unnamed_(unnamed) {}

  absl::StatusOr<PointCloud> Read() {
    while (const std::optional<absl::string_view> line = cursor_.NextLine()) {
      STRATA_RETURN_IF_ERROR(ReadLine(*line));
    }
    if (!builder_.has_value()) return cursor_.Error("expected points, found the end of the file");
    return std::move(*builder_).Build();
  }

 private:
  absl::Status ReadLine(absl::string_view line) {
    const bool comment = absl::StartsWith(line, "#") || absl::StartsWith(line, "//");
    if (comment) {
      line.remove_prefix(std::min(line.find_first_not_of("#/"), line.size()));
    }
    if (!comment && absl::StrContains(line, ';') && absl::StrContains(line, ',')) {
      return cursor_.Error("';' and ',' on one line; write decimals with points: 1.25;2.5;0.75");
    }
    const std::vector<absl::string_view> words = SplitWords(line, true);
    if (words.empty()) return absl::OkStatus();
    if (comment) {
      if (const auto first = FindXyz(words); first && !builder_) {
        meanings_ = NamedColumns(words, *first);
      }
      return absl::OkStatus();
    }
    const bool first = !builder_.has_value() && meanings_.empty();
    // Some programs write the number of points first.
    if (first && words.size() == 1 && ParseCount(words[0]).has_value()) return absl::OkStatus();
    if (first && std::all_of(words.begin(), words.end(), IsName)) {
      meanings_ = NamedColumns(words, 0);
      return absl::OkStatus();
    }
    const std::optional<std::vector<double>> numbers = Numbers(words);
    return numbers.has_value() ? AddPoint(*numbers) : NotNumbers(words);
  }

  absl::Status NotNumbers(const std::vector<absl::string_view>& words) const {
    const auto bad = std::find_if(words.begin(), words.end(), [](absl::string_view word) {
      return !ParseNumber(word).has_value();
    });
    return cursor_.Error(absl::StrCat("expected numbers only, found '", bad->substr(0, 40), "'"));
  }

  absl::Status AddPoint(const std::vector<double>& numbers) {
    if (!builder_.has_value()) {
      if (meanings_.empty()) meanings_ = unnamed_(numbers.size());
      absl::StatusOr<CloudBuilder> builder = CloudBuilder::Create(meanings_);
      if (!builder.ok()) return cursor_.Error(builder.status().message());
      builder_ = *std::move(builder);
    }
    if (numbers.size() != meanings_.size()) {
      return cursor_.Error(
          absl::StrCat("expected ", meanings_.size(), " numbers, found ", numbers.size()));
    }
    builder_->Add(numbers.data());
    return absl::OkStatus();
  }

  TextCursor cursor_;
  const Columns unnamed_;
  std::vector<Meaning> meanings_;
  std::optional<CloudBuilder> builder_;
};

// No lidar of a car sees farther.
constexpr float kFarthestReturnM = 300.0F;

float FloatAt(absl::string_view bytes, std::size_t index) {
  float value = 0.0F;
  std::memcpy(&value, bytes.data() + 4 * index, sizeof value);
  return value;
}

// Whether the bytes are records of five floats of which the last is the number of a laser.
bool HasRings(absl::string_view bytes) {
  constexpr float kLasers = 128.0F;
  const std::size_t records = bytes.size() / 20;
  if (bytes.size() % 20 != 0 || records == 0) return false;
  bool any = false;
  for (std::size_t i = 0; i < records; ++i) {
    const float ring = FloatAt(bytes, 5 * i + 4);
    if (!(ring >= 0.0F && ring < kLasers && ring == std::floor(ring))) return false;
    any = any || ring > 0.0F;
  }
  return any;
}

// Records of `columns` float32 each, which begin with x y z intensity. Nothing but their values
// tells such files from those of `other`, or of anything else.
absl::StatusOr<PointCloud> ReadFloats(absl::string_view bytes,
                                      std::size_t columns,
                                      absl::string_view names,
                                      absl::string_view other) {
  const std::size_t point_bytes = 4 * columns;
  const std::string cure = absl::StrCat("; --format ", other, " reads files of another layout");
  if (bytes.size() % point_bytes != 0) {
    return absl::InvalidArgumentError(absl::StrCat(
        bytes.size(), " bytes; expected a multiple of ", point_bytes, " (", names, ")", cure));
  }
  const std::size_t points = bytes.size() / point_bytes;
  std::size_t odd = 0;
  for (std::size_t i = 0; i < points; ++i) {
    const Eigen::Vector3f p(FloatAt(bytes, i * columns),
                            FloatAt(bytes, i * columns + 1),
                            FloatAt(bytes, i * columns + 2));
    odd += p.norm() <= kFarthestReturnM ? 0 : 1;
  }
  if (100 * odd > points) {
    return absl::InvalidArgumentError(absl::StrCat(odd,
                                                   " of ",
                                                   points,
                                                   " points are farther than ",
                                                   kFarthestReturnM,
                                                   " m or not finite: these bytes are no ",
                                                   names,
                                                   cure));
  }
  const std::vector<Meaning> meanings = UnnamedColumns(4);
  STRATA_ASSIGN_OR_RETURN(CloudBuilder builder, CloudBuilder::Create(meanings));
  std::vector<PointField> fields;
  for (std::size_t k = 0; k < 4; ++k) {
    fields.push_back({meanings[k], ScalarType::kFloat32, bytes.data() + 4 * k, point_bytes});
  }
  AddPoints(fields, points, false, builder);
  return std::move(builder).Build();
}

}  // namespace

absl::StatusOr<PointCloud> ReadXyz(absl::string_view bytes) {
  return ColumnText(bytes, UnnamedColumns).Read();
}

absl::StatusOr<PointCloud> ReadOakland(absl::string_view bytes) {
  return ColumnText(bytes, OaklandColumns).Read();
}

absl::StatusOr<PointCloud> ReadKitti(absl::string_view bytes) {
  if (HasRings(bytes)) {
    return absl::InvalidArgumentError(
        "every fifth number is a ring: these are x y z intensity ring of nuScenes; read them with "
        "--format nuscenes");
  }
  return ReadFloats(bytes, 4, "x y z reflectance", "nuscenes");
}

absl::StatusOr<PointCloud> ReadNuscenes(absl::string_view bytes) {
  return ReadFloats(bytes, 5, "x y z intensity ring", "kitti");
}

absl::StatusOr<PointCloud> Read3dtk(absl::string_view bytes) {
  using enum Meaning;
  TextCursor cursor(bytes);
  std::optional<CloudBuilder> builder;
  std::size_t columns = 0;
  while (const std::optional<absl::string_view> line = cursor.NextLine()) {
    const std::vector<absl::string_view> words = SplitWords(*line);
    if (words.empty() || words[0][0] == '#') continue;
    const std::optional<std::vector<double>> numbers = Numbers(words);
    if (!numbers.has_value()) return cursor.Error("expected numbers only");
    if (numbers->size() < 3) {
      if (cursor.line_number() == 1) continue;  // some files begin with their size
      return cursor.Error(absl::StrCat("expected x y z, found ", numbers->size(), " numbers"));
    }
    if (!builder.has_value()) {
      columns = numbers->size() > 3 ? 4 : 3;
      STRATA_ASSIGN_OR_RETURN(builder, CloudBuilder::Create(UnnamedColumns(columns)));
    }
    if (numbers->size() < columns) return cursor.Error("expected a fourth number: reflectance");
    const Eigen::Vector3d p =
        kMetresPerCentimetre * (AxesOf3dtk() * Eigen::Map<const Eigen::Vector3d>(numbers->data()));
    const double values[] = {p.x(), p.y(), p.z(), columns > 3 ? (*numbers)[3] : 0.0};
    builder->Add(values);
  }
  if (!builder.has_value()) return cursor.Error("expected points, found the end of the file");
  return std::move(*builder).Build();
}

absl::StatusOr<Pose> Parse3dtkPose(absl::string_view text) {
  TextCursor cursor(text);
  double values[6];
  for (double& value : values) {
    const std::optional<double> number = ParseNumber(cursor.NextWord());
    if (!number.has_value() || !std::isfinite(*number)) {
      return cursor.Error("expected x y z [cm] and three angles [degrees]");
    }
    value = *number;
  }
  const auto rotation = [&values](int axis) {
    const double angle_rad = values[3 + axis] * std::numbers::pi / 180.0;
    return Eigen::AngleAxisd(angle_rad, Eigen::Vector3d::Unit(axis)).toRotationMatrix();
  };
  const Eigen::Matrix3d M = AxesOf3dtk();
  const Eigen::Matrix3d R = M * rotation(0) * rotation(1) * rotation(2) * M.transpose();
  const Eigen::Vector3d t(values[0], values[1], values[2]);
  return MakePose(Eigen::Quaterniond(R), kMetresPerCentimetre * (M * t));
}

}  // namespace strata
