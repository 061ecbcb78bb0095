#include <thread>
#include <vector>

#include "absl/synchronization/notification.h"
#include "absl/time/clock.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "strata/v1/maps.grpc.pb.h"
#include "strata/v1/planning.grpc.pb.h"
#include "tests/server/served_mock.h"

namespace strata::server {
namespace {

using ::strata::testing::IsOk;
using ::strata::testing::StatusIs;
using ::testing::_;

class ShutdownTest : public ServedMock {
 protected:
  absl::Status PlanPath() {
    v1::PlanPathRequest in;
    in.mutable_from();
    in.mutable_to();
    v1::PlanPathResponse out;
    return Call<v1::Planning>(&v1::Planning::Stub::PlanPath, in, &out);
  }
  absl::Notification started_;
};

TEST_F(ShutdownTest, LetsCallsUnderWayEnd) {
  ServerOptions options;
  options.drain_timeout = absl::Seconds(60);
  Serve(options);
  absl::Notification go_on;
  ON_CALL(db_.planning(), PlanPath(_, _, _)).WillByDefault([&](auto&, auto, auto&) {
    started_.Notify();
    go_on.WaitForNotification();
    return absl::StatusOr<PlanResult>(PlanResult());
  });
  std::thread caller([this] { EXPECT_THAT(PlanPath(), IsOk()); });
  started_.WaitForNotification();
  std::thread shutdown([this] { server_->Shutdown(); });
  // New calls are refused while the one under way goes on.
  ON_CALL(db_.maps(), List(_)).WillByDefault(::testing::Return(std::vector<MapInfo>()));
  absl::Status refused;
  while (refused.ok()) {
    v1::ListMapsResponse out;
    refused = Call<v1::Maps>(&v1::Maps::Stub::List, v1::ListMapsRequest(), &out);
  }
  EXPECT_THAT(refused, StatusIs(absl::StatusCode::kUnavailable, _));
  EXPECT_EQ(ReasonOf(refused), "SHUTTING_DOWN");
  go_on.Notify();
  caller.join();
  shutdown.join();
  EXPECT_THAT(PlanPath(), StatusIs(absl::StatusCode::kUnavailable, _));
}

TEST_F(ShutdownTest, CancelsWhatDoesNotEnd) {
  ServerOptions options;
  options.drain_timeout = absl::Milliseconds(50);
  Serve(options);
  ON_CALL(db_.planning(), PlanPath(_, _, _)).WillByDefault([&](const api::Call& call, auto, auto&) {
    started_.Notify();
    while (call.stop.status().ok()) absl::SleepFor(absl::Milliseconds(1));
    return absl::StatusOr<PlanResult>(call.stop.status());
  });
  absl::Status status;
  std::thread caller([&] { status = PlanPath(); });
  started_.WaitForNotification();
  server_->Shutdown();
  caller.join();
  EXPECT_THAT(status.code(),
              ::testing::AnyOf(absl::StatusCode::kCancelled, absl::StatusCode::kUnavailable));
}

TEST_F(ShutdownTest, TwiceIsOnce) {
  Serve();
  server_->Shutdown();
  server_->Shutdown();
}

}  // namespace
}  // namespace strata::server
