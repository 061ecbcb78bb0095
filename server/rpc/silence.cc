#include "server/rpc/silence.h"

#include <algorithm>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"

#include "core/common/guarded.h"
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
  // A stream ends at most a quarter late, and soon after its call was stopped.
  const absl::Duration interval =
      std::clamp(limit_ / 4, absl::Milliseconds(10), absl::Milliseconds(250));
  absl::Time next = SteadyNow() + interval;
  while (true) {
    // AwaitWithTimeout would wait as long as a clock is set back.
    absl::SleepFor(std::min(interval, kSlice));
    absl::MutexLock lock(&mutex_);
    if (closing_) return;
    if (SteadyNow() < next) continue;
    // Those for which there is no memory now end a little later.
    const auto end_silent = [this]() ABSL_NO_THREAD_SAFETY_ANALYSIS {
      EndSilent();
      return absl::OkStatus();
    };
    if (!Guarded(end_silent).ok()) continue;
    next = SteadyNow() + interval;
  }
}

void SilenceWatch::EndSilent() {
  const absl::Time now = SteadyNow();
  for (auto it = waiting_.begin(); it != waiting_.end();) {
    ExpectedMessage* stream = *it;
    const bool stopped = stream->stop_.requested();
    if (!stopped && now - stream->since_ < limit_) {
      ++it;
      continue;
    }
    const absl::Status status =
        stopped ? stream->stop_.status()
                : translate::WithReason(absl::DeadlineExceededError(absl::StrCat(
                                            "the client sent nothing for ",
                                            absl::FormatDuration(limit_),
                                            "; what was not acknowledged is abandoned")),
                                        translate::kSlowSenderReason);
    // The stream lives until this task ends it, since Arrived() will be false. It is the server's,
    // whose turn comes at once.
    executor_.Submit("", [end = stream->on_silence_, status] { end(status); });
    it = waiting_.erase(it);
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
