#include "core/codec/blob.h"

#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/codec/bytes.h"
#include "core/common/checksum.h"
#include "tests/core/codec/hostile.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using ::strata::testing::IsOkAndHolds;
using ::strata::testing::StatusIs;
using ::testing::HasSubstr;

TEST(BlobTest, EnvelopeIsMagicVersionsLengthBodyChecksum) {
  const std::string blob = SealBlob(BlobKind::kPoints, 1, "body");
  ASSERT_EQ(blob.size(), 4 + kBlobOverheadBytes);
  EXPECT_EQ(blob.substr(0, 16), std::string("SPT1\1\0\1\0\4\0\0\0body", 16));
  EXPECT_THAT(OpenBlob(BlobKind::kPoints, 1, blob), IsOkAndHolds("body"));
}

TEST(BlobTest, DamageIsDataLoss) {
  testing::ExpectDamageIsDataLoss(
      SealBlob(BlobKind::kMlsTile, 1, "some body"),
      [](absl::string_view bytes) { return OpenBlob(BlobKind::kMlsTile, 1, bytes); },
      1,
      500);
}

TEST(BlobTest, OtherKindIsDataLoss) {
  EXPECT_THAT(OpenBlob(BlobKind::kMlsTile, 1, SealBlob(BlobKind::kPoints, 1, "")),
              StatusIs(absl::StatusCode::kDataLoss, HasSubstr("magic")));
}

TEST(BlobTest, LaterVersionIsUnimplementedAndSaysWhich) {
  EXPECT_THAT(OpenBlob(BlobKind::kPoints, 1, SealBlob(BlobKind::kPoints, 7, "")),
              StatusIs(absl::StatusCode::kUnimplemented, HasSubstr("version 7")));
}

}  // namespace
}  // namespace strata
