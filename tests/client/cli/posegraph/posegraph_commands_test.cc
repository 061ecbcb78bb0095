// strata posegraph and pose, on a database that the test decides on.
#include <fstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/cli/terminal/command.h"
#include "tests/client/cli/commands_fixture.h"
#include "tests/support/status_matchers.h"
#include "tests/support/temp_dir.h"

namespace strata::cli {
namespace {

using ::strata::testing::StatusIs;
using ::testing::_;
using ::testing::HasSubstr;
using ::testing::Return;
using Code = absl::StatusCode;

class PosegraphCommandsTest : public CommandsTest {};

TEST_F(PosegraphCommandsTest, APoseThatIsNotKnownSaysWhy) {
  EXPECT_CALL(db_.posegraph(), LookupPose(_, absl::string_view("m"), ScanId{"run", 4}))
      .WillOnce(Return(api::PoseLookup{false, "pending behind 3 scans", Pose::Identity(), 2}));
  const Json lookup = RunJson({"pose", "lookup", "m", "run/4"});
  EXPECT_EQ(lookup["id"], "run/4");
  EXPECT_EQ(lookup["known"], false);
  EXPECT_EQ(lookup["message"], "pending behind 3 scans");
}

TEST_F(PosegraphCommandsTest, AConstraintIsSaidInMetresAndRadians) {
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
           "1,2,3,90",
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

TEST_F(PosegraphCommandsTest, AnImportedEdgeMayBeFalseIfTheUserSaysSo) {
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

TEST_F(PosegraphCommandsTest, APlaceInTheMapIsAPriorOnThePositionAlone) {
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

TEST_F(PosegraphCommandsTest, ConstraintsAreSwitchedAndRemoved) {
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

TEST_F(PosegraphCommandsTest, TheGraphShowsHowWellItsConstraintsAreKept) {
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

}  // namespace
}  // namespace strata::cli
