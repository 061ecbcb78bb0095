#include "client/formats/cloud_builder.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"

#include "core/common/status.h"

namespace strata {
namespace {

struct NamedMeaning {
  absl::string_view name;
  Meaning meaning;
};

constexpr NamedMeaning kNames[] = {
    {"x", Meaning::kX},
    {"y", Meaning::kY},
    {"z", Meaning::kZ},
    {"intensity", Meaning::kIntensity},
    {"i", Meaning::kIntensity},
    {"scalar_intensity", Meaning::kIntensity},
    {"reflectance", Meaning::kIntensity},
    {"reflectivity", Meaning::kIntensity},
    {"remission", Meaning::kIntensity},
    {"red", Meaning::kRed},
    {"r", Meaning::kRed},
    {"diffuse_red", Meaning::kRed},
    {"green", Meaning::kGreen},
    {"g", Meaning::kGreen},
    {"diffuse_green", Meaning::kGreen},
    {"blue", Meaning::kBlue},
    {"b", Meaning::kBlue},
    {"diffuse_blue", Meaning::kBlue},
    {"rgb", Meaning::kPackedColour},
    {"rgba", Meaning::kPackedColour},
    {"label", Meaning::kLabel},
    {"label_id", Meaning::kLabel},
    {"class", Meaning::kLabel},
    {"classification", Meaning::kLabel},
    {"scalar_label", Meaning::kLabel},  // as CloudCompare writes them
    {"scalar_class", Meaning::kLabel},
    {"scalar_classification", Meaning::kLabel},
};

constexpr double kFarMetres = 1000.0;
constexpr double kOriginStepMetres = 100.0;
// As ValidateCloud, which knows no more the coordinates of the file.
constexpr double kFarthestMetres = 1e6;
// Nearer than this, what is small may well be seen from the zero of its coordinates.
constexpr double kSeenMetres = 100.0;

std::uint16_t LabelOf(double value) {
  return value >= 0.0 && value <= 65535.0 ? static_cast<std::uint16_t>(value) : 0;
}

absl::Status TooFar(const Eigen::Vector3d& point) {
  return absl::InvalidArgumentError(absl::StrCat("point (",
                                                 point.x(),
                                                 ", ",
                                                 point.y(),
                                                 ", ",
                                                 point.z(),
                                                 ") is more than ",
                                                 kFarthestMetres,
                                                 " m from the middle of the others or from zero"));
}

std::uint8_t ChannelOf(double value) {
  return static_cast<std::uint8_t>(std::lround(std::clamp(value, 0.0, 255.0)));
}

}  // namespace

Meaning MeaningOf(absl::string_view field_name) {
  for (const NamedMeaning& named : kNames) {
    if (absl::AsciiStrToLower(field_name) == named.name) return named.meaning;
  }
  return Meaning::kIgnored;
}

absl::StatusOr<CloudBuilder> CloudBuilder::Create(std::vector<Meaning> meanings) {
  CloudBuilder builder(std::move(meanings));
  for (const auto& [name, meaning] : {NamedMeaning{"x", Meaning::kX},
                                      NamedMeaning{"y", Meaning::kY},
                                      NamedMeaning{"z", Meaning::kZ}}) {
    if (builder.Has(meaning)) continue;
    return absl::InvalidArgumentError(absl::StrCat("points have no field ", name));
  }
  return builder;
}

CloudBuilder::CloudBuilder(std::vector<Meaning> meanings) : meanings_(std::move(meanings)) {
  // The first field of a meaning counts.
  for (Meaning& meaning : meanings_) {
    bool& has = has_[static_cast<std::size_t>(meaning)];
    if (has) meaning = Meaning::kIgnored;
    has = true;
  }
  has_colour_ = Has(Meaning::kPackedColour) ||
                (Has(Meaning::kRed) && Has(Meaning::kGreen) && Has(Meaning::kBlue));
}

void CloudBuilder::Reserve(std::size_t points) {
  points_.reserve(points);
  if (Has(Meaning::kIntensity)) intensity_.reserve(points);
  if (has_colour_) colour_.reserve(points);
  if (Has(Meaning::kLabel)) label_.reserve(points);
}

void CloudBuilder::SetGrid(std::uint32_t rows, std::uint32_t columns) {
  rows_ = rows;
  columns_ = columns;
}

void CloudBuilder::Add(const double* values) {
  std::array<double, kMeanings> of{};
  for (std::size_t i = 0; i < meanings_.size(); ++i) {
    of[static_cast<std::size_t>(meanings_[i])] = values[i];
  }
  const auto value = [&of](Meaning meaning) { return of[static_cast<std::size_t>(meaning)]; };
  Eigen::Vector3d point(value(Meaning::kX), value(Meaning::kY), value(Meaning::kZ));
  ++added_;
  if (!point.allFinite()) {
    if (rows_ == 0) return;
    point.setConstant(std::numeric_limits<double>::quiet_NaN());
  }
  points_.push_back(point);
  if (Has(Meaning::kIntensity)) {
    intensity_.push_back(static_cast<float>(value(Meaning::kIntensity)));
  }
  if (Has(Meaning::kLabel)) {
    const double label = value(Meaning::kLabel);
    whole_labels_ = whole_labels_ && (label == std::floor(label) || !std::isfinite(label));
    label_.push_back(LabelOf(label));
  }
  if (!has_colour_) return;
  if (Has(Meaning::kPackedColour)) {
    const auto bits = static_cast<std::uint32_t>(value(Meaning::kPackedColour));
    colour_.emplace_back(bits >> 16 & 0xFF, bits >> 8 & 0xFF, bits & 0xFF);
  } else {
    colour_.push_back(
        Eigen::Vector3d(value(Meaning::kRed), value(Meaning::kGreen), value(Meaning::kBlue))
            .cast<float>());
  }
}

Eigen::Vector3d CloudBuilder::ChooseOrigin() const {
  Eigen::Array3d low = Eigen::Array3d::Constant(std::numeric_limits<double>::infinity());
  Eigen::Array3d high = -low;
  for (const Eigen::Vector3d& point : points_) {
    if (std::isnan(point.x())) continue;
    low = low.min(point.array());
    high = high.max(point.array());
  }
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  for (int k = 0; k < 3; ++k) {
    const double middle = 0.5 * low[k] + 0.5 * high[k];
    const bool one_side = low[k] > 0.0 || high[k] < 0.0;
    if (one_side && std::abs(middle) > kFarMetres) {
      origin[k] = std::round(middle / kOriginStepMetres) * kOriginStepMetres;
    }
  }
  if (!sensor_origin_.isZero(0.0)) return origin;
  const Eigen::Array3d gap = (low - origin.array()).max(origin.array() - high).max(0.0);
  const double size = (high - low).matrix().norm();
  if (gap.matrix().norm() <= std::max(size, kSeenMetres)) return origin;
  return (0.5 * low + 0.5 * high).round();
}

double CloudBuilder::ColourScale() const {
  float largest = 0.0F;
  bool fractions = false;
  for (const Eigen::Vector3f& colour : colour_) {
    largest = std::max(largest, colour.maxCoeff());
    fractions = fractions || (colour.array() != colour.array().floor()).any();
  }
  if (largest > 255.0F) return 255.0 / 65535.0;
  return fractions && largest <= 1.0F ? 255.0 : 1.0;
}

absl::StatusOr<PointCloud> CloudBuilder::Build() && {
  PointCloud cloud;
  cloud.origin = ChooseOrigin();
  cloud.rows = rows_;
  cloud.columns = columns_;
  cloud.intensity = std::move(intensity_);
  if (whole_labels_) cloud.label = std::move(label_);
  if (!sensor_origin_.isZero(0.0)) {
    cloud.sensor_origin = (sensor_origin_ - cloud.origin).cast<float>();
  }
  cloud.points.reserve(points_.size());
  for (const Eigen::Vector3d& point : points_) {
    const Eigen::Vector3d local = point - cloud.origin;
    if (local.cwiseAbs().maxCoeff() > kFarthestMetres) return TooFar(point);
    cloud.points.push_back(local.cast<float>());
  }
  const double scale = ColourScale();
  cloud.colour.reserve(colour_.size());
  for (const Eigen::Vector3f& colour : colour_) {
    cloud.colour.push_back({ChannelOf(colour.x() * scale),
                            ChannelOf(colour.y() * scale),
                            ChannelOf(colour.z() * scale)});
  }
  if (CountFinite(cloud) == 0) {
    return absl::InvalidArgumentError(
        absl::StrCat("no finite point among ", added_, "; expected at least one"));
  }
  STRATA_RETURN_IF_ERROR(ValidateCloud(cloud));
  return cloud;
}

}  // namespace strata
