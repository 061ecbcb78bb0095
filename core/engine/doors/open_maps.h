// The maps of an engine by name: opened when somebody needs them, or when they have something to do
// by themselves, and let go when that is over.
#ifndef STRATA_CORE_ENGINE_DOORS_OPEN_MAPS_H_
#define STRATA_CORE_ENGINE_DOORS_OPEN_MAPS_H_

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/time.h"

#include "core/common/cache_budget.h"
#include "core/common/stop.h"
#include "core/engine/doors/map.h"
#include "core/engine/map/engine_options.h"
#include "core/engine/map/map_stores.h"
#include "core/engine/map/numbers.h"

namespace strata {

// A map that is not open costs its entry, some hundred bytes: no thread, no file, no connection.
// Whether one is in use is seen by who holds it, so whoever works on a map holds what Find() gave
// until it has ended: a stream, a watch. Thread-safe.
class OpenMaps {
 public:
  // Those of `stores`, which must outlive it. Looks at them in the background, which this waits for
  // a little, and opens those that have something to do.
  static absl::StatusOr<std::unique_ptr<OpenMaps>> Start(const EngineOptions& options,
                                                         const MapStores& stores);
  // Closes them. No call may be under way.
  ~OpenMaps();

  // The map, opened if it is not. NOT_FOUND; RESOURCE_EXHAUSTED where as many are open as may be,
  // and all have something to do; UNAVAILABLE with MapOwnerOf() where another engine has it; or why
  // it did not open. Where that was for want of room or of a
  // disk that answers, it is tried again, once a second at most. `stop` ends the wait for another
  // who opens or closes it.
  absl::StatusOr<std::shared_ptr<Map>> Find(const Stop& stop, absl::string_view name);
  // Has `make` make a map, and opens it. ALREADY_EXISTS; RESOURCE_EXHAUSTED for one more than there
  // may be.
  absl::Status Make(const Stop& stop,
                    const std::string& name,
                    absl::FunctionRef<absl::Status()> make);
  // Closes the map and has `remove` remove it, which is told where its clock stood, if known;
  // nobody finds it meanwhile, and afterwards it is forgotten. NOT_FOUND.
  absl::Status Remove(const Stop& stop,
                      absl::string_view name,
                      absl::FunctionRef<absl::Status(std::uint64_t clock)> remove);

  // Of shared stores: forgets a map that is not open here and that another engine has removed.
  void ForgetIfGone(const std::string& name);

  // By name, without opening any; those that do not open are left out. Waits until each was looked
  // at once, which `stop` ends; of shared stores some seconds ago at most, or as long as that takes
  // ten times.
  absl::StatusOr<std::vector<MapInfo>> List(const Stop& stop);
  const std::shared_ptr<CacheBudget>& caches() const { return caches_; }
  // Whether it is open, or about to be.
  bool IsOpen(const std::string& name) const;
  // Those that are open now.
  std::vector<std::shared_ptr<Map>> Open() const;
  // Of open maps, then as last known of others.
  EngineNumbers Numbers() const;
  // Those that do not open, but for such as are being made or removed.
  std::vector<std::string> NotOpened() const;

 private:
  enum class State : std::uint8_t { kClosed, kOpening, kOpen, kClosing, kMaking, kGoing };
  struct Entry {
    State state = State::kClosed;
    std::shared_ptr<Map> map;  // of kOpen, and of kClosing at first
    absl::Status why;          // of kClosed: that it did not open the last time
    absl::Time next_try = absl::InfinitePast();
    absl::Time used;  // of kOpen: last
    MapMemory memory;
    std::optional<std::uint64_t> clock;  // of kClosed, where known
    std::optional<MapInfo> info;         // as it was last known
    std::optional<MapNumbers> numbers;
  };
  using Entries = std::map<std::string, Entry, std::less<>>;
  // What a call has to do before it has its map.
  struct Turn {
    std::shared_ptr<Map> found;
    bool open = false;            // the map, whose state is kOpening
    std::string close;            // another one, or this, whose state is kClosing
    std::shared_ptr<Map> closed;  // of that
  };

  OpenMaps(const EngineOptions& options,
           const MapStores& stores,
           const std::vector<std::string>& names);

