#include "client/formats/parsing/cloud_builder.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <limits>
#include <span>
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
    {"t", Meaning::kTime},            // Ouster
    {"time", Meaning::kTime},         // Velodyne
    {"timestamp", Meaning::kTime},    // Hesai, Livox, RoboSense
    {"time_stamp", Meaning::kTime},   // Autoware
    {"offset_time", Meaning::kTime},  // Livox
    {"time_offset", Meaning::kTime},
    {"point_time_offset", Meaning::kTime},  // Cartographer
    {"scalar_time", Meaning::kTime},
    {"scalar_timestamp", Meaning::kTime},
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

// What makes 0–255 of the channels of a file.
double ColourScale(const std::vector<Eigen::Vector3f>& channels) {
  float largest = 0.0F;
  bool fractions = false;
  for (const Eigen::Vector3f& colour : channels) {
    largest = std::max(largest, colour.maxCoeff());
    fractions = fractions || (colour.array() != colour.array().floor()).any();
  }
  if (largest > 255.0F) return 255.0 / 65535.0;
  return fractions && largest <= 1.0F ? 255.0 : 1.0;
}

bool AreFinite(std::span<const double> values) {
  // What is not finite has no difference to itself.
  const Eigen::Map<const Eigen::ArrayXd> v(values.data(), std::ssize(values));
  return (v - v).sum() == 0.0;
}

bool AreBytes(std::span<const double> values) {
  return std::all_of(values.begin(), values.end(), [](double value) {
    return value >= 0.0 && value <= 255.0 && value == static_cast<std::uint8_t>(value);
  });
}

std::array<std::span<double>, 3> Coordinates(const PointBlock& block) {
  return {block.of(Meaning::kX), block.of(Meaning::kY), block.of(Meaning::kZ)};
}

template <typename T>
void AppendPoints(const PointBlock& block, std::vector<Eigen::Matrix<T, 3, 1>>& points) {
  const auto [x, y, z] = Coordinates(block);
  const std::size_t before = points.size();
  points.resize(before + block.count);
  for (std::size_t i = 0; i < block.count; ++i) {
    points[before + i] = Eigen::Vector3d(x[i], y[i], z[i]).cast<T>();
  }
}

template <typename T>
std::vector<Eigen::Vector3f> Shifted(const std::vector<Eigen::Matrix<T, 3, 1>>& points,
                                     const Eigen::Vector3d& origin) {
  std::vector<Eigen::Vector3f> shifted(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    shifted[i] = (points[i].template cast<double>() - origin).template cast<float>();
  }
  return shifted;
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
  hold_floats_ ? floats_.reserve(points) : doubles_.reserve(points);
  if (Has(Meaning::kIntensity)) intensity_.reserve(points);
  if (has_colour_) colour_.reserve(points);
  if (Has(Meaning::kLabel)) label_.reserve(points);
  if (Has(Meaning::kTime)) time_.reserve(points);
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
  PointBlock block{.count = 1, .columns = {}};
  for (std::size_t m = 0; m < kMeanings; ++m) block.columns[m] = &of[m];
  AddBlock(block);
}

void CloudBuilder::AddBlock(PointBlock block) {
  added_ += block.count;
  SettleHoles(block);
  WidenBox(block);
  hold_floats_ ? AppendPoints(block, floats_) : AppendPoints(block, doubles_);
  if (Has(Meaning::kIntensity)) {
    const std::span<const double> intensity = block.of(Meaning::kIntensity);
    intensity_.insert(intensity_.end(), intensity.begin(), intensity.end());
  }
  if (Has(Meaning::kTime)) {
    const std::span<const double> time = block.of(Meaning::kTime);
    time_.insert(time_.end(), time.begin(), time.end());
  }
  if (Has(Meaning::kLabel)) AddLabels(block.of(Meaning::kLabel));
  if (has_colour_) AddColours(block);
}

// Takes points out that are not finite, or makes holes of the grid of them.
void CloudBuilder::SettleHoles(PointBlock& block) {
  const auto [x, y, z] = Coordinates(block);
  if (AreFinite(x) && AreFinite(y) && AreFinite(z)) {
    finite_ += block.count;
    return;
  }
  std::size_t kept = 0;
  for (std::size_t i = 0; i < block.count; ++i) {
    const bool finite = std::isfinite(x[i]) && std::isfinite(y[i]) && std::isfinite(z[i]);
    if (finite) ++finite_;
    if (!finite && rows_ == 0) continue;
    if (!finite) x[i] = y[i] = z[i] = std::numeric_limits<double>::quiet_NaN();
    for (double* const column : block.columns) {
      if (column != nullptr) column[kept] = column[i];
    }
    ++kept;
  }
  block.count = kept;
}

