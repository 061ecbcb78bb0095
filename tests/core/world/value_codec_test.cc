// Small stored values and their checksums.
#include "core/world/value_codec.h"

#include <cstddef>
#include <string>

#include "absl/status/status.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

using ::testing::HasSubstr;

TEST(ValueCodecTest, EveryFlippedBitIsFound) {
  ScanHeader header;
  header.id = {"run", 1};
  const std::string good = EncodeScanHeader(header);
  STRATA_ASSERT_OK(DecodeScanHeader(header.id, good));
  for (std::size_t bit = 0; bit < 8 * good.size(); ++bit) {
    std::string bad = good;
    bad[bit / 8] = static_cast<char>(bad[bit / 8] ^ (1 << (bit % 8)));
    EXPECT_THAT(DecodeScanHeader(header.id, bad),
                StatusIs(absl::StatusCode::kDataLoss, HasSubstr("scan header")));
  }
  EXPECT_THAT(DecodeScanHeader(header.id, good.substr(1)),
              StatusIs(absl::StatusCode::kDataLoss, HasSubstr("bytes instead of")));
}

}  // namespace
}  // namespace strata::testing
