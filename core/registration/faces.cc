#include "core/registration/faces.h"

#include <array>
#include <cmath>
#include <cstdint>

#include <Eigen/Core>

#include "core/mls/features.h"
#include "core/registration/column_grid.h"

namespace strata {
namespace {

// Sine of the angle at which a surface is seen; closer to its own plane nobody knows the side.
constexpr float kLeastSine = 0.03F;
// Features are cells' centres, so that a face of a wall spreads by a third of a cell, and hedges by
// more than this.
constexpr float kMaxSpreadM = 0.06F;
// What is thicker has its faces in different cells, and matches tell them apart.
constexpr float kMinThicknessM = 0.02F;
constexpr float kMaxThicknessM = 0.3F;
constexpr int kMinPoints = 4;
// Of a normal to the vertical, as a cosine.
constexpr float kLeaning = 0.5F;
// A trunk or a pole is narrower than as many features of a wall are: it is seen from all around,
// and the other side of it says where it is.
constexpr int kWallNeighbours = 32;
constexpr int kMinWallPoints = 8;
constexpr float kMinWallSpreadM = 0.13F;

// The neighbours of p apart by the side of `normal`, which points to the scan's sensor, that they
// were seen from.
struct Faces {
  NeighbourMoments own;
  NeighbourMoments other;
};

Faces FacesAround(const RegistrationTarget& target,
                  const Eigen::Vector3f& p,
                  const Eigen::Vector3f& normal,
                  int neighbours,
                  float radius_m) {
  Faces faces;
  std::array<std::uint32_t, ColumnGrid::kMaxNeighbours> indices;
  const int n =
      target.grid(FeatureClass::kVertical).Nearest(p, neighbours, radius_m, indices.data());
  for (int i = 0; i < n; ++i) {
    for (const SeenSide& side : target.upright_sides()[indices[i]]) {
      if (side.count == 0.0F) continue;
      const float sine = normal.dot(side.toward) / side.toward.norm();
      if (std::abs(sine) >= kLeastSine) (sine > 0.0F ? faces.own : faces.other).Add(side.mean - p);
    }
  }
  return faces;
}

bool IsWall(const NeighbourMoments& face, const Eigen::Vector3f& normal) {
  const Eigen::Vector3f along = normal.cross(Eigen::Vector3f::UnitZ());
  return face.n >= kMinWallPoints && face.SpreadAlong(normal) <= kMaxSpreadM &&
         face.SpreadAlong(along) >= kMinWallSpreadM;
}

bool IsThinWall(const Faces& faces, const Eigen::Vector3f& normal) {
  const float thickness_m = normal.dot(faces.own.mean() - faces.other.mean());
  return thickness_m >= kMinThicknessM && thickness_m <= kMaxThicknessM &&
         faces.own.SpreadAlong(normal) <= kMaxSpreadM &&
         faces.other.SpreadAlong(normal) <= kMaxSpreadM;
}

// True for what was seen from the other side only of something that leans, like the steps of stairs
// do: neither trunk nor pole.
bool IsLeaning(const Faces& faces, const Eigen::Vector3f& normal) {
  return std::abs(normal.z()) > kLeaning && faces.own.n == 0 && faces.other.n >= kMinWallPoints &&
         faces.other.SpreadAlong(normal) <= kMaxSpreadM;
}

SurfaceElement ElementAlong(const Eigen::Vector3f& p,
                            const NeighbourMoments& face,
                            const Eigen::Vector3f& normal) {
  return {p + normal.dot(face.mean()) * normal, normal};
}

}  // namespace

Face FaceTowards(const RegistrationTarget& target,
                 std::uint32_t index,
                 const Eigen::Vector3f& sensor,
                 const Eigen::Vector3f& normal,
                 int neighbours,
                 float radius_m,
                 SurfaceElement& element) {
  const Eigen::Vector3f& p = target.grid(FeatureClass::kVertical).points()[index];
  const Eigen::Vector3f to_sensor = sensor - p;
  const float height_m = normal.dot(to_sensor);
  if (std::abs(height_m) < kLeastSine * to_sensor.norm()) return Face::kWhole;
  const Eigen::Vector3f towards = height_m > 0.0F ? normal : Eigen::Vector3f(-normal);
  const Faces faces = FacesAround(target, p, towards, neighbours, radius_m);
  if (faces.other.n < kMinPoints) return Face::kWhole;
  if (faces.own.n >= kMinPoints) {
    if (!IsThinWall(faces, towards)) return Face::kWhole;
    element = ElementAt(p, faces.own);
    if (element.normal.isZero()) element = ElementAlong(p, faces.own, towards);
    return Face::kOne;
  }
  const Faces more = FacesAround(target, p, towards, kWallNeighbours, radius_m);
  if (IsLeaning(more, towards)) return Face::kOther;
  if (!IsWall(more.other, towards)) return Face::kWhole;
  if (faces.own.n == 0) return Face::kOther;
  element = ElementAlong(p, faces.own, towards);
  return Face::kOne;
}

}  // namespace strata
