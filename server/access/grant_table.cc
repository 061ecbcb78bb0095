#include "server/access/grant_table.h"

#include <utility>
#include <vector>

#include "absl/status/status.h"
#include <glog/logging.h>
#include <sys/stat.h>

#include "core/common/log_line.h"
#include "core/common/status.h"
#include "core/common/steady_time.h"
#include "server/access/token_file.h"

namespace strata::server {

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
  grants_ = std::move(grants);
  return absl::OkStatus();
}

std::shared_ptr<const Grants> GrantTable::Current() {
  absl::MutexLock lock(&mutex_);
  const absl::Duration since = SteadyNow() - looked_;
  if (since < interval_) return grants_;
  looked_ = SteadyNow();
  if (MarkOf(path_) == mark_) return grants_;
  const absl::Status loaded = Load();
  if (loaded.ok()) {
    LOG(INFO) << LogLine("tokens").Add("file", path_.string()).Add("grants", grants_->by_id.size());
  } else {
    LOG(ERROR) << LogLine("tokens").Add("file", path_.string()).Add("error", loaded.message());
  }
  return grants_;
}

}  // namespace strata::server
