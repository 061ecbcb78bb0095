// Scans.SetLabels: the labels of one scan.
#ifndef STRATA_SERVER_SERVICES_LABEL_COLLECTOR_H_
#define STRATA_SERVER_SERVICES_LABEL_COLLECTOR_H_

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/status.h"

#include "core/api/database.h"
#include "server/rpc/client_limits.h"
#include "strata/v1/scans.pb.h"

namespace strata::server {

// As CollectReactor wants it. Keeps no more labels than the scan has points.
class LabelCollector {
 public:
  using In = v1::SetScanLabelsRequest;
  using Out = v1::SetScanLabelsResponse;

  absl::Status Take(api::Database& db, const api::Call& call, const In& in, Booking& memory);
  absl::Status Finish(api::Database& db, const api::Call& call, Out& out);

 private:
  absl::Status Begin(api::Database& db, const api::Call& call, const v1::SetScanLabelsStart& start);
  absl::Status Add(const std::string& bytes, Booking& memory);

  bool begun_ = false;
  std::string map_;
  ScanId id_;
  api::LabelMode mode_ = api::LabelMode::kReplace;
  std::uint64_t points_ = 0;  // of the scan
  std::vector<std::uint16_t> labels_;
};

}  // namespace strata::server

#endif  // STRATA_SERVER_SERVICES_LABEL_COLLECTOR_H_
