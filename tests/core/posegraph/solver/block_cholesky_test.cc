#include "core/posegraph/solver/block_cholesky.h"

#include <cstdint>
#include <random>
#include <set>
#include <utility>
#include <vector>

#include <Eigen/Cholesky>
#include <gtest/gtest.h>

namespace strata {
namespace {

using Pairs = std::vector<std::pair<std::size_t, std::size_t>>;

// A chain with loops, as robots drive, in several components.
Pairs LoopyChain(std::size_t rows, std::size_t loops, std::mt19937_64& random) {
  Pairs pairs;
  for (std::size_t i = 1; i < rows; ++i) {
    if (i % 40 != 0) pairs.emplace_back(i - 1, i);
  }
  for (std::size_t k = 0; k < loops; ++k) {
    const std::size_t i = random() % rows;
    const std::size_t j = random() % rows;
    if (i != j) pairs.emplace_back(i, j);
  }
  return pairs;
}

// Writes a block into the sparse and the dense matrix.
void Put(BlockCholesky& sparse,
         Eigen::MatrixXd& dense,
         int size,
         std::size_t i,
         std::size_t j,
         const Eigen::MatrixXd& block) {
  const BlockSlot slot = sparse.Slot(i, j);
  Eigen::Map<Eigen::MatrixXd> values(sparse.values().data() + slot.offset, size, size);
  values += slot.transposed ? Eigen::MatrixXd(block.transpose()) : block;
  const auto row = static_cast<Eigen::Index>(i) * size;
  const auto column = static_cast<Eigen::Index>(j) * size;
  dense.block(row, column, size, size) += block;
  if (i != j) dense.block(column, row, size, size) += block.transpose();
}

struct Case {
  int size;
  std::size_t rows, loops;
};

class BlockCholeskyTest : public ::testing::TestWithParam<Case> {
 protected:
  void SetUp() override {
    const auto [size, rows, loops] = GetParam();
    const Pairs pairs = LoopyChain(rows, loops, random_);
    sparse_.emplace_back(size, rows, pairs);
    const auto n = static_cast<Eigen::Index>(rows) * size;
    dense_ = Eigen::MatrixXd::Zero(n, n);
    for (const auto& [i, j] : pairs) {
      const Eigen::MatrixXd A = Random(size, size);
      const Eigen::MatrixXd B = Random(size, size);
      Put(sparse_[0], dense_, size, i, i, A.transpose() * A);
      Put(sparse_[0], dense_, size, j, j, B.transpose() * B);
      Put(sparse_[0], dense_, size, i, j, A.transpose() * B);
    }
    for (std::size_t i = 0; i < rows; ++i) {
      Put(sparse_[0], dense_, size, i, i, 0.1 * Eigen::MatrixXd::Identity(size, size));
    }
  }
  Eigen::MatrixXd Random(Eigen::Index rows, Eigen::Index columns) {
    std::normal_distribution<double> normal;
    return Eigen::MatrixXd::NullaryExpr(rows, columns, [&] { return normal(random_); });
  }

  std::mt19937_64 random_{7};
  std::vector<BlockCholesky> sparse_;
  Eigen::MatrixXd dense_;
};

TEST_P(BlockCholeskyTest, SolvesWhatADenseFactorisationSolves) {
  BlockCholesky& sparse = sparse_[0];
  EXPECT_EQ(sparse.Diagonal(), dense_.diagonal());
  for (int n = 0; n < 3; ++n) {  // the pattern is used again
    const Eigen::VectorXd damping = Random(dense_.rows(), 1).cwiseAbs();
    const Eigen::VectorXd b = Random(dense_.rows(), 1);
    const Eigen::MatrixXd damped = dense_ + Eigen::MatrixXd(damping.asDiagonal());
    ASSERT_TRUE(sparse.Factor(damping));
    const Eigen::VectorXd x = sparse.Solve(b);
    EXPECT_LT((x - damped.llt().solve(b)).norm(), 1e-9 * x.norm());
  }
}

TEST_P(BlockCholeskyTest, SaysWhatIsNotPositiveDefinite) {
  Eigen::VectorXd damping = Eigen::VectorXd::Zero(dense_.rows());
  damping[dense_.rows() / 2] = -1e6;
  EXPECT_FALSE(sparse_[0].Factor(damping));
  damping.setZero();
  EXPECT_TRUE(sparse_[0].Factor(damping));
}

INSTANTIATE_TEST_SUITE_P(Shapes,
                         BlockCholeskyTest,
                         ::testing::Values(Case{6, 1, 0},
                                           Case{6, 2, 1},
                                           Case{3, 50, 0},
                                           Case{6, 90, 60},
                                           Case{3, 200, 100},
                                           Case{6, 60, 1500}));

TEST(BlockCholeskyFillTest, AChainFillsLittle) {
  Pairs pairs;
  for (std::size_t i = 1; i < 1000; ++i) pairs.emplace_back(i, i - 1);
  EXPECT_LT(BlockCholesky(6, 1000, pairs).factor_blocks(), 6000U);
}

}  // namespace
}  // namespace strata
