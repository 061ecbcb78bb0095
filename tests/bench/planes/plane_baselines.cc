#include "tests/bench/planes/plane_baselines.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>
#include <optional>
#include <span>
#include <utility>

#include <Eigen/Core>

#include "core/cloud/point_tree.h"
#include "core/common/random.h"
#include "core/planes/moments.h"

namespace strata::bench {
namespace {

constexpr std::size_t kNeighbours = 30;
constexpr int kHoughAzimuths = 120, kHoughElevations = 30;  // of the upper half sphere
constexpr double kGrowCosine = 0.985;                       // 10°
constexpr std::size_t kStartPlanes = 40;
constexpr int kMostSteps = 60;
constexpr double kDistanceCapM = 1.0;  // 5.4.2
constexpr std::size_t kMostPlanes = 200;

std::vector<Eigen::Vector3d> Chosen(const PlaneCase& input, std::size_t most) {
  const std::vector<Eigen::Vector3f>& points = input.points.points;
  const std::size_t every = (points.size() + most - 1) / std::max<std::size_t>(1, most);
  std::vector<Eigen::Vector3d> out;
  for (std::size_t i = 0; i < points.size(); i += std::max<std::size_t>(1, every)) {
    out.push_back(points[i].cast<double>());
  }
  return out;
}

Plane PlaneThrough(std::span<const Eigen::Vector3d> points, const std::vector<double>& weights) {
  Eigen::Matrix4d moments = Eigen::Matrix4d::Zero();
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (weights[i] > 1e-9) moments += MomentsOf(weights[i], points[i], Eigen::Matrix3d::Zero());
  }
  return FitMoments(moments).plane;
}

// The nearest of the planes within near_m; each point to one.
PointGroups Assigned(const PlaneCase& input, const std::vector<Plane>& planes) {
  PointGroups groups(planes.size());
  for (std::uint32_t i = 0; i < input.points.points.size(); ++i) {
    const Eigen::Vector3d p = input.points.points[i].cast<double>();
    double least = input.near_m;
    std::optional<std::size_t> nearest;
    for (std::size_t m = 0; m < planes.size(); ++m) {
      const double off = Distance(p, planes[m]);
      if (off >= least) continue;
      least = off;
      nearest = m;
    }
    if (nearest.has_value()) groups[*nearest].push_back(i);
  }
  return groups;
}

void DropSmall(const PlaneCase& input, PointGroups& groups) {
  std::erase_if(groups, [&input](const auto& group) { return group.size() < input.min_points; });
}

class Accumulator {
 public:
  explicit Accumulator(const PlaneCase& input) : bin_m_(2.0 * input.near_m) {
    double farthest = 0.0;
    for (const Eigen::Vector3f& p : input.points.points) {
      farthest = std::max<double>(farthest, p.norm());
    }
    half_ = static_cast<int>(farthest / bin_m_) + 1;
    for (int e = 0; e < kHoughElevations; ++e) {
      const double elevation = (e + 0.5) * std::numbers::pi / 2.0 / kHoughElevations;
      for (int a = 0; a < kHoughAzimuths; ++a) {
        normals_.push_back(UnitVector({a * 2.0 * std::numbers::pi / kHoughAzimuths, elevation}));
      }
    }
    votes_.assign(normals_.size() * static_cast<std::size_t>(2 * half_ + 1), 0);
  }

  void Vote(const Eigen::Vector3d& p, int votes) {
    for (std::size_t n = 0; n < normals_.size(); ++n) votes_[Cell(n, p)] += votes;
  }
  std::size_t Highest() const {
    return static_cast<std::size_t>(std::max_element(votes_.begin(), votes_.end()) -
                                    votes_.begin());
  }
  int At(std::size_t cell) const { return votes_[cell]; }
  bool Holds(std::size_t cell, const Eigen::Vector3d& p) const {
    return Cell(cell / static_cast<std::size_t>(2 * half_ + 1), p) == cell;
  }

 private:
  std::size_t Cell(std::size_t n, const Eigen::Vector3d& p) const {
    const int at = static_cast<int>(std::floor(normals_[n].dot(p) / bin_m_ + 0.5)) + half_;
    return n * static_cast<std::size_t>(2 * half_ + 1) + static_cast<std::size_t>(at);
  }

