#include "client/formats/planes/polygon_pieces.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <boost/polygon/polygon.hpp>

#include "core/common/status.h"

namespace strata {
namespace {

using LatticePolygon = boost::polygon::polygon_with_holes_data<std::int32_t>;
using LatticePiece = boost::polygon::polygon_data<std::int32_t>;
using LatticePoint = boost::polygon::point_data<std::int32_t>;
using LatticeRegion = boost::polygon::polygon_set_data<std::int32_t>;
using LatticeRing = std::vector<LatticePoint>;

constexpr double kFarthestCornerM = 1e7;
constexpr double kFinestUnitM = 1e-5;
constexpr double kMostUnits = 1e9;  // a polygon's extent

absl::Status CheckRing(const PlaneRing& ring) {
  if (ring.size() < 3) {
    return absl::InvalidArgumentError(absl::StrCat("a ring of ", ring.size(), " points"));
  }
  for (const Eigen::Vector3d& p : ring) {
    if (p.allFinite() && p.cwiseAbs().maxCoeff() <= kFarthestCornerM) continue;
    return absl::InvalidArgumentError(
        absl::StrCat("corner ", p.x(), ", ", p.y(), ", ", p.z(), " m is not within 10,000 km"));
  }
  return absl::OkStatus();
}

absl::Status CheckPlane(const ModelPlane& plane) {
  const Eigen::Vector3d& n = plane.plane.normal;
  if (!n.allFinite() || std::abs(n.norm() - 1.0) > 1e-6) {
    return absl::InvalidArgumentError(
        absl::StrCat("normal ", n.x(), ", ", n.y(), ", ", n.z(), " is not of unit length"));
  }
  if (!std::isfinite(plane.rms_m) || !std::isfinite(plane.sigma_m)) {
    return absl::InvalidArgumentError(
        absl::StrCat("rms ", plane.rms_m, " m and sigma ", plane.sigma_m, " m are not finite"));
  }
  for (const PlanePolygon& polygon : plane.polygons) {
    if (!std::isfinite(polygon.area_m2)) {
      return absl::InvalidArgumentError(absl::StrCat("area ", polygon.area_m2, " m2"));
    }
    STRATA_RETURN_IF_ERROR(CheckRing(polygon.outer));
    for (const PlaneHole& hole : polygon.holes) STRATA_RETURN_IF_ERROR(CheckRing(hole.ring));
  }
  return absl::OkStatus();
}

// Whole units in the plane, from a corner of the first polygon.
class Lattice {
 public:
  Lattice(std::span<const PlanePolygon* const> polygons, const Eigen::Vector3d& normal)
      : origin_(polygons.front()->outer.front()) {
    // One axis of a wall is level, and in a floor they are those of the map.
    axis_u_ = std::abs(normal.z()) < 0.9
                  ? Eigen::Vector3d(-normal.y(), normal.x(), 0.0).normalized()
                  : Eigen::Vector3d::UnitY().cross(normal).normalized();
    axis_v_ = normal.cross(axis_u_);
    double farthest = 0.0;
    const auto look_at = [&](const PlaneRing& ring) {
      for (const Eigen::Vector3d& p : ring) farthest = std::max(farthest, (p - origin_).norm());
    };
    for (const PlanePolygon* polygon : polygons) {
      look_at(polygon->outer);
      for (const PlaneHole& hole : polygon->holes) look_at(hole.ring);
    }
    unit_m_ = std::max(kFinestUnitM, farthest / kMostUnits);
  }

  LatticeRing Flat(const PlaneRing& ring) const {
    LatticeRing out;
    out.reserve(ring.size());
    for (const Eigen::Vector3d& p : ring) {
      const Eigen::Vector3d d = (p - origin_) / unit_m_;
      out.emplace_back(static_cast<std::int32_t>(std::lround(axis_u_.dot(d))),
                       static_cast<std::int32_t>(std::lround(axis_v_.dot(d))));
    }
    return out;
  }

  LatticePolygon Flat(const PlanePolygon& polygon) const {
    LatticePolygon flat;
    const LatticeRing outer = Flat(polygon.outer);
    flat.set(outer.begin(), outer.end());
    std::vector<LatticePiece> holes;
    for (const PlaneHole& hole : polygon.holes) {
      const LatticeRing ring = Flat(hole.ring);
      holes.emplace_back().set(ring.begin(), ring.end());
    }
    flat.set_holes(holes.begin(), holes.end());
    return flat;
  }

  // Of a lattice seen from above; beyond kMostUnits there is no corner of a polygon.
  boost::polygon::rectangle_data<std::int32_t> Flat(const Eigen::AlignedBox2d& box) const {
    const auto at = [this](double m, double origin_m) {
      return static_cast<std::int32_t>(
          std::lround(std::clamp((m - origin_m) / unit_m_, -kMostUnits, kMostUnits)));
    };
    return {at(box.min().x(), origin_.x()),
            at(box.min().y(), origin_.y()),
            at(box.max().x(), origin_.x()),
            at(box.max().y(), origin_.y())};
  }

