#include "core/codec/local_map_codec.h"

#include <cstddef>
#include <string>

#include "absl/status/status.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/mls/mls_map.h"
#include "tests/core/codec/tile_samples.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using ::testing::HasSubstr;
using testing::StatusIs;

TEST(LocalMapCodecTest, WhatIsTooLargeToBeReadIsNotWritten) {
  MlsMap map;
  map.tiles.push_back(testing::RandomTile(1, 100, true));
  const std::size_t patches = map.patch_count();
  ASSERT_GT(patches, 0U);
  STRATA_ASSERT_OK_AND_ASSIGN(const std::string bytes, EncodeLocalMap(map, patches));
  STRATA_ASSERT_OK_AND_ASSIGN(const MlsMap back, DecodeLocalMap(bytes, map.parameters));
  EXPECT_EQ(back, map);
  EXPECT_THAT(EncodeLocalMap(map, patches - 1),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("split the scan")));
}

}  // namespace
}  // namespace strata
