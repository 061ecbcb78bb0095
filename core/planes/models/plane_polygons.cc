#include "core/planes/models/plane_polygons.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <boost/geometry.hpp>
#include <boost/geometry/geometries/point_xy.hpp>
#include <boost/geometry/geometries/polygon.hpp>

#include "core/planes/models/alpha_polygons.h"
#include "core/planes/models/plane_raster.h"

namespace strata {
namespace {

namespace bg = boost::geometry;
using FlatPoint = bg::model::d2::point_xy<double>;
using BoostPolygon = bg::model::polygon<FlatPoint, /*ClockWise=*/false, /*Closed=*/true>;

constexpr double kMinMeetingSine = 0.26;  // 15°
constexpr int kMostHalvings = 4;          // of a tolerance that makes a polygon invalid
constexpr double kOpenShare = 0.5;        // of a hole, crossed by rays
constexpr double kNoHoleM2 = 0.05;        // smaller ones are gaps between points
// A gap between points is a triangle of them with a circle just above ε, or a few such: a hole
// without rays through it that is no larger, in ε², says no more than that.
constexpr double kGapEpsilons2 = 4.0;

BoostPolygon ToBoost(const FlatPolygon& polygon) {
  BoostPolygon out;
  const auto fill = [](const FlatRing& ring, auto& to) {
    for (const Eigen::Vector2d& p : ring) to.emplace_back(p.x(), p.y());
    if (!ring.empty()) to.emplace_back(ring.front().x(), ring.front().y());
  };
  fill(polygon.outer, out.outer());
  out.inners().resize(polygon.holes.size());
  for (std::size_t i = 0; i < polygon.holes.size(); ++i) fill(polygon.holes[i], out.inners()[i]);
  return out;
}

FlatRing WithoutRepeats(const FlatRing& ring) {
  FlatRing out;
  for (const Eigen::Vector2d& p : ring) {
    if (out.empty() || (p - out.back()).norm() > 1e-6) out.push_back(p);
  }
  while (out.size() > 1 && (out.front() - out.back()).norm() <= 1e-6) out.pop_back();
  return out;
}

FlatPolygon FromBoost(const BoostPolygon& polygon) {
  const auto ring_of = [](const auto& from) {
    FlatRing ring;
    for (const FlatPoint& p : from) ring.emplace_back(p.x(), p.y());
    return WithoutRepeats(ring);
  };
  FlatPolygon out;
  out.outer = ring_of(polygon.outer());
  for (const auto& inner : polygon.inners()) {
    FlatRing hole = ring_of(inner);
    if (hole.size() >= 3 && -SignedArea(hole) >= kNoHoleM2) out.holes.push_back(std::move(hole));
  }
  return out;
}

// Whether the place along the line has the other plane's surface.
bool Reaches(const MeetingLine& line, double at) {
  const auto after = std::upper_bound(line.begins.begin(), line.begins.end(), at);
  if (after == line.begins.begin()) return false;
  return at <= line.ends[static_cast<std::size_t>(after - line.begins.begin()) - 1];
}

std::optional<Eigen::Vector2d> Crossing(const MeetingLine& a, const MeetingLine& b) {
  const double sine = a.along.x() * b.along.y() - a.along.y() * b.along.x();
  if (std::abs(sine) < kMinMeetingSine) return std::nullopt;
  const Eigen::Vector2d d = b.at - a.at;
  const double t = (d.x() * b.along.y() - d.y() * b.along.x()) / sine;
  return Eigen::Vector2d(a.at + t * a.along);
}

Eigen::Vector2d SnappedPoint(const Eigen::Vector2d& p,
                             std::span<const MeetingLine> lines,
                             double epsilon_m) {
  std::vector<std::pair<double, std::size_t>> near;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const Eigen::Vector2d d = p - lines[i].at;
    const double along = lines[i].along.dot(d);
    const double off = (d - along * lines[i].along).norm();
    if (off <= epsilon_m && Reaches(lines[i], along)) near.emplace_back(off, i);
  }
  if (near.empty()) return p;
  std::sort(near.begin(), near.end());
  const MeetingLine& first = lines[near[0].second];
  for (std::size_t k = 1; k < near.size(); ++k) {
    const auto corner = Crossing(first, lines[near[k].second]);
    if (corner.has_value() && (*corner - p).norm() <= 1.5 * epsilon_m) return *corner;
  }
  return first.at + first.along.dot(p - first.at) * first.along;
}

// Share of the hole's squares that rays crossed.
double CrossedShare(const FlatRing& hole, const PlaneRaster& raster) {
  Eigen::AlignedBox2d box;
  for (const Eigen::Vector2d& p : hole) box.extend(p);
  BoostPolygon polygon;
  for (const Eigen::Vector2d& p : hole) polygon.outer().emplace_back(p.x(), p.y());
  bg::correct(polygon);
  const double step = raster.look_square_m();
  double inside = 0.0, crossed = 0.0;
  for (double u = box.min().x() + step / 2; u < box.max().x(); u += step) {
    for (double v = box.min().y() + step / 2; v < box.max().y(); v += step) {
      if (!bg::within(FlatPoint(u, v), polygon)) continue;
      inside += 1.0;
      if (raster.HasLook({u, v})) crossed += 1.0;
    }
  }
  return inside > 0.0 ? crossed / inside : 0.0;
}

PlaneRing Lifted(const FlatRing& ring, const PlaneFrame& frame) {
  PlaneRing out;
  out.reserve(ring.size());
  for (const Eigen::Vector2d& p : ring) out.push_back(frame.Lift(p));
  return out;
}

// What is known of a hole; none of what may as well be a gap between points.
std::optional<PlaneHole> HoleOf(const FlatRing& hole, const SeenPlane& own, double epsilon_m) {
  const bool open = CrossedShare(hole, own.raster) >= kOpenShare;
  if (!open && -SignedArea(hole) < kGapEpsilons2 * epsilon_m * epsilon_m) return std::nullopt;
  return PlaneHole{Lifted(hole, own.frame), open};
}

}  // namespace

