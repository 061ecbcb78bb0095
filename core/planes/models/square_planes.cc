#include "core/planes/models/square_planes.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <optional>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include <Eigen/Core>

#include "core/common/random.h"
#include "core/common/status.h"
#include "core/common/stop.h"
#include "core/planes/extraction.h"
#include "core/planes/models/cells_of_planes.h"
#include "core/planes/models/coloured_cells.h"
#include "core/planes/models/model_selection.h"
#include "core/planes/models/peeled_cells.h"
#include "core/planes/models/plane_colour.h"
#include "core/planes/models/plane_mixture.h"
#include "core/planes/models/planes_at_points.h"
#include "core/planes/moments.h"
#include "core/planes/planar_cells.h"
#include "core/planes/region_growing.h"

namespace strata {
namespace {

constexpr int kMostRounds = 8;
constexpr int kMostSteps = 40;
constexpr double kFloorM = 0.02;              // of ρ, beside what is measured: waves of a surface
constexpr double kIndependentAreaM2 = 0.125;  // of surface for a measurement of a plane's place
constexpr double kExplainedSigmas = 2.0;      // of a plane's points about it
constexpr double kStartShare = 0.25;          // of min_area_m2, of a region that begins a plane

PlaneExtractionOptions CellOptions(const PlaneModelOptions& options) {
  PlaneExtractionOptions cells;
  cells.sensor.sigma_m = std::max(kFloorM, options.rho_m);
  cells.sensor.sigma_per_metre = 0.0;
  cells.max_range_m = 1000.0;
  cells.cell_size_m = options.cell_size_m;
  cells.max_rms_m = std::max(0.06, 1.5 * options.rho_m);
  return cells;
}

MixtureCell MixtureCellOf(const PlanarCell& cell,
                          const CellColour& colour,
                          const Eigen::Vector3d& shift,
                          const PlaneModelOptions& options) {
  MixtureCell out;
  out.mean = cell.mean + shift;
  out.covariance =
      cell.moments.topLeftCorner<3, 3>() / cell.moments(3, 3) - cell.mean * cell.mean.transpose();
  out.measurements = std::min(cell.area_m2 / kIndependentAreaM2, 1.0 * cell.point_count);
  const double rho = options.rho_m > 0.0 ? options.rho_m : std::hypot(cell.rms_m, kFloorM);
  out.variance_m2 = rho * rho;
  out.area_m2 = cell.area_m2;
  out.colour = colour.mean;
  out.colour_variance = colour.variance;
  return out;
}

// What a plane begins with: cells of one colour in one region.
struct StartGroup {
  Eigen::Matrix4d moments = Eigen::Matrix4d::Zero();  // of their area
  LabColour colour = LabColour::Zero();               // mean
  std::vector<Voxel> voxels;
};

void AddCell(const MixtureCell& cell, std::vector<StartGroup>& groups) {
  auto group = std::find_if(groups.begin(), groups.end(), [&cell](const StartGroup& one) {
    return AreAlike(one.colour, cell.colour);
  });
  if (group == groups.end()) group = groups.insert(groups.end(), StartGroup());
  group->moments += MomentsOf(cell.area_m2, cell.mean, cell.covariance);
  group->colour += cell.area_m2 / group->moments(3, 3) * (cell.colour - group->colour);
  group->voxels.push_back(VoxelOf(cell.mean));
}

void SortVoxels(std::vector<Voxel>& voxels) {
  std::sort(voxels.begin(), voxels.end());
  voxels.erase(std::unique(voxels.begin(), voxels.end()), voxels.end());
}

// `moved`: the cells of all layers.
std::vector<MixturePlane> StartPlanes(const std::vector<CellLayer>& layers,
                                      const std::vector<MixtureCell>& moved,
                                      std::size_t max_planes,
                                      const PlaneModelOptions& options) {
  std::vector<StartGroup> groups;
  std::size_t first = 0;
  for (const CellLayer& layer : layers) {
    const auto touching = TouchingCells(layer.cells);
    for (const PlanarRegion& region : GrowRegions(layer.cells, touching, CellOptions(options))) {
      std::vector<StartGroup> parts;
      for (const std::uint32_t i : region.cells) AddCell(moved[first + i], parts);
      groups.insert(groups.end(), parts.begin(), parts.end());
    }
    first += layer.cells.size();
  }
  std::erase_if(groups, [&](const StartGroup& group) {
    return group.moments(3, 3) < kStartShare * options.min_area_m2;
  });
  std::stable_sort(groups.begin(), groups.end(), [](const auto& a, const auto& b) {
    return a.moments(3, 3) > b.moments(3, 3);
  });
  if (groups.size() > max_planes) groups.resize(max_planes);
  std::vector<MixturePlane> planes;
  for (StartGroup& group : groups) {
    MixturePlane plane;
    plane.plane = FitMoments(group.moments).plane;
    plane.colour = group.colour;
    plane.voxels = std::move(group.voxels);
    SortVoxels(plane.voxels);
    planes.push_back(std::move(plane));
  }
  return planes;
}

struct FramedCells {
  std::vector<MixtureCell> cells;
  std::vector<std::uint32_t> point_counts;
};

struct MixtureFrame {
  const Eigen::Vector3d& reference;
  const PlaneModelOptions& options;

