// One stream of a scan into a map that another engine has: acknowledged by the store they share,
// integrated by the other.
#ifndef STRATA_CORE_ENGINE_INGEST_UPLOAD_BESIDE_H_
#define STRATA_CORE_ENGINE_INGEST_UPLOAD_BESIDE_H_

#include <cstdint>
#include <memory>
#include <optional>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "core/api/call.h"
#include "core/api/scans.h"
#include "core/engine/ingest/scan_draft.h"
#include "core/storage/storage.h"
#include "core/world/scan.h"

namespace strata {

// Whatever ends it before its acknowledgement, the scan is sent again from its first point on.
class UploadBeside final : public api::ScanUpload {
 public:
  // `store` as of MapStores::OpenToAdd(); `header` must be valid. ALREADY_EXISTS for a scan with
  // another content than announced.
  static absl::StatusOr<std::unique_ptr<UploadBeside>> Begin(std::unique_ptr<MapStorage> store,
                                                             const api::Call& call,
                                                             const ScanHeader& header);
  ~UploadBeside() override;

  std::uint64_t points_held() const override;
  absl::Status Write(const PointCloud& chunk) override;
  absl::StatusOr<ScanAck> Finish() override;

 private:
  UploadBeside(std::unique_ptr<MapStorage> store, const api::Call& call, const ScanHeader& header);
  // Sets present_ if the announced scan is there.
  absl::Status LookForPresent();
  absl::Status Take(const PointCloud& chunk);
  absl::StatusOr<ScanAck> Commit();

  const std::unique_ptr<MapStorage> store_;
  const api::Call call_;
  const ScanHeader header_;
  ScanDraft draft_;
  std::optional<ScanAck> present_;
  absl::Status failed_;  // first error; the stream is dead then
  bool leave_ = false;   // what was staged may belong to a scan
};

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_INGEST_UPLOAD_BESIDE_H_
