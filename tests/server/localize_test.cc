#include <limits>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/common/retry_delay.h"
#include "strata/v1/posegraph.grpc.pb.h"
#include "tests/server/scan_sink.h"
#include "tests/server/served_mock.h"

namespace strata::server {
namespace {

using ::strata::testing::IsOk;
using ::strata::testing::StatusIs;
using ::testing::_;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;
using Code = absl::StatusCode;

class LocalizeTest : public ServedMock {
 protected:
  void SetUp() override {
    Serve();
    ON_CALL(db_.posegraph(), Localize(_, _, _))
        .WillByDefault([this](auto&, absl::string_view map, const LocalizeQuery& query) {
          map_ = std::string(map);
          asked_.push_back(query);
          LocalizeResult result;
          result.found = true;
          result.best.place = {"run", 17};
          result.covariance = Matrix6d::Identity() * 0.5;
          result.epoch = 4;
          return absl::StatusOr<LocalizeResult>(result);
        });
  }

  static v1::LocalizeRequest Start(std::uint64_t points) {
    v1::LocalizeRequest message;
    message.mutable_start()->set_map("campus");
    message.mutable_start()->set_point_count(points);
    return message;
  }
  static v1::LocalizeRequest Message(const v1::PointChunk& chunk) {
    v1::LocalizeRequest message;
    *message.mutable_chunk() = chunk;
    return message;
  }

  absl::Status Localize(const std::vector<v1::LocalizeRequest>& messages) {
    const auto stub = v1::PoseGraph::NewStub(channel_);
    grpc::ClientContext context;
    const auto writer = stub->Localize(&context, &response_);
    for (const v1::LocalizeRequest& message : messages) {
      if (!writer->Write(message)) break;
    }
    writer->WritesDone();
    return translate::FromGrpcStatus(writer->Finish());
  }

