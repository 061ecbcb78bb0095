// Poses that agree best with everything known about them (thesis 7.3, 7.4): relative poses,
// planes seen from any number of scans, and absolute poses. Corresponding points (7.17) come as the
// relative pose that fits them best and its information (docs/decisions/0100).
//
// Frames: T_map_scan maps a scan's coordinates into the map; nodes are numbered by their place in
// PoseGraphProblem::T_map_scan. Metres and radians. Information matrices have the order [rotation,
// translation] and belong to a right-hand step on the pose they stand beside.
//
// A relative pose and a prior have the error of g2o (Kümmerle et al. 2011) in our units: with
// Δ = T_i_j⁻¹ T_i⁻¹ T_j, e = [2 · vec q(Δ), translation of Δ], q having w ≥ 0. 2 · vec q is the
// rotation vector up to its third power, its length ends at 2, and Σ eᵀΩe is g2o's χ² when g2o's
// information, which is of vec q = rotation / 2, is scaled: rotation rows and columns by ½ each
// (see InformationFromG2o). So files and database have one error.
#ifndef STRATA_CORE_POSEGRAPH_POSE_GRAPH_H_
#define STRATA_CORE_POSEGRAPH_POSE_GRAPH_H_

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "core/geometry/pose.h"
#include "core/geometry/primitives.h"
#include "core/posegraph/convergence.h"

namespace strata {

// Σ w p̃ p̃ᵀ over weighted points p̃ = (x, y, z, 1) in scan coordinates: all that a plane needs to
// know of the points of one scan, exactly.
using PointMoments = Eigen::Matrix4d;

// What a node pair knows of its relative pose (thesis 7.10–7.15).
struct RelativePoseTerm {
  std::size_t i = 0, j = 0;
  Pose T_i_j = Pose::Identity();
  Matrix6d information = Matrix6d::Identity();
  bool may_be_false = false;  // a loop closure, which may be rejected as a whole
  // What a solution before made of a term that may be false. Where all have it, it stands if it
  // still fits at the minimum; else all is decided anew.
  std::optional<bool> believed = std::nullopt;
};

// One plane and what all scans saw of it (7.19), edge vertices and plane patches alike: the squared
// distances of the points to the plane, which is free to move. Weights are 1 / variance [1/m²].
// Seen by one node only it says nothing about it.
struct PlaneTerm {
  struct View {
    std::size_t i = 0;
    PointMoments moments = PointMoments::Zero();
  };
  Plane plane_map;  // where to start from
  std::vector<View> views;
};

// A direction in which surfaces of the world face (thesis 5.3), and the normals of the surfaces
// that scans saw facing along it: sin² of their angles to it, which is free to turn. Surfaces that
// face it or face away are the same, and need not be the same surface: two scans that saw two
// parallel walls are turned alike. Seen by one node only it says next to nothing about it.
struct DirectionTerm {
  struct View {
    std::size_t i = 0;
    Eigen::Vector3d normal_scan = Eigen::Vector3d::UnitX();
    double information = 0.0;  // 1 / variance of its angle [1/rad²]
  };
  Eigen::Vector3d direction_map = Eigen::Vector3d::UnitX();  // where to start from
  std::vector<View> views;
};

// An absolute pose (GPS, landmark). With the rotation's rows and columns 0 it is a position; it is
// then the translation's information in the axes of T_map_scan's rotation: the identity for the
// axes of the map.
struct PriorTerm {
  std::size_t i = 0;
  Pose T_map_scan = Pose::Identity();
  Matrix6d information = Matrix6d::Identity();
  bool may_be_false = false;                    // GPS among walls, which may be rejected as a whole
  std::optional<bool> believed = std::nullopt;  // as of a relative pose
};

struct PoseGraphProblem {
  std::vector<Pose> T_map_scan;  // where to start from
  std::vector<bool> fixed;       // empty: none
  std::vector<RelativePoseTerm> relative;
  std::vector<PlaneTerm> planes;
  std::vector<DirectionTerm> directions;
  std::vector<PriorTerm> priors;
};

enum class Weighting : std::uint8_t {
  kCovariance,   // every term by its information
  kLocalGlobal,  // f = local_weight · l + (1 − local_weight) · g (7.21)
};

struct PoseGraphOptions {
  Weighting weighting = Weighting::kCovariance;
  // l sums relative poses, g planes, directions and priors. The thesis does not normalise the two
  // sums. Ours are both in units of their measurements' variance, and then equal weights are the
  // most likely poses: ½ is the default and gives what kCovariance gives. More than ½ trusts
  // correspondences more than their variance says, less trusts planes more. [1e-6, 1 − 1e-6]
  double local_weight = 0.5;
  ConvergenceOptions convergence;
  // Terms that may be false are rejected if they cannot be had below this χ² together with the
  // rest. By graduated non-convexity with truncated least squares (Yang et al. 2020). The default
  // is the 99.9 % quantile for 6 degrees of freedom. > 0; infinity believes everything.
  double max_closure_chi2 = 22.458;
};

// Σ eᵀΩe of every kind of term, rejected ones included, whatever the weighting.
struct PoseGraphCosts {
  double relative = 0.0, planes = 0.0, directions = 0.0, priors = 0.0;
  double total() const { return relative + planes + directions + priors; }
};

// A term that may be false and in the end counts nothing; all others count in full.
struct RejectedTerm {
  std::size_t term = 0;  // its index
  double chi2 = 0.0;     // at the solution, as max_closure_chi2 counts it
};

struct NodeResidual {
  std::size_t node = 0;
  // Sum over the terms that touch the node: a term of two nodes counts half for each, planes
  // and directions by views; rejected terms do not count.
  double chi2 = 0.0;
};

struct PoseGraphSummary {
  PoseGraphCosts before, after;
  int iterations = 0;  // linear systems solved
  PoseGraphTermination termination = PoseGraphTermination::kConverged;
  std::vector<std::size_t> held;  // nodes held only because nothing else fixes their component
  std::vector<RejectedTerm> rejected_relative;  // ascending
  std::vector<RejectedTerm> rejected_priors;    // likewise; indices into PoseGraphProblem::priors
  std::vector<NodeResidual> worst_nodes;        // the 10 worst, worst first
};

struct PoseGraphSolution {
  std::vector<Pose> T_map_scan;
  std::vector<Plane> planes;  // of each PlaneTerm, its normal on the side it was given
  PoseGraphSummary summary;
};

}  // namespace strata

#endif  // STRATA_CORE_POSEGRAPH_POSE_GRAPH_H_
