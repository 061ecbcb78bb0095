// Conformance: the kinds of things in maps.
#include <algorithm>
#include <cstdint>
#include <iterator>
#include <limits>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/cloud/point_cloud.h"
#include "core/world/things/entity.h"
#include "core/world/things/kind.h"
#include "tests/support/database_suite/database_suite.h"
#include "tests/support/database_suite/things.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;
using Code = absl::StatusCode;

// Of each of two kinds two, and one that is like no other.
PointCloud FloorWithThings() {
  PointCloud cloud = LevelFloor();
  cloud.label.assign(cloud.size(), kGroundClass);
  AddBlock({-3.0F, -3.0F, 0.0F}, {0.8F, 0.6F, 1.0F}, cloud);
  AddBlock({2.0F, -2.0F, 0.0F}, {0.8F, 0.6F, 1.0F}, cloud);
  AddBlock({-3.0F, 2.0F, 0.0F}, {1.6F, 0.4F, 0.5F}, cloud);
  AddBlock({1.0F, 2.0F, 0.0F}, {1.6F, 0.4F, 0.5F}, cloud);
  AddBlock({-0.5F, -0.5F, 0.0F}, {0.3F, 0.3F, 1.8F}, cloud);
  return cloud;
}

void PutThings(api::Database& db, const std::string& map = kMap) {
  const PointCloud cloud = FloorWithThings();
  STRATA_ASSERT_OK(UploadScan(db, map, FloorHeader({"run", 1}, cloud), cloud));
  AwaitIntegration(db, map);
  STRATA_ASSERT_OK(db.maps().SetClass({}, map, {kThingClass, "thing", {200, 90, 20}}));
}

NewKind Crate(float height) {
  NewKind kind{"crate", "thing", {}};
  PointCloud cloud;
  AddBlock({-0.4F, -0.3F, 0.0F}, {0.8F, 0.6F, height}, cloud);
  kind.shape.points = cloud.points;
  kind.shape.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  kind.shape.triangles = {{0, 1, 2}};
  return kind;
}

TEST_P(DatabaseSuite, ThingsAreSortedIntoKindsThatPeopleName) {
  EXPECT_THAT(*db().objects().ListKinds({}, kMap), IsEmpty());
  PutThings(db());
  const JobInfo job = FindKinds(db());
  EXPECT_EQ(job.metrics.at("kinds"), 2.0);
  EXPECT_THAT(job.message, HasSubstr("4 of 2 kinds"));
  STRATA_ASSERT_OK_AND_ASSIGN(const std::vector<KindInfo> found,
                              db().objects().ListKinds({}, kMap));
  ASSERT_THAT(found, SizeIs(2));
  for (const KindInfo& kind : found) {
    EXPECT_EQ(kind.origin, KindOrigin::kFound);
    EXPECT_EQ(kind.class_id, kThingClass);
    EXPECT_EQ(kind.entities, 2U);
    EXPECT_EQ(kind.name, "");
  }
  const std::vector<Entity> all = EntitiesWith(db());
  ASSERT_THAT(all, SizeIs(5));
  EXPECT_EQ(std::count_if(all.begin(), all.end(), [](const Entity& e) { return !e.kind; }), 1);

  const std::string id = KindIdText(found[0].id);
  STRATA_ASSERT_OK_AND_ASSIGN(const KindInfo named,
                              db().objects().RenameKind({}, kMap, id.substr(0, 8), "low.box"));
  EXPECT_EQ(named.id, found[0].id);
  EXPECT_EQ(named.origin, KindOrigin::kNamed);
  ASSERT_THAT(EntitiesWith(db(), {.kind = "low.box"}), SizeIs(2));
  EXPECT_EQ(EntitiesWith(db(), {.kind = "low.box"})[0].kind->name, "low.box");
  EXPECT_THAT(db().objects().RenameKind({}, kMap, KindIdText(found[1].id), "low.box"),
              StatusIs(Code::kAlreadyExists, HasSubstr("low.box")));
  EXPECT_THAT(db().objects().RenameKind({}, kMap, id, "no name"),
              StatusIs(Code::kInvalidArgument, HasSubstr("kind name")));
  // It keeps id and name over runs, restarts and rebuilds.
  Reopen();
  FindKinds(db());
  EXPECT_EQ(db().objects().ListKinds({}, kMap)->at(0).name, "low.box");
  ASSERT_THAT(EntitiesWith(db(), {.kind = "low.box"}), SizeIs(2));
  EXPECT_THAT(db().objects().DeleteKind({}, kMap, KindIdText(found[1].id)),
              StatusIs(Code::kFailedPrecondition, HasSubstr("no name")));
  STRATA_ASSERT_OK(db().objects().DeleteKind({}, kMap, "low.box"));
  EXPECT_THAT(db().objects().DeleteKind({}, kMap, "low.box"),
              StatusIs(Code::kNotFound, HasSubstr("low.box")));
  EXPECT_EQ(EntitiesWith(db()).size(), 5U);
  FindKinds(db());
  STRATA_ASSERT_OK_AND_ASSIGN(const std::vector<KindInfo> again,
                              db().objects().ListKinds({}, kMap));
  ASSERT_THAT(again, SizeIs(2));
  EXPECT_EQ(again[0].id, found[0].id);
  EXPECT_EQ(again[0].name, "");
}

