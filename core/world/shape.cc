#include "core/world/shape.h"

#include <algorithm>
#include <cmath>

#include "absl/strings/str_cat.h"

#include "core/common/option_checks.h"
#include "core/common/status.h"

namespace strata {
namespace {

using Eigen::Vector3d;

constexpr double kMostExtentM = 100.0;
constexpr double kMostCoordinateM = 1e7;

absl::Status Bad(const std::string& what) {
  return absl::InvalidArgumentError(absl::StrCat("shape: ", what));
}

absl::Status ValidatePart(const ShapePart& part, std::size_t i) {
  const bool box = part.kind == ShapePart::Kind::kBox;
  const bool cylinder = part.kind == ShapePart::Kind::kCylinder;
  const auto holds = [](double size) { return size > 0.0 && size <= kMostExtentM; };
  if (!holds(part.size_m.x()) || (box && !holds(part.size_m.y())) ||
      ((box || cylinder) && !holds(part.size_m.z()))) {
    return Bad(absl::StrCat("the sizes of part ", i, " are not in (0, ", kMostExtentM, "] m"));
  }
  if (!part.T_shape_part.matrix().allFinite() ||
      part.T_shape_part.translation().cwiseAbs().maxCoeff() > kMostExtentM) {
    return Bad(
        absl::StrCat("part ", i, " is not within ", kMostExtentM, " m of the shape's origin"));
  }
  return absl::OkStatus();
}

absl::Status ValidateShape(const CollisionShape& shape) {
  if (shape.triangles.empty() && shape.parts.empty()) {
    return Bad("it has neither triangles nor parts");
  }
  if (shape.triangles.size() > kMaxShapeTriangles) {
    return Bad(absl::StrCat(shape.triangles.size(),
                            " triangles, more than ",
                            kMaxShapeTriangles,
                            "; simplify the mesh"));
  }
  if (shape.parts.size() > kMaxShapeParts || shape.vertices.size() > 3 * kMaxShapeTriangles) {
    return Bad(absl::StrCat(
        "more than ", kMaxShapeParts, " parts or ", 3 * kMaxShapeTriangles, " vertices"));
  }
  for (const Eigen::Vector3f& v : shape.vertices) {
    if (!(v.cwiseAbs().maxCoeff() <= kMostExtentM) || !v.allFinite()) {
      return Bad(absl::StrCat("a vertex is not within ",
                              kMostExtentM,
                              " m of its origin; is the file in millimetres?"));
    }
  }
  for (const auto& triangle : shape.triangles) {
    for (const std::uint32_t v : triangle) {
      if (v >= shape.vertices.size()) return Bad(absl::StrCat("a triangle has no vertex ", v));
    }
  }
  for (std::size_t i = 0; i < shape.parts.size(); ++i) {
    STRATA_RETURN_IF_ERROR(ValidatePart(shape.parts[i], i));
  }
  return absl::OkStatus();
}

Pose Facing(const Vector3d& at, const Vector3d& along) {
  const double yaw = std::atan2(along.y(), along.x());
  const double pitch = -std::atan2(along.z(), along.head<2>().norm());
  return MakePose(Eigen::Quaterniond(Eigen::AngleAxisd(yaw, Vector3d::UnitZ()) *
                                     Eigen::AngleAxisd(pitch, Vector3d::UnitY())),
                  at);
}

}  // namespace

std::vector<Pose> PosesAlong(const std::vector<Vector3d>& waypoints) {
  std::vector<Pose> poses;
  for (std::size_t i = 0; i + 1 < waypoints.size(); ++i) {
    const Vector3d along = waypoints[i + 1] - waypoints[i];
    if (along.head<2>().isZero(1e-9)) continue;  // up and down on the spot turns nothing
    poses.push_back(Facing(waypoints[i], along));
    poses.push_back(Facing(waypoints[i + 1], along));
  }
  if (poses.empty() && !waypoints.empty()) {
    poses.push_back(MakePose(Eigen::Quaterniond::Identity(), waypoints.front()));
  }
  return poses;
}

absl::Status ValidateShapeQuery(const ShapeQuery& query) {
  STRATA_RETURN_IF_ERROR(ValidateShape(query.shape));
  OptionChecks checks("shape");
  checks.InRange("clearance_m", query.clearance_m, 0.0, 10.0);
  checks.InRange("ground_m", query.ground_m, 0.0, 10.0);
  STRATA_RETURN_IF_ERROR(checks.status());
  if (query.poses.empty() == query.waypoints.empty()) {
    return Bad("either poses or waypoints are needed");
  }
  if (query.poses.size() + query.waypoints.size() > kMaxShapePoses) {
    return Bad(absl::StrCat("more than ", kMaxShapePoses, " poses; check the way in parts"));
  }
  const auto lies = [](const Vector3d& p) {
    return p.allFinite() && p.cwiseAbs().maxCoeff() <= kMostCoordinateM;
  };
  for (std::size_t i = 0; i < query.poses.size(); ++i) {
    if (query.poses[i].matrix().allFinite() && lies(query.poses[i].translation())) continue;
    return Bad(absl::StrCat("pose ", i, " is not finite or not within 1e7 m"));
  }
  for (std::size_t i = 0; i < query.waypoints.size(); ++i) {
    if (lies(query.waypoints[i])) continue;
    return Bad(absl::StrCat("waypoint ", i, " is not finite or not within 1e7 m"));
  }
  return absl::OkStatus();
}

}  // namespace strata
