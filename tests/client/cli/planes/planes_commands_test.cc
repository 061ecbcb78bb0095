// strata planes and map floorplan, on a database that the test decides on.
#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/client/cli/commands_fixture.h"
#include "tests/support/simulator/plane_room.h"
#include "tests/support/status_matchers.h"
#include "tests/support/temp_dir.h"

namespace strata::cli {
namespace {

using ::strata::testing::StatusIs;
using ::testing::_;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::Return;
using Code = absl::StatusCode;

class PlanesCommandsTest : public CommandsTest {};

TEST_F(PlanesCommandsTest, PlanesAreListedWithTheirSupporters) {
  api::PoseGraphState state;
  GlobalPlane wall;
  wall.id = 12;
  wall.plane = {Eigen::Vector3d::UnitX(), 4.0};
  wall.supports = {{{"a", 1}, 2.5, 0.01}, {{"b", 7}, 1.0, 0.02}};
  state.planes = {wall};
  ON_CALL(db_.posegraph(), Get(_, _)).WillByDefault(Return(state));
  const Json planes = RunJson({"planes", "list", "m"});
  ASSERT_EQ(planes.size(), 1U);
  EXPECT_EQ(planes[0]["id"], 12);
  EXPECT_EQ(planes[0]["kind"], "wall");
  EXPECT_EQ(planes[0]["weight"], 3.5);
  EXPECT_EQ(planes[0]["supporters"], 2);
  EXPECT_EQ(planes[0]["supports"][1]["scan"], "b/7");
  const std::string table = RunText({"planes", "list", "m"});
  EXPECT_THAT(table, HasSubstr("wall"));
  EXPECT_THAT(table, Not(HasSubstr("b/7")));
}

TEST_F(PlanesCommandsTest, PlanesOfAMapAreShownExportedAndDrawn) {
  PlaneModel room = ::strata::testing::DrawnRoom();
  room.planes[1].colour = Colour{160, 45, 40};
  ON_CALL(db_.models(), GetPlaneModel(_, _, _)).WillByDefault([&](auto&, auto, auto sink) {
    for (const ModelPlane& plane : room.planes) STRATA_EXPECT_OK(sink(plane));
    PlaneModelInfo info;
    info.job = 4;
    info.epoch = 2;
    info.scans = 34;
    info.planes = room.planes.size();
    info.directions = {{Eigen::Vector3d::UnitZ(), 2, 0.01}};
    return absl::StatusOr<PlaneModelInfo>(info);
  });
  std::uint64_t now = 2;
  ON_CALL(db_.maps(), History(_, _)).WillByDefault([&](auto&, auto) {
    EpochInfo epoch;
    epoch.epoch = now;
    epoch.current = true;
    return absl::StatusOr<std::vector<EpochInfo>>({epoch});
  });
  std::uint64_t scans = 34;
  ON_CALL(db_.maps(), Stats(_, _)).WillByDefault([&](auto&, auto) {
    MapStats stats;
    stats.scans = scans;
    return absl::StatusOr<MapStats>(stats);
  });
  ON_CALL(db_.maps(), Get(_, _)).WillByDefault([](auto&, auto) {
    return absl::StatusOr<MapInfo>(MapInfo());
  });
  ON_CALL(db_.planning(), ListProfiles(_, _)).WillByDefault([](auto&, auto) {
    return absl::StatusOr<std::map<std::string, RobotProfile>>({{"default", RobotProfile()}});
  });
  ON_CALL(db_.planning(), ListFloors(_, _, _)).WillByDefault([](auto&, auto, auto&) {
    return absl::StatusOr<FloorPlan>(FloorPlan());
  });
  const std::string text = RunText({"planes", "model", "m"});
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 1 + 6 + 1) << text;
  EXPECT_THAT(text, HasSubstr("direction 0: 0.0000 0.0000 1.0000, 2 planes"));
  EXPECT_EQ(RunJson({"planes", "model", "m"})["stale"], false);
  scans = 29;  // five were deleted
  EXPECT_EQ(RunJson({"planes", "model", "m"})["stale"], true);
  EXPECT_THAT(talk_.str(), HasSubstr("of 34 scans, the map has 29"));
  scans = 34;
  now = 3;
  const auto model = RunJson({"planes", "model", "m"});
  EXPECT_EQ(model["stale"], true);
  EXPECT_EQ(model["planes"].size(), 6U);
  EXPECT_EQ(model["planes"][2]["polygons"][0]["holes"][0]["seen_open"], true);
  EXPECT_EQ(model["planes"][1]["colour"], "#a02d28");
  EXPECT_TRUE(model["planes"][2]["colour"].is_null());
  const ::strata::testing::TempDir folder;
  const std::string out = folder.path() / "room";
  EXPECT_EQ(RunJson({"planes", "export", "m", out + ".dxf"})["planes"], 6);
  EXPECT_TRUE(std::filesystem::exists(out + ".dxf"));
  EXPECT_THAT(Run({"planes", "export", "m", out + ".txt"}),
              StatusIs(Code::kInvalidArgument, HasSubstr("geojson")));
  const auto drawn = RunJson({"map", "floorplan", "m", out + ".svg", "--storey", "0"});
  EXPECT_GE(drawn["walls"], 4);
  EXPECT_EQ(drawn["high"][0], 4.0);
  EXPECT_TRUE(std::filesystem::exists(out + ".svg"));
  EXPECT_THAT(Run({"map", "floorplan", "m", out + ".svg", "--storey", "50"}),
              StatusIs(Code::kNotFound, _));
}

// What is written says that it has nothing; a plan of nothing is refused.
TEST_F(PlanesCommandsTest, AModelWithoutPlanesIsWrittenAsOne) {
  ON_CALL(db_.models(), GetPlaneModel(_, _, _)).WillByDefault([](auto&, auto, auto) {
    return absl::StatusOr<PlaneModelInfo>(PlaneModelInfo());
  });
  ON_CALL(db_.maps(), History(_, _)).WillByDefault([](auto&, auto) {
    return absl::StatusOr<std::vector<EpochInfo>>(std::vector<EpochInfo>());
  });
  ON_CALL(db_.maps(), Get(_, _)).WillByDefault([](auto&, auto) {
    return absl::StatusOr<MapInfo>(MapInfo());
  });
  ON_CALL(db_.planning(), ListProfiles(_, _)).WillByDefault([](auto&, auto) {
    return absl::StatusOr<std::map<std::string, RobotProfile>>({{"default", RobotProfile()}});
  });
  ON_CALL(db_.planning(), ListFloors(_, _, _)).WillByDefault([](auto&, auto, auto&) {
    return absl::StatusOr<FloorPlan>(FloorPlan());
  });
  EXPECT_TRUE(RunJson({"planes", "model", "m"})["planes"].empty());
  const ::strata::testing::TempDir folder;
  for (const char* ending : {"dxf", "geojson", "glb", "ply", "obj"}) {
    const std::string out = folder.path() / (std::string("none.") + ending);
    EXPECT_EQ(RunJson({"planes", "export", "m", out})["planes"], 0) << ending;
    EXPECT_TRUE(std::filesystem::exists(out)) << ending;
  }
  const std::string plan = folder.path() / "none.svg";
  EXPECT_THAT(Run({"map", "floorplan", "m", plan, "--storey", "0"}),
              StatusIs(Code::kNotFound, HasSubstr("the model has no floors")));
  EXPECT_FALSE(std::filesystem::exists(plan));
}

}  // namespace
}  // namespace strata::cli
