// What is derived, and what jobs found.
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

class DerivedContractTest : public StorageContractTest {};

TEST_F(DerivedContractTest, ReaderOfAVersionSeesTheNewestTileUpToIt) {
  const TileKey key{0, -3, 5};
  STRATA_ASSERT_OK(PutTile(key, 10, false, "ten"));
  STRATA_ASSERT_OK(PutTile(key, 20, false, "twenty"));
  STRATA_ASSERT_OK(PutTile(key, 30, true, ""));
  STRATA_ASSERT_OK(PutTile({1, -2, 2}, 20, false, "up"));
  EXPECT_FALSE(reader().FindSurfaceTile(key, 9)->has_value());
  EXPECT_EQ(reader().FindSurfaceTile(key, 19)->value().bytes, "ten");
  EXPECT_EQ(reader().FindSurfaceTile(key, 29)->value().bytes, "twenty");
  EXPECT_FALSE(reader().FindSurfaceTile(key, 30)->has_value());
  EXPECT_EQ(reader().ListSurfaceTiles({}, 25)->size(), 1U);
  EXPECT_EQ(reader().ListSurfaceTiles({}, 30)->size(), 0U);
  EXPECT_EQ(reader().ListSurfaceTiles({.level = 1}, 30)->size(), 1U);
  STRATA_ASSERT_OK(Commit([&] { return writer().CollectSurfaceTile(key, 25); }));
  EXPECT_FALSE(reader().FindSurfaceTile(key, 19)->has_value());
  EXPECT_EQ(reader().FindSurfaceTile(key, 25)->value().bytes, "twenty");
  STRATA_ASSERT_OK(Commit([&]() -> absl::Status {
    STRATA_RETURN_IF_ERROR(writer().PublishTiles(20, true));
    return writer().DiscardUnpublished();
  }));
  EXPECT_EQ(reader().FindSurfaceTile(key, 99)->value().bytes, "twenty");
}

TEST_F(DerivedContractTest, ChangesAreToldAfterACommit) {
  const ScanNumber first = Put(1);
  std::uint64_t at = 0;
  STRATA_ASSERT_OK(Commit([&]() -> absl::Status {
    STRATA_ASSIGN_OR_RETURN(at, writer().NextCommitSequence());
    return writer().PutChanges({{at, {"run", 1}, {}, 0, false, false},
                                {at, {}, {0, -3, 5}, at, false, false},
                                {at, {}, {0, 4, -5}, at - 1, true, false},
                                {at, {}, {}, 0, false, true}});
  }));
  EXPECT_FALSE(
      Commit([&]() -> absl::Status {
        STRATA_RETURN_IF_ERROR(writer().PutChanges({{at + 1, {"run", 1}, {}, 0, false, false}}));
        return absl::AbortedError("no");
      }).ok());
  const ScanNumber second = Put(2);
  STRATA_ASSERT_OK_AND_ASSIGN(const StoredChanges all, reader().ListChanges(first));
  // Who has a store alone keeps none.
  EXPECT_EQ(all.complete, storage().number() != 0);
  if (!all.complete) return;
  ASSERT_EQ(all.changes.size(), 5U);
  EXPECT_EQ(all.changes[0].commit_sequence, at);
  EXPECT_EQ(all.changes[0].scan, (ScanId{"run", 1}));
  EXPECT_EQ(all.changes[1].scan.trajectory, "");
  EXPECT_EQ(all.changes[1].tile, (TileKey{0, -3, 5}));
  EXPECT_EQ(all.changes[1].version, at);
  EXPECT_FALSE(all.changes[1].gone);
  EXPECT_EQ(all.changes[2].tile, (TileKey{0, 4, -5}));
  EXPECT_TRUE(all.changes[2].gone);
  EXPECT_FALSE(all.changes[2].inferred);
  EXPECT_TRUE(all.changes[3].inferred);
  EXPECT_EQ(all.changes[4].scan, (ScanId{"run", 2}));
  EXPECT_EQ(all.changes[4].commit_sequence, second);
  EXPECT_EQ(reader().ListChanges(0)->changes.size(), 6U);
  EXPECT_EQ(reader().ListChanges(at)->changes.size(), 1U);
  Reopen();
  EXPECT_TRUE(reader().ListChanges(second)->complete);
  EXPECT_EQ(reader().ListChanges(second)->changes.size(), 0U);
  // What becomes of the tiles then nobody has said.
  STRATA_ASSERT_OK(Commit([&] { return writer().DropDerived(); }));
  EXPECT_FALSE(reader().ListChanges(second)->complete);
}

