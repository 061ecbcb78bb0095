// strata map, on a database that the test decides on.
#include <cmath>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/cli/terminal/command.h"
#include "tests/client/cli/commands_fixture.h"
#include "tests/support/mock_database.h"
#include "tests/support/status_matchers.h"
#include "tests/support/temp_dir.h"

namespace strata::cli {
namespace {

using ::strata::testing::IsOk;
using ::strata::testing::StatusIs;
using ::testing::_;
using ::testing::Each;
using ::testing::HasSubstr;
using ::testing::Return;
using ::testing::SizeIs;
using Code = absl::StatusCode;

class MapCommandsTest : public CommandsTest {};

TEST_F(MapCommandsTest, TheOriginOfAMapIsInDegrees) {
  MapParameters created;
  ON_CALL(db_.maps(), Create(_, _, _))
      .WillByDefault([&](auto&, auto name, const MapParameters& parameters) {
        created = parameters;
        return absl::StatusOr<MapInfo>(MapInfo{std::string(name), parameters, {}});
      });
  EXPECT_THAT(Run({"map", "create", "m", "--origin", "45,-90,34"}), IsOk());
  ASSERT_TRUE(created.origin.has_value());
  EXPECT_NEAR(created.origin->latitude_rad, std::acos(std::sqrt(0.5)), 1e-12);
  EXPECT_NEAR(created.origin->longitude_rad, std::asin(-1.0), 1e-12);
  EXPECT_EQ(created.origin->altitude_m, 34.0);
}

TEST_F(MapCommandsTest, FloorsAreToldWithTheWaysBetweenThem) {
  ON_CALL(db_.planning(), ListProfiles(_, _)).WillByDefault([](auto&, auto) {
    return absl::StatusOr<std::map<std::string, RobotProfile>>({{"default", RobotProfile()}});
  });
  FloorPlan plan;
  ON_CALL(db_.planning(), ListFloors(_, _, _)).WillByDefault([&](auto&, auto, auto&) {
    return absl::StatusOr<FloorPlan>(plan);
  });
  EXPECT_THAT(RunText({"map", "floors", "m"}), HasSubstr("no floor"));
  EXPECT_TRUE(RunJson({"map", "floors", "m"})["floors"].empty());
  EXPECT_THAT(Run({"map", "floors", "m", "--at", "0,0,0"}), StatusIs(Code::kNotFound, _));
  EXPECT_THAT(Run({"map", "floors", "m", "--profile", "giant"}), StatusIs(Code::kNotFound, _));
  EXPECT_THAT(Run({"map", "export", "m", "--format", "nav2", "--floor", "2", "--out", "x"}),
              StatusIs(Code::kNotFound, HasSubstr("no floor")));
  EXPECT_THAT(Run({"map", "export", "m", "--format", "ply", "--floor", "2", "--out", "x"}),
              StatusIs(Code::kInvalidArgument, HasSubstr("nav2")));
  plan.floors.resize(2);
  plan.floors[1].area_m2 = 12.5;
  plan.links.push_back({0, 1, {1.0, 2.0, 3.0}, 4.0, 0.25});
  plan.at = 1;
  const auto json = RunJson({"map", "floors", "m", "--at", "0,0,0"});
  EXPECT_EQ(json["floors"][1]["area_m2"], 12.5);
  EXPECT_EQ(json["links"][0]["floors"][1], 1);
  EXPECT_EQ(json["links"][0]["slope_rad"], 0.25);
  EXPECT_EQ(json["at"], 1);
}

TEST_F(MapCommandsTest, TheHistoryIsATableAndAnEpochIsBroughtBackByAJob) {
  EpochInfo first;
  first.epoch = 1;
  first.created = absl::UnixEpoch();
  first.reason = "created";
  EpochInfo second = first;
  second.epoch = 2;
  second.job = 5;
  second.current = true;
  ON_CALL(db_.maps(), History(_, _)).WillByDefault(Return(std::vector<EpochInfo>{second, first}));
  const Json epochs = RunJson({"map", "history", "m"});
  EXPECT_EQ(epochs[0]["job"], 5);
  EXPECT_TRUE(epochs[0]["current"].get<bool>());
  EXPECT_TRUE(epochs[1]["job"].is_null());
  EXPECT_THAT(RunText({"map", "history", "m"}), HasSubstr("created"));
  const ::strata::testing::StringMap epoch = {{"epoch", "1"}};
  EXPECT_CALL(db_.jobs(), Start(_, absl::string_view("m"), absl::string_view("revert"), epoch))
      .WillOnce(Return(Job(9, JobState::kQueued)));
  EXPECT_EQ(RunJson({"map", "revert", "m", "1"})["id"], 9);
  EXPECT_THROW(Run({"map", "revert", "m", "0"}).IgnoreError(), CLI::ParseError);
}

TEST_F(MapCommandsTest, AWatcherReadsALineAChange) {
  ON_CALL(db_.maps(), Watch(_, _, _, _))
      .WillByDefault([](auto&, auto, const api::WatchOptions& options, auto sink) {
        EXPECT_EQ(options.since, 811U);
        EXPECT_EQ(options.trajectory, "run");
        EXPECT_TRUE(options.once);
        api::MapUpdate update;
        update.commit_sequence = 812;
        update.epoch = 3;
        update.epoch_reason = "job 7";
        Pose pose = Pose::Identity();
        pose.translation().x() = 1.5;
        update.scans = {{{"run", 4}, ScanState::kIntegrated, pose, false},
                        {{"run", 5}, ScanState::kPending, pose, true}};
        if (options.tiles) update.tiles = {{{0, 1, -2}, 812, false}, {{0, 1, -3}, 812, true}};
        return sink(update);
      });
  const std::vector<std::string> words = {
      "map", "watch", "m", "--since", "811", "--trajectory", "run", "--once"};
  EXPECT_EQ(RunText(words),
            "commit 812 epoch 3 job 7\n"
            "  scan run/4 integrated at 1.500, 0.000, 0.000\n"
            "  scan run/5 deleted\n"
            "  tile 0/1/-2 version 812\n"
            "  tile 0/1/-3 gone\n");
  std::vector<std::string> no_tiles = words;
  no_tiles.emplace_back("--no-tiles");
  const Json update = RunJson(no_tiles);
  EXPECT_EQ(update["commit_sequence"], 812);
  EXPECT_EQ(update["scans"][0]["pose"][0], 1.5);
  EXPECT_EQ(update["scans"][1]["gone"], true);
  EXPECT_TRUE(update["tiles"].empty());
}

TEST_F(MapCommandsTest, AnEndedWatchSaysWhereItGoesOn) {
  const auto after_one = [this](const absl::Status& end, bool stop) {
    ON_CALL(db_.maps(), Watch(_, _, _, _))
        .WillByDefault([end, stop](const api::Call& call, auto, auto&, auto sink) {
          api::MapUpdate update;
          update.commit_sequence = 40;
          EXPECT_THAT(sink(update), IsOk());
          if (stop) call.stop.Request();
          return end;
        });
    return Run({"map", "watch", "m"});
  };
  EXPECT_THAT(after_one(absl::CancelledError("stopped"), true), IsOk());
  EXPECT_THAT(talk_.str(), HasSubstr("--since 40"));
  EXPECT_THAT(after_one(absl::NotFoundError("deleted"), false), StatusIs(Code::kNotFound, _));
  EXPECT_THAT(talk_.str(), HasSubstr("--since 40"));
}

TEST_F(MapCommandsTest, AMapSaysHowWellItsScansAndLoopsAgree) {
  ON_CALL(db_.maps(), Get(_, _)).WillByDefault(Return(MapInfo()));
  ON_CALL(db_.maps(), Stats(_, _)).WillByDefault(Return(MapStats()));
  absl::Status listed;
  ON_CALL(db_.scans(), List(_, _, _, _))
      .WillByDefault([&listed](auto&, auto, auto&, auto sink) -> absl::Status {
        for (const double overlap : {0.5, 0.8, 0.9}) {
          ScanInfo scan;
          scan.state = ScanState::kIntegrated;
          scan.alignment.aligned = overlap > 0.6;
          scan.alignment.overlap = overlap;
          EXPECT_THAT(sink(scan), IsOk());
          scan.alignment = {};
          scan.alignment.message = "optimize, job 7";
          EXPECT_THAT(sink(scan), IsOk());
          scan.state = ScanState::kPending;  // says nothing yet
          EXPECT_THAT(sink(scan), IsOk());
        }
        return listed;
      });
  api::PoseGraphState state;
  state.nodes = {Node({"a", 1}, 0.0), Node({"a", 2}, 1.5)};
  const auto add = [&state](double x_m, ConstraintOrigin origin, bool enabled) {
    Constraint constraint;
    constraint.i = {"a", 1};
    constraint.j = {"a", 2};
    constraint.T_i_j = Pose(Eigen::Translation3d(x_m, 0.0, 0.0));
    constraint.origin = origin;
    constraint.enabled = enabled;
    state.constraints.push_back(constraint);
  };
  add(1.5, ConstraintOrigin::kIngest, true);  // no loop
  add(1.4, ConstraintOrigin::kOptimize, true);
  add(1.6, ConstraintOrigin::kPerson, true);
  add(3.5, ConstraintOrigin::kPerson, true);
  add(9.0, ConstraintOrigin::kOptimize, false);
  ON_CALL(db_.posegraph(), Get(_, _)).WillByDefault(Return(state));
  JobInfo optimize = Job(7, JobState::kSucceeded);
  optimize.message = "settled. Good.";
  const std::vector<JobInfo> jobs = {optimize, Job(9, JobState::kFailed)};
  ON_CALL(db_.jobs(), List(_, _)).WillByDefault(Return(jobs));
  const Json shown = RunJson({"map", "show", "m"});
  EXPECT_EQ(shown["scans_moved_by_jobs"], 3);
  EXPECT_EQ(shown["optimized"], "job 7: settled. Good.");
  EXPECT_EQ(shown["median_overlap"], 0.8);
  EXPECT_EQ(shown["poses_doubtful"], false);
  EXPECT_EQ(shown["loops_closed"], 2);
  EXPECT_EQ(shown["loops_open"], 1);
  EXPECT_EQ(shown["loops_not_believed"], 1);
  JobInfo revert = Job(10, JobState::kSucceeded);
  revert.kind = "revert";
  revert.message = "back to epoch 1";
  ON_CALL(db_.jobs(), List(_, _)).WillByDefault(Return(std::vector<JobInfo>{optimize, revert}));
  EXPECT_EQ(RunJson({"map", "show", "m"})["optimized"], "job 10: back to epoch 1");
  const std::string text = RunText({"map", "show", "m"});
  EXPECT_THAT(text, HasSubstr("median overlap 0.80, 2 of 3 aligned, 0 at the step limit"));
  EXPECT_THAT(text, HasSubstr("2 closed, 1 open, 1 not believed"));
  listed = absl::DataLossError("1 scan is damaged");  // the others count
  EXPECT_EQ(RunJson({"map", "show", "m"})["median_overlap"], 0.8);
  listed = absl::UnavailableError("gone");
  EXPECT_FALSE(RunJson({"map", "show", "m"}).contains("median_overlap"));
  EXPECT_THAT(talk_.str(), HasSubstr("its quality is unknown: gone"));
}

TEST_F(MapCommandsTest, PlacesAreToldAndDrawn) {
  ON_CALL(db_.planning(), ListProfiles(_, _)).WillByDefault([](auto&, auto) {
    return absl::StatusOr<std::map<std::string, RobotProfile>>({{"default", RobotProfile()}});
  });
  FloorPlaces found;
  ON_CALL(db_.planning(), ListPlaces(_, _, _)).WillByDefault([&](auto&, auto, auto&) {
    return absl::StatusOr<FloorPlaces>(found);
  });
  FloorPlan plan;
  ON_CALL(db_.planning(), ListFloors(_, _, _)).WillByDefault([&](auto&, auto, const FloorQuery& q) {
    EXPECT_EQ(q.floor, found.floor);
    return absl::StatusOr<FloorPlan>(plan);
  });
  const ::strata::testing::TempDir dir;
  const std::string file = (dir.path() / "places.png").string();
  EXPECT_THAT(RunText({"map", "places", "m"}), HasSubstr("no place"));
  EXPECT_TRUE(RunJson({"map", "places", "m"})["places"].empty());
  EXPECT_THAT(Run({"map", "places", "m", file}), StatusIs(Code::kNotFound, HasSubstr("no floor")));
  EXPECT_THAT(Run({"map", "places", "m", "--profile", "giant"}), StatusIs(Code::kNotFound, _));
  found.floor = 0;
  found.cell_size_m = 0.1;
  found.places = {
      {PlaceKind::kRoom, 12.5, {0, 0}, {4, 3}, {2, 1}, {1}, {{0, 0, 0x0FFFFFFFFFFFFFFF}}},
      {PlaceKind::kDoorway, 0.5, {4, 0}, {5, 1}, {4, 1}, {0}, {{0, 0, 0xF000000000000000}}}};
  const auto json = RunJson({"map", "places", "m", "--floor", "0"});
  EXPECT_EQ(json["floor"], 0);
  EXPECT_EQ(json["places"][0]["kind"], "room");
  EXPECT_EQ(json["places"][1]["neighbours"][0], 0);
  EXPECT_EQ(json["places"][0]["high"][1], 3.0);
  EXPECT_THAT(Run({"map", "places", "m", file}), StatusIs(Code::kAborted, _));
  plan.floors.resize(1);
  plan.floors[0].blocks = {{0, 0, ~std::uint64_t{0}, 0, 0}, {1, 0, 0, 0xFF, 0xFF00}};
  EXPECT_THAT(Run({"map", "places", "m", file}), IsOk());
  EXPECT_GT(std::filesystem::file_size(file), 100U);
}

TEST_F(MapCommandsTest, FloorsAndPlacesMindWhatWasInferredIfAskedTo) {
  ON_CALL(db_.planning(), ListProfiles(_, _)).WillByDefault([](auto&, auto) {
    return absl::StatusOr<std::map<std::string, RobotProfile>>({{"default", RobotProfile()}});
  });
  std::vector<InferredAs> asked;
  ON_CALL(db_.planning(), ListFloors(_, _, _)).WillByDefault([&](auto&, auto, const FloorQuery& q) {
    asked.push_back(q.inferred);
    FloorPlan plan;
    plan.floors.resize(1);
    plan.floors[0].blocks = {{0, 0, ~std::uint64_t{0}, 0, 0}};
    plan.message = "nothing is inferred";
    plan.cell_size_m = 0.1;
    return absl::StatusOr<FloorPlan>(plan);
  });
  ON_CALL(db_.planning(), ListPlaces(_, _, _)).WillByDefault([&](auto&, auto, const PlaceQuery& q) {
    asked.push_back(q.inferred);
    FloorPlaces found;
    found.places = {{PlaceKind::kRoom, 0.64, {0, 0}, {1, 1}, {0, 0}, {}, {{0, 0, 1}}}};
    found.floor = 0;
    found.cell_size_m = 0.1;
    found.message = "nothing is inferred here";
    return absl::StatusOr<FloorPlaces>(found);
  });
  const ::strata::testing::TempDir dir;
  const std::string out = (dir.path() / "m").string();
  EXPECT_EQ(RunJson({"map", "floors", "m", "--inferred", "obstacle"})["message"],
            "nothing is inferred");
  EXPECT_EQ(RunJson({"map", "places", "m", out + ".png", "--inferred", "obstacle"})["message"],
            "nothing is inferred here");
  EXPECT_THAT(
      Run({"map", "export", "m", "--format", "nav2", "--inferred", "obstacle", "--out", out}),
      IsOk());
  EXPECT_THAT(talk_.str(), HasSubstr("nothing is inferred"));
  EXPECT_THAT(asked, SizeIs(4));  // the picture of places, too
  EXPECT_THAT(asked, Each(InferredAs::kObstacle));
  asked.clear();
  RunText({"map", "floors", "m"});
  EXPECT_THAT(asked, Each(InferredAs::kIgnore));
  EXPECT_THAT(
      Run({"map", "export", "m", "--format", "ply", "--inferred", "obstacle", "--out", "x"}),
      StatusIs(Code::kInvalidArgument, HasSubstr("nav2")));
}

}  // namespace
}  // namespace strata::cli