  // Waits while the map is being opened or closed.
  absl::Status AwaitSettled(const Stop& stop, absl::string_view name) const;
  absl::StatusOr<Turn> TakeTurn(const std::string& name);
  void BeginClosing(Entry& entry, const std::string& name, Turn& turn)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  // Where there is no room, another is closed first.
  absl::Status BeginOpening(Entry& entry, const std::string& name, Turn& turn)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  absl::StatusOr<std::shared_ptr<Map>> OpenNow(const std::string& name);
  // Keeps what is known of the map before it is closed.
  void NoteClosing(const std::string& name, Map& map, bool in_doubt);
  // Of a map whose state is kClosing.
  void CloseNow(const std::string& name, std::shared_ptr<Map> map);
  // Of shared stores: a map that another engine made; whether there is one.
  absl::StatusOr<bool> Adopt(const std::string& name);
  void NoteNotOpened(const std::string& name, Entry& entry, const absl::Status& why)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  // Takes the map out, so that nobody finds it any more; its name stays taken. false: it is being
  // opened or closed, or its clock is not known.
  absl::StatusOr<bool> Withdraw(const std::string& name,
                                std::shared_ptr<Map>& map,
                                std::uint64_t& clock);
  // The one used longest ago of those that nobody uses and that have nothing to do; empty: none.
  std::string LeastUsed() const ABSL_SHARED_LOCKS_REQUIRED(mutex_);
  // Whether nobody uses it, and nobody can but by Find().
  static bool IsFree(const Entry& entry) {
    return entry.state == State::kOpen && entry.map.use_count() == 1;
  }

  bool IsSurveyed() const ABSL_SHARED_LOCKS_REQUIRED(mutex_) { return surveyed_.has_value(); }
  bool IsNotSurveying() const ABSL_SHARED_LOCKS_REQUIRED(mutex_) { return !surveying_; }
  // The thread that nobody asks: looks at all maps once, then opens and closes.
  void Loop();
  absl::Status Survey();
  // Of shared stores, whose maps others make, remove and change: once it is so long ago, and longer
  // where there are many.
  absl::Status SurveyAgain(absl::Duration age);
  void ForgetClosedBut(const std::set<std::string>& names);
  // Opens what engines that are gone left.
  void TakeAbandoned();
  // Has maps look for scans, jobs and edits that came in at other engines; whether edits did.
  bool TellOfArrivals();
  // Of jobs that engines ran that are gone.
  void ReturnDeadJobs(Map& map);
  // Deletes the map as another engine has asked.
  void RemoveAsAsked(const std::string& name);
  void Note(const std::string& name, absl::StatusOr<MapOutline> outline);
  void TakeInOrigin(const std::string& name, const MapOutline& outline);
  // Whether there was room.
  bool OpenWanted(const std::string& name);
  void OpenAllWanted();
  // Lets go what is idle, and closes what has to be opened anew.
  void CloseIdle();
  // Begins to close the next such one. False: there is none behind `after`.
  bool NextIdle(const std::string& after, Turn& turn);

  const EngineOptions options_;
  const MapStores& stores_;
  const std::shared_ptr<CacheBudget> caches_;  // of all maps
  const Stop closing_;
  // Made beforehand, for want of memory is one of the reasons to let a map go.
  const absl::Status let_go_ = absl::UnavailableError("the map was let go; ask again");
  mutable absl::Mutex mutex_;
  Entries entries_ ABSL_GUARDED_BY(mutex_);
  std::set<std::string> open_ ABSL_GUARDED_BY(mutex_);    // of kOpening, kOpen and kClosing
  std::set<std::string> wanted_ ABSL_GUARDED_BY(mutex_);  // to be opened without being asked for
  std::set<std::string> failed_ ABSL_GUARDED_BY(mutex_);  // whose `why` is not OK
  std::optional<absl::Status> surveyed_ ABSL_GUARDED_BY(mutex_);  // how the last look at all ended
  absl::Time surveyed_at_ ABSL_GUARDED_BY(mutex_) = absl::InfinitePast();
  absl::Duration survey_took_ ABSL_GUARDED_BY(mutex_);
  bool surveying_ ABSL_GUARDED_BY(mutex_) = false;       // one thread looks at all maps
  std::uint64_t maps_lost_ ABSL_GUARDED_BY(mutex_) = 0;  // to other engines, while they were open
  bool closed_ ABSL_GUARDED_BY(mutex_) = false;
  std::thread thread_;
};

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_DOORS_OPEN_MAPS_H_
