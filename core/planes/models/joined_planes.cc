#include "core/planes/models/joined_planes.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <numeric>
#include <span>
#include <tuple>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include <Eigen/Core>

#include "core/common/hash_map.h"
#include "core/common/status.h"
#include "core/common/stop.h"
#include "core/planes/models/model_selection.h"
#include "core/planes/models/plane_colour.h"
#include "core/planes/models/plane_mixture.h"
#include "core/planes/moments.h"

namespace strata {
namespace {

constexpr double kJoinCosine = 0.99;   // 8°: beyond that one plane cannot fit both
constexpr double kJoinFloorM = 0.02;   // by which a surface may bend
constexpr double kStraightRad = 0.17;  // of a wall or floor, as of global planes
// Of an owner's rms and so much, how far off it a plane may be that counts for its place.
constexpr double kOwnedSigmas = 3.0;
constexpr double kOwnedFloorM = 0.02;
constexpr int kSteps = 50;

PlaneKind KindOf(const Eigen::Vector3d& normal) {
  const double tilt = std::acos(std::min(1.0, std::abs(normal.z())));
  if (tilt < kStraightRad) return PlaneKind::kLevel;
  return tilt > M_PI_2 - kStraightRad ? PlaneKind::kWall : PlaneKind::kSloped;
}

// How much more one plane leaves of the surface of each of two than its own does, beside what is
// allowed; above 1 they are two.
double Strain(const SquarePlane& a, const SquarePlane& b) {
  if (std::abs(a.plane.normal.dot(b.plane.normal)) < kJoinCosine) return 2.0;
  if (!AreAlike(a.colour, b.colour)) return 2.0;
  const Plane joint = FitMoments(a.moments + b.moments).plane;
  double strain = 0.0;
  for (const SquarePlane* part : {&a, &b}) {
    const double own = RmsDistance(part->moments, FitMoments(part->moments).plane);
    const double off = RmsDistance(part->moments, joint);
    const double allowed = std::max(kJoinFloorM, own);
    strain = std::max(strain, (off * off - own * own) / (allowed * allowed));
  }
  return strain;
}

void AddTo(SquarePlane& sum, const SquarePlane& part) {
  sum.moments += part.moments;
  sum.colour += part.moments(3, 3) / sum.moments(3, 3) * (part.colour - sum.colour);
  sum.plane = FitMoments(sum.moments).plane;
  sum.measurements += part.measurements;
  sum.information += part.information;
  sum.point_count += part.point_count;
  std::vector<Voxel> all;
  std::set_union(sum.voxels.begin(),
                 sum.voxels.end(),
                 part.voxels.begin(),
                 part.voxels.end(),
                 std::back_inserter(all));
  sum.voxels = std::move(all);
}

struct Match {
  std::uint32_t a = 0, b = 0;
  double strain = 0.0;
};

// Planes that touch and may be one, those first that surely are.
absl::StatusOr<std::vector<Match>> Matches(const std::vector<SquarePlane>& planes,
                                           const Stop& stop) {
  HashMap<Voxel, std::vector<std::uint32_t>> at;
  std::vector<Match> matches;
  for (std::uint32_t i = 0; i < planes.size(); ++i) {
    STRATA_RETURN_IF_ERROR(stop.status());
    HashSet<std::uint32_t> met;
    for (const Voxel voxel : planes[i].voxels) {
      for (const Voxel around : VoxelsAround(voxel)) {
        const auto found = at.find(around);
        if (found == at.end()) continue;
        met.insert(found->second.begin(), found->second.end());
      }
    }
    for (const std::uint32_t other : met) {
      const double strain = Strain(planes[i], planes[other]);
      if (strain <= 1.0) matches.push_back({other, i, strain});
    }
    for (const Voxel voxel : planes[i].voxels) at[voxel].push_back(i);
  }
  std::sort(matches.begin(), matches.end(), [](const Match& a, const Match& b) {
    return std::tie(a.strain, a.a, a.b) < std::tie(b.strain, b.a, b.b);
  });
  return matches;
}

// One plane where a surface was found in parts: over the borders of squares, or around what stands
// before it. Pair by pair, so that what bends slowly ends where it has bent too far.
absl::StatusOr<std::vector<SquarePlane>> Joined(
    const std::vector<std::vector<SquarePlane>>& squares, const Stop& stop) {
  std::vector<SquarePlane> planes;
  for (const std::vector<SquarePlane>& square : squares) {
    planes.insert(planes.end(), square.begin(), square.end());
  }
  while (true) {
    STRATA_ASSIGN_OR_RETURN(const std::vector<Match> matches, Matches(planes, stop));
    if (matches.empty()) return planes;
    std::vector<bool> taken(planes.size(), false);
    for (const Match& match : matches) {
      if (taken[match.a] || taken[match.b]) continue;
      taken[match.a] = taken[match.b] = true;
      AddTo(planes[match.a], planes[match.b]);
      planes[match.b].voxels.clear();
    }
    std::erase_if(planes, [](const SquarePlane& plane) { return plane.voxels.empty(); });
  }
}

// A joined plane as one cell of a mixture, so that EM over all planes finds their directions.
MixtureCell CellOf(const SquarePlane& plane, const PlaneModelOptions& options) {
  const MomentsFit fit = FitMoments(plane.moments);
  MixtureCell cell;
  cell.mean = fit.mean;
  cell.covariance = fit.eigenvectors * fit.eigenvalues.asDiagonal() * fit.eigenvectors.transpose();
  cell.measurements = plane.measurements;
  // What spreads more about the plane than its cells about theirs is wavy, and says less.
  cell.variance_m2 = std::max(
      {plane.measurements / plane.information, fit.eigenvalues(0), options.rho_m * options.rho_m});
  cell.area_m2 = plane.moments(3, 3);
  cell.colour = plane.colour;
  return cell;
}

absl::StatusOr<PlaneMixture> WithDirections(const std::vector<SquarePlane>& sums,
                                            const PlaneModelOptions& options,
                                            const Stop& stop) {
  std::vector<MixtureCell> cells;
  for (const SquarePlane& sum : sums) cells.push_back(CellOf(sum, options));
  MixtureOptions mixing;
  mixing.direction_sigma_rad = options.sigma_rad;
  mixing.directions = options.directions;
  mixing.colour = options.colour;
  PlaneMixture mixture(std::move(cells), mixing);
  for (std::size_t m = 0; m < sums.size(); ++m) {
    const Plane plane = FitMoments(sums[m].moments).plane;
    MixturePlane begun;
    begun.plane = plane;
    begun.colour = sums[m].colour;
    begun.voxels = {VoxelOf(mixture.cells()[m].mean)};
    mixture.planes.push_back(std::move(begun));
    mixture.AddDirection(plane.normal);
  }
  mixture.Prepare();
  do {
    STRATA_RETURN_IF_ERROR(mixture.Run(kSteps, stop));
  } while (options.directions && DropDirections(mixture));
  return mixture;
}

ModelPlane ModelOf(const SquarePlane& sum, const PlaneMixture& mixture, std::size_t m) {
  ModelPlane model;
  model.plane = mixture.planes[m].plane;
  model.kind = KindOf(model.plane.normal);
  const MixtureCell& cell = mixture.cells()[m];
  model.area_m2 = cell.area_m2;
  model.point_count = sum.point_count;
  model.rms_m = RmsDistance(sum.moments, model.plane);
  const MomentsFit fit = FitMoments(sum.moments);
  model.sigma_m = std::sqrt(cell.variance_m2 / cell.measurements);
  if (mixture.options().colour) model.colour = ColourOf(sum.colour);
  model.sigma_rad = model.sigma_m / std::sqrt(std::max(1e-9, fit.eigenvalues(1)));
  if (!mixture.options().directions) return model;
  Eigen::Index most = 0;
  mixture.direction_shares().row(static_cast<Eigen::Index>(m)).maxCoeff(&most);
  if (most < std::ssize(mixture.directions)) model.direction = static_cast<std::uint32_t>(most);
  return model;
}

Eigen::Vector3d WithLargestPositive(const Eigen::Vector3d& v) {
  Eigen::Index largest = 0;
  v.cwiseAbs().maxCoeff(&largest);
  return v(largest) < 0.0 ? Eigen::Vector3d(-v) : v;
}

// Those with planes, by falling number; the planes' indices follow.
std::vector<MainDirection> DirectionsOf(const PlaneMixture& mixture,
                                        std::vector<JoinedPlane>& planes) {
  std::vector<MainDirection> all(mixture.directions.size());
  for (const JoinedPlane& plane : planes) {
    if (plane.model.direction == kNoDirection) continue;
    MainDirection& direction = all[plane.model.direction];
    direction.direction = WithLargestPositive(mixture.directions[plane.model.direction]);
    const double cosine = direction.direction.dot(plane.model.plane.normal);
    ++direction.planes;
    direction.sigma_rad += std::max(0.0, 1.0 - cosine * cosine);
  }
  std::vector<std::uint32_t> order(all.size());
  std::iota(order.begin(), order.end(), 0U);
  std::stable_sort(order.begin(), order.end(), [&all](std::uint32_t a, std::uint32_t b) {
    return all[a].planes > all[b].planes;
  });
  std::vector<std::uint32_t> place(all.size(), kNoDirection);
  std::vector<MainDirection> kept;
  for (const std::uint32_t k : order) {
    if (all[k].planes == 0) continue;
    place[k] = static_cast<std::uint32_t>(kept.size());
    kept.push_back(all[k]);
    kept.back().sigma_rad = std::sqrt(all[k].sigma_rad / all[k].planes);
  }
  for (JoinedPlane& plane : planes) {
    if (plane.model.direction != kNoDirection) plane.model.direction = place[plane.model.direction];
  }
  return kept;
}

absl::StatusOr<JoinedPlanes> Modelled(std::vector<SquarePlane> sums,
                                      const PlaneModelOptions& options,
                                      const Stop& stop) {
  STRATA_ASSIGN_OR_RETURN(const PlaneMixture mixture, WithDirections(sums, options, stop));
  JoinedPlanes joined;
  for (std::size_t m = 0; m < sums.size(); ++m) {
    JoinedPlane plane{std::move(sums[m]), {}};
    plane.model = ModelOf(plane.sum, mixture, m);
    plane.model.id = m + 1;
    plane.sum.plane = plane.model.plane;
    joined.planes.push_back(std::move(plane));
  }
  joined.directions = DirectionsOf(mixture, joined.planes);
  return joined;
}

}  // namespace

absl::StatusOr<JoinedPlanes> JoinSquares(const std::vector<std::vector<SquarePlane>>& squares,
                                         const PlaneModelOptions& options,
                                         const Stop& stop) {
  STRATA_ASSIGN_OR_RETURN(std::vector<SquarePlane> sums, Joined(squares, stop));
  std::erase_if(sums,
                [&](const SquarePlane& sum) { return sum.moments(3, 3) < options.min_area_m2; });
  std::stable_sort(sums.begin(), sums.end(), [](const SquarePlane& a, const SquarePlane& b) {
    return a.moments(3, 3) > b.moments(3, 3);
  });
  return Modelled(std::move(sums), options, stop);
}

absl::StatusOr<JoinedPlanes> WithOwned(JoinedPlanes joined,
                                       std::span<const std::size_t> owners,
                                       const PlaneModelOptions& options,
                                       const Stop& stop) {
  std::vector<SquarePlane> sums;
  for (std::size_t m = 0; m < owners.size(); ++m) {
    if (owners[m] == m) continue;
    JoinedPlane& owner = joined.planes[owners[m]];
    const double off = RmsDistance(joined.planes[m].sum.moments, owner.model.plane);
    // Farther off it holds strips of two surfaces, as of both faces of a thin wall.
    if (off <= kOwnedSigmas * std::hypot(owner.model.rms_m, kOwnedFloorM)) {
      AddTo(owner.sum, joined.planes[m].sum);
    }
  }
  for (std::size_t m = 0; m < owners.size(); ++m) {
    if (owners[m] == m) sums.push_back(std::move(joined.planes[m].sum));
  }
  return Modelled(std::move(sums), options, stop);
}

}  // namespace strata
