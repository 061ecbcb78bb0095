#include "core/engine/doors/open_maps.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/time.h"
#include <glog/logging.h>

#include "core/common/blocking.h"
#include "core/common/guarded.h"
#include "core/common/log_line.h"
#include "core/common/map_owner.h"
#include "core/common/retry_delay.h"
#include "core/common/status.h"
#include "core/common/steady_time.h"
#include "core/engine/doors/map_numbers.h"
#include "core/storage/outcome.h"
#include "core/world/names.h"

namespace strata {
namespace {

constexpr absl::Duration kPoll = absl::Milliseconds(50);
// A start waits so long for the first look at all maps: of few it is known from the beginning what
// is wrong with them, and what they have to do has begun.
constexpr absl::Duration kFirstLook = absl::Milliseconds(500);
constexpr absl::Duration kFirstLookAtFew = absl::Seconds(10);
constexpr std::size_t kFew = 100;
// Of shared stores: how old may be what a list says.
constexpr absl::Duration kListAge = absl::Seconds(2);

// Whether it was no fault of the map that it did not open.
bool MayOpenLater(const absl::Status& status) {
  return absl::IsResourceExhausted(status) || absl::IsUnavailable(status);
}

absl::Status NoSuchMap(absl::string_view name) {
  return absl::NotFoundError(absl::StrCat("map ", name.substr(0, 100), " does not exist"));
}

}  // namespace

OpenMaps::OpenMaps(const EngineOptions& options,
                   const MapStores& stores,
                   const std::vector<std::string>& names)
    : options_(options),
      stores_(stores),
      caches_(std::make_shared<CacheBudget>(options.cache_bytes)) {
  for (const std::string& name : names) entries_.emplace(name, Entry());
  thread_ = std::thread([this] { Loop(); });
}

absl::StatusOr<std::unique_ptr<OpenMaps>> OpenMaps::Start(const EngineOptions& options,
                                                          const MapStores& stores) {
  STRATA_ASSIGN_OR_RETURN(const std::vector<std::string> names, stores.List());
  std::unique_ptr<OpenMaps> maps(new OpenMaps(options, stores, names));
  absl::MutexLock lock(&maps->mutex_);
  maps->mutex_.AwaitWithTimeout(absl::Condition(maps.get(), &OpenMaps::IsSurveyed),
                                names.size() <= kFew ? kFirstLookAtFew : kFirstLook);
  return maps;
}

OpenMaps::~OpenMaps() {
  {
    absl::MutexLock lock(&mutex_);
    closed_ = true;
  }
  closing_.Request();
  thread_.join();
}

absl::Status OpenMaps::AwaitSettled(const Stop& stop, absl::string_view name) const {
  const auto settled = [this, name]() ABSL_SHARED_LOCKS_REQUIRED(mutex_) {
    const auto it = entries_.find(name);
    return it == entries_.end() ||
           (it->second.state != State::kOpening && it->second.state != State::kClosing);
  };
  const BlockingScope blocking;
  absl::MutexLock lock(&mutex_);
  while (!mutex_.AwaitWithTimeout(absl::Condition(&settled), kPoll)) {
    STRATA_RETURN_IF_ERROR(
        Annotate(stop.status(), absl::StrCat("waited for map ", name, " to be opened")));
  }
  return absl::OkStatus();
}

void OpenMaps::BeginClosing(Entry& entry, const std::string& name, Turn& turn) {
  turn.close = name;  // may want memory, and nobody would end what had begun
  entry.state = State::kClosing;
  turn.closed = entry.map;
}

std::string OpenMaps::LeastUsed() const {
  std::string least;
  absl::Time used = absl::InfiniteFuture();
  for (const std::string& name : open_) {
    const Entry& entry = entries_.find(name)->second;
    if (!IsFree(entry) || entry.used >= used || entry.map->HasWork()) continue;
    least = name;
    used = entry.used;
  }
  return least;
}

absl::StatusOr<OpenMaps::Turn> OpenMaps::TakeTurn(const std::string& name) {
  Turn turn;
  absl::MutexLock lock(&mutex_);
  const auto it = entries_.find(name);
  if (it == entries_.end()) return NoSuchMap(name);
  Entry& entry = it->second;
  switch (entry.state) {
    case State::kMaking:
      return absl::AbortedError(absl::StrCat("map ", name, " is being made"));
    case State::kGoing:
      return absl::AbortedError(absl::StrCat("map ", name, " is being deleted"));
    case State::kOpening:
    case State::kClosing:
      return turn;
    case State::kOpen:
      entry.used = SteadyNow();
      if (!entry.map->core().doubt().ok()) {
        BeginClosing(entry, name, turn);
        return turn;
      }
      // What is in memory may be older than what others have seen meanwhile.
      STRATA_RETURN_IF_ERROR(entry.map->core().CheckHeld());
      turn.found = entry.map;
      return turn;
    case State::kClosed:
      break;
  }
  if (!entry.why.ok() && (!MayOpenLater(entry.why) || SteadyNow() < entry.next_try)) {
    return entry.why;
  }
  STRATA_RETURN_IF_ERROR(BeginOpening(entry, name, turn));
  return turn;
}

absl::Status OpenMaps::BeginOpening(Entry& entry, const std::string& name, Turn& turn) {
  if (open_.size() < options_.max_open_maps) {
    open_.insert(name);
    entry.state = State::kOpening;
    turn.open = true;
    return absl::OkStatus();
  }
  const std::string least = LeastUsed();
  if (!least.empty()) {
    BeginClosing(entries_.find(least)->second, least, turn);
    return absl::OkStatus();
  }
  return WithRetryDelay(
      absl::ResourceExhaustedError(absl::StrCat("map ",
                                                name,
                                                " is not open, and ",
                                                open_.size(),
                                                " others are, the most this server opens "
                                                "(--max-open-maps); all are in use")),
      kRetryDelay);
}

absl::StatusOr<std::shared_ptr<Map>> OpenMaps::Find(const Stop& stop, absl::string_view name) {
  STRATA_RETURN_IF_ERROR(ValidateName("map name", name));
  const std::string key(name);
  while (true) {
    absl::StatusOr<Turn> taken = TakeTurn(key);
    if (absl::IsNotFound(taken.status()) && stores_.IsShared()) {
      STRATA_ASSIGN_OR_RETURN(const bool there, Adopt(key));
      if (there) taken = TakeTurn(key);
    }
    STRATA_RETURN_IF_ERROR(taken.status());
    Turn turn = *std::move(taken);
    if (turn.found != nullptr) return std::move(turn.found);
    if (turn.open) return OpenNow(key);
    if (turn.closed != nullptr) {
      CloseNow(turn.close, std::move(turn.closed));
    } else {
      STRATA_RETURN_IF_ERROR(AwaitSettled(stop, key));
    }
  }
}

absl::StatusOr<bool> OpenMaps::Adopt(const std::string& name) {
  STRATA_ASSIGN_OR_RETURN(const bool there, stores_.Has(name));
  if (!there) return false;
  absl::MutexLock lock(&mutex_);
  if (entries_.size() < options_.max_maps || entries_.contains(name)) {
    // Whoever asks for a list next finds it there, too.
    if (entries_.try_emplace(name).second) surveyed_at_ = absl::InfinitePast();
    return true;
  }
  return absl::ResourceExhaustedError(
      absl::StrCat("there are ", entries_.size(), " maps, the most this server holds"));
}

absl::StatusOr<std::shared_ptr<Map>> OpenMaps::OpenNow(const std::string& name) {
  const BlockingScope blocking;
  // All that may fail for want of memory: whoever waits for the map waits until its state is set.
  absl::StatusOr<std::shared_ptr<Map>> map = Guarded([&]() -> absl::StatusOr<std::shared_ptr<Map>> {
    MapMemory memory;
    {
      absl::MutexLock lock(&mutex_);
      memory = entries_.find(name)->second.memory;
    }
    STRATA_ASSIGN_OR_RETURN(StoredMap stored, stores_.Open(name));
    return Map::Open(name, std::move(stored), options_, caches_, memory);
  });
  absl::MutexLock lock(&mutex_);
  Entry& entry = entries_.find(name)->second;
  entry.used = SteadyNow();
  if (map.ok()) {
    entry.state = State::kOpen;
    entry.map = *map;
    entry.memory.opened_before = true;
    entry.why = absl::OkStatus();
    wanted_.erase(name);
    failed_.erase(name);
    return map;
  }
  open_.erase(name);
  if (absl::IsNotFound(map.status()) && stores_.IsShared()) {  // another has removed it
    wanted_.erase(name);
    failed_.erase(name);
    entries_.erase(name);
    return map;
  }
  NoteNotOpened(name, entry, map.status());
  return map;
}

void OpenMaps::NoteNotOpened(const std::string& name, Entry& entry, const absl::Status& why) {
  const bool told = entry.why == why;
  const bool elsewhere = MapOwnerOf(why).has_value();
  entry.state = State::kClosed;
  entry.why = why;
  entry.next_try = SteadyNow() + kRetryDelay;
  // Whoever has it does what there is to do; TakeAbandoned() sees that he is gone.
  if (elsewhere || !MayOpenLater(why)) wanted_.erase(name);
  if (elsewhere) {
    failed_.erase(name);
  } else {
    failed_.insert(name);
  }
  if (told) return;
  LOG_IF(ERROR, !elsewhere) << LogLine("map").Add("map", name).Add("not_opened", why.message());
  LOG_IF(INFO, elsewhere) << LogLine("map").Add("map", name).Add("owner", *MapOwnerOf(why));
}

void OpenMaps::NoteClosing(const std::string& name, Map& map, bool in_doubt) {
  std::optional<MapNumbers> numbers;
  if (!in_doubt) numbers = NumbersOfMap(map, stores_.FileOf(name));
  absl::MutexLock lock(&mutex_);
  Entry& entry = entries_.find(name)->second;
  entry.info = map.core().info();
  if (numbers.has_value() && entry.numbers.has_value()) AddCounts(*entry.numbers, *numbers);
  if (numbers.has_value()) entry.numbers = std::move(numbers);
}

// What is in doubt is not asked for anything any more, but opened anew at once.
void OpenMaps::CloseNow(const std::string& name, std::shared_ptr<Map> map) {
  const BlockingScope blocking;  // for what its threads are at
  const absl::Status doubt = map->core().doubt();
  std::set<std::string> again;  // its name, if there is memory for it now
  Guarded([&] {
    again.insert(name);
    NoteClosing(name, *map, !doubt.ok());
    return absl::OkStatus();
  }).IgnoreError();
  {
    absl::MutexLock lock(&mutex_);
    entries_.find(name)->second.map = nullptr;  // what is known of it is in the entry
  }
  map->Close(doubt.ok() ? let_go_ : doubt);
  Guarded([&] {
    MapMemory memory = map->memory();
    absl::MutexLock lock(&mutex_);
    entries_.find(name)->second.memory = std::move(memory);
    return absl::OkStatus();
  }).IgnoreError();
  absl::MutexLock lock(&mutex_);
  if (MustBeOpenedAnew(doubt) && !IsOutcomeUnknown(doubt)) ++maps_lost_;
  Entry& entry = entries_.find(name)->second;
  entry.clock.reset();
  if (doubt.ok()) entry.clock = map->core().changes().last();
  const bool wanted = !doubt.ok() || map->HasWork();
  map.reset();
  entry.state = State::kClosed;
  open_.erase(name);
  if (wanted) wanted_.merge(again);
}

absl::Status OpenMaps::Make(const Stop& stop,
                            const std::string& name,
                            absl::FunctionRef<absl::Status()> make) {
  if (stores_.IsShared()) ForgetIfGone(name);
  {
    absl::MutexLock lock(&mutex_);
    if (entries_.contains(name)) {
      return absl::AlreadyExistsError(absl::StrCat("map ", name, " exists"));
    }
    if (entries_.size() >= options_.max_maps) {
      return absl::ResourceExhaustedError(absl::StrCat(
          "there are ", entries_.size(), " maps, the most this server holds; delete one first"));
    }
    entries_[name].state = State::kMaking;
  }
  // Without the lock: every call looks for its map, and this waits for the disk.
  const absl::Status made = Guarded(make);
  {
    absl::MutexLock lock(&mutex_);
    if (!made.ok()) {
      entries_.erase(name);
      return made;
    }
    Entry& entry = entries_.find(name)->second;
    entry.state = State::kClosed;
    entry.clock = 0;  // as nobody has seen
  }
  return Find(stop, name).status();
}

absl::StatusOr<bool> OpenMaps::Withdraw(const std::string& name,
                                        std::shared_ptr<Map>& map,
                                        std::uint64_t& clock) {
  absl::MutexLock lock(&mutex_);
  const auto it = entries_.find(name);
  if (it == entries_.end()) return NoSuchMap(name);
  Entry& entry = it->second;
  if (entry.state == State::kMaking || entry.state == State::kGoing) return NoSuchMap(name);
  if (entry.state == State::kOpening || entry.state == State::kClosing) return false;
  const bool known = entry.map != nullptr || entry.clock.has_value() ||
                     (!entry.why.ok() && !MapOwnerOf(entry.why).has_value());
  if (!known) return false;
  clock = entry.clock.value_or(0);
  map = std::exchange(entry.map, nullptr);
  entry.state = State::kGoing;
  return true;
}

absl::Status OpenMaps::Remove(const Stop& stop,
                              absl::string_view name,
                              absl::FunctionRef<absl::Status(std::uint64_t clock)> remove) {
  const std::string key(name);
  std::shared_ptr<Map> map;
  std::uint64_t clock = 0;
  while (true) {
    STRATA_RETURN_IF_ERROR(AwaitSettled(stop, key));
    STRATA_ASSIGN_OR_RETURN(const bool taken, Withdraw(key, map, clock));
    if (taken) break;
    // Where its clock stands is read by opening it; where that fails it goes without.
    const absl::Status opened = Find(stop, key).status();
    STRATA_RETURN_IF_ERROR(stop.status());
    const bool elsewhere = MapOwnerOf(opened).has_value();
    const bool gone = absl::IsNotFound(opened);
    if (elsewhere || gone || absl::IsResourceExhausted(opened)) return opened;
  }
  if (map != nullptr) {
    const BlockingScope blocking;  // for what its threads are at
    map->Close();                  // its jobs end with it
    clock = map->core().changes().last();
  }
  const absl::Status removed = remove(clock);
  absl::MutexLock lock(&mutex_);
  open_.erase(key);
  // It is no map, or another engine has just opened it.
  if (absl::IsFailedPrecondition(removed) || MapOwnerOf(removed).has_value()) {
    entries_.find(key)->second.state = State::kClosed;
    return removed;
  }
  wanted_.erase(key);
  failed_.erase(key);
  entries_.erase(key);
  return removed;
}

absl::StatusOr<std::vector<MapInfo>> OpenMaps::List(const Stop& stop) {
  const BlockingScope blocking;
  absl::MutexLock lock(&mutex_);
  while (!mutex_.AwaitWithTimeout(absl::Condition(this, &OpenMaps::IsSurveyed), kPoll)) {
    STRATA_RETURN_IF_ERROR(Annotate(stop.status(), "waited for the first look at all maps"));
  }
  STRATA_RETURN_IF_ERROR(*surveyed_);
  const auto is_listed = [](const Entry& entry) {
    if (entry.state == State::kMaking || entry.state == State::kGoing) return false;
    return entry.why.ok() || MapOwnerOf(entry.why).has_value();
  };
  if (stores_.IsShared()) {
    // Somebody asked for a map that was not there at the last look.
    const bool is_new = std::ranges::any_of(entries_, [&](const auto& named) {
      const Entry& entry = named.second;
      return is_listed(entry) && entry.map == nullptr && !entry.info.has_value();
    });
    mutex_.Unlock();
    const absl::Status looked = SurveyAgain(is_new ? absl::ZeroDuration() : kListAge);
    mutex_.Lock();
    STRATA_RETURN_IF_ERROR(looked);
  }
  std::vector<MapInfo> infos;
  infos.reserve(entries_.size());
  for (const auto& [name, entry] : entries_) {
    if (!is_listed(entry)) continue;
    if (entry.map != nullptr) {
      infos.push_back(entry.map->core().info());
    } else if (entry.info.has_value()) {
      infos.push_back(*entry.info);
    }
  }
  return infos;
}

bool OpenMaps::IsOpen(const std::string& name) const {
  absl::MutexLock lock(&mutex_);
  return open_.contains(name);
}

std::vector<std::shared_ptr<Map>> OpenMaps::Open() const {
  std::vector<std::shared_ptr<Map>> open;
  absl::MutexLock lock(&mutex_);
  for (const std::string& name : open_) {
    const Entry& entry = entries_.find(name)->second;
    if (entry.map != nullptr) open.push_back(entry.map);
  }
  return open;
}

EngineNumbers OpenMaps::Numbers() const {
  EngineNumbers numbers;
  std::map<std::string, MapNumbers> of_maps;
  for (const std::shared_ptr<Map>& map : Open()) {
    const std::string& name = map->core().name();
    of_maps[name] = NumbersOfMap(*map, stores_.FileOf(name));
  }
  absl::MutexLock lock(&mutex_);
  numbers.maps_not_opened = failed_.size();
  numbers.maps_lost = maps_lost_;
  for (const auto& [name, entry] : entries_) {
    const auto open = of_maps.find(name);
    // What was closed meanwhile is known better by its entry.
    const bool is_open = entry.map != nullptr && open != of_maps.end();
    if (entry.state == State::kGoing || !(is_open || entry.numbers.has_value())) continue;
    if (!entry.why.ok() && !MapOwnerOf(entry.why).has_value()) continue;
    MapNumbers& added = numbers.maps.emplace_back(is_open ? open->second : *entry.numbers);
    if (is_open && entry.numbers.has_value()) AddCounts(*entry.numbers, added);
    if (is_open && stores_.IsShared()) added.owner = options_.server_name;
    added.map = name;
  }
  return numbers;
}

std::vector<std::string> OpenMaps::NotOpened() const {
  absl::MutexLock lock(&mutex_);
  return {failed_.begin(), failed_.end()};
}

}  // namespace strata
