#include "core/registration/sliding.h"

#include <Eigen/Cholesky>
#include <gtest/gtest.h>

namespace strata {
namespace {

// What points hold, of which `normals` is the stiffness in each direction of space.
Matrix6d Held(const Eigen::Vector3d& normals) {
  Matrix6d H = Matrix6d::Zero();
  for (const double x : {-2.0, -1.0, 1.0, 2.0}) {
    for (const double y : {-1.5, -0.5, 0.5, 1.5}) {
      Eigen::Matrix<double, 3, 6> J;
      J << 0, 0, -y, 1, 0, 0,  //
          0, 0, x, 0, 1, 0,    //
          y, -x, 0, 0, 0, 1;
      H += J.transpose() * normals.asDiagonal() * J;
    }
  }
  return H;
}

const Vector6d kPull = (Vector6d() << 1, -2, 3, -4, 5, -6).finished();

TEST(SlidingTest, AFloorSaysNothingOfWhereOnItOneIs) {
  const Matrix6d H_across = Held({0.0, 0.0, 1.0});
  const NormalEquations all = {H_across + Held({0.25, 0.25, 0.0}), kPull};
  const NormalEquations left = WithoutSliding(all, H_across, 0.5, 2.0);
  for (const int unheld : {2, 3, 4}) {
    EXPECT_NEAR(left.b[unheld], 0.0, 1e-9) << unheld;
    EXPECT_LT(left.H.row(unheld).norm(), 1e-9) << unheld;
    EXPECT_LT(left.H.col(unheld).norm(), 1e-9) << unheld;
  }
  for (const int held : {0, 1, 5}) {
    EXPECT_NEAR(left.b[held], all.b[held], 1e-9) << held;
    EXPECT_NEAR(left.H(held, held), all.H(held, held), 1e-9) << held;
  }
}

TEST(SlidingTest, ACorridorIsHeldButAlongItself) {
  const Matrix6d H_across = Held({0.0, 1.0, 1.0});
  const NormalEquations all = {H_across + Held({0.25, 0.0, 0.0}), kPull};
  const NormalEquations left = WithoutSliding(all, H_across, 0.5, 2.0);
  EXPECT_NEAR(left.b[3], 0.0, 1e-9);
  EXPECT_LT(left.H.col(3).norm(), 1e-9);
  EXPECT_NEAR(left.b[4], all.b[4], 1e-9);
  EXPECT_NEAR(left.H(2, 2), all.H(2, 2), 1e-9) << "both walls hold its direction";
}

TEST(SlidingTest, WhatIsHeldInEveryDirectionStaysAsItIs) {
  const Matrix6d H_across = Held({0.1, 0.1, 1.0});
  const NormalEquations all = {H_across + Held({0.25, 0.25, 0.0}), kPull};
  EXPECT_EQ(WithoutSliding(all, H_across, 0.5, 2.0).H, all.H);
  EXPECT_EQ(WithoutSliding(all, Matrix6d::Zero(), 0.0, 2.0).H, all.H) << "nothing has to be held";
}

TEST(SlidingTest, TurnsAreWeighedAsTheirArc) {
  Matrix6d H = 100.0 * Matrix6d::Identity();
  H(2, 2) = 4.0;
  const NormalEquations all = {H, kPull};
  EXPECT_EQ(WithoutSliding(all, H, 0.9, 2.0).b[2], kPull[2]);
  EXPECT_NEAR(WithoutSliding(all, H, 0.9, 3.0).b[2], 0.0, 1e-9);
}

}  // namespace
}  // namespace strata
