#include "server/services/track_reactor.h"

#include <cstdint>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"

#include "core/api/chunk_check.h"
#include "core/common/guarded.h"
#include "core/common/status.h"
#include "proto/translate/points.h"
#include "proto/translate/track.h"
#include "server/services/append.h"

namespace strata::server {
namespace {

constexpr std::uint64_t kMaxStepPoints = 2'000'000;

absl::Status Misplaced(absl::string_view rule) {
  return AtTheDoor(absl::InvalidArgumentError(absl::StrCat("track: ", rule)));
}

}  // namespace

TrackReactor::TrackReactor(Runtime& runtime, grpc::CallbackServerContext& context)
    : runtime_(runtime),
      request_(runtime, context, "PoseGraph.Track"),
      in_memory_(request_.NewBooking()),
      points_memory_(request_.NewBooking()),
      expected_(runtime.silence, request_.call().stop, [this](const absl::Status& status) {
        Finish(request_.Close(status));
      }) {
  if (!request_.admission().ok()) {
    Finish(request_.Close(request_.admission()));
    return;
  }
  Read();
}

void TrackReactor::Read() {
  expected_.Expect();
  StartRead(&message_);
}

void TrackReactor::OnReadDone(bool ok) {
  if (!expected_.Arrived()) return;
  runtime_.uploads.Submit(request_.client(), [this, ok] {
    if (ok) {
      Take();
    } else {
      Finish(request_.Close(CheckEnd()));
    }
  });
}

absl::Status TrackReactor::CheckEnd() const {
  // The stream also ends when the client has gone.
  STRATA_RETURN_IF_ERROR(request_.call().stop.status());
  if (tracking_ == nullptr) return Misplaced("the stream ended before it began");
  if (!step_begun_) return absl::OkStatus();
  return Misplaced(
      absl::StrCat(step_.cloud.size(), " points arrived, the step announced ", shape_.point_count));
}

void TrackReactor::Take() {
  answers_now_ = false;
  const absl::Status status = Guarded([this] { return TakeMessage(); });
  in_memory_.Release();
  if (!status.ok()) {
    Finish(request_.Close(status));
  } else if (answers_now_) {
    Answer();
  } else if (StepIsComplete()) {
    runtime_.queries.Submit(request_.client(), [this] { Follow(); });
  } else {
    Read();
  }
}

absl::Status TrackReactor::TakeMessage() {
  STRATA_RETURN_IF_ERROR(request_.call().stop.status());
  In in;
  STRATA_RETURN_IF_ERROR(request_.Open(message_.bytes, in, in_memory_));
  if (in.has_start() && tracking_ == nullptr) return Begin(in.start());
  if (in.has_step() && tracking_ != nullptr && !step_begun_) return BeginStep(in.step());
  if (in.has_chunk() && step_begun_) return Add(in.chunk());
  if (tracking_ == nullptr) return Misplaced("the first message is the start");
  return Misplaced(step_begun_ ? "the points of a step follow it" : "the next message is a step");
}

absl::Status TrackReactor::Begin(const v1::TrackStart& start) {
  STRATA_ASSIGN_OR_RETURN(const TrackStart begin, AtTheDoor(translate::FromProto(start)));
  STRATA_ASSIGN_OR_RETURN(tracking_,
                          runtime_.db.posegraph().Track(request_.call(), start.map(), begin));
  answers_now_ = true;
  return absl::OkStatus();
}

absl::Status TrackReactor::BeginStep(const v1::TrackStep& step) {
  if (step.point_count() > kMaxStepPoints) {
    return AtTheDoor(absl::ResourceExhaustedError(absl::StrCat("track: ",
                                                               step.point_count(),
                                                               " points announced, at most ",
                                                               kMaxStepPoints,
                                                               "; thin the scan out")));
  }
  STRATA_ASSIGN_OR_RETURN(step_, AtTheDoor(translate::FromProto(step)));
  shape_.point_count = step.point_count();
  shape_.rows = step.rows();
  shape_.columns = step.columns();
  step_.cloud.rows = step.rows();
  step_.cloud.columns = step.columns();
  step_begun_ = true;
  // All at once: a step that was begun is not refused in the middle.
  return Reserve(shape_.point_count, points_memory_, step_.cloud.points);
}

absl::Status TrackReactor::Add(const v1::PointChunk& chunk) {
  STRATA_ASSIGN_OR_RETURN(const PointCloud piece, AtTheDoor(translate::FromProto(chunk)));
  std::vector<Eigen::Vector3f>& points = step_.cloud.points;
  STRATA_RETURN_IF_ERROR(AtTheDoor(api::CheckChunk(piece, shape_, points.size())));
  return Append(piece.points, points_memory_, points);
}

void TrackReactor::Follow() {
  const absl::Status status = Guarded([this] { return FollowStep(); });
  step_ = TrackStep();
  points_memory_.Release();
  step_begun_ = false;
  if (status.ok()) {
    Answer();
  } else {
    Finish(request_.Close(status));
  }
}

absl::Status TrackReactor::FollowStep() {
  STRATA_RETURN_IF_ERROR(request_.call().stop.status());
  STRATA_RETURN_IF_ERROR(request_.StillAllowed());
  STRATA_ASSIGN_OR_RETURN(const TrackedPose pose, tracking_->Step(step_));
  answer_ = translate::ToProto(pose);
  return absl::OkStatus();
}

void TrackReactor::Answer() {
  request_.CountSent(answer_);
  StartWrite(&answer_);
}

void TrackReactor::OnWriteDone(bool ok) {
  if (ok) {
    Read();
  } else {
    Finish(request_.Close(absl::CancelledError("the reader has gone")));
  }
}

}  // namespace strata::server
