#include "core/posegraph/solver/graph_problem.h"

#include <cstddef>
#include <memory>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <ceres/problem.h>

#include "core/posegraph/costs/direction_cost.h"
#include "core/posegraph/costs/inertia_cost.h"
#include "core/posegraph/costs/prior_cost.h"
#include "core/posegraph/costs/relative_pose_cost.h"
#include "core/posegraph/solver/gauge.h"

namespace strata {
namespace {

// Share of the terms of poses that only planes bind: two planes, or parallel ones, leave directions
// open.
constexpr double kInertia = 1e-6;
// What keeps a component from sliding away along what nothing holds that counts [1/rad², 1/m²]: a
// little beside one position of GPS.
constexpr double kInertiaInDoubt = 1e-3;

// The centre of all that was seen of a plane; where nothing has weight, the plane's point nearest
// to the origin.
Eigen::Vector3d CentreOf(const PlaneTerm& term, const std::vector<Pose>& T_map_scan) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double weight = 0.0;
  for (const PlaneTerm::View& view : term.views) {
    sum += T_map_scan[view.i].linear() * view.moments.block<3, 1>(0, 3) +
           T_map_scan[view.i].translation() * view.moments(3, 3);
    weight += view.moments(3, 3);
  }
  if (!(weight > 0.0)) return term.plane_map.normal * term.plane_map.distance;
  return sum / weight;
}

DirectionBlock DirectionBlockOf(const DirectionTerm& term) {
  const Eigen::Vector3d d = term.direction_map.normalized();
  return {d.x(), d.y(), d.z()};
}

}  // namespace

GraphProblem::GraphProblem(const PoseGraphProblem& graph,
                           const std::vector<bool>& held,
                           double local_factor,
                           double global_factor)
    : graph_(graph),
      held_(held),
      relative_weights_(graph.relative.size(), 1.0),
      prior_weights_(graph.priors.size(), 1.0),
      problem_(KeepingManifolds()) {
  AddNodes();
  AddRelative(local_factor);
  AddPlanes(global_factor);
  AddDirections(global_factor);
  AddPriors(global_factor);
  Damp(global_factor);
}

void GraphProblem::AddNodes() {
  for (const Pose& T : graph_.T_map_scan) poses_.push_back(PoseBlockOf(T));
  for (std::size_t n = 0; n < poses_.size(); ++n) {
    problem_.AddParameterBlock(poses_[n].data(), 7, &pose_manifold_);
    if (held_[n]) problem_.SetParameterBlockConstant(poses_[n].data());
  }
}

void GraphProblem::AddRelative(double factor) {
  for (std::size_t k = 0; k < graph_.relative.size(); ++k) {
    const RelativePoseTerm& term = graph_.relative[k];
    auto cost = std::make_unique<RelativePoseCost>(
        term.T_i_j, factor * term.information, &relative_weights_[k]);
    problem_.AddResidualBlock(
        cost.release(), nullptr, poses_[term.i].data(), poses_[term.j].data());
  }
}

void GraphProblem::AddPlanes(double factor) {
  for (const PlaneTerm& term : graph_.planes) {
    centres_.push_back(CentreOf(term, graph_.T_map_scan));
    planes_.push_back(PlaneBlockOf(term.plane_map, centres_.back()));
    views_.emplace_back();
    for (const PlaneTerm::View& view : term.views) {
      views_.back().push_back(SummariseView(view.moments));
    }
  }
  for (std::size_t p = 0; p < planes_.size(); ++p) {
    problem_.AddParameterBlock(planes_[p].data(), 4, &plane_manifold_);
    for (std::size_t v = 0; v < views_[p].size(); ++v) {
      auto cost = std::make_unique<PlaneViewCost>(views_[p][v], centres_[p], factor);
      problem_.AddResidualBlock(
          cost.release(), nullptr, poses_[graph_.planes[p].views[v].i].data(), planes_[p].data());
    }
  }
}

void GraphProblem::AddDirections(double factor) {
  for (const DirectionTerm& term : graph_.directions) {
    directions_.push_back(DirectionBlockOf(term));
  }
  for (std::size_t d = 0; d < directions_.size(); ++d) {
    problem_.AddParameterBlock(directions_[d].data(), 3, &direction_manifold_);
    for (const DirectionTerm::View& view : graph_.directions[d].views) {
      auto cost = std::make_unique<DirectionCost>(view.normal_scan, factor * view.information);
      problem_.AddResidualBlock(
          cost.release(), nullptr, poses_[view.i].data(), directions_[d].data());
    }
  }
}

