#include "core/engine/ingest/scan_intake.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include <Eigen/Core>

#include "core/api/chunk_check.h"
#include "core/codec/point_codec.h"
#include "core/common/status.h"
#include "core/common/steady_time.h"
#include "core/storage/storage.h"

namespace strata {
namespace {

constexpr std::size_t kStageBytes = std::size_t{1} << 20;

}  // namespace

absl::StatusOr<std::uint64_t> ScanIntake::Take() {
  absl::MutexLock lock(&mutex_);
  const bool begun = hasher_.has_value() && !dead_;
  if (!begun) {
    BeginAnew();
    STRATA_RETURN_IF_ERROR(Load());
  }
  return ++ticket_;
}

void ScanIntake::BeginAnew() {
  record_ = ScanRecord();
  record_.header = header_;
  record_.upload = core_.NextUpload();
  hasher_.emplace();
  piece_ = PointCloud();
  pieces_.clear();
  pieces_bytes_ = 0;
  staged_ = 0;
  points_ = 0;
  dead_ = false;
}

absl::Status ScanIntake::Load() {
  if (!parked_.has_value()) return absl::OkStatus();
  {
    STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, core_.Reader());
    const absl::Status loaded = LoadPieces(*reader, *parked_);
    record_.upload = parked_->upload;
    staged_ = parked_->chunks;
    touched_ = parked_->touched;
    parked_.reset();
    if (loaded.ok()) return loaded;
  }
  Abandon();
  BeginAnew();
  return absl::OkStatus();
}

absl::Status ScanIntake::LoadPieces(StorageReader& reader, const UnfinishedUpload& parked) {
  for (std::uint32_t ordinal = 0; ordinal < parked.chunks; ++ordinal) {
    STRATA_ASSIGN_OR_RETURN(const std::string bytes, reader.GetChunk(parked.upload, ordinal));
    STRATA_ASSIGN_OR_RETURN(const PointCloud piece, DecodePoints(bytes));
    STRATA_RETURN_IF_ERROR(api::CheckChunk(piece, header_, points_));
    hasher_->Add(piece);
    for (const Eigen::Vector3f& p : piece.points) {
      if (!std::isnan(p.x())) record_.box_scan.extend(p);
    }
    points_ += piece.size();
    ++record_.chunks;
    record_.point_bytes += bytes.size();
  }
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
  return points_;
}

absl::Status ScanIntake::Write(std::uint64_t ticket, const Stop& stop, const PointCloud& chunk) {
  absl::MutexLock lock(&mutex_);
  STRATA_RETURN_IF_ERROR(CheckTicket(ticket));
  if (chunk.size() == 0) return absl::OkStatus();
  if (const absl::Status sound = api::CheckChunk(chunk, header_, points_); !sound.ok()) {
    Abandon();
    return sound;
  }
  for (std::size_t begin = 0, end = 0; begin < chunk.size(); begin = end) {
    end = std::min(chunk.size(), begin + kMaxEncodedPoints - piece_.size());
    Append(chunk, begin, end);
    if (piece_.size() == kMaxEncodedPoints) STRATA_RETURN_IF_ERROR(SealPiece());
  }
  points_ += chunk.size();
  return pieces_bytes_ >= kStageBytes ? StagePieces(stop) : absl::OkStatus();
}

void ScanIntake::Append(const PointCloud& chunk, std::size_t begin, std::size_t end) {
  const std::size_t first = piece_.size();
  const auto append = [=](const auto& from, auto& to) {
    if (!from.empty()) to.insert(to.end(), from.data() + begin, from.data() + end);
  };
  append(chunk.points, piece_.points);
  append(chunk.intensity, piece_.intensity);
  append(chunk.colour, piece_.colour);
  append(chunk.label, piece_.label);
  QuietNans(piece_, first);
  for (std::size_t i = first; i < piece_.size(); ++i) {
    if (!std::isnan(piece_.points[i].x())) record_.box_scan.extend(piece_.points[i]);
  }
}

absl::Status ScanIntake::SealPiece() {
  STRATA_ASSIGN_OR_RETURN(std::string bytes, EncodePoints(piece_));
  hasher_->Add(piece_);
  pieces_.push_back(std::move(bytes));
  pieces_bytes_ += pieces_.back().size();
  record_.point_bytes += pieces_.back().size();
  ++record_.chunks;
  piece_.points.clear();
  piece_.intensity.clear();
  piece_.colour.clear();
  piece_.label.clear();
  return absl::OkStatus();
}