  double bin_m_;
  int half_ = 0;
  std::vector<Eigen::Vector3d> normals_;
  std::vector<int> votes_;
};

// Expectations, plane by plane.
using Shares = std::vector<std::vector<double>>;

class PlainEm {
 public:
  PlainEm(std::vector<Eigen::Vector3d> points, double rho_m)
      : points_(std::move(points)), rho_m_(rho_m) {}

  std::vector<Plane> planes;

  // 5.4.2: planes through the neighbours of points drawn by their distance from all planes.
  void Draw(const PointTree& tree, std::span<const Eigen::Vector3f> all) {
    SplitMix64 random(1);
    std::vector<double> distance(points_.size(), kDistanceCapM);
    while (planes.size() < kStartPlanes) {
      double at = random.Uniform() * std::accumulate(distance.begin(), distance.end(), 0.0);
      std::size_t drawn = 0;
      while (drawn + 1 < points_.size() && (at -= distance[drawn]) > 0.0) ++drawn;
      const Eigen::Vector3f p = points_[drawn].cast<float>();
      std::array<std::uint32_t, kNeighbours> near{};
      std::array<float, kNeighbours> squared{};
      const std::size_t count = tree.knnSearch(p.data(), kNeighbours, near.data(), squared.data());
      Eigen::Matrix4d moments = Eigen::Matrix4d::Zero();
      for (std::size_t k = 0; k < count; ++k) {
        moments += MomentsOf(1.0, all[near[k]].cast<double>(), Eigen::Matrix3d::Zero());
      }
      planes.push_back(FitMoments(moments).plane);
      for (std::size_t i = 0; i < points_.size(); ++i) {
        distance[i] = std::min(distance[i], Distance(points_[i], planes.back()));
      }
    }
  }

  void Run() {
    double before = -1e300;
    for (int step = 0; step < kMostSteps; ++step) {
      const double now = EStep();
      if (now - before < 1e-5 * static_cast<double>(points_.size())) return;
      before = now;
      for (std::size_t m = 0; m < planes.size(); ++m) {
        if (std::accumulate(shares_[m].begin(), shares_[m].end(), 0.0) < 3.0) continue;
        planes[m] = PlaneThrough(points_, shares_[m]);
      }
    }
  }

  void DropByBic() {
    const double price = 3.0 * std::log(static_cast<double>(points_.size()));
    while (planes.size() > 1) {
      EStep();
      std::size_t best = planes.size();
      double least = 0.0;
      for (std::size_t m = 0; m < planes.size(); ++m) {
        const double change = 2.0 * LossWithout(m) - price;
        if (change >= least) continue;
        least = change;
        best = m;
      }
      if (best == planes.size()) return;
      planes.erase(planes.begin() + static_cast<std::ptrdiff_t>(best));
    }
  }

 private:
  // 5.10; the log-likelihood of 5.5.
  double EStep() {
    shares_.assign(planes.size(), std::vector<double>(points_.size()));
    const double scale = 1.0 / (2.0 * rho_m_ * rho_m_);
    double log = 0.0;
    for (std::size_t i = 0; i < points_.size(); ++i) {
      double least = 1e300;
      for (std::size_t m = 0; m < planes.size(); ++m) {
        shares_[m][i] = std::pow(SignedDistance(points_[i], planes[m]), 2) * scale;
        least = std::min(least, shares_[m][i]);
      }
      double sum = 0.0;
      for (std::size_t m = 0; m < planes.size(); ++m) {
        shares_[m][i] = std::exp(least - shares_[m][i]);
        sum += shares_[m][i];
      }
      for (std::size_t m = 0; m < planes.size(); ++m) shares_[m][i] /= sum;
      log += std::log(sum) - least;
    }
    return log - static_cast<double>(points_.size()) *
                     std::log(static_cast<double>(planes.size()) * rho_m_);
  }

  // Of the log-likelihood by leaving out plane m, the others as they are. A point that is far from
  // all others costs what its nearest one says.
  double LossWithout(std::size_t m) const {
    const double scale = 1.0 / (2.0 * rho_m_ * rho_m_);
    const double M = static_cast<double>(planes.size());
    double loss = -static_cast<double>(points_.size()) * std::log(M / (M - 1.0));
    for (std::size_t i = 0; i < points_.size(); ++i) {
      const double rest = 1.0 - shares_[m][i];
      if (rest > 1e-12) {
        loss -= std::log(rest);
        continue;
      }
      double least = 1e300;
      for (std::size_t k = 0; k < planes.size(); ++k) {
        if (k != m) least = std::min(least, std::pow(SignedDistance(points_[i], planes[k]), 2));
      }
      loss += (least - std::pow(SignedDistance(points_[i], planes[m]), 2)) * scale;
    }
    return loss;
  }

