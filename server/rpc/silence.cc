#include "server/rpc/silence.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"

#include "core/common/steady_time.h"
#include "core/common/this_thread.h"
#include "proto/translate/status.h"

namespace strata::server {
namespace {

// How soon the watch itself ends.
constexpr absl::Duration kSlice = absl::Milliseconds(50);

}  // namespace

SilenceWatch::SilenceWatch(absl::Duration limit, Executor& executor)
    : limit_(limit), executor_(executor), thread_([this] { Loop(); }) {}

SilenceWatch::~SilenceWatch() {
  {
    absl::MutexLock lock(&mutex_);
    closing_ = true;
  }
  thread_.join();
}

void SilenceWatch::Loop() {
  NameThisThread("silence");
  // A stream ends at most a quarter late.
  const absl::Duration interval = std::clamp(limit_ / 4, absl::Milliseconds(10), absl::Seconds(5));
  absl::Time next = SteadyNow() + interval;
  while (true) {
    // AwaitWithTimeout would wait as long as a clock is set back.
    absl::SleepFor(std::min(interval, kSlice));
    absl::MutexLock lock(&mutex_);
    if (closing_) return;
    if (SteadyNow() < next) continue;
    EndSilent();
    next = SteadyNow() + interval;
  }
}

void SilenceWatch::EndSilent() {
  const absl::Time now = SteadyNow();
  for (auto it = waiting_.begin(); it != waiting_.end();) {
    ExpectedMessage* stream = *it;
    if (now - stream->since_ < limit_) {
      ++it;
      continue;
    }
    it = waiting_.erase(it);
    const absl::Status status = translate::WithReason(
        absl::DeadlineExceededError(absl::StrCat("the client sent nothing for ",
                                                 absl::FormatDuration(limit_),
                                                 "; what was not acknowledged is abandoned")),
        translate::kSlowSenderReason);
    // The stream lives until this task ends it, since Arrived() will be false. It is the server's,
    // whose turn comes at once.
    executor_.Submit("", [end = stream->on_silence_, status] { end(status); });
  }
}

ExpectedMessage::~ExpectedMessage() {
  absl::MutexLock lock(&watch_.mutex_);
  watch_.waiting_.erase(this);
}

void ExpectedMessage::Expect() {
  absl::MutexLock lock(&watch_.mutex_);
  since_ = SteadyNow();
  watch_.waiting_.insert(this);
}

bool ExpectedMessage::Arrived() {
  absl::MutexLock lock(&watch_.mutex_);
  return watch_.waiting_.erase(this) == 1;
}

}  // namespace strata::server
