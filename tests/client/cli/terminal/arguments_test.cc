#include "client/cli/terminal/arguments.h"

#include <fstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/cli/terminal/number_file.h"
#include "tests/support/status_matchers.h"
#include "tests/support/temp_dir.h"

namespace strata::cli {
namespace {

using ::strata::testing::StatusIs;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST(ParseNumbersTest, TakesSignsBlanksAndExponents) {
  EXPECT_THAT(ParseNumbers("-14,0.5, 1e3", 3, 3).value(), ElementsAre(-14.0, 0.5, 1000.0));
}

TEST(ParseNumbersTest, RefusesOtherCountsWordsAndWhatIsNotFinite) {
  for (const char* text : {"", "1", "1,2,3,4", "1,x", "1,,2", "nan,1", "1,inf", "1;2"}) {
    EXPECT_FALSE(ParseNumbers(text, 2, 3).has_value()) << text;
  }
}

TEST(ProfileOverridesTest, ChangesOnlyWhatIsGiven) {
  RobotProfile profile;
  profile.height_m = 1.7;
  ProfileOverrides overrides;
  overrides.radius_m = 0.0;
  const RobotProfile result = overrides.Over(profile);
  EXPECT_EQ(result.radius_m, 0.0);
  EXPECT_EQ(result.height_m, 1.7);
}

class NumberFileTest : public ::testing::Test {
 protected:
  absl::StatusOr<std::vector<std::vector<double>>> Read(const std::string& text) {
    std::ofstream(path_) << text;
    return ReadNumberFile(path_, 2, 3);
  }
  testing::TempDir dir_;
  std::string path_ = (dir_.path() / "numbers.csv").string();
};

TEST_F(NumberFileTest, SkipsHeaderCommentsAndEmptyLines) {
  STRATA_ASSERT_OK_AND_ASSIGN(const auto rows, Read("x,y\n# note\n\n1,2\r\n-3;4 5\n"));
  EXPECT_THAT(rows, ElementsAre(ElementsAre(1.0, 2.0), ElementsAre(-3.0, 4.0, 5.0)));
}

TEST_F(NumberFileTest, NamesTheBadLine) {
  EXPECT_THAT(Read("1,2\n1,two\n"),
              StatusIs(absl::StatusCode::kInvalidArgument,
                       HasSubstr("numbers.csv: line 2: expected 2 to 3")));
  EXPECT_THAT(Read("1\n"), StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr(": line 1:")));
}

TEST_F(NumberFileTest, AByteOrderMarkIsNoNumber) {
  STRATA_ASSERT_OK_AND_ASSIGN(const auto rows, Read("\xef\xbb\xbf-1,2\n"));
  EXPECT_THAT(rows, ElementsAre(ElementsAre(-1.0, 2.0)));
  STRATA_ASSERT_OK_AND_ASSIGN(const auto headed, Read("\xef\xbb\xbfx,y\n1,2\n"));
  EXPECT_THAT(headed, ElementsAre(ElementsAre(1.0, 2.0)));
}

TEST_F(NumberFileTest, AFolderIsAnError) {
  EXPECT_THAT(ReadNumberFile(dir_.path().string(), 2, 2),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("not a file")));
}

TEST_F(NumberFileTest, MissingFileIsNotFound) {
  EXPECT_THAT(ReadNumberFile("/nowhere/x.csv", 1, 1),
              StatusIs(absl::StatusCode::kNotFound, HasSubstr("/nowhere/x.csv")));
}

}  // namespace
}  // namespace strata::cli
