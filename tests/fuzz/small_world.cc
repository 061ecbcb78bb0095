#include "tests/fuzz/small_world.h"

#include <cstdint>
#include <memory>

#include "core/cloud/cloud_slice.h"
#include "core/engine/engine.h"
#include "core/world/scan_hash.h"
#include "tests/core/engine/engine_fixture.h"
#include "tests/fuzz/require.h"

namespace strata::fuzz {
namespace {

PointCloud LabelledRoom(std::uint64_t seed) {
  PointCloud cloud = testing::MakeRoom(seed, kWorldPoints);
  for (const Eigen::Vector3f& p : cloud.points) cloud.label.push_back(p.z() > 0.1F ? 2 : 1);
  return cloud;
}

void AddScan(api::Database& database, std::uint64_t i) {
  const PointCloud cloud = LabelledRoom(i);
  const ScanHeader header = testing::HeaderOf({kWorld, i}, cloud, testing::RoomPose(i));
  Require(testing::Upload(database, header, cloud, kWorldPoints, kWorld).ok(), "a scan is taken");
}

void BreakUploadOff(api::Database& database) {
  const auto [header, cloud] = BrokenOffScan();
  const auto upload = database.scans().Upload({}, kWorld, header);
  Require(upload.ok() && (*upload)->Write(SliceOf(cloud, 0, kWorldPoints / 2)).ok(),
          "half a scan is taken");
}

void Decide(api::Database& database) {
  Require(database.maps().SetClass({}, kWorld, {1, "floor", {128, 128, 128}}).ok(),
          "a class is named");
  Require(database.posegraph()
              .SetPose({}, kWorld, {kWorld, kWorldScans}, testing::PoseAt(1.0, 2.0, 0.9))
              .ok(),
          "a scan is moved");
  Constraint constraint;
  constraint.i = {kWorld, 1};
  constraint.j = {kWorld, 2};
  constraint.T_i_j = testing::PoseAt(4.0, 0.7, 0.3);
  constraint.information.setIdentity();
  Require(database.posegraph().AddConstraint({}, kWorld, constraint).ok(), "a constraint is taken");
}

void Learn(api::Database& database) {
  const JobInfo job = testing::RunJob(
      database, "train", {{"name", kWorldClassifier}, {"method", "bayes"}, {"folds", "0"}}, kWorld);
  Require(job.state == JobState::kSucceeded, "labels are learned");
}

void CheckPlanning(api::Database& database) {
  PlanQuery query;
  query.from = {.x_m = -6.0, .y_m = 0.7};
  query.to = {.x_m = 1.0, .y_m = 2.0};
  query.profile = kWorldRobot;
  const auto plan = database.planning().PlanPath({}, kWorld, query);
  Require(plan.ok() && plan->reason == PlanReason::kFound, "there is a path through the world");
}

}  // namespace

WorldScan BrokenOffScan() {
  const PointCloud cloud = LabelledRoom(kWorldScans + 1);
  ScanHeader header =
      testing::HeaderOf({kWorld, kWorldScans + 1}, cloud, testing::PoseAt(0.0, 0.0));
  header.content_hash = ContentHashOf(header, cloud);
  return {header, cloud};
}

SmallWorld::SmallWorld() {
  const auto database = OpenEngine({.directory = directory_.path()}).value();
  MapParameters parameters;
  parameters.mls.cell_size_m = kWorldCellSizeM;
  Require(database->maps().Create({}, kWorld, parameters).ok(), "a map is made");
  for (std::uint64_t i = 1; i <= kWorldScans; ++i) AddScan(*database, i);
  testing::WaitIntegrated(*database, kWorld);
  Decide(*database);
  Learn(*database);
  BreakUploadOff(*database);
  CheckPlanning(*database);
}

void SmallWorld::CopyTo(const std::filesystem::path& directory) const {
  std::filesystem::copy(directory_.path(), directory, std::filesystem::copy_options::recursive);
}

}  // namespace strata::fuzz
