#include "client/cli/classifier/label_classes.h"

#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/cli/classifier/classifier_options.h"
#include "client/formats/file_bytes.h"
#include "core/world/map_class.h"
#include "tests/support/mock_database.h"
#include "tests/support/status_matchers.h"
#include "tests/support/temp_dir.h"

namespace strata::cli {
namespace {

using ::strata::testing::StatusIs;
using ::testing::_;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Pair;
using ::testing::Return;

constexpr char kTwo[] = "ground=1200,1202; facade = 1400";

TEST(LabelClassesTest, GroupsLabelsUnderNames) {
  STRATA_ASSERT_OK_AND_ASSIGN(const LabelClasses two, ParseLabelClasses(kTwo));
  EXPECT_THAT(two.classes, ElementsAre(ClassName{1, "ground"}, ClassName{2, "facade"}));
  EXPECT_THAT(two.class_of_label, ElementsAre(Pair(1200, 1), Pair(1202, 1), Pair(1400, 2)));
  PointCloud cloud;
  cloud.label = {0, 1202, 7, 1400};
  two.Apply(cloud);
  EXPECT_THAT(cloud.label, ElementsAre(0, 1, 0, 2));
}

TEST(LabelClassesTest, AFileHasAClassALine) {
  const testing::TempDir dir;
  const std::string path = (dir.path() / "classes.txt").string();
  STRATA_ASSERT_OK(
      WriteFileBytes(path, "# by hand\nground=1200,1202 # all of it\r\n\nfacade=1400\n"));
  STRATA_ASSERT_OK_AND_ASSIGN(const LabelClasses read, ReadLabelClasses(path));
  STRATA_ASSERT_OK_AND_ASSIGN(const LabelClasses two, ReadLabelClasses(kTwo));
  EXPECT_EQ(read.classes, two.classes);
  EXPECT_EQ(read.class_of_label, two.class_of_label);
  STRATA_ASSERT_OK(WriteFileBytes(path, "ground=none\n"));
  EXPECT_THAT(ReadLabelClasses(path),
              StatusIs(absl::StatusCode::kInvalidArgument,
                       ::testing::AllOf(HasSubstr("classes.txt"), HasSubstr("'none' of ground"))));
  EXPECT_THAT(ReadLabelClasses("/nowhere"), StatusIs(absl::StatusCode::kNotFound, HasSubstr("")));
}

TEST(LabelClassesTest, ErrorsNameTheClassAndTheLabel) {
  const auto expect = [](const std::string& text, const std::string& message) {
    EXPECT_THAT(ParseLabelClasses(text),
                StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr(message)));
  };
  expect("", "there are none");
  expect("ground", "'ground' is no class");
  expect("=1", "'=1' is no class");
  expect("ground=", "'' of ground is no label");
  expect("ground=0", "'0' of ground is no label");
  expect("ground=65536", "'65536' of ground is no label");
  expect("a=1;b=1", "label 1 of b is there twice");
  expect("a=1;a=2", "class a is there twice");
}

TEST(LabelClassesTest, MeetsTheClassesOfAClassifierByName) {
  STRATA_ASSERT_OK_AND_ASSIGN(const LabelClasses two, ParseLabelClasses(kTwo));
  const std::vector<ClassName> own = {{9, "facade"}, {5, "ground"}, {6, "wire"}};
  STRATA_ASSERT_OK_AND_ASSIGN(const LabelClasses met, ForClassesOf(two, own));
  EXPECT_EQ(met.classes, own);
  EXPECT_THAT(met.class_of_label, ElementsAre(Pair(1200, 5), Pair(1202, 5), Pair(1400, 9)));
  EXPECT_THAT(ForClassesOf(two, {{1, "ground"}}),
              StatusIs(absl::StatusCode::kInvalidArgument,
                       HasSubstr("class facade is none of the classifier's: ground")));
}

TEST(LabelClassesTest, AMapIsGivenTheClassesThatItDoesNotHave) {
  ::strata::testing::MockMaps maps;
  ON_CALL(maps, ListClasses(_, _)).WillByDefault(Return(std::vector<MapClass>{{1, "facade", {}}}));
  EXPECT_CALL(maps, ListClasses(_, _));
  EXPECT_CALL(maps, SetClass(_, _, MapClass{2, "ground", DefaultClassColour(2)}));
  STRATA_ASSERT_OK_AND_ASSIGN(const LabelClasses two, ParseLabelClasses(kTwo));
  STRATA_ASSERT_OK_AND_ASSIGN(const LabelClasses met, ForClassesOfMap(maps, {}, "m", two));
  EXPECT_THAT(met.class_of_label, ElementsAre(Pair(1200, 2), Pair(1202, 2), Pair(1400, 1)));
}

TEST(LabelClassesTest, EveryLabelIsAClassOfItsOwn) {
  PointCloud cloud;
  cloud.label = {7, 0, 3};
  const LabelClasses every = EveryLabel({cloud});
  EXPECT_THAT(every.classes, ElementsAre(ClassName{3, "3"}, ClassName{7, "7"}));
  every.Apply(cloud);
  EXPECT_THAT(cloud.label, ElementsAre(7, 0, 3));
}

TEST(ClassifierOptionsTest, ReductionsByName) {
  STRATA_ASSERT_OK_AND_ASSIGN(const ReductionOptions depth, ParseReduction("depth=12"));
  EXPECT_EQ(depth.kind, ReductionKind::kDepth);
  EXPECT_EQ(depth.depth, 12);
  STRATA_ASSERT_OK_AND_ASSIGN(const ReductionOptions random, ParseReduction("random=500"));
  EXPECT_EQ(random.kind, ReductionKind::kRandom);
  EXPECT_EQ(random.count, 500U);
  EXPECT_EQ(ParseReduction("auto")->kind, ReductionKind::kBalanced);
  EXPECT_EQ(ParseReduction("pure")->kind, ReductionKind::kPure);
  EXPECT_EQ(ParseReduction("none")->kind, ReductionKind::kNone);
  for (const char* bad : {"", "depth", "depth=", "depth=x", "depth=0", "depth=31", "some"}) {
    EXPECT_EQ(ParseReduction(bad).status().code(), absl::StatusCode::kInvalidArgument) << bad;
  }
}

}  // namespace
}  // namespace strata::cli
