#include "client/cli/planes/storey_plan.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include <Eigen/Core>
#include <Eigen/Geometry>

#include "client/formats/planes/polygon_pieces.h"
#include "core/common/status.h"
#include "core/world/constraint.h"

namespace strata::cli {
namespace {

constexpr double kMostHeightM = 1e6;
constexpr double kMostCutHeightM = 100.0;
constexpr double kShortestM = 1e-3;
constexpr std::size_t kMostNamedHeights = 5;

absl::Status CheckOptions(const StoreyOptions& options) {
  if (!(std::abs(options.storey_z_m) <= kMostHeightM)) {
    return absl::InvalidArgumentError(absl::StrCat(
        "storey at ", options.storey_z_m, " m is not within ", kMostHeightM, " m of the map's 0"));
  }
  if (!(options.cut_height_m > 0.0 && options.cut_height_m <= kMostCutHeightM)) {
    return absl::InvalidArgumentError(absl::StrCat(
        "cut ", options.cut_height_m, " m above the floor is not in (0, ", kMostCutHeightM, "]"));
  }
  return absl::OkStatus();
}

// Where the ring passes the height, each with its place along the wall.
using Crossings = std::vector<std::pair<double, Eigen::Vector2d>>;

void AddCrossings(const PlaneRing& ring,
                  double z_m,
                  const Eigen::Vector2d& along,
                  Crossings& crossings) {
  for (std::size_t i = 0; i < ring.size(); ++i) {
    const Eigen::Vector3d& a = ring[i];
    const Eigen::Vector3d& b = ring[(i + 1) % ring.size()];
    if ((a.z() < z_m) == (b.z() < z_m)) continue;
    const double share = (z_m - a.z()) / (b.z() - a.z());
    const Eigen::Vector2d p = a.head<2>() + share * (b - a).head<2>();
    crossings.emplace_back(along.dot(p), p);
  }
}

// The part of it that is in the box.
std::optional<PlanSegment> PartWithin(const PlanSegment& segment, const Eigen::AlignedBox2d& box) {
  const Eigen::Vector2d& a = segment[0];
  const Eigen::Vector2d d = segment[1] - a;
  double first = 0.0, last = 1.0;
  for (const int axis : {0, 1}) {
    if (d(axis) == 0.0) {
      if (a(axis) < box.min()(axis) || a(axis) > box.max()(axis)) return std::nullopt;
      continue;
    }
    const auto [enters, leaves] =
        std::minmax({(box.min()(axis) - a(axis)) / d(axis), (box.max()(axis) - a(axis)) / d(axis)});
    first = std::max(first, enters);
    last = std::min(last, leaves);
  }
  if ((last - first) * d.norm() < kShortestM) return std::nullopt;
  return PlanSegment{a + first * d, a + last * d};
}

// From each odd crossing to the next.
void AddSegments(Crossings crossings,
                 const Eigen::AlignedBox2d& region,
                 std::vector<PlanSegment>& segments) {
  std::sort(crossings.begin(), crossings.end(), [](const auto& a, const auto& b) {
    return a.first < b.first;
  });
  for (std::size_t i = 0; i + 1 < crossings.size(); i += 2) {
    const auto part = PartWithin({crossings[i].second, crossings[i + 1].second}, region);
    if (part.has_value()) segments.push_back(*part);
  }
}

void CutWall(const ModelPlane& plane, StoreyPlan& plan) {
  const Eigen::Vector3d& n = plane.plane.normal;
  const Eigen::Vector2d along = Eigen::Vector2d(-n.y(), n.x()).normalized();
  for (const PlanePolygon& polygon : plane.polygons) {
    Crossings crossings;
    AddCrossings(polygon.outer, plan.cut_z_m, along, crossings);
    for (const PlaneHole& hole : polygon.holes) {
      AddCrossings(hole.ring, plan.cut_z_m, along, crossings);
      if (hole.seen_open) continue;
      Crossings across;
      AddCrossings(hole.ring, plan.cut_z_m, along, across);
      AddSegments(std::move(across), plan.region, plan.unseen);
    }
    AddSegments(std::move(crossings), plan.region, plan.walls);
  }
}

double MeanHeight(const PlaneRing& ring) {
  double sum = 0.0;
  for (const Eigen::Vector3d& p : ring) sum += p.z();
  return sum / static_cast<double>(ring.size());
}

// Of a ceiling the normal points down.
bool IsFloor(const ModelPlane& plane) {
  return plane.kind == PlaneKind::kLevel && plane.plane.normal.z() > 0.0;
}

std::vector<const PlanePolygon*> FloorsNear(const PlaneModel& model, double storey_z_m) {
  std::vector<const PlanePolygon*> floors;
  for (const ModelPlane& plane : model.planes) {
    if (!IsFloor(plane)) continue;
    for (const PlanePolygon& polygon : plane.polygons) {
      if (std::abs(MeanHeight(polygon.outer) - storey_z_m) <= kStoreyReachM) {
        floors.push_back(&polygon);
      }
    }
  }
  return floors;
}

// Of the largest floors, each height once, without a minus before 0.
std::string HeightsOfFloors(const PlaneModel& model) {
  std::vector<std::string> heights;
  for (const ModelPlane& plane : model.planes) {
    if (!IsFloor(plane) || plane.polygons.empty()) continue;
    const double z_m = std::round(MeanHeight(plane.polygons.front().outer) * 10.0) / 10.0 + 0.0;
    std::string height = absl::StrFormat("%.1f", z_m);
    if (std::find(heights.begin(), heights.end(), height) != heights.end()) continue;
    heights.push_back(std::move(height));
    if (heights.size() == kMostNamedHeights) break;
  }
  return absl::StrJoin(heights, ", ");
}

absl::Status NothingThere(const PlaneModel& model, const StoreyPlan& plan) {
  const std::string heights = HeightsOfFloors(model);
  return absl::NotFoundError(
      absl::StrFormat("no wall at z = %.2f m and no floor near z = %.2f m; %s",
                      plan.cut_z_m,
                      plan.storey_z_m,
                      heights.empty() ? std::string("the model has no floors")
                                      : absl::StrCat("the largest floors are at ", heights, " m")));
}

absl::Status NothingInRegion(const StoreyPlan& whole) {
  const Eigen::AlignedBox2d extent = ExtentOf(whole);
  return absl::NotFoundError(
      absl::StrFormat("the storey has neither wall nor floor in the region; it lies within x %.1f "
                      "to %.1f and y %.1f to %.1f m",
                      extent.min().x(),
                      extent.max().x(),
                      extent.min().y(),
                      extent.max().y()));
}

}  // namespace

absl::StatusOr<StoreyPlan> PlanOfStorey(const PlaneModel& model, const StoreyOptions& options) {
  STRATA_RETURN_IF_ERROR(CheckOptions(options));
  STRATA_RETURN_IF_ERROR(CheckPlaneModel(model));
  StoreyPlan plan;
  plan.storey_z_m = options.storey_z_m;
  plan.cut_z_m = options.storey_z_m + options.cut_height_m;
  plan.region = options.region.value_or(plan.region);
  for (const ModelPlane& plane : model.planes) {
    if (plane.kind != PlaneKind::kLevel) CutWall(plane, plan);
  }
  plan.floors = UnionFromAbove(FloorsNear(model, options.storey_z_m), plan.region);
  if (!ExtentOf(plan).isEmpty()) return plan;
  if (!options.region.has_value()) return NothingThere(model, plan);
  STRATA_ASSIGN_OR_RETURN(const StoreyPlan whole,
                          PlanOfStorey(model, {options.storey_z_m, options.cut_height_m}));
  return NothingInRegion(whole);
}

void AddObstacles(const OccupancyGrid& grid, StoreyPlan& plan) {
  const auto at = [&grid](int column, int row) {
    return Eigen::Vector2d(grid.x_m + column * grid.resolution_m,
                           grid.y_m + row * grid.resolution_m);
  };
  for (int row = 0; row < grid.height; ++row) {
    const auto begin = grid.cells.begin() + static_cast<std::ptrdiff_t>(row) * grid.width;
    for (int column = 0; column < grid.width; ++column) {
      if (begin[column] != GridCell::kOccupied) continue;
      const int first = column;
      while (column < grid.width && begin[column] == GridCell::kOccupied) ++column;
      const Eigen::AlignedBox2d obstacle(at(first, row), at(column, row + 1));
      if (plan.region.intersects(obstacle)) {
        plan.obstacles.push_back(plan.region.intersection(obstacle));
      }
    }
  }
}

Eigen::AlignedBox2d ExtentOf(const StoreyPlan& plan) {
  Eigen::AlignedBox2d box;
  for (const std::vector<PlanSegment>* segments : {&plan.walls, &plan.unseen}) {
    for (const auto& [a, b] : *segments) box.extend(a).extend(b);
  }
  for (const auto& ring : plan.floors) {
    for (const Eigen::Vector2d& p : ring) box.extend(p);
  }
  for (const Eigen::AlignedBox2d& obstacle : plan.obstacles) box.extend(obstacle);
  return box;
}

}  // namespace strata::cli
