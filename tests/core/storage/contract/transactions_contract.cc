// Commits, their parts, and what readers see of them.
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
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

class TransactionsContractTest : public StorageContractTest {};

TEST_F(TransactionsContractTest, ASnapshotSeesOneStateAndThenTheNewest) {
  Put(1);
  STRATA_ASSERT_OK(reader().Snapshot([&]() -> absl::Status {
    EXPECT_EQ(reader().GetScanTotals()->scans, 1U);
    Put(2);
    EXPECT_EQ(reader().GetScanTotals()->scans, 1U);
    EXPECT_EQ(reader().ListScanNumbers()->size(), 1U);
    EXPECT_FALSE(reader().FindScan({"run", 2}, 1)->has_value());
    return absl::OkStatus();
  }));
  EXPECT_EQ(reader().GetScanTotals()->scans, 2U);
  EXPECT_THAT(reader().Snapshot([] { return absl::AbortedError("enough"); }),
              StatusIs(absl::StatusCode::kAborted, HasSubstr("enough")));
  EXPECT_EQ(reader().GetScanTotals()->scans, 2U);
}

TEST_F(TransactionsContractTest, ALongSnapshotIsOne) {
  Put(1);
  STRATA_ASSERT_OK(reader().LongSnapshot([&]() -> absl::Status {
    EXPECT_EQ(reader().GetScanTotals()->scans, 1U);
    Put(2);
    EXPECT_EQ(reader().ListScanNumbers()->size(), 1U);
    return absl::OkStatus();
  }));
  EXPECT_EQ(reader().ListScanNumbers()->size(), 2U);
}

// The queue of the engine's writer is one commit of many parts.
TEST_F(TransactionsContractTest, PartsThatFailLeaveTheOthers) {
  Put(1);
  const auto put = [&](std::uint64_t sequence, std::uint64_t upload) {
    return writer().Part([&]() -> absl::Status {
      ScanRecord scan = Scan(sequence);
      scan.upload = upload;
      STRATA_ASSIGN_OR_RETURN(scan.number, writer().NextCommitSequence());
      STRATA_RETURN_IF_ERROR(writer().PutChunk(upload, 0, "part"));
      return writer().PutScan(scan);
    });
  };
  STRATA_ASSERT_OK(Commit([&]() -> absl::Status {
    for (std::uint64_t i = 2; i <= 40; ++i) {
      if (i % 3 == 0) {
        EXPECT_THAT(put(1, 100 + i),
                    StatusIs(absl::StatusCode::kAlreadyExists, HasSubstr("run/1")));
        // A piece that is there already.
        EXPECT_THAT(writer().Part([&] { return writer().PutChunk(1, 0, "again"); }),
                    StatusIs(absl::StatusCode::kAlreadyExists, ::testing::_));
      } else {
        STRATA_EXPECT_OK(put(i, i));
      }
    }
    return absl::OkStatus();
  }));
  EXPECT_EQ(reader().GetScanTotals()->scans, 27U);
  EXPECT_THAT(reader().GetChunk(1, 0), IsOkAndHolds(std::string("bytes")));
  EXPECT_FALSE(reader().GetChunk(103, 0).ok());
  EXPECT_EQ(reader().GetClock()->commit_sequence, 27U);  // what failed has ticked nothing
}

TEST_F(TransactionsContractTest, ARelaxedCommitIsSeenAtOnceAndByALaterStart) {
  STRATA_ASSERT_OK(
      writer().Commit(Durability::kRelaxed, [&] { return writer().PutChunk(3, 0, "a"); }));
  EXPECT_THAT(reader().GetChunk(3, 0), IsOkAndHolds(std::string("a")));
  Reopen();
  EXPECT_THAT(reader().GetChunk(3, 0), IsOkAndHolds(std::string("a")));
}

TEST_F(TransactionsContractTest, ManyReadersSeeTheSame) {
  const ScanNumber number = Put(1);
  std::vector<std::unique_ptr<StorageReader>> readers;
  for (int i = 0; i < 12; ++i) {
    STRATA_ASSERT_OK_AND_ASSIGN(std::unique_ptr<StorageReader> made, storage().NewReader());
    readers.push_back(std::move(made));
  }
  for (const auto& one : readers) {
    EXPECT_THAT(one->ListScanNumbers(), IsOkAndHolds(ElementsAre(number)));
  }
}

// The writer of an engine may come again with the same work.
TEST_F(TransactionsContractTest, ABodyThatFailedMayRunAgain) {
  int runs = 0;
  const auto body = [&]() -> absl::Status {
    ++runs;
    STRATA_RETURN_IF_ERROR(writer().PutChunk(5, 0, "five"));
    return runs == 1 ? absl::UnavailableError("not yet") : absl::OkStatus();
  };
  EXPECT_THAT(Commit(body), StatusIs(absl::StatusCode::kUnavailable, HasSubstr("not yet")));
  EXPECT_FALSE(reader().GetChunk(5, 0).ok());
  STRATA_ASSERT_OK(Commit(body));
  EXPECT_EQ(runs, 2);
}

TEST_F(TransactionsContractTest, APieceIsAtMostAMebibyte) {
  const std::string largest(std::size_t{1} << 20, 'x');
  STRATA_ASSERT_OK(Commit([&] { return writer().PutChunk(5, 0, largest); }));
  EXPECT_THAT(reader().GetChunk(5, 0), IsOkAndHolds(largest));
  EXPECT_FALSE(Commit([&] { return writer().PutChunk(5, 1, largest + "x"); }).ok());
}

}  // namespace
}  // namespace strata::testing
