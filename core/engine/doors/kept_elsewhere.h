// What is kept between calls of maps that other engines have.
#ifndef STRATA_CORE_ENGINE_DOORS_KEPT_ELSEWHERE_H_
#define STRATA_CORE_ENGINE_DOORS_KEPT_ELSEWHERE_H_

#include <algorithm>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <utility>

#include "absl/base/thread_annotations.h"
#include "absl/functional/function_ref.h"
#include "absl/status/statusor.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/time.h"

#include "core/common/status.h"
#include "core/common/steady_time.h"
#include "core/engine/map/engine_options.h"

namespace strata {

// A planner, a localizer: of as many maps as may be open, those that were asked for last, and for
// as long as a map may be idle. Thread-safe.
template <typename T>
class KeptElsewhere {
 public:
  using Make = absl::FunctionRef<absl::StatusOr<std::shared_ptr<T>>()>;

  explicit KeptElsewhere(const EngineOptions& options)
      : most_(options.max_open_maps), idle_(options.map_idle) {}

  // That of the map that is called `name` now, or what `make` makes. `number`: of the map, which
  // another one of that name has not.
  absl::StatusOr<std::shared_ptr<T>> Find(const std::string& name, std::int64_t number, Make make) {
    if (std::shared_ptr<T> kept = FindKept(name, number)) return kept;
    STRATA_ASSIGN_OR_RETURN(std::shared_ptr<T> made, make());
    absl::MutexLock lock(&mutex_);
    Entry& entry = kept_[name];
    // Of two that were made at once one is used.
    if (entry.value == nullptr || entry.number != number) entry = {number, {}, std::move(made)};
    entry.used = SteadyNow();
    std::shared_ptr<T> found = entry.value;
    DropUnused();
    return found;
  }

 private:
  struct Entry {
    std::int64_t number = 0;
    absl::Time used;
    std::shared_ptr<T> value;
  };

  std::shared_ptr<T> FindKept(const std::string& name, std::int64_t number) {
    absl::MutexLock lock(&mutex_);
    const auto it = kept_.find(name);
    if (it == kept_.end() || it->second.number != number) return nullptr;
    it->second.used = SteadyNow();
    return it->second.value;
  }

  void DropUnused() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) {
    const absl::Time old = SteadyNow() - idle_;
    std::erase_if(kept_, [old](const auto& entry) { return entry.second.used < old; });
    if (kept_.size() <= most_) return;
    kept_.erase(std::min_element(kept_.begin(), kept_.end(), [](const auto& a, const auto& b) {
      return a.second.used < b.second.used;
    }));
  }

  const std::uint64_t most_;
  const absl::Duration idle_;
  absl::Mutex mutex_;
  std::map<std::string, Entry> kept_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_DOORS_KEPT_ELSEWHERE_H_
