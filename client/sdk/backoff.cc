#include "client/sdk/backoff.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "absl/random/random.h"
#include "absl/time/clock.h"

#include "core/common/map_owner.h"
#include "core/common/retry_delay.h"
#include "core/common/steady_time.h"

namespace strata::sdk {
namespace {

// How soon a pause notices that nobody waits any more.
constexpr absl::Duration kSlice = absl::Milliseconds(20);
constexpr absl::Duration kNextServer = absl::Milliseconds(1);
constexpr absl::Duration kClusterPatience = absl::Minutes(2);

std::function<double()> DrawByChance() {
  auto generator = std::make_shared<absl::BitGen>();
  return [generator] { return absl::Uniform(*generator, 0.0, 1.0); };
}

}  // namespace

Backoff::Backoff(const BackoffOptions& options, std::function<double()> uniform)
    : options_(options), uniform_(std::move(uniform)) {}

Backoff::Backoff(const BackoffOptions& options, int servers) : Backoff(options, DrawByChance()) {
  servers_ = servers;
}

std::optional<absl::Duration> Backoff::NextPause(const absl::Status& status) {
  const std::optional<absl::Duration> asked = RetryDelayOf(status);
  // A server that ends cancels what comes in last; what the caller cancelled, Wait() sees by
  // `stop`.
  const bool gone = absl::IsUnavailable(status) || absl::IsCancelled(status);
  const bool again = gone || (absl::IsResourceExhausted(status) && asked.has_value());
  if (!again) return std::nullopt;
  // Calls go round the servers, those of other threads too: twice round finds the one that has it.
  if (MapOwnerOf(status).has_value() && elsewhere_ < 2 * (servers_ - 1)) {
    ++elsewhere_;
    return kNextServer;
  }
  elsewhere_ = 0;
  const absl::Time now = SteadyNow();
  if (!until_.has_value()) {
    until_ =
        now + options_.retry_for.value_or(servers_ > 1 ? kClusterPatience : absl::ZeroDuration());
  }
  const bool exhausted = options_.max_attempts > 0 && attempts_ >= options_.max_attempts;
  if (exhausted && now >= *until_) return std::nullopt;
  const absl::Duration doubled = options_.initial * std::exp2(std::min(attempts_ - 1, 30));
  ++attempts_;
  const absl::Duration pause = std::min(doubled, options_.max) * (1.0 - 0.5 * uniform_());
  return std::max(pause, asked.value_or(absl::ZeroDuration()));
}

bool Backoff::Wait(const absl::Status& status, const Stop& stop) {
  if (stop.requested()) return false;
  const std::optional<absl::Duration> pause = NextPause(status);
  if (!pause.has_value()) return false;
  const absl::Time until = SteadyNow() + *pause;
  if (until >= stop.deadline()) return false;
  for (absl::Time now = SteadyNow(); now < until; now = SteadyNow()) {
    if (stop.requested()) return false;
    absl::SleepFor(std::min(kSlice, until - now));
  }
  return true;
}

}  // namespace strata::sdk
