#include "core/posegraph/alignment/plane_terms.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include <Eigen/Eigenvalues>

#include "core/geometry/primitives.h"

namespace strata {
namespace {

// Σ w (n · p − d)² of the plane that fits best to what has these moments.
double BestPlaneCost(const PointMoments& moments) {
  const Eigen::Vector3d mean = moments.topRightCorner<3, 1>() / moments(3, 3);
  const Eigen::Matrix3d scatter =
      moments.topLeftCorner<3, 3>() - moments(3, 3) * mean * mean.transpose();
  return std::max(0.0,
                  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(scatter, Eigen::EigenvaluesOnly)
                      .eigenvalues()
                      .x());
}

// By how much the views of one plane disagree beyond their noise: χ² per degree of freedom of what
// they say together over what each says alone, three for every view after the first. About 1 for a
// plane; much more where the poses are still wrong, or where the surface is none.
double Disagreement(const SharedPlane& plane, const std::vector<Pose>& T_map_scan) {
  PointMoments together = PointMoments::Zero();
  double alone = 0.0;
  for (const SharedPlane::View& view : plane.views) {
    const Eigen::Matrix4d T = T_map_scan[view.scan].matrix();
    together += T * view.moments * T.transpose();
    alone += BestPlaneCost(view.moments);
  }
  const double freedom = 3.0 * static_cast<double>(plane.views.size() - 1);
  return std::max(0.0, BestPlaneCost(together) - alone) / freedom;
}

}  // namespace

bool IsExcluded(const SharedPlane& found,
                const ExcludedPlane& excluded,
                const std::vector<Pose>& T_map_scan) {
  constexpr double kSameCosine = 0.9986;
  constexpr double kSameDistanceM = 0.2;
  if (found.plane.normal.dot(excluded.plane_map.normal) < kSameCosine) return false;
  return std::any_of(found.views.begin(), found.views.end(), [&](const SharedPlane::View& view) {
    if (std::ranges::find(excluded.nodes, view.scan) == excluded.nodes.end()) return false;
    // Where it was seen: far from there planes of one tilt or another are anywhere.
    const Eigen::Vector3d p_scan = view.moments.topRightCorner<3, 1>() / view.moments(3, 3);
    return Distance(T_map_scan[view.scan] * p_scan, excluded.plane_map) <= kSameDistanceM;
  });
}

PlaneTerm TermOf(const SharedPlane& plane, const std::vector<Pose>& T_map_scan) {
  PlaneTerm term;
  term.plane_map = plane.plane;
  // Ground that bends agrees with itself from nearby scans and would tilt them all: a plane counts
  // as much as its views agree (weights as of Geman and McClure), and more from round to round if
  // it was the poses.
  const double disagreement = std::max(1.0, Disagreement(plane, T_map_scan));
  const double weight = 1.0 / (disagreement * disagreement);
  for (const SharedPlane::View& view : plane.views) {
    term.views.push_back({view.scan, weight * view.moments});
  }
  return term;
}

std::vector<SharedPlane> SplitByPart(const std::vector<SharedPlane>& planes,
                                     const std::vector<std::size_t>& parts) {
  std::vector<SharedPlane> split;
  for (const SharedPlane& plane : planes) {
    std::map<std::size_t, SharedPlane> of_part;
    for (const SharedPlane::View& view : plane.views) {
      SharedPlane& seen =
          of_part.try_emplace(parts[view.scan], SharedPlane{plane.plane, plane.from_edges, {}, 0.0})
              .first->second;
      seen.views.push_back(view);
      seen.support_value += view.weight;
    }
    for (auto& [part, seen] : of_part) {
      if (seen.views.size() > 1) split.push_back(std::move(seen));
    }
  }
  return split;
}

DirectionTerm TermOf(const SharedDirection& direction, const std::vector<Pose>& T_map_scan) {
  DirectionTerm term{.direction_map = direction.direction_map, .views = {}};
  for (const SharedDirection::View& view : direction.views) {
    const Eigen::Vector3d normal = T_map_scan[view.scan].linear() * view.normal_scan;
    const double sin2 = normal.cross(direction.direction_map).squaredNorm();
    // As planes: what does not agree counts less, and more from round to round if it was the poses.
    const double disagreement = std::max(1.0, view.information * sin2 / 2.0);
    term.views.push_back(
        {view.scan, view.normal_scan, view.information / (disagreement * disagreement)});
  }
  return term;
}

}  // namespace strata
