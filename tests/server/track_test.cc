#include <atomic>
#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/time/clock.h"
#include "absl/time/time.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "strata/v1/posegraph.grpc.pb.h"
#include "tests/server/scan_sink.h"
#include "tests/server/served_mock.h"
#include "tests/support/patience.h"

namespace strata::server {
namespace {

using ::strata::testing::IsOk;
using ::strata::testing::StatusIs;
using ::testing::_;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Return;
using ::testing::SizeIs;
using Code = absl::StatusCode;

// Notes its steps, and says of the n-th that the robot is n metres ahead.
class NotedTracking final : public api::Tracking {
 public:
  NotedTracking(std::vector<TrackStep>& steps, std::shared_ptr<std::atomic<bool>> ended)
      : steps_(steps), ended_(std::move(ended)) {}
  ~NotedTracking() override { *ended_ = true; }

  absl::StatusOr<TrackedPose> Step(const TrackStep& step) override {
    steps_.push_back(step);
    if (steps_.size() == 4) return absl::DataLossError("no map any more");
    TrackedPose pose;
    pose.state = TrackState::kTracked;
    pose.known = true;
    pose.T_map_scan.translation().x() = static_cast<double>(steps_.size());
    pose.covariance = 0.5 * Matrix6d::Identity();
    pose.score = 0.75;
    pose.epoch = 4;
    return pose;
  }

 private:
  std::vector<TrackStep>& steps_;
  std::shared_ptr<std::atomic<bool>> ended_;
};

class TrackTest : public ServedMock {
 protected:
  void SetUp() override {
    Serve();
    ON_CALL(db_.posegraph(), Track(_, _, _))
        .WillByDefault([this](auto&, absl::string_view map, const TrackStart& start)
                           -> absl::StatusOr<std::unique_ptr<api::Tracking>> {
          map_ = std::string(map);
          start_ = start;
          return std::make_unique<NotedTracking>(steps_, ended_);
        });
  }

  static v1::TrackRequest Start() {
    v1::TrackRequest message;
    message.mutable_start()->set_map("campus");
    return message;
  }
  static v1::TrackRequest Step(double x, std::uint64_t points) {
    v1::TrackRequest message;
    message.mutable_step()->mutable_odometry()->mutable_translation()->set_x(x);
    message.mutable_step()->set_point_count(points);
    return message;
  }
  static v1::TrackRequest Message(const v1::PointChunk& chunk) {
    v1::TrackRequest message;
    *message.mutable_chunk() = chunk;
    return message;
  }

  // All that is answered.
  absl::Status Track(const std::vector<v1::TrackRequest>& messages) {
    const auto stub = v1::PoseGraph::NewStub(channel_);
    grpc::ClientContext context;
    const auto stream = stub->Track(&context);
    for (const v1::TrackRequest& message : messages) {
      if (!stream->Write(message)) break;
    }
    stream->WritesDone();
    answers_.clear();
    v1::TrackResponse answer;
    while (stream->Read(&answer)) answers_.push_back(answer);
    return translate::FromGrpcStatus(stream->Finish());
  }

