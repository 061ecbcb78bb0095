// What the services of one server share.
#ifndef STRATA_SERVER_RPC_RUNTIME_H_
#define STRATA_SERVER_RPC_RUNTIME_H_

#include <atomic>
#include <cstddef>
#include <memory>
#include <utility>

#include "absl/base/thread_annotations.h"
#include "absl/strings/match.h"
#include "absl/strings/string_view.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"

#include "core/api/database.h"
#include "core/common/steady_time.h"
#include "server/access/access.h"
#include "server/metrics/metrics.h"
#include "server/rpc/arrivals.h"
#include "server/rpc/client_limits.h"
#include "server/rpc/executor.h"
#include "server/rpc/revocation.h"
#include "server/rpc/silence.h"
#include "server/rpc/strangers.h"
#include "server/rpc/ticker.h"

namespace strata::server {

struct RuntimeOptions {
  // At a time; those that wait for a map's worker, a commit or a reader are not counted (Executor).
  int query_threads = 8;                              // unary calls
  int stream_threads = 8;                             // listings and downloads
  int upload_threads = 16;                            // scans coming in
  absl::Duration max_query_time = absl::Seconds(30);  // of a unary call that only reads
  int max_calls = 1024;                               // calls under way; more are told SERVER_BUSY
  int max_watches = 4096;  // watches under way, which are no calls; more are told SERVER_BUSY
  // A stream's reader that falls so far behind ReaderPace::kLeastBytesPerSecond loses the stream.
  absl::Duration slow_reader_timeout = absl::Seconds(30);
  // And a sender that brings nothing for so long.
  absl::Duration slow_sender_timeout = absl::Seconds(60);
  ClientLimitOptions client;
  StrangerOptions strangers;
  // Memory that the calls of all clients hold, as ClientLimitOptions::max_bytes.
  std::size_t max_call_bytes = std::size_t{160} << 20;
};

// Counts what is under way, and says whether it is more than there may be. Thread-safe.
class CallGate {
 public:
  // `what` as in "calls".
  CallGate(int most, absl::string_view what) : most_(most), what_(what) {}

  // Whether there was room for the one that enters; it ends and leaves in either case.
  bool Enter() {
    absl::MutexLock lock(&mutex_);
    ++here_;
    return ++under_way_ <= most_ && here_ <= kHereShare * most_;
  }
  // Its answer is on its way; gRPC tells only later that the client has it, much later where the
  // machine is busy.
  void End() {
    absl::MutexLock lock(&mutex_);
    --under_way_;
  }
  int most() const { return most_; }
  absl::string_view what() const { return what_; }
  int under_way() const {
    absl::MutexLock lock(&mutex_);
    return under_way_;
  }
  void Leave() {
    absl::MutexLock lock(&mutex_);
    --here_;
  }
  // Returns when all have left, or after `timeout`.
  void AwaitEmpty(absl::Duration timeout) const {
    const absl::Time until = SteadyNow() + timeout;
    const auto empty = [this] {
      absl::MutexLock lock(&mutex_);
      return here_ == 0;
    };
    while (!empty() && SteadyNow() < until) absl::SleepFor(absl::Milliseconds(5));
  }

 private:
  // Answers that nobody takes are memory, too.
  static constexpr int kHereShare = 4;

  const int most_;
  const absl::string_view what_;
  mutable absl::Mutex mutex_;
  int under_way_ ABSL_GUARDED_BY(mutex_) = 0;
  int here_ ABSL_GUARDED_BY(mutex_) = 0;
};

// Thread-safe.
struct Runtime {
  Runtime(api::Database& database,
          std::unique_ptr<GrantTable> grants,
          const RuntimeOptions& runtime_options)
      : db(database),
        options(runtime_options),
        access(std::move(grants)),
        clients(runtime_options.client, runtime_options.max_call_bytes),
        strangers(runtime_options.strangers),
        arriving_calls(runtime_options.client.max_calls + kGoing),
        arriving_watches(runtime_options.client.max_watches + kGoing),
        queries(runtime_options.query_threads, "query"),
        streams(runtime_options.stream_threads, "stream"),
        uploads(runtime_options.upload_threads, "upload"),
        silence(runtime_options.slow_sender_timeout, uploads),
        ticker(absl::Milliseconds(100), queries),
        calls(runtime_options.max_calls, "calls"),
        watches(runtime_options.max_watches, "watches") {}

  // Where calls of a method are counted that have come in, "Maps.Watch" or "/strata.v1.Maps/Watch".
  Arrivals& ArrivalsOf(absl::string_view method) {
    const absl::string_view name = method.substr(method.find_last_of("./") + 1);
    return absl::StartsWith(name, "Watch") ? arriving_watches : arriving_calls;
  }

  // Calls of one client that are refused or have ended and are not freed yet.
  static constexpr int kGoing = 256;

  api::Database& db;
  const RuntimeOptions options;
  Access access;
  ClientLimits clients;
  Strangers strangers;
  Arrivals arriving_calls;
  Arrivals arriving_watches;
  RevocationWatch revocations{absl::Milliseconds(500)};
  CallMetrics metrics;
  Executor queries;
  Executor streams;
  Executor uploads;
  SilenceWatch silence;
  Ticker ticker;  // of watches
  CallGate calls;
  CallGate watches;
  std::atomic<bool> shutting_down = false;  // calls without an end of their own should end
};

}  // namespace strata::server

#endif  // STRATA_SERVER_RPC_RUNTIME_H_
