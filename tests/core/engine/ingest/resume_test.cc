// Uploads of announced scans that break off go on where they were.
#include <algorithm>
#include <cstdint>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "absl/status/status.h"
#include "absl/time/clock.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/api/database.h"
#include "core/cloud/cloud_slice.h"
#include "core/common/status.h"
#include "core/world/scan_hash.h"
#include "tests/core/engine/engine_fixture.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

using ::testing::HasSubstr;
using Code = absl::StatusCode;

constexpr std::size_t kChunk = 7'000;  // no divisor of the pieces on disk

class ResumeTest : public EngineTest {
 protected:
  void SetUp() override { MakeMap(); }

  ScanHeader Announce(std::uint64_t sequence) const {
    ScanHeader header = HeaderOf({"run", sequence}, cloud_, PoseAt(3.0, 1.0, 0.4));
    header.content_hash = ContentHashOf(header, cloud_);
    return header;
  }
  std::unique_ptr<api::ScanUpload> Begin(const ScanHeader& header) {
    auto upload = db().scans().Upload({}, kMapName, header);
    EXPECT_THAT(upload, IsOk());
    return upload.ok() ? *std::move(upload) : nullptr;
  }
  // Writes what the upload lacks up to point `end`.
  absl::Status WriteUpTo(api::ScanUpload& upload, std::size_t end) const {
    for (std::size_t begin = upload.points_held(); begin < end; begin += kChunk) {
      STRATA_RETURN_IF_ERROR(upload.Write(SliceOf(cloud_, begin, std::min(end, begin + kChunk))));
    }
    return absl::OkStatus();
  }
  void Break(const ScanHeader& header, std::size_t end) {
    STRATA_EXPECT_OK(WriteUpTo(*Begin(header), end));
  }
  std::uint64_t Held(const ScanHeader& header) { return Begin(header)->points_held(); }
  void Complete(const ScanHeader& header) {
    const auto upload = Begin(header);
    STRATA_ASSERT_OK(WriteUpTo(*upload, cloud_.size()));
    STRATA_ASSERT_OK_AND_ASSIGN(const ScanAck ack, upload->Finish());
    EXPECT_EQ(ack.content_hash, header.content_hash);
    EXPECT_FALSE(ack.already_present);
  }
  void ExpectStoredAsSent(const ScanId& id) {
    std::vector<Eigen::Vector3f> points;
    STRATA_EXPECT_OK(db().scans().GetPoints({}, kMapName, id, [&](const PointCloud& piece) {
      points.insert(points.end(), piece.points.begin(), piece.points.end());
      return absl::OkStatus();
    }));
    EXPECT_EQ(points, cloud_.points);
  }

