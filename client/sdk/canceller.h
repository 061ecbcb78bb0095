// Carries a Stop into gRPC calls that block.
#ifndef STRATA_CLIENT_SDK_CANCELLER_H_
#define STRATA_CLIENT_SDK_CANCELLER_H_

#include <list>
#include <thread>

#include "absl/base/thread_annotations.h"
#include "absl/synchronization/mutex.h"
#include <grpcpp/client_context.h>

#include "core/common/stop.h"

namespace strata::sdk {

// A Stop is a flag that is asked, a blocked call cannot ask: one thread asks for all calls under
// way and cancels those whose Stop was requested. Thread-safe.
class Canceller {
 public:
  Canceller();
  // REQUIRES: no Watch is left.
  ~Canceller();
  Canceller(const Canceller&) = delete;
  Canceller& operator=(const Canceller&) = delete;

  // While it lives, `context` is cancelled once `stop` is requested.
  class Watch {
   public:
    Watch(Canceller& canceller, const Stop& stop, grpc::ClientContext& context);
    ~Watch();
    Watch(const Watch&) = delete;
    Watch& operator=(const Watch&) = delete;

   private:
    friend class Canceller;
    Canceller& canceller_;
    const Stop stop_;
    grpc::ClientContext& context_;
    std::list<Watch*>::iterator place_;
  };

 private:
  void Work();

  absl::Mutex mutex_;
  std::list<Watch*> watches_ ABSL_GUARDED_BY(mutex_);
  bool closing_ ABSL_GUARDED_BY(mutex_) = false;
  std::thread thread_;
};

}  // namespace strata::sdk

#endif  // STRATA_CLIENT_SDK_CANCELLER_H_
