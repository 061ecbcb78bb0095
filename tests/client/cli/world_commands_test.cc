// The commands around epochs, constraints and places, in this process on a database that the test
// decides on.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/cli/terminal/command.h"
#include "tests/support/mock_database.h"
#include "tests/support/plane_room.h"
#include "tests/support/status_matchers.h"
#include "tests/support/temp_dir.h"

namespace strata::cli {
namespace {

using ::strata::testing::IsOk;
using ::strata::testing::StatusIs;
using ::testing::_;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::Return;
using Code = absl::StatusCode;

class WorldCommandsTest : public ::testing::Test {
 protected:
  // Runs a command line without the word "strata"; throws CLI::ParseError for wrong usage.
  absl::Status Run(std::vector<std::string> words, OutputFormat format = OutputFormat::kJson) {
    data_.str("");
    talk_.str("");
    CLI::App root;
    root.require_subcommand(1);
    Commands commands{.root = root, .selected = {}, .selected_on_files = {}};
    AddMapCommands(commands);
    AddPoseCommands(commands);
    AddJobCommands(commands);
    AddPosegraphCommands(commands);
    AddPlanesCommands(commands);
    AddLocalizeCommand(commands);
    AddPlanCommand(commands);
    std::reverse(words.begin(), words.end());  // as CLI11 takes them
    root.parse(words);
    Output output(format, data_, talk_);
    Context context{.database = db_, .call = {}, .output = output};
    return commands.selected(context);
  }
  // Its JSON, of a command that ends well.
  Json RunJson(const std::vector<std::string>& words) {
    EXPECT_THAT(Run(words), IsOk());
    return Json::parse(data_.str(), nullptr, false);
  }
  std::string RunText(const std::vector<std::string>& words) {
    EXPECT_THAT(Run(words, OutputFormat::kText), IsOk());
    return data_.str();
  }

  static JobInfo Job(std::uint64_t id, JobState state) {
    JobInfo job;
    job.id = id;
    job.kind = "optimize";
    job.state = state;
    return job;
  }
  void EveryWatchEndsWith(JobState state) {
    ON_CALL(db_.jobs(), Get(_, _, _)).WillByDefault([](auto&, auto, std::uint64_t id) {
      return absl::StatusOr<JobInfo>(Job(id, JobState::kQueued));
    });
    ON_CALL(db_.jobs(), Watch(_, _, _, _))
        .WillByDefault(
            [state](auto&, auto, std::uint64_t id, auto sink) { return sink(Job(id, state)); });
  }
  static Constraint SomeConstraint(std::uint64_t id) {
    Constraint constraint;
    constraint.id = id;
    constraint.i = {"a", 1};
    constraint.j = {"a", 2};
    constraint.T_i_j.translation().x() = 1.0;
    return constraint;
  }
  static PoseNode Node(const ScanId& id, double x) {
    PoseNode node;
    node.id = id;
    node.time = absl::UnixEpoch();
    node.T_map_scan.translation().x() = x;
    return node;
  }

