#include "core/world/job_kinds.h"

#include <fstream>
#include <iterator>
#include <set>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "absl/strings/string_view.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/world/job_arguments.h"
#include "tests/support/paths.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using ::testing::AllOf;
using ::testing::Each;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::SizeIs;

// Comment lines of a proto file, as text.
std::string CommentsOf(const std::string& proto) {
  std::ifstream file(proto);
  const std::string all(std::istreambuf_iterator<char>(file), {});
  std::string comments;
  for (absl::string_view line : absl::StrSplit(all, '\n')) {
    if (line.substr(0, 3) == "// ") absl::StrAppend(&comments, line.substr(3), "\n");
  }
  return comments;
}

TEST(JobKindsTest, TheProtoHasEveryKindParameterBoundAndDefault) {
  EXPECT_THAT(CommentsOf(testing::SourcePath("proto/strata/v1/jobs.proto")),
              HasSubstr(JobKindsText()));
}

TEST(JobKindsTest, TextsAreLinesForAProtoAndATerminal) {
  const std::vector<std::string> lines = absl::StrSplit(JobKindsText(), '\n');
  EXPECT_THAT(lines, Each(SizeIs(::testing::Le(77U))));
  EXPECT_THAT(lines,
              ::testing::Contains("  rounds=1..50          Most rounds of matching and "
                                  "optimising (30)"));
  EXPECT_EQ(JobKindNames(),
            "rebuild, verify, optimize, revert, train, classify, evaluate, "
            "fade, planes, objects or complete");
}

TEST(JobKindsTest, NamesAreTheirOwnAndDefaultsFit) {
  std::set<absl::string_view> kinds;
  for (const JobKind& kind : JobKinds()) {
    EXPECT_TRUE(kinds.insert(kind.name).second) << kind.name;
    std::set<absl::string_view> names;
    JobParameters defaults;
    for (const JobParameter& parameter : kind.parameters) {
      EXPECT_TRUE(names.insert(parameter.name).second) << kind.name << " " << parameter.name;
      EXPECT_TRUE(parameter.default_text.empty() || !parameter.required) << parameter.name;
      const std::string text(parameter.required ? "1" : parameter.default_text);
      if (!text.empty()) defaults.emplace(parameter.name, text);
    }
    EXPECT_THAT(ReadJobArguments(kind.name, defaults), testing::IsOk());
  }
}

TEST(JobKindsTest, FindsAKindOrNamesThoseThereAre) {
  STRATA_ASSERT_OK_AND_ASSIGN(const JobKind* const fade, FindJobKind("fade"));
  EXPECT_EQ(fade->name, kFadeJob);
  EXPECT_THAT(FindJobKind("dance"),
              testing::StatusIs(
                  absl::StatusCode::kInvalidArgument,
                  AllOf(HasSubstr("'dance'"), HasSubstr("fade, planes, objects or complete"))));
  const absl::Status refused = FindJobKind(std::string(1000, 'x')).status();
  EXPECT_THAT(std::string(refused.message()), Not(HasSubstr(std::string(101, 'x'))));
}

TEST(JobKindsTest, TypesSayWhatTheyTake) {
  const auto both = [](const JobParameterType& type) {
    return absl::StrCat(ToString(type), "; ", BoundOf(type));
  };
  EXPECT_EQ(both(FlagType()), "0|1; 0 or 1");
  EXPECT_EQ(both(WholeType{-3, 100'000}), "-3..100000; in [-3, 100000]");
  EXPECT_EQ(both(WholeType{1}), "N; a whole number from 1");
  EXPECT_EQ(both(RealType{0.0, 1e6}), "0..1000000; in [0, 1000000]");
  EXPECT_EQ(both(RealType{1e-12, 0.999999}), "1e-12..0.999999; in [1e-12, 0.999999]");
  EXPECT_EQ(both(ChoiceType{{"a", "b"}}), "a|b; a or b");
  EXPECT_EQ(both(ChoiceType{{"a", "b=N", "c"}}), "a|b=N|c; a, b=N or c");
  EXPECT_EQ(both(BoxType()),
            "X0,Y0,X1,Y1[,Z0,Z1]; X0,Y0,X1,Y1[,Z0,Z1] with X0 < X1, Y0 < Y1 and Z0 < Z1");
  EXPECT_EQ(both(NameType()), "NAME; 1 to 100 of A-Z a-z 0-9 _ . -");
}

}  // namespace
}  // namespace strata
