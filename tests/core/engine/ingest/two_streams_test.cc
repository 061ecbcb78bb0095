// Streams that claim to send the same scan: what one of them sends never becomes part of what
// another one announced.
#include <cstddef>
#include <cstdint>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/api/database.h"
#include "core/cloud/cloud_slice.h"
#include "core/world/scan_hash.h"
#include "tests/core/engine/engine_fixture.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

using ::testing::HasSubstr;
using Code = absl::StatusCode;

enum Columns : unsigned { kIntensity = 1, kColour = 2, kLabel = 4 };

PointCloud WithColumns(const PointCloud& points, unsigned columns) {
  PointCloud cloud = points;
  if ((columns & kIntensity) != 0) cloud.intensity.assign(cloud.size(), 0.5F);
  if ((columns & kColour) != 0) cloud.colour.assign(cloud.size(), {1, 2, 3});
  if ((columns & kLabel) != 0) cloud.label.assign(cloud.size(), 4);
  return cloud;
}

class TwoStreamsTest : public EngineTest {
 protected:
  void SetUp() override { MakeMap(); }

  std::unique_ptr<api::ScanUpload> Begin(const ScanHeader& header) {
    auto upload = db().scans().Upload({}, kMapName, header);
    return upload.ok() ? *std::move(upload) : nullptr;
  }
  // Every stored scan has the columns of its header, as long as its points.
  void ExpectWholeColumns(const ScanId& id) {
    const auto found = db().scans().Get({}, kMapName, id);
    if (absl::IsNotFound(found.status())) return;
    STRATA_ASSERT_OK(found);
    const ScanHeader& header = found->header;
    std::size_t points = 0;
    STRATA_EXPECT_OK(db().scans().GetPoints({}, kMapName, id, [&](const PointCloud& piece) {
      points += piece.size();
      EXPECT_EQ(piece.intensity.size(), header.has_intensity ? piece.size() : 0);
      EXPECT_EQ(piece.colour.size(), header.has_colour ? piece.size() : 0);
      EXPECT_EQ(piece.label.size(), header.has_label ? piece.size() : 0);
      return absl::OkStatus();
    }));
    EXPECT_EQ(points, header.point_count);
  }

  const PointCloud points_ = MakeRoom(1, 3000);
};

// The hash is that of a lie: colours of one point, coordinates of all. It was accepted, and what
// came back as the other colours was the server's memory.
TEST_F(TwoStreamsTest, AHashSharedWithAnotherHeaderSharesNothingElse) {
  const PointCloud coloured = WithColumns(points_, kColour);
  ScanHeader plain = HeaderOf({"run", 1}, points_, PoseAt(0, 0));
  ScanHeader with_colour = HeaderOf({"run", 1}, coloured, PoseAt(0, 0));
  PointCloud lie = points_;
  lie.colour = {coloured.colour[0]};
  ScanHasher hasher;
  hasher.Add(lie);
  plain.content_hash = with_colour.content_hash = hasher.Digest(plain);

  const auto first = Begin(with_colour);
  STRATA_ASSERT_OK(first->Write(SliceOf(coloured, 0, 1)));
  const auto second = Begin(plain);
  EXPECT_EQ(second->points_held(), 0U);
  STRATA_ASSERT_OK(second->Write(SliceOf(points_, 1, points_.size())));
  EXPECT_THAT(second->Finish(), StatusIs(Code::kInvalidArgument, HasSubstr("announced 3000")));
  STRATA_ASSERT_OK(first->Write(SliceOf(coloured, 1, coloured.size())));
  EXPECT_THAT(first->Finish(), StatusIs(Code::kInvalidArgument, HasSubstr("content_hash")));
  EXPECT_THAT(db().scans().Get({}, kMapName, plain.id), StatusIs(Code::kNotFound, HasSubstr("")));
}

TEST_F(TwoStreamsTest, ALieLeftBehindDoesNotKeepTheTruthOut) {
  const PointCloud cloud = MakeRoom(2, 60'000);
  ScanHeader header = HeaderOf({"run", 1}, cloud, PoseAt(0, 0));
  header.content_hash = ContentHashOf(header, cloud);
  ScanHeader lie = header;
  lie.has_intensity = true;
  for (const ScanHeader& claimed : {lie, header, lie}) {
    const auto upload = Begin(claimed);
    const unsigned columns = claimed.has_intensity ? kIntensity : 0U;
    STRATA_ASSERT_OK(upload->Write(WithColumns(SliceOf(cloud, 0, 40'000), columns)));
    STRATA_ASSERT_OK(upload->Write(WithColumns(SliceOf(cloud, 40'000, 50'000), columns)));
  }
  STRATA_ASSERT_OK_AND_ASSIGN(const ScanAck ack, Upload(db(), header, cloud));
  EXPECT_FALSE(ack.already_present);
  ExpectWholeColumns(header.id);
  WaitIntegrated(db());
  ExpectSound();
}

// Some streams of one scan at once, of whatever columns, counts and claims, with pieces that fit
// and that do not, in any order. The address sanitizer looks on.
TEST_F(TwoStreamsTest, RandomStreamsOfOneScanStoreOnlyWholeColumns) {
  std::mt19937_64 random(17);
  const auto below = [&](std::size_t n) { return static_cast<std::size_t>(random() % n); };
  struct Stream {
    unsigned columns;
    std::unique_ptr<api::ScanUpload> upload;
  };
  int stored = 0;
  for (std::uint64_t scan = 1; scan <= 100; ++scan) {
    const ScanId id{"run", scan};
    const PointCloud some = SliceOf(points_, 0, 1 + below(300));
    std::vector<std::string> claims = {""};
    for (unsigned columns = 0; columns < 8; ++columns) {
      const PointCloud cloud = WithColumns(some, columns);
      claims.push_back(ContentHashOf(HeaderOf(id, cloud, PoseAt(0, 0)), cloud));
    }
    std::vector<Stream> streams;
    for (int step = 0; step < 40; ++step) {
      if (streams.size() < 2 || below(8) == 0) {
        const auto columns = static_cast<unsigned>(below(8));
        ScanHeader header = HeaderOf(id, WithColumns(some, columns), PoseAt(0, 0));
        header.content_hash = claims[below(3) == 0 ? 1 + columns : below(claims.size())];
        if (below(10) == 0) header.point_count = 1 + below(400);
        if (auto upload = Begin(header); upload != nullptr) {
          streams.push_back({columns, std::move(upload)});
        }
        continue;
      }
      const std::size_t which = below(streams.size());
      Stream& stream = streams[which];
      const std::size_t begin = below(2) == 0 ? stream.upload->points_held() : below(some.size());
      if (below(6) == 0) {
        stored += stream.upload->Finish().ok() ? 1 : 0;
        streams.erase(streams.begin() + static_cast<std::ptrdiff_t>(which));
      } else if (begin < some.size()) {
        const unsigned columns = below(10) == 0 ? static_cast<unsigned>(below(8)) : stream.columns;
        const std::size_t end = begin + 1 + below(some.size() - begin);
        stream.upload->Write(WithColumns(SliceOf(some, begin, end), columns)).IgnoreError();
      }
    }
    streams.clear();
    ExpectWholeColumns(id);
  }
  EXPECT_GT(stored, 0);
  WaitIntegrated(db());
  ExpectSound();
}

}  // namespace
}  // namespace strata::testing
