#include "server/access/grant_table.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include <glog/logging.h>
#include <sys/stat.h>

#include "core/common/log_line.h"
#include "core/common/status.h"
#include "core/common/steady_time.h"
#include "server/access/token_file.h"
#include "server/access/utc_text.h"

namespace strata::server {
namespace {

constexpr absl::Duration kComplaintInterval = absl::Minutes(1);

LogLine LineOf(absl::string_view change, const Grant& grant) {
  LogLine line("audit");
  line.Add("tokens", change)
      .Add("object", grant.name)
      .Add("grant", grant.id)
      .Add("by", grant.by_certificate() ? "certificate" : "token")
      .Add("rights", grant.RightsText())
      .Add("expires", grant.expires == absl::InfiniteFuture() ? "never" : UtcText(grant.expires));
  return line;
}

bool Same(const Grant& a, const Grant& b) {
  return a.name == b.name && a.secret_sha256 == b.secret_sha256 && a.maps == b.maps &&
         a.expires == b.expires;
}

}  // namespace

std::vector<LogLine> ChangesBetween(const Grants& before, const Grants& after) {
  std::vector<LogLine> lines;
  for (const auto& [id, was] : before.by_id) {
    const auto now = after.by_id.find(id);
    if (now == after.by_id.end()) {
      lines.push_back(LineOf("removed", was));
    } else if (!Same(was, now->second)) {
      lines.push_back(LineOf("changed", now->second));
      lines.back().Add("was", was.name).Add("rights_before", was.RightsText());
      if (was.secret_sha256 != now->second.secret_sha256) lines.back().Add("secret", "another");
    }
  }
  for (const auto& [id, now] : after.by_id) {
    if (!before.by_id.contains(id)) lines.push_back(LineOf("added", now));
  }
  return lines;
}

absl::StatusOr<std::unique_ptr<GrantTable>> GrantTable::Open(const std::filesystem::path& path,
                                                             absl::Duration interval) {
  std::unique_ptr<GrantTable> table(new GrantTable(path, interval));
  absl::MutexLock lock(&table->mutex_);
  STRATA_RETURN_IF_ERROR(table->Load());
  return table;
}

GrantTable::Mark GrantTable::MarkOf(const std::filesystem::path& path) {
  struct stat now {};
  if (::stat(path.c_str(), &now) != 0) return {};
  constexpr std::int64_t kNanoseconds = 1'000'000'000;
  return {now.st_ino, now.st_mtim.tv_sec * kNanoseconds + now.st_mtim.tv_nsec, now.st_size};
}

absl::Status GrantTable::Load() {
  looked_ = SteadyNow();
  mark_ = MarkOf(path_);  // before reading: what changes meanwhile is read again
  STRATA_ASSIGN_OR_RETURN(std::vector<Grant> list, ReadTokenFile(path_));
  auto grants = std::make_shared<Grants>();
  for (Grant& grant : list) {
    if (grant.by_certificate()) grants->ids_by_certificate[grant.name] = grant.id;
    grants->by_id.emplace(grant.id, std::move(grant));
  }
  if (grants_ != nullptr) {
    for (const LogLine& line : ChangesBetween(*grants_, *grants)) LOG(INFO) << line;
  }
  grants_ = std::move(grants);
  return absl::OkStatus();
}

void GrantTable::Look() {
  if (SteadyNow() - looked_ < interval_) return;
  looked_ = SteadyNow();
  const bool unread = unread_since_ != absl::InfiniteFuture();
  // What made it unreadable need not show in the mark: a mode, a limit of the process.
  if (!unread && MarkOf(path_) == mark_) return;
  if (const absl::Status loaded = Load(); !loaded.ok()) return Complain(loaded);
  unread_since_ = absl::InfiniteFuture();
  complained_ = absl::InfinitePast();
  LOG(INFO) << LogLine("tokens").Add("file", path_.string()).Add("grants", grants_->by_id.size());
}

void GrantTable::Complain(const absl::Status& status) {
  unread_since_ = std::min(unread_since_, SteadyNow());
  if (SteadyNow() - complained_ < kComplaintInterval) return;
  complained_ = SteadyNow();
  LOG(ERROR) << LogLine("tokens")
                    .Add("file", path_.string())
                    .Add("error", status.message())
                    .Add("unread_s", absl::ToInt64Seconds(SteadyNow() - unread_since_))
                    .Add("still_hold", grants_->by_id.size());
}

std::shared_ptr<const Grants> GrantTable::Current() {
  absl::MutexLock lock(&mutex_);
  Look();
  return grants_;
}

absl::Duration GrantTable::Unread() {
  absl::MutexLock lock(&mutex_);
  Look();
  return std::max(absl::ZeroDuration(), SteadyNow() - unread_since_);
}

}  // namespace strata::server
