// PoseGraph.Track: a robot that is followed, a stream both ways.
#ifndef STRATA_SERVER_SERVICES_TRACK_REACTOR_H_
#define STRATA_SERVER_SERVICES_TRACK_REACTOR_H_

#include <memory>

#include "absl/status/status.h"

#include "core/api/posegraph.h"
#include "core/world/scan.h"
#include "core/world/tracking.h"
#include "server/rpc/request.h"
#include "server/rpc/runtime.h"
#include "server/rpc/sealed.h"
#include "strata/v1/posegraph.grpc.pb.h"

namespace strata::server {

// One step at a time under way: a message is read once the one before is dealt with, and the next
// step once the answer to the one before is on the wire. Between them it holds no thread; memory is
// one scan, and the little that the database keeps of the robot. Lives from the call's arrival to
// its end; owns itself.
class TrackReactor final
    : public grpc::ServerBidiReactor<Sealed<v1::TrackRequest>, v1::TrackResponse> {
 public:
  using In = v1::TrackRequest;
  using Out = v1::TrackResponse;

  TrackReactor(Runtime& runtime, grpc::CallbackServerContext& context);

 private:
  void Read();
  void OnReadDone(bool ok) override;
  void OnWriteDone(bool ok) override;
  void OnCancel() override { request_.Cancel(); }
  void OnDone() override { delete this; }

  // On an upload thread.
  void Take();
  absl::Status TakeMessage();
  absl::Status Begin(const v1::TrackStart& start);
  absl::Status BeginStep(const v1::TrackStep& step);
  absl::Status Add(const v1::PointChunk& chunk);
  bool StepIsComplete() const { return step_begun_ && step_.cloud.size() == shape_.point_count; }
  // On a query thread.
  void Follow();
  absl::Status FollowStep();
  void Answer();
  absl::Status CheckEnd() const;

  Runtime& runtime_;
  Request request_;
  Booking in_memory_;
  Booking points_memory_;
  Sealed<In> message_;
  Out answer_;
  bool answers_now_ = false;  // the message just taken is the start
  bool step_begun_ = false;
  ScanHeader shape_;  // grid and number of the points of the step
  TrackStep step_;
  std::unique_ptr<api::Tracking> tracking_;  // nullptr: before the start
  ExpectedMessage expected_;
};

}  // namespace strata::server

#endif  // STRATA_SERVER_SERVICES_TRACK_REACTOR_H_
