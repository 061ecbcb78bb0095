#include "server/services/localize_reactor.h"

#include <utility>

#include "absl/strings/str_cat.h"

#include "core/api/chunk_check.h"
#include "core/common/guarded.h"
#include "core/common/status.h"
#include "proto/translate/localize.h"
#include "proto/translate/points.h"
#include "server/services/append.h"

namespace strata::server {
namespace {

constexpr std::uint64_t kMaxPoints = 2'000'000;

absl::Status OutOfOrder(absl::string_view rule) {
  return absl::InvalidArgumentError(absl::StrCat("localize: ", rule));
}

}  // namespace

LocalizeReactor::LocalizeReactor(Runtime& runtime, grpc::CallbackServerContext& context, Out& out)
    : runtime_(runtime),
      request_(runtime, context, "PoseGraph.Localize"),
      in_memory_(request_.NewBooking()),
      points_memory_(request_.NewBooking()),
      out_(out),
      expected_(runtime.silence, request_.call().stop, [this](const absl::Status& status) {
        Finish(request_.Close(status));
      }) {
  if (!request_.admission().ok()) {
    Finish(request_.Close(request_.admission()));
    return;
  }
  Read();
}

void LocalizeReactor::Read() {
  expected_.Expect();
  StartRead(&message_);
}

void LocalizeReactor::OnReadDone(bool ok) {
  if (!expected_.Arrived()) return;
  if (ok) {
    runtime_.uploads.Submit(request_.client(), [this] { Take(); });
  } else {
    runtime_.queries.Submit(request_.client(), [this] { Search(); });
  }
}

void LocalizeReactor::Take() {
  const absl::Status status = Guarded([this] { return TakeMessage(); });
  in_memory_.Release();
  if (status.ok()) {
    Read();
  } else {
    Finish(request_.Close(status));
  }
}

absl::Status LocalizeReactor::TakeMessage() {
  STRATA_RETURN_IF_ERROR(request_.call().stop.status());
  In in;
  STRATA_RETURN_IF_ERROR(request_.Open(message_.bytes, in, in_memory_));
  if (in.has_start() && !begun_) {
    STRATA_RETURN_IF_ERROR(AtTheDoor(Begin(in.start())));
    // All at once: a scan that was begun is not refused in the middle.
    return Reserve(shape_.point_count, points_memory_, query_.cloud.points);
  }
  if (in.has_chunk() && begun_) return Add(in.chunk());
  return AtTheDoor(OutOfOrder(begun_ ? "every message after the first is a chunk"
                                     : "the first message is the start of the scan"));
}

absl::Status LocalizeReactor::Begin(const v1::LocalizeStart& start) {
  if (start.point_count() > kMaxPoints) {
    return absl::ResourceExhaustedError(absl::StrCat("localize: ",
                                                     start.point_count(),
                                                     " points announced, at most ",
                                                     kMaxPoints,
                                                     "; thin the scan out"));
  }
  STRATA_ASSIGN_OR_RETURN(query_, translate::FromProto(start));
  map_ = start.map();
  shape_.point_count = start.point_count();
  shape_.rows = start.rows();
  shape_.columns = start.columns();
  begun_ = true;
  return absl::OkStatus();
}

absl::Status LocalizeReactor::Add(const v1::PointChunk& chunk) {
  STRATA_ASSIGN_OR_RETURN(const PointCloud piece, AtTheDoor(translate::FromProto(chunk)));
  std::vector<Eigen::Vector3f>& points = query_.cloud.points;
  STRATA_RETURN_IF_ERROR(AtTheDoor(api::CheckChunk(piece, shape_, points.size())));
  return Append(piece.points, points_memory_, points);
}

absl::Status LocalizeReactor::CheckComplete() const {
  if (!begun_) return OutOfOrder("the stream ended before its scan began");
  if (query_.cloud.size() != shape_.point_count) {
    return OutOfOrder(absl::StrCat(
        query_.cloud.size(), " points arrived, the start announced ", shape_.point_count));
  }
  return ValidateLocalizeQuery(query_);
}

void LocalizeReactor::Search() {
  const absl::Status status = Guarded([this]() -> absl::Status {
    // The stream also ends when the client has gone.
    STRATA_RETURN_IF_ERROR(request_.call().stop.status());
    STRATA_RETURN_IF_ERROR(request_.StillAllowed());
    STRATA_RETURN_IF_ERROR(AtTheDoor(CheckComplete()));
    STRATA_ASSIGN_OR_RETURN(const LocalizeResult result,
                            runtime_.db.posegraph().Localize(request_.call(), map_, query_));
    out_ = translate::ToProto(result);
    return absl::OkStatus();
  });
  request_.CountSent(out_);
  Finish(request_.Close(status));
}

}  // namespace strata::server
