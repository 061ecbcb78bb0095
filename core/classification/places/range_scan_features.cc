#include "core/classification/places/range_scan_features.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstddef>
#include <numbers>
#include <utility>

#include <Eigen/Core>
#include <Eigen/LU>

namespace strata {
namespace {

using Eigen::Vector2d;

constexpr int kMagnitudes = 12;  // of Fourier, beside the first

class Features {
 public:
  Features(std::span<const float> ranges,
           std::span<const Vector2d> directions,
           std::span<const std::complex<double>> frequencies)
      : r_(ranges.begin(), ranges.end()), frequencies_(frequencies) {
    for (std::size_t i = 0; i < r_.size(); ++i) ends_.emplace_back(r_[i] * directions[i]);
  }

  std::vector<float> Take() {
    PutBeams(r_);
    for (double most = 1.0; most <= 15.0; most += 1.0) PutCut(most);
    for (double threshold = 0.1; threshold <= 4.0; threshold *= 1.3) PutThreshold(threshold);
    PutQuantiles(r_);
    PutWidths();
    PutPolygon();
    PutFourier();
    return std::move(out_);
  }

 private:
  void Put(double value) { out_.push_back(static_cast<float>(value)); }

  void PutMeanAndDeviation(const std::vector<double>& values) {
    const auto n = static_cast<double>(values.size());
    double mean = 0.0, variance = 0.0;
    for (const double v : values) mean += v / n;
    for (const double v : values) variance += (v - mean) * (v - mean) / n;
    Put(mean);
    Put(std::sqrt(variance));
  }

  std::vector<double> StepsOf(const std::vector<double>& ranges) const {
    std::vector<double> steps;
    for (std::size_t i = 0; i < ranges.size(); ++i) {
      steps.push_back(std::abs(ranges[i] - ranges[(i + 1) % ranges.size()]));
    }
    return steps;
  }

  void PutBeams(const std::vector<double>& ranges) {
    PutMeanAndDeviation(ranges);
    PutMeanAndDeviation(StepsOf(ranges));
  }

  void PutCut(double most) {
    std::vector<double> cut = r_;
    for (double& r : cut) r = std::min(r, most);
    PutBeams(cut);
  }

  // How many steps are gaps, and how many beams are no longer than some lengths.
  void PutThreshold(double threshold) {
    const std::vector<double> steps = StepsOf(r_);
    Put(static_cast<double>(
        std::count_if(steps.begin(), steps.end(), [&](double d) { return d > threshold; })));
    Put(static_cast<double>(
        std::count_if(r_.begin(), r_.end(), [&](double r) { return r < 3.0 * threshold; })));
  }

  void PutQuantiles(std::vector<double> values) {
    std::sort(values.begin(), values.end());
    for (int k = 0; k <= 10; ++k) {
      Put(values[std::min(values.size() - 1, values.size() * static_cast<std::size_t>(k) / 10)]);
    }
  }

  // From wall to wall through the scanner.
  void PutWidths() {
    std::vector<double> widths;
    const std::size_t half = r_.size() / 2;
    for (std::size_t i = 0; i < half; ++i) widths.push_back(r_[i] + r_[i + half]);
    PutQuantiles(widths);
    const auto [least, most] = std::minmax_element(widths.begin(), widths.end());
    Put(*least / std::max(1e-6, *most));
  }

  void PutPolygon() {
    double area = 0.0, perimeter = 0.0;
    Vector2d centroid = Vector2d::Zero();
    for (std::size_t i = 0; i < ends_.size(); ++i) {
      const Vector2d& a = ends_[i];
      const Vector2d& b = ends_[(i + 1) % ends_.size()];
      const double cross = a.x() * b.y() - a.y() * b.x();
      area += 0.5 * cross;
      centroid += cross / 6.0 * (a + b);
      perimeter += (b - a).norm();
    }
    area = std::max(area, 1e-6);
    centroid /= area;
    Put(area);
    Put(perimeter);
    Put(area / perimeter);
    Put(perimeter * perimeter / area);
    Put(centroid.norm());
    PutSpread(centroid);
  }

  void PutSpread(const Vector2d& centroid) {
    std::vector<double> distances;
    Eigen::Matrix2d moments = Eigen::Matrix2d::Zero();
    double longest = 0.0;
    for (const Vector2d& end : ends_) {
      const Vector2d d = end - centroid;
      distances.push_back(d.norm());
      moments += d * d.transpose() / static_cast<double>(ends_.size());
      longest = std::max(longest, d.norm());
    }
    PutMeanAndDeviation(distances);
    for (double& d : distances) d /= std::max(longest, 1e-6);
    PutMeanAndDeviation(distances);
    const double mean = 0.5 * moments.trace();
    const double root = std::sqrt(std::max(0.0, mean * mean - moments.determinant()));
    Put(std::sqrt(mean + root));
    Put(std::sqrt(std::max(0.0, mean - root)));
    Put(std::sqrt(std::max(0.0, mean - root) / std::max(1e-9, mean + root)));
  }

  void PutFourier() {
    double first = 1.0;
    for (std::size_t k = 0; k <= kMagnitudes; ++k) {
      std::complex<double> sum = 0.0;
      for (std::size_t i = 0; i < r_.size(); ++i) sum += r_[i] * frequencies_[k * r_.size() + i];
      if (k == 0) first = std::abs(sum);
      if (k > 0) Put(std::abs(sum) / std::max(first, 1e-6));
    }
  }

  std::vector<double> r_;
  std::span<const std::complex<double>> frequencies_;
  std::vector<Vector2d> ends_;
  std::vector<float> out_;
};

}  // namespace

RangeScanFeatures::RangeScanFeatures(int beams) {
  for (int i = 0; i < beams; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / beams;
    directions_.emplace_back(std::cos(angle), std::sin(angle));
  }
  for (int k = 0; k <= kMagnitudes; ++k) {
    for (int i = 0; i < beams; ++i) {
      frequencies_.push_back(std::polar(1.0, -2.0 * std::numbers::pi * k * i / beams));
    }
  }
}

std::vector<float> RangeScanFeatures::Of(std::span<const float> ranges_m) const {
  return Features(ranges_m, directions_, frequencies_).Take();
}

}  // namespace strata