  std::string map_;
  TrackStart start_;
  std::vector<TrackStep> steps_;
  // The call outlives its answer a little, and may outlive the test.
  std::shared_ptr<std::atomic<bool>> ended_ = std::make_shared<std::atomic<bool>>(false);
  std::vector<v1::TrackResponse> answers_;
};

TEST_F(TrackTest, EveryStepIsAnsweredOnceItsPointsAreThere) {
  v1::TrackRequest start = Start();
  start.mutable_start()->mutable_guess()->mutable_translation()->set_x(7.0);
  start.mutable_start()->set_guess_radius_m(3.0);
  v1::TrackRequest first = Step(1.5, 5);
  first.mutable_step()->mutable_sensor_origin()->set_z(1.5);
  first.mutable_step()->set_rows(1);
  first.mutable_step()->set_columns(5);
  for (int i = 0; i < 36; ++i) first.mutable_step()->add_motion_covariance(i % 7 == 0 ? 0.25 : 0.0);
  EXPECT_THAT(Track({start, first, Message(Points(3)), Message(Points(2)), Step(2.5, 0)}), IsOk());
  EXPECT_EQ(map_, "campus");
  EXPECT_EQ(start_.T_map_scan_guess->translation().x(), 7.0);
  EXPECT_EQ(start_.guess_radius_m, 3.0);
  ASSERT_THAT(steps_, SizeIs(2));
  EXPECT_EQ(steps_[0].cloud.size(), 5U);
  EXPECT_EQ(steps_[0].cloud.columns, 5U);
  EXPECT_EQ(steps_[0].cloud.sensor_origin.z(), 1.5F);
  EXPECT_EQ((*steps_[0].motion_covariance)(1, 1), 0.25);
  EXPECT_EQ(steps_[0].T_odom_scan.translation().x(), 1.5);
  EXPECT_EQ(steps_[1].cloud.size(), 0U);
  EXPECT_EQ(steps_[1].motion_covariance, std::nullopt);
  // The start's, and one a step.
  ASSERT_THAT(answers_, SizeIs(3));
  EXPECT_EQ(answers_[0].state(), v1::TRACK_STATE_UNSPECIFIED);
  EXPECT_EQ(answers_[1].state(), v1::TRACK_STATE_TRACKED);
  EXPECT_EQ(answers_[1].pose().translation().x(), 1.0);
  EXPECT_EQ(answers_[2].pose().translation().x(), 2.0);
  EXPECT_EQ(answers_[2].covariance(7), 0.5);
  EXPECT_EQ(answers_[2].score(), 0.75);
  EXPECT_EQ(answers_[2].epoch(), 4U);
  const absl::Time until = absl::Now() + testing::kPatience;
  while (!*ended_ && absl::Now() < until) absl::SleepFor(absl::Milliseconds(1));
  EXPECT_TRUE(*ended_);
}

TEST_F(TrackTest, RefusesMessagesOutOfOrder) {
  const auto refused = [](const char* why) {
    return StatusIs(Code::kInvalidArgument, HasSubstr(why));
  };
  EXPECT_THAT(Track({}), refused("ended before it began"));
  EXPECT_THAT(Track({Step(0.0, 0)}), refused("first message is the start"));
  EXPECT_THAT(Track({Start(), Start()}), refused("next message is a step"));
  EXPECT_THAT(Track({Start(), Message(Points(1))}), refused("next message is a step"));
  EXPECT_THAT(Track({Start(), Step(0.0, 3), Step(0.0, 0)}), refused("points of a step follow"));
  EXPECT_THAT(Track({Start(), v1::TrackRequest()}), refused("next message is a step"));
  EXPECT_THAT(Track({Start(), Step(0.0, 3), Message(Points(2))}), refused("2 points arrived"));
  EXPECT_THAT(steps_, IsEmpty());
}

TEST_F(TrackTest, RefusesWhatIsNoStep) {
  EXPECT_THAT(Track({Start(), Step(0.0, 2'000'001)}),
              StatusIs(Code::kResourceExhausted, HasSubstr("thin the scan out")));
  EXPECT_THAT(Track({Start(), Step(std::numeric_limits<double>::quiet_NaN(), 0)}),
              StatusIs(Code::kInvalidArgument, HasSubstr("odometry")));
  EXPECT_THAT(Track({Start(), Step(0.0, 2), Message(Points(3))}),
              StatusIs(Code::kInvalidArgument, _));
  v1::TrackRequest step = Step(0.0, 6);
  step.mutable_step()->set_rows(2);
  step.mutable_step()->set_columns(4);
  EXPECT_THAT(Track({Start(), step}), StatusIs(Code::kInvalidArgument, HasSubstr("grid of 2 × 4")));
  step = Step(0.0, 0);
  step.mutable_step()->add_motion_covariance(1.0);
  EXPECT_THAT(Track({Start(), step}),
              StatusIs(Code::kInvalidArgument, HasSubstr("motion_covariance")));
  step = Step(0.0, 0);
  for (int i = 0; i < 36; ++i) step.mutable_step()->add_motion_covariance(0.0);
  EXPECT_THAT(Track({Start(), step}),
              StatusIs(Code::kInvalidArgument, HasSubstr("motion covariance")));
  v1::TrackRequest start = Start();
  start.mutable_start()->set_guess_radius_m(-1.0);
  EXPECT_THAT(Track({start}), StatusIs(Code::kInvalidArgument, HasSubstr("guess_radius_m")));
  EXPECT_THAT(steps_, IsEmpty());
}

TEST_F(TrackTest, TheFirstErrorEndsTheStream) {
  EXPECT_THAT(Track({Start(), Step(0, 0), Step(1, 0), Step(2, 0), Step(3, 0), Step(4, 0)}),
              StatusIs(Code::kDataLoss, HasSubstr("no map any more")));
  EXPECT_THAT(answers_, SizeIs(4));
  EXPECT_THAT(steps_, SizeIs(4));
  EXPECT_CALL(db_.posegraph(), Track(_, _, _))
      .WillOnce([](auto&, auto, auto&) -> absl::StatusOr<std::unique_ptr<api::Tracking>> {
        return absl::NotFoundError("no such map");
      });
  EXPECT_THAT(Track({Start()}), StatusIs(Code::kNotFound, HasSubstr("no such map")));
  EXPECT_THAT(answers_, IsEmpty());
}

}  // namespace
}  // namespace strata::server
