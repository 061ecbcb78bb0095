#include "core/posegraph/solver/initial_poses.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>

#include "core/common/disjoint_sets.h"
#include "core/posegraph/solver/gauge.h"

namespace strata {
namespace {

constexpr Eigen::Index kHeld = -1;
// Keeps the linear problems definite where informations are zero.
constexpr double kRidge = 1e-12;

// A relative pose in two or three dimensions.
template <int dim>
struct Link {
  std::size_t i, j;
  Eigen::Matrix<double, dim, dim> R;
  Eigen::Matrix<double, dim, 1> t;
  double rotation_weight;
  Eigen::Matrix<double, dim, dim> translation_information;
};

template <int dim>
struct Placed {
  Eigen::Matrix<double, dim, dim> R;
  Eigen::Matrix<double, dim, 1> t;
};

template <int dim>
struct Graph {
  std::vector<Placed<dim>> poses;
  std::vector<Link<dim>> links;
  std::vector<bool> held;
};

template <int dim>
std::vector<bool> HeldNodes(const std::vector<Link<dim>>& links,
                            const std::vector<bool>& fixed,
                            std::size_t nodes) {
  DisjointSets joined;
  for (const Link<dim>& link : links) joined.Join(link.i, link.j);
  std::vector<bool> held = fixed;
  held.resize(nodes, false);
  for (const std::size_t node : FirstUnheld(joined, held)) held[node] = true;
  return held;
}

Graph<3> GraphOf(const PoseGraphProblem& problem) {
  Graph<3> graph;
  for (const Pose& T : problem.T_map_scan) graph.poses.push_back({T.linear(), T.translation()});
  for (const RelativePoseTerm& term : problem.relative) {
    graph.links.push_back({term.i,
                           term.j,
                           term.T_i_j.linear(),
                           term.T_i_j.translation(),
                           term.information.diagonal().head<3>().mean(),
                           term.information.bottomRightCorner<3, 3>()});
  }
  graph.held = HeldNodes(graph.links, problem.fixed, graph.poses.size());
  return graph;
}

Graph<2> GraphOf(const PlanarPoseGraph& planar) {
  Graph<2> graph;
  const auto turn = [](double angle) { return Eigen::Rotation2Dd(angle).toRotationMatrix(); };
  for (const PlanarPose& pose : planar.poses) {
    graph.poses.push_back({turn(pose.z()), pose.head<2>()});
  }
  for (const PlanarRelativeTerm& term : planar.relative) {
    graph.links.push_back({term.i,
                           term.j,
                           turn(term.T_i_j.z()),
                           term.T_i_j.head<2>(),
                           term.information(2, 2),
                           term.information.topLeftCorner<2, 2>()});
  }
  graph.held = HeldNodes(graph.links, planar.fixed, graph.poses.size());
  return graph;
}

// Links by the distance of their nodes' numbers, the first that reach a node.
template <int dim>
void FollowSpanningTree(Graph<dim>& graph) {
  std::vector<std::size_t> order(graph.links.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto span = [&graph](std::size_t k) {
    const Link<dim>& link = graph.links[k];
    return link.i < link.j ? link.j - link.i : link.i - link.j;
  };
  std::stable_sort(order.begin(), order.end(), [&](auto a, auto b) { return span(a) < span(b); });

  // A held node is a root of its own: joined to all others at once.
  const std::size_t nodes = graph.poses.size();
  DisjointSets joined;
  for (std::size_t n = 0; n < nodes; ++n) {
    if (graph.held[n]) joined.Join(n, nodes);
  }
  std::vector<std::vector<std::size_t>> tree(nodes);
  for (const std::size_t k : order) {
    if (!joined.Join(graph.links[k].i, graph.links[k].j)) continue;
    tree[graph.links[k].i].push_back(k);
    tree[graph.links[k].j].push_back(k);
  }
  std::vector<bool> placed = graph.held;
  std::vector<std::size_t> queue;
  for (std::size_t n = 0; n < nodes; ++n) {
    if (placed[n]) queue.push_back(n);
  }
  for (std::size_t next = 0; next < queue.size(); ++next) {
    const std::size_t n = queue[next];
    const Placed<dim> here = graph.poses[n];
    for (const std::size_t k : tree[n]) {
      const Link<dim>& link = graph.links[k];
      const std::size_t other = link.i == n ? link.j : link.i;
      if (placed[other]) continue;
      if (link.i == n) {
        graph.poses[other] = {here.R * link.R, here.t + here.R * link.t};
      } else {
        const Eigen::Matrix<double, dim, dim> R = here.R * link.R.transpose();
        graph.poses[other] = {R, here.t - R * link.t};
      }
      placed[other] = true;
      queue.push_back(other);
    }
  }
}

// A linear problem Σ |W^½ (x_j − A x_i − b)|² with blocks of `dim` rows and some columns; held
// nodes are known.
template <int dim>
class LinearLinks {
 public:
  using Block = Eigen::Matrix<double, dim, dim>;
  using Rows = Eigen::Matrix<double, dim, Eigen::Dynamic>;

  LinearLinks(const Graph<dim>& graph, Eigen::Index columns) {
    for (const bool held : graph.held) block_of_node_.push_back(held ? kHeld : blocks_++);
    right_ = Eigen::MatrixXd::Zero(blocks_ * dim, columns);
  }

  // `known_i`, `known_j`: the values of held nodes.
  void Add(const Link<dim>& link,
           const Block& A,
           const Rows& b,
           const Block& W,
           const Rows& known_i,
           const Rows& known_j) {
    const Eigen::Index i = block_of_node_[link.i];
    const Eigen::Index j = block_of_node_[link.j];
    const Block WA = W * A;
    const Rows from_i = i == kHeld ? Rows(A * known_i + b) : b;
    if (j != kHeld) {
      AddBlock(j, j, W);
      Right(j) += W * from_i;
    }
    if (i != kHeld) {
      const Rows target = j == kHeld ? Rows(known_j - b) : Rows(-b);
      AddBlock(i, i, A.transpose() * WA);
      Right(i) += WA.transpose() * target;
    }
    if (i != kHeld && j != kHeld) {
      if (i < j) {
        AddBlock(j, i, -WA);
      } else {
        AddBlock(i, j, -WA.transpose());
      }
    }
  }

  // The values of the free nodes; false if there are none or the numbers are too bad.
  bool Solve() {
    if (blocks_ == 0) return false;
    Eigen::SparseMatrix<double> H(right_.rows(), right_.rows());
    H.setFromTriplets(lower_.begin(), lower_.end());
    const double ridge = std::max(kRidge * H.diagonal().maxCoeff(), 1e-300);
    Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> ldlt;
    ldlt.setShift(ridge);
    ldlt.compute(H);
    if (ldlt.info() != Eigen::Success) return false;
    right_ = ldlt.solve(right_).eval();
    return right_.allFinite();
  }
  bool IsFree(std::size_t node) const { return block_of_node_[node] != kHeld; }
  Rows Value(std::size_t node) { return Right(block_of_node_[node]); }

 private:
  auto Right(Eigen::Index block) { return right_.template middleRows<dim>(block * dim); }
  // Blocks of the lower triangle: i ≥ j.
  void AddBlock(Eigen::Index i, Eigen::Index j, const Block& block) {
    for (int column = 0; column < dim; ++column) {
      for (int row = i == j ? column : 0; row < dim; ++row) {
        lower_.emplace_back(i * dim + row, j * dim + column, block(row, column));
      }
    }
  }

  std::vector<Eigen::Index> block_of_node_;
  Eigen::Index blocks_ = 0;
  std::vector<Eigen::Triplet<double>> lower_;
  Eigen::MatrixXd right_;
};

template <int dim>
Eigen::Matrix<double, dim, dim> NearestRotation(const Eigen::Matrix<double, dim, dim>& M) {
  using Matrix = Eigen::Matrix<double, dim, dim>;
  const Eigen::JacobiSVD<Matrix> svd(M, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Matrix<double, dim, 1> S = Eigen::Matrix<double, dim, 1>::Ones();
  if (svd.matrixU().determinant() * svd.matrixV().determinant() < 0.0) S[dim - 1] = -1.0;
  return svd.matrixU() * S.asDiagonal() * svd.matrixV().transpose();
}

template <int dim>
void Relax(Graph<dim>& graph) {
  using Matrix = Eigen::Matrix<double, dim, dim>;
  using Rows = typename LinearLinks<dim>::Rows;
  // R_jᵀ = R_ijᵀ R_iᵀ.
  LinearLinks<dim> rotations(graph, dim);
  for (const Link<dim>& link : graph.links) {
    rotations.Add(link,
                  link.R.transpose(),
                  Rows::Zero(dim, dim),
                  link.rotation_weight * Matrix::Identity(),
                  graph.poses[link.i].R.transpose(),
                  graph.poses[link.j].R.transpose());
  }
  if (!rotations.Solve()) return;
  for (std::size_t n = 0; n < graph.poses.size(); ++n) {
    if (!rotations.IsFree(n)) continue;
    graph.poses[n].R = NearestRotation<dim>(Matrix(rotations.Value(n)).transpose());
  }
  // t_j = t_i + R_i t_ij, weighed in the axes of the measured j.
  LinearLinks<dim> translations(graph, 1);
  for (const Link<dim>& link : graph.links) {
    const Matrix R = graph.poses[link.i].R * link.R;
    translations.Add(link,
                     Matrix::Identity(),
                     graph.poses[link.i].R * link.t,
                     R * link.translation_information * R.transpose(),
                     graph.poses[link.i].t,
                     graph.poses[link.j].t);
  }
  if (!translations.Solve()) return;
  for (std::size_t n = 0; n < graph.poses.size(); ++n) {
    if (translations.IsFree(n)) graph.poses[n].t = translations.Value(n);
  }
}

std::vector<Pose> PosesOf(const Graph<3>& graph) {
  std::vector<Pose> poses;
  for (const Placed<3>& placed : graph.poses) {
    poses.push_back(MakePose(Eigen::Quaterniond(placed.R), placed.t));
  }
  return poses;
}

std::vector<PlanarPose> PosesOf(const Graph<2>& graph) {
  std::vector<PlanarPose> poses;
  for (const Placed<2>& placed : graph.poses) {
    poses.emplace_back(placed.t.x(), placed.t.y(), std::atan2(placed.R(1, 0), placed.R(0, 0)));
  }
  return poses;
}

template <typename Problem>
auto Odometry(const Problem& problem) {
  auto graph = GraphOf(problem);
  FollowSpanningTree(graph);
  return PosesOf(graph);
}

template <typename Problem>
auto Chordal(const Problem& problem) {
  auto graph = GraphOf(problem);
  Relax(graph);
  return PosesOf(graph);
}

}  // namespace

std::vector<Pose> OdometryPoses(const PoseGraphProblem& problem) { return Odometry(problem); }
std::vector<PlanarPose> OdometryPoses(const PlanarPoseGraph& graph) { return Odometry(graph); }
std::vector<Pose> ChordalPoses(const PoseGraphProblem& problem) { return Chordal(problem); }
std::vector<PlanarPose> ChordalPoses(const PlanarPoseGraph& graph) { return Chordal(graph); }

}  // namespace strata
