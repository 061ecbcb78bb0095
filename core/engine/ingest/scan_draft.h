// The points of a scan on their way in, in memory: checked as they come, encoded piece by piece,
// and made a scan of the store once they are whole.
#ifndef STRATA_CORE_ENGINE_INGEST_SCAN_DRAFT_H_
#define STRATA_CORE_ENGINE_INGEST_SCAN_DRAFT_H_

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "core/cloud/point_cloud.h"
#include "core/storage/records.h"
#include "core/storage/storage.h"
#include "core/world/scan.h"
#include "core/world/scan_hash.h"

namespace strata {

// So many bytes of encoded pieces may wait for the disk.
inline constexpr std::size_t kStageBytes = std::size_t{1} << 20;

// One thread at a time.
class ScanDraft {
 public:
  // OK if the map takes one more scan.
  using CheckRoom = absl::FunctionRef<absl::Status()>;

  // `header` must be valid; `upload`: a number that no other has (MapCore::NextUpload()).
  ScanDraft(const ScanHeader& header, std::uint64_t upload);

  // Takes up what is on disk of the same header. An error: damaged, or not of this header; the
  // draft can not be used.
  absl::Status Load(StorageReader& reader, const UnfinishedUpload& parked);
  // Whether the points can be of the scan; INVALID_ARGUMENT.
  absl::Status Check(const PointCloud& chunk) const;
  // Adds points that Check() has found good.
  absl::Status Add(const PointCloud& chunk);
  // Encodes what has come last, however little.
  absl::Status Seal();
  // After Seal(): INVALID_ARGUMENT if the points are not all, or not those announced; then the
  // scan has its hash.
  absl::Status CheckWhole();

  // Puts what waits as chunks of the upload; Staged(), once that is committed.
  absl::Status PutPieces(StorageWriter& writer) const;
  void Staged();
  // After CheckWhole(), within a commit that nobody else writes beside: puts the rest and the scan,
  // or finds that it is there. ALREADY_EXISTS with other content; the errors of `check_room`.
  absl::StatusOr<ScanAck> Commit(StorageWriter& writer, CheckRoom check_room);

  bool announced() const { return !record_.header.content_hash.empty(); }
  std::uint64_t upload() const { return record_.upload; }
  std::uint64_t points() const { return points_; }
  std::uint64_t point_bytes() const { return record_.point_bytes; }
  std::uint32_t staged() const { return staged_; }  // pieces on disk
  std::size_t waiting_bytes() const { return waiting_bytes_; }

 private:
  void Append(const PointCloud& chunk, std::size_t begin, std::size_t end);

  ScanRecord record_;
  ScanHasher hasher_;
  PointCloud piece_;                  // less than kMaxEncodedPoints
  std::vector<std::string> waiting_;  // encoded, not on disk yet
  std::size_t waiting_bytes_ = 0;
  std::uint32_t staged_ = 0;
  std::uint64_t points_ = 0;
};

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_INGEST_SCAN_DRAFT_H_
