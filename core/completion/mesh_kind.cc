#include "core/completion/mesh_kind.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include <Eigen/Geometry>

#include "core/common/status.h"

namespace strata {
namespace {

constexpr double kFinestSpacingM = 0.03;

double AreaOf(const std::array<Eigen::Vector3d, 3>& corners) {
  return 0.5 * (corners[1] - corners[0]).cross(corners[2] - corners[0]).norm();
}

// The i-th of a sequence that fills the triangle evenly (R2 of Roberts 2018, folded).
Eigen::Vector3d PointIn(const std::array<Eigen::Vector3d, 3>& corners, std::size_t i) {
  constexpr double kPlastic = 1.32471795724474602596;
  const auto n = static_cast<double>(i);
  double u = std::fmod(0.5 + n / kPlastic, 1.0);
  double v = std::fmod(0.5 + n / (kPlastic * kPlastic), 1.0);
  if (u + v > 1.0) {
    u = 1.0 - u;
    v = 1.0 - v;
  }
  return corners[0] + u * (corners[1] - corners[0]) + v * (corners[2] - corners[0]);
}

absl::Status CheckMesh(std::span<const Eigen::Vector3f> vertices,
                       std::span<const std::array<std::uint32_t, 3>> triangles) {
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    if (vertices[i].allFinite()) continue;
    return absl::InvalidArgumentError(absl::StrCat("mesh: vertex ", i, " is not finite"));
  }
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    for (const std::uint32_t vertex : triangles[i]) {
      if (vertex < vertices.size()) continue;
      return absl::InvalidArgumentError(
          absl::StrCat("mesh: triangle ", i, " has vertex ", vertex, " of ", vertices.size()));
    }
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<KindShape> KindShapeOfMesh(std::span<const Eigen::Vector3f> vertices,
                                          std::span<const std::array<std::uint32_t, 3>> triangles) {
  STRATA_RETURN_IF_ERROR(CheckMesh(vertices, triangles));
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3f& v : vertices) box.extend(v.cast<double>());
  const Eigen::Vector3d base(box.center().x(), box.center().y(), box.min().z());
  const auto corners_of = [&](const std::array<std::uint32_t, 3>& triangle) {
    std::array<Eigen::Vector3d, 3> corners;
    for (std::size_t k = 0; k < 3; ++k) corners[k] = vertices[triangle[k]].cast<double>() - base;
    return corners;
  };
  double area = 0.0;
  for (const auto& triangle : triangles) area += AreaOf(corners_of(triangle));
  if (!(area > 0.0)) return absl::InvalidArgumentError("mesh: its triangles have no area");
  const double of_each =
      std::max(kFinestSpacingM * kFinestSpacingM, area / static_cast<double>(kMaxKindPoints - 1));
  KindShape shape;
  double owed = 0.0;
  for (const auto& triangle : triangles) {
    const auto corners = corners_of(triangle);
    for (owed += AreaOf(corners) / of_each; owed >= 1.0; owed -= 1.0) {
      shape.points.push_back(PointIn(corners, shape.points.size()).cast<float>());
    }
  }
  if (vertices.size() <= kMaxKindVertices && triangles.size() <= kMaxKindTriangles) {
    for (const Eigen::Vector3f& v : vertices) {
      shape.vertices.push_back((v.cast<double>() - base).cast<float>());
    }
    shape.triangles.assign(triangles.begin(), triangles.end());
  }
  STRATA_RETURN_IF_ERROR(ValidateKindShape(shape));
  return shape;
}

}  // namespace strata
