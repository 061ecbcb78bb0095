// strata objects, on a database that the test decides on.
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/formats/file_bytes.h"
#include "tests/client/cli/commands_fixture.h"
#include "tests/support/status_matchers.h"
#include "tests/support/temp_dir.h"

namespace strata::cli {
namespace {

using ::strata::testing::StatusIs;
using ::testing::_;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using Code = absl::StatusCode;

class ObjectsCommandsTest : public CommandsTest {
 protected:
  void SetUp() override {
    Entity car;
    car.id = 1;
    car.class_id = 7;
    car.box = {{10.0, 20.0, 0.75}, {4.0, 2.0, 1.5}, 0.0};
    car.points = 345;
    car.scans = {{{"run", 1}, 300}, {{"run", 4}, 45}};
    Entity bench = car;
    bench.id = 2;
    car.kind = EntityKind{0xabcdef012345, "golf", Pose::Identity(), 0.02, 0.9};
    bench.class_id = 9;
    entities_ = {car, bench};
    ON_CALL(db_.objects(), ListEntities(_, _, _, _))
        .WillByDefault([&](auto&, auto, const EntityQuery& query, auto sink) {
          for (const Entity& entity : entities_) {
            if (!query.Takes(entity)) continue;
            STRATA_EXPECT_OK(sink(entity));
          }
          EntitiesInfo info;
          info.job = 4;
          info.epoch = 2;
          info.entities = 2;
          info.reaches = {{7, 0.4}};
          return absl::StatusOr<EntitiesInfo>(info);
        });
    ON_CALL(db_.maps(), ListClasses(_, _)).WillByDefault([](auto&, auto) {
      return absl::StatusOr<std::vector<MapClass>>({{7, "car", {200, 0, 0}}});
    });
    ON_CALL(db_.maps(), History(_, _)).WillByDefault([&](auto&, auto) {
      EpochInfo epoch;
      epoch.epoch = now_;
      epoch.current = true;
      return absl::StatusOr<std::vector<EpochInfo>>({epoch});
    });
    ON_CALL(db_.maps(), Get(_, _)).WillByDefault([](auto&, auto) {
      return absl::StatusOr<MapInfo>(MapInfo());
    });
  }

  std::vector<Entity> entities_;
  std::uint64_t now_ = 2;
};

TEST_F(ObjectsCommandsTest, AreListedAndShown) {
  const Json all = RunJson({"objects", "list", "m"});
  ASSERT_EQ(all["entities"].size(), 2U);
  EXPECT_EQ(all["entities"][0]["class"], "car");
  EXPECT_EQ(all["entities"][0]["size_m"], Json({4.0, 2.0, 1.5}));
  EXPECT_EQ(all["entities"][0]["scans"]["run/4"], 45);
  EXPECT_EQ(all["entities"][1]["class"], "9");
  EXPECT_EQ(all["entities"][0]["kind"]["name"], "golf");
  EXPECT_EQ(all["entities"][0]["kind"]["id"], "abcdef012345");
  EXPECT_TRUE(all["entities"][1]["kind"].is_null());
  EXPECT_THAT(RunText({"objects", "list", "m"}), HasSubstr("golf"));
  EXPECT_EQ(all["distance_m"]["car"], 0.4);
  EXPECT_EQ(all["stale"], false);
  now_ = 3;
  EXPECT_EQ(RunJson({"objects", "list", "m", "--class", "car"})["entities"].size(), 1U);
  EXPECT_THAT(talk_.str(), HasSubstr("the map is at 3"));
  EXPECT_EQ(RunJson({"objects", "list", "m", "--region", "100,0,101,1"})["entities"].size(), 0U);
  EXPECT_THAT(RunText({"objects", "list", "m"}), HasSubstr("car"));
  const Json car = RunJson({"objects", "show", "m", "1"});
  EXPECT_EQ(car["base"].size(), 4U);
  EXPECT_EQ(car["base"][0], Json({8.0, 19.0, 0.0}));
  EXPECT_THAT(Run({"objects", "show", "m", "77"}),
              StatusIs(Code::kNotFound, HasSubstr("objects list")));
  EXPECT_THAT(Run({"objects", "list", "m", "--class", "zeppelin"}),
              StatusIs(Code::kNotFound, HasSubstr("car")));
}

TEST_F(ObjectsCommandsTest, AreExported) {
  const ::strata::testing::TempDir directory;
  const std::string out = (directory.path() / "things").string();
  EXPECT_EQ(RunJson({"objects", "export", "m", out + ".geojson"})["entities"], 2);
  STRATA_ASSERT_OK_AND_ASSIGN(const std::string text, ReadFileBytes(out + ".geojson"));
  const Json features = Json::parse(text);
  EXPECT_EQ(features["frame"], "map [m]");
  EXPECT_EQ(features["features"][0]["geometry"]["coordinates"][0].size(), 5U);
  EXPECT_EQ(features["features"][0]["properties"]["class"], "car");
  EXPECT_EQ(RunJson({"objects", "export", "m", out + ".csv", "--class", "7"})["entities"], 1);
  STRATA_ASSERT_OK_AND_ASSIGN(const std::string csv, ReadFileBytes(out + ".csv"));
  EXPECT_THAT(csv, HasSubstr("1,car,10.000,20.000,0.750,4.000,2.000,1.500,0.0000,345,2,golf\n"));
  EXPECT_THAT(Run({"objects", "export", "m", out + ".txt"}),
              StatusIs(Code::kInvalidArgument, HasSubstr("map render --objects")));
}

TEST_F(ObjectsCommandsTest, WhatWasInferredIsWritten) {
  ON_CALL(db_.objects(), ListInferred(_, _, _, _))
      .WillByDefault([&](auto&, auto, const EntityQuery& query, auto sink) {
        EXPECT_EQ(query.class_id, 7);
        STRATA_EXPECT_OK(sink(InferredPart{1, 0xabcdef012345, 40, 2, {{1, 2, 3}, {4, 5, 6}}}));
        InferredInfo info;
        info.epoch = 2;
        return absl::StatusOr<InferredInfo>(info);
      });
  const ::strata::testing::TempDir directory;
  const std::string out = (directory.path() / "hidden").string();
  const auto write = [&](const std::string& ending) {
    return std::vector<std::string>{
        "objects", "export", "m", out + ending, "--inferred", "--class", "car"};
  };
  const Json ply = RunJson(write(".ply"));
  EXPECT_EQ(ply["points"], 2);
  EXPECT_EQ(ply["stale"], false);
  EXPECT_EQ(ply["parts"][0]["kind"], "abcdef012345");
  EXPECT_EQ(ply["parts"][0]["agreeing"], 40);
  EXPECT_EQ(ply["entities"], 1);
  EXPECT_THAT(RunText(write(".ply")), AllOf(HasSubstr("entities"), Not(HasSubstr("agreeing"))));
  STRATA_ASSERT_OK_AND_ASSIGN(const std::string text, ReadFileBytes(out + ".ply"));
  EXPECT_THAT(text, HasSubstr("element vertex 2"));
  now_ = 3;
  EXPECT_EQ(RunJson(write(".pcd"))["stale"], true);
  EXPECT_THAT(talk_.str(), HasSubstr("objects complete"));
  EXPECT_THAT(Run(write(".geojson")),
              StatusIs(Code::kInvalidArgument, HasSubstr("map render --inferred")));
}

}  // namespace
}  // namespace strata::cli
