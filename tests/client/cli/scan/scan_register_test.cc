// strata scan register, as its users run it: without a server.
#include <cstdint>
#include <filesystem>
#include <random>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "client/formats/file_bytes.h"
#include "client/formats/geometry_writer.h"
#include "core/geometry/pose.h"
#include "tests/client/cli/run_strata.h"
#include "tests/support/status_matchers.h"
#include "tests/support/temp_dir.h"

namespace strata::cli {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;
using ::testing::StartsWith;

// A yard of 24 m with walls, a block and a ramp in it, seen from its middle, in the frame of a
// scan that stands at T_yard_scan.
Geometry Yard(std::uint64_t seed, const Pose& T_yard_scan) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> wide(-12.0, 12.0);
  std::uniform_real_distribution<double> tall(-1.5, 3.0);
  std::uniform_real_distribution<double> one(0.0, 1.0);
  std::normal_distribution<double> noise(0.0, 0.005);
  const Pose T_scan_yard = T_yard_scan.inverse();
  Geometry geometry;
  const auto add = [&](double x, double y, double z) {
    geometry.vertices.emplace_back(T_scan_yard * Eigen::Vector3d(x, y, z));
  };
  for (int i = 0; i < 20'000; ++i) add(wide(random), wide(random), -1.5 + noise(random));
  for (int i = 0; i < 12'000; ++i) {
    const double side = (i % 2 == 0 ? 12.0 : -12.0) + noise(random);
    if (i % 4 < 2) {
      add(side, wide(random), tall(random));
    } else {
      add(wide(random), side, tall(random));
    }
  }
  for (int i = 0; i < 6'000; ++i) {
    add(4.0 + noise(random), 2.0 + 3.0 * one(random), -1.5 + 2.0 * one(random));
    add(4.0 + 2.0 * one(random), 2.0 + noise(random), -1.5 + 2.0 * one(random));
    const double up = one(random);
    add(-8.0 + 5.0 * up, -6.0 + 3.0 * one(random), -1.5 + 1.2 * up + noise(random));
  }
  return geometry;
}

Pose Planted() {
  return MakePose(
      Eigen::Quaterniond(Eigen::AngleAxisd(0.06, Eigen::Vector3d(0.1, -0.1, 1.0).normalized())),
      {0.5, -0.3, 0.1});
}

class ScanRegisterTest : public ::testing::TestWithParam<std::string> {
 protected:
  std::string Write(const std::string& name, const Geometry& geometry) {
    const std::string path = (dir_.path() / name).string();
    const auto bytes = PcdBytes(geometry);
    STRATA_EXPECT_OK(bytes.status());
    STRATA_EXPECT_OK(WriteFileBytes(path, *bytes));
    return path;
  }
  Ran Register(std::vector<std::string> more) {
    std::vector<std::string> arguments = {"scan", "register"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    arguments.insert(arguments.end(), {"--output", "json"});
    return RunStrata(arguments);
  }
  testing::TempDir dir_;
};

Pose PoseOf(const json& pose) {
  const auto n = pose.get<std::vector<double>>();
  return MakePose(Eigen::Quaterniond(n[6], n[3], n[4], n[5]), Eigen::Vector3d(n[0], n[1], n[2]));
}

double ErrorOf(const Pose& T, const Pose& truth) {
  const Pose error = truth.inverse() * T;
  return error.translation().norm() + RotationAngleRad(error);
}

TEST_P(ScanRegisterTest, FindsThePlantedPoseAndDrawsIt) {
  const std::string target = Write("a.pcd", Yard(1, Pose::Identity()));
  const std::string source = Write("b.pcd", Yard(2, Planted()));
  const std::string picture = (dir_.path() / "both.png").string();
  const Ran ran = Register({source, target, "--method", GetParam(), "--picture", picture});
  ASSERT_EQ(ran.exit_code, 0) << ran.err;
  const json result = json::parse(ran.out);
  EXPECT_EQ(result["method"], GetParam());
  EXPECT_EQ(result["converged"], true) << ran.out;
  EXPECT_LT(ErrorOf(PoseOf(result["T_target_source"]), Planted()), 0.03) << ran.out;
  EXPECT_GT(result["overlap"], 0.6);
  EXPECT_EQ(result["undetermined_directions"], 0);
  EXPECT_GT(result["sigma_m"], 0.0);
  STRATA_ASSERT_OK_AND_ASSIGN(const std::string bytes, ReadFileBytes(picture));
  EXPECT_THAT(bytes, StartsWith("\x89PNG"));
}

// As georeferenced scans are: the pose is between coordinates of hundreds of kilometres.
TEST_P(ScanRegisterTest, FarCoordinatesLoseNothing) {
  const Pose utm(Eigen::Translation3d(450'000.0, 5'400'000.0, 300.0));
  const std::string target = Write("a.pcd", Yard(3, utm.inverse()));
  const std::string source = Write("b.pcd", Yard(4, Planted() * utm.inverse()));
  const Ran ran = Register({source, target, "--method", GetParam()});
  ASSERT_EQ(ran.exit_code, 0) << ran.err;
  const json result = json::parse(ran.out);
  EXPECT_EQ(result["converged"], true) << ran.out;
  const Pose T_yard = utm.inverse() * PoseOf(result["T_target_source"]) * utm;
  EXPECT_LT(ErrorOf(T_yard, Planted()), 0.03) << ran.out;
}

INSTANTIATE_TEST_SUITE_P(Methods,
                         ScanRegisterTest,
                         ::testing::Values("mls", "icp", "trimmed", "plane", "gicp"),
                         [](const auto& method) { return method.param; });

using ScanRegisterDoorTest = ScanRegisterTest;

TEST_F(ScanRegisterDoorTest, WhatDoesNotOverlapIsNoError) {
  const std::string target = Write("a.pcd", Yard(1, Pose::Identity()));
  for (const std::string method : {"mls", "gicp"}) {
    const Ran ran = Register({target, target, "--method", method, "--guess", "500,0,0"});
    ASSERT_EQ(ran.exit_code, 0) << ran.err;
    const json result = json::parse(ran.out);
    EXPECT_EQ(result["converged"], false);
    EXPECT_EQ(result["termination"], "too little overlap");
    EXPECT_EQ(result["T_target_source"][0], 500.0);
    EXPECT_THAT(ran.err, HasSubstr("--guess"));
  }
}

TEST_F(ScanRegisterDoorTest, WhatCannotBeReadOrIsNoMethodIsSaid) {
  const std::string target = Write("a.pcd", Yard(1, Pose::Identity()));
  EXPECT_THAT(Register({"none.pcd", target}).err, HasSubstr("none.pcd"));
  EXPECT_EQ(Register({target, target, "--method", "magic"}).exit_code, 2);
}

}  // namespace
}  // namespace strata::cli
