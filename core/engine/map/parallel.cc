#include "core/engine/map/parallel.h"

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <exception>
#include <thread>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/synchronization/mutex.h"

#include "core/common/guarded.h"

namespace strata {
namespace {

struct FirstError {
  absl::Mutex mutex;
  absl::Status status ABSL_GUARDED_BY(mutex);
  std::size_t index ABSL_GUARDED_BY(mutex) = 0;

  void Keep(const absl::Status& error, std::size_t i) {
    absl::MutexLock lock(&mutex);
    if (!status.ok() && index < i) return;
    status = error;
    index = i;
  }
};

}  // namespace

absl::Status ParallelFor(int threads,
                         std::size_t count,
                         absl::FunctionRef<absl::Status(int thread, std::size_t i)> body) {
  FirstError error;
  std::atomic<std::size_t> next{0};
  std::atomic<bool> failed{false};
  const auto run = [&](int thread) {
    while (!failed.load(std::memory_order_relaxed)) {
      const std::size_t i = next.fetch_add(1);
      if (i >= count) return;
      const absl::Status done = Guarded([&] { return body(thread, i); });
      if (done.ok()) continue;
      error.Keep(done, i);
      failed = true;
    }
  };
  std::vector<std::thread> helpers;
  const int helper_count =
      static_cast<int>(std::min<std::size_t>(static_cast<std::size_t>(std::max(threads, 1)),
                                             std::max<std::size_t>(count, 1)) -
                       1);
  try {
    helpers.reserve(static_cast<std::size_t>(helper_count));
    for (int i = 1; i <= helper_count; ++i) helpers.emplace_back(run, i);
  } catch (const std::exception&) {
    // No memory or no thread for one more: those that are there do the work.
  }
  run(0);
  for (std::thread& helper : helpers) helper.join();
  absl::MutexLock lock(&error.mutex);
  return error.status;
}

}  // namespace strata
