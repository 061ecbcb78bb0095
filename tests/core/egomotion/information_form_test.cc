#include "core/egomotion/information_form.h"

#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/LU>
#include <gtest/gtest.h>

#include "tests/support/simulator/simulator.h"

namespace strata {
namespace {

constexpr int kSize = 4, kNoise = 2, kRows = 2;
using Vector = Eigen::Matrix<double, kSize, 1>;
using Matrix = Eigen::Matrix<double, kSize, kSize>;

template <typename M>
void Fill(M& matrix, testing::Random& random) {
  for (double& number : matrix.reshaped()) number = random.Uniform(-1.0, 1.0);
}

// A linear system x ← F x + G w that is measured after each step.
struct Step {
  Matrix F;
  Eigen::Matrix<double, kSize, kNoise> G;
  Eigen::Vector2d variances;
  Eigen::Matrix<double, kRows, kSize> H;
  Eigen::Matrix2d R;
  Eigen::Vector2d z;
};

std::vector<Step> DrawSteps(testing::Random& random, int count) {
  std::vector<Step> steps(count);
  for (Step& step : steps) {
    Fill(step.F, random);
    step.F = Matrix::Identity() + 0.2 * step.F;
    Fill(step.G, random);
    step.variances.x() = random.Uniform(0.01, 1.0);
    step.variances.y() = random.Uniform(0.01, 1.0);
    Fill(step.H, random);
    Fill(step.R, random);
    step.R = step.R * step.R.transpose() + 0.1 * Eigen::Matrix2d::Identity();
    Fill(step.z, random);
    step.z *= 10.0;
  }
  return steps;
}

TEST(InformationFormTest, EqualsTheKalmanFilter) {
  testing::Random random(11);
  InformationForm form(Matrix::Identity() * 4.0);
  Vector x = Vector::Zero(), mean = Vector::Zero();
  Matrix P = Matrix::Identity() * 4.0;
  for (const Step& step : DrawSteps(random, 500)) {
    form.Predict(step.F, step.G, step.variances);
    x = step.F * x;
    form.Add(step.H, step.z - step.H * x, step.R);
    x += form.Correct();

    P = step.F * P * step.F.transpose() + step.G * step.variances.asDiagonal() * step.G.transpose();
    mean = step.F * mean;
    const Eigen::Matrix2d S = step.H * P * step.H.transpose() + step.R;
    const Eigen::Matrix<double, kSize, kRows> K = P * step.H.transpose() * S.inverse();
    mean += K * (step.z - step.H * mean);
    P = (Matrix::Identity() - K * step.H) * P;
    ASSERT_LT((x - mean).norm(), 1e-9 * (1.0 + mean.norm()));
    ASSERT_LT((form.Covariance() - P).norm(), 1e-9 * P.norm());
  }
}

// All states and noises at once: rows of [first state, noise of each step], weighed.
TEST(InformationFormTest, EqualsLeastSquaresOfTheWholeRun) {
  constexpr int kSteps = 30;
  testing::Random random(12);
  const std::vector<Step> steps = DrawSteps(random, kSteps);
  InformationForm form(Matrix::Identity() * 4.0);
  Vector x = Vector::Zero();
  const int unknowns = kSize + kSteps * kNoise;
  Eigen::MatrixXd A = Eigen::MatrixXd::Zero(unknowns + kSteps * kRows, unknowns);
  Eigen::VectorXd b = Eigen::VectorXd::Zero(A.rows());
  A.topLeftCorner<kSize, kSize>() = 0.5 * Matrix::Identity();
  Eigen::MatrixXd state = Eigen::MatrixXd::Zero(kSize, unknowns);  // by the unknowns
  state.leftCols<kSize>().setIdentity();
  for (int k = 0; k < kSteps; ++k) {
    const Step& step = steps[k];
    form.Predict(step.F, step.G, step.variances);
    x = step.F * x;
    form.Add(step.H, step.z - step.H * x, step.R);
    x += form.Correct();

    const int noise = kSize + k * kNoise, row = unknowns + k * kRows;
    state = step.F * state;
    state.middleCols<kNoise>(noise) += step.G;
    A.block<kNoise, kNoise>(noise, noise) = step.variances.cwiseSqrt().cwiseInverse().asDiagonal();
    const Eigen::LLT<Eigen::Matrix2d> root(step.R);
    A.middleRows<kRows>(row) = root.matrixL().solve(Eigen::MatrixXd(step.H * state));
    b.segment<kRows>(row) = root.matrixL().solve(step.z);
  }
  const Eigen::LDLT<Eigen::MatrixXd> normal(A.transpose() * A);
  const Vector expected = state * normal.solve(A.transpose() * b);
  EXPECT_LT((x - expected).norm(), 1e-9 * expected.norm());
  const Matrix P = state * normal.solve(state.transpose());
  EXPECT_LT((form.Covariance() - P).norm(), 1e-9 * P.norm());
}

}  // namespace
}  // namespace strata