  ::strata::testing::MockDatabase db_;
  std::ostringstream data_, talk_;
};

TEST_F(WorldCommandsTest, TheOriginOfAMapIsInDegrees) {
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

TEST_F(WorldCommandsTest, ALongPlanShowsTenWaypointsAndJsonAll) {
  PlanResult plan;
  plan.reason = PlanReason::kFound;
  for (int i = 0; i < 773; ++i) plan.waypoints.emplace_back(i, 0.5, 0.25);
  ON_CALL(db_.planning(), ListProfiles(_, _)).WillByDefault([](auto&, auto) {
    return absl::StatusOr<std::map<std::string, RobotProfile>>({{"default", RobotProfile()}});
  });
  ON_CALL(db_.planning(), PlanPath(_, _, _)).WillByDefault([&](auto&, auto, auto&) {
    return absl::StatusOr<PlanResult>(plan);
  });
  const std::vector<std::string> words = {"plan", "m", "--from", "0,0", "--to", "772,0"};
  const std::string text = RunText(words);
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 1 + 10 + 1) << text;
  EXPECT_THAT(text, HasSubstr("9.000  0.500  0.250\n  … 763 more; --out"));
  EXPECT_EQ(RunJson(words)["waypoints"].size(), 773U);
}

TEST_F(WorldCommandsTest, FloorsAreToldWithTheWaysBetweenThem) {
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

TEST_F(WorldCommandsTest, AJobTakesItsParametersByPlaceByNameAndByFlag) {
  const ::strata::testing::StringMap expected = {
      {"rounds", "3"}, {"pool", "2"}, {"threads", "4"}, {"dry_run", "1"}};
  EXPECT_CALL(db_.jobs(), Start(_, absl::string_view("m"), absl::string_view("optimize"), expected))
      .WillOnce(Return(Job(7, JobState::kQueued)));
  EXPECT_EQ(RunJson({"job",
                     "start",
                     "m",
                     "optimize",
                     "rounds=3",
                     "pool=2",
                     "--param",
                     "threads=4",
                     "--dry-run"})["id"],
            7);
  EXPECT_THROW(Run({"job", "start", "m", "optimize", "fast"}).IgnoreError(), CLI::ParseError);
}

TEST_F(WorldCommandsTest, ADryRunThatProposesHasDoneItsWork) {
  ON_CALL(db_.jobs(), Start(_, _, _, _)).WillByDefault(Return(Job(7, JobState::kQueued)));
  EveryWatchEndsWith(JobState::kProposed);
  EXPECT_EQ(RunJson({"job", "start", "m", "optimize", "--dry-run", "--wait"})["state"], "proposed");
  EveryWatchEndsWith(JobState::kFailed);
  EXPECT_THAT(Run({"job", "start", "m", "optimize", "--dry-run", "--wait"}),
              StatusIs(Code::kFailedPrecondition, HasSubstr("job 7 failed")));
}

TEST_F(WorldCommandsTest, TheReportOfAJobHasALineANumber) {
  JobInfo job = Job(7, JobState::kProposed);
  job.metrics = {{"cost_before", 12.5}, {"cost_after", 3.25}};
  ON_CALL(db_.jobs(), Get(_, _, _)).WillByDefault(Return(job));
  EXPECT_THAT(RunText({"job", "show", "m", "7"}),
              HasSubstr("\n\ncost_after   3.25\ncost_before  12.5\n"));
  EXPECT_EQ(RunJson({"job", "show", "m", "7"})["metrics"]["cost_after"], 3.25);
}

TEST_F(WorldCommandsTest, ProposalsAreAcceptedAndForgotten) {
  EXPECT_CALL(db_.jobs(), Accept(_, absl::string_view("m"), 7))
      .WillRepeatedly(Return(Job(7, JobState::kQueued)));
  EveryWatchEndsWith(JobState::kSucceeded);
  EXPECT_EQ(RunJson({"job", "accept", "m", "7"})["state"], "queued");
  EXPECT_EQ(RunJson({"job", "accept", "m", "7", "--wait"})["state"], "succeeded");
  // A forgotten proposal is cancelled, as asked: nothing to wait for, and no failure.
  EXPECT_CALL(db_.jobs(), Revert(_, absl::string_view("m"), 7))
      .WillOnce(Return(Job(7, JobState::kCancelled)))
      .WillOnce(Return(Job(8, JobState::kQueued)));
  EXPECT_EQ(RunJson({"job", "revert", "m", "7", "--wait"})["state"], "cancelled");
  const Json undone = RunJson({"job", "revert", "m", "7", "--wait"});
  EXPECT_EQ(undone["id"], 8);
  EXPECT_EQ(undone["state"], "succeeded");
}

TEST_F(WorldCommandsTest, TheHistoryIsATableAndAnEpochIsBroughtBackByAJob) {
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

TEST_F(WorldCommandsTest, AWatcherReadsALineAChange) {
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

TEST_F(WorldCommandsTest, AnEndedWatchSaysWhereItGoesOn) {
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

TEST_F(WorldCommandsTest, AMapSaysHowWellItsScansAndLoopsAgree) {
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
  const std::string text = RunText({"map", "show", "m"});
  EXPECT_THAT(text, HasSubstr("median overlap 0.80, 2 of 3 aligned, 0 at the step limit"));
  EXPECT_THAT(text, HasSubstr("2 closed, 1 open, 1 not believed"));
  listed = absl::DataLossError("1 scan is damaged");  // the others count
  EXPECT_EQ(RunJson({"map", "show", "m"})["median_overlap"], 0.8);
  listed = absl::UnavailableError("gone");
  EXPECT_FALSE(RunJson({"map", "show", "m"}).contains("median_overlap"));
  EXPECT_THAT(talk_.str(), HasSubstr("its quality is unknown: gone"));
}

TEST_F(WorldCommandsTest, APoseThatIsNotKnownSaysWhy) {
  EXPECT_CALL(db_.posegraph(), LookupPose(_, absl::string_view("m"), ScanId{"run", 4}))
      .WillOnce(Return(api::PoseLookup{false, "pending behind 3 scans", Pose::Identity(), 2}));
  const Json lookup = RunJson({"pose", "lookup", "m", "run/4"});
  EXPECT_EQ(lookup["id"], "run/4");
  EXPECT_EQ(lookup["known"], false);
  EXPECT_EQ(lookup["message"], "pending behind 3 scans");
}

TEST_F(WorldCommandsTest, AConstraintIsSaidInMetresAndRadians) {
  Constraint seen;
  ON_CALL(db_.posegraph(), AddConstraint(_, _, _))
      .WillByDefault([&seen](auto&, auto, const Constraint& constraint) {
        seen = constraint;
        return absl::StatusOr<Constraint>(constraint);
      });
  RunJson({"posegraph",
           "add-constraint",
           "m",
           "a/1",
           "b/2",
           "--pose",
           "1,2,3,1.5707963267948966",
           "--sigma-m",
           "0.1",
           "--sigma-rad",
           "0.05",
           "--note",
           "tape"});
  EXPECT_EQ(seen.i, (ScanId{"a", 1}));
  EXPECT_EQ(seen.j, (ScanId{"b", 2}));
  EXPECT_TRUE((seen.T_i_j * Eigen::Vector3d::UnitX()).isApprox(Eigen::Vector3d(1, 3, 3), 1e-9));
  Vector6d information;
  information << 400, 400, 400, 100, 100, 100;
  EXPECT_TRUE(seen.information.isApprox(Matrix6d(information.asDiagonal()), 1e-9));
  EXPECT_EQ(seen.note, "tape");
  EXPECT_FALSE(seen.may_be_false);
  const Json doubtful = RunJson(
      {"posegraph", "add-constraint", "m", "a/1", "b/2", "--pose", "1,2,3", "--may-be-false"});
  EXPECT_TRUE(seen.may_be_false);
  EXPECT_EQ(doubtful["may_be_false"], true);
}

TEST_F(WorldCommandsTest, AnImportedEdgeMayBeFalseIfTheUserSaysSo) {
  api::PoseGraphState state;
  state.nodes = {Node({"a", 1}, 0.0), Node({"a", 2}, 1.5)};
  ON_CALL(db_.posegraph(), Get(_, _)).WillByDefault(Return(state));
  std::vector<Constraint> added;
  ON_CALL(db_.posegraph(), AddConstraint(_, _, _))
      .WillByDefault([&added](auto&, auto, const Constraint& constraint) {
        added.push_back(constraint);
        return absl::StatusOr<Constraint>(constraint);
      });
  const ::strata::testing::TempDir dir;
  const std::string file = (dir.path() / "graph.g2o").string();
  const std::string information = " 1 0 0 0 0 0 1 0 0 0 0 1 0 0 0 1 0 0 1 0 1\n";
  std::ofstream(file) << "# 0 a/1\n# 1 a/2\n# 2 map\n"
                      << "EDGE_SE3:QUAT 0 1 1.5 0 0 0 0 0 1" << information
                      << "EDGE_SE3:QUAT 2 0 0 0 0 0 0 0 1" << information;
  EXPECT_EQ(RunJson({"posegraph", "import", "m", file})["constraints_added"], 2);
  ASSERT_EQ(added.size(), 2U);
  EXPECT_FALSE(added[0].may_be_false);
  added.clear();
  RunJson({"posegraph", "import", "m", file, "--may-be-false"});
  ASSERT_EQ(added.size(), 2U);
  EXPECT_TRUE(added[0].may_be_false);
  EXPECT_TRUE(added[1].is_prior());
  EXPECT_FALSE(added[1].may_be_false);
}

TEST_F(WorldCommandsTest, APlaceInTheMapIsAPriorOnThePositionAlone) {
  Constraint seen;
  ON_CALL(db_.posegraph(), AddConstraint(_, _, _))
      .WillByDefault([&seen](auto&, auto, const Constraint& constraint) {
        seen = constraint;
        return absl::StatusOr<Constraint>(constraint);
      });
  const Json added =
      RunJson({"posegraph", "add-constraint", "m", "map", "b/2", "--pose", "-1,2,3"});
  EXPECT_TRUE(seen.is_prior());
  EXPECT_TRUE((seen.information.topLeftCorner<3, 3>().isZero()));
  EXPECT_NEAR(seen.information(5, 5), 400.0, 1e-9);
  EXPECT_EQ(added["kind"], "prior");
  EXPECT_TRUE(added["i"].is_null());
  for (const std::vector<std::string>& wrong :
       {std::vector<std::string>{
            "posegraph", "add-constraint", "m", "a/1", "map", "--pose", "1,2,3"},
        {"posegraph", "add-constraint", "m", "a/1", "b/2"},
        {"posegraph", "add-constraint", "m", "a/1", "b/2", "--pose", "1,2"},
        {"posegraph", "add-constraint", "m", "a/1", "b/2", "--pose", "1,2,3", "--sigma-m", "0"}}) {
    EXPECT_THROW(Run(wrong).IgnoreError(), CLI::ParseError) << wrong.back();
  }
}

TEST_F(WorldCommandsTest, ConstraintsAreSwitchedAndRemoved) {
  EXPECT_CALL(db_.posegraph(), EnableConstraint(_, absl::string_view("m"), 4, false))
      .WillOnce(Return(absl::OkStatus()));
  EXPECT_CALL(db_.posegraph(), EnableConstraint(_, absl::string_view("m"), 4, true))
      .WillOnce(Return(absl::NotFoundError("constraint 4")));
  EXPECT_CALL(db_.posegraph(), RemoveConstraint(_, absl::string_view("m"), 5))
      .WillOnce(Return(absl::OkStatus()));
  EXPECT_EQ(RunJson({"posegraph", "disable", "m", "4"})["enabled"], false);
  EXPECT_THAT(Run({"posegraph", "enable", "m", "4"}), StatusIs(Code::kNotFound, "constraint 4"));
  EXPECT_EQ(RunJson({"posegraph", "remove-constraint", "m", "5"})["removed"], 5);
}

TEST_F(WorldCommandsTest, TheGraphShowsHowWellItsConstraintsAreKept) {
  api::PoseGraphState state;
  state.epoch = 3;
  state.nodes = {Node({"a", 1}, 0.0), Node({"a", 2}, 1.5)};
  state.constraints = {SomeConstraint(1), SomeConstraint(2)};
  state.constraints[0].T_i_j.translation().x() = 1.5;
  state.constraints[1].information *= 24.0;  // half a metre off: 24 · 0.25 / 6
  state.constraints[1].enabled = false;
  ON_CALL(db_.posegraph(), Get(_, _)).WillByDefault(Return(state));
  const Json shown = RunJson({"posegraph", "show", "m", "--worst"});
  EXPECT_EQ(shown["scans"], 2);
  EXPECT_EQ(shown["disabled"], 1);
  EXPECT_EQ(shown["by_origin"]["ingest"], 2);
  EXPECT_EQ(shown["constraints"][0]["id"], 2);
  EXPECT_NEAR(shown["constraints"][0]["chi2"].get<double>(), 1.0, 1e-9);
  EXPECT_NEAR(shown["constraints"][0]["residual_m"].get<double>(), 0.5, 1e-9);
  EXPECT_NEAR(shown["constraints"][1]["chi2"].get<double>(), 0.0, 1e-9);
  EXPECT_THAT(RunText({"posegraph", "show", "m"}), HasSubstr("CHI2"));
}

TEST_F(WorldCommandsTest, PlanesAreListedWithTheirSupporters) {
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

TEST_F(WorldCommandsTest, PlanesOfAMapAreShownExportedAndDrawn) {
  PlaneModel room = ::strata::testing::DrawnRoom();
  room.planes[1].colour = Colour{160, 45, 40};
  ON_CALL(db_.models(), GetPlaneModel(_, _, _)).WillByDefault([&](auto&, auto, auto sink) {
    for (const ModelPlane& plane : room.planes) STRATA_EXPECT_OK(sink(plane));
    PlaneModelInfo info;
    info.job = 4;
    info.epoch = 2;
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

TEST_F(WorldCommandsTest, AScanIsSearchedForInTheFramesOfItsFile) {
  const ::strata::testing::TempDir dir;
  const std::string file = (dir.path() / "scan.xyz").string();
  // Far coordinates, which the reader keeps apart from the points.
  std::ofstream(file) << "500000 0 0\n500001 0 0\n500000 1 0\n";
  LocalizeQuery seen;
  ON_CALL(db_.posegraph(), Localize(_, _, _))
      .WillByDefault([&seen](auto&, auto, const LocalizeQuery& query) {
        seen = query;
        LocalizeResult result;
        result.found = true;
        result.best.T_map_scan = *query.T_map_scan_guess;
        result.best.place = {"a", 1};
        result.message = "overlap 0.9";
        result.others.push_back(result.best);
        return absl::StatusOr<LocalizeResult>(result);
      });
  const std::vector<std::string> words = {
      "localize", "m", file, "--guess", "1,2,3,0.5", "--radius", "7"};
  const Json result = RunJson(words);
  EXPECT_EQ(seen.cloud.size(), 3U);
  EXPECT_TRUE(seen.cloud.origin.isZero());
  EXPECT_EQ(seen.guess_radius_m, 7.0);
  EXPECT_EQ(result["found"], true);
  EXPECT_EQ(result["place"], "a/1");
  // What came back was the guess, so it is the pose that was given.
  EXPECT_NEAR(result["pose"][0].get<double>(), 1.0, 1e-6);
  EXPECT_NEAR(result["pose"][1].get<double>(), 2.0, 1e-6);
  EXPECT_NEAR(result["others"][0]["pose"][2].get<double>(), 3.0, 1e-6);
  EXPECT_EQ(result["covariance"].size(), 6U);
  EXPECT_THAT(RunText(words), HasSubstr("found: overlap 0.9"));
}

TEST_F(WorldCommandsTest, NowhereIsAnAnswer) {
  const ::strata::testing::TempDir dir;
  const std::string file = (dir.path() / "scan.xyz").string();
  std::ofstream(file) << "1 2 3\n4 5 6\n";
  LocalizeResult nowhere;
  nowhere.message = "best overlap 0.1";
  ON_CALL(db_.posegraph(), Localize(_, _, _)).WillByDefault(Return(nowhere));
  const Json result = RunJson({"localize", "m", file});
  EXPECT_EQ(result["found"], false);
  EXPECT_FALSE(result.contains("pose"));
  EXPECT_THAT(RunText({"localize", "m", file}), HasSubstr("not found: best overlap 0.1"));
}

}  // namespace
}  // namespace strata::cli
