// What a server reads of a map after its lease of it has ended, as one that was frozen does.
#include <memory>

#include "absl/status/status.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/storage/postgresql/connection.h"
#include "core/storage/postgresql/postgres_maps.h"
#include "core/storage/storage.h"
#include "tests/support/patience.h"
#include "tests/support/postgres_cluster.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

constexpr char kMap[] = "lapsed";

TEST(LapsedReadsTest, OfVersionsThatOthersMayCollectAreRefused) {
  const auto cluster = SharedPostgresCluster();
  if (absl::IsFailedPrecondition(cluster.status())) GTEST_SKIP() << cluster.status().message();
  STRATA_ASSERT_OK(cluster);
  PostgresOptions options;
  options.where = (*cluster)->AddressOfOwn(kMap);
  options.lease.time = absl::Seconds(1);
  STRATA_ASSERT_OK_AND_ASSIGN(const PostgresMaps maps, PostgresMaps::Connect(options));
  STRATA_ASSERT_OK(maps.Create(kMap, MapParameters(), absl::Now()));
  STRATA_ASSERT_OK_AND_ASSIGN(const std::unique_ptr<MapStorage> map, maps.OpenAlone(kMap));
  STRATA_ASSERT_OK_AND_ASSIGN(const std::unique_ptr<StorageReader> reader, map->NewReader());
  STRATA_EXPECT_OK(reader->ListSurfaceTiles(TileRange(), 1));
  // Its renewals leave out a row that somebody holds.
  STRATA_ASSERT_OK_AND_ASSIGN(const auto taker, Connection::Open(options.where));
  STRATA_ASSERT_OK(taker->Execute("BEGIN; SELECT FROM map_lease FOR UPDATE"));
  const absl::Time end = absl::Now() + kPatience;
  while (map->CheckHeld().ok() && absl::Now() < end) absl::SleepFor(absl::Milliseconds(20));
  const auto refused = StatusIs(absl::StatusCode::kUnavailable, ::testing::HasSubstr("lease"));
  EXPECT_THAT(reader->ListSurfaceTiles(TileRange(), 1), refused);
  EXPECT_THAT(reader->FindSurfaceTile(TileKey(), 1), refused);
  EXPECT_THAT(reader->ListMlsTiles(1), refused);
  EXPECT_THAT(reader->FindMlsTile(TileKey(), 1), refused);
  STRATA_EXPECT_OK(reader->GetClock());  // the newest state, whoever made it
  STRATA_ASSERT_OK(taker->Execute("ROLLBACK"));
  while (!map->CheckHeld().ok() && absl::Now() < end) absl::SleepFor(absl::Milliseconds(20));
  STRATA_EXPECT_OK(reader->ListSurfaceTiles(TileRange(), 1));
}

}  // namespace
}  // namespace strata::testing
