#include "tests/integration/crashes/epoch_ledger.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include <gtest/gtest.h>

namespace strata::testing {
namespace {

// The ground is what all scans see, so it follows them no closer than they agree.
constexpr double kGroundM = 0.1;

double LiftOf(const ScanId& id, const Pose& T_map_scan) {
  return T_map_scan.translation().z() - YardTruth(id).translation().z();
}

}  // namespace

void EpochLedger::SawPose(const std::string& who,
                          std::uint64_t epoch,
                          const ScanId& id,
                          const Pose& pose) {
  absl::MutexLock lock(&mutex_);
  const auto [it, added] = poses_.insert({{epoch, id}, pose});
  if (added || it->second.isApprox(pose, 1e-12)) return;
  ADD_FAILURE() << who << ": scan " << id.ToString() << " has two poses in epoch " << epoch << ":\n"
                << it->second.matrix() << "\nand\n"
                << pose.matrix();
}

void EpochLedger::SawMarks(const std::string& who,
                           std::uint64_t epoch,
                           const std::map<ScanId, Mark>& marks) {
  absl::MutexLock lock(&mutex_);
  for (const auto& [id, mark] : marks) {
    const auto [it, added] = marks_.insert({{epoch, id}, mark});
    if (added || it->second == mark) continue;
    ADD_FAILURE() << who << ": scan " << id.ToString() << " is in tiles of epoch " << epoch
                  << " in two ways, " << it->second.size() << " cells around "
                  << it->second.begin()->second << " m and " << mark.size() << " around "
                  << mark.begin()->second << " m";
  }
}

void EpochLedger::SawPlan(const PlanResult& plan) {
  if (!plan.found()) return;
  Heights heights{plan.waypoints.front().z(), plan.waypoints.front().z()};
  for (const Eigen::Vector3d& waypoint : plan.waypoints) {
    heights.lowest = std::min(heights.lowest, waypoint.z());
    heights.highest = std::max(heights.highest, waypoint.z());
  }
  absl::MutexLock lock(&mutex_);
  plans_.insert({plan.epoch, heights});
}

EpochLedger::Compared EpochLedger::Compare() const {
  absl::MutexLock lock(&mutex_);
  Compared compared;
  std::set<std::uint64_t> epochs;
  for (const auto& [key, mark] : marks_) {
    const auto pose = poses_.find(key);
    if (pose == poses_.end()) {
      ++compared.poses_unknown;
      continue;
    }
    ++compared.marks;
    epochs.insert(key.first);
    EXPECT_EQ(Misplaced(key.second, pose->second, mark), "")
        << "scan " << key.second.ToString() << " in epoch " << key.first;
  }
  compared.epochs = epochs.size();
  for (const auto& [epoch, heights] : plans_) {
    const auto pose = poses_.find({epoch, YardScan(1, 1)});
    if (pose == poses_.end()) {
      ++compared.poses_unknown;
      continue;
    }
    ++compared.plans;
    const double ground = LiftOf(pose->first.second, pose->second);
    EXPECT_NEAR(heights.lowest, ground, kGroundM) << "a path of epoch " << epoch;
    EXPECT_NEAR(heights.highest, ground, kGroundM) << "a path of epoch " << epoch;
  }
  return compared;
}

double EpochLedger::SmallestLift(const ScanId& id) const {
  absl::MutexLock lock(&mutex_);
  double smallest = std::numeric_limits<double>::infinity();
  const Pose* before = nullptr;
  for (const auto& [key, pose] : poses_) {
    if (key.second != id) continue;
    if (before != nullptr) {
      smallest = std::min(smallest, std::abs(pose.translation().z() - before->translation().z()));
    }
    before = &pose;
  }
  return smallest;
}

}  // namespace strata::testing
