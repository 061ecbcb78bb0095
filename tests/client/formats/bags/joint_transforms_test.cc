// The chain of joints of thesis 4.2: the arm of figure 4.2, composed by hand.
#include "client/formats/bags/joint_transforms.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <random>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/formats/bags/transform_tree.h"
#include "client/formats/file_bytes.h"
#include "tests/support/status_matchers.h"
#include "tests/support/temp_dir.h"

namespace strata {
namespace {

using ::strata::testing::StatusIs;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

// Joints j1 and j3 turn about z, j2 and j4 about x; the constants are those of 4.2.1.
constexpr char kArm[] = R"(<robot name="arm">
  <link name="base"/><link name="l1"/><link name="l2"/><link name="l3"/><link name="l4"/>
  <link name="laser"/><link name="finger"/>
  <joint name="j1" type="continuous"><parent link="base"/><child link="l1"/>
    <origin xyz="0 0 0.045"/><axis xyz="0 0 1"/></joint>
  <joint name="j2" type="revolute"><parent link="l1"/><child link="l2"/>
    <axis xyz="1 0 0"/><limit lower="-1.5708" upper="1.5708" effort="1" velocity="1"/></joint>
  <joint name="j3" type="continuous"><parent link="l2"/><child link="l3"/>
    <origin xyz="0 0 0.73"/><axis xyz="0 0 1"/></joint>
  <joint name="j4" type="revolute"><parent link="l3"/><child link="l4"/>
    <axis xyz="1 0 0"/><limit lower="-1.5708" upper="1.5708" effort="1" velocity="1"/></joint>
  <joint name="mount" type="fixed"><parent link="l4"/><child link="laser"/>
    <origin xyz="0 0 0.47" rpy="0.1 0.2 0.3"/></joint>
  <joint name="grip" type="prismatic"><parent link="l4"/><child link="finger"/>
    <axis xyz="0 2 0"/><limit lower="-1" upper="1" effort="1" velocity="1"/>
    <mimic joint="j1" multiplier="-0.5" offset="0.25"/></joint>
</robot>)";

Eigen::Matrix4d Rz(double a) {
  Eigen::Matrix4d R = Eigen::Matrix4d::Identity();
  R.topLeftCorner<2, 2>() << std::cos(a), -std::sin(a), std::sin(a), std::cos(a);
  return R;
}
Eigen::Matrix4d Ry(double a) {
  Eigen::Matrix4d R = Eigen::Matrix4d::Identity();
  R(0, 0) = R(2, 2) = std::cos(a);
  R(0, 2) = std::sin(a);
  R(2, 0) = -std::sin(a);
  return R;
}
Eigen::Matrix4d Rx(double a) {
  Eigen::Matrix4d R = Eigen::Matrix4d::Identity();
  R.block<2, 2>(1, 1) << std::cos(a), -std::sin(a), std::sin(a), std::cos(a);
  return R;
}
Eigen::Matrix4d Up(double z) {
  Eigen::Matrix4d T = Eigen::Matrix4d::Identity();
  T(2, 3) = z;
  return T;
}

class JointTransformsTest : public ::testing::Test {
 protected:
  absl::StatusOr<JointTransforms> Read(const std::string& text) const {
    STRATA_EXPECT_OK(WriteFileBytes(dir_.path() / "arm.urdf", text));
    return JointTransforms::Read((dir_.path() / "arm.urdf").string());
  }
  testing::TempDir dir_;
};

TEST_F(JointTransformsTest, TheArmOfTheThesis) {
  constexpr std::uint64_t kSeed = 42;
  SCOPED_TRACE(kSeed);
  STRATA_ASSERT_OK_AND_ASSIGN(const JointTransforms joints, Read(kArm));
  EXPECT_THAT(joints.Moving(), ElementsAre("j1", "j2", "j3", "j4"));
  TransformTree tree;
  for (const RosPose& transform : joints.Fixed()) STRATA_ASSERT_OK(tree.Add(transform, true));
  std::mt19937_64 random(kSeed);
  std::uniform_real_distribution<double> turn(-3.14, 3.14), bend(-1.57, 1.57);
  std::array<double, 4> before{};
  for (std::int64_t t = 0; t < 50; ++t) {
    const std::array<double, 4> j = {turn(random), bend(random), turn(random), bend(random)};
    // Only what a message names moves: the second half comes apart from the first.
    for (const RosJointState& state :
         {RosJointState{{t * 1000, ""}, {"j1", "j2", "wheel"}, {j[0], j[1], 7.0}},
          RosJointState{{t * 1000, ""}, {"j4", "j3"}, {j[3], j[2]}}}) {
      for (const RosPose& transform : joints.At(state))
        STRATA_ASSERT_OK(tree.Add(transform, false));
    }
    const auto arm = [](const std::array<double, 4>& q) -> Eigen::Matrix4d {
      const Eigen::Matrix4d mount = Up(0.47) * Rz(0.3) * Ry(0.2) * Rx(0.1);
      return Up(0.045) * Rz(q[0]) * Rx(q[1]) * Up(0.73) * Rz(q[2]) * Rx(q[3]) * mount;
    };
    STRATA_ASSERT_OK_AND_ASSIGN(const Pose T, tree.Lookup("base", "laser", t * 1000));
    EXPECT_LT((T.matrix() - arm(j)).norm(), 1e-12);
    STRATA_ASSERT_OK_AND_ASSIGN(const Pose grip, tree.Lookup("l4", "finger", t * 1000));
    EXPECT_NEAR(grip.translation().y(), -0.5 * j[0] + 0.25, 1e-12);
    // Between two messages every joint turns evenly, the shorter way round.
    std::array<double, 4> half{};
    for (std::size_t k = 0; k < 4; ++k) {
      half[k] = before[k] + 0.5 * std::remainder(j[k] - before[k], 2.0 * M_PI);
    }
    if (t > 0) {
      STRATA_ASSERT_OK_AND_ASSIGN(const Pose middle, tree.Lookup("base", "laser", t * 1000 - 500));
      EXPECT_LT((middle.matrix() - arm(half)).norm(), 1e-9);
    }
    before = j;
  }
}

TEST_F(JointTransformsTest, OtherFilesAreRefused) {
  EXPECT_THAT(Read("<robot"),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("no robot description")));
  EXPECT_EQ(JointTransforms::Read("/nowhere.urdf").status().code(), absl::StatusCode::kNotFound);
}

}  // namespace
}  // namespace strata
