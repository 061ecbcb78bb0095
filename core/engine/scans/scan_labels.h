// Which label of a point counts: what a person said, else what was uploaded, else what a classifier
// says. 0 is nothing said.
#ifndef STRATA_CORE_ENGINE_SCANS_SCAN_LABELS_H_
#define STRATA_CORE_ENGINE_SCANS_SCAN_LABELS_H_

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "core/cloud/point_cloud.h"
#include "core/storage/storage.h"

namespace strata {

// Labels that a scan gets.
struct LabelChange {
  LabelOrigin origin = LabelOrigin::kPerson;
  std::uint64_t model = 0;            // of kModel; of kFaded, how many labels are not 0
  std::vector<std::uint16_t> labels;  // of every point, in order; all 0: none at all but of kModel
};

// The pieces that storage keeps of `change`; none where it takes labels away.
std::vector<std::string> EncodeLabelChange(const LabelChange& change);

// What of a scan's labels is wanted.
struct LabelView {
  bool models = true;                   // false: only what people gave or uploaded
  const LabelChange* change = nullptr;  // as if this had been stored already
};

// All labels of one origin, as stored; zeros where there is none. DATA_LOSS.
absl::StatusOr<std::vector<std::uint16_t>> ReadLabels(StorageReader& reader,
                                                      const ScanRecord& scan,
                                                      LabelOrigin origin);

// How many labels of one origin are stored. DATA_LOSS.
absl::StatusOr<std::uint64_t> CountLabels(StorageReader& reader,
                                          const ScanRecord& scan,
                                          LabelOrigin origin);

// Goes along with the pieces of a scan's points. One thread at a time.
class ScanLabels {
 public:
  // `view.change`, if any, must outlive it.
  ScanLabels(const ScanRecord& scan, const LabelView& view);

  // What is stored of its labels now is what the pieces get, whatever is stored later. They stay
  // encoded. DATA_LOSS.
  absl::Status Hold(StorageReader& reader);

  // The next piece in order: its label column becomes the one that counts; empty if the scan has no
  // label at all. DATA_LOSS naming the labels that are damaged.
  absl::Status Apply(StorageReader& reader, PointCloud& piece);
  // For each of the next `count` points how many scans looked through its place where that made it
  // fade, else 0; empty if no point of the scan has faded. DATA_LOSS.
  absl::StatusOr<std::vector<std::uint16_t>> Faded(StorageReader& reader, std::size_t count);

 private:
  // Labels of one origin, read piece by piece.
  struct Column {
    bool wanted = false;
    LabelOrigin origin = LabelOrigin::kPerson;
    const LabelChange* change = nullptr;                            // instead of what is stored
    std::optional<std::vector<std::string>> stored = std::nullopt;  // instead of what is stored now
    std::uint32_t next_piece = 0;
    std::vector<std::uint16_t> held;
    std::size_t used = 0;  // of `held`
  };

  // Empty beyond what is stored.
  absl::StatusOr<std::vector<std::uint16_t>> NextPiece(StorageReader& reader, Column& column) const;
  // The next label of the column; 0 beyond what is stored.
  absl::StatusOr<std::uint16_t> Next(StorageReader& reader, Column& column) const;

  const ScanNumber scan_;
  const bool uploaded_;
  Column person_;
  Column model_;
  Column faded_;
};

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_SCANS_SCAN_LABELS_H_
