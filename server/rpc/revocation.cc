#include "server/rpc/revocation.h"

#include <algorithm>

#include "absl/status/status.h"
#include "absl/time/clock.h"

#include "core/common/guarded.h"
#include "core/common/steady_time.h"
#include "core/common/this_thread.h"

namespace strata::server {
namespace {

// How soon the watch itself ends.
constexpr absl::Duration kSlice = absl::Milliseconds(50);

}  // namespace

RevocationWatch::RevocationWatch(absl::Duration interval)
    : interval_(interval), thread_([this] { Loop(); }) {}

RevocationWatch::~RevocationWatch() {
  {
    absl::MutexLock lock(&mutex_);
    closing_ = true;
  }
  thread_.join();
}

void RevocationWatch::Add(Revocable& call) {
  absl::MutexLock lock(&mutex_);
  calls_.insert(&call);
}

void RevocationWatch::Remove(Revocable& call) {
  absl::MutexLock lock(&mutex_);
  calls_.erase(&call);
}

void RevocationWatch::Loop() {
  NameThisThread("revocation");
  absl::Time next = SteadyNow() + interval_;
  while (true) {
    absl::SleepFor(std::min(interval_, kSlice));
    absl::MutexLock lock(&mutex_);
    if (closing_) return;
    if (SteadyNow() < next) continue;
    // Where there is no memory for it, or to read who may still do what, at the next look.
    const auto end_revoked = [this]() ABSL_NO_THREAD_SAFETY_ANALYSIS {
      for (Revocable* call : calls_) call->EndIfRevoked();
      return absl::OkStatus();
    };
    if (!Guarded(end_revoked).ok()) continue;
    next = SteadyNow() + interval_;
  }
}

}  // namespace strata::server
