#include "client/formats/survey/las_points.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include <Eigen/Core>

#include "client/formats/parsing/cloud_builder.h"
#include "client/formats/parsing/scalar.h"
#include "client/formats/survey/las_header.h"
#include "client/formats/survey/las_units.h"
#include "core/cloud/point_cloud.h"
#include "core/common/status.h"

namespace strata {
namespace {

constexpr std::size_t kIntensityAt = 12;
constexpr std::size_t kClassAt = 15;
constexpr std::size_t kExtendedClassAt = 16;
constexpr std::size_t kFlagsAt = 15;

using LasColumns = std::array<std::array<double, LasPoints::kMostAtOnce>, kMeanings>;

double ClassOf(const LasFormat& format, double value) {
  const auto byte = static_cast<std::uint8_t>(value);
  const int code = format.extended ? byte : byte & 31;
  return code == 1 ? 0 : code;
}

}  // namespace

std::vector<LasPoints::Field> LasPoints::FieldsOf(const LasFormat& format) {
  std::vector<Field> fields = {
      {Meaning::kIntensity, ScalarType::kUint16, kIntensityAt},
      {Meaning::kLabel, ScalarType::kUint8, format.extended ? kExtendedClassAt : kClassAt}};
  if (format.time > 0) fields.push_back({Meaning::kTime, ScalarType::kFloat64, format.time});
  if (format.colour == 0) return fields;
  fields.push_back({Meaning::kRed, ScalarType::kUint16, format.colour});
  fields.push_back({Meaning::kGreen, ScalarType::kUint16, format.colour + 2});
  fields.push_back({Meaning::kBlue, ScalarType::kUint16, format.colour + 4});
  return fields;
}

absl::StatusOr<LasPoints> LasPoints::Create(const LasHeader& header, const LasUnits& units) {
  std::vector<Field> fields = FieldsOf(header.format);
  std::vector<Meaning> meanings = {Meaning::kX, Meaning::kY, Meaning::kZ};
  for (const Field& field : fields) meanings.push_back(field.meaning);
  STRATA_ASSIGN_OR_RETURN(CloudBuilder builder, CloudBuilder::Create(std::move(meanings)));
  return LasPoints(header, units, std::move(fields), std::move(builder));
}

LasPoints::LasPoints(const LasHeader& header,
                     const LasUnits& units,
                     std::vector<Field> fields,
                     CloudBuilder builder)
    : header_(&header),
      unit_m_(units.horizontal_m, units.horizontal_m, units.vertical_m),
      fields_(std::move(fields)),
      builder_(std::move(builder)) {}

void LasPoints::Add(std::span<const char> records) {
  LasColumns columns;
  PointBlock block{.count = records.size() / header_->point_bytes, .columns = {}};
  for (std::size_t m = 0; m < 3; ++m) block.columns[m] = columns[m].data();
  for (Field& field : fields_) {
    const auto m = static_cast<std::size_t>(field.meaning);
    block.columns[m] = columns[m].data();
    const std::span<double> values = block.of(field.meaning);
    ReadScalars(records.data() + field.at, header_->point_bytes, field.type, false, values);
    if (field.meaning == Meaning::kLabel) {
      for (double& label : values) label = ClassOf(header_->format, label);
    }
    field.any =
        field.any || std::any_of(values.begin(), values.end(), [](double v) { return v != 0.0; });
  }
  ReadCoordinates(records, block);
  builder_.AddBlock(block);
}

void LasPoints::ReadCoordinates(std::span<const char> records, PointBlock& block) const {
  constexpr std::array kAxes = {Meaning::kX, Meaning::kY, Meaning::kZ};
  for (std::size_t k = 0; k < kAxes.size(); ++k) {
    const auto i = static_cast<Eigen::Index>(k);
    const std::span<double> values = block.of(kAxes[k]);
    ReadScalars(records.data() + 4 * k, header_->point_bytes, ScalarType::kInt32, false, values);
    for (double& value : values) {
      value = (value * header_->scale[i] + header_->offset[i]) * unit_m_[i];
    }
  }
  for (double& x : block.of(Meaning::kX)) {
    if (IsWithheld(records.data())) x = std::numeric_limits<double>::quiet_NaN();
    records = records.subspan(header_->point_bytes);
  }
}

bool LasPoints::IsWithheld(const char* point) const {
  if (header_->format.extended) return (point[kFlagsAt] & 4) != 0;
  return header_->minor >= 1 && (point[kFlagsAt] & 128) != 0;
}

bool LasPoints::Any(Meaning meaning) const {
  return std::any_of(fields_.begin(), fields_.end(), [meaning](const Field& field) {
    return field.meaning == meaning && field.any;
  });
}

absl::StatusOr<PointCloud> LasPoints::Build() && {
  STRATA_ASSIGN_OR_RETURN(PointCloud cloud, std::move(builder_).Build());
  // What a sensor does not have is zero throughout.
  if (!Any(Meaning::kIntensity)) cloud.intensity.clear();
  if (!Any(Meaning::kLabel)) cloud.label.clear();
  if (!Any(Meaning::kTime)) cloud.time.clear();
  if (!Any(Meaning::kRed) && !Any(Meaning::kGreen) && !Any(Meaning::kBlue)) cloud.colour.clear();
  return cloud;
}

}  // namespace strata
