#include "core/planes/curvature.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/Eigenvalues>

#include "core/planes/planar_cells.h"

namespace strata {
namespace {

constexpr std::size_t kLeastCells = 4;
constexpr std::size_t kEnoughCells = 12;
constexpr double kSigmas = 4.0;

// Least squares for c, g and K = (k_uu, k_uv; k_uv, k_vv), in this order.
class QuadricFit {
 public:
  // A cell with its middle at x, z and slopes dz/dx there.
  void Add(const Eigen::Vector2d& x, double z, const Eigen::Vector2d& slopes, double area_m2) {
    const double u = x.x();
    const double v = x.y();
    Eigen::Matrix<double, 3, 6> J;
    J << 1.0, u, v, 0.5 * u * u, u * v, 0.5 * v * v,  //
        0.0, 1.0, 0.0, u, v, 0.0,                     //
        0.0, 0.0, 1.0, 0.0, u, v;
    const Eigen::Vector3d measured(z, slopes.x(), slopes.y());
    // By points spread evenly over a square: their number, and that times the square of their
    // spread.
    const Eigen::Vector3d weights = area_m2 * Eigen::Vector3d(1.0, area_m2 / 12.0, area_m2 / 12.0);
    const Eigen::Matrix<double, 6, 3> JtW = J.transpose() * weights.asDiagonal();
    normal_ += JtW * J;
    right_ += JtW * measured;
    squares_ += measured.cwiseAbs2().dot(weights);
    rows_ += 3.0;
  }

  // See CurvatureOf.
  Eigen::Vector3d Curvature() const {
    const Eigen::LDLT<Matrix> solver(normal_);
    const Vector solved = solver.solve(right_);
    const Matrix inverse = solver.solve(Matrix::Identity());
    if (solver.info() != Eigen::Success || !solved.allFinite() || !inverse.allFinite()) {
      return Eigen::Vector3d::Zero();
    }
    Eigen::Matrix2d K;
    K << solved[3], solved[4], solved[4], solved[5];
    const double curvature =
        Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(K).eigenvalues().cwiseAbs().maxCoeff();
    const double left = std::max(0.0, squares_ - right_.dot(solved)) / (rows_ - 6.0);
    const double sigma = std::sqrt(left * std::max(inverse(3, 3), inverse(5, 5)));
    if (curvature <= kSigmas * sigma) return Eigen::Vector3d::Zero();
    return solved.tail<3>();
  }

 private:
  using Vector = Eigen::Matrix<double, 6, 1>;
  using Matrix = Eigen::Matrix<double, 6, 6>;

  Matrix normal_ = Matrix::Zero();
  Vector right_ = Vector::Zero();
  double squares_ = 0.0;
  double rows_ = 0.0;
};

}  // namespace

std::vector<std::uint32_t> AroundFew(std::span<const PlanarCell> cells,
                                     const std::vector<std::vector<std::uint32_t>>& touching,
                                     std::span<const std::uint32_t> members,
                                     double max_angle_rad) {
  std::vector<std::uint32_t> around(members.begin(), members.end());
  const double min_cosine = std::cos(max_angle_rad);
  for (std::size_t next = 0; next < around.size() && around.size() < kEnoughCells; ++next) {
    for (const std::uint32_t i : touching[around[next]]) {
      if (std::abs(cells[i].normal.dot(cells[members.front()].normal)) >= min_cosine &&
          std::ranges::find(around, i) == around.end()) {
        around.push_back(i);
      }
    }
  }
  return around;
}

Eigen::Vector3d CurvatureOf(std::span<const PlanarCell> cells,
                            std::span<const std::uint32_t> members,
                            const Eigen::Vector3d& axis_u,
                            const Eigen::Vector3d& axis_v) {
  if (members.size() < kLeastCells) return Eigen::Vector3d::Zero();
  const Eigen::Vector3d normal = axis_u.cross(axis_v);
  const Eigen::Vector3d origin = cells[members.front()].mean;
  QuadricFit fit;
  for (const std::uint32_t i : members) {
    const PlanarCell& cell = cells[i];
    const Eigen::Vector3d at = cell.mean - origin;
    const double up = cell.normal.dot(normal);
    if (up == 0.0) continue;  // it stands across
    const Eigen::Vector2d slopes =
        -Eigen::Vector2d(cell.normal.dot(axis_u), cell.normal.dot(axis_v)) / up;
    fit.Add({axis_u.dot(at), axis_v.dot(at)}, normal.dot(at), slopes, cell.area_m2);
  }
  return fit.Curvature();
}

}  // namespace strata
