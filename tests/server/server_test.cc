#include "server/server.h"

#include <chrono>
#include <limits>
#include <new>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "absl/synchronization/notification.h"
#include "absl/time/clock.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/common/retry_delay.h"
#include "strata/v1/maps.grpc.pb.h"
#include "strata/v1/planning.grpc.pb.h"
#include "strata/v1/posegraph.grpc.pb.h"
#include "strata/v1/tiles.grpc.pb.h"
#include "tests/server/raw_call.h"
#include "tests/server/served_mock.h"

namespace strata::server {
namespace {

using ::strata::testing::IsOk;
using ::strata::testing::StatusIs;
using ::testing::_;
using ::testing::HasSubstr;
using ::testing::Return;
using Code = absl::StatusCode;

class ServerTest : public ServedMock {
 protected:
  absl::Status PlanPath(grpc::ClientContext* context = nullptr) {
    v1::PlanPathRequest in;
    in.mutable_from();
    in.mutable_to();
    v1::PlanPathResponse out;
    return Call<v1::Planning>(&v1::Planning::Stub::PlanPath, in, &out, context);
  }
  absl::Status ListMaps(grpc::ClientContext* context = nullptr) {
    v1::ListMapsResponse out;
    return Call<v1::Maps>(&v1::Maps::Stub::List, v1::ListMapsRequest(), &out, context);
  }
  // Work that goes on until its caller's Stop ends it.
  void PlanUntilStopped() {
    ON_CALL(db_.planning(), PlanPath(_, _, _))
        .WillByDefault([this](const api::Call& call, auto, auto&) {
          if (!planning_.HasBeenNotified()) planning_.Notify();
          while (call.stop.status().ok()) absl::SleepFor(absl::Milliseconds(1));
          stopped_by_ = call.stop.status();
          stopped_.Notify();
          return absl::StatusOr<PlanResult>(stopped_by_);
        });
  }