TEST_P(DatabaseSuite, FoundKindsComeBackBitForBitAfterARebuild) {
  PutThings(db());
  FindKinds(db());
  const auto shapes = [&] {
    std::vector<KindShape> all;
    const std::vector<KindInfo> kinds = db().objects().ListKinds({}, kMap).value();
    for (const KindInfo& kind : kinds) {
      all.push_back(db().objects().GetKind({}, kMap, KindIdText(kind.id)).value().shape);
    }
    return all;
  };
  const std::vector<KindShape> before = shapes();
  const std::vector<Entity> entities = EntitiesWith(db());
  const JobInfo rebuild = EndOfJob(db(), "rebuild");
  EXPECT_EQ(rebuild.state, JobState::kSucceeded) << rebuild.message;
  EXPECT_THAT(*db().objects().ListKinds({}, kMap), IsEmpty());
  FindKinds(db());
  EXPECT_EQ(shapes(), before);
  const std::vector<Entity> after = EntitiesWith(db());
  ASSERT_EQ(after.size(), entities.size());
  for (std::size_t i = 0; i < after.size(); ++i) {
    ASSERT_EQ(after[i].kind.has_value(), entities[i].kind.has_value());
    if (!after[i].kind.has_value()) continue;
    EXPECT_EQ(after[i].kind->id, entities[i].kind->id);
    EXPECT_EQ(after[i].kind->T_map_kind.matrix(), entities[i].kind->T_map_kind.matrix());
    EXPECT_EQ(after[i].kind->residual_m, entities[i].kind->residual_m);
  }
}

TEST_P(DatabaseSuite, AnImportedKindIsRecognised) {
  PutThings(db());
  const NewKind crate = Crate(1.0F);
  STRATA_ASSERT_OK_AND_ASSIGN(const KindInfo info, db().objects().ImportKind({}, kMap, crate));
  EXPECT_EQ(info.class_id, kThingClass);
  EXPECT_EQ(info.points, crate.shape.points.size());
  EXPECT_EQ(info.triangles, 1U);
  EXPECT_THAT(db().objects().ImportKind({}, kMap, crate),
              StatusIs(Code::kAlreadyExists, HasSubstr("crate")));
  EXPECT_EQ(FindKinds(db()).metrics.at("kinds_found"), 1.0);
  const std::vector<Entity> crates = EntitiesWith(db(), {.kind = "crate"});
  ASSERT_THAT(crates, SizeIs(2));
  for (const Entity& entity : crates) {
    EXPECT_NEAR(entity.kind->T_map_kind.translation().z(), 0.0, 0.06);
    EXPECT_LT((entity.kind->T_map_kind.translation() - entity.box.centre).head<2>().norm(), 0.1);
    EXPECT_GT(entity.kind->overlap, 0.9);
  }
  STRATA_ASSERT_OK_AND_ASSIGN(const ThingKind read, db().objects().GetKind({}, kMap, "crate"));
  EXPECT_EQ(read.shape, crate.shape);
  EXPECT_EQ(read.info.entities, 2U);
  // In another map it has the same id.
  STRATA_ASSERT_OK(db().maps().Create({}, "other", {}));
  NewKind there{"box", "furniture", read.shape};
  STRATA_ASSERT_OK_AND_ASSIGN(const KindInfo other, db().objects().ImportKind({}, "other", there));
  EXPECT_EQ(other.id, info.id);
  EXPECT_EQ(db().maps().ListClasses({}, "other")->back().name, "furniture");
  const JobInfo verify = EndOfJob(db(), "verify");
  EXPECT_EQ(verify.state, JobState::kSucceeded) << verify.message;
}

