// A pool of threads for calls that block, so that gRPC's own threads never do.
#ifndef STRATA_SERVER_RPC_EXECUTOR_H_
#define STRATA_SERVER_RPC_EXECUTOR_H_

#include <cstddef>
#include <deque>
#include <functional>
#include <thread>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/synchronization/mutex.h"

namespace strata::server {

// Runs tasks in the order submitted, on as many threads as were ever needed at once, up to a bound.
// Thread-safe. The queue is as long as there are calls under way, which Runtime bounds: a call has
// few tasks at a time.
class Executor {
 public:
  // `name` is that of the threads and must outlive them. REQUIRES: most_threads ≥ 1.
  Executor(int most_threads, const char* name);
  // Runs what was submitted, then joins the threads.
  ~Executor();
  Executor(const Executor&) = delete;
  Executor& operator=(const Executor&) = delete;

  // `task` must not throw.
  void Submit(std::function<void()> task);

 private:
  void AddThread() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void Work();
  bool Ready() const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) { return closing_ || !tasks_.empty(); }

  const std::size_t most_threads_;
  const char* const name_;
  absl::Mutex mutex_;
  std::deque<std::function<void()>> tasks_ ABSL_GUARDED_BY(mutex_);
  bool closing_ ABSL_GUARDED_BY(mutex_) = false;
  std::size_t idle_ ABSL_GUARDED_BY(mutex_) = 0;  // threads that wait for a task
  std::vector<std::thread> threads_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace strata::server

#endif  // STRATA_SERVER_RPC_EXECUTOR_H_
