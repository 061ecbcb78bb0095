#include "core/engine/doors/map.h"

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "core/common/status.h"
#include "core/engine/repair/rebuild.h"

namespace strata {

namespace {

// Whether the process may have died that had the map before.
bool MayHaveDied(const MapCore& core, const MapMemory& memory) {
  switch (core.last_owner()) {
    case LastOwner::kNobody:
      return false;
    case LastOwner::kSelf:
      return !memory.opened_before;
    case LastOwner::kOther:
      break;
  }
  return true;
}

}  // namespace

absl::StatusOr<std::shared_ptr<Map>> Map::Open(const std::string& name,
                                               const std::filesystem::path& file,
                                               const EngineOptions& options,
                                               std::shared_ptr<CacheBudget> caches) {
  STRATA_ASSIGN_OR_RETURN(StoredMap stored, OpenMapFile(file, options));
  return Open(name, std::move(stored), options, std::move(caches));
}

absl::StatusOr<std::shared_ptr<Map>> Map::Open(const std::string& name,
                                               StoredMap stored,
                                               const EngineOptions& options,
                                               std::shared_ptr<CacheBudget> caches,
                                               const MapMemory& memory) {
  std::shared_ptr<Map> map(new Map());
  STRATA_ASSIGN_OR_RETURN(map->core_,
                          MapCore::Open(name, std::move(stored), options, std::move(caches)));
  STRATA_ASSIGN_OR_RETURN(map->quarantine_,
                          Quarantine::Open(*map->core_, MayHaveDied(*map->core_, memory)));
  STRATA_ASSIGN_OR_RETURN(map->jobs_, JobBoard::Open(*map->core_, *map->quarantine_));
  STRATA_ASSIGN_OR_RETURN(map->uploads_, UnfinishedUploads::Open(*map->core_));
  std::uint64_t pending = 0;
  {
    STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, map->core_->Reader());
    STRATA_ASSIGN_OR_RETURN(const ScanTotals totals, reader->GetScanTotals());
    pending = totals.pending;
  }
  map->planner_ = std::make_unique<MapPlanner>(
      name, map->core_->info().parameters, map->core_->options(), map->core_->caches());
  map->tiles_ = std::make_unique<ServedTiles>(*map->core_);
  map->localizer_ = std::make_unique<Localizer>(ScanAccess(*map->core_));
  map->surfaces_ = std::make_unique<SurfacesAround>(
      map->core_->info().parameters, map->core_->caches(), map->tiles_.get());
  map->worker_ = std::make_unique<Worker>(*map->core_, *map->quarantine_, &RecoverDerived, pending);
  map->runner_ = std::make_unique<JobRunner>(
      *map->core_, *map->quarantine_, *map->jobs_, *map->worker_, memory.seen);
  return map;
}

absl::Status Map::TakeInJobs(std::optional<std::uint64_t> id) {
  STRATA_ASSIGN_OR_RETURN(const bool any, jobs_->TakeIn(id));
  if (any) runner_->JobQueued();
  return absl::OkStatus();
}

absl::Status Map::ReturnDeadJobs(const std::set<std::string>& alive) {
  STRATA_RETURN_IF_ERROR(jobs_->ReturnDead(alive));
  if (jobs_->NextId().has_value()) runner_->JobQueued();
  return absl::OkStatus();
}

bool Map::HasJobs() const {
  return jobs_->AnyIn(JobState::kQueued) || jobs_->AnyIn(JobState::kRunning);
}

bool Map::HasWork() const { return worker_->HasWork() || HasJobs(); }

bool Map::AtRest() const { return !HasWork() && worker_->AtRest() && runner_->AtRest(); }

void Map::Close(const absl::Status& why) {
  if (runner_ != nullptr) runner_->Close();
  if (worker_ != nullptr) worker_->Close(why);
  if (core_ != nullptr) core_->Close(why);
}

}  // namespace strata
