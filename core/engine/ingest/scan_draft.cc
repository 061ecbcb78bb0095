#include "core/engine/ingest/scan_draft.h"

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
#include <Eigen/Core>

#include "core/api/chunk_check.h"
#include "core/codec/point_codec.h"
#include "core/common/status.h"

namespace strata {

ScanDraft::ScanDraft(const ScanHeader& header, std::uint64_t upload) {
  record_.header = header;
  record_.upload = upload;
}

absl::Status ScanDraft::Load(StorageReader& reader, const UnfinishedUpload& parked) {
  record_.upload = parked.upload;
  staged_ = parked.chunks;
  for (std::uint32_t ordinal = 0; ordinal < parked.chunks; ++ordinal) {
    STRATA_ASSIGN_OR_RETURN(const std::string bytes, reader.GetChunk(parked.upload, ordinal));
    STRATA_ASSIGN_OR_RETURN(const PointCloud piece, DecodePoints(bytes));
    STRATA_RETURN_IF_ERROR(Check(piece));
    hasher_.Add(piece);
    for (const Eigen::Vector3f& p : piece.points) {
      if (!std::isnan(p.x())) record_.box_scan.extend(p);
    }
    points_ += piece.size();
    ++record_.chunks;
    record_.point_bytes += bytes.size();
  }
  return absl::OkStatus();
}

absl::Status ScanDraft::Check(const PointCloud& chunk) const {
  return api::CheckChunk(chunk, record_.header, points_);
}

absl::Status ScanDraft::Add(const PointCloud& chunk) {
  for (std::size_t begin = 0, end = 0; begin < chunk.size(); begin = end) {
    end = std::min(chunk.size(), begin + kMaxEncodedPoints - piece_.size());
    Append(chunk, begin, end);
    if (piece_.size() == kMaxEncodedPoints) STRATA_RETURN_IF_ERROR(Seal());
  }
  points_ += chunk.size();
  return absl::OkStatus();
}

void ScanDraft::Append(const PointCloud& chunk, std::size_t begin, std::size_t end) {
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

absl::Status ScanDraft::Seal() {
  if (piece_.size() == 0) return absl::OkStatus();
  STRATA_ASSIGN_OR_RETURN(std::string bytes, EncodePoints(piece_));
  hasher_.Add(piece_);
  waiting_.push_back(std::move(bytes));
  waiting_bytes_ += waiting_.back().size();
  record_.point_bytes += waiting_.back().size();
  ++record_.chunks;
  piece_.points.clear();
  piece_.intensity.clear();
  piece_.colour.clear();
  piece_.label.clear();
  return absl::OkStatus();
}

absl::Status ScanDraft::CheckWhole() {
  const ScanHeader& header = record_.header;
  if (points_ != header.point_count) {
    return absl::InvalidArgumentError(
        absl::StrCat(points_, " points, but the header announced ", header.point_count));
  }
  if (announced() && !hasher_.Matches(header, header.content_hash)) {
    return absl::InvalidArgumentError(absl::StrCat("content_hash of what arrived is ",
                                                   hasher_.Digest(header),
                                                   ", but the header announced ",
                                                   header.content_hash,
                                                   "; nothing of it is kept"));
  }
  record_.content_hash = announced() ? header.content_hash : hasher_.Digest(header);
  return absl::OkStatus();
}

absl::Status ScanDraft::PutPieces(StorageWriter& writer) const {
  std::uint32_t ordinal = staged_;
  for (const std::string& bytes : waiting_) {
    STRATA_RETURN_IF_ERROR(writer.PutChunk(record_.upload, ordinal++, bytes));
  }
  return absl::OkStatus();
}

void ScanDraft::Staged() {
  staged_ += static_cast<std::uint32_t>(waiting_.size());
  waiting_.clear();
  waiting_bytes_ = 0;
}

absl::StatusOr<ScanAck> ScanDraft::Commit(StorageWriter& writer, CheckRoom check_room) {
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
  STRATA_RETURN_IF_ERROR(PutPieces(writer));
  STRATA_RETURN_IF_ERROR(writer.PutScan(record_));
  STRATA_RETURN_IF_ERROR(writer.SetFootprint(
      record_.number, FootprintOf(record_.box_scan, record_.header.T_map_scan)));
  return ScanAck{record_.header.id, record_.number, false, record_.content_hash};
}

}  // namespace strata
