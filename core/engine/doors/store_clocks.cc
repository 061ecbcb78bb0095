#include "core/engine/doors/store_clocks.h"

#include <algorithm>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"

#include "core/common/blocking.h"
#include "core/common/guarded.h"
#include "core/common/status.h"
#include "core/common/steady_time.h"

namespace strata {
namespace {

// Who has not asked for so long does not watch.
constexpr absl::Duration kForgotten = absl::Seconds(10);
constexpr absl::Duration kStopPoll = absl::Milliseconds(50);

}  // namespace

std::vector<std::string> StoreClocks::Watched(absl::Time now) {
  std::vector<std::string> names;
  for (auto it = entries_.begin(); it != entries_.end();) {
    if (now - it->second.asked > kForgotten) {
      it = entries_.erase(it);
    } else {
      names.push_back((it++)->first);
    }
  }
  return names;
}

void StoreClocks::Look(const std::vector<std::string>& names) {
  const absl::Time begun = SteadyNow();
  absl::StatusOr<std::vector<std::pair<std::string, MapClock>>> clocks =
      Guarded([&] { return stores_.ListClocks(names); });
  absl::MutexLock lock(&mutex_);
  looking_ = false;
  for (const std::string& name : names) {
    const auto it = entries_.find(name);
    if (it == entries_.end()) continue;
    it->second.looked = begun;
    it->second.clock = clocks.ok() ? absl::NotFoundError("") : clocks.status();
  }
  if (!clocks.ok()) return;
  for (auto& [name, clock] : *clocks) {
    const auto it = entries_.find(name);
    if (it != entries_.end()) it->second.clock = clock;
  }
}

absl::StatusOr<MapClock> StoreClocks::ClockOf(const std::string& name,
                                              absl::Duration lag,
                                              const Stop& stop) {
  const absl::Time asked = SteadyNow();
  while (true) {
    std::vector<std::string> names;
    {
      absl::MutexLock lock(&mutex_);
      Entry& entry = entries_[name];
      entry.asked = asked;
      if (entry.looked >= asked - lag) {
        if (!absl::IsNotFound(entry.clock.status())) return entry.clock;
        return absl::NotFoundError(absl::StrCat("map ", name, " does not exist"));
      }
      if (looking_) {
        const BlockingScope blocking;
        mutex_.AwaitWithTimeout(absl::Condition(this, &StoreClocks::IsFree), kStopPoll);
      } else {
        names = Watched(asked);
        looking_ = true;
      }
    }
    STRATA_RETURN_IF_ERROR(stop.status());
    if (!names.empty()) Look(names);
  }
}

absl::Status StoreClocks::Await(const std::string& name,
                                std::uint64_t commit_sequence,
                                std::uint64_t epoch,
                                const Stop& stop) {
  while (true) {
    const absl::Time next = SteadyNow() + api::kWatchLag;
    const absl::StatusOr<MapClock> clock = ClockOf(name, api::kWatchLag, stop);
    if (absl::IsNotFound(clock.status())) return absl::OkStatus();
    STRATA_RETURN_IF_ERROR(clock.status());
    if (clock->commit_sequence != commit_sequence || clock->epoch != epoch) return absl::OkStatus();
    while (SteadyNow() < next) {
      STRATA_RETURN_IF_ERROR(stop.status());
      absl::SleepFor(std::min(kStopPoll, next - SteadyNow()));
    }
  }
}

}  // namespace strata
