#include "core/world/job_arguments.h"

#include <map>
#include <set>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include <Eigen/Core>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/world/job_kinds.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using testing::IsOk;
using testing::StatusIs;
constexpr auto kInvalid = absl::StatusCode::kInvalidArgument;

// What every parameter has to take and to refuse, written down apart from the table.
struct Expected {
  std::string kind, name, default_text;
  std::vector<std::string> fit, unfit;
};

const std::vector<std::string> kNoFlags = {"2", "-1", "yes", "01", ""};

std::vector<Expected> AllParameters() {
  std::vector<Expected> all = {
      {"optimize", "dry_run", "0", {"0", "1"}, kNoFlags},
      {"optimize", "closures", "1", {"0", "1"}, kNoFlags},
      {"optimize", "planes", "1", {"0", "1"}, kNoFlags},
      {"optimize", "directions", "1", {"0", "1"}, kNoFlags},
      {"optimize", "robust", "1", {"0", "1"}, kNoFlags},
      {"optimize", "automatic", "0", {"0", "1"}, kNoFlags},
      {"optimize", "rounds", "30", {"1", "50"}, {"0", "51", "2.5", "many", ""}},
      {"optimize", "pool", "5", {"1", "50"}, {"0", "51"}},
      {"optimize", "weighting", "covariance", {"covariance", "local_global"}, {"local", ""}},
      {"optimize", "local_weight", "0.5", {"0.000001", "0.5", "0.999999"}, {"0", "1", "1.5"}},
      {"optimize", "tolerance_m", "0.005", {"0", "1"}, {"-0.001", "1.001", "nan", "inf"}},
      {"optimize", "tolerance_rad", "0.0005", {"0", "1e-9", "1"}, {"-1", "2"}},
      {"revert", "epoch", "", {"1", "9000000000000000000"}, {"0", "-1", "one", ""}},
      {"train", "name", "", {"street", "a.b-c_d"}, {"", ".hidden", "a/b", std::string(101, 'a')}},
      {"train", "method", "amn", {"amn", "iamn", "bayes", "knn", "adaboost"}, {"AMN", "svm", ""}},
      {"train", "features", "shape", {"shape", "wall", "spin"}, {"colour", ""}},
      {"train",
       "reduce",
       "auto",
       {"auto", "pure", "none", "depth=3", "random=100"},
       {"depth", "depth=", "depth=N", "depth=0", "random=-5", "auto=1", "depth=3=4", ""}},
      {"train", "neighbours", "5", {"1", "100"}, {"0", "101"}},
      {"train", "rounds", "100", {"1", "10000"}, {"0", "10001"}},
      {"train", "slack_weight", "100", {"1e-12", "1e12"}, {"0", "-1", "1e13"}},
      {"train", "feature_neighbours", "16", {"4", "64"}, {"3", "65"}},
      {"train", "scales", "4", {"1", "8"}, {"0", "9"}},
      {"train", "voxel_m", "0.15", {"0.01", "10"}, {"0", "11"}},
      {"train", "max_height_m", "15", {"0.01", "1000"}, {"0", "1001"}},
      {"train", "plane_side_m", "0.05", {"0.001", "1"}, {"0", "1.1"}},
      {"train", "wall_distance_m", "0.5", {"0.01", "10"}, {"0", "11"}},
      {"train", "spin_radius_m", "0", {"0", "100"}, {"-1", "101"}},
      {"train", "network_degree", "3", {"1", "16"}, {"0", "17"}},
      {"train", "network_draws", "8", {"1", "1000"}, {"0", "1001"}},
      {"train", "network_sigma", "2", {"0.01", "100"}, {"0", "101"}},
      {"train", "folds", "5", {"0", "100"}, {"-1", "101"}},
      {"train", "region_m", "0", {"0", "1e6"}, {"-1", "1e7"}},
      {"classify", "model", "", {"street"}, {"", "a b"}},
      {"evaluate", "model", "", {"street"}, {"", "a b"}},
      {"fade", "scans", "", {"1", "1000"}, {"0", "1001"}},
      {"fade", "rays", "10", {"1", "100000"}, {"0", "100001"}},
      {"fade", "clearance_m", "0.3", {"0.05", "10"}, {"0.04", "10.1"}},
      {"fade", "undo", "0", {"0", "1"}, kNoFlags},
      {"planes", "rho_m", "0", {"0", "1"}, {"-0.1", "1.1", "nan"}},
      {"planes", "sigma_rad", "0.03", {"0.001", "0.5"}, {"0", "0.6"}},
      {"planes", "directions", "1", {"0", "1"}, kNoFlags},
      {"planes", "colour", "0", {"0", "1"}, kNoFlags},
      {"planes",
       "region",
       "",
       {"0,0,20,15", "-1.5,-2,1e3,4,-0.5,2.5"},
       {"",
        "0,0,20",
        "0,0,20,15,3",
        "20,0,0,15",
        "0,0,0,1",
        "0,0,1,1,2,2",
        "0,0,nan,1",
        "0,0,inf,1",
        "a,0,1,1",
        "0,0,1,1,0,1,2"}},
      {"planes", "max_planes", "500", {"1", "10000"}, {"0", "10001"}},
      {"planes", "min_area_m2", "1", {"0.01", "10000"}, {"0", "10001"}},
      {"planes", "epsilon_m", "0.25", {"0.05", "5"}, {"0.04", "5.1"}},
      {"objects", "class", "", {"car", "7"}, {"", "a b"}},
      {"objects", "region", "", {"0,0,20,15", "-1.5,-2,1e3,4,-0.5,2.5"}, {"0,0,20", "20,0,0,15"}},
      {"objects", "distance_m", "0", {"0", "4"}, {"-0.1", "4.1", "nan"}},
      {"objects", "voxel_m", "0.05", {"0.01", "1"}, {"0", "1.1"}},
      {"objects", "min_points", "50", {"1", "1000000000"}, {"0", "-1"}},
      {"complete", "kind", "", {"golf", "0123456789ab"}, {"", "a b"}},
      {"complete", "voxel_m", "0.05", {"0.01", "1"}, {"0", "1.1", "nan"}},
  };
  for (const char* kind : {"rebuild", "verify", "optimize", "fade"}) {
    all.push_back({kind, "threads", "", {"1", "64"}, {"0", "65", "-1", "two", ""}});
  }
  return all;
}

