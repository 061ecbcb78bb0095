#include "core/storage/postgresql/map_leases.h"

#include <algorithm>
#include <cstdint>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "absl/algorithm/container.h"
#include "absl/random/random.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "absl/strings/string_view.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/time.h"

#include "core/common/guarded.h"
#include "core/common/map_owner.h"
#include "core/common/retry_delay.h"
#include "core/common/status.h"
#include "core/common/steady_time.h"
#include "core/common/this_thread.h"
#include "core/storage/outcome.h"

namespace strata {
namespace {

constexpr absl::Duration kRetry = absl::Seconds(1);

std::int64_t RandomToken() {
  absl::BitGen random;
  return absl::Uniform<std::int64_t>(random, 1, std::int64_t{1} << 62);
}

// Who has a map that is offered to those who take maps; empty: no process.
constexpr char kNobody[] = "";

absl::Status OpenNowhere(absl::string_view name, absl::string_view why) {
  return WithRetryDelay(
      WithMapOwner(absl::UnavailableError(absl::StrCat("map ", name, " is open in no server", why)),
                   "nobody"),
      kRetry);
}

absl::StatusOr<bool> AnyTakesMaps(Connection& connection) {
  STRATA_ASSIGN_OR_RETURN(
      Rows row,
      connection.Query("SELECT EXISTS (SELECT FROM map_server WHERE expires > clock_timestamp() "
                       "AND $1 = ANY (string_to_array(roles, ',')))",
                       absl::string_view(kIntegratorRole)));
  row.Next();
  return row.Bool(0);
}

absl::Status HeldBy(absl::string_view name, absl::string_view server) {
  return WithRetryDelay(
      WithMapOwner(absl::UnavailableError(absl::StrCat(
                       "map ", name, " is in use by server ", server, " on the same store")),
                   server),
      kRetry);
}

}  // namespace

absl::Status MapLease::Check() const {
  absl::MutexLock lock(&mutex_);
  if (!lost_.ok()) return lost_;
  if (SteadyNow() < until_) return absl::OkStatus();
  return WithRetryDelay(
      absl::UnavailableError(absl::StrCat("map ",
                                          name_,
                                          ": the store was not reached for longer than this "
                                          "server's lease of it lasts; another may have it")),
      kRetry);
}

void MapLease::Renewed(absl::Time until) {
  absl::MutexLock lock(&mutex_);
  until_ = until;
}

void MapLease::Lost(const absl::Status& why) {
  absl::MutexLock lock(&mutex_);
  if (lost_.ok()) lost_ = why;
}

absl::Status CheckNobodyHas(Connection& connection, std::int64_t map, absl::string_view name) {
  STRATA_ASSIGN_OR_RETURN(
      Rows row,
      connection.Query(
          "SELECT server FROM map_lease WHERE map = $1 AND expires > clock_timestamp()", map));
  return row.Next() ? HeldBy(name, row.Text(0)) : absl::OkStatus();
}

MapLeases::MapLeases(std::string where, const LeaseOptions& options)
    : where_(std::move(where)), options_(options) {
  if (options_.holder.empty()) options_.holder = absl::StrCat(RandomToken());
  if (options_.server.empty()) options_.server = options_.holder;
  thread_ = std::thread([this] { Loop(); });
}

MapLeases::~MapLeases() {
  {
    absl::MutexLock lock(&mutex_);
    for (const auto& [token, lease] : held_) given_up_.emplace(token, lease->map());
    held_.clear();
    closed_ = true;
  }
  thread_.join();
}

bool MapLeases::takes_maps() const {
  return options_.roles.empty() ||
         absl::c_linear_search(std::vector<std::string>(absl::StrSplit(options_.roles, ',')),
                               kIntegratorRole);
}

absl::Status MapLeases::RenewServer(Connection& connection, bool leaves) const {
  if (leaves) {
    return connection.Change("DELETE FROM map_server WHERE holder = $1", options_.holder).status();
  }
  return connection
      .Change(
          "INSERT INTO map_server AS s (holder, server, roles, expires) VALUES ($1, $2, $3, "
          "clock_timestamp() + $4 * interval '1 second') ON CONFLICT (holder) DO UPDATE SET server "
          "= $2, roles = $3, expires = excluded.expires",
          options_.holder,
          options_.server,
          options_.roles,
          absl::ToDoubleSeconds(options_.time))
      .status();
}

// Those that died are shown for a day.
absl::Status MapLeases::Announce(Connection& connection) {
  if (options_.roles.empty()) return absl::OkStatus();
  STRATA_RETURN_IF_ERROR(connection.Execute(
      "DELETE FROM map_server WHERE expires < clock_timestamp() - interval '1 day'"));
  STRATA_RETURN_IF_ERROR(RenewServer(connection, /*leaves=*/false));
  absl::MutexLock lock(&mutex_);
  announced_ = true;
  return absl::OkStatus();
}

absl::Status MapLeases::Refuse(Connection& connection,
                               std::int64_t map,
                               absl::string_view name) const {
  STRATA_RETURN_IF_ERROR(CheckNobodyHas(connection, map, name));
  return OpenNowhere(name, ", and this one takes none (--role)");
}

// The lease of nobody ended long ago: whoever takes maps finds it as that of a server that died.
absl::Status MapLeases::Offer(Connection& connection,
                              std::int64_t map,
                              absl::string_view name) const {
  const absl::Status held = CheckNobodyHas(connection, map, name);
  if (MapOwnerOf(held).has_value()) return absl::OkStatus();
  STRATA_RETURN_IF_ERROR(held);
  STRATA_RETURN_IF_ERROR(
      connection
          .Change("INSERT INTO map_lease (map, token, holder, server, expires) SELECT $1, 0, $2, "
                  "'nobody', to_timestamp(0) WHERE EXISTS (SELECT FROM map_place WHERE map = $1) "
                  "ON CONFLICT DO NOTHING",
                  map,
                  absl::string_view(kNobody))
          .status());
  STRATA_ASSIGN_OR_RETURN(const bool any, AnyTakesMaps(connection));
  if (any) return absl::OkStatus();
  return OpenNowhere(
      name,
      absl::StrCat(", and none on this store takes maps: start one with --role ", kIntegratorRole));
}

absl::Status MapLeases::CheckFree(Connection& connection,
                                  std::int64_t map,
                                  absl::string_view name) const {
  STRATA_ASSIGN_OR_RETURN(
      Rows row,
      connection.Query("SELECT server FROM map_lease WHERE map = $1 AND holder <> $2 AND expires > "
                       "clock_timestamp()",
                       map,
                       options_.holder));
  return row.Next() ? HeldBy(name, row.Text(0)) : absl::OkStatus();
}

absl::StatusOr<LastOwner> MapLeases::LastOwnerOf(Connection& connection, std::int64_t map) const {
  STRATA_ASSIGN_OR_RETURN(
      Rows row, connection.Query("SELECT holder FROM map_lease WHERE map = $1 FOR UPDATE", map));
  if (!row.Next() || row.Text(0) == kNobody) return LastOwner::kNobody;
  return row.Text(0) == options_.holder ? LastOwner::kSelf : LastOwner::kOther;
}

// Whoever is second waits for the first one's row, and then finds that it has not expired.
absl::StatusOr<std::shared_ptr<MapLease>> MapLeases::Take(Connection& connection,
                                                          std::int64_t map,
                                                          absl::string_view name) const {
  const absl::Time until = SteadyNow() + options_.time;
  const std::int64_t token = RandomToken();
  STRATA_ASSIGN_OR_RETURN(
      const std::uint64_t taken,
      connection.Change(
          "INSERT INTO map_lease AS l (map, token, holder, server, expires) VALUES ($1, $2, $3, "
          "$4, clock_timestamp() + $5 * interval '1 second') ON CONFLICT (map) DO UPDATE SET token "
          "= $2, holder = $3, server = $4, expires = clock_timestamp() + $5 * interval '1 second' "
          "WHERE l.expires <= clock_timestamp() OR l.holder = $3",
          map,
          token,
          options_.holder,
          options_.server,
          absl::ToDoubleSeconds(options_.time)));
  if (taken > 0) return std::make_shared<MapLease>(map, std::string(name), token, until);
  STRATA_RETURN_IF_ERROR(CheckFree(connection, map, name));
  return HeldBy(name, "that has just left");
}

absl::Status MapLeases::HeldUp(absl::string_view name) const {
  return WithRetryDelay(
      WithMapOwner(absl::UnavailableError(absl::StrCat(
                       "map ",
                       name,
                       ": its last server does not answer and is in the middle of a commit, which "
                       "the database ends soon")),
                   "that does not answer"),
      kRetry);
}

void MapLeases::Hold(std::shared_ptr<MapLease> lease) {
  absl::MutexLock lock(&mutex_);
  const std::int64_t token = lease->token();
  held_[token] = std::move(lease);
  taken_ = true;
}

void MapLeases::GiveUp(const MapLease& lease) {
  absl::MutexLock lock(&mutex_);
  if (held_.erase(lease.token()) > 0) given_up_.emplace(lease.token(), lease.map());
}

absl::StatusOr<Connection*> MapLeases::Connected() {
  if (connection_ != nullptr && connection_->IsFresh()) return connection_.get();
  connection_.reset();
  STRATA_ASSIGN_OR_RETURN(connection_, Connection::Open(where_));
  return connection_.get();
}

absl::Status MapLeases::DropGivenUp(Connection& connection) {
  std::vector<std::int64_t> maps;
  std::vector<std::int64_t> tokens;
  {
    absl::MutexLock lock(&mutex_);
    for (const auto& [token, map] : given_up_) {
      maps.push_back(map);
      tokens.push_back(token);
    }
    given_up_.clear();  // tried once
  }
  if (maps.empty()) return absl::OkStatus();
  return connection
      .Change("DELETE FROM map_lease WHERE map = ANY ($1) AND token = ANY ($2)", maps, tokens)
      .status();
}

// Rows that somebody holds who would take them are left out: one slow map must not cost the others
// their leases.
absl::Status MapLeases::Renew(Connection& connection, const Leases& leases) const {
  if (leases.empty()) return absl::OkStatus();
  std::vector<std::int64_t> maps;
  std::vector<std::int64_t> tokens;
  for (const auto& lease : leases) {
    maps.push_back(lease->map());
    tokens.push_back(lease->token());
  }
  const absl::Time until = SteadyNow() + options_.time;
  STRATA_ASSIGN_OR_RETURN(
      Rows row,
      connection.Query(
          "UPDATE map_lease SET expires = clock_timestamp() + $3 * interval '1 second' WHERE map "
          "IN (SELECT map FROM map_lease WHERE map = ANY ($1) AND token = ANY ($2) FOR UPDATE SKIP "
          "LOCKED) AND token = ANY ($2) RETURNING token",
          maps,
          tokens,
          absl::ToDoubleSeconds(options_.time)));
  std::set<std::int64_t> renewed;
  while (row.Next()) renewed.insert(row.Int(0));
  Leases others;
  for (const auto& lease : leases) {
    if (renewed.contains(lease->token())) {
      lease->Renewed(until);
    } else {
      others.push_back(lease);
    }
  }
  return others.empty() ? absl::OkStatus() : NoteLost(connection, others);
}

absl::Status MapLeases::NoteLost(Connection& connection, const Leases& leases) const {
  std::vector<std::int64_t> maps;
  for (const auto& lease : leases) maps.push_back(lease->map());
  STRATA_ASSIGN_OR_RETURN(
      Rows row,
      connection.Query("SELECT map, token, server FROM map_lease WHERE map = ANY ($1)", maps));
  std::map<std::int64_t, std::pair<std::int64_t, std::string>> now;
  while (row.Next()) now[row.Int(0)] = {row.Int(1), std::string(row.Text(2))};
  for (const auto& lease : leases) {
    const auto found = now.find(lease->map());
    if (found != now.end() && found->second.first == lease->token()) continue;  // it is held up
    const absl::Status taken = TakenAway(
        absl::StrCat("map ", lease->name(), ": this server's lease of it ended, and was taken"));
    lease->Lost(found == now.end() ? taken : WithMapOwner(taken, found->second.second));
  }
  return absl::OkStatus();
}

void MapLeases::Loop() {
  NameThisThread("leases");
  while (true) {
    Leases leases;
    bool closed = false;
    bool announced = false;
    {
      absl::MutexLock lock(&mutex_);
      mutex_.AwaitWithTimeout(absl::Condition(this, &MapLeases::HasToAct), options_.time / 3);
      for (const auto& [token, lease] : held_) leases.push_back(lease);
      closed = closed_;
      taken_ = false;
      announced = announced_;
      if (HasNothing(leases)) {
        if (closed) return;
        continue;
      }
    }
    // What fails is tried again in its time; until then the leases say themselves that they end.
    const absl::Status done = Guarded([&, this]() -> absl::Status {
      STRATA_ASSIGN_OR_RETURN(Connection* const connection, Connected());
      STRATA_RETURN_IF_ERROR(Renew(*connection, leases));
      STRATA_RETURN_IF_ERROR(DropGivenUp(*connection));
      return announced ? RenewServer(*connection, closed) : absl::OkStatus();
    });
    if (closed) return;
    if (done.ok()) continue;
    absl::MutexLock lock(&mutex_);
    mutex_.AwaitWithTimeout(absl::Condition(&closed_), std::min(kRetry, options_.time / 3));
  }
}

}  // namespace strata
