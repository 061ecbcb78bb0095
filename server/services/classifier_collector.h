// Classifiers.Import: the bytes of one classifier.
#ifndef STRATA_SERVER_SERVICES_CLASSIFIER_COLLECTOR_H_
#define STRATA_SERVER_SERVICES_CLASSIFIER_COLLECTOR_H_

#include <string>

#include "absl/status/status.h"

#include "core/api/database.h"
#include "server/rpc/client_limits.h"
#include "strata/v1/classifiers.pb.h"

namespace strata::server {

// As CollectReactor wants it. Keeps at most kMaxClassifierBytes.
class ClassifierCollector {
 public:
  using In = v1::ImportClassifierRequest;
  using Out = v1::ImportClassifierResponse;

  absl::Status Take(api::Database& db, const api::Call& call, const In& in, Booking& memory);
  absl::Status Finish(api::Database& db, const api::Call& call, Out& out);

 private:
  bool begun_ = false;
  std::string map_;
  std::string name_;
  std::string bytes_;
};

}  // namespace strata::server

#endif  // STRATA_SERVER_SERVICES_CLASSIFIER_COLLECTOR_H_