// The least that a kind has to be told.
JobParameters LeastOf(const std::string& kind) {
  if (kind == "revert") return {{"epoch", "1"}};
  if (kind == "classify" || kind == "evaluate") return {{"model", "street"}};
  return {};
}

TEST(JobArgumentsTest, AllParametersAreKnownHere) {
  std::set<std::string> table, expected;
  for (const JobKind& kind : JobKinds()) {
    for (const JobParameter& each : kind.parameters) {
      table.insert(absl::StrCat(kind.name, ".", each.name));
    }
  }
  for (const Expected& each : AllParameters()) {
    expected.insert(absl::StrCat(each.kind, ".", each.name));
  }
  EXPECT_EQ(table, expected);
}

TEST(JobArgumentsTest, WhatIsNotGivenHasItsDefault) {
  for (const Expected& each : AllParameters()) {
    const JobParameters least = LeastOf(each.kind);
    if (least.contains(each.name)) continue;
    STRATA_ASSERT_OK_AND_ASSIGN(const JobArguments arguments, ReadJobArguments(each.kind, least));
    ASSERT_EQ(arguments.Has(each.name), !each.default_text.empty()) << each.name;
    if (each.default_text.empty()) continue;
    EXPECT_EQ(arguments.Text(each.name), each.default_text) << each.name;
  }
}

TEST(JobArgumentsTest, WhatFitsIsTakenAndWhatDoesNotIsNamed) {
  for (const Expected& each : AllParameters()) {
    JobParameters parameters = LeastOf(each.kind);
    for (const std::string& text : each.fit) {
      parameters[each.name] = text;
      STRATA_ASSERT_OK_AND_ASSIGN(const JobArguments arguments,
                                  ReadJobArguments(each.kind, parameters));
      EXPECT_EQ(arguments.Text(each.name), text);
    }
    for (const std::string& text : each.unfit) {
      parameters[each.name] = text;
      const std::string what =
          absl::StrCat("job parameter ", each.name, " = '", text.substr(0, 100), "' is not ");
      EXPECT_THAT(ReadJobArguments(each.kind, parameters), StatusIs(kInvalid, HasSubstr(what)));
    }
  }
}

