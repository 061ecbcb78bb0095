#include "client/ros2/server_link.h"

#include <cstdint>
#include <memory>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"

#include "core/common/status.h"
#include "core/common/steady_time.h"
#include "core/world/scan.h"

namespace strata::ros2 {

std::string NobodyAnswers(const std::string& server, bool scans) {
  return absl::StrCat(
      "no stratad answers at ", server, scans ? ": scans wait on disk until one does" : "");
}

ServerLink::ServerLink(const LinkOptions& options, Spool* spool, Talk& talk)
    : options_(options), spool_(spool), talk_(talk), thread_([this] { Loop(); }) {}

ServerLink::~ServerLink() {
  call_.stop.Request();
  thread_.join();
}

api::Database* ServerLink::database() const {
  absl::MutexLock lock(&mutex_);
  return database_.get();
}

Correction ServerLink::correction() const {
  absl::MutexLock lock(&mutex_);
  return correction_;
}

std::uint64_t ServerLink::changes() const {
  absl::MutexLock lock(&mutex_);
  return changes_;
}

void ServerLink::Pause() {
  const absl::Time until = SteadyNow() + kRetryAfter;
  while (SteadyNow() < until && !call_.stop.requested()) absl::SleepFor(absl::Milliseconds(20));
}

absl::Status ServerLink::Connected() {
  absl::StatusOr<std::unique_ptr<api::Database>> database = Connect(options_.client);
  if (!database.ok()) return database.status();
  if (spool_ != nullptr) sender_ = std::make_unique<SpoolSender>(*spool_, **database);
  absl::MutexLock lock(&mutex_);
  database_ = *std::move(database);
  return absl::OkStatus();
}

void ServerLink::Loop() {
  while (!call_.stop.requested()) {
    absl::Status status = database() == nullptr ? Connected() : absl::OkStatus();
    if (status.ok()) {
      api::WatchOptions watch;
      watch.trajectory = options_.trajectory;
      status = database()->maps().Watch(
          call_, options_.map, watch, [this](const api::MapUpdate& update) {
            return Take(update);
          });
    }
    if (call_.stop.requested()) break;
    talk_.SayNew("server", WhyWaiting(status));
    Pause();
  }
  sender_.reset();
}

std::string ServerLink::WhyWaiting(const absl::Status& status) const {
  if (absl::IsUnavailable(status)) {
    return NobodyAnswers(options_.server.server, spool_ != nullptr);
  }
  if (absl::IsNotFound(status)) {
    return absl::StrCat(status.message(),
                        "; make it: strata map create ",
                        options_.map,
                        spool_ != nullptr ? "; scans wait on disk" : "");
  }
  return std::string(cli::Explained(status, options_.server).message());
}

absl::Status ServerLink::Take(const api::MapUpdate& update) {
  talk_.SayNew("server", absl::StrCat("map ", options_.map, " at ", options_.server.server));
  const api::ScanChange* newest = nullptr;
  if (update.whole) newest_.reset();
  for (const api::ScanChange& scan : update.scans) {
    if (scan.gone || scan.state != ScanState::kIntegrated) continue;
    if (newest_.has_value() && scan.id.sequence < *newest_) continue;
    newest = &scan;
    newest_ = scan.id.sequence;
  }
  Correction correction;
  if (newest != nullptr) {
    const absl::StatusOr<ScanInfo> info = database()->scans().Get(call_, options_.map, newest->id);
    // Deleted since: the next update says so.
    if (!info.ok() && !absl::IsNotFound(info.status())) return info.status();
    if (info.ok()) {
      correction = {absl::ToUnixNanos(info->header.time),
                    Normalized(newest->T_map_scan * info->header.T_map_scan.inverse())};
    }
  }
  absl::MutexLock lock(&mutex_);
  if (newest != nullptr) correction_ = correction;
  if (update.whole || update.inferred || !update.tiles.empty()) ++changes_;
  return absl::OkStatus();
}

}  // namespace strata::ros2