void GraphProblem::AddPriors(double factor) {
  for (std::size_t k = 0; k < graph_.priors.size(); ++k) {
    const PriorTerm& term = graph_.priors[k];
    auto cost =
        std::make_unique<PriorCost>(term.T_map_scan, factor * term.information, &prior_weights_[k]);
    problem_.AddResidualBlock(cost.release(), nullptr, poses_[term.i].data());
  }
}

void GraphProblem::Damp(double factor) {
  std::vector<bool> bound = held_;
  for (const RelativePoseTerm& term : graph_.relative) bound[term.i] = bound[term.j] = true;
  for (const PriorTerm& term : graph_.priors) bound[term.i] = true;
  std::vector<double> rotation(poses_.size(), 0.0);
  std::vector<double> translation(poses_.size(), 0.0);
  for (std::size_t p = 0; p < planes_.size(); ++p) {
    for (std::size_t v = 0; v < views_[p].size(); ++v) {
      const std::size_t node = graph_.planes[p].views[v].i;
      rotation[node] += views_[p][v].points.squaredNorm();
      translation[node] += views_[p][v].weight * views_[p][v].weight;
    }
  }
  for (std::size_t n = 0; n < poses_.size(); ++n) {
    if (bound[n] || translation[n] == 0.0) continue;
    auto cost = std::make_unique<InertiaCost>(kInertia * factor * rotation[n],
                                              kInertia * factor * translation[n]);
    problem_.AddResidualBlock(cost.release(), nullptr, poses_[n].data());
  }
  for (const std::size_t n : NodesInDoubt(graph_)) {
    auto cost = std::make_unique<InertiaCost>(kInertiaInDoubt, kInertiaInDoubt);
    problem_.AddResidualBlock(cost.release(), nullptr, poses_[n].data());
  }
}

void GraphProblem::Restart() {
  for (std::size_t n = 0; n < poses_.size(); ++n) poses_[n] = PoseBlockOf(graph_.T_map_scan[n]);
  for (std::size_t p = 0; p < planes_.size(); ++p) {
    planes_[p] = PlaneBlockOf(graph_.planes[p].plane_map, centres_[p]);
  }
  for (std::size_t d = 0; d < directions_.size(); ++d) {
    directions_[d] = DirectionBlockOf(graph_.directions[d]);
  }
}

double GraphProblem::RelativeChi2(std::size_t term) const {
  const RelativePoseTerm& t = graph_.relative[term];
  const Vector6d e = RelativePoseError(pose(t.i), pose(t.j), t.T_i_j);
  return e.dot(t.information * e);
}

double GraphProblem::ViewChi2(std::size_t plane, std::size_t view) const {
  const Pose T = pose(graph_.planes[plane].views[view].i);
  return PlaneViewDistances(views_[plane][view], T, planes_[plane].data(), centres_[plane])
      .squaredNorm();
}

double GraphProblem::DirectionChi2(std::size_t direction, std::size_t view) const {
  const DirectionTerm::View& v = graph_.directions[direction].views[view];
  const Eigen::Map<const Eigen::Vector3d> d(directions_[direction].data());
  return v.information * (pose(v.i).linear() * v.normal_scan).cross(d).squaredNorm();
}

double GraphProblem::PriorChi2(std::size_t term) const {
  const PriorTerm& t = graph_.priors[term];
  const Vector6d e = RelativePoseError(Pose::Identity(), pose(t.i), t.T_map_scan);
  return e.dot(t.information * e);
}

std::vector<Pose> GraphProblem::poses() const {
  std::vector<Pose> poses;
  for (std::size_t n = 0; n < poses_.size(); ++n) {
    poses.push_back(held_[n] ? graph_.T_map_scan[n] : pose(n));
  }
  return poses;
}

std::vector<Plane> GraphProblem::planes() const {
  std::vector<Plane> planes;
  for (std::size_t p = 0; p < planes_.size(); ++p) {
    planes.push_back(PlaneOf(planes_[p], centres_[p]));
  }
  return planes;
}

}  // namespace strata
