// What things are: classes, labels, classifiers.
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/common/status.h"
#include "core/storage/storage.h"
#include "tests/core/storage/contract/storage_contract.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

class MeaningContractTest : public StorageContractTest {};

TEST_F(MeaningContractTest, LabelsAreReplacedByOriginAndGoWithTheirScan) {
  const ScanNumber number = Put(1);
  const auto labels = [&](LabelOrigin origin) {
    std::vector<std::string> pieces;
    for (std::uint32_t piece = 0;; ++piece) {
      const auto found = reader().FindLabels(number, origin, piece);
      STRATA_EXPECT_OK(found);
      if (!found.ok() || !found->has_value()) return pieces;
      pieces.push_back(**found);
    }
  };
  STRATA_ASSERT_OK(Commit([&]() -> absl::Status {
    STRATA_RETURN_IF_ERROR(writer().PutLabels(number, LabelOrigin::kPerson, 0, {"a", "b", "c"}));
    STRATA_RETURN_IF_ERROR(writer().PutLabels(number, LabelOrigin::kModel, 4, {"m"}));
    return writer().PutLabels(number, LabelOrigin::kPerson, 0, {"d"});
  }));
  EXPECT_THAT(labels(LabelOrigin::kPerson), ElementsAre("d"));
  EXPECT_THAT(labels(LabelOrigin::kModel), ElementsAre("m"));
  STRATA_ASSERT_OK_AND_ASSIGN(PosedScan scan, reader().GetScan(number, 1));
  EXPECT_TRUE(scan.scan.person_labels);
  EXPECT_EQ(scan.scan.label_model, 4U);
  STRATA_ASSERT_OK(Commit([&] { return writer().PutLabels(number, LabelOrigin::kPerson, 0, {}); }));
  EXPECT_THAT(labels(LabelOrigin::kPerson), ElementsAre());
  STRATA_ASSERT_OK_AND_ASSIGN(scan, reader().GetScan(number, 1));
  EXPECT_FALSE(scan.scan.person_labels);
  STRATA_ASSERT_OK(Commit([&] { return writer().DeleteScan(number); }));
  EXPECT_THAT(labels(LabelOrigin::kModel), ElementsAre());
}

TEST_F(MeaningContractTest, ClassifiersComeBackToTheByteAndTheirIdsAreNotUsedAgain) {
  ClassifierInfo info;
  info.name = "street";
  info.created = absl::FromUnixMicros(123);
  info.job = 3;
  info.description = "learned";
  info.parameters = {{"method", "amn"}};
  info.scores = {{"accuracy", 0.1 + 0.2}};
  std::string bytes(3'000'000, 'x');
  bytes[2'500'000] = 'y';
  info.bytes = bytes.size();
  const auto put = [&] {
    return Commit([&]() -> absl::Status {
      STRATA_ASSIGN_OR_RETURN(info.id, writer().PutClassifier(info, bytes));
      return absl::OkStatus();
    });
  };
  STRATA_ASSERT_OK(put());
  const std::uint64_t first = info.id;
  EXPECT_THAT(put(), StatusIs(absl::StatusCode::kAlreadyExists, HasSubstr("street")));
  Reopen();
  EXPECT_THAT(reader().ListClassifiers(), IsOkAndHolds(ElementsAre(info)));
  EXPECT_THAT(reader().GetClassifier(first), IsOkAndHolds(bytes));
  STRATA_ASSERT_OK(Commit([&] { return writer().DeleteClassifier(first); }));
  EXPECT_THAT(reader().ListClassifiers(), IsOkAndHolds(ElementsAre()));
  STRATA_ASSERT_OK(put());
  EXPECT_GT(info.id, first);
}

TEST_F(MeaningContractTest, ClassesAreReplacedByIdAndTheirNamesAreTheirOwn) {
  const auto put = [&](std::uint16_t id, const std::string& name, Colour colour) {
    return Commit([&] { return writer().PutClass({id, name, colour}); });
  };
  STRATA_ASSERT_OK(put(7, "wall", {1, 2, 3}));
  STRATA_ASSERT_OK(put(2, "road", {255, 0, 128}));
  STRATA_ASSERT_OK(put(7, "facade", {4, 5, 6}));
  EXPECT_THAT(put(2, "facade", {0, 0, 0}),
              StatusIs(absl::StatusCode::kAlreadyExists, HasSubstr("facade")));
  Reopen();
  EXPECT_THAT(reader().ListClasses(),
              IsOkAndHolds(ElementsAre(MapClass{2, "road", {255, 0, 128}},
                                       MapClass{7, "facade", {4, 5, 6}})));
}

}  // namespace
}  // namespace strata::testing