TEST(JobArgumentsTest, ValuesHaveTheTypesOfTheirParameters) {
  STRATA_ASSERT_OK_AND_ASSIGN(
      const JobArguments arguments,
      ReadJobArguments("optimize", {{"rounds", "7"}, {"tolerance_m", "1e-3"}, {"planes", "0"}}));
  EXPECT_EQ(arguments.Whole("rounds"), 7);
  EXPECT_EQ(arguments.Real("tolerance_m"), 0.001);
  EXPECT_FALSE(arguments.Flag("planes"));
  EXPECT_TRUE(arguments.Flag("robust"));
  EXPECT_EQ(arguments.Text("weighting"), "covariance");
}

TEST(JobArgumentsTest, BoxesHaveTheirCornersAndAnyHeight) {
  STRATA_ASSERT_OK_AND_ASSIGN(const JobArguments flat,
                              ReadJobArguments("planes", {{"region", "-1,2,3.5,4"}}));
  EXPECT_EQ(flat.Box("region").min(), Eigen::Vector3d(-1, 2, -1e7));
  EXPECT_EQ(flat.Box("region").max(), Eigen::Vector3d(3.5, 4, 1e7));
  STRATA_ASSERT_OK_AND_ASSIGN(const JobArguments high,
                              ReadJobArguments("planes", {{"region", "-1,2,3.5,4,-0.5,9"}}));
  EXPECT_EQ(high.Box("region").min(), Eigen::Vector3d(-1, 2, -0.5));
  EXPECT_EQ(high.Box("region").max(), Eigen::Vector3d(3.5, 4, 9));
}

TEST(JobArgumentsTest, BoundsAreSaid) {
  const auto refusal = [](const JobParameters& parameters) {
    return std::string(ReadJobArguments("optimize", parameters).status().message());
  };
  EXPECT_EQ(refusal({{"rounds", "51"}}), "job parameter rounds = '51' is not in [1, 50]");
  EXPECT_EQ(refusal({{"dry_run", "maybe"}}), "job parameter dry_run = 'maybe' is not 0 or 1");
  EXPECT_EQ(refusal({{"weighting", "by_taste"}}),
            "job parameter weighting = 'by_taste' is not covariance or local_global");
}

TEST(JobArgumentsTest, WhatAKindDoesNotTakeIsNamedWithAllThatItTakes) {
  for (const JobKind& kind : JobKinds()) {
    JobParameters parameters = LeastOf(std::string(kind.name));
    parameters["speed"] = "1";
    std::string takes = absl::StrCat("; ", kind.name, " takes");
    for (const JobParameter& each : kind.parameters) absl::StrAppend(&takes, " ", each.name);
    EXPECT_THAT(ReadJobArguments(kind.name, parameters),
                StatusIs(kInvalid, AllOf(HasSubstr("'speed' is unknown"), HasSubstr(takes))));
  }
  // What only the server says.
  EXPECT_THAT(ReadJobArguments("optimize", {{"accepted", "1"}}),
              StatusIs(kInvalid, HasSubstr("accepted")));
}

TEST(JobArgumentsTest, WhatAKindNeedsIsAskedFor) {
  EXPECT_THAT(ReadJobArguments("revert", {}),
              StatusIs(kInvalid, "revert takes the parameter epoch, as in epoch=N"));
  EXPECT_THAT(ReadJobArguments("classify", {}), StatusIs(kInvalid, HasSubstr("model=NAME")));
  EXPECT_THAT(ReadJobArguments("evaluate", {}), StatusIs(kInvalid, HasSubstr("model=NAME")));
  EXPECT_THAT(ReadJobArguments("dance", {}), StatusIs(kInvalid, HasSubstr("use rebuild")));
  for (const char* kind : {"rebuild", "verify", "optimize", "train", "fade"}) {
    EXPECT_THAT(ReadJobArguments(kind, {}), IsOk());
  }
}

}  // namespace
}  // namespace strata
