#include "tests/support/database_suite/things.h"

#include <string>
#include <vector>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "core/common/status.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

// Whether the box is in the way of the ray from where the sensor of FloorHeader() is.
bool IsBehind(const Eigen::AlignedBox3f& box, const Eigen::Vector3f& p) {
  for (float share = 0.0F; share < 0.999F; share += 0.002F) {
    const Eigen::Vector3f on = Eigen::Vector3f::UnitZ() + share * (p - Eigen::Vector3f::UnitZ());
    if (box.contains(on)) return true;
  }
  return false;
}

}  // namespace

void AddBlock(const Eigen::Vector3f& low, const Eigen::Vector3f& size, PointCloud& cloud) {
  constexpr float kStep = 0.05F;
  for (float x = 0.0F; x <= size.x(); x += kStep) {
    for (float y = 0.0F; y <= size.y(); y += kStep) {
      for (float z = 0.1F; z <= size.z(); z += kStep) {
        const bool side = x < kStep || y < kStep || x + kStep > size.x() || y + kStep > size.y();
        if (!side && z + kStep <= size.z()) continue;
        cloud.points.emplace_back(low + Eigen::Vector3f(x, y, z));
        cloud.label.push_back(kThingClass);
      }
    }
  }
}

JobInfo FindKinds(api::Database& db, const std::string& map) {
  const JobInfo job = EndOfJob(db, "objects", {{"class", "thing"}}, map);
  EXPECT_EQ(job.state, JobState::kSucceeded) << job.message;
  return job;
}

std::vector<Entity> EntitiesWith(api::Database& db,
                                 const EntityQuery& query,
                                 const std::string& map) {
  std::vector<Entity> entities;
  STRATA_EXPECT_OK(db.objects().ListEntities({}, map, query, [&](const Entity& entity) {
    entities.push_back(entity);
    return absl::OkStatus();
  }));
  return entities;
}

void PutWholeAndHalf(api::Database& db) {
  PointCloud whole = LevelFloor();
  whole.label.assign(whole.size(), kGroundClass);
  AddBlock({-3.0F, -3.0F, 0.0F}, kHalfSize, whole);
  STRATA_ASSERT_OK(UploadScan(db, kMap, FloorHeader({"run", 1}, whole), whole));
  PointCloud half = LevelFloor();
  const Eigen::AlignedBox3f box(kHalfLow, kHalfLow + kHalfSize);
  std::erase_if(half.points, [&](const Eigen::Vector3f& p) { return IsBehind(box, p); });
  half.label.assign(half.size(), kGroundClass);
  PointCloud block;
  AddBlock(kHalfLow, kHalfSize, block);
  for (const Eigen::Vector3f& p : block.points) {
    if (p.x() > 2.5F) continue;
    half.points.push_back(p);
    half.label.push_back(kThingClass);
  }
  STRATA_ASSERT_OK(UploadScan(db, kMap, FloorHeader({"run", 2}, half), half));
  AwaitIntegration(db, kMap);
  STRATA_ASSERT_OK(db.maps().SetClass({}, kMap, {kThingClass, "thing", {200, 90, 20}}));
}

absl::StatusOr<std::vector<InferredPart>> InferredOf(api::Database& db, const EntityQuery& query) {
  std::vector<InferredPart> parts;
  STRATA_RETURN_IF_ERROR(db.objects()
                             .ListInferred({},
                                           kMap,
                                           query,
                                           [&](const InferredPart& part) {
                                             parts.push_back(part);
                                             return absl::OkStatus();
                                           })
                             .status());
  return parts;
}

}  // namespace strata::testing
