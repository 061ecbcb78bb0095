// Streams of requests that bring nothing.
#ifndef STRATA_SERVER_RPC_SILENCE_H_
#define STRATA_SERVER_RPC_SILENCE_H_

#include <functional>
#include <set>
#include <thread>
#include <utility>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/time.h"

#include "core/common/stop.h"
#include "server/rpc/executor.h"

namespace strata::server {

// Watches over all streams with one thread. Thread-safe.
class SilenceWatch {
 public:
  // Streams that wait longer than `limit` for their client have ended, and those whose call was
  // stopped; `executor`, which must outlive the watch, tells them.
  SilenceWatch(absl::Duration limit, Executor& executor);
  ~SilenceWatch();

  absl::Duration limit() const { return limit_; }

 private:
  friend class ExpectedMessage;
  void Loop();
  void EndSilent() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  const absl::Duration limit_;
  Executor& executor_;
  absl::Mutex mutex_;
  bool closing_ ABSL_GUARDED_BY(mutex_) = false;
  std::set<class ExpectedMessage*> waiting_ ABSL_GUARDED_BY(mutex_);
  std::thread thread_;
};

// The next message of one stream. Expect() before the read begins, Arrived() when it has ended;
// when the client was silent for too long between the two, or `stop` was requested, Arrived() is
// false, and instead `on_silence` is called once, on the executor, with the error that the stream
// ends with: of the two exactly one goes on with the stream.
class ExpectedMessage {
 public:
  ExpectedMessage(SilenceWatch& watch,
                  const Stop& stop,
                  std::function<void(const absl::Status&)> on_silence)
      : watch_(watch), stop_(stop), on_silence_(std::move(on_silence)) {}
  ExpectedMessage(const ExpectedMessage&) = delete;
  ExpectedMessage& operator=(const ExpectedMessage&) = delete;
  ~ExpectedMessage();

  void Expect();
  bool Arrived();

 private:
  friend class SilenceWatch;

  SilenceWatch& watch_;
  const Stop stop_;
  const std::function<void(const absl::Status&)> on_silence_;
  absl::Time since_;  // guarded by the watch's mutex
};

}  // namespace strata::server

#endif  // STRATA_SERVER_RPC_SILENCE_H_
