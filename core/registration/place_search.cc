#include "core/registration/place_search.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <numbers>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "core/common/random.h"
#include "core/mls/features.h"
#include "core/registration/column_grid.h"
#include "core/registration/place_match.h"
#include "core/registration/upright_frame.h"

namespace strata {
namespace {

constexpr double kCellM = 1.0;         // of the images, and the step of shifts
constexpr double kHeadingStep = 0.05;  // 3 m at 60 m, where the image's blur ends
constexpr int kMinPoints = 2;          // of a vertical patch in a cell of the image: half a metre
constexpr double kFullPoints = 12.0;   // taller structure counts no more
constexpr std::uint32_t kMaxStructure = 500;
constexpr std::uint32_t kMaxGround = 400;
constexpr double kGroundRangeM = 25.0;
constexpr double kHeightBinM = 0.25;
constexpr double kStoreyM = 1.5;
constexpr double kRivalShare = 0.5;  // of the matches of the best height
constexpr double kSameShiftM = 3.0;
constexpr double kSameHeading = 0.17;

Pose Upright(double heading_rad, const Eigen::Vector3d& t) {
  Pose T = Pose::Identity();
  T.linear() = Eigen::AngleAxisd(heading_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  T.translation() = t;
  return T;
}

template <typename T>
std::vector<T> Sample(const std::vector<T>& all, std::uint32_t count) {
  SplitMix64 random(1);
  std::vector<T> chosen;
  for (const std::uint32_t i :
       SampleIndices(static_cast<std::uint32_t>(all.size()), count, random)) {
    chosen.push_back(all[i]);
  }
  return chosen;
}

}  // namespace

PlaceSearch::PlaceSearch(const ScanFeatures& source, const RegistrationTarget& target)
    : origin_(target.origin()) {
  std::map<std::pair<int, int>, std::pair<Eigen::Vector2d, int>> cells;
  const Eigen::Matrix3f upright = UprightTurn(source.up()).cast<float>();
  for (const Eigen::Vector3f& p_source : source.points(FeatureClass::kVertical)) {
    const Eigen::Vector3f p = upright * p_source;
    auto& [sum, n] = cells
                         .try_emplace({static_cast<int>(std::floor(p.x() / kCellM)),
                                       static_cast<int>(std::floor(p.y() / kCellM))},
                                      Eigen::Vector2d::Zero(),
                                      0)
                         .first->second;
    sum += p.head<2>().cast<double>();
    ++n;
  }
  for (const auto& [cell, content] : cells) {
    const auto& [sum, n] = content;
    if (n >= kMinPoints) structure_.push_back({sum / n, std::min(1.0, n / kFullPoints)});
  }
  structure_ = Sample(structure_, kMaxStructure);
  for (const Eigen::Vector3f& p_source : source.points(FeatureClass::kTraversable)) {
    const Eigen::Vector3f p = upright * p_source;
    if (p.head<2>().norm() < kGroundRangeM) ground_.push_back(p.cast<double>());
  }
  ground_ = Sample(ground_, kMaxGround);

  Eigen::AlignedBox2d box;
  for (const auto c : {FeatureClass::kVertical, FeatureClass::kTraversable}) {
    for (const Eigen::Vector3f& p : target.grid(c).points()) {
      box.extend(p.head<2>().cast<double>());
    }
  }
  if (box.isEmpty()) return;
  corner_ = box.min().array() - 2.0 * kCellM;
  columns_ = static_cast<int>(std::ceil(box.sizes().x() / kCellM)) + 4;
  rows_ = static_cast<int>(std::ceil(box.sizes().y() / kCellM)) + 4;
  const std::size_t size = static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_);
  const auto cell_of = [&](const Eigen::Vector3f& p) {
    const Eigen::Vector2d at = (p.head<2>().cast<double>() - corner_) / kCellM;
    return static_cast<std::size_t>(at.y()) * static_cast<std::size_t>(columns_) +
           static_cast<std::size_t>(at.x());
  };
  std::vector<int> counts(size, 0);
  for (const Eigen::Vector3f& p : target.grid(FeatureClass::kVertical).points()) {
    ++counts[cell_of(p)];
  }
  image_.assign(size, 0.0F);
  constexpr float kBlur[] = {1.0F, 0.7F, 0.5F};  // by squared distance in cells
  for (int y = 1; y + 1 < rows_; ++y) {
    for (int x = 1; x + 1 < columns_; ++x) {
      if (counts[static_cast<std::size_t>(y * columns_ + x)] < kMinPoints) continue;
      for (int dy = -1; dy <= 1; ++dy) {
        for (int dx = -1; dx <= 1; ++dx) {
          float& v = image_[static_cast<std::size_t>((y + dy) * columns_ + x + dx)];
          v = std::max(v, kBlur[dx * dx + dy * dy]);
        }
      }
    }
  }
  levels_.resize(size);
  for (const Eigen::Vector3f& p : target.grid(FeatureClass::kTraversable).points()) {
    std::vector<float>& levels = levels_[cell_of(p)];
    if (std::none_of(levels.begin(), levels.end(), [&](float z) {
          return std::abs(z - p.z()) < kHeightBinM;
        })) {
      levels.push_back(p.z());
    }
  }
}

double PlaceSearch::Score(const std::vector<Structure>& turned,
                          const Eigen::Vector2d& shift) const {
  double score = 0.0;
  const Eigen::Vector2d offset = shift - corner_;
  for (const Structure& s : turned) {
    const double x = (s.p.x() + offset.x()) / kCellM;
    const double y = (s.p.y() + offset.y()) / kCellM;
    if (x < 0.0 || y < 0.0 || x >= columns_ || y >= rows_) continue;
    score +=
        s.weight *
        static_cast<double>(
            image_[static_cast<std::size_t>(static_cast<int>(y) * columns_ + static_cast<int>(x))]);
  }
  return score;
}

std::vector<double> PlaceSearch::Heights(double heading_rad,
                                         const Eigen::Vector2d& shift,
                                         double middle_m,
                                         double range_m) const {
  const int half = static_cast<int>(std::ceil(range_m / kHeightBinM));
  std::vector<double> histogram(static_cast<std::size_t>(2 * half + 1), 0.0);
  const Eigen::Rotation2Dd turn(heading_rad);
  for (const Eigen::Vector3d& p : ground_) {
    const Eigen::Vector2d at = (turn * p.head<2>() + shift - corner_) / kCellM;
    if (at.x() < 0.0 || at.y() < 0.0 || at.x() >= columns_ || at.y() >= rows_) continue;
    for (const float z :
         levels_[static_cast<std::size_t>(at.y()) * static_cast<std::size_t>(columns_) +
                 static_cast<std::size_t>(at.x())]) {
      const double bin = std::round((static_cast<double>(z) - p.z() - middle_m) / kHeightBinM);
      if (std::abs(bin) <= half) histogram[static_cast<std::size_t>(bin + half)] += 1.0;
    }
  }
  std::vector<double> smooth(histogram.size(), 0.0);
  for (std::size_t i = 0; i < histogram.size(); ++i) {
    smooth[i] = histogram[i] + (i > 0 ? histogram[i - 1] : 0.0) +
                (i + 1 < histogram.size() ? histogram[i + 1] : 0.0);
  }
  std::vector<double> heights;
  const double best = *std::max_element(smooth.begin(), smooth.end());
  while (true) {
    const auto peak = std::max_element(smooth.begin(), smooth.end());
    if (*peak <= 0.0 || *peak < kRivalShare * best) break;
    const auto at = static_cast<int>(peak - smooth.begin());
    heights.push_back(middle_m + (at - half) * kHeightBinM);
    const int near = static_cast<int>(kStoreyM / kHeightBinM);
    for (int i = std::max(0, at - near); i <= std::min(2 * half, at + near); ++i) {
      smooth[static_cast<std::size_t>(i)] = 0.0;
    }
  }
  if (heights.empty()) heights.push_back(middle_m);
  return heights;
}

std::vector<CoarsePlace> PlaceSearch::Search(const PlaceHypothesis& hypothesis,
                                             std::size_t count) const {
  std::vector<CoarsePlace> places;
  double all = 0.0;
  for (const Structure& s : structure_) all += s.weight;
  if (all == 0.0 || image_.empty()) return places;

  struct Candidate {
    double heading_rad;
    Eigen::Vector2d shift;
    double score;
  };
  std::vector<Candidate> candidates;
  const Eigen::Matrix3d& R = hypothesis.T_target_source.linear();
  const double middle = std::atan2(R(1, 0), R(0, 0));
  const Eigen::Vector3d t = hypothesis.T_target_source.translation() - origin_;
  const double turn = std::min(hypothesis.heading_range_rad, std::numbers::pi);
  const int turns = static_cast<int>(std::ceil(turn / kHeadingStep));
  const int steps = static_cast<int>(std::ceil(hypothesis.radius_m / kCellM));
  for (int h = -turns; h <= turns; ++h) {
    const double heading = middle + h * (turns > 0 ? turn / turns : 0.0);
    std::vector<Structure> turned = structure_;
    for (Structure& s : turned) s.p = Eigen::Rotation2Dd(heading) * s.p;
    for (int y = -steps; y <= steps; ++y) {
      for (int x = -steps; x <= steps; ++x) {
        if (x * x + y * y > steps * steps) continue;
        const Eigen::Vector2d shift = t.head<2>() + kCellM * Eigen::Vector2d(x, y);
        candidates.push_back({heading, shift, Score(turned, shift) / all});
      }
    }
  }
  std::stable_sort(candidates.begin(), candidates.end(), [](const auto& a, const auto& b) {
    return a.score > b.score;
  });
  std::vector<Candidate> chosen;
  for (const Candidate& c : candidates) {
    if (places.size() >= count) break;
    if (std::any_of(chosen.begin(), chosen.end(), [&](const Candidate& other) {
          const double turned =
              std::remainder(c.heading_rad - other.heading_rad, 2.0 * std::numbers::pi);
          return (c.shift - other.shift).norm() < kSameShiftM && std::abs(turned) < kSameHeading;
        })) {
      continue;
    }
    chosen.push_back(c);
    for (const double z : Heights(c.heading_rad, c.shift, t.z(), hypothesis.height_range_m)) {
      const Eigen::Vector3d shift(c.shift.x(), c.shift.y(), z);
      places.push_back({Upright(c.heading_rad, shift + origin_), c.score});
    }
  }
  if (places.size() > count) places.resize(count);
  return places;
}

}  // namespace strata
