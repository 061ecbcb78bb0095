#include <algorithm>

#include "absl/status/status.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"

#include "client/sdk/spool.h"
#include "core/common/steady_time.h"

namespace strata {
namespace {

constexpr absl::Duration kShortest = absl::Milliseconds(100);
constexpr absl::Duration kLongest = absl::Seconds(5);

}  // namespace

SpoolSender::SpoolSender(Spool& spool, api::Database& database)
    : spool_(spool), database_(database), thread_([this] { Loop(); }) {}

SpoolSender::~SpoolSender() {
  call_.stop.Request();
  thread_.join();
}

void SpoolSender::Loop() {
  absl::Duration pause = kShortest;
  while (!call_.stop.requested()) {
    const absl::Status sent = spool_.Send(call_, database_);
    pause = sent.ok() ? kShortest : std::min(2 * pause, kLongest);
    const absl::Time until = SteadyNow() + pause;
    while (SteadyNow() < until && !call_.stop.requested()) absl::SleepFor(absl::Milliseconds(20));
  }
}

}  // namespace strata
