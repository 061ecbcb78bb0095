#include "server/rpc/arrivals.h"

#include <cstddef>

namespace strata::server {
namespace {

// By when handlers of calls run in turn: of a call that came in this long before one that has
// begun, nothing will be heard any more.
constexpr absl::Duration kInTurn = absl::Seconds(5);
constexpr std::size_t kMostWaiting = 512;
constexpr absl::Duration kLetIn = absl::Milliseconds(10);

}  // namespace

Arrival Arrivals::Enter(absl::string_view client, int lane, absl::Time now) {
  absl::MutexLock lock(&mutex_);
  const auto found = clients_.find(client);
  Client& entry = found == clients_.end() ? clients_[std::string(client)] : found->second;
  const bool full = entry.waiting.size() >= kMostWaiting ||
                    entry.running + entry.waiting.size() >= static_cast<std::size_t>(most_);
  if (full && now - entry.let_in < kLetIn) return entry.refusals.Add(lane, now);
  entry.waiting.push_back(now);
  entry.let_in = now;
  return {};
}

void Arrivals::Begin(absl::string_view client, absl::Time now) {
  absl::MutexLock lock(&mutex_);
  Client& entry = clients_[std::string(client)];
  ++entry.running;
  // Which of them it is is not told; the first are missed least.
  if (!entry.waiting.empty()) entry.waiting.pop_front();
  while (!entry.waiting.empty() && now - entry.waiting.front() > kInTurn) {
    entry.waiting.pop_front();
  }
}

void Arrivals::Leave(absl::string_view client) {
  absl::MutexLock lock(&mutex_);
  const auto found = clients_.find(client);
  if (found == clients_.end()) return;
  --found->second.running;
  if (found->second.running <= 0 && found->second.waiting.empty()) clients_.erase(found);
}

}  // namespace strata::server
