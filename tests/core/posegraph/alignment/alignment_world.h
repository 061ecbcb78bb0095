#ifndef STRATA_TESTS_CORE_POSEGRAPH_ALIGNMENT_ALIGNMENT_WORLD_H_
#define STRATA_TESTS_CORE_POSEGRAPH_ALIGNMENT_ALIGNMENT_WORLD_H_

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include <gtest/gtest.h>

#include "core/cloud/sensor_model.h"
#include "core/mls/build.h"
#include "core/planes/extraction.h"
#include "core/posegraph/alignment/alignment.h"
#include "tests/core/posegraph/random_poses.h"
#include "tests/support/simulator/simulator.h"
#include "tests/support/simulator/worlds.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {

// What a robot saw on its way through the yard and a second one after it, a scan every 2 m.
class YardScans final : public AlignmentSource {
 public:
  static constexpr std::size_t kFirst = 6;
  static constexpr std::size_t kScans = 10;

  YardScans() {
    const Scene yard = YardScene();
    SensorOptions sensor;
    sensor.rings = 32;
    sensor.columns = 360;
    for (std::size_t k = 0; k < kScans; ++k) {
      const bool first = k < kFirst;
      const double along = 2.0 * static_cast<double>(first ? k : k - kFirst) + (first ? 0.0 : 1.0);
      const Eigen::AngleAxisd turn(first ? 0.05 * along : 2.0, Eigen::Vector3d::UnitZ());
      truth_.push_back(
          MakePose(Eigen::Quaterniond(turn), {along, first ? 0.0 : -1.5, first ? 1.2 : 1.5}));
      Take(SimulateScan(yard, sensor, truth_.back(), 100 + k));
    }
  }

  absl::StatusOr<std::shared_ptr<const ScanFeatures>> Features(std::size_t node) override {
    return features_[node];
  }
  absl::StatusOr<std::shared_ptr<const ScanPlanes>> Planes(std::size_t node) override {
    return planes_[node];
  }
  const std::vector<Pose>& truth() const { return truth_; }

 private:
  void Take(const PointCloud& cloud) {
    const absl::StatusOr<MlsBuildResult> local =
        BuildMlsMap(cloud, Pose::Identity(), SensorModel(), MlsParameters());
    STRATA_EXPECT_OK(local);
    ScanFeatureOptions options;
    options.sample_count = 1000;
    features_.push_back(
        std::make_shared<const ScanFeatures>(ScanFeatures::FromMap(local->map, options)));
    planes_.push_back(std::make_shared<const ScanPlanes>(ExtractPlanes(cloud)));
  }

  std::vector<Pose> truth_;
  std::vector<std::shared_ptr<const ScanFeatures>> features_;
  std::vector<std::shared_ptr<const ScanPlanes>> planes_;
};

// Of translation [m] and rotation [rad] of all but the first, relative to the first.
struct Errors {
  double mean_m = 0.0, max_m = 0.0, max_rad = 0.0;
};

class AlignmentTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() { yard_ = new YardScans; }
  static void TearDownTestSuite() { delete yard_; }

  AlignmentTest() {
    problem_.T_map_scan = yard().truth();
    problem_.trajectories.resize(2);
    for (std::size_t k = 0; k < YardScans::kScans; ++k) {
      problem_.trajectories[k < YardScans::kFirst ? 0 : 1].push_back(k);
      if (k != 0 && k != YardScans::kFirst) problem_.pairs.push_back({k - 1, k});
    }
    // Both know that they are in one frame.
    problem_.relative.push_back(
        {0, YardScans::kFirst, TrueStep(0, YardScans::kFirst), Matrix6d::Identity() * 1e-6});
    options_.max_rounds = 4;
    options_.registration.max_samples = 1000;
  }

  static YardScans& yard() { return *yard_; }

  void Disturb(std::uint64_t seed, double sigma_rad = 0.015, double sigma_m = 0.1) {
    RandomPoses random(seed);
    for (std::size_t k = 1; k < YardScans::kScans; ++k) {
      problem_.T_map_scan[k] = Retract(problem_.T_map_scan[k], random.Step(sigma_rad, sigma_m));
    }
  }

  absl::StatusOr<AlignmentResult> Align(AlignmentSource& source, ForEach for_each = ForEachInTurn) {
    return AlignScans(
        problem_, source, options_, for_each, [](double) { return absl::OkStatus(); }, Stop());
  }
  absl::StatusOr<AlignmentResult> Align() { return Align(yard()); }

  static Pose TrueStep(std::size_t i, std::size_t j) {
    return yard().truth()[i].inverse() * yard().truth()[j];
  }

  static Errors ErrorsOf(const std::vector<Pose>& T_map_scan) {
    Errors errors;
    for (std::size_t k = 1; k < T_map_scan.size(); ++k) {
      const Pose off = TrueStep(0, k).inverse() * T_map_scan[0].inverse() * T_map_scan[k];
      const double distance = off.translation().norm();
      errors.mean_m += distance / static_cast<double>(T_map_scan.size() - 1);
      errors.max_m = std::max(errors.max_m, distance);
      errors.max_rad = std::max(errors.max_rad, RotationAngleRad(off));
    }
    return errors;
  }

  AlignmentProblem problem_;
  AlignmentOptions options_;

 private:
  static inline YardScans* yard_ = nullptr;
};

}  // namespace strata::testing

#endif  // STRATA_TESTS_CORE_POSEGRAPH_ALIGNMENT_ALIGNMENT_WORLD_H_
