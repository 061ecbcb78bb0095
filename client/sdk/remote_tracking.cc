#include "client/sdk/remote_tracking.h"

#include <algorithm>
#include <cstddef>
#include <vector>

#include "core/api/scans.h"
#include "core/common/status.h"
#include "proto/translate/points.h"
#include "proto/translate/track.h"

namespace strata::sdk {

RemoteTracking::RemoteTracking(Connection& connection,
                               v1::PoseGraph::Stub& stub,
                               const api::Call& call)
    : call_(call), context_(connection, call), stream_(stub.Track(context_.get())) {}

RemoteTracking::~RemoteTracking() {
  if (stream_ == nullptr) return;
  stream_->WritesDone();
  v1::TrackResponse none;
  while (stream_->Read(&none)) {
  }
  stream_->Finish();
}

absl::Status RemoteTracking::Open(absl::string_view map, const TrackStart& start) {
  v1::TrackRequest in;
  *in.mutable_start() = translate::ToProto(map, start);
  v1::TrackResponse out;
  // The server refuses by ending the stream; why is in its status.
  if (!stream_->Write(in) || !stream_->Read(&out)) return End();
  return absl::OkStatus();
}

bool RemoteTracking::Send(const TrackStep& step) {
  v1::TrackRequest in;
  *in.mutable_step() = translate::ToProto(step);
  bool goes_on = stream_->Write(in);
  const std::vector<Eigen::Vector3f>& points = step.cloud.points;
  for (std::size_t i = 0; goes_on && i < points.size(); i += api::kMaxPointsPerChunk) {
    const std::size_t end = std::min(points.size(), i + api::kMaxPointsPerChunk);
    PointCloud piece;
    piece.points.assign(points.begin() + static_cast<std::ptrdiff_t>(i),
                        points.begin() + static_cast<std::ptrdiff_t>(end));
    *in.mutable_chunk() = translate::ToProto(piece);
    goes_on = stream_->Write(in);
  }
  return goes_on;
}

absl::StatusOr<TrackedPose> RemoteTracking::Step(const TrackStep& step) {
  // The server would end the stream.
  STRATA_RETURN_IF_ERROR(ValidateTrackStep(step));
  if (stream_ == nullptr) return ended_;
  v1::TrackResponse out;
  if (!Send(step) || !stream_->Read(&out)) return End();
  return translate::FromProto(out);
}

absl::Status RemoteTracking::End() {
  const grpc::Status status = stream_->Finish();
  stream_ = nullptr;
  ended_ = status.ok() ? absl::InternalError("the server has ended the stream")
                       : StatusOf(status, call_);
  return ended_;
}

}  // namespace strata::sdk