absl::Status ScanIntake::StagePieces(const Stop& stop) {
  touched_ = SteadyNow();
  UnfinishedUpload unfinished = Unfinished();
  unfinished.touched = absl::Now();  // for later runs
  const auto put = [&, this](StorageWriter& writer) ABSL_NO_THREAD_SAFETY_ANALYSIS -> absl::Status {
    for (std::size_t i = 0; i < pieces_.size(); ++i) {
      STRATA_RETURN_IF_ERROR(
          writer.PutChunk(record_.upload, staged_ + static_cast<std::uint32_t>(i), pieces_[i]));
    }
    return unfinished.content_hash.empty() ? absl::OkStatus() : writer.KeepUpload(unfinished);
  };
  STRATA_RETURN_IF_ERROR(core_.writer().Run(Durability::kRelaxed, pieces_bytes_, stop, put));
  staged_ += static_cast<std::uint32_t>(pieces_.size());
  pieces_.clear();
  pieces_bytes_ = 0;
  return absl::OkStatus();
}

absl::Status ScanIntake::CheckWhole() const {
  if (points_ != header_.point_count) {
    return absl::InvalidArgumentError(
        absl::StrCat(points_, " points, but the header announced ", header_.point_count));
  }
  if (announced() && !hasher_->Matches(header_, header_.content_hash)) {
    return absl::InvalidArgumentError(absl::StrCat("content_hash of what arrived is ",
                                                   hasher_->Digest(header_),
                                                   ", but the header announced ",
                                                   header_.content_hash,
                                                   "; nothing of it is kept"));
  }
  return absl::OkStatus();
}

absl::StatusOr<ScanAck> ScanIntake::Commit(StorageWriter& writer, CheckRoom check_room) {
  StorageReader& reader = writer.reader();
  STRATA_ASSIGN_OR_RETURN(const MapClock clock, reader.GetClock());
  STRATA_ASSIGN_OR_RETURN(const std::optional<PosedScan> present,
                          reader.FindScan(record_.header.id, clock.epoch));
  if (present.has_value()) {
    if (present->scan.content_hash != record_.content_hash) {
      return absl::AlreadyExistsError("exists with other content");
    }
    STRATA_RETURN_IF_ERROR(writer.AbandonUpload(record_.upload));
    return ScanAck{record_.header.id, present->scan.number, true, record_.content_hash};
  }
  STRATA_RETURN_IF_ERROR(check_room());
  STRATA_ASSIGN_OR_RETURN(record_.number, writer.NextCommitSequence());
  for (std::size_t i = 0; i < pieces_.size(); ++i) {
    STRATA_RETURN_IF_ERROR(
        writer.PutChunk(record_.upload, staged_ + static_cast<std::uint32_t>(i), pieces_[i]));
  }
  STRATA_RETURN_IF_ERROR(writer.PutScan(record_));
  STRATA_RETURN_IF_ERROR(writer.SetFootprint(
      record_.number, FootprintOf(record_.box_scan, record_.header.T_map_scan)));
  return ScanAck{record_.header.id, record_.number, false, record_.content_hash};
}

absl::StatusOr<ScanAck> ScanIntake::Finish(std::uint64_t ticket,
                                           const Stop& stop,
                                           CheckRoom check_room,
                                           absl::FunctionRef<void(ScanNumber)> committed) {
  absl::MutexLock lock(&mutex_);
  STRATA_RETURN_IF_ERROR(CheckTicket(ticket));
  if (piece_.size() > 0) STRATA_RETURN_IF_ERROR(SealPiece());
  if (const absl::Status whole = CheckWhole(); !whole.ok()) {
    Abandon();
    return whole;
  }
  record_.content_hash = announced() ? header_.content_hash : hasher_->Digest(header_);
  ScanAck ack;
  const absl::Status done = core_.writer().Run(
      Durability::kFull,
      pieces_bytes_,
      stop,
      [&](StorageWriter& writer) ABSL_NO_THREAD_SAFETY_ANALYSIS -> absl::Status {
        STRATA_ASSIGN_OR_RETURN(ack, Commit(writer, check_room));
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
  if (staged_ == 0) return;
  // If this fails the next start cleans up: what is announced, once it has been kept long enough.
  core_.writer()
      .Run(
          Durability::kRelaxed,
          0,
          Stop(),
          [upload = record_.upload](StorageWriter& writer) { return writer.AbandonUpload(upload); })
      .IgnoreError();
}

UnfinishedUpload ScanIntake::Unfinished() const {
  return {.upload = record_.upload,
          .id = header_.id,
          .content_hash = header_.content_hash,
          .touched = touched_,
          .chunks = staged_,
          .bytes = record_.point_bytes};
}

void ScanIntake::EndStream(std::uint64_t ticket) {
  absl::MutexLock lock(&mutex_);
  if (parked_.has_value() || ticket != ticket_ || dead_) return;
  if (!announced() || core_.options().upload_keep == absl::ZeroDuration()) {
    Abandon();
    return;
  }
  // What does not get there is sent again.
  if (piece_.size() > 0 && !SealPiece().ok()) return;
  if (!pieces_.empty()) StagePieces(Stop()).IgnoreError();
}

std::optional<UnfinishedUpload> ScanIntake::Rest() const {
  absl::MutexLock lock(&mutex_);
  if (parked_.has_value()) return parked_;  // it was not taken up
  if (dead_ || !announced() || staged_ == 0) return std::nullopt;
  return Unfinished();
}

}  // namespace strata