TEST_P(DatabaseSuite, KindsThatCannotBeAreRefused) {
  const auto refused = [&](const NewKind& kind, const char* why) {
    EXPECT_THAT(db().objects().ImportKind({}, kMap, kind),
                StatusIs(Code::kInvalidArgument, HasSubstr(why)));
  };
  NewKind kind = Crate(1.0F);
  kind.shape.points[5].z() = std::numeric_limits<float>::quiet_NaN();
  refused(kind, "point 5");
  kind = Crate(1.0F);
  kind.shape.points[6].x() = 1e30F;
  refused(kind, "point 6");
  kind = Crate(1.0F);
  kind.shape.points.resize(kMaxKindPoints + 1, Eigen::Vector3f::Zero());
  refused(kind, "points");
  kind = Crate(1.0F);
  kind.name = std::string(101, 'a');
  refused(kind, "kind name");
  kind = Crate(1.0F);
  kind.class_name = "";
  refused(kind, "class name");
  EXPECT_THAT(db().objects().GetKind({}, kMap, "none"),
              StatusIs(Code::kNotFound, HasSubstr("kind list")));
  EXPECT_THAT(db().objects().ListKinds({}, "none"), StatusIs(Code::kNotFound, HasSubstr("none")));
  EXPECT_THAT(*db().objects().ListKinds({}, kMap), IsEmpty());
}

// Whatever a person does to the library while things are sorted stays done, and the job succeeds.
TEST_P(DatabaseSuite, AJobNeitherLosesNorUndoesWhatAPersonDoesMeanwhile) {
  PutThings(db());
  FindKinds(db());
  const std::vector<KindInfo> found = db().objects().ListKinds({}, kMap).value();
  ASSERT_THAT(found, SizeIs(2));
  for (int round = 0; round < 6; ++round) {
    const auto job = db().jobs().Start({}, kMap, "objects", {{"class", "thing"}});
    STRATA_ASSERT_OK(job);
    NewKind kind = Crate(1.0F);
    PointCloud cube;  // that nothing there is a part of
    AddBlock({-1.2F, -1.2F, 0.0F}, {2.4F, 2.4F, 2.0F + 0.1F * static_cast<float>(round)}, cube);
    kind.shape.points = cube.points;
    kind.name = "cube" + std::to_string(round);
    int calls = 0;
    JobInfo last;
    // Each report of the job is answered by a change.
    STRATA_ASSERT_OK(db().jobs().Watch({}, kMap, job->id, [&](const JobInfo& now) {
      last = now;
      if (calls == 0) {
        STRATA_EXPECT_OK(db().objects().ImportKind({}, kMap, kind));
      }
      if (calls == 1) {
        STRATA_EXPECT_OK(db().objects().RenameKind({}, kMap, kind.name, "t"));
      }
      if (calls == 2) {
        STRATA_EXPECT_OK(db().objects().DeleteKind({}, kMap, "t"));
      }
      ++calls;
      return absl::OkStatus();
    }));
    EXPECT_EQ(last.state, JobState::kSucceeded) << last.message;
    const std::string name = calls == 1 ? kind.name : "t";
    EXPECT_EQ(db().objects().GetKind({}, kMap, name).ok(), calls < 3) << calls;
    if (calls < 3) {
      STRATA_EXPECT_OK(db().objects().DeleteKind({}, kMap, name));
    }
    if (round == 2) {
      STRATA_EXPECT_OK(db().objects().RenameKind({}, kMap, KindIdText(found[0].id), "low.box"));
    }
  }
  ASSERT_THAT(EntitiesWith(db(), {.kind = "low.box"}), SizeIs(2));
  EXPECT_THAT(db().objects().ListKinds({}, kMap).value(), SizeIs(2));
}

