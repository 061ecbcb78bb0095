#include "server/services/ingest_reactor.h"

#include <cstddef>
#include <cstdint>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/time/time.h"

#include "core/common/guarded.h"
#include "core/common/status.h"
#include "core/common/steady_time.h"
#include "proto/translate/scans.h"
#include "proto/translate/status.h"

namespace strata::server {
namespace {

// Scans of one stream between their last point and their answer on the wire.
constexpr std::size_t kMaxUnanswered = 16;

}  // namespace

IngestReactor::IngestReactor(Runtime& runtime, grpc::CallbackServerContext& context)
    : runtime_(runtime),
      request_(runtime, context, "Scans.Ingest"),
      in_memory_(request_.NewBooking()),
      expected_(runtime.silence, request_.call().stop, [this](const absl::Status& status) {
        EndReading(status);
      }) {
  if (!request_.admission().ok()) {
    Finish(request_.Close(request_.admission()));
    return;
  }
  Read();
}

void IngestReactor::Read() {
  expected_.Expect();
  StartRead(&message_);
}

void IngestReactor::OnReadDone(bool ok) {
  if (!expected_.Arrived()) return;
  if (ok) {
    runtime_.uploads.Submit(request_.client(), [this] { Take(); });
  } else {
    runtime_.uploads.Submit(request_.client(), [this] {
      AbandonIncomplete();
      EndReading(absl::OkStatus());
    });
  }
}

void IngestReactor::Take() {
  const absl::Status status = Guarded([this] { return TakeMessage(); });
  if (!status.ok()) {
    EndReading(status);
    return;
  }
  absl::MutexLock lock(&mutex_);
  reading_ = false;
  StartReadIfRoom();
}

absl::Status IngestReactor::TakeMessage() {
  STRATA_RETURN_IF_ERROR(request_.call().stop.status());
  In in;
  const absl::Status allowed = request_.Open(message_.bytes, in, in_memory_);
  // Another scan's map may be his to write to.
  if (!allowed.ok() && !absl::IsPermissionDenied(allowed)) return allowed;
  if (in.has_start()) {
    AbandonIncomplete();
    Begin(in.start(), allowed);
    return absl::OkStatus();
  }
  if (in.has_chunk()) return Add(in.chunk(), allowed);
  return AtTheDoor(
      absl::InvalidArgumentError("ingest: a message is the start of a scan or a chunk"));
}

void IngestReactor::Begin(const v1::ScanStart& start, const absl::Status& allowed) {
  current_id_ = start.header().id();
  const absl::Status held = allowed.ok() ? HoldChunk(start.header(), in_memory_) : allowed;
  absl::StatusOr<ScanReceiver> begun =
      held.ok() ? ScanReceiver::Begin(runtime_.db, request_.call(), start, request_.NewBooking())
                : held;
  passing_over_ = !begun.ok();
  if (!begun.ok()) {
    EndScan(begun.status());
    return;
  }
  current_ = *std::move(begun);
  if (start.resume()) Accept(current_->points_held());
  if (!current_->complete()) return;
  // A client that does not resume sends all points of a scan that is there all the same.
  passing_over_ = current_->points_held() > 0;
  EndScan(absl::OkStatus());
}

void IngestReactor::Accept(std::uint64_t points_held) {
  v1::IngestScansResponse answer;
  *answer.mutable_id() = current_id_;
  answer.mutable_accepted()->set_points_held(points_held);
  request_.CountSent(answer);
  absl::MutexLock lock(&mutex_);
  answers_.push_back(std::move(answer));
  StartWriteIfIdle();
}

absl::Status IngestReactor::Add(const v1::PointChunk& chunk, const absl::Status& allowed) {
  if (passing_over_) return absl::OkStatus();
  if (!current_.has_value()) {
    return AtTheDoor(
        absl::InvalidArgumentError("ingest: a chunk belongs to no scan; send its start"));
  }
  const absl::Status status = allowed.ok() ? current_->Add(chunk) : allowed;
  passing_over_ = !status.ok();
  if (!status.ok() || current_->complete()) EndScan(status);
  return absl::OkStatus();
}

void IngestReactor::AbandonIncomplete() {
  // The receiver itself says what is missing.
  if (current_.has_value()) EndScan(current_->Finish().status());
}

void IngestReactor::EndScan(const absl::Status& error) {
  Ended ended{current_id_, std::nullopt, error};
  if (error.ok()) ended.scan = std::move(current_);
  current_.reset();
  absl::MutexLock lock(&mutex_);
  ended_.push_back(std::move(ended));
  StartCommitIfIdle();
}

void IngestReactor::EndReading(const absl::Status& status) {
  current_.reset();
  absl::MutexLock lock(&mutex_);
  reading_ = false;
  reading_ended_ = true;
  stream_status_ = status;
  FinishIfDone();
}

void IngestReactor::Commit() {
  Ended ended;
  {
    absl::MutexLock lock(&mutex_);
    ended = std::move(ended_.front());
  }
  v1::IngestScansResponse answer = Answer(ended);
  ended.scan.reset();
  request_.CountSent(answer);
  absl::MutexLock lock(&mutex_);
  committing_ = false;
  ended_.pop_front();
  answers_.push_back(std::move(answer));
  StartCommitIfIdle();
  StartWriteIfIdle();
}

v1::IngestScansResponse IngestReactor::Answer(Ended& ended) {
  v1::IngestScansResponse answer;
  *answer.mutable_id() = ended.id;
  absl::Status status = ended.error;
  if (status.ok()) {
    status = Guarded([&]() -> absl::Status {
      STRATA_RETURN_IF_ERROR(request_.call().stop.status());
      const absl::Time begun = SteadyNow();
      STRATA_ASSIGN_OR_RETURN(const ScanAck ack, ended.scan->Finish());
      runtime_.metrics.Acknowledged(SteadyNow() - begun);
      *answer.mutable_ack() = translate::ToProto(ack);
      return absl::OkStatus();
    });
  }
  if (!status.ok()) {
    *answer.mutable_error() = translate::ToScanError(status, request_.call().request_id);
  }
  return answer;
}

void IngestReactor::OnWriteDone(bool ok) {
  absl::MutexLock lock(&mutex_);
  writing_ = false;
  answers_.pop_front();
  // A reader that is gone needs no answers; the end of its stream follows.
  if (!ok) answers_.clear();
  StartWriteIfIdle();
  StartReadIfRoom();
  FinishIfDone();
}

void IngestReactor::OnDone() {
  // Whoever finished the call still holds the mutex for an instant.
  mutex_.Lock();
  mutex_.Unlock();
  delete this;
}

void IngestReactor::StartCommitIfIdle() {
  if (committing_ || ended_.empty()) return;
  committing_ = true;
  runtime_.uploads.Submit(request_.client(), [this] { Commit(); });
}

void IngestReactor::StartWriteIfIdle() {
  if (writing_ || answers_.empty()) return;
  writing_ = true;
  StartWrite(&answers_.front());
}

void IngestReactor::StartReadIfRoom() {
  if (reading_ || reading_ended_ || ended_.size() + answers_.size() >= kMaxUnanswered) return;
  reading_ = true;
  Read();
}

bool IngestReactor::Done() const {
  return reading_ended_ && !committing_ && ended_.empty() && !writing_ && answers_.empty();
}

void IngestReactor::FinishIfDone() {
  if (Done()) Finish(request_.Close(stream_status_));
}

}  // namespace strata::server
