#include "server/rpc/client_limits.h"

#include <algorithm>
#include <iterator>

#include "absl/strings/str_cat.h"

#include "core/common/retry_delay.h"
#include "proto/translate/status.h"

namespace strata::server {
namespace {

// After which a client that has too much under way may look again.
constexpr absl::Duration kLookAgain = absl::Milliseconds(500);

absl::Status TooMuch(absl::string_view message, absl::Duration delay) {
  return translate::WithReason(WithRetryDelay(absl::ResourceExhaustedError(message), delay),
                               translate::kClientLimitReason);
}

}  // namespace

absl::Duration ClientLimits::TakeAllowance(Client& client, absl::Time now) const {
  if (options_.calls_per_second <= 0.0) return absl::ZeroDuration();
  // A clock that was set back gives nothing.
  const double passed = std::max(0.0, absl::ToDoubleSeconds(now - client.counted));
  client.allowance =
      std::min(options_.burst, client.allowance + passed * options_.calls_per_second);
  client.counted = now;
  if (client.allowance < 1.0) {
    return absl::Seconds((1.0 - client.allowance) / options_.calls_per_second);
  }
  client.allowance -= 1.0;
  return absl::ZeroDuration();
}

bool ClientLimits::Idle(const Client& client, absl::Time now) const {
  if (client.calls > 0 || client.watches > 0 || client.bytes > 0) return false;
  if (options_.calls_per_second <= 0.0) return true;
  // Its allowance is full again: forgetting it gives it nothing.
  const absl::Duration refill = absl::Seconds(options_.burst / options_.calls_per_second);
  return absl::AbsDuration(now - client.counted) > refill;
}

void ClientLimits::ForgetIdle(absl::Time now) {
  for (auto it = clients_.begin(); it != clients_.end();) {
    it = Idle(it->second, now) ? clients_.erase(it) : std::next(it);
  }
  // Amortised: as many clients must come anew as are left.
  forget_at_ = std::max<std::size_t>(1024, 2 * clients_.size());
}

absl::Status ClientLimits::Enter(absl::string_view name, Kind kind, absl::Time now) {
  absl::MutexLock lock(&mutex_);
  if (clients_.size() >= forget_at_) ForgetIdle(now);
  auto found = clients_.find(name);
  if (found == clients_.end()) {
    const Client fresh{.allowance = options_.burst, .counted = now};
    found = clients_.emplace(std::string(name), fresh).first;
  }
  Client& client = found->second;
  const bool call = kind == Kind::kCall;
  int& under_way = call ? client.calls : client.watches;
  const int most = call ? options_.max_calls : options_.max_watches;
  if (under_way >= most) {
    return TooMuch(absl::StrCat("client ",
                                name,
                                " has ",
                                most,
                                call ? " calls" : " watches",
                                " under way, which is all it may have"),
                   kLookAgain);
  }
  const absl::Duration wait = TakeAllowance(client, now);
  if (wait > absl::ZeroDuration()) {
    return TooMuch(
        absl::StrCat("client ", name, " began more than ", options_.calls_per_second, " calls/s"),
        wait);
  }
  ++under_way;
  return absl::OkStatus();
}

void ClientLimits::Leave(absl::string_view name, Kind kind) {
  absl::MutexLock lock(&mutex_);
  Client& client = clients_.find(name)->second;
  --(kind == Kind::kCall ? client.calls : client.watches);
}

absl::Status ClientLimits::Hold(absl::string_view name, std::size_t more, std::size_t all) {
  if (all > options_.max_bytes) {
    return translate::WithReason(
        absl::ResourceExhaustedError(absl::StrCat("the call needs ",
                                                  all,
                                                  " bytes of memory; one client may hold ",
                                                  options_.max_bytes,
                                                  " (stratad --client-memory); ask in parts")),
        translate::kRequestReason);
  }
  absl::MutexLock lock(&mutex_);
  const auto found = clients_.find(name);
  if (found->second.bytes + more > options_.max_bytes) {
    return TooMuch(absl::StrCat("calls of client ",
                                name,
                                " hold ",
                                found->second.bytes,
                                " bytes of memory; with ",
                                more,
                                " more it were above the ",
                                options_.max_bytes,
                                " it may hold"),
                   kLookAgain);
  }
  if (held_ + more > max_bytes_) {
    const absl::Status full =
        absl::ResourceExhaustedError(absl::StrCat("the calls under way hold ",
                                                  held_,
                                                  " bytes of memory, of ",
                                                  max_bytes_,
                                                  " they may; try again later"));
    return translate::WithReason(WithRetryDelay(full, kLookAgain), translate::kServerBusyReason);
  }
  found->second.bytes += more;
  held_ += more;
  return absl::OkStatus();
}

void ClientLimits::Release(absl::string_view name, std::size_t bytes) {
  absl::MutexLock lock(&mutex_);
  clients_.find(name)->second.bytes -= bytes;
  held_ -= bytes;
}

absl::Status Booking::Resize(std::size_t bytes) {
  if (bytes > bytes_) {
    const absl::Status held = limits_->Hold(client_, bytes - bytes_, bytes);
    if (!held.ok()) return held;
  } else if (bytes < bytes_) {
    limits_->Release(client_, bytes_ - bytes);
  }
  bytes_ = bytes;
  return absl::OkStatus();
}

std::size_t ClientLimits::held_bytes() const {
  absl::MutexLock lock(&mutex_);
  return held_;
}

std::size_t ClientLimits::clients() const {
  absl::MutexLock lock(&mutex_);
  return clients_.size();
}

}  // namespace strata::server