TEST_P(DatabaseSuite, WhatNobodySawIsInferredFromOthersOfTheKind) {
  EXPECT_THAT(InferredOf(db()), StatusIs(Code::kNotFound, HasSubstr("objects complete")));
  EXPECT_THAT(EndOfJob(db(), "complete").message, HasSubstr("objects find"));
  PutWholeAndHalf(db());
  FindKinds(db());
  const std::vector<Entity> things = EntitiesWith(db());
  ASSERT_THAT(things, SizeIs(2));
  ASSERT_TRUE(things[0].kind.has_value() && things[1].kind.has_value());
  const JobInfo job = EndOfJob(db(), "complete");
  ASSERT_EQ(job.state, JobState::kSucceeded) << job.message;
  EXPECT_EQ(job.metrics.at("entities"), 2.0);
  EXPECT_EQ(job.metrics.at("kinds"), 1.0);
  EXPECT_EQ(job.metrics.at("contradicted"), 0.0) << job.message;
  STRATA_ASSERT_OK_AND_ASSIGN(const std::vector<InferredPart> parts, InferredOf(db()));
  ASSERT_THAT(parts, SizeIs(2));
  EXPECT_EQ(parts[1].entity, things[1].id);
  EXPECT_EQ(parts[1].kind, things[1].kind->id);
  EXPECT_GT(parts[1].points.size(), 200U);
  EXPECT_LT(parts[0].points.size(), parts[1].points.size() / 5);
  const Eigen::AlignedBox3d block(kHalfLow.cast<double>(), (kHalfLow + kHalfSize).cast<double>());
  for (const Eigen::Vector3d& p : parts[1].points) {
    EXPECT_GT(p.x(), 2.45);
    EXPECT_LT(block.exteriorDistance(p), 0.06) << p.transpose();
    EXPECT_LT(std::min((p - block.min()).minCoeff(), (block.max() - p).minCoeff()), 0.1);
  }
  Reopen();
  EXPECT_EQ(InferredOf(db()).value(), parts);
  EXPECT_EQ(EndOfJob(db(), "complete").metrics.at("points"), job.metrics.at("points"));
  EXPECT_EQ(InferredOf(db()).value(), parts);
  const Eigen::AlignedBox3d east(Eigen::Vector3d(1, -3, 0), Eigen::Vector3d(3, 3, 3));
  EXPECT_THAT(InferredOf(db(), {.region = east}).value(), SizeIs(1));
  // Coarser where one says so, and of one kind.
  const std::string kind = KindIdText(parts[0].kind);
  EXPECT_LT(EndOfJob(db(), "complete", {{"voxel_m", "0.1"}, {"kind", kind}}).metrics.at("points"),
            job.metrics.at("points"));
}

TEST_P(DatabaseSuite, WhatWasInferredGoesWithTheScansItIsFrom) {
  PutWholeAndHalf(db());
  FindKinds(db());
  ASSERT_EQ(EndOfJob(db(), "complete").state, JobState::kSucceeded);
  STRATA_ASSERT_OK(db().scans().Delete({}, kMap, {"run", 1}));
  EXPECT_THAT(InferredOf(db()).value(), IsEmpty());
  // The next entities are others.
  FindKinds(db());
  EXPECT_THAT(InferredOf(db()), StatusIs(Code::kNotFound, HasSubstr("objects complete")));
  const JobInfo alone = EndOfJob(db(), "complete");
  EXPECT_EQ(alone.state, JobState::kFailed);
  EXPECT_THAT(alone.message, HasSubstr("no entity has a kind"));
  EXPECT_THAT(db().objects().ListInferred(
                  {}, "none", {}, [](const InferredPart&) { return absl::OkStatus(); }),
              StatusIs(Code::kNotFound, HasSubstr("none")));
}

TEST_P(DatabaseSuite, ALibraryHasABound) {
  NewKind kind = Crate(1.0F);
  kind.shape.points.resize(kMinKindPoints);
  kind.shape.vertices.clear();
  kind.shape.triangles.clear();
  for (std::size_t i = 0; i < kMaxKinds; ++i) {
    kind.name = "kind" + std::to_string(i);
    kind.shape.points[0].x() = static_cast<float>(i) * 0.01F;
    STRATA_ASSERT_OK(db().objects().ImportKind({}, kMap, kind));
  }
  kind.name = "more";
  kind.shape.points[0].x() = 50.0F;
  EXPECT_THAT(db().objects().ImportKind({}, kMap, kind),
              StatusIs(Code::kResourceExhausted, HasSubstr("at most 256")));
}

}  // namespace
}  // namespace strata::testing