  std::vector<Eigen::Vector3d> points_;
  double rho_m_;
  Shares shares_;
};

}  // namespace

PointGroups HoughPlanes(const PlaneCase& input, std::size_t most) {
  std::vector<Eigen::Vector3d> left = Chosen(input, most);
  const std::size_t least = std::max<std::size_t>(
      5, input.min_points * left.size() / std::max<std::size_t>(1, input.points.points.size()));
  Accumulator accumulator(input);
  for (const Eigen::Vector3d& p : left) accumulator.Vote(p, 1);
  std::vector<Plane> planes;
  while (planes.size() < kMostPlanes) {
    const std::size_t highest = accumulator.Highest();
    if (accumulator.At(highest) < static_cast<int>(least)) break;
    std::vector<double> in(left.size());
    for (std::size_t i = 0; i < left.size(); ++i) {
      in[i] = accumulator.Holds(highest, left[i]) ? 1.0 : 0.0;
    }
    const Plane plane = PlaneThrough(left, in);
    planes.push_back(plane);
    std::vector<Eigen::Vector3d> rest;
    for (std::size_t i = 0; i < left.size(); ++i) {
      if (in[i] > 0.0 || Distance(left[i], plane) < input.near_m) {
        accumulator.Vote(left[i], -1);
      } else {
        rest.push_back(left[i]);
      }
    }
    left = std::move(rest);
  }
  PointGroups groups = Assigned(input, planes);
  DropSmall(input, groups);
  return groups;
}

PointGroups GrownPlanes(const PlaneCase& input) {
  const std::span<const Eigen::Vector3f> points = input.points.points;
  const PointsView view{points};
  const PointTree tree(3, view, nanoflann::KDTreeSingleIndexAdaptorParams(12));
  std::vector<std::array<std::uint32_t, kNeighbours>> near(points.size());
  std::vector<Eigen::Vector3d> normals(points.size());
  std::array<float, kNeighbours> squared{};
  for (std::size_t i = 0; i < points.size(); ++i) {
    near[i].fill(static_cast<std::uint32_t>(i));
    tree.knnSearch(points[i].data(), kNeighbours, near[i].data(), squared.data());
    Eigen::Matrix4d moments = Eigen::Matrix4d::Zero();
    for (const std::uint32_t k : near[i]) {
      moments += MomentsOf(1.0, (points[k] - points[i]).cast<double>(), Eigen::Matrix3d::Zero());
    }
    normals[i] = FitMoments(moments).plane.normal;
  }
  SplitMix64 random(1);
  const auto size = static_cast<std::uint32_t>(points.size());
  std::vector<bool> taken(points.size(), false);
  PointGroups groups;
  for (const std::uint32_t first : SampleIndices(size, size, random)) {
    if (taken[first]) continue;
    std::vector<std::uint32_t> region = {first};
    taken[first] = true;
    for (std::size_t next = 0; next < region.size(); ++next) {
      for (const std::uint32_t k : near[region[next]]) {
        if (taken[k] || std::abs(normals[k].dot(normals[first])) < kGrowCosine) continue;
        taken[k] = true;
        region.push_back(k);
      }
    }
    groups.push_back(std::move(region));
  }
  DropSmall(input, groups);
  return groups;
}

PointGroups PlainEmPlanes(const PlaneCase& input, std::size_t most) {
  const std::span<const Eigen::Vector3f> points = input.points.points;
  const PointsView view{points};
  const PointTree tree(3, view, nanoflann::KDTreeSingleIndexAdaptorParams(12));
  PlainEm em(Chosen(input, most), input.near_m / 3.0);
  em.Draw(tree, points);
  em.Run();
  em.DropByBic();
  em.Run();
  PointGroups groups = Assigned(input, em.planes);
  DropSmall(input, groups);
  return groups;
}

FoundPlanes FittedPlanes(const PlaneCase& input, PointGroups groups) {
  FoundPlanes found;
  for (std::vector<std::uint32_t>& group : groups) {
    Eigen::Matrix4d moments = Eigen::Matrix4d::Zero();
    for (const std::uint32_t i : group) {
      moments += MomentsOf(1.0, input.points.points[i].cast<double>(), Eigen::Matrix3d::Zero());
    }
    found.push_back({FitMoments(moments).plane, std::move(group)});
  }
  return found;
}

}  // namespace strata::bench
