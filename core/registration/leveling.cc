#include "core/registration/leveling.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <unordered_set>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>

#include "core/common/option_checks.h"
#include "core/common/random.h"
#include "core/common/status.h"

namespace strata {
namespace {

// n·x = d, n upwards.
struct FloorPlane {
  Eigen::Vector3d n = Eigen::Vector3d::UnitZ();
  double d = 0.0;
};

constexpr double kThinningM = 0.2;
// Three points closer than this say little about a plane.
constexpr double kMinTriangleM2 = 0.5;

// The first point of each cube, at most `max_points` of them.
std::vector<Eigen::Vector3d> ThinnedPoints(const PointCloud& cloud, int max_points) {
  std::vector<Eigen::Vector3d> points;
  std::unordered_set<std::uint64_t> seen;  // membership only: its order shows nowhere
  const auto coordinate = [](float v) {
    return static_cast<std::uint64_t>(static_cast<std::int64_t>(std::floor(v / kThinningM))) &
           0x1FFFFF;
  };
  for (const Eigen::Vector3f& p : cloud.points) {
    if (!p.allFinite() || p.cwiseAbs().maxCoeff() > 1e5F) continue;
    const std::uint64_t key = coordinate(p.x()) | coordinate(p.y()) << 21 | coordinate(p.z()) << 42;
    if (seen.insert(key).second) points.push_back(p.cast<double>());
  }
  const auto limit = static_cast<std::size_t>(max_points);
  if (points.size() <= limit) return points;
  std::vector<Eigen::Vector3d> even;
  for (std::size_t i = 0; i < limit; ++i) even.push_back(points[i * points.size() / limit]);
  return even;
}

std::size_t Support(const std::vector<Eigen::Vector3d>& points,
                    const FloorPlane& plane,
                    double thickness_m) {
  std::size_t count = 0;
  for (const Eigen::Vector3d& p : points) {
    count += static_cast<std::size_t>(std::abs(plane.n.dot(p) - plane.d) <= thickness_m);
  }
  return count;
}

FloorPlane Refit(const std::vector<Eigen::Vector3d>& points,
                 const FloorPlane& plane,
                 double thickness_m) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  Eigen::Matrix3d moments = Eigen::Matrix3d::Zero();
  double n = 0.0;
  for (const Eigen::Vector3d& p : points) {
    if (std::abs(plane.n.dot(p) - plane.d) > thickness_m) continue;
    mean += p;
    moments += p * p.transpose();
    n += 1.0;
  }
  mean /= n;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(moments / n - mean * mean.transpose());
  FloorPlane fitted;
  fitted.n = eigen.eigenvectors().col(0);
  if (fitted.n.z() < 0.0) fitted.n = -fitted.n;
  fitted.d = fitted.n.dot(mean);
  return fitted;
}

FloorPlane BestHypothesis(const std::vector<Eigen::Vector3d>& points,
                          const LevelingOptions& options,
                          std::size_t& best_support) {
  FloorPlane best;
  SplitMix64 random(options.seed);
  const auto size = static_cast<std::uint32_t>(points.size());
  const double min_cosine = std::cos(options.max_tilt_rad);
  // Most triples are no floor: they cost little, only fitting ones are counted.
  for (int tried = 0, drawn = 0; tried < options.hypotheses && drawn < 100 * options.hypotheses;
       ++drawn) {
    const Eigen::Vector3d& a = points[random.Below(size)];
    const Eigen::Vector3d& b = points[random.Below(size)];
    const Eigen::Vector3d& c = points[random.Below(size)];
    Eigen::Vector3d n = (b - a).cross(c - a);
    const double area = n.norm();
    if (area < kMinTriangleM2 || std::abs(n.z()) < min_cosine * area) continue;
    ++tried;
    n *= (n.z() < 0.0 ? -1.0 : 1.0) / area;
    const FloorPlane plane{n, n.dot(a)};
    const std::size_t support = Support(points, plane, options.thickness_m);
    if (support <= best_support) continue;
    best_support = support;
    best = plane;
  }
  return best;
}

}  // namespace

absl::Status LevelingOptions::Validate() const {
  OptionChecks checks("leveling options");
  checks.InRange("max_tilt_rad", max_tilt_rad, 1e-6, 1.0);
  checks.InRange("thickness_m", thickness_m, 0.001, 1.0);
  checks.InRange("hypotheses", hypotheses, 10, 100000);
  checks.InRange("max_points", max_points, 100, 1e7);
  checks.InRange("min_support", min_support, 1e-9, 1.0);
  return checks.status();
}

absl::StatusOr<Leveling> LevelByFloor(const PointCloud& cloud, const LevelingOptions& options) {
  STRATA_RETURN_IF_ERROR(options.Validate());
  const std::vector<Eigen::Vector3d> points = ThinnedPoints(cloud, options.max_points);
  std::size_t support = 0;
  FloorPlane floor;
  if (points.size() >= 3) floor = BestHypothesis(points, options, support);
  const double share =
      points.empty() ? 0.0 : static_cast<double>(support) / static_cast<double>(points.size());
  if (support < 3 || share < options.min_support) {
    return absl::NotFoundError(absl::StrCat("no floor: the best plane within ",
                                            options.max_tilt_rad,
                                            " rad of level holds ",
                                            share,
                                            " of the points, ",
                                            options.min_support,
                                            " is needed"));
  }
  for (int i = 0; i < 3; ++i) floor = Refit(points, floor, options.thickness_m);
  Leveling leveling;
  leveling.R_level_scan =
      Eigen::Quaterniond::FromTwoVectors(floor.n, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  leveling.tilt_rad = std::acos(std::clamp(floor.n.z(), -1.0, 1.0));
  leveling.floor_z_m = floor.d;
  leveling.support = static_cast<double>(Support(points, floor, options.thickness_m)) /
                     static_cast<double>(points.size());
  return leveling;
}

}  // namespace strata
