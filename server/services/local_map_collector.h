// Scans.UploadLocalMap: the bytes of one local map.
#ifndef STRATA_SERVER_SERVICES_LOCAL_MAP_COLLECTOR_H_
#define STRATA_SERVER_SERVICES_LOCAL_MAP_COLLECTOR_H_

#include <string>

#include "absl/status/status.h"

#include "core/api/database.h"
#include "core/mls/mls_parameters.h"
#include "core/world/scan.h"
#include "server/rpc/client_limits.h"
#include "strata/v1/scans.pb.h"

namespace strata::server {

// As CollectReactor wants it. Keeps at most kMaxLocalMapBytes.
class LocalMapCollector {
 public:
  using In = v1::UploadLocalMapRequest;
  using Out = v1::UploadLocalMapResponse;

  absl::Status Take(api::Database& db, const api::Call& call, const In& in, Booking& memory);
  absl::Status Finish(api::Database& db, const api::Call& call, Out& out);

 private:
  bool begun_ = false;
  std::string map_;
  ScanHeader header_;
  MlsParameters parameters_;
  std::string bytes_;
};

}  // namespace strata::server

#endif  // STRATA_SERVER_SERVICES_LOCAL_MAP_COLLECTOR_H_