  std::string map_;
  std::vector<LocalizeQuery> asked_;
  v1::LocalizeResponse response_;
};

TEST_F(LocalizeTest, AScanInPiecesIsSearchedForOnce) {
  v1::LocalizeRequest start = Start(5);
  start.mutable_start()->mutable_sensor_origin()->set_z(1.5);
  start.mutable_start()->mutable_guess()->mutable_translation()->set_x(7.0);
  start.mutable_start()->set_guess_radius_m(3.0);
  EXPECT_THAT(Localize({start, Message(Points(3)), Message(Points(2))}), IsOk());
  ASSERT_THAT(asked_, SizeIs(1));
  EXPECT_EQ(map_, "campus");
  EXPECT_EQ(asked_[0].cloud.size(), 5U);
  EXPECT_EQ(asked_[0].cloud.sensor_origin.z(), 1.5F);
  EXPECT_EQ(asked_[0].T_map_scan_guess->translation().x(), 7.0);
  EXPECT_EQ(asked_[0].guess_radius_m, 3.0);
  EXPECT_EQ(asked_[0].sensor, std::nullopt);
  EXPECT_TRUE(response_.found());
  EXPECT_EQ(response_.best().place().sequence(), 17U);
  EXPECT_EQ(response_.covariance(7), 0.5);
  EXPECT_EQ(response_.epoch(), 4U);
}

TEST_F(LocalizeTest, AnOrganisedScanKeepsItsGrid) {
  v1::LocalizeRequest start = Start(6);
  start.mutable_start()->set_rows(2);
  start.mutable_start()->set_columns(3);
  v1::PointChunk chunk = Points(6);
  const float nan[3] = {std::numeric_limits<float>::quiet_NaN(),
                        std::numeric_limits<float>::quiet_NaN(),
                        std::numeric_limits<float>::quiet_NaN()};
  chunk.mutable_xyz()->replace(12, 12, reinterpret_cast<const char*>(nan), 12);
  EXPECT_THAT(Localize({start, Message(chunk)}), IsOk());
  ASSERT_THAT(asked_, SizeIs(1));
  EXPECT_EQ(asked_[0].cloud.rows, 2U);
  EXPECT_EQ(asked_[0].cloud.columns, 3U);
  EXPECT_THAT(Localize({Start(6), Message(chunk)}),
              StatusIs(Code::kInvalidArgument, HasSubstr("point 1 (nan")));
  start.mutable_start()->set_columns(4);
  EXPECT_THAT(Localize({start, Message(chunk)}),
              StatusIs(Code::kInvalidArgument, HasSubstr("grid of 2 × 4")));
}

TEST_F(LocalizeTest, RefusesMessagesOutOfOrder) {
  EXPECT_THAT(Localize({}), StatusIs(Code::kInvalidArgument, HasSubstr("before its scan began")));
  EXPECT_THAT(Localize({Message(Points(1))}),
              StatusIs(Code::kInvalidArgument, HasSubstr("first message is the start")));
  EXPECT_THAT(Localize({Start(5), Start(5)}),
              StatusIs(Code::kInvalidArgument, HasSubstr("after the first is a chunk")));
  EXPECT_THAT(Localize({Start(5), v1::LocalizeRequest()}),
              StatusIs(Code::kInvalidArgument, HasSubstr("after the first is a chunk")));
  EXPECT_THAT(
      Localize({Start(5), Message(Points(3))}),
      StatusIs(Code::kInvalidArgument, HasSubstr("3 points arrived, the start announced 5")));
  EXPECT_THAT(Localize({Start(5), Message(Points(6))}),
              StatusIs(Code::kInvalidArgument, HasSubstr("6 points arrived")));
  EXPECT_THAT(Localize({Start(0)}), StatusIs(Code::kInvalidArgument, HasSubstr("no points")));
  EXPECT_THAT(asked_, IsEmpty());
}

TEST_F(LocalizeTest, RefusesWhatIsWrongInItself) {
  v1::LocalizeRequest start = Start(1);
  start.mutable_start()->set_guess_radius_m(-1.0);
  EXPECT_THAT(Localize({start}), StatusIs(Code::kInvalidArgument, HasSubstr("guess_radius_m")));
  start = Start(1);
  start.mutable_start()->mutable_guess()->mutable_rotation()->set_w(0.5);
  const absl::Status status = Localize({start});
  EXPECT_THAT(status, StatusIs(Code::kInvalidArgument, HasSubstr("guess.rotation")));
  EXPECT_EQ(ReasonOf(status), "REQUEST");
  start = Start(1);
  start.mutable_start()->mutable_sensor()->set_sigma_m(-2.0);
  EXPECT_THAT(Localize({start}), StatusIs(Code::kInvalidArgument, HasSubstr("sigma_m")));
  v1::PointChunk chunk = Points(1);
  chunk.set_label("ab");
  EXPECT_THAT(Localize({Start(1), Message(chunk)}),
              StatusIs(Code::kInvalidArgument, HasSubstr("label")));
  EXPECT_THAT(asked_, IsEmpty());
}

TEST_F(LocalizeTest, TooLargeAScanIsNotToBeSentAgain) {
  const absl::Status status = Localize({Start(2'000'001)});
  EXPECT_THAT(status, StatusIs(Code::kResourceExhausted, HasSubstr("2000001 points announced")));
  EXPECT_EQ(RetryDelayOf(status), std::nullopt);
}

TEST_F(LocalizeTest, AClientThatGoesAwayIsNotSearchedFor) {
  const auto stub = v1::PoseGraph::NewStub(channel_);
  grpc::ClientContext context;
  const auto writer = stub->Localize(&context, &response_);
  ASSERT_TRUE(writer->Write(Start(4)));
  ASSERT_TRUE(writer->Write(Message(Points(3))));
  context.TryCancel();
  EXPECT_EQ(writer->Finish().error_code(), grpc::StatusCode::CANCELLED);
  server_.reset();  // waits for its calls
  EXPECT_THAT(asked_, IsEmpty());
}

}  // namespace
}  // namespace strata::server
