// What a cost of the pose graph's solver gives to Ceres, beside derivatives by differences.
#ifndef STRATA_TESTS_CORE_POSEGRAPH_COST_JACOBIAN_H_
#define STRATA_TESTS_CORE_POSEGRAPH_COST_JACOBIAN_H_

#include <algorithm>
#include <cstddef>
#include <vector>

#include <Eigen/Core>
#include <ceres/cost_function.h>
#include <ceres/manifold.h>
#include <gtest/gtest.h>

#include "tests/core/posegraph/random_poses.h"

namespace strata::testing {

using Blocks = std::vector<std::vector<double>>;
using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

inline Eigen::VectorXd ResidualsOf(const ceres::CostFunction& cost, const Blocks& blocks) {
  std::vector<const double*> at;
  for (const std::vector<double>& block : blocks) at.push_back(block.data());
  Eigen::VectorXd residuals(cost.num_residuals());
  EXPECT_TRUE(cost.Evaluate(at.data(), residuals.data(), nullptr));
  return residuals;
}

// By steps of each block, as Ceres makes them of the cost's Jacobians and the manifolds'.
inline std::vector<Eigen::MatrixXd> JacobiansOf(
    const ceres::CostFunction& cost,
    const Blocks& blocks,
    const std::vector<const ceres::Manifold*>& manifolds) {
  std::vector<const double*> at;
  std::vector<RowMajor> by_block;
  for (const std::vector<double>& block : blocks) {
    at.push_back(block.data());
    by_block.emplace_back(cost.num_residuals(), static_cast<Eigen::Index>(block.size()));
  }
  std::vector<double*> jacobians;
  for (RowMajor& jacobian : by_block) jacobians.push_back(jacobian.data());
  Eigen::VectorXd residuals(cost.num_residuals());
  EXPECT_TRUE(cost.Evaluate(at.data(), residuals.data(), jacobians.data()));
  EXPECT_EQ(residuals, ResidualsOf(cost, blocks));
  std::vector<Eigen::MatrixXd> by_step;
  for (std::size_t k = 0; k < blocks.size(); ++k) {
    RowMajor plus(manifolds[k]->AmbientSize(), manifolds[k]->TangentSize());
    EXPECT_TRUE(manifolds[k]->PlusJacobian(at[k], plus.data()));
    by_step.emplace_back(by_block[k] * plus);
  }
  return by_step;
}

inline void ExpectTrueJacobians(const ceres::CostFunction& cost,
                                const Blocks& blocks,
                                const std::vector<const ceres::Manifold*>& manifolds,
                                double tolerance) {
  const std::vector<Eigen::MatrixXd> by_step = JacobiansOf(cost, blocks, manifolds);
  for (std::size_t k = 0; k < blocks.size(); ++k) {
    const Eigen::MatrixXd by_difference = NumericJacobian(
        [&](const Eigen::VectorXd& step) {
          Blocks moved = blocks;
          EXPECT_TRUE(manifolds[k]->Plus(blocks[k].data(), step.data(), moved[k].data()));
          return ResidualsOf(cost, moved);
        },
        manifolds[k]->TangentSize());
    const double scale = std::max(1.0, by_difference.cwiseAbs().maxCoeff());
    EXPECT_LT((by_step[k] - by_difference).cwiseAbs().maxCoeff(), tolerance * scale) << k;
  }
}

}  // namespace strata::testing

#endif  // STRATA_TESTS_CORE_POSEGRAPH_COST_JACOBIAN_H_
