#include "core/engine/scans/scan_labels.h"

#include <algorithm>
#include <optional>
#include <span>
#include <utility>

#include "absl/strings/str_cat.h"

#include "core/codec/label_codec.h"
#include "core/common/status.h"

namespace strata {
namespace {

absl::StatusOr<std::vector<std::uint16_t>> Decode(const std::string& bytes, std::uint32_t piece) {
  absl::StatusOr<std::vector<std::uint16_t>> labels = DecodeLabels(bytes);
  if (labels.ok()) return labels;
  return Annotate(labels.status(), absl::StrCat("labels, piece ", piece));
}

// nullopt where there is no such piece.
absl::StatusOr<std::optional<std::vector<std::uint16_t>>> ReadPiece(StorageReader& reader,
                                                                    ScanNumber scan,
                                                                    LabelOrigin origin,
                                                                    std::uint32_t piece) {
  using Piece = std::optional<std::vector<std::uint16_t>>;
  STRATA_ASSIGN_OR_RETURN(const std::optional<std::string> bytes,
                          reader.FindLabels(scan, origin, piece));
  if (!bytes.has_value()) return Piece();
  STRATA_ASSIGN_OR_RETURN(std::vector<std::uint16_t> labels, Decode(*bytes, piece));
  return Piece(std::move(labels));
}

}  // namespace

std::vector<std::string> EncodeLabelChange(const LabelChange& change) {
  std::vector<std::string> pieces;
  const std::span<const std::uint16_t> labels(change.labels);
  const bool none =
      std::all_of(labels.begin(), labels.end(), [](std::uint16_t label) { return label == 0; });
  if (none && change.origin != LabelOrigin::kModel) return pieces;
  for (std::size_t begin = 0; begin < labels.size(); begin += kMaxEncodedLabels) {
    const std::size_t count = std::min(kMaxEncodedLabels, labels.size() - begin);
    pieces.push_back(EncodeLabels(labels.subspan(begin, count)));
  }
  return pieces;
}

absl::StatusOr<std::vector<std::uint16_t>> ReadLabels(StorageReader& reader,
                                                      const ScanRecord& scan,
                                                      LabelOrigin origin) {
  std::vector<std::uint16_t> labels;
  for (std::uint32_t piece = 0;; ++piece) {
    STRATA_ASSIGN_OR_RETURN(const auto more, ReadPiece(reader, scan.number, origin, piece));
    if (!more.has_value()) break;
    labels.insert(labels.end(), more->begin(), more->end());
  }
  labels.resize(scan.header.point_count);
  return labels;
}

absl::StatusOr<std::uint64_t> CountLabels(StorageReader& reader,
                                          const ScanRecord& scan,
                                          LabelOrigin origin) {
  std::uint64_t count = 0;
  for (std::uint32_t piece = 0;; ++piece) {
    STRATA_ASSIGN_OR_RETURN(const auto more, ReadPiece(reader, scan.number, origin, piece));
    if (!more.has_value()) return count;
    count += more->size();
  }
}

ScanLabels::ScanLabels(const ScanRecord& scan, const LabelView& view)
    : scan_(scan.number), uploaded_(scan.header.has_label) {
  person_ = {.wanted = scan.person_labels, .origin = LabelOrigin::kPerson, .held = {}};
  model_ = {
      .wanted = scan.label_model != 0 && view.models, .origin = LabelOrigin::kModel, .held = {}};
  faded_ = {.wanted = scan.faded_points != 0, .origin = LabelOrigin::kFaded, .held = {}};
  if (view.change == nullptr) return;
  Column& changed = view.change->origin == LabelOrigin::kPerson  ? person_
                    : view.change->origin == LabelOrigin::kModel ? model_
                                                                 : faded_;
  changed.wanted = true;
  changed.change = view.change;
}

absl::Status ScanLabels::Hold(StorageReader& reader) {
  for (Column* const column : {&person_, &model_, &faded_}) {
    if (!column->wanted || column->change != nullptr) continue;
    std::vector<std::string>& stored = column->stored.emplace();
    while (true) {
      STRATA_ASSIGN_OR_RETURN(
          std::optional<std::string> bytes,
          reader.FindLabels(scan_, column->origin, static_cast<std::uint32_t>(stored.size())));
      if (!bytes.has_value()) break;
      stored.push_back(*std::move(bytes));
    }
  }
  return absl::OkStatus();
}

absl::StatusOr<std::vector<std::uint16_t>> ScanLabels::NextPiece(StorageReader& reader,
                                                                 Column& column) const {
  const std::uint32_t piece = column.next_piece++;
  if (!column.stored.has_value()) {
    STRATA_ASSIGN_OR_RETURN(auto read, ReadPiece(reader, scan_, column.origin, piece));
    return std::move(read).value_or(std::vector<std::uint16_t>());
  }
  if (piece >= column.stored->size()) return std::vector<std::uint16_t>();
  return Decode((*column.stored)[piece], piece);
}

absl::StatusOr<std::uint16_t> ScanLabels::Next(StorageReader& reader, Column& column) const {
  if (column.change != nullptr) {
    const std::vector<std::uint16_t>& labels = column.change->labels;
    return column.used < labels.size() ? labels[column.used++] : std::uint16_t{0};
  }
  if (column.used == column.held.size()) {
    STRATA_ASSIGN_OR_RETURN(column.held, NextPiece(reader, column));
    column.used = 0;
    if (column.held.empty()) {
      column.held.assign(kMaxEncodedLabels, 0);
    }
  }
  return column.held[column.used++];
}

absl::Status ScanLabels::Apply(StorageReader& reader, PointCloud& piece) {
  if (!person_.wanted && !model_.wanted && !uploaded_) return absl::OkStatus();
  piece.label.resize(piece.size(), 0);
  for (std::uint16_t& label : piece.label) {
    std::uint16_t said = 0;
    std::uint16_t guessed = 0;
    if (person_.wanted) {
      STRATA_ASSIGN_OR_RETURN(said, Next(reader, person_));
    }
    if (model_.wanted) {
      STRATA_ASSIGN_OR_RETURN(guessed, Next(reader, model_));
    }
    if (said != 0) {
      label = said;
    } else if (label == 0) {
      label = guessed;
    }
  }
  return absl::OkStatus();
}

absl::StatusOr<std::vector<std::uint16_t>> ScanLabels::Faded(StorageReader& reader,
                                                             std::size_t count) {
  std::vector<std::uint16_t> faded;
  if (!faded_.wanted) return faded;
  faded.reserve(count);
  while (faded.size() < count) {
    STRATA_ASSIGN_OR_RETURN(const std::uint16_t seen_through, Next(reader, faded_));
    faded.push_back(seen_through);
  }
  return faded;
}

}  // namespace strata
