#include "server/rpc/strangers.h"

#include <utility>

#include "absl/strings/str_cat.h"

#include "core/common/retry_delay.h"
#include "core/common/status.h"
#include "proto/translate/status.h"

namespace strata::server {
namespace {

constexpr absl::string_view kEverybody = "all strangers";
constexpr absl::Duration kLogInterval = absl::Seconds(1);
// Whoever was not heard of for so long has been forgotten: his call was cancelled before.
constexpr absl::Duration kForgotten = absl::Seconds(30);

ClientLimitOptions Rate(double calls_per_second, double burst) {
  ClientLimitOptions options;
  options.calls_per_second = calls_per_second;
  options.burst = burst;
  return options;
}

// Takes one from the allowance of `name`.
absl::Status Take(ClientLimits& limits, absl::string_view name, absl::Time now) {
  const absl::Status status = limits.Enter(name, ClientLimits::Kind::kCall, now);
  if (status.ok()) {
    limits.Leave(name, ClientLimits::Kind::kCall);
    return status;
  }
  const absl::Status refused = absl::ResourceExhaustedError(
      absl::StrCat("without a token of this server: ", status.message()));
  return translate::WithReason(WithRetryDelay(refused, RetryDelayOf(status).value_or(kLogInterval)),
                               translate::kClientLimitReason);
}

}  // namespace

Strangers::Strangers(const StrangerOptions& options)
    : all_(Rate(options.all_per_second, options.all_burst), 0),
      by_address_(Rate(options.calls_per_second, options.burst), 0),
      heard_(Rate(options.heard_per_second, options.heard_burst), 0),
      heard_at_once_(options.heard_at_once) {}

Arrival Strangers::Hear(int lane, absl::Time now) {
  absl::MutexLock lock(&mutex_);
  while (!hearing_.empty() && now - hearing_.front() > kForgotten) hearing_.pop_front();
  if (hearing_.size() < heard_at_once_ && Take(heard_, kEverybody, now).ok()) {
    hearing_.push_back(now);
    return {};
  }
  ++not_logged_;
  return refusals_.Add(lane, now);
}

void Strangers::Leave() {
  absl::MutexLock lock(&mutex_);
  if (!hearing_.empty()) hearing_.pop_front();  // which of them it is does not matter
}

absl::Status Strangers::Enter(absl::string_view address, absl::Time now) {
  // All first: then there are never more addresses in the books than may come in a while.
  STRATA_RETURN_IF_ERROR(Take(all_, kEverybody, now));
  return Take(by_address_, address, now);
}

std::optional<std::uint64_t> Strangers::ToLog(absl::Time now) {
  absl::MutexLock lock(&mutex_);
  ++not_logged_;
  // A clock that was set back does not silence it.
  if (absl::AbsDuration(now - logged_) < kLogInterval) return std::nullopt;
  logged_ = now;
  return std::exchange(not_logged_, 0);
}

}  // namespace strata::server
