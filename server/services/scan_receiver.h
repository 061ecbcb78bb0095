// One scan on its way in.
#ifndef STRATA_SERVER_SERVICES_SCAN_RECEIVER_H_
#define STRATA_SERVER_SERVICES_SCAN_RECEIVER_H_

#include <algorithm>
#include <cstdint>
#include <memory>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "core/api/call.h"
#include "core/api/database.h"
#include "core/world/scan.h"
#include "server/rpc/client_limits.h"
#include "strata/v1/scans.pb.h"

namespace strata::server {

// Books in `memory` what a message with points of the scan takes: a scan that was begun is not
// refused in the middle because others have begun since.
absl::Status HoldChunk(const v1::ScanHeader& header, Booking& memory);

// Checks what arrives and hands it on; destroying it before Finish() abandons the scan. Calls block
// and come one at a time, from any thread.
class ScanReceiver {
 public:
  // INVALID_ARGUMENT for a bad header; what api::Scans::Upload answers; RESOURCE_EXHAUSTED where
  // `memory` cannot book what a scan takes on its way in.
  static absl::StatusOr<ScanReceiver> Begin(api::Database& db,
                                            const api::Call& call,
                                            const v1::ScanStart& start,
                                            Booking memory);

  // INVALID_ARGUMENT for points that the header did not announce or that are not finite.
  // Those that were there already are passed over.
  absl::Status Add(const v1::PointChunk& chunk);
  // INVALID_ARGUMENT while points are missing; otherwise returns once the scan is durable.
  absl::StatusOr<ScanAck> Finish();

  const ScanId& id() const { return header_.id; }
  // Points that were there when it began.
  std::uint64_t points_held() const { return held_; }
  // Every announced point is there.
  bool complete() const { return std::max(held_, received_) == header_.point_count; }

 private:
  ScanReceiver(ScanHeader header,
               Booking memory,
               std::unique_ptr<api::ScanUpload> upload,
               bool resume)
      : header_(std::move(header)),
        memory_(std::move(memory)),
        upload_(std::move(upload)),
        held_(upload_->points_held()),
        received_(resume ? held_ : 0) {}

  ScanHeader header_;
  Booking memory_;
  std::unique_ptr<api::ScanUpload> upload_;
  std::uint64_t held_;
  std::uint64_t received_;  // points, those included that the client knew to be there
};

}  // namespace strata::server

#endif  // STRATA_SERVER_SERVICES_SCAN_RECEIVER_H_
