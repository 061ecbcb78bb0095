#include "core/engine/upload.h"

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include <Eigen/Core>

#include "core/codec/point_codec.h"
#include "core/common/status.h"
#include "core/engine/map_core.h"
#include "core/storage/storage.h"
#include "core/world/map_class.h"

namespace strata {
namespace {

constexpr std::size_t kStageBytes = std::size_t{1} << 20;
constexpr float kMaxCoordinate = 1e6F;
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

absl::Status CheckColumn(const char* name, std::size_t size, bool announced, std::size_t points) {
  if (size == (announced ? points : 0)) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat("column ",
                                                 name,
                                                 " has ",
                                                 size,
                                                 " entries for ",
                                                 points,
                                                 " points; the header announced ",
                                                 announced ? "it" : "none"));
}

float QuietNan(float value) { return std::isnan(value) ? kNan : value; }

}  // namespace

EngineUpload::EngineUpload(std::shared_ptr<Map> map,
                           const api::Call& call,
                           const ScanHeader& header)
    : map_(std::move(map)), call_(call) {
  record_.header = header;
  record_.upload = map_->core().NextUpload();
}

EngineUpload::~EngineUpload() {
  if (finished_ || staged_ == 0) return;
  // If this fails the next start cleans up.
  map_->core()
      .writer()
      .Run(Durability::kRelaxed,
           0,
           Stop(),
           [this](StorageWriter& writer) { return writer.AbandonUpload(record_.upload); })
      .IgnoreError();
}

absl::Status EngineUpload::Write(const PointCloud& chunk) {
  if (failed_.ok() && finished_) failed_ = absl::FailedPreconditionError("upload is finished");
  if (failed_.ok()) failed_ = call_.stop.status();
  if (failed_.ok()) {
    failed_ = Annotate(WriteChecked(chunk), absl::StrCat("scan ", record_.header.id.ToString()));
  }
  return failed_;
}

absl::Status EngineUpload::WriteChecked(const PointCloud& chunk) {
  STRATA_RETURN_IF_ERROR(CheckChunk(chunk));
  for (std::size_t i = 0; i < chunk.size(); ++i) {
    Append(chunk, i);
    if (piece_.size() == kMaxEncodedPoints) STRATA_RETURN_IF_ERROR(SealPiece());
  }
  points_ += chunk.size();
  return absl::OkStatus();
}

absl::Status EngineUpload::CheckChunk(const PointCloud& chunk) const {
  const ScanHeader& header = record_.header;
  const std::size_t size = chunk.size();
  if (size > api::kMaxPointsPerChunk) {
    return absl::InvalidArgumentError(
        absl::StrCat("piece of ", size, " points; at most ", api::kMaxPointsPerChunk));
  }
  if (!chunk.origin.isZero(0.0)) {
    return absl::InvalidArgumentError("piece with an origin; fold it into the pose");
  }
  if (points_ + size > header.point_count) {
    return absl::InvalidArgumentError(
        absl::StrCat(points_ + size, " points, but the header announced ", header.point_count));
  }
  STRATA_RETURN_IF_ERROR(
      CheckColumn("intensity", chunk.intensity.size(), header.has_intensity, size));
  STRATA_RETURN_IF_ERROR(CheckColumn("colour", chunk.colour.size(), header.has_colour, size));
  STRATA_RETURN_IF_ERROR(CheckColumn("label", chunk.label.size(), header.has_label, size));
  STRATA_RETURN_IF_ERROR(ValidateLabels(chunk.label, points_));
  for (std::size_t i = 0; i < size; ++i) {
    const Eigen::Vector3f& p = chunk.points[i];
    if ((p.array().abs() <= kMaxCoordinate).all()) continue;
    if (header.rows != 0 && p.array().isNaN().all()) continue;
    return absl::InvalidArgumentError(absl::StrCat("point ",
                                                   points_ + i,
                                                   " (",
                                                   p.x(),
                                                   ", ",
                                                   p.y(),
                                                   ", ",
                                                   p.z(),
                                                   ") is not within ±",
                                                   kMaxCoordinate,
                                                   " m"));
  }
  return absl::OkStatus();
}

