// A pool of threads for calls that block, so that gRPC's own threads never do.
#ifndef STRATA_SERVER_RPC_EXECUTOR_H_
#define STRATA_SERVER_RPC_EXECUTOR_H_

#include <deque>
#include <functional>
#include <thread>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/synchronization/mutex.h"

namespace strata::server {

// Runs tasks in the order submitted on a fixed number of threads. Thread-safe. The queue is as long
// as there are calls under way, which Runtime bounds: a call has few tasks at a time.
class Executor {
 public:
  // `name` is that of the threads and must outlive them. REQUIRES: threads ≥ 1.
  Executor(int threads, const char* name);
  // Runs what was submitted, then joins the threads.
  ~Executor();
  Executor(const Executor&) = delete;
  Executor& operator=(const Executor&) = delete;

  // `task` must not throw.
  void Submit(std::function<void()> task);

 private:
  void Work();
  bool Ready() const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) { return closing_ || !tasks_.empty(); }

  absl::Mutex mutex_;
  std::deque<std::function<void()>> tasks_ ABSL_GUARDED_BY(mutex_);
  bool closing_ ABSL_GUARDED_BY(mutex_) = false;
  std::vector<std::thread> threads_;
};

}  // namespace strata::server

#endif  // STRATA_SERVER_RPC_EXECUTOR_H_