  Eigen::Vector3d Lift(const LatticePoint& p) const {
    return origin_ + unit_m_ * (p.x() * axis_u_ + p.y() * axis_v_);
  }

 private:
  Eigen::Vector3d origin_, axis_u_, axis_v_;
  double unit_m_ = kFinestUnitM;
};

// Twice the area of the triangle; below 2^63, since no corner is farther than kMostUnits.
std::int64_t DoubleArea(const LatticePoint& a, const LatticePoint& b, const LatticePoint& c) {
  const std::int64_t abx = std::int64_t{b.x()} - a.x(), aby = std::int64_t{b.y()} - a.y();
  const std::int64_t acx = std::int64_t{c.x()} - a.x(), acy = std::int64_t{c.y()} - a.y();
  return abx * acy - aby * acx;
}

// Counterclockwise, without those on an edge; none where it has no area.
LatticeRing CornersOf(const LatticePiece& piece) {
  const LatticeRing ring(piece.begin(), piece.end());
  LatticeRing corners;
  for (const LatticePoint& p : ring) {
    while (corners.size() > 1 && DoubleArea(corners.end()[-2], corners.back(), p) == 0) {
      corners.pop_back();
    }
    if (corners.empty() || !(corners.back() == p)) corners.push_back(p);
  }
  while (corners.size() > 2 && DoubleArea(corners.end()[-2], corners.back(), corners[0]) == 0) {
    corners.pop_back();
  }
  while (corners.size() > 2 && DoubleArea(corners.back(), corners[0], corners[1]) == 0) {
    corners.erase(corners.begin());
  }
  if (corners.size() < 3) return {};
  if (DoubleArea(corners[0], corners[1], corners[2]) < 0) {
    std::reverse(corners.begin(), corners.end());
  }
  return corners;
}

}  // namespace

absl::Status CheckPlaneModel(const PlaneModel& model) {
  for (const ModelPlane& plane : model.planes) {
    STRATA_RETURN_IF_ERROR(Annotate(CheckPlane(plane), absl::StrCat("plane ", plane.id)));
  }
  return absl::OkStatus();
}

std::vector<FlatPiece> PiecesOf(const PlanePolygon& polygon, const Eigen::Vector3d& normal) {
  const PlanePolygon* const only = &polygon;
  const Lattice lattice({&only, 1}, normal);
  LatticeRegion region;
  region.insert(lattice.Flat(polygon));
  std::vector<LatticePiece> trapezoids;
  region.get_trapezoids(trapezoids);
  std::vector<FlatPiece> pieces;
  for (const LatticePiece& trapezoid : trapezoids) {
    const LatticeRing corners = CornersOf(trapezoid);
    for (std::size_t i = 1; i + 1 < corners.size(); i += 2) {
      const std::size_t last = std::min(i + 2, corners.size() - 1);
      pieces.push_back({lattice.Lift(corners[0]),
                        lattice.Lift(corners[i]),
                        lattice.Lift(corners[i + 1]),
                        lattice.Lift(corners[last])});
    }
  }
  return pieces;
}

std::vector<std::vector<Eigen::Vector2d>> UnionFromAbove(
    std::span<const PlanePolygon* const> polygons, const Eigen::AlignedBox2d& within) {
  std::vector<std::vector<Eigen::Vector2d>> rings;
  if (polygons.empty()) return rings;
  const Lattice lattice(polygons, Eigen::Vector3d::UnitZ());
  LatticeRegion region;
  for (const PlanePolygon* polygon : polygons) region.insert(lattice.Flat(*polygon));
  using boost::polygon::operators::operator&=;
  region &= lattice.Flat(within);
  std::vector<LatticePolygon> joined;
  region.get(joined);
  const auto add = [&](const auto& flat, bool counterclockwise) {
    std::vector<Eigen::Vector2d>& ring = rings.emplace_back();
    for (const LatticePoint& p : flat) ring.emplace_back(lattice.Lift(p).head<2>());
    if (ring.size() > 1 && ring.front() == ring.back()) ring.pop_back();
    const bool turns_left = boost::polygon::winding(flat) == boost::polygon::COUNTERCLOCKWISE;
    if (turns_left != counterclockwise) std::reverse(ring.begin(), ring.end());
  };
  for (const LatticePolygon& polygon : joined) {
    add(polygon, true);
    for (auto hole = polygon.begin_holes(); hole != polygon.end_holes(); ++hole) add(*hole, false);
  }
  return rings;
}

}  // namespace strata