  const PointCloud cloud_ = MakeRoom(1, 60'000);
};

TEST_F(ResumeTest, GoesOnAtEveryPlaceWhereItCanBreak) {
  std::uint64_t sequence = 0;
  for (std::size_t end = 0; end < cloud_.size(); end += kChunk) {
    const ScanHeader header = Announce(++sequence);
    Break(header, end);
    if (sequence % 3 == 0) Reopen();
    EXPECT_EQ(Held(header), end);
    Complete(header);
    ExpectStoredAsSent(header.id);
  }
  WaitIntegrated(db());
  ExpectSound();
}

TEST_F(ResumeTest, TheMapIsThatOfAnUndisturbedUpload) {
  const ScanHeader header = Announce(1);
  Break(header, 5 * kChunk);
  Reopen();
  Complete(header);
  const std::string disturbed = Digest();
  STRATA_ASSERT_OK(db().maps().Delete({}, kMapName));
  MakeMap();
  Complete(header);
  EXPECT_EQ(Digest(), disturbed);
}

TEST_F(ResumeTest, BreaksInARowAddUp) {
  const ScanHeader header = Announce(1);
  for (std::size_t end = 0; end < cloud_.size(); end += 2 * kChunk + 11) {
    Break(header, end);
    EXPECT_EQ(Held(header), end);
  }
  Complete(header);
  ExpectStoredAsSent(header.id);
}

TEST_F(ResumeTest, WhatIsLeftIsFoundInWhateverOrderItsStreamsEnd) {
  const ScanHeader header = Announce(1);
  auto older = Begin(header);
  STRATA_ASSERT_OK(WriteUpTo(*older, 2 * kChunk));
  auto newer = Begin(header);
  STRATA_ASSERT_OK(WriteUpTo(*newer, 4 * kChunk));
  newer = nullptr;
  older = nullptr;
  EXPECT_EQ(Held(header), 4 * kChunk);
  Complete(header);
  ExpectStoredAsSent(header.id);
}

// What was put to disk of an upload that broke off is the scan's own once it is whole.
TEST_F(ResumeTest, WhatHasBecomeAScanIsNotDroppedAsStale) {
  EngineOptions options = Options();
  options.upload_keep = absl::Milliseconds(300);
  Reopen(options);
  const ScanHeader header = Announce(1);
  Break(header, 5 * kChunk);
  Complete(header);
  absl::SleepFor(absl::Milliseconds(350));
  EXPECT_EQ(Held(Announce(2)), 0U);  // drops what is stale
  ExpectStoredAsSent(header.id);
}

TEST_F(ResumeTest, AnAnnouncedScanThatIsThereNeedsNoPoints) {
  ScanHeader header = Announce(1);
  Complete(header);
  const auto again = Begin(header);
  EXPECT_EQ(again->points_held(), cloud_.size());
  STRATA_ASSERT_OK_AND_ASSIGN(const ScanAck ack, again->Finish());
  EXPECT_TRUE(ack.already_present);
  EXPECT_EQ(ack.content_hash, header.content_hash);
  EXPECT_THAT(again->Write(SliceOf(cloud_, 0, 1)),
              StatusIs(Code::kInvalidArgument, HasSubstr("every point is there")));

  header.content_hash = std::string(32, '0');
  EXPECT_THAT(db().scans().Upload({}, kMapName, header),
              StatusIs(Code::kAlreadyExists, HasSubstr("run/1")));
}

TEST_F(ResumeTest, AnotherHashThanAnnouncedKeepsNothing) {
  ScanHeader header = Announce(1);
  const std::string right = header.content_hash;
  header.content_hash = std::string(32, 'e');
  const auto upload = Begin(header);
  STRATA_ASSERT_OK(WriteUpTo(*upload, cloud_.size()));
  EXPECT_THAT(
      upload->Finish(),
      StatusIs(Code::kInvalidArgument,
               AllOf(HasSubstr("run/1"), HasSubstr(right), HasSubstr(header.content_hash))));
  EXPECT_EQ(Held(header), 0U);
  EXPECT_THAT(db().scans().Get({}, kMapName, header.id), StatusIs(Code::kNotFound, HasSubstr("")));
  header.content_hash = right;
  Complete(header);
}

TEST_F(ResumeTest, BadHashesAndBadPointsAreRefused) {
  ScanHeader header = Announce(1);
  for (const std::string& bad : {std::string("12"), std::string(32, 'E'), std::string(33, '1')}) {
    header.content_hash = bad;
    EXPECT_THAT(db().scans().Upload({}, kMapName, header),
                StatusIs(Code::kInvalidArgument, HasSubstr(bad)));
  }
  header = Announce(1);
  Break(header, 2 * kChunk);
  {
    const auto upload = Begin(header);
    PointCloud bad = SliceOf(cloud_, 0, kChunk);
    bad.points[5].x() = 1e9F;
    EXPECT_THAT(upload->Write(bad), StatusIs(Code::kInvalidArgument, HasSubstr("point 14005")));
  }
  EXPECT_EQ(Held(header), 0U);  // nothing of it can be trusted
  Complete(header);
}

TEST_F(ResumeTest, TheLaterOfTwoStreamsTakesOver) {
  const ScanHeader header = Announce(1);
  const auto first = Begin(header);
  STRATA_ASSERT_OK(WriteUpTo(*first, 3 * kChunk));
  const auto second = Begin(header);
  EXPECT_EQ(second->points_held(), 3 * kChunk);
  EXPECT_THAT(first->Write(SliceOf(cloud_, 3 * kChunk, 4 * kChunk)),
              StatusIs(Code::kAborted, HasSubstr("taken over")));
  EXPECT_THAT(first->Finish(), StatusIs(Code::kAborted, HasSubstr("run/1")));
  STRATA_ASSERT_OK(WriteUpTo(*second, cloud_.size()));
  STRATA_ASSERT_OK(second->Finish());
  ExpectStoredAsSent(header.id);
}

TEST_F(ResumeTest, ManyStreamsOfOneScanMakeOneScan) {
  const ScanHeader header = Announce(1);
  std::vector<std::thread> threads;
  for (int i = 0; i < 4; ++i) {
    threads.emplace_back([&] {
      const auto send = [&]() -> absl::Status {
        STRATA_ASSIGN_OR_RETURN(const auto upload, db().scans().Upload({}, kMapName, header));
        STRATA_RETURN_IF_ERROR(WriteUpTo(*upload, cloud_.size()));
        return upload->Finish().status();
      };
      absl::Status sent = send();
      while (absl::IsAborted(sent) || absl::IsFailedPrecondition(sent)) sent = send();
      STRATA_EXPECT_OK(sent);
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(WaitIntegrated(db()).scans, 1U);
  ExpectStoredAsSent(header.id);
  ExpectSound();
}

TEST_F(ResumeTest, WhatIsNotResumedInTimeGoes) {
  const ScanHeader header = Announce(1);
  Break(header, 5 * kChunk);
  EngineOptions options = Options();
  options.upload_keep = absl::Milliseconds(1);
  absl::SleepFor(absl::Milliseconds(5));
  Reopen(options);
  EXPECT_EQ(Held(header), 0U);
  options.upload_keep = absl::ZeroDuration();
  Reopen(options);
  Break(header, 5 * kChunk);
  EXPECT_EQ(Held(header), 0U);
  Complete(header);
}

TEST_F(ResumeTest, BeyondTheBoundTheOldestGoes) {
  for (const std::uint64_t sequence : {1, 2, 3}) Break(Announce(sequence), 5 * kChunk);
  Break(Announce(1), 6 * kChunk);  // the youngest now
  EngineOptions options = Options();
  options.max_kept_upload_bytes = (5 + 6) * kChunk * 12;  // compressed they are a little less
  Reopen(options);
  EXPECT_EQ(Held(Announce(2)), 0U);
  EXPECT_EQ(Held(Announce(3)), 5 * kChunk);
  EXPECT_EQ(Held(Announce(1)), 6 * kChunk);
}

TEST_F(ResumeTest, DamagedPiecesAreSentAgain) {
  const ScanHeader header = Announce(1);
  Break(header, 8 * kChunk);
  Close();
  Sql("UPDATE truth_chunk SET bytes = zeroblob(length(bytes)) WHERE ordinal = 1");
  Reopen();
  EXPECT_EQ(Held(header), 0U);
  Complete(header);
  ExpectStoredAsSent(header.id);
  ExpectSound();
}

}  // namespace
}  // namespace strata::testing
