// Health of the server and of its services, as grpc.health.v1 has it, for anybody.
#ifndef STRATA_SERVER_HEALTH_H_
#define STRATA_SERVER_HEALTH_H_

#include <cstddef>
#include <map>
#include <set>
#include <string>

#include "absl/base/thread_annotations.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/time.h"
#include <grpcpp/impl/service_type.h>

#include "server/rpc/client_limits.h"
#include "server/rpc/executor.h"
#include "server/rpc/runtime.h"

namespace strata::server {

// In place of gRPC's own, which takes up whatever anybody sends before it looks at it: here few
// requests are read at a time, the hosts that send them take turns, and what is not there soon is
// not waited for. Must outlive the gRPC server. Thread-safe.
class Health final : public grpc::Service {
 public:
  static constexpr char kCheck[] = "/grpc.health.v1.Health/Check";
  static constexpr char kWatch[] = "/grpc.health.v1.Health/Watch";

  // Its calls leave the arrivals of `runtime` under these names.
  explicit Health(Runtime& runtime);

  // The server as a whole is "", which is serving from the beginning. Watches are told.
  void Set(const std::string& service, bool serving);
  // Nothing is serving from now on.
  void Shutdown();

 private:
  friend class HealthReactor;

  static constexpr int kReads = 4;  // at a time; each up to the largest message
  // Requests of one host until they are read; meanwhile a window's worth of each is kept.
  static constexpr int kHostRequests = 8;
  static constexpr int kHostWatches = 64;
  static constexpr int kRequests = 512;
  static constexpr absl::Duration kPatience = absl::Seconds(1);

  // As grpc.health.v1 numbers it.
  int StateOf(const std::string& service) const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void TellAll() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  Runtime& runtime_;
  ClientLimits hosts_;
  CallGate requests_;
  absl::Mutex mutex_;
  std::map<std::string, bool> serving_ ABSL_GUARDED_BY(mutex_);
  bool shut_down_ ABSL_GUARDED_BY(mutex_) = false;
  std::set<class HealthReactor*> watches_ ABSL_GUARDED_BY(mutex_);
  Executor readers_;
};

}  // namespace strata::server

#endif  // STRATA_SERVER_HEALTH_H_
