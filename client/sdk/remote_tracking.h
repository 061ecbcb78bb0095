// A robot that a server follows.
#ifndef STRATA_CLIENT_SDK_REMOTE_TRACKING_H_
#define STRATA_CLIENT_SDK_REMOTE_TRACKING_H_

#include <memory>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "client/sdk/connection.h"
#include "core/api/posegraph.h"
#include "strata/v1/posegraph.grpc.pb.h"

namespace strata::sdk {

// One stream, never repeated: what the server knew of the robot goes with it. Not thread-safe.
class RemoteTracking final : public api::Tracking {
 public:
  RemoteTracking(Connection& connection, v1::PoseGraph::Stub& stub, const api::Call& call);
  ~RemoteTracking() override;
  RemoteTracking(const RemoteTracking&) = delete;
  RemoteTracking& operator=(const RemoteTracking&) = delete;

  // Returns once the server has answered.
  absl::Status Open(absl::string_view map, const TrackStart& start);
  // Sends the points' coordinates only.
  absl::StatusOr<TrackedPose> Step(const TrackStep& step) override;

 private:
  bool Send(const TrackStep& step);
  // Why the stream has ended; the same again.
  absl::Status End();

  const api::Call call_;
  AttemptContext context_;
  std::unique_ptr<grpc::ClientReaderWriter<v1::TrackRequest, v1::TrackResponse>> stream_;
  absl::Status ended_;
};

}  // namespace strata::sdk

#endif  // STRATA_CLIENT_SDK_REMOTE_TRACKING_H_
