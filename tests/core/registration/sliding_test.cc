#include "core/registration/sliding.h"

#include <random>

#include <Eigen/Core>
#include <Eigen/Geometry>
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

// Planted: normals of one plane that err alike in every sixteen, held against each other.
TEST(SlidingTest, NormalsThatErrFeignAsMuchHoldAsIsSaid) {
  constexpr double kError = 0.15;
  constexpr int kElements = 125;
  constexpr int kMatches = 16 * kElements;
  std::mt19937_64 random(7);
  std::normal_distribution<double> error(0.0, kError);
  int beyond = 0;
  int beyond_a_third = 0;
  for (int draw = 0; draw < 1000; ++draw) {
    double held = 0.0;
    double squared_lean = 0.0;
    for (int i = 0; i < kElements; ++i) {
      const Eigen::Vector3d p = Eigen::Vector3d(error(random), error(random), 1.0).normalized();
      const Eigen::Vector3d q = Eigen::Vector3d(error(random), error(random), 1.0).normalized();
      held += p.x() * q.x() / kElements;
      squared_lean += p.cross(q).squaredNorm() / kElements;
    }
    const double feigned = FeignedHold(squared_lean, kMatches);
    beyond += held > feigned ? 1 : 0;
    beyond_a_third += held > feigned / 3.0 ? 1 : 0;
  }
  EXPECT_LE(beyond, 5) << "three sigma";
  EXPECT_GT(beyond_a_third, 110) << "one sigma: 159 of 1,000";
  EXPECT_LT(beyond_a_third, 210);
}

TEST(SlidingTest, FeignedHoldIsBounded) {
  EXPECT_EQ(FeignedHold(0.0, 0), 0.0);
  EXPECT_EQ(FeignedHold(0.0, 2000), 0.0) << "normals without an error feign nothing";
  EXPECT_LE(FeignedHold(0.75, 100), 0.015) << "two surfaces are no errors";
  EXPECT_GT(FeignedHold(0.02, 500), FeignedHold(0.02, 2000)) << "many err less together";
}

}  // namespace
}  // namespace strata
