// PoseGraph.Localize: one scan, a client stream; where it was taken.
#ifndef STRATA_SERVER_SERVICES_LOCALIZE_REACTOR_H_
#define STRATA_SERVER_SERVICES_LOCALIZE_REACTOR_H_

#include <string>

#include "absl/status/status.h"

#include "core/world/localization.h"
#include "core/world/scan.h"
#include "server/rpc/request.h"
#include "server/rpc/runtime.h"
#include "server/rpc/sealed.h"
#include "strata/v1/posegraph.grpc.pb.h"

namespace strata::server {

// Reads a message only when the one before is dealt with; memory is the scan, which is bounded. The
// search itself holds a query thread. Lives from the call's arrival to its end; owns itself.
class LocalizeReactor final : public grpc::ServerReadReactor<Sealed<v1::LocalizeRequest>> {
 public:
  using In = v1::LocalizeRequest;
  using Out = v1::LocalizeResponse;

  LocalizeReactor(Runtime& runtime, grpc::CallbackServerContext& context, Out& out);

 private:
  void Read();
  void OnReadDone(bool ok) override;
  void OnCancel() override { request_.Cancel(); }
  void OnDone() override { delete this; }

  // On an upload thread, one at a time.
  void Take();
  absl::Status TakeMessage();
  absl::Status Begin(const v1::LocalizeStart& start);
  absl::Status Add(const v1::PointChunk& chunk);
  // On a query thread, at the end.
  void Search();
  absl::Status CheckComplete() const;

  Runtime& runtime_;
  Request request_;
  Booking in_memory_;
  Booking points_memory_;
  Out& out_;
  Sealed<In> message_;
  bool begun_ = false;
  std::string map_;
  ScanHeader shape_;  // grid and number of the points to come
  LocalizeQuery query_;
  ExpectedMessage expected_;
};

}  // namespace strata::server

#endif  // STRATA_SERVER_SERVICES_LOCALIZE_REACTOR_H_
