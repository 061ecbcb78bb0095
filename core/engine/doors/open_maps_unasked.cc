// What the thread of OpenMaps does that nobody asks: it looks at all maps, opens those that have
// something to do, and lets go what is idle.
#include <algorithm>
#include <cstdint>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/time.h"
#include <glog/logging.h>

#include "core/common/guarded.h"
#include "core/common/log_line.h"
#include "core/common/map_owner.h"
#include "core/common/steady_time.h"
#include "core/common/this_thread.h"
#include "core/engine/doors/open_maps.h"

namespace strata {
namespace {

// Of shared stores: how often all maps are looked at unasked.
constexpr absl::Duration kSurveyInterval = absl::Minutes(1);
constexpr absl::Duration kLongSurvey = absl::Milliseconds(500);  // is worth a line of the log
// Whoever edits a map by another engine edits more: for so long it is looked for so often.
constexpr absl::Duration kEditing = absl::Seconds(10);
constexpr absl::Duration kLookWhileEditing = absl::Milliseconds(100);
// So long it takes at most to forget a map that has just been deleted.
constexpr absl::Duration kSettled = absl::Seconds(1);

}  // namespace

void OpenMaps::Loop() {
  NameThisThread("maps");
  bool surveyed = false;
  absl::Time edited = absl::InfinitePast();  // elsewhere, last
  while (true) {
    Guarded([&]() -> absl::Status {
      if (!surveyed) surveyed = SurveyAgain(absl::ZeroDuration()).ok();
      if (surveyed && stores_.IsShared()) {
        SurveyAgain(kSurveyInterval).IgnoreError();  // the next one may succeed
        if (options_.integrates) TakeAbandoned();
        if (options_.integrates && TellOfArrivals()) edited = SteadyNow();
      }
      OpenAllWanted();
      CloseIdle();
      return absl::OkStatus();
    }).IgnoreError();  // without memory it is done later
    absl::Duration pause = options_.look_interval;
    if (SteadyNow() - edited < kEditing) pause = std::min(pause, kLookWhileEditing);
    absl::MutexLock lock(&mutex_);
    if (mutex_.AwaitWithTimeout(absl::Condition(&closed_), pause)) return;
  }
}

absl::Status OpenMaps::Survey() {
  const absl::Time begun = SteadyNow();
  std::uint64_t maps = 0;
  std::set<std::string> names;  // of shared stores
  const bool shared = stores_.IsShared();
  const absl::Status done = Guarded([&, this] {
    return stores_.Survey(closing_,
                          [&, this](const std::string& name, absl::StatusOr<MapOutline> outline) {
                            ++maps;
                            if (shared) names.insert(name);
                            Note(name, std::move(outline));
                          });
  });
  if (!done.ok() && !closing_.requested()) {
    LOG(ERROR) << LogLine("maps").Add("not_looked_at", done.message());
  } else if (SteadyNow() - begun > kLongSurvey) {
    LOG(INFO) << LogLine("maps")
                     .Add("looked_at", maps)
                     .Add("ms", absl::ToInt64Milliseconds(SteadyNow() - begun));
  }
  if (done.ok() && shared) ForgetClosedBut(names);
  absl::MutexLock lock(&mutex_);
  if (!surveyed_.has_value() || !surveyed_->ok()) surveyed_ = done;
  survey_took_ = SteadyNow() - begun;
  return done;
}

absl::Status OpenMaps::SurveyAgain(absl::Duration age) {
  {
    absl::MutexLock lock(&mutex_);
    // What another one sees may be older than what the caller knows of.
    mutex_.Await(absl::Condition(this, &OpenMaps::IsNotSurveying));
    const bool young = SteadyNow() - surveyed_at_ < std::max(age, 10 * survey_took_);
    if (young && age > absl::ZeroDuration()) return absl::OkStatus();
    surveying_ = true;
    surveyed_at_ = SteadyNow();
  }
  const absl::Status done = Guarded([this] { return Survey(); });
  absl::MutexLock lock(&mutex_);
  surveying_ = false;
  return done;
}

// Those that were opened or made meanwhile are not closed, or were not at the time.
void OpenMaps::ForgetClosedBut(const std::set<std::string>& names) {
  std::vector<std::string> unseen;
  {
    absl::MutexLock lock(&mutex_);
    for (const auto& [name, entry] : entries_) {
      if (entry.state == State::kClosed && !names.contains(name)) unseen.push_back(name);
    }
  }
  for (const std::string& name : unseen) ForgetIfGone(name);
}

void OpenMaps::ForgetIfGone(const std::string& name) {
  {
    // As another engine has asked, a moment ago.
    const auto settled = [&]() ABSL_SHARED_LOCKS_REQUIRED(mutex_) {
      const auto it = entries_.find(name);
      return it == entries_.end() || it->second.state != State::kGoing;
    };
    absl::MutexLock lock(&mutex_);
    mutex_.AwaitWithTimeout(absl::Condition(&settled), kSettled);
  }
  const absl::StatusOr<bool> there = stores_.Has(name);
  if (!there.ok() || *there) return;
  absl::MutexLock lock(&mutex_);
  const auto it = entries_.find(name);
  if (it == entries_.end() || it->second.state != State::kClosed) return;
  wanted_.erase(name);
  failed_.erase(name);
  entries_.erase(it);
}

void OpenMaps::TakeAbandoned() {
  const absl::StatusOr<std::vector<std::string>> names = stores_.ListAbandoned();
  if (!names.ok()) return;  // the store is away; what it holds stays where it is
  for (const std::string& name : *names) {
    {
      absl::MutexLock lock(&mutex_);
      if (entries_.size() < options_.max_maps) entries_.try_emplace(name);
      const auto it = entries_.find(name);
      if (it == entries_.end() || it->second.state != State::kClosed) continue;
      it->second.why = absl::OkStatus();
      wanted_.insert(name);
    }
    OpenWanted(name);
  }
}

bool OpenMaps::TellOfArrivals() {
  const absl::StatusOr<std::vector<WaitingMap>> waiting = stores_.ListWaiting();
  if (!waiting.ok()) return false;  // the store is away; what waits there goes on waiting
  bool edits = false;
  std::map<std::string, WaitingMap> arrived;
  for (const WaitingMap& one : *waiting) {
    if (one.deletion) {
      RemoveAsAsked(one.name);
      continue;
    }
    arrived[one.name] = one;
    edits = edits || one.edits > 0;
  }
  for (const std::shared_ptr<Map>& map : Open()) {
    const auto it = arrived.find(map->core().name());
    if (it != arrived.end() && it->second.scans) map->ScansWait();
    if (it != arrived.end() && it->second.edits > 0) map->EditsWait(it->second.edits);
    // What waits or runs here may have been cancelled elsewhere. An error: it is looked again.
    const bool jobs = it != arrived.end() && it->second.jobs;
    if (jobs || map->HasJobs()) map->TakeInJobs().IgnoreError();
    if (map->jobs().AnyElsewhere()) ReturnDeadJobs(*map);
  }
  return edits;
}

void OpenMaps::ReturnDeadJobs(Map& map) {
  const absl::StatusOr<std::set<std::string>> alive = stores_.ListWorkers();
  if (alive.ok()) map.ReturnDeadJobs(*alive).IgnoreError();  // the next look may succeed
}

void OpenMaps::RemoveAsAsked(const std::string& name) {
  const absl::Status removed =
      Remove(closing_, name, [&](std::uint64_t) { return stores_.DeleteAsAsked(name); });
  // Until it is withdrawn, it is tried again at the next look, by whoever has the map then.
  LOG_IF(INFO, removed.ok())
      << LogLine("map").Add("map", name).Add("deleted", "as asked elsewhere");
}

// The origin of a map that is open here may be set elsewhere.
void OpenMaps::TakeInOrigin(const std::string& name, const MapOutline& outline) {
  std::shared_ptr<Map> map;
  {
    absl::MutexLock lock(&mutex_);
    const auto it = entries_.find(name);
    if (it != entries_.end()) map = it->second.map;
  }
  if (map == nullptr) return;
  if (map->core().info().parameters.origin == outline.info.parameters.origin) return;
  map->core().TakeInOrigin().IgnoreError();  // the next look may succeed
}

void OpenMaps::Note(const std::string& name, absl::StatusOr<MapOutline> outline) {
  if (outline.ok() && stores_.IsShared()) TakeInOrigin(name, *outline);
  bool first = false;
  {
    absl::MutexLock lock(&mutex_);
    first = !surveyed_.has_value();
    const bool shared = stores_.IsShared();
    if (shared && outline.ok() && entries_.size() < options_.max_maps) entries_.try_emplace(name);
    const auto it = entries_.find(name);
    if (it == entries_.end()) return;
    Entry& entry = it->second;
    const bool elsewhere = MapOwnerOf(entry.why).has_value();
    if (entry.state != State::kClosed || !(entry.why.ok() || elsewhere)) return;
    if (entry.memory.opened_before && !shared) return;
    if (outline.ok()) {
      entry.info = std::move(outline->info);
      entry.info->name = name;
      entry.clock = outline->clock;
      entry.numbers = std::move(outline->numbers);
      if (!outline->has_work || !options_.integrates) return;
    }
    wanted_.insert(name);
  }
  if (first) OpenWanted(name);  // others can wait, whoever asks for a list cannot
}

bool OpenMaps::OpenWanted(const std::string& name) {
  if (closing_.requested()) return false;
  const absl::Status opened = Find(closing_, name).status();
  if (opened.ok() || !absl::IsResourceExhausted(opened)) return true;
  absl::MutexLock lock(&mutex_);
  return open_.size() < options_.max_open_maps;
}

void OpenMaps::OpenAllWanted() {
  std::vector<std::string> wanted;
  {
    absl::MutexLock lock(&mutex_);
    wanted.assign(wanted_.begin(), wanted_.end());
  }
  for (const std::string& name : wanted) {
    if (!OpenWanted(name)) return;
  }
}

void OpenMaps::CloseIdle() {
  std::string after;
  while (!closing_.requested()) {
    Turn turn;
    if (!NextIdle(after, turn)) return;
    // What was taken away from under it says so for as long as it is open.
    if (turn.closed->core().doubt().ok() && !turn.closed->core().CheckInPlace().ok()) {
      absl::MutexLock lock(&mutex_);
      Entry& entry = entries_.find(turn.close)->second;
      entry.state = State::kOpen;
      entry.used = SteadyNow();
    } else {
      CloseNow(turn.close, std::move(turn.closed));
    }
    after = std::move(turn.close);
  }
}

bool OpenMaps::NextIdle(const std::string& after, Turn& turn) {
  absl::MutexLock lock(&mutex_);
  const absl::Time now = SteadyNow();
  for (auto it = open_.upper_bound(after); it != open_.end(); ++it) {
    Entry& entry = entries_.find(*it)->second;
    if (entry.state != State::kOpen) continue;
    if (entry.map->core().doubt().ok()) {
      if (!IsFree(entry)) entry.used = now;
      if (now - entry.used < options_.map_idle || !IsFree(entry) || !entry.map->AtRest()) continue;
    }
    BeginClosing(entry, *it, turn);
    return true;
  }
  return false;
}

}  // namespace strata