void CloudBuilder::WidenBox(const PointBlock& block) {
  const auto [x, y, z] = Coordinates(block);
  std::array<Range, 3> box = box_;
  for (std::size_t i = 0; i < block.count; ++i) {
    if (x[i] == 0.0 && y[i] == 0.0 && z[i] == 0.0) continue;
    box[0].Widen(x[i]);
    box[1].Widen(y[i]);
    box[2].Widen(z[i]);
  }
  box_ = box;
}

void CloudBuilder::AddLabels(std::span<const double> labels) {
  for (const double label : labels) {
    const std::uint16_t id = LabelOf(label);
    label_.push_back(id);
    const bool whole = label == id || label == std::floor(label) || !std::isfinite(label);
    whole_labels_ = whole_labels_ && whole;
  }
}

void CloudBuilder::AddColours(const PointBlock& block) {
  if (!Has(Meaning::kPackedColour)) return AddChannels(block);
  for (const double value : block.of(Meaning::kPackedColour)) {
    const auto bits = static_cast<std::uint32_t>(value);
    colour_.push_back({static_cast<std::uint8_t>(bits >> 16),
                       static_cast<std::uint8_t>(bits >> 8),
                       static_cast<std::uint8_t>(bits)});
  }
}

void CloudBuilder::AddChannels(const PointBlock& block) {
  const std::span<const double> red = block.of(Meaning::kRed);
  const std::span<const double> green = block.of(Meaning::kGreen);
  const std::span<const double> blue = block.of(Meaning::kBlue);
  if (channels_.empty() && AreBytes(red) && AreBytes(green) && AreBytes(blue)) {
    for (std::size_t i = 0; i < block.count; ++i) {
      colour_.push_back({static_cast<std::uint8_t>(red[i]),
                         static_cast<std::uint8_t>(green[i]),
                         static_cast<std::uint8_t>(blue[i])});
    }
    return;
  }
  if (channels_.empty()) channels_.reserve(colour_.capacity());
  for (const Colour& colour : std::exchange(colour_, {})) {
    channels_.emplace_back(colour.r, colour.g, colour.b);
  }
  for (std::size_t i = 0; i < block.count; ++i) {
    channels_.push_back(Eigen::Vector3d(red[i], green[i], blue[i]).cast<float>());
  }
}

Eigen::Vector3d CloudBuilder::ChooseOrigin() const {
  const Eigen::Array3d low = Low();
  const Eigen::Array3d high = High();
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

absl::Status CloudBuilder::CheckDistances(const Eigen::Vector3d& origin) const {
  const auto is_far = [&origin](const auto& point) {
    const Eigen::Vector3d local = point.template cast<double>() - origin;
    return local.cwiseAbs().maxCoeff() > kFarthestMetres;
  };
  if (!is_far(Low().matrix()) && !is_far(High().matrix())) return absl::OkStatus();
  if (!hold_floats_) return TooFar(*std::find_if(doubles_.begin(), doubles_.end(), is_far));
  return TooFar(std::find_if(floats_.begin(), floats_.end(), is_far)->cast<double>());
}

std::vector<Eigen::Vector3f> CloudBuilder::TakeLocalPoints(const Eigen::Vector3d& origin) {
  if (!hold_floats_) return Shifted(doubles_, origin);
  return origin.isZero(0.0) ? std::move(floats_) : Shifted(floats_, origin);
}

std::vector<Colour> CloudBuilder::ScaledColours() const {
  const double scale = ColourScale(channels_);
  std::vector<Colour> colours;
  colours.reserve(channels_.size());
  for (const Eigen::Vector3f& channels : channels_) {
    colours.push_back({ChannelOf(channels.x() * scale),
                       ChannelOf(channels.y() * scale),
                       ChannelOf(channels.z() * scale)});
  }
  return colours;
}

absl::StatusOr<PointCloud> CloudBuilder::Build() && {
  if (finite_ == 0) {
    return absl::InvalidArgumentError(
        absl::StrCat("no finite point among ", added_, "; expected at least one"));
  }
  if (!(box_[0].low <= box_[0].high)) box_.fill({0.0, 0.0});
  PointCloud cloud;
  cloud.origin = ChooseOrigin();
  STRATA_RETURN_IF_ERROR(CheckDistances(cloud.origin));
  if (!sensor_origin_.isZero(0.0)) {
    cloud.sensor_origin = (sensor_origin_ - cloud.origin).cast<float>();
  }
  cloud.rows = rows_;
  cloud.columns = columns_;
  cloud.points = TakeLocalPoints(cloud.origin);
  cloud.intensity = std::move(intensity_);
  cloud.colour = channels_.empty() ? std::move(colour_) : ScaledColours();
  if (whole_labels_) cloud.label = std::move(label_);
  cloud.time = std::move(time_);
  STRATA_RETURN_IF_ERROR(ValidateCloud(cloud));
  return cloud;
}

}  // namespace strata