void EngineUpload::Append(const PointCloud& chunk, std::size_t i) {
  const Eigen::Vector3f& p = chunk.points[i];
  if (std::isnan(p.x())) {
    piece_.points.emplace_back(kNan, kNan, kNan);
  } else {
    piece_.points.push_back(p);
    record_.box_scan.extend(p);
  }
  if (!chunk.intensity.empty()) piece_.intensity.push_back(QuietNan(chunk.intensity[i]));
  if (!chunk.colour.empty()) piece_.colour.push_back(chunk.colour[i]);
  if (!chunk.label.empty()) piece_.label.push_back(chunk.label[i]);
}

absl::Status EngineUpload::SealPiece() {
  hasher_.Add(piece_);
  pieces_.push_back(EncodePoints(piece_));
  pieces_bytes_ += pieces_.back().size();
  record_.point_bytes += pieces_.back().size();
  ++record_.chunks;
  piece_.points.clear();
  piece_.intensity.clear();
  piece_.colour.clear();
  piece_.label.clear();
  return pieces_bytes_ >= kStageBytes ? StagePieces() : absl::OkStatus();
}

absl::Status EngineUpload::StagePieces() {
  const auto put = [this](StorageWriter& writer) -> absl::Status {
    for (std::size_t i = 0; i < pieces_.size(); ++i) {
      STRATA_RETURN_IF_ERROR(
          writer.PutChunk(record_.upload, staged_ + static_cast<std::uint32_t>(i), pieces_[i]));
    }
    return absl::OkStatus();
  };
  STRATA_RETURN_IF_ERROR(
      map_->core().writer().Run(Durability::kRelaxed, pieces_bytes_, call_.stop, put));
  staged_ += static_cast<std::uint32_t>(pieces_.size());
  pieces_.clear();
  pieces_bytes_ = 0;
  return absl::OkStatus();
}

absl::StatusOr<ScanAck> EngineUpload::Commit(StorageWriter& writer) {
  StorageReader& reader = writer.reader();
  STRATA_ASSIGN_OR_RETURN(const MapClock clock, reader.GetClock());
  STRATA_ASSIGN_OR_RETURN(const std::optional<PosedScan> present,
                          reader.FindScan(record_.header.id, clock.epoch));
  if (present.has_value()) {
    if (present->scan.content_hash != record_.content_hash) {
      return absl::AlreadyExistsError("exists with other content");
    }
    STRATA_RETURN_IF_ERROR(writer.AbandonUpload(record_.upload));
    return ScanAck{record_.header.id, present->scan.number, true};
  }
  STRATA_RETURN_IF_ERROR(map_->CheckRoomForPending());
  STRATA_ASSIGN_OR_RETURN(record_.number, writer.NextCommitSequence());
  for (std::size_t i = 0; i < pieces_.size(); ++i) {
    STRATA_RETURN_IF_ERROR(
        writer.PutChunk(record_.upload, staged_ + static_cast<std::uint32_t>(i), pieces_[i]));
  }
  STRATA_RETURN_IF_ERROR(writer.PutScan(record_));
  STRATA_RETURN_IF_ERROR(writer.SetFootprint(
      record_.number, FootprintOf(record_.box_scan, record_.header.T_map_scan)));
  return ScanAck{record_.header.id, record_.number, false};
}

absl::StatusOr<ScanAck> EngineUpload::Finish() {
  const std::string what = absl::StrCat("scan ", record_.header.id.ToString());
  if (failed_.ok() && finished_) failed_ = absl::FailedPreconditionError("upload is finished");
  STRATA_RETURN_IF_ERROR(failed_);
  STRATA_RETURN_IF_ERROR(call_.stop.status());
  if (points_ != record_.header.point_count) {
    return absl::InvalidArgumentError(absl::StrCat(
        what, ": ", points_, " points, but the header announced ", record_.header.point_count));
  }
  if (piece_.size() > 0) STRATA_RETURN_IF_ERROR(SealPiece());
  record_.content_hash = hasher_.Digest(record_.header);
  ScanAck ack;
  const absl::Status committed = map_->core().writer().Run(
      Durability::kFull,
      pieces_bytes_,
      call_.stop,
      [&](StorageWriter& writer) -> absl::Status {
        STRATA_ASSIGN_OR_RETURN(ack, Commit(writer));
        return absl::OkStatus();
      },
      [&] {
        if (!ack.already_present) map_->core().changes().Add(ack.commit_sequence, {ack.id}, {});
      });
  if (!committed.ok()) return Annotate(committed, what);
  finished_ = true;
  if (!ack.already_present) map_->ScanCommitted();
  return ack;
}

}  // namespace strata
