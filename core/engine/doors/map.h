// One map in use: its shared core, the worker that integrates scans, and the runner of its jobs.
#ifndef STRATA_CORE_ENGINE_DOORS_MAP_H_
#define STRATA_CORE_ENGINE_DOORS_MAP_H_

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "core/engine/consistency/closure_watch.h"
#include "core/engine/consistency/localizer.h"
#include "core/engine/consistency/surfaces_around.h"
#include "core/engine/ingest/unfinished_uploads.h"
#include "core/engine/ingest/worker.h"
#include "core/engine/jobs/job_board.h"
#include "core/engine/jobs/job_runner.h"
#include "core/engine/map/map_core.h"
#include "core/engine/map/map_stores.h"
#include "core/engine/map/quarantine.h"
#include "core/engine/plans/map_planner.h"
#include "core/engine/tiles/served_tiles.h"

namespace strata {

// What one opening of a map leaves to the next in the same process.
struct MapMemory {
  bool opened_before = false;
  SeenClosures seen;
};

// Thread-safe.
class Map {
 public:
  static absl::StatusOr<std::shared_ptr<Map>> Open(const std::string& name,
                                                   StoredMap stored,
                                                   const EngineOptions& options,
                                                   std::shared_ptr<CacheBudget> caches,
                                                   const MapMemory& memory = {});
  // A map in a file.
  static absl::StatusOr<std::shared_ptr<Map>> Open(const std::string& name,
                                                   const std::filesystem::path& file,
                                                   const EngineOptions& options,
                                                   std::shared_ptr<CacheBudget> caches);
  ~Map() { Close(); }

  MapCore& core() { return *core_; }
  JobBoard& jobs() { return *jobs_; }
  MapPlanner& planner() { return *planner_; }
  ServedTiles& tiles() { return *tiles_; }
  Localizer& localizer() { return *localizer_; }
  SurfacesAround& surfaces() { return *surfaces_; }
  Worker& worker() { return *worker_; }
  UnfinishedUploads& uploads() { return *uploads_; }

  // RESOURCE_EXHAUSTED while too many scans wait for integration.
  absl::Status CheckRoomForPending() const { return worker_->CheckRoom(); }
  // A scan became durable.
  void ScanCommitted(ScanNumber number) { worker_->ScanCommitted(number); }
  // Scans became durable elsewhere.
  void ScansWait() { worker_->ScansWait(); }
  // Edits up to number `until` were asked for elsewhere.
  void EditsWait(std::uint64_t until) { worker_->EditsWait(until); }
  // A job was queued.
  void JobQueued() { runner_->JobQueued(); }
  // Jobs, or this one, may have been queued or decided elsewhere.
  absl::Status TakeInJobs(std::optional<std::uint64_t> id = std::nullopt);

  // As JobBoard::ReturnDead().
  absl::Status ReturnDeadJobs(const std::set<std::string>& alive);

  // Jobs wait or run.
  bool HasJobs() const;
  // Scans or jobs wait or are under way, or what is derived has to be made again. After Close():
  // whether the next opening has them to do.
  bool HasWork() const;
  // No work, and nothing else that it does by itself is under way or due.
  bool AtRest() const;
  // For the next opening.
  MapMemory memory() const { return {true, runner_->seen()}; }

  // Ends all threads, waiting for what they do now, and closes the file. Calls that are under way
  // and need more of it end with `why`.
  void Close(const absl::Status& why = BeingClosed());

 private:
  Map() = default;

  std::unique_ptr<MapCore> core_;
  std::unique_ptr<Quarantine> quarantine_;
  std::unique_ptr<JobBoard> jobs_;
  std::unique_ptr<MapPlanner> planner_;
  std::unique_ptr<ServedTiles> tiles_;
  std::unique_ptr<Localizer> localizer_;
  std::unique_ptr<SurfacesAround> surfaces_;
  std::unique_ptr<UnfinishedUploads> uploads_;
  std::unique_ptr<Worker> worker_;
  std::unique_ptr<JobRunner> runner_;
};

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_DOORS_MAP_H_
