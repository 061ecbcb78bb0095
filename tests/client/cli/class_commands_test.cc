// What commands show and ask of classes, in this process on a database that the test decides on.
#include <algorithm>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/formats/scan_reader.h"
#include "core/codec/surface_tile_codec.h"
#include "tests/client/cli/commands_fixture.h"
#include "tests/support/mock_database.h"
#include "tests/support/status_matchers.h"
#include "tests/support/temp_dir.h"

namespace strata::cli {
namespace {

using ::strata::testing::IsOk;
using ::strata::testing::StatusIs;
using ::testing::_;
using ::testing::Field;
using ::testing::HasSubstr;
using ::testing::Return;
using Code = absl::StatusCode;

const MapClass kVegetation{3, "vegetation", {10, 200, 20}};

// A hundred cells of class 3 and a hundred of 9, which no table names.
SurfaceTile TwoFields() {
  SurfaceTile tile;
  for (std::uint16_t cell = 0; cell < 200; ++cell) {
    tile.surfaces.push_back({.cell = cell,
                             .class_id = static_cast<std::uint8_t>(cell < 100 ? 3 : 9),
                             .sigma_m = 0.01F});
  }
  tile.IndexRows();
  return tile;
}

class ClassCommandsTest : public CommandsTest {
 protected:
  ClassCommandsTest() {
    ON_CALL(db_.maps(), ListClasses(_, _))
        .WillByDefault(Return(std::vector<MapClass>{kVegetation, {4, "water", {}}}));
    ON_CALL(db_.maps(), Get(_, _)).WillByDefault(Return(MapInfo()));
    ON_CALL(db_.maps(), Stats(_, _)).WillByDefault(Return(MapStats()));
    ON_CALL(db_.planning(), ListProfiles(_, _))
        .WillByDefault(Return(
            ::strata::testing::Profiles{{std::string(api::kDefaultProfile), RobotProfile()}}));
    ON_CALL(db_.planning(), PlanPath(_, _, _)).WillByDefault(Return(PlanResult()));
    ON_CALL(db_.tiles(), Fetch(_, _, _, _, _))
        .WillByDefault([](auto&, auto, auto&, auto&, const auto& sink) {
          api::TileUpdate update;
          update.tile.bytes = EncodeSurfaceTile(TwoFields()).value();
          return sink(update);
        });
  }
  absl::Status Plan(std::vector<std::string> avoid) {
    std::vector<std::string> words = {"plan", "m", "--from", "0,0", "--to", "1,0"};
    words.insert(words.end(), avoid.begin(), avoid.end());
    return Run(words);
  }
  std::string Path(const std::string& name) const { return (dir_.path() / name).string(); }

  testing::TempDir dir_;
};

TEST_F(ClassCommandsTest, PlanAvoidsClassesByNameOrId) {
  const ClassCosts costs = {{3, 5.0}, {4, kForbiddenClass}, {77, 1.5}};
  EXPECT_CALL(db_.planning(), PlanPath(_, _, Field(&PlanQuery::class_costs, costs)));
  EXPECT_THAT(Plan({"--avoid", "vegetation=5", "--avoid", "water=never", "--avoid", "77=1.5"}),
              IsOk());
  EXPECT_CALL(db_.planning(), PlanPath(_, _, Field(&PlanQuery::class_costs, ClassCosts())));
  EXPECT_THAT(Plan({}), IsOk());
}

TEST_F(ClassCommandsTest, PlanNamesWhatItCannotAvoid) {
  EXPECT_CALL(db_.planning(), PlanPath(_, _, _)).Times(0);
  EXPECT_THAT(Plan({"--avoid", "lava=5"}), StatusIs(Code::kNotFound, HasSubstr("vegetation")));
  for (const char* bad : {"water", "water=", "water=much"}) {
    EXPECT_THAT(Plan({"--avoid", bad}),
                StatusIs(Code::kInvalidArgument, HasSubstr("CLASS=FACTOR or CLASS=never")));
  }
  for (const char* bad : {"water=0.5", "water=101", "water=nan"}) {
    EXPECT_THAT(Plan({"--avoid", bad}), StatusIs(Code::kInvalidArgument, HasSubstr("of class 4")));
  }
}

TEST_F(ClassCommandsTest, SurfacesSayWhatTheMapCallsTheirClass) {
  const SurfaceColumn column{
      1.0, 2.0, {{.class_id = 3, .confidence = 87}, {.class_id = 9, .z_m = 1.0F}, {.z_m = 2.0F}}};
  ON_CALL(db_.planning(), SampleSurfaces(_, _, _))
      .WillByDefault(Return(std::vector<SurfaceColumn>{column}));
  EXPECT_THAT(Run({"surface", "m", "--at", "1,2"}), IsOk());
  const Json surfaces = Json::parse(data_.str())["surfaces"];
  EXPECT_EQ(surfaces[0]["class"], 3);
  EXPECT_EQ(surfaces[0]["class_name"], "vegetation");
  EXPECT_EQ(surfaces[1]["class_name"], "9");
  EXPECT_TRUE(surfaces[2]["class_name"].is_null());
  EXPECT_EQ(surfaces[0]["confidence"], 0.87);
  EXPECT_TRUE(surfaces[2]["confidence"].is_null());
  EXPECT_THAT(Run({"surface", "m", "--at", "1,2"}, OutputFormat::kText), IsOk());
  EXPECT_THAT(data_.str(), HasSubstr("vegetation"));
}

TEST_F(ClassCommandsTest, RenderDrawsClassesInTheMapsColours) {
  EXPECT_THAT(Run({"map", "render", "m", Path("class.png"), "--layer", "class"}), IsOk());
  const Json classes = Json::parse(data_.str())["classes"];
  ASSERT_EQ(classes.size(), 2U);
  EXPECT_EQ(classes[0]["name"], "vegetation");
  EXPECT_EQ(classes[0]["colour"], "#0ac814");
  EXPECT_EQ(classes[1]["name"], "9");
  EXPECT_THAT(Run({"map", "render", "m", Path("plain.png")}), IsOk());
  EXPECT_TRUE(Json::parse(data_.str())["classes"].empty());
}

TEST_F(ClassCommandsTest, AnExportedMeshCarriesTheClass) {
  EXPECT_THAT(Run({"map", "export", "m", "--format", "ply", "--out", Path("map.ply")}), IsOk());
  STRATA_ASSERT_OK_AND_ASSIGN(const PointCloud mesh, ReadScan(Path("map.ply")));
  ASSERT_EQ(mesh.label.size(), 200U);
  EXPECT_EQ(std::count(mesh.label.begin(), mesh.label.end(), 3), 100);
  EXPECT_EQ(std::count(mesh.label.begin(), mesh.label.end(), 9), 100);
}

}  // namespace
}  // namespace strata::cli