std::vector<MeetingLine> MeetingLines(std::span<const SeenPlane> planes,
                                      std::size_t i,
                                      double epsilon_m) {
  std::vector<MeetingLine> lines;
  const SeenPlane& own = planes[i];
  for (std::size_t other = 0; other < planes.size(); ++other) {
    if (other == i || !planes[other].box.intersects(own.box)) continue;
    const Plane& b = planes[other].plane;
    // In the own frame the other plane is a · u + c · v = rest.
    const Eigen::Vector2d across(b.normal.dot(own.frame.axis_u), b.normal.dot(own.frame.axis_v));
    const double sine = across.norm();
    if (sine < kMinMeetingSine) continue;
    MeetingLine line;
    line.at = across * (b.distance - b.normal.dot(own.frame.origin)) / (sine * sine);
    line.along = Eigen::Vector2d(-across.y(), across.x()) / sine;
    const Eigen::Vector2d start = planes[other].frame.Flat(own.frame.Lift(line.at));
    const Eigen::Vector2d end = planes[other].frame.Flat(own.frame.Lift(line.at + line.along));
    std::vector<double> places =
        planes[other].raster.HitsAlong(start, (end - start).normalized(), epsilon_m);
    std::sort(places.begin(), places.end());
    for (const double place : places) {
      if (!line.ends.empty() && place - epsilon_m <= line.ends.back()) {
        line.ends.back() = place + epsilon_m;
        continue;
      }
      line.begins.push_back(place - epsilon_m);
      line.ends.push_back(place + epsilon_m);
    }
    if (!line.begins.empty()) lines.push_back(std::move(line));
  }
  return lines;
}

FlatRing Snapped(const FlatRing& ring, std::span<const MeetingLine> lines, double epsilon_m) {
  FlatRing out;
  out.reserve(ring.size());
  for (const Eigen::Vector2d& p : ring) out.push_back(SnappedPoint(p, lines, epsilon_m));
  return WithoutRepeats(out);
}

bool IsValid(const FlatPolygon& polygon) {
  return polygon.outer.size() >= 3 && SignedArea(polygon.outer) > 0.0 &&
         bg::is_valid(ToBoost(polygon));
}

FlatPolygon Simplified(const FlatPolygon& polygon, double tolerance_m) {
  const BoostPolygon whole = ToBoost(polygon);
  double tolerance = tolerance_m;
  for (int i = 0; i < kMostHalvings; ++i, tolerance /= 2.0) {
    BoostPolygon simple;
    bg::simplify(whole, simple, tolerance);
    FlatPolygon out = FromBoost(simple);
    if (IsValid(out)) return out;
  }
  return polygon;
}

std::vector<PlanePolygon> PolygonsOf(std::span<const SeenPlane> planes,
                                     std::size_t i,
                                     const PolygonOptions& options) {
  const SeenPlane& own = planes[i];
  const double epsilon = options.epsilon_m;
  const std::vector<MeetingLine> lines = MeetingLines(planes, i, epsilon);
  std::vector<PlanePolygon> polygons;
  for (const FlatPolygon& shape : AlphaPolygons(own.raster.Outline(), epsilon)) {
    if (AreaOf(shape) < options.min_area_m2) break;
    FlatPolygon snapped;
    snapped.outer = Snapped(shape.outer, lines, epsilon);
    for (const FlatRing& hole : shape.holes) {
      if (-SignedArea(hole) >= kNoHoleM2) snapped.holes.push_back(Snapped(hole, lines, epsilon));
    }
    // The border that was measured, where the snapped one crosses itself.
    FlatPolygon simple = Simplified(snapped, epsilon / 2.0);
    if (!IsValid(simple)) simple = Simplified(shape, epsilon / 2.0);
    PlanePolygon polygon;
    polygon.outer = Lifted(simple.outer, own.frame);
    polygon.area_m2 = SignedArea(simple.outer);
    for (const FlatRing& ring : simple.holes) {
      std::optional<PlaneHole> hole = HoleOf(ring, own, epsilon);
      if (!hole.has_value()) continue;
      polygon.area_m2 += SignedArea(ring);
      polygon.holes.push_back(*std::move(hole));
    }
    polygons.push_back(std::move(polygon));
  }
  std::stable_sort(polygons.begin(), polygons.end(), [](const auto& a, const auto& b) {
    return a.area_m2 > b.area_m2;
  });
  return polygons;
}

}  // namespace strata