  FramedCells CellsIn(const std::vector<CellLayer>& layers, const Eigen::Vector3d& origin) const {
    FramedCells out;
    for (const CellLayer& layer : layers) {
      for (std::size_t i = 0; i < layer.cells.size(); ++i) {
        out.cells.push_back(
            MixtureCellOf(layer.cells[i], layer.colours[i], origin - reference, options));
        out.point_counts.push_back(layer.cells[i].point_count);
      }
    }
    return out;
  }
  MixtureOptions Mixing() const {
    MixtureOptions mixing;
    mixing.direction_sigma_rad = options.sigma_rad;
    mixing.directions = options.directions;
    mixing.colour = options.colour;
    return mixing;
  }
};

// The cells of points that no plane of the mixture explains, about another origin, so that the grid
// cuts elsewhere. Those of how a plane's points scatter are left out.
std::vector<CellLayer> CellsOfRest(const PosedPoints& points,
                                   const Eigen::Vector3d& origin,
                                   const MixtureFrame& frame,
                                   const PlaneMixture& mixture) {
  const PlanesAtPoints at(mixture, kExplainedSigmas);
  const Eigen::Vector3f shift = (origin - points.origin).cast<float>();
  const Eigen::Vector3d moved = points.origin - frame.reference;
  std::vector<Eigen::Vector3f> left, known;
  for (const Eigen::Vector3f& p : points.points) {
    const bool explained = at.AnyAt(p.cast<double>() + moved);
    (explained ? known : left).push_back(p - shift);
  }
  std::vector<CellLayer> layers = PeelCells(left, known, CellOptions(frame.options));
  for (CellLayer& layer : layers) {
    std::erase_if(layer.cells, [&](const PlanarCell& cell) {
      return at.IsOfOne(cell, origin - frame.reference);
    });
    layer.colours.resize(layer.cells.size());
  }
  return layers;
}

// The mixture with the planes of what it does not explain. They are found by themselves: beside the
// other planes' cells they would be slivers that these do better with.
absl::StatusOr<PlaneMixture> WithRest(const PosedPoints& points,
                                      const MixtureFrame& frame,
                                      PlaneMixture mixture,
                                      const Stop& stop) {
  const auto all = static_cast<std::size_t>(frame.options.max_planes);
  const std::size_t most = all - std::min(all, mixture.planes.size());
  // A third of the largest cells is a third or two of those of each level.
  const Eigen::Vector3d origin =
      points.origin + Eigen::Vector3d::Constant(frame.options.cell_size_m / 3.0);
  const std::vector<CellLayer> layers = CellsOfRest(points, origin, frame, mixture);
  STRATA_RETURN_IF_ERROR(stop.status());
  const FramedCells framed = frame.CellsIn(layers, origin);
  PlaneMixture rest(framed.cells, frame.Mixing());
  rest.planes = StartPlanes(layers, framed.cells, most, frame.options);
  rest.directions = mixture.directions;
  rest.chances = mixture.chances;
  for (const MixturePlane& plane : rest.planes) rest.AddDirection(plane.plane.normal);
  STRATA_RETURN_IF_ERROR(FitMixture(most, rest, stop));
  std::vector<MixtureCell> cells = mixture.cells();
  cells.insert(cells.end(), framed.cells.begin(), framed.cells.end());
  PlaneMixture both(std::move(cells), frame.Mixing());
  both.planes = std::move(mixture.planes);
  both.planes.insert(both.planes.end(), rest.planes.begin(), rest.planes.end());
  both.directions = std::move(mixture.directions);
  both.chances = std::move(mixture.chances);
  for (const Eigen::Vector3d& direction : rest.directions) both.AddDirection(direction);
  both.Prepare();
  return both;
}

// Each cell to the plane that has more of it than all else.
std::vector<SquarePlane> PlanesIn(const PlanSquare& square,
                                  const std::vector<std::uint32_t>& point_counts,
                                  const PlaneMixture& mixture,
                                  const Eigen::Vector3d& reference) {
  std::vector<SquarePlane> planes(mixture.planes.size());
  for (std::size_t m = 0; m < planes.size(); ++m) {
    planes[m].plane = mixture.planes[m].plane;
    planes[m].colour = mixture.planes[m].colour;
  }
  for (std::size_t j = 0; j < point_counts.size(); ++j) {
    const MixtureCell& cell = mixture.cells()[j];
    const Eigen::Vector2d at = (cell.mean + reference).head<2>();
    if ((at.array() < square.min().array()).any() || (at.array() >= square.max().array()).any()) {
      continue;
    }
    const std::optional<std::uint32_t> of = mixture.PlaneOf(j);
    if (!of.has_value()) continue;
    SquarePlane& plane = planes[*of];
    plane.moments += MomentsOf(cell.area_m2, cell.mean, cell.covariance);
    plane.measurements += cell.measurements;
    plane.information += cell.measurements / cell.variance_m2;
    plane.point_count += point_counts[j];
    plane.voxels.push_back(VoxelOf(cell.mean));
  }
  std::erase_if(planes, [](const SquarePlane& plane) { return plane.voxels.empty(); });
  for (SquarePlane& plane : planes) SortVoxels(plane.voxels);
  return planes;
}

}  // namespace

absl::Status FitMixture(std::size_t max_planes, PlaneMixture& mixture, const Stop& stop) {
  SplitMix64 random(1);
  mixture.Prepare();
  for (int round = 0; round < kMostRounds; ++round) {
    STRATA_RETURN_IF_ERROR(mixture.Run(kMostSteps, stop));
    bool changed = DropDirections(mixture);
    STRATA_ASSIGN_OR_RETURN(const bool dropped, DropPlanes(mixture, stop));
    mixture.RefreshSupport();
    mixture.Prepare();
    const std::size_t most = max_planes - std::min(max_planes, mixture.planes.size());
    STRATA_ASSIGN_OR_RETURN(const std::size_t added, AddPlanes(mixture, most, random, stop));
    if (!changed && !dropped && added == 0) break;
  }
  return mixture.Run(kMostSteps, stop);
}

absl::StatusOr<std::vector<SquarePlane>> FindSquarePlanes(const PosedPoints& points,
                                                          const PlanSquare& square,
                                                          const Eigen::Vector3d& reference,
                                                          const PlaneModelOptions& options,
                                                          const Stop& stop) {
  const PlaneExtractionOptions cells = CellOptions(options);
  const MixtureFrame frame{reference, options};
  const auto most = static_cast<std::size_t>(options.max_planes);
  const std::vector<CellLayer> layers = FindColouredCells(points, cells);
  STRATA_RETURN_IF_ERROR(stop.status());
  FramedCells framed = frame.CellsIn(layers, points.origin);
  std::vector<MixturePlane> start = StartPlanes(layers, framed.cells, most, options);
  PlaneMixture mixture(std::move(framed.cells), frame.Mixing());
  mixture.planes = std::move(start);
  for (const MixturePlane& plane : mixture.planes) mixture.AddDirection(plane.plane.normal);
  STRATA_RETURN_IF_ERROR(FitMixture(most, mixture, stop));
  // Of points of another colour than their plane's a surface has some everywhere, and what is left
  // of it without them is not even.
  if (options.colour) return PlanesIn(square, framed.point_counts, mixture, reference);
  STRATA_ASSIGN_OR_RETURN(mixture, WithRest(points, frame, std::move(mixture), stop));
  framed = frame.CellsIn(CellsOfPlanes(points, reference, mixture, cells), points.origin);
  PlaneMixture fitted(std::move(framed.cells), frame.Mixing());
  fitted.planes = std::move(mixture.planes);
  fitted.directions = std::move(mixture.directions);
  fitted.chances = std::move(mixture.chances);
  fitted.Prepare();
  STRATA_RETURN_IF_ERROR(fitted.Run(kMostSteps, stop));
  STRATA_RETURN_IF_ERROR(DropPlanes(fitted, stop, PlaneReduction::kNearlyOne).status());
  do {
    STRATA_RETURN_IF_ERROR(fitted.Run(kMostSteps, stop));
  } while (DropDirections(fitted));
  return PlanesIn(square, framed.point_counts, fitted, reference);
}

}  // namespace strata
