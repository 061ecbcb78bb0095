#include "core/registration/clouds/leveling.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <pcl/memory.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <pcl/sample_consensus/ransac.h>
#include <pcl/sample_consensus/sac_model_perpendicular_plane.h>
#include <pcl/types.h>

#include "core/common/option_checks.h"
#include "core/common/status.h"
#include "core/geometry/rotation_between.h"
#include "core/registration/clouds/thinning.h"

namespace strata {
namespace {

using Cloud = pcl::PointCloud<pcl::PointXYZ>;

constexpr double kThinningM = 0.2;
constexpr float kMaxRangeM = 100.0F;

Cloud::Ptr NearPoints(const PointCloud& cloud) {
  PointCloud near;
  for (const Eigen::Vector3f& p : cloud.points) {
    if ((p - cloud.sensor_origin).squaredNorm() <= kMaxRangeM * kMaxRangeM) {
      near.points.push_back(p);
    }
  }
  auto points = pcl::make_shared<Cloud>();
  for (const Eigen::Vector3f& p : ThinCloud(near, kThinningM).points) {
    points->emplace_back(p.x(), p.y(), p.z());
  }
  return points;
}

// n·x = d, n upwards.
struct FloorPlane {
  Eigen::Vector3d n = Eigen::Vector3d::UnitZ();
  double d = 0.0;
  std::size_t support = 0;
};

FloorPlane BestPlane(const Cloud::Ptr& points, const LevelingOptions& options) {
  // Draws alike each time.
  const auto model =
      pcl::make_shared<pcl::SampleConsensusModelPerpendicularPlane<pcl::PointXYZ>>(points);
  model->setAxis(Eigen::Vector3f::UnitZ());
  model->setEpsAngle(options.max_tilt_rad);
  pcl::RandomSampleConsensus<pcl::PointXYZ> search(model, options.thickness_m);
  search.setMaxIterations(options.hypotheses);
  search.setProbability(0.9999);
  FloorPlane floor;
  if (!search.computeModel()) return floor;
  pcl::Indices inliers;
  Eigen::VectorXf drawn;
  Eigen::VectorXf plane;
  search.getInliers(inliers);
  search.getModelCoefficients(drawn);
  model->optimizeModelCoefficients(inliers, drawn, plane);
  model->selectWithinDistance(plane, options.thickness_m, inliers);
  floor.support = inliers.size();
  floor.n = plane.head<3>().cast<double>();
  const double length = floor.n.z() < 0.0 ? -floor.n.norm() : floor.n.norm();
  floor.n /= length;
  floor.d = -plane[3] / length;
  return floor;
}

}  // namespace

absl::Status LevelingOptions::Validate() const {
  OptionChecks checks("leveling options");
  checks.InRange("max_tilt_rad", max_tilt_rad, 1e-6, 1.0);
  checks.InRange("thickness_m", thickness_m, 0.001, 1.0);
  checks.InRange("hypotheses", hypotheses, 10, 100000);
  checks.InRange("min_support", min_support, 1e-9, 1.0);
  return checks.status();
}

absl::StatusOr<Leveling> LevelByFloor(const PointCloud& cloud, const LevelingOptions& options) {
  STRATA_RETURN_IF_ERROR(options.Validate());
  const Cloud::Ptr points = NearPoints(cloud);
  FloorPlane floor;
  if (points->size() >= 3) floor = BestPlane(points, options);
  const double share =
      static_cast<double>(floor.support) / std::max(1.0, static_cast<double>(points->size()));
  if (floor.support < 3 || share < options.min_support) {
    return absl::NotFoundError(absl::StrCat("no floor: the best plane within ",
                                            options.max_tilt_rad,
                                            " rad of level holds ",
                                            share,
                                            " of the points, ",
                                            options.min_support,
                                            " is needed"));
  }
  Leveling leveling;
  leveling.R_level_scan = RotationBetween(floor.n, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  leveling.tilt_rad = std::acos(std::clamp(floor.n.z(), -1.0, 1.0));
  leveling.floor_z_m = floor.d;
  leveling.support = share;
  return leveling;
}

}  // namespace strata
