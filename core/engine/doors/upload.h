// One stream of a scan: api::ScanUpload.
#ifndef STRATA_CORE_ENGINE_DOORS_UPLOAD_H_
#define STRATA_CORE_ENGINE_DOORS_UPLOAD_H_

#include <cstdint>
#include <memory>
#include <optional>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "core/api/call.h"
#include "core/api/scans.h"
#include "core/engine/doors/map.h"
#include "core/engine/ingest/scan_intake.h"
#include "core/world/scan.h"

namespace strata {

class EngineUpload final : public api::ScanUpload {
 public:
  // `header` must be valid. RESOURCE_EXHAUSTED while too many scans wait; ALREADY_EXISTS for a scan
  // with another content than announced.
  static absl::StatusOr<std::unique_ptr<EngineUpload>> Begin(std::shared_ptr<Map> map,
                                                             const api::Call& call,
                                                             const ScanHeader& header);
  ~EngineUpload() override;

  std::uint64_t points_held() const override { return held_; }
  absl::Status Write(const PointCloud& chunk) override;
  absl::StatusOr<ScanAck> Finish() override;

 private:
  EngineUpload(std::shared_ptr<Map> map, const api::Call& call, const ScanHeader& header)
      : map_(std::move(map)), call_(call), id_(header.id), intake_(map_->uploads().Find(header)) {}
  absl::Status Open(const ScanHeader& header);
  // Sets present_ if the announced scan is there.
  absl::Status LookForPresent(const ScanHeader& header);

  const std::shared_ptr<Map> map_;
  const api::Call call_;
  const ScanId id_;
  std::shared_ptr<ScanIntake> intake_;
  std::uint64_t ticket_ = 0;
  std::uint64_t held_ = 0;
  std::optional<ScanAck> present_;
  absl::Status failed_;  // first error; the stream is dead then
};

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_DOORS_UPLOAD_H_
