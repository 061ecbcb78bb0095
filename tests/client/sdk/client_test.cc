#include "client/sdk/client.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "absl/synchronization/notification.h"
#include "absl/time/clock.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/client/sdk/connected_mock.h"

namespace strata {
namespace {

using ::strata::testing::IsOk;
using ::strata::testing::StatusIs;
using ::testing::_;
using ::testing::HasSubstr;
using ::testing::Return;
using Code = absl::StatusCode;

using ClientTest = sdk::ConnectedMock;

TEST_F(ClientTest, LookupsAreRepeatedUntilTheServerIsBack) {
  EXPECT_CALL(behind_.maps(), List(_))
      .WillOnce(Return(absl::UnavailableError("starting")))
      .WillOnce(Return(absl::UnavailableError("starting")))
      .WillOnce(Return(std::vector<MapInfo>()));
  EXPECT_THAT(client_->maps().List({}), IsOk());
}

TEST_F(ClientTest, WhatMayHaveHappenedIsNotRepeated) {
  const absl::Status away = absl::UnavailableError("away");
  EXPECT_CALL(behind_.maps(), Create(_, _, _)).WillOnce(Return(away));
  EXPECT_CALL(behind_.maps(), Delete(_, _)).WillOnce(Return(away));
  EXPECT_CALL(behind_.jobs(), Start(_, _, _, _)).WillOnce(Return(away));
  EXPECT_CALL(behind_.jobs(), Accept(_, _, _)).WillOnce(Return(away));
  EXPECT_CALL(behind_.jobs(), Revert(_, _, _)).WillOnce(Return(away));
  EXPECT_CALL(behind_.scans(), Delete(_, _, _)).WillOnce(Return(away));
  EXPECT_THAT(client_->maps().Create({}, "m", {}), StatusIs(Code::kUnavailable, "away"));
  EXPECT_THAT(client_->maps().Delete({}, "m"), StatusIs(Code::kUnavailable, "away"));
  EXPECT_THAT(client_->jobs().Start({}, "m", "verify", {}), StatusIs(Code::kUnavailable, "away"));
  EXPECT_THAT(client_->jobs().Accept({}, "m", 1), StatusIs(Code::kUnavailable, "away"));
  EXPECT_THAT(client_->jobs().Revert({}, "m", 1), StatusIs(Code::kUnavailable, "away"));
  EXPECT_THAT(client_->scans().Delete({}, "m", {"r", 1}), StatusIs(Code::kUnavailable, "away"));
}

TEST_F(ClientTest, AStreamIsNotRepeatedOnceItDelivered) {
  EXPECT_CALL(behind_.scans(), GetPoints(_, _, _, _))
      .WillOnce(Return(absl::UnavailableError("starting")))
      .WillOnce([](auto&, auto, auto&, ::strata::testing::Sink<PointCloud> sink) {
        PointCloud piece;
        piece.points.assign(3, Eigen::Vector3f::Zero());
        STRATA_EXPECT_OK(sink(piece));
        return absl::UnavailableError("gone");
      });
  int points = 0;
  const auto count = [&points](const PointCloud& piece) {
    points += static_cast<int>(piece.size());
    return absl::OkStatus();
  };
  EXPECT_THAT(client_->scans().GetPoints({}, "m", {"r", 1}, count),
              StatusIs(Code::kUnavailable, "gone"));
  EXPECT_EQ(points, 3);
}

TEST_F(ClientTest, AnUploadIsSentAgainFromItsStart) {
  int attempts = 0;
  ON_CALL(behind_.scans(), Upload(_, _, _))
      .WillByDefault([&attempts](auto&, auto, const ScanHeader& header)
                         -> absl::StatusOr<std::unique_ptr<api::ScanUpload>> {
        auto upload = std::make_unique<::testing::NiceMock<::strata::testing::MockScanUpload>>();
        EXPECT_CALL(*upload, Write(_)).Times(2);
        ++attempts;
        EXPECT_CALL(*upload, Finish())
            .WillOnce(Return(attempts == 1
                                 ? absl::StatusOr<ScanAck>(absl::ResourceExhaustedError("full"))
                                 : absl::StatusOr<ScanAck>(ScanAck{header.id, 5, false, ""})));
        return upload;
      });
  PointCloud chunk;
  chunk.points.assign(4, Eigen::Vector3f::Zero());
  ScanHeader header;
  header.id = {"run", 3};
  header.point_count = 8;
  auto upload = client_->scans().Upload({}, "m", header);
  ASSERT_THAT(upload, IsOk());
  STRATA_ASSERT_OK((*upload)->Write(chunk));
  STRATA_ASSERT_OK((*upload)->Write(chunk));
  STRATA_ASSERT_OK_AND_ASSIGN(const ScanAck ack, (*upload)->Finish());
  EXPECT_EQ(ack.commit_sequence, 5U);
  EXPECT_EQ(attempts, 2);
}

TEST_F(ClientTest, AnAnnouncedUploadGoesOnBehindWhatTheServerHas) {
  std::vector<std::vector<float>> attempts;
  ON_CALL(behind_.scans(), Upload(_, _, _))
      .WillByDefault([&attempts](auto&, auto, const ScanHeader& header)
                         -> absl::StatusOr<std::unique_ptr<api::ScanUpload>> {
        constexpr std::array<std::uint64_t, 4> kHeld = {2, 5, 5, 7};
        auto upload = std::make_unique<::testing::NiceMock<::strata::testing::MockScanUpload>>();
        const std::size_t attempt = attempts.size();
        attempts.emplace_back();
        ON_CALL(*upload, points_held()).WillByDefault(Return(kHeld.at(attempt)));
        ON_CALL(*upload, Write(_)).WillByDefault([&attempts, attempt](const PointCloud& chunk) {
          for (const Eigen::Vector3f& point : chunk.points) attempts[attempt].push_back(point.x());
          return absl::OkStatus();
        });
        ON_CALL(*upload, Finish())
            .WillByDefault(
                Return(attempt < 3 ? absl::StatusOr<ScanAck>(absl::ResourceExhaustedError("full"))
                                   : absl::StatusOr<ScanAck>(ScanAck{header.id, 5, false, ""})));
        return upload;
      });
  ScanHeader header;
  header.id = {"run", 3};
  header.point_count = 8;
  header.content_hash = std::string(32, 'a');
  STRATA_ASSERT_OK_AND_ASSIGN(auto upload, client_->scans().Upload({}, "m", header));
  EXPECT_EQ(upload->points_held(), 2U);
  for (const int begin : {2, 5}) {
    PointCloud chunk;
    for (int x = begin; x < begin + 3; ++x) {
      chunk.points.emplace_back(static_cast<float>(x), 0.0F, 0.0F);
    }
    STRATA_ASSERT_OK(upload->Write(chunk));
  }
  STRATA_ASSERT_OK(upload->Finish());
  EXPECT_THAT(attempts,
              ::testing::ElementsAre(::testing::ElementsAre(2, 3, 4, 5, 6, 7),
                                     ::testing::ElementsAre(5, 6, 7),
                                     ::testing::ElementsAre(5, 6, 7),
                                     ::testing::ElementsAre(7)));
}

TEST_F(ClientTest, CancellationReachesTheWorkOnTheServer) {
  absl::Notification planning;
  ON_CALL(behind_.planning(), PlanPath(_, _, _))
      .WillByDefault([&planning](const api::Call& call, auto, auto&) {
        planning.Notify();
        while (call.stop.status().ok()) absl::SleepFor(absl::Milliseconds(1));
        return absl::StatusOr<PlanResult>(call.stop.status());
      });
  const api::Call call;
  std::thread canceller([&] {
    planning.WaitForNotification();
    call.stop.Request();
  });
  EXPECT_THAT(client_->planning().PlanPath(call, "m", {}), StatusIs(Code::kCancelled, _));
  canceller.join();
}

TEST_F(ClientTest, TheCallsIdAndDeadlineTravel) {
  const api::Call call{
      Stop(absl::Now() + absl::Seconds(20)), "tour-1", ""};  // below --max-query-time
  api::Call seen;
  ON_CALL(behind_.maps(), List(_)).WillByDefault([&seen](const api::Call& received) {
    seen = received;
    return absl::StatusOr<std::vector<MapInfo>>(std::vector<MapInfo>());
  });
  STRATA_ASSERT_OK(client_->maps().List(call));
  EXPECT_EQ(seen.request_id, "tour-1");
  EXPECT_LT(absl::AbsDuration(seen.stop.deadline() - call.stop.deadline()), absl::Seconds(8));
}

TEST_F(ClientTest, ManyPlacesAreAskedInParts) {
  std::vector<std::size_t> parts;
  ON_CALL(behind_.planning(), SampleSurfaces(_, _, _))
      .WillByDefault([&parts](auto&, auto, const std::vector<Eigen::Vector2d>& places) {
        parts.push_back(places.size());
        std::vector<SurfaceColumn> columns;
        for (const Eigen::Vector2d& place : places) columns.push_back({place.x(), place.y(), {}});
        return absl::StatusOr<std::vector<SurfaceColumn>>(columns);
      });
  std::vector<Eigen::Vector2d> places;
  for (int i = 0; i < 25'000; ++i) places.emplace_back(i, -i);
  STRATA_ASSERT_OK_AND_ASSIGN(const auto columns,
                              client_->planning().SampleSurfaces({}, "m", places));
  EXPECT_THAT(parts, ::testing::ElementsAre(10'000U, 10'000U, 5'000U));
  ASSERT_EQ(columns.size(), places.size());
  EXPECT_EQ(columns[24'999].x_m, 24'999.0);
}

TEST(ConnectTest, SaysWhatIsWrong) {
  ClientOptions options;
  options.target = "127.0.0.1:1";
  options.connect_timeout = absl::Milliseconds(100);
  EXPECT_THAT(Connect(options).status(), StatusIs(Code::kUnavailable, HasSubstr("127.0.0.1:1")));
  options.target = "";
  options.backoff.max_attempts = -1;
  EXPECT_THAT(Connect(options).status(),
              StatusIs(Code::kInvalidArgument, HasSubstr("max_attempts = -1")));
}

}  // namespace
}  // namespace strata
