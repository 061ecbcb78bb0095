// Looks at what may have changed, again and again.
#ifndef STRATA_SERVER_RPC_TICKER_H_
#define STRATA_SERVER_RPC_TICKER_H_

#include <functional>
#include <string>
#include <thread>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/strings/string_view.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/time.h"

#include "server/rpc/executor.h"

namespace strata::server {

// One thread for all that wait, whatever becomes of the machine's clock: grpc::Alarm stands still
// for as long as that is set back. Thread-safe.
class Ticker {
 public:
  // Ticks every `interval` while anything waits; `executor` must outlive the ticker.
  Ticker(absl::Duration interval, Executor& executor);
  // REQUIRES: nothing waits.
  ~Ticker();
  Ticker(const Ticker&) = delete;
  Ticker& operator=(const Ticker&) = delete;

  // Runs `task`, of `client`, on the executor at the next tick.
  void AtNextTick(absl::string_view client, std::function<void()> task);

 private:
  struct Task {
    std::string client;
    std::function<void()> run;
  };
  void Loop();
  void Submit(const Task& task);

  const absl::Duration interval_;
  Executor& executor_;
  absl::Mutex mutex_;
  bool closing_ ABSL_GUARDED_BY(mutex_) = false;
  std::vector<Task> waiting_ ABSL_GUARDED_BY(mutex_);
  std::thread thread_;
};

}  // namespace strata::server

#endif  // STRATA_SERVER_RPC_TICKER_H_