  absl::Notification planning_;
  absl::Notification stopped_;
  absl::Status stopped_by_;
};

// The answer's bytes, or why there are none.
std::string RawCall(const std::shared_ptr<grpc::Channel>& channel,
                    const char* method,
                    const std::string& request) {
  const RawAnswer answer = CallRaw(channel, method, request);
  if (!answer.status.ok()) return answer.status.error_message();
  return answer.messages.empty() ? "no message" : answer.messages.front();
}

TEST_F(ServerTest, HealthIsKnownByServerAndByService) {
  Serve();
  const std::string serving("\x08\x01", 2);  // status = 1
  const auto health = [this](const std::string& service) {
    const std::string request =
        service.empty() ? "" : std::string("\x0A") + static_cast<char>(service.size()) + service;
    return RawCall(channel_, "/grpc.health.v1.Health/Check", request);
  };
  EXPECT_EQ(health(""), serving);
  for (const char* service : {"Maps", "Scans", "Tiles", "Planning", "Jobs", "PoseGraph"}) {
    EXPECT_EQ(health(std::string("strata.v1.") + service), serving) << service;
  }
  EXPECT_NE(health("strata.v1.Nothing"), serving);
}

TEST_F(ServerTest, ReflectionNamesTheServices) {
  Serve();
  const std::string list_services("\x3A\x00", 2);
  const std::string names = RawCall(
      channel_, "/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo", list_services);
  for (const char* service : {"Maps", "Scans", "Tiles", "Planning", "Jobs", "PoseGraph"}) {
    EXPECT_THAT(names, HasSubstr(std::string("strata.v1.") + service));
  }
}

TEST_F(ServerTest, ListensBeyondLoopbackOnlyWhenTold) {
  ServerOptions options;
  options.listen = "0.0.0.0:0";
  EXPECT_THAT(Server::Start(db_, options),
              StatusIs(Code::kFailedPrecondition, HasSubstr("--tls-cert")));
  options.insecure = true;
  EXPECT_THAT(Server::Start(db_, options), IsOk());
}

TEST_F(ServerTest, APortInUseIsUnavailable) {
  Serve();
  ServerOptions options;
  options.listen = server_->address();
  EXPECT_THAT(Server::Start(db_, options),
              StatusIs(Code::kUnavailable, HasSubstr(server_->address())));
}

TEST_F(ServerTest, BadOptionsAreAllNamed) {
  ServerOptions options;
  options.query_threads = 0;
  options.max_calls = -3;
  EXPECT_THAT(
      Server::Start(db_, options),
      StatusIs(Code::kInvalidArgument,
               ::testing::AllOf(HasSubstr("query_threads = 0"), HasSubstr("max_calls = -3"))));
}

TEST_F(ServerTest, WhatIsWrongInItselfNeverReachesTheDatabase) {
  Serve();
  EXPECT_CALL(db_.posegraph(), SetPose(_, _, _, _)).Times(0);
  EXPECT_CALL(db_.maps(), Create(_, _, _)).Times(0);
  EXPECT_CALL(db_.planning(), SampleSurfaces(_, _, _)).Times(0);
  EXPECT_CALL(db_.planning(), PlanPath(_, _, _)).Times(0);
  EXPECT_CALL(db_.tiles(), Get(_, _, _)).Times(0);

  v1::SetPoseRequest pose;
  pose.mutable_pose()->mutable_translation()->set_x(std::numeric_limits<double>::quiet_NaN());
  v1::SetPoseResponse posed;
  const absl::Status status = Call<v1::PoseGraph>(&v1::PoseGraph::Stub::SetPose, pose, &posed);
  EXPECT_THAT(status, StatusIs(Code::kInvalidArgument, HasSubstr("pose.translation")));
  EXPECT_EQ(ReasonOf(status), "REQUEST");

  v1::CreateMapRequest create;
  v1::CreateMapResponse created;
  create.set_name("../etc/passwd");
  EXPECT_THAT(Call<v1::Maps>(&v1::Maps::Stub::Create, create, &created),
              StatusIs(Code::kInvalidArgument, HasSubstr("map name '../etc/passwd'")));
  create.set_name("campus");
  create.mutable_parameters()->mutable_mls()->set_cell_size_m(-1);
  EXPECT_THAT(Call<v1::Maps>(&v1::Maps::Stub::Create, create, &created),
              StatusIs(Code::kInvalidArgument, HasSubstr("cell_size_m")));

  v1::SampleSurfacesRequest sample;
  v1::SampleSurfacesResponse sampled;
  for (int i = 0; i < 10'001; ++i) sample.add_places();
  EXPECT_THAT(Call<v1::Planning>(&v1::Planning::Stub::SampleSurfaces, sample, &sampled),
              StatusIs(Code::kInvalidArgument, HasSubstr("10001")));

  v1::PlanPathRequest plan;
  v1::PlanPathResponse planned;
  plan.mutable_profile()->set_radius_m(1e9);
  EXPECT_THAT(Call<v1::Planning>(&v1::Planning::Stub::PlanPath, plan, &planned),
              StatusIs(Code::kInvalidArgument, HasSubstr("radius_m")));
  plan.clear_profile();
  EXPECT_THAT(Call<v1::Planning>(&v1::Planning::Stub::PlanPath, plan, &planned),
              StatusIs(Code::kInvalidArgument, HasSubstr("from is missing")));
  plan.mutable_from();
  EXPECT_THAT(Call<v1::Planning>(&v1::Planning::Stub::PlanPath, plan, &planned),
              StatusIs(Code::kInvalidArgument, HasSubstr("to is missing")));

  v1::ExploreResponse explored;
  EXPECT_THAT(Call<v1::Planning>(&v1::Planning::Stub::Explore, v1::ExploreRequest(), &explored),
              StatusIs(Code::kInvalidArgument, HasSubstr("from is missing")));

  v1::GetTileRequest tile;
  v1::GetTileResponse got;
  tile.mutable_key()->set_level(-1);
  EXPECT_THAT(Call<v1::Tiles>(&v1::Tiles::Stub::Get, tile, &got),
              StatusIs(Code::kInvalidArgument, HasSubstr("level -1")));
}

TEST_F(ServerTest, TheDatabasesErrorsArriveAsTheyAre) {
  Serve();
  ON_CALL(db_.maps(), List(_)).WillByDefault(Return(absl::DataLossError("tile 0/1/2 is damaged")));
  const absl::Status status = ListMaps();
  EXPECT_THAT(status, StatusIs(Code::kDataLoss, "tile 0/1/2 is damaged"));
  EXPECT_EQ(ReasonOf(status), "DATABASE");
}

TEST_F(ServerTest, ExceptionsBecomeStatuses) {
  Serve();
  EXPECT_CALL(db_.maps(), List(_))
      .WillOnce([](auto&) -> absl::StatusOr<std::vector<MapInfo>> { throw std::bad_alloc(); })
      .WillOnce(
          [](auto&) -> absl::StatusOr<std::vector<MapInfo>> { throw std::runtime_error("odd"); })
      .WillOnce(Return(std::vector<MapInfo>()));
  EXPECT_THAT(ListMaps(), StatusIs(Code::kResourceExhausted, HasSubstr("memory")));
  EXPECT_THAT(ListMaps(), StatusIs(Code::kInternal, "odd"));
  EXPECT_THAT(ListMaps(), IsOk());
}

TEST_F(ServerTest, CancellationReachesIntoTheWork) {
  Serve();
  PlanUntilStopped();
  grpc::ClientContext context;
  std::thread canceller([&] {
    planning_.WaitForNotification();
    context.TryCancel();
  });
  EXPECT_THAT(PlanPath(&context), StatusIs(Code::kCancelled, _));
  canceller.join();
  stopped_.WaitForNotification();
  EXPECT_THAT(stopped_by_, StatusIs(Code::kCancelled, _));
}

TEST_F(ServerTest, TheDeadlineReachesIntoTheWork) {
  Serve();
  PlanUntilStopped();
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + std::chrono::milliseconds(200));
  EXPECT_THAT(PlanPath(&context), StatusIs(Code::kDeadlineExceeded, _));
  stopped_.WaitForNotification();
  // The deadline's passing may also arrive as gRPC's cancellation.
  EXPECT_THAT(stopped_by_.code(), ::testing::AnyOf(Code::kDeadlineExceeded, Code::kCancelled));
}

TEST_F(ServerTest, AQueryHasATimeLimitWhateverItsCallerAllows) {
  ServerOptions options;
  options.max_query_time = absl::Milliseconds(200);
  Serve(options);
  PlanUntilStopped();
  EXPECT_THAT(PlanPath(),
              StatusIs(Code::kDeadlineExceeded, HasSubstr("200ms (--max-query-time); ask for")));
  stopped_.WaitForNotification();
  EXPECT_THAT(stopped_by_, StatusIs(Code::kDeadlineExceeded, _));
}

TEST_F(ServerTest, AnEditHasNone) {
  ServerOptions options;
  options.max_query_time = absl::Milliseconds(1);
  Serve(options);
  ON_CALL(db_.planning(), SetProfile(_, _, _, _)).WillByDefault([](const api::Call& call, auto...) {
    EXPECT_EQ(call.stop.deadline(), absl::InfiniteFuture());
    return absl::OkStatus();
  });
  v1::SetProfileRequest in;
  in.set_name("crawler");
  v1::SetProfileResponse out;
  EXPECT_THAT(Call<v1::Planning>(&v1::Planning::Stub::SetProfile, in, &out), IsOk());
}

TEST_F(ServerTest, AFullServerSaysWhenToComeBack) {
  ServerOptions options;
  options.max_calls = 1;
  Serve(options);
  PlanUntilStopped();
  ON_CALL(db_.maps(), List(_)).WillByDefault(Return(std::vector<MapInfo>()));
  grpc::ClientContext context;
  std::thread holder([&] { EXPECT_THAT(PlanPath(&context), StatusIs(Code::kCancelled, _)); });
  planning_.WaitForNotification();
  const absl::Status status = ListMaps();
  EXPECT_THAT(status, StatusIs(Code::kResourceExhausted, HasSubstr("1 calls under way")));
  EXPECT_EQ(ReasonOf(status), "SERVER_BUSY");
  EXPECT_NE(RetryDelayOf(status), std::nullopt);
  context.TryCancel();
  holder.join();
}

TEST_F(ServerTest, WhatIsAtHandNeedsNoThread) {
  ServerOptions options;
  options.query_threads = 1;
  Serve(options);
  PlanUntilStopped();
  EXPECT_CALL(db_.tiles(), GetAtHand)
      .WillOnce(Return(api::EncodedTile{{0, 1, 2}, 7, 3, "bytes"}))
      .WillOnce(Return(absl::NotFoundError("no such map")))
      .WillOnce(Return(std::optional<api::EncodedTile>()));
  EXPECT_CALL(db_.tiles(), Get).WillOnce(Return(absl::DataLossError("damaged")));
  grpc::ClientContext context;
  std::thread holder([&] { EXPECT_THAT(PlanPath(&context), StatusIs(Code::kCancelled, _)); });
  planning_.WaitForNotification();
  const v1::GetTileRequest in;
  v1::GetTileResponse out;
  EXPECT_THAT(Call<v1::Tiles>(&v1::Tiles::Stub::Get, in, &out), IsOk());
  EXPECT_EQ(out.tile().bytes(), "bytes");
  EXPECT_EQ(out.tile().version(), 7U);
  EXPECT_THAT(Call<v1::Tiles>(&v1::Tiles::Stub::Get, in, &out), StatusIs(Code::kNotFound, _));
  context.TryCancel();
  holder.join();
  EXPECT_THAT(Call<v1::Tiles>(&v1::Tiles::Stub::Get, in, &out), StatusIs(Code::kDataLoss, _));
}

TEST_F(ServerTest, OversizedRequestsAreRefusedAndTheServerGoesOn) {
  Serve();
  ON_CALL(db_.maps(), List(_)).WillByDefault(Return(std::vector<MapInfo>()));
  v1::GetMapRequest in;
  in.set_name(std::string(5 << 20, 'x'));
  v1::GetMapResponse out;
  EXPECT_THAT(Call<v1::Maps>(&v1::Maps::Stub::Get, in, &out),
              StatusIs(Code::kResourceExhausted, _));
  EXPECT_THAT(ListMaps(), IsOk());
}

TEST_F(ServerTest, TheRequestIdIsTheClientsOrTheServers) {
  Serve();
  std::string seen;
  ON_CALL(db_.maps(), List(_)).WillByDefault([&seen](const api::Call& call) {
    seen = call.request_id;
    return absl::StatusOr<std::vector<MapInfo>>(absl::NotFoundError("x"));
  });
  grpc::ClientContext named;
  named.AddMetadata("x-request-id", "robot-7/42");
  const absl::Status status = ListMaps(&named);
  EXPECT_EQ(seen, "robot-7/42");
  EXPECT_EQ(translate::DetailOf(status)->metadata().at("request_id"), "robot-7/42");
  grpc::ClientContext silly;
  silly.AddMetadata("x-request-id", std::string(65, 'a'));
  ASSERT_THAT(ListMaps(&silly), StatusIs(Code::kNotFound, "x"));
  EXPECT_NE(seen, std::string(65, 'a'));
  EXPECT_FALSE(seen.empty());
}

}  // namespace
}  // namespace strata::server
