// Which maps of a database this process has to itself: rows of map_lease, which end by the
// database's clock unless they are renewed.
#ifndef STRATA_CORE_STORAGE_POSTGRESQL_MAP_LEASES_H_
#define STRATA_CORE_STORAGE_POSTGRESQL_MAP_LEASES_H_

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/time.h"

#include "core/storage/postgresql/connection.h"
#include "core/storage/storage.h"

namespace strata {

// What a server does that others on its database have to know of: it takes maps; it runs jobs of
// maps that others have.
inline constexpr char kIntegratorRole[] = "integrator";
inline constexpr char kWorkerRole[] = "worker";

struct LeaseOptions {
  // Who this process is: the same for one that ended and was started again, which gets its maps
  // back at once, and no other's. Empty: drawn at random.
  std::string holder;
  // What others say of it to people.
  std::string server;
  // What it does, with commas between; empty: it is no server, and nobody is told of it.
  std::string roles;
  // How long a lease lasts from its last renewal; renewed three times as often.
  absl::Duration time = absl::Seconds(10);
};

// One map's lease as this process knows it. Thread-safe.
class MapLease {
 public:
  MapLease(std::int64_t map, std::string name, std::int64_t token, absl::Time until)
      : map_(map), name_(std::move(name)), token_(token), until_(until) {}

  std::int64_t map() const { return map_; }
  const std::string& name() const { return name_; }
  // Drawn anew by whoever takes the map.
  std::int64_t token() const { return token_; }
  // As MapStorage::CheckHeld(). It ends here no later than in the database, however long this
  // process was frozen.
  absl::Status Check() const;

  void Renewed(absl::Time until);
  void Lost(const absl::Status& why);

 private:
  const std::int64_t map_;
  const std::string name_;
  const std::int64_t token_;
  mutable absl::Mutex mutex_;
  absl::Time until_ ABSL_GUARDED_BY(mutex_);  // by SteadyNow()
  absl::Status lost_ ABSL_GUARDED_BY(mutex_);
};

// Thread-safe.
class MapLeases {
 public:
  // Renews on a connection of its own, so that nobody's commits hold it up.
  MapLeases(std::string where, const LeaseOptions& options);
  // Gives up what is held.
  ~MapLeases();

  const std::string& holder() const { return options_.holder; }
  absl::Duration time() const { return options_.time; }
  // Whether it may take maps.
  bool takes_maps() const;

  // Tells others of this server, now and as long as it lives.
  absl::Status Announce(Connection& connection);
  // That this server takes no maps, and nobody has this one, or who has it. Never OK.
  absl::Status Refuse(Connection& connection, std::int64_t map, absl::string_view name) const;
  // OK where somebody has the map or will soon: one that nobody has is offered to those who take
  // maps. UNAVAILABLE where none lives.
  absl::Status Offer(Connection& connection, std::int64_t map, absl::string_view name) const;

  // Whose lease there is, in whatever state.
  absl::StatusOr<LastOwner> LastOwnerOf(Connection& connection, std::int64_t map) const;
  // In the open transaction of `connection`: takes the map if nobody else has it. UNAVAILABLE with
  // MapOwnerOf() and a retry delay where somebody has. Held once the transaction is committed and
  // Hold() called.
  absl::StatusOr<std::shared_ptr<MapLease>> Take(Connection& connection,
                                                 std::int64_t map,
                                                 absl::string_view name) const;
  // That the map's last server, whose lease has ended, holds its row in the middle of a commit.
  absl::Status HeldUp(absl::string_view name) const;
  // The same refusal, without taking or waiting for anything.
  absl::Status CheckFree(Connection& connection, std::int64_t map, absl::string_view name) const;
  void Hold(std::shared_ptr<MapLease> lease);
  // Soon, in the background; one that cannot be given up ends by itself.
  void GiveUp(const MapLease& lease);

 private:
  using Leases = std::vector<std::shared_ptr<MapLease>>;

  void Loop();
  bool HasToAct() const ABSL_SHARED_LOCKS_REQUIRED(mutex_) {
    return closed_ || taken_ || !given_up_.empty();
  }
  bool HasNothing(const Leases& leases) const ABSL_SHARED_LOCKS_REQUIRED(mutex_) {
    return leases.empty() && given_up_.empty() && !announced_;
  }
  absl::Status RenewServer(Connection& connection, bool leaves) const;
  absl::Status DropGivenUp(Connection& connection);
  absl::Status Renew(Connection& connection, const Leases& leases) const;
  // Of those that could not be renewed: which are another's by now.
  absl::Status NoteLost(Connection& connection, const Leases& leases) const;
  absl::StatusOr<Connection*> Connected();

  const std::string where_;
  LeaseOptions options_;
  std::unique_ptr<Connection> connection_;  // the thread's
  absl::Mutex mutex_;
  std::map<std::int64_t, std::shared_ptr<MapLease>> held_ ABSL_GUARDED_BY(mutex_);  // by token
  std::map<std::int64_t, std::int64_t> given_up_ ABSL_GUARDED_BY(mutex_);           // maps by token
  bool taken_ ABSL_GUARDED_BY(mutex_) = false;  // one that may be old already: it was waited for
  bool announced_ ABSL_GUARDED_BY(mutex_) = false;
  bool closed_ ABSL_GUARDED_BY(mutex_) = false;
  std::thread thread_;
};

// UNAVAILABLE with MapOwnerOf() while a process has the map alone.
absl::Status CheckNobodyHas(Connection& connection, std::int64_t map, absl::string_view name);

}  // namespace strata

#endif  // STRATA_CORE_STORAGE_POSTGRESQL_MAP_LEASES_H_
