// One scan on its way in.
#ifndef STRATA_SERVER_SERVICES_SCAN_RECEIVER_H_
#define STRATA_SERVER_SERVICES_SCAN_RECEIVER_H_

#include <cstdint>
#include <memory>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "core/api/call.h"
#include "core/api/database.h"
#include "core/world/scan.h"
#include "strata/v1/scans.pb.h"

namespace strata::server {

// Checks what arrives and hands it on; destroying it before Finish() abandons the scan. Calls block
// and come one at a time, from any thread.
class ScanReceiver {
 public:
  // INVALID_ARGUMENT for a bad header; what api::Scans::Upload answers.
  static absl::StatusOr<ScanReceiver> Begin(api::Database& db,
                                            const api::Call& call,
                                            const v1::ScanStart& start);

  // INVALID_ARGUMENT for points that the header did not announce or that are not finite.
  absl::Status Add(const v1::PointChunk& chunk);
  // INVALID_ARGUMENT while points are missing; otherwise returns once the scan is durable.
  absl::StatusOr<ScanAck> Finish();

  const ScanId& id() const { return header_.id; }
  // Every announced point has arrived.
  bool complete() const { return received_ == header_.point_count; }

 private:
  ScanReceiver(ScanHeader header, std::unique_ptr<api::ScanUpload> upload)
      : header_(std::move(header)), upload_(std::move(upload)) {}

  ScanHeader header_;
  std::unique_ptr<api::ScanUpload> upload_;
  std::uint64_t received_ = 0;  // points
};

}  // namespace strata::server

#endif  // STRATA_SERVER_SERVICES_SCAN_RECEIVER_H_
