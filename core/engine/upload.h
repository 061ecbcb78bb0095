// Takes in one scan: checks its points as they come, puts them to disk piece by piece, and makes
// them a scan in one durable commit.
#ifndef STRATA_CORE_ENGINE_UPLOAD_H_
#define STRATA_CORE_ENGINE_UPLOAD_H_

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include <Eigen/Geometry>

#include "core/api/call.h"
#include "core/api/scans.h"
#include "core/cloud/point_cloud.h"
#include "core/engine/map.h"
#include "core/engine/scan_hash.h"
#include "core/world/scan.h"

namespace strata {

class EngineUpload final : public api::ScanUpload {
 public:
  // `header` must be valid.
  EngineUpload(std::shared_ptr<Map> map, const api::Call& call, const ScanHeader& header);
  ~EngineUpload() override;

  absl::Status Write(const PointCloud& chunk) override;
  absl::StatusOr<ScanAck> Finish() override;

 private:
  absl::Status WriteChecked(const PointCloud& chunk);
  absl::Status CheckChunk(const PointCloud& chunk) const;
  // Adds point `i` of `chunk` to the piece under way.
  void Append(const PointCloud& chunk, std::size_t i);
  // Encodes the piece under way; sends pieces to disk once there are many.
  absl::Status SealPiece();
  absl::Status StagePieces();
  absl::StatusOr<ScanAck> Commit(StorageWriter& writer);

  std::shared_ptr<Map> map_;
  const api::Call call_;
  ScanRecord record_;
  ScanHasher hasher_;
  PointCloud piece_;                 // less than kMaxEncodedPoints
  std::vector<std::string> pieces_;  // encoded, not on disk yet
  std::size_t pieces_bytes_ = 0;
  std::uint32_t staged_ = 0;  // pieces on disk
  std::uint64_t points_ = 0;
  absl::Status failed_;  // first error; the upload is dead then
  bool finished_ = false;
};

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_UPLOAD_H_
