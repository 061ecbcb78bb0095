#include "core/posegraph/solver/graph_least_squares.h"

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/Core>

#include "core/posegraph/costs/relative_pose_cost.h"
#include "core/posegraph/costs/screw_motion.h"

namespace strata {
namespace {

// A plane's block is as large as a pose's; its last three parameters are idle.
constexpr int kPlaneParameters = 3;
// Holds back planes that their points do not determine (they lie on one line) and poses that their
// planes do not determine (two of them, or parallel ones). It slows others by this share and biases
// none.
constexpr double kInertia = 1e-11;

using Block = Eigen::Matrix<double, 6, 6>;

void Add(BlockCholesky& H, const BlockSlot& slot, const Block& block) {
  Eigen::Map<Block> values(H.values().data() + slot.offset);
  if (slot.transposed) {
    values += block.transpose();
  } else {
    values += block;
  }
}

auto Segment(Eigen::VectorXd& v, std::size_t block) {
  return v.segment<6>(static_cast<Eigen::Index>(block) * 6);
}

// Adds a share of their mean, or of 1 where they are nothing, to `size` entries of the diagonal of
// the block.
void AddInertia(BlockCholesky& H, std::size_t block, int first, int size) {
  Eigen::Map<Block> values(H.values().data() + H.Slot(block, block).offset);
  auto diagonal = values.diagonal().segment(first, size);
  const double inertia = kInertia * std::max(diagonal.mean(), 1.0);
  diagonal.array() += inertia;
}

// Of a plane's own equations when it follows its points: only what they determine well.
constexpr double kSettlingInertia = 1e-3;
constexpr int kSettlingSteps = 2;

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

}  // namespace

GraphLeastSquares::GraphLeastSquares(const PoseGraphProblem& problem,
                                     const std::vector<bool>& held,
                                     double local_factor,
                                     double global_factor)
    : problem_(problem),
      local_factor_(local_factor),
      global_factor_(global_factor),
      relative_weights_(problem.relative.size(), 1.0),
      pairs_weights_(problem.pairs.size(), 1.0) {
  for (const bool is_held : held) block_of_node_.push_back(is_held ? kHeld : blocks_++);
  current_.poses = problem.T_map_scan;
  for (const RelativePoseTerm& term : problem.relative) {
    relative_edges_.push_back(EdgeOf(block_of_node_[term.i], block_of_node_[term.j]));
  }
  for (const PointPairsTerm& term : problem.pairs) {
    pairs_.push_back(SummarisePairs(term.moments));
    pairs_edges_.push_back(EdgeOf(block_of_node_[term.i], block_of_node_[term.j]));
  }
  for (const PriorTerm& term : problem.priors) {
    prior_edges_.push_back(EdgeOf(block_of_node_[term.i], kHeld));
  }
  for (const PlaneTerm& term : problem.planes) {
    current_.planes.emplace_back(term.plane_map, CentreOf(term, problem.T_map_scan));
    views_.emplace_back();
    view_edges_.emplace_back();
    for (const PlaneTerm::View& view : term.views) {
      views_.back().push_back(SummariseView(view.moments));
      view_edges_.back().push_back(EdgeOf(block_of_node_[view.i], blocks_));
    }
    ++blocks_;
  }
  trial_ = current_;
  std::vector<bool> bound(blocks_, false);
  for (const auto* list : {&relative_edges_, &pairs_edges_, &prior_edges_}) {
    for (const Edge& edge : *list) {
      if (edge.i != kHeld) bound[edge.i] = true;
      if (edge.j != kHeld) bound[edge.j] = true;
    }
  }
  for (std::size_t b = 0; b + problem.planes.size() < blocks_; ++b) {
    if (!bound[b]) planes_only_.push_back(b);
  }
}

BlockCholesky GraphLeastSquares::MakeSystem() {
  std::vector<Edge*> edges;
  for (auto* list : {&relative_edges_, &pairs_edges_, &prior_edges_}) {
    for (Edge& edge : *list) edges.push_back(&edge);
  }
  for (std::vector<Edge>& list : view_edges_) {
    for (Edge& edge : list) edges.push_back(&edge);
  }
  std::vector<std::pair<std::size_t, std::size_t>> pattern;
  for (const Edge* edge : edges) {
    if (edge->i != kHeld && edge->j != kHeld) pattern.emplace_back(edge->i, edge->j);
  }
  BlockCholesky H(kSize, blocks_, pattern);
  for (Edge* edge : edges) {
    if (edge->i != kHeld) edge->ii = H.Slot(edge->i, edge->i);
    if (edge->j != kHeld) edge->jj = H.Slot(edge->j, edge->j);
    if (edge->i != kHeld && edge->j != kHeld) edge->ij = H.Slot(edge->i, edge->j);
  }
  return H;
}

double GraphLeastSquares::RelativeChi2(const State& state, std::size_t term) const {
  const RelativePoseTerm& t = problem_.relative[term];
  const Vector6d e = RelativePoseError(state.poses[t.i], state.poses[t.j], t.T_i_j);
  return e.dot(t.information * e);
}

double GraphLeastSquares::PairsChi2(const State& state, std::size_t term) const {
  const PointPairsTerm& t = problem_.pairs[term];
  return PointPairsCost(pairs_[term], state.poses[t.i], state.poses[t.j]);
}

double GraphLeastSquares::PairsExcess(std::size_t term) const {
  return PairsChi2(term) - pairs_[term].least;
}

double GraphLeastSquares::ViewChi2(std::size_t plane, std::size_t view) const {
  return PlaneViewCost(views_[plane][view],
                       current_.poses[problem_.planes[plane].views[view].i],
                       current_.planes[plane]);
}

double GraphLeastSquares::PriorChi2(const State& state, std::size_t term) const {
  const PriorTerm& t = problem_.priors[term];
  const Vector6d e = RelativePoseError(Pose::Identity(), state.poses[t.i], t.T_map_scan);
  return e.dot(t.information * e);
}

double GraphLeastSquares::CostOf(const State& state) const {
  double local = 0.0;
  double global = 0.0;
  for (std::size_t k = 0; k < problem_.relative.size(); ++k) {
    if (relative_weights_[k] > 0.0) local += relative_weights_[k] * RelativeChi2(state, k);
  }
  for (std::size_t k = 0; k < problem_.pairs.size(); ++k) {
    if (pairs_weights_[k] > 0.0) local += pairs_weights_[k] * PairsChi2(state, k);
  }
  for (std::size_t p = 0; p < problem_.planes.size(); ++p) {
    for (std::size_t v = 0; v < views_[p].size(); ++v) {
      const Pose& T = state.poses[problem_.planes[p].views[v].i];
      global += PlaneViewCost(views_[p][v], T, state.planes[p]);
    }
  }
  for (std::size_t k = 0; k < problem_.priors.size(); ++k) global += PriorChi2(state, k);
  return local_factor_ * local + global_factor_ * global;
}

void GraphLeastSquares::Linearise(BlockCholesky& H, Eigen::VectorXd& gradient) const {
  gradient.setZero(static_cast<Eigen::Index>(blocks_) * kSize);
  LineariseRelative(H, gradient);
  LinearisePairs(H, gradient);
  LinearisePlanes(H, gradient);
  LinearisePriors(H, gradient);
  HoldBack(H);
}

void GraphLeastSquares::LineariseRelative(BlockCholesky& H, Eigen::VectorXd& gradient) const {
  for (std::size_t k = 0; k < problem_.relative.size(); ++k) {
    const double weight = local_factor_ * relative_weights_[k];
    const Edge& edge = relative_edges_[k];
    if (weight == 0.0) continue;
    const RelativePoseTerm& term = problem_.relative[k];
    const RelativePoseDerivatives d =
        DifferentiateRelativePose(current_.poses[term.i], current_.poses[term.j], term.T_i_j);
    const Block information = weight * term.information;
    const Vector6d weighted = information * d.error;
    const Block weighted_j = information * d.by_j;
    if (edge.i != kHeld) {
      Add(H, edge.ii, d.by_i.transpose() * (information * d.by_i).eval());
      Segment(gradient, edge.i).noalias() += d.by_i.transpose() * weighted;
    }
    if (edge.j != kHeld) {
      Add(H, edge.jj, d.by_j.transpose() * weighted_j);
      Segment(gradient, edge.j).noalias() += d.by_j.transpose() * weighted;
    }
    if (edge.i != kHeld && edge.j != kHeld) Add(H, edge.ij, d.by_i.transpose() * weighted_j);
  }
}

void GraphLeastSquares::LinearisePairs(BlockCholesky& H, Eigen::VectorXd& gradient) const {
  for (std::size_t k = 0; k < problem_.pairs.size(); ++k) {
    const double weight = local_factor_ * pairs_weights_[k];
    const Edge& edge = pairs_edges_[k];
    if (weight == 0.0) continue;
    const PointPairsTerm& term = problem_.pairs[k];
    const PointPairsDerivatives d =
        DifferentiatePointPairs(pairs_[k], current_.poses[term.i], current_.poses[term.j]);
    if (edge.i != kHeld) {
      Add(H, edge.ii, weight * d.ii);
      Segment(gradient, edge.i) += weight * d.gradient_i;
    }
    if (edge.j != kHeld) {
      Add(H, edge.jj, weight * d.jj);
      Segment(gradient, edge.j) += weight * d.gradient_j;
    }
    if (edge.i != kHeld && edge.j != kHeld) Add(H, edge.ij, weight * d.ij);
  }
}

void GraphLeastSquares::LinearisePlanes(BlockCholesky& H, Eigen::VectorXd& gradient) const {
  for (std::size_t p = 0; p < problem_.planes.size(); ++p) {
    const std::size_t plane_block = blocks_ - problem_.planes.size() + p;
    Block own = Block::Identity();
    own.topLeftCorner<kPlaneParameters, kPlaneParameters>().setZero();
    for (std::size_t v = 0; v < views_[p].size(); ++v) {
      const Edge& edge = view_edges_[p][v];
      const Pose& T = current_.poses[problem_.planes[p].views[v].i];
      const PlaneViewDerivatives d = DifferentiatePlaneView(views_[p][v], T, current_.planes[p]);
      own.topLeftCorner<kPlaneParameters, kPlaneParameters>() += global_factor_ * d.planes;
      Segment(gradient, plane_block).head<kPlaneParameters>() += global_factor_ * d.gradient_plane;
      if (edge.i == kHeld) continue;
      Block mixed = Block::Zero();
      mixed.leftCols<kPlaneParameters>() = global_factor_ * d.mixed;
      Add(H, edge.ii, global_factor_ * d.poses);
      Add(H, edge.ij, mixed);
      Segment(gradient, edge.i) += global_factor_ * d.gradient_pose;
    }
    Add(H, H.Slot(plane_block, plane_block), own);
  }
}

void GraphLeastSquares::LinearisePriors(BlockCholesky& H, Eigen::VectorXd& gradient) const {
  for (std::size_t k = 0; k < problem_.priors.size(); ++k) {
    const Edge& edge = prior_edges_[k];
    if (edge.i == kHeld) continue;
    const PriorTerm& term = problem_.priors[k];
    const RelativePoseDerivatives d =
        DifferentiateRelativePose(Pose::Identity(), current_.poses[term.i], term.T_map_scan);
    const Block weighted = global_factor_ * term.information * d.by_j;
    Add(H, edge.ii, d.by_j.transpose() * weighted);
    Segment(gradient, edge.i).noalias() += weighted.transpose() * d.error;
  }
}

void GraphLeastSquares::HoldBack(BlockCholesky& H) const {
  for (const std::size_t block : planes_only_) {
    AddInertia(H, block, 0, 3);
    AddInertia(H, block, 3, 3);
  }
  for (std::size_t p = 0; p < problem_.planes.size(); ++p) {
    AddInertia(H, blocks_ - problem_.planes.size() + p, 0, kPlaneParameters);
  }
}

void GraphLeastSquares::AverageByKind(Eigen::VectorXd& diagonal) const {
  for (std::size_t b = 0; b < blocks_; ++b) {
    auto own = Segment(diagonal, b);
    const int first = b + problem_.planes.size() < blocks_ ? 3 : 2;  // turns
    own.head(first).setConstant(own.head(first).mean());
    if (first == 3) own.tail<3>().setConstant(own.tail<3>().mean());
  }
}

double GraphLeastSquares::Try(const Eigen::VectorXd& step) {
  for (std::size_t n = 0; n < block_of_node_.size(); ++n) {
    if (block_of_node_[n] == kHeld) continue;
    const auto own = step.segment<kSize>(static_cast<Eigen::Index>(block_of_node_[n]) * kSize);
    trial_.poses[n] = MovedAlongScrew(current_.poses[n], own);
  }
  const std::size_t first = blocks_ - problem_.planes.size();
  for (std::size_t p = 0; p < trial_.planes.size(); ++p) {
    const auto own = step.segment<kPlaneParameters>(static_cast<Eigen::Index>(first + p) * kSize);
    trial_.planes[p] = current_.planes[p].Retracted(own);
  }
  SettlePlanes(trial_);
  return CostOf(trial_);
}

// A long step of all poses as one body leaves planes behind by its square, at a price that would
// keep the map from swinging about a weak anchor. Planes follow it.
void GraphLeastSquares::SettlePlanes(State& state) const {
  for (std::size_t p = 0; p < state.planes.size(); ++p) {
    for (int k = 0; k < kSettlingSteps; ++k) {
      Eigen::Matrix3d H = Eigen::Matrix3d::Zero();
      Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
      for (std::size_t v = 0; v < views_[p].size(); ++v) {
        const Pose& T = state.poses[problem_.planes[p].views[v].i];
        const PlaneViewDerivatives d = DifferentiatePlaneView(views_[p][v], T, state.planes[p]);
        H += d.planes;
        gradient += d.gradient_plane;
      }
      const double inertia = kSettlingInertia * (H(0, 0) + H(1, 1));
      H(0, 0) += inertia;
      H(1, 1) += inertia;
      const Eigen::LLT<Eigen::Matrix3d> llt(H);
      if (llt.info() != Eigen::Success) break;
      state.planes[p] = state.planes[p].Retracted(-llt.solve(gradient));
    }
  }
}

std::vector<Plane> GraphLeastSquares::planes() const {
  std::vector<Plane> planes;
  for (const MovingPlane& plane : current_.planes) planes.push_back(plane.plane());
  return planes;
}

}  // namespace strata