// As if everything had changed.
TEST_F(DerivedContractTest, TooManyChangesAreNotKept) {
  if (storage().number() == 0) return;
  std::uint64_t at = 0;
  STRATA_ASSERT_OK(Commit([&]() -> absl::Status {
    STRATA_ASSIGN_OR_RETURN(at, writer().NextCommitSequence());
    std::vector<StoredChange> changes;
    for (std::int32_t x = 0; x < 70'000; ++x)
      changes.push_back({at, {}, {0, x, 0}, at, false, false});
    return writer().PutChanges(changes);
  }));
  EXPECT_FALSE(reader().ListChanges(at - 1)->complete);
  EXPECT_TRUE(reader().ListChanges(at)->complete);
}

TEST_F(DerivedContractTest, ScanViewsAreKeptWithTheirScan) {
  const ScanNumber number = Put(1);
  EXPECT_EQ(reader().FindScanView(number)->place, "");
  STRATA_ASSERT_OK(Commit([&] { return writer().PutScanView(number, {"place", "planes"}); }));
  EXPECT_EQ(reader().FindScanView(number)->place, "place");
  EXPECT_EQ(reader().FindScanView(number)->planes, "planes");
  STRATA_ASSERT_OK(Commit([&] { return writer().DeleteScan(number); }));
  EXPECT_EQ(reader().FindScanView(number)->planes, "");
}

TEST_F(DerivedContractTest, DropDerivedKeepsTruth) {
  Put(1);
  STRATA_ASSERT_OK(PutTile({0, 0, 0}, 1, false, "x"));
  STRATA_ASSERT_OK(Commit([&] { return writer().DropDerived(); }));
  EXPECT_FALSE(reader().GetClock()->derived_complete);
  EXPECT_FALSE(reader().FindSurfaceTile({0, 0, 0}, 99)->has_value());
  EXPECT_EQ(reader().GetScanTotals()->scans, 1U);
}

TEST_F(DerivedContractTest, APreparedTileIsFoundOnlyByWhatItIsMadeOf) {
  const TileKey key{0, -3, 7};
  const std::string first("a\0b", 3);  // bytes, not text
  const auto put = [&](const TileKey& at, const std::string& made_of, const std::string& bytes) {
    return Commit([&] { return writer().PutPreparedTile({at, made_of, bytes}); });
  };
  STRATA_ASSERT_OK(put(key, first, "old"));
  STRATA_ASSERT_OK(put({0, -4, 9}, "c", "other"));
  EXPECT_THAT(reader().FindPreparedTile(key, first),
              IsOkAndHolds(::testing::Optional(std::string("old"))));
  EXPECT_THAT(reader().FindPreparedTile(key, "a"), IsOkAndHolds(::testing::Eq(std::nullopt)));
  EXPECT_THAT(reader().FindPreparedTile(key, "c"), IsOkAndHolds(::testing::Eq(std::nullopt)));
  STRATA_ASSERT_OK(put(key, "c", "new"));  // in place of the first
  EXPECT_THAT(reader().FindPreparedTile(key, first), IsOkAndHolds(::testing::Eq(std::nullopt)));
  EXPECT_THAT(reader().FindPreparedTile(key, "c"),
              IsOkAndHolds(::testing::Optional(std::string("new"))));
  Reopen();
  STRATA_ASSERT_OK_AND_ASSIGN(const std::vector<PreparedTileRow> rows,
                              reader().ListPreparedTiles());
  ASSERT_EQ(rows.size(), 2U);
  EXPECT_EQ(rows[0].key, (TileKey{0, -4, 9}));
  EXPECT_EQ(rows[1].key, key);
  EXPECT_EQ(rows[1].made_of, "c");
  EXPECT_TRUE(rows[1].bytes.empty());
  STRATA_ASSERT_OK(Commit([&] { return writer().DeletePreparedTile(key); }));
  EXPECT_THAT(reader().FindPreparedTile(key, "c"), IsOkAndHolds(::testing::Eq(std::nullopt)));
  EXPECT_EQ(reader().ListPreparedTiles()->size(), 1U);
  // Numbers of tiles begin anew then, as far as the store knows.
  STRATA_ASSERT_OK(Commit([&] { return writer().DropDerived(); }));
  EXPECT_TRUE(reader().ListPreparedTiles()->empty());
}

TEST_F(DerivedContractTest, APlaneModelIsKeptUntilTheNextAndNoPartOfAnotherIsFound) {
  EXPECT_THAT(reader().JobOfPlaneModel(), IsOkAndHolds(0U));
  const std::string bytes("a\0b", 3);
  const auto put = [&](std::uint64_t job, const std::string& part) {
    return Commit([&]() -> absl::Status {
      STRATA_RETURN_IF_ERROR(writer().DeletePlaneModel());
      STRATA_RETURN_IF_ERROR(writer().PutPlaneModelPart(job, 0, bytes));
      return writer().PutPlaneModelPart(job, 1, part);
    });
  };
  STRATA_ASSERT_OK(put(7, "seven"));
  STRATA_ASSERT_OK(put(9, "nine"));
  Reopen();
  EXPECT_THAT(reader().JobOfPlaneModel(), IsOkAndHolds(9U));
  EXPECT_THAT(reader().FindPlaneModelPart(9, 0), IsOkAndHolds(::testing::Optional(bytes)));
  EXPECT_THAT(reader().FindPlaneModelPart(9, 1),
              IsOkAndHolds(::testing::Optional(std::string("nine"))));
  EXPECT_THAT(reader().FindPlaneModelPart(9, 2), IsOkAndHolds(::testing::Eq(std::nullopt)));
  EXPECT_THAT(reader().FindPlaneModelPart(7, 1), IsOkAndHolds(::testing::Eq(std::nullopt)));
  STRATA_ASSERT_OK(Commit([&] { return writer().DropDerived(); }));
  EXPECT_THAT(reader().JobOfPlaneModel(), IsOkAndHolds(0U));
}

TEST_F(DerivedContractTest, AnEntityGoesWithTheLastScanThatSawIt) {
  EXPECT_THAT(reader().JobOfEntities(), IsOkAndHolds(0U));
  const ScanNumber one = Put(1);
  const ScanNumber two = Put(2);
  const auto put = [&](std::uint64_t job) {
    return Commit([&]() -> absl::Status {
      STRATA_RETURN_IF_ERROR(writer().DeleteEntities());
      STRATA_RETURN_IF_ERROR(writer().PutEntityPart(job, {0, "head"}, {}));
      STRATA_RETURN_IF_ERROR(writer().PutEntityPart(job, {1, "both"}, {one, two}));
      return writer().PutEntityPart(job, {2, "first"}, {one});
    });
  };
  STRATA_ASSERT_OK(put(7));
  STRATA_ASSERT_OK(put(9));
  Reopen();
  EXPECT_THAT(reader().JobOfEntities(), IsOkAndHolds(9U));
  EXPECT_FALSE(reader().FindEntityPart(7, std::nullopt)->has_value());
  EXPECT_EQ((*reader().FindEntityPart(9, std::nullopt))->bytes, "head");
  EXPECT_EQ((*reader().FindEntityPart(9, 0))->bytes, "both");
  EXPECT_EQ((*reader().FindEntityPart(9, 1))->bytes, "first");
  EXPECT_FALSE(reader().FindEntityPart(9, 2)->has_value());
  STRATA_ASSERT_OK(Commit([&] { return writer().DeleteScan(one); }));
  EXPECT_EQ((*reader().FindEntityPart(9, std::nullopt))->bytes, "head");
  EXPECT_EQ((*reader().FindEntityPart(9, 0))->bytes, "both");
  EXPECT_FALSE(reader().FindEntityPart(9, 1)->has_value());
  STRATA_ASSERT_OK(Commit([&] { return writer().DeleteScan(two); }));
  EXPECT_FALSE(reader().FindEntityPart(9, 0)->has_value());
  EXPECT_THAT(reader().JobOfEntities(), IsOkAndHolds(9U));
}

TEST_F(DerivedContractTest, WhatWasInferredGoesWithAnyScanThatItsKindWasSeenBy) {
  EXPECT_THAT(reader().JobOfInferred(), IsOkAndHolds(0U));
  const ScanNumber one = Put(1);
  const ScanNumber two = Put(2);
  const auto put = [&]() -> absl::Status {
    STRATA_RETURN_IF_ERROR(writer().DeleteInferred());
    STRATA_RETURN_IF_ERROR(writer().PutInferredPart(9, 0, {0, "head"}));
    STRATA_RETURN_IF_ERROR(writer().PutInferredPart(9, 70, {4, "car"}));
    STRATA_RETURN_IF_ERROR(writer().PutInferredPart(9, 71, {5, "bench"}));
    STRATA_RETURN_IF_ERROR(writer().PutInferredScan(70, one));
    STRATA_RETURN_IF_ERROR(writer().PutInferredScan(70, two));
    return writer().PutInferredScan(71, two);
  };
  STRATA_ASSERT_OK(Commit(put));
  STRATA_ASSERT_OK(Commit(put));
  Reopen();
  EXPECT_THAT(reader().JobOfInferred(), IsOkAndHolds(9U));
  EXPECT_EQ((*reader().FindInferredPart(9, std::nullopt))->bytes, "head");
  EXPECT_EQ((*reader().FindInferredPart(9, 0))->bytes, "car");
  EXPECT_EQ((*reader().FindInferredPart(9, 4))->bytes, "bench");
  EXPECT_FALSE(reader().FindInferredPart(9, 5)->has_value());
  STRATA_ASSERT_OK(Commit([&] { return writer().DeleteScan(one); }));
  EXPECT_EQ((*reader().FindInferredPart(9, std::nullopt))->bytes, "head");
  EXPECT_EQ((*reader().FindInferredPart(9, 0))->bytes, "bench");
  STRATA_ASSERT_OK(Commit([&] { return writer().DeleteEntities(); }));
  EXPECT_THAT(reader().JobOfInferred(), IsOkAndHolds(0U));
}

TEST_F(DerivedContractTest, KindsOfTheLibraryAreKeptAndFoundOnesGoWithTheEntities) {
  const auto ids = [&] {
    std::vector<std::string> names;
    const auto kinds = reader().ListKinds();
    STRATA_EXPECT_OK(kinds);
    if (!kinds.ok()) return names;
    for (const KindRow& row : *kinds) {
      names.push_back(absl::StrCat(row.id, row.in_library ? " " : " found", row.name, row.info));
    }
    return names;
  };
  EXPECT_THAT(ids(), ElementsAre());
  STRATA_ASSERT_OK(Commit([&]() -> absl::Status {
    STRATA_RETURN_IF_ERROR(writer().PutKind({9, "golf", true, "+"}, std::string("s\0h", 3)));
    STRATA_RETURN_IF_ERROR(writer().PutFoundKind({4, "", false, "-"}, "found"));
    return writer().PutFoundKind({9, "", false, "-"}, "hidden");
  }));
  Reopen();
  EXPECT_THAT(ids(), ElementsAre("9 golf+", "4 found-"));
  EXPECT_EQ(**reader().FindKindShape(9), std::string("s\0h", 3));
  EXPECT_EQ(**reader().FindKindShape(4), "found");
  EXPECT_FALSE(reader().FindKindShape(5)->has_value());
  const auto put = [&](std::uint64_t id, const std::string& name) {
    return Commit([&] { return writer().PutKind({id, name, true, "+"}, "x"); });
  };
  EXPECT_THAT(put(9, "other"), StatusIs(absl::StatusCode::kAlreadyExists, HasSubstr("other")));
  EXPECT_THAT(put(10, "golf"), StatusIs(absl::StatusCode::kAlreadyExists, HasSubstr("golf")));
  STRATA_ASSERT_OK(put(4, "van"));
  EXPECT_THAT(Commit([&] { return writer().RenameKind(4, "golf"); }),
              StatusIs(absl::StatusCode::kAlreadyExists, HasSubstr("golf")));
  STRATA_ASSERT_OK(Commit([&] { return writer().RenameKind(4, "bus"); }));
  EXPECT_THAT(ids(), ElementsAre("4 bus+", "9 golf+"));
  STRATA_ASSERT_OK(Commit([&] { return writer().DeleteKind(9); }));
  EXPECT_THAT(ids(), ElementsAre("4 bus+", "9 found-"));
  STRATA_ASSERT_OK(Commit([&] { return writer().DeleteEntities(); }));
  EXPECT_THAT(ids(), ElementsAre("4 bus+"));
  STRATA_ASSERT_OK(Commit([&] { return writer().PutFoundKind({5, "", false, "-"}, "found"); }));
  STRATA_ASSERT_OK(Commit([&] { return writer().DropDerived(); }));
  EXPECT_THAT(ids(), ElementsAre("4 bus+"));
  EXPECT_EQ(**reader().FindKindShape(4), "x");
}

TEST_F(DerivedContractTest, FullStatisticsAreReadByVersion) {
  MlsTileRow row;
  row.key = {0, -3, 5};
  row.patches = 4;
  row.cells = 3;
  row.spread_weight = 0.1;
  row.spread_sum = 1.0 / 3.0;
  row.box.extend(Eigen::Vector3d(-1e7, 2, 3));
  row.box.extend(Eigen::Vector3d(1, 2.5, 1e-300));
  row.digest = "d";
  for (const std::uint64_t version : {10, 20, 30}) {
    row.version = version;
    row.bytes = std::string("b\0", 2) + std::to_string(version);
    STRATA_ASSERT_OK(Commit([&] { return writer().PutMlsTile(row); }));
  }
  row.key = {0, 7, -8};
  STRATA_ASSERT_OK(Commit([&] { return writer().PutMlsTile(row); }));
  const TileKey key{0, -3, 5};
  EXPECT_FALSE(reader().FindMlsTile(key, 9)->has_value());
  STRATA_ASSERT_OK_AND_ASSIGN(const std::optional<MlsTileRow> found, reader().FindMlsTile(key, 29));
  ASSERT_TRUE(found.has_value());
  EXPECT_EQ(found->version, 20U);
  EXPECT_EQ(found->bytes, std::string("b\0", 2) + "20");
  EXPECT_EQ(found->box.min(), row.box.min());
  EXPECT_EQ(found->box.max(), row.box.max());
  EXPECT_EQ(found->spread_sum, 1.0 / 3.0);
  EXPECT_EQ(found->digest, "d");
  STRATA_ASSERT_OK_AND_ASSIGN(const std::vector<MlsTileRow> rows, reader().ListMlsTiles(25));
  ASSERT_EQ(rows.size(), 1U);
  EXPECT_EQ(rows[0].version, 20U);
  EXPECT_TRUE(rows[0].bytes.empty());
  EXPECT_EQ(reader().ListMlsTiles(30)->size(), 2U);
  STRATA_ASSERT_OK(Commit([&] { return writer().DeleteOlderMlsTiles(key, 20); }));
  EXPECT_FALSE(reader().FindMlsTile(key, 19)->has_value());
  STRATA_ASSERT_OK(Commit([&]() -> absl::Status {
    STRATA_RETURN_IF_ERROR(writer().PublishTiles(20, true));
    return writer().DiscardUnpublished();
  }));
  EXPECT_EQ(reader().ListMlsTiles(99)->size(), 1U);
  STRATA_ASSERT_OK(Commit([&] { return writer().DeleteMlsTile(key); }));
  EXPECT_TRUE(reader().ListMlsTiles(99)->empty());
}

TEST_F(DerivedContractTest, CollectedTilesAreThoseNobodySees) {
  const TileKey one{0, 1, 1}, two{3, -1, 0}, gone{0, 2, 2};
  for (const TileKey& key : {one, two, gone}) {
    STRATA_ASSERT_OK(PutTile(key, 1, false, "1"));
    STRATA_ASSERT_OK(PutTile(key, 5, key == gone, key == gone ? "" : "5"));
  }
  STRATA_ASSERT_OK(PutTile(one, 9, false, "9"));
  STRATA_ASSERT_OK(Commit([&] { return writer().CollectAllSurfaceTiles(6); }));
  EXPECT_FALSE(reader().FindSurfaceTile(one, 4)->has_value());
  EXPECT_EQ(reader().FindSurfaceTile(one, 6)->value().bytes, "5");
  EXPECT_EQ(reader().FindSurfaceTile(one, 9)->value().size_bytes, 1U);
  EXPECT_EQ(reader().FindSurfaceTile(two, 6)->value().bytes, "5");
  EXPECT_FALSE(reader().FindSurfaceTile(gone, 4)->has_value());
}

TEST_F(DerivedContractTest, RelationsGoBothWaysAndOrphansOfThemGo) {
  const ScanNumber a = Put(1);
  const ScanNumber b = Put(2);
  STRATA_ASSERT_OK(Commit([&]() -> absl::Status {
    STRATA_RETURN_IF_ERROR(writer().SetTilesOfScan(a, {{0, 9, 9}}));
    STRATA_RETURN_IF_ERROR(writer().SetTilesOfScan(a, {{0, 5, -2}, {0, -7, 3}, {0, -7, 2}}));
    STRATA_RETURN_IF_ERROR(writer().SetTilesOfScan(b, {{0, 5, -2}}));
    STRATA_RETURN_IF_ERROR(writer().SetTilesOfScan(77, {{0, 5, -2}}));
    STRATA_RETURN_IF_ERROR(writer().SetFootprint(
        77, Eigen::AlignedBox2d(Eigen::Vector2d(0, 0), Eigen::Vector2d(1, 1))));
    return writer().PutScanView(77, {"p", "q"});
  }));
  EXPECT_THAT(reader().TilesOfScan(a),
              IsOkAndHolds(ElementsAre(TileKey{0, -7, 2}, TileKey{0, -7, 3}, TileKey{0, 5, -2})));
  EXPECT_THAT(reader().ScansOfTile({0, 5, -2}), IsOkAndHolds(ElementsAre(a, b, 77)));
  EXPECT_THAT(reader().ScansOfTile({0, 9, 9}), IsOkAndHolds(ElementsAre()));
  STRATA_ASSERT_OK(Commit([&] { return writer().DeleteOrphanIndexes(); }));
  EXPECT_THAT(reader().ScansOfTile({0, 5, -2}), IsOkAndHolds(ElementsAre(a, b)));
  EXPECT_FALSE(reader().FootprintOfScan(77)->has_value());
  EXPECT_EQ(reader().FindScanView(77)->place, "");
}

}  // namespace
}  // namespace strata::testing
