#include "core/engine/ingest/scan_intake.h"

#include <cstdint>
#include <optional>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/clock.h"

#include "core/common/status.h"
#include "core/common/steady_time.h"
#include "core/storage/storage.h"

namespace strata {
absl::StatusOr<std::uint64_t> ScanIntake::Take() {
  absl::MutexLock lock(&mutex_);
  const bool begun = draft_.has_value() && !dead_;
  if (!begun) {
    BeginAnew();
    STRATA_RETURN_IF_ERROR(Load());
  }
  return ++ticket_;
}

void ScanIntake::BeginAnew() {
  draft_.emplace(header_, core_.NextUpload());
  dead_ = false;
}

absl::Status ScanIntake::Load() {
  if (!parked_.has_value()) return absl::OkStatus();
  {
    STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, core_.Reader());
    const absl::Status loaded = draft_->Load(*reader, *parked_);
    touched_ = parked_->touched;
    parked_.reset();
    if (loaded.ok()) return loaded;
  }
  Abandon();
  BeginAnew();
  return absl::OkStatus();
}

absl::Status ScanIntake::CheckTicket(std::uint64_t ticket) const {
  if (ticket != ticket_) {
    return absl::AbortedError("another stream of the same scan has taken over");
  }
  return dead_ ? absl::FailedPreconditionError("upload is finished") : absl::OkStatus();
}

std::uint64_t ScanIntake::points() const {
  absl::MutexLock lock(&mutex_);
  return draft_.has_value() ? draft_->points() : 0;
}

absl::Status ScanIntake::Write(std::uint64_t ticket, const Stop& stop, const PointCloud& chunk) {
  absl::MutexLock lock(&mutex_);
  STRATA_RETURN_IF_ERROR(CheckTicket(ticket));
  if (chunk.size() == 0) return absl::OkStatus();
  if (const absl::Status sound = draft_->Check(chunk); !sound.ok()) {
    Abandon();
    return sound;
  }
  STRATA_RETURN_IF_ERROR(draft_->Add(chunk));
  return draft_->waiting_bytes() >= kStageBytes ? StagePieces(stop) : absl::OkStatus();
}

absl::Status ScanIntake::StagePieces(const Stop& stop) {
  touched_ = SteadyNow();
  UnfinishedUpload unfinished = Unfinished();
  unfinished.touched = absl::Now();  // for later runs
  const auto put = [&, this](StorageWriter& writer) ABSL_NO_THREAD_SAFETY_ANALYSIS -> absl::Status {
    STRATA_RETURN_IF_ERROR(draft_->PutPieces(writer));
    return unfinished.content_hash.empty() ? absl::OkStatus() : writer.KeepUpload(unfinished);
  };
  STRATA_RETURN_IF_ERROR(
      core_.writer().Run(Durability::kRelaxed, draft_->waiting_bytes(), stop, put));
  draft_->Staged();
  return absl::OkStatus();
}

absl::StatusOr<ScanAck> ScanIntake::Finish(std::uint64_t ticket,
                                           const Stop& stop,
                                           CheckRoom check_room,
                                           absl::FunctionRef<void(ScanNumber)> committed) {
  absl::MutexLock lock(&mutex_);
  STRATA_RETURN_IF_ERROR(CheckTicket(ticket));
  STRATA_RETURN_IF_ERROR(draft_->Seal());
  if (const absl::Status whole = draft_->CheckWhole(); !whole.ok()) {
    Abandon();
    return whole;
  }
  ScanAck ack;
  const absl::Status done = core_.writer().Run(
      Durability::kFull,
      draft_->waiting_bytes(),
      stop,
      [&](StorageWriter& writer) ABSL_NO_THREAD_SAFETY_ANALYSIS -> absl::Status {
        STRATA_ASSIGN_OR_RETURN(ack, draft_->Commit(writer, check_room));
        return absl::OkStatus();
      },
      [&] {
        if (ack.already_present) return;
        core_.changes().Add(ack.commit_sequence, {ack.id}, {});
        committed(ack.commit_sequence);
      });
  if (absl::IsAlreadyExists(done)) Abandon();
  STRATA_RETURN_IF_ERROR(done);
  dead_ = true;
  return ack;
}

void ScanIntake::Abandon() {
  dead_ = true;
  if (draft_->staged() == 0) return;
  // If this fails the next start cleans up: what is announced, once it has been kept long enough.
  core_.writer()
      .Run(Durability::kRelaxed,
           0,
           Stop(),
           [upload = draft_->upload()](StorageWriter& writer) {
             return writer.AbandonUpload(upload);
           })
      .IgnoreError();
}

UnfinishedUpload ScanIntake::Unfinished() const {
  return {.upload = draft_->upload(),
          .id = header_.id,
          .content_hash = header_.content_hash,
          .touched = touched_,
          .chunks = draft_->staged(),
          .bytes = draft_->point_bytes()};
}

void ScanIntake::EndStream(std::uint64_t ticket) {
  absl::MutexLock lock(&mutex_);
  if (parked_.has_value() || ticket != ticket_ || dead_) return;
  if (!announced() || core_.options().upload_keep == absl::ZeroDuration()) {
    Abandon();
    return;
  }
  // What does not get there is sent again.
  if (!draft_->Seal().ok()) return;
  if (draft_->waiting_bytes() > 0) StagePieces(Stop()).IgnoreError();
}

std::optional<UnfinishedUpload> ScanIntake::Rest() const {
  absl::MutexLock lock(&mutex_);
  if (parked_.has_value()) return parked_;  // it was not taken up
  if (dead_ || !announced() || !draft_.has_value() || draft_->staged() == 0) return std::nullopt;
  return Unfinished();
}

}  // namespace strata
