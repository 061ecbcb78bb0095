// Where an engine keeps its maps: files in its directory, or a database.
#ifndef STRATA_CORE_ENGINE_MAP_MAP_STORES_H_
#define STRATA_CORE_ENGINE_MAP_MAP_STORES_H_

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"

#include "core/common/stop.h"
#include "core/engine/map/directory.h"
#include "core/engine/map/engine_options.h"
#include "core/engine/map/numbers.h"
#include "core/storage/storage.h"
#include "core/world/map_info.h"

namespace strata {

// A map's store, and where its bytes lie; an empty path: not on a disk of this machine.
struct StoredMap {
  std::unique_ptr<MapStorage> storage;
  std::filesystem::path file;
};

// What is known of a map that is not open.
struct MapOutline {
  MapInfo info;
  std::uint64_t clock = 0;  // the last commit sequence
  // Scans or jobs wait, or what is derived has to be made again.
  bool has_work = false;
  // As they are at rest, but for `map`; nullopt where they would cost much to read.
  std::optional<MapNumbers> numbers;
};

// Thread-safe. Names must be valid (ValidateName).
class MapStores {
 public:
  // An error: more is known only once the map is opened.
  using TellOutline =
      absl::FunctionRef<void(const std::string& name, absl::StatusOr<MapOutline> outline)>;

  virtual ~MapStores() = default;

  // Sorted.
  virtual absl::StatusOr<std::vector<std::string>> List() const = 0;
  // Looks at every map without opening it; what it says of one that is open meanwhile is worth
  // nothing. CANCELLED, DEADLINE_EXCEEDED by `stop`.
  virtual absl::Status Survey(const Stop& stop, TellOutline tell) const = 0;
  // All or nothing, also when the power fails. ALREADY_EXISTS. The map's clock begins behind those
  // of all maps that were removed, so that nobody takes it for one of them.
  virtual absl::Status Create(absl::string_view name,
                              const MapParameters& parameters,
                              absl::Time created) const = 0;
  // For this engine alone. UNAVAILABLE with MapOwnerOf() while another engine has it, or always
  // where EngineOptions::integrates is not set; both can be where IsShared() only.
  virtual absl::StatusOr<StoredMap> Open(absl::string_view name) const = 0;
  // Of shared ones: for reading only, whoever has it.
  virtual absl::StatusOr<std::unique_ptr<MapStorage>> OpenToRead(absl::string_view name) const {
    return absl::UnimplementedError(absl::StrCat("map ", name, ": its store is not shared"));
  }
  // Of shared ones: for what comes in here while another engine has the map alone:
  // PutScan() is RESOURCE_EXHAUSTED while `most_waiting` wait for integration, and UNAVAILABLE
  // where chunks of the scan have gone, which have to be sent again. UNAVAILABLE while nobody has
  // it alone, unless this engine takes none.
  virtual absl::StatusOr<std::unique_ptr<MapStorage>> OpenToAdd(absl::string_view name,
                                                                std::uint64_t) const {
    return absl::UnimplementedError(absl::StrCat("map ", name, ": its store is not shared"));
  }
  // For a call that waits for another engine: OK where one has the map, or will soon. UNAVAILABLE
  // where none takes it.
  virtual absl::Status CheckTaken(absl::string_view) const { return absl::OkStatus(); }
  // Of shared ones: maps that this engine has alone and in which scans, jobs or edits wait.
  virtual absl::StatusOr<std::vector<WaitingMap>> ListWaiting() const {
    return std::vector<WaitingMap>();
  }
  // Of shared ones: holders of engines that live and work; jobs that wait or run, of all maps; a
  // map for a job that is run here while another engine has it, as of PostgresMaps::OpenToWork().
  virtual absl::StatusOr<std::set<std::string>> ListWorkers() const {
    return std::set<std::string>();
  }
  virtual absl::StatusOr<std::vector<UnfinishedJob>> ListUnfinishedJobs() const {
    return std::vector<UnfinishedJob>();
  }
  virtual absl::StatusOr<StoredMap> OpenToWork(absl::string_view name,
                                               std::uint64_t,
                                               absl::string_view) const {
    return absl::UnimplementedError(absl::StrCat("map ", name, ": its store is not shared"));
  }
  // Whether other engines use the same stores: maps may come, go and change beside this one.
  virtual bool IsShared() const { return false; }
  // Of shared ones: whether the map is there; maps whose engine went without closing them.
  virtual absl::StatusOr<bool> Has(absl::string_view) const { return false; }
  virtual absl::StatusOr<std::vector<std::string>> ListAbandoned() const {
    return std::vector<std::string>();
  }
  // Of shared ones: where those of `names` that are there stand.
  virtual absl::StatusOr<std::vector<std::pair<std::string, MapClock>>> ListClocks(
      const std::vector<std::string>&) const {
    return std::vector<std::pair<std::string, MapClock>>();
  }
  // FAILED_PRECONDITION for what is no map; OK also where there is nothing.
  virtual absl::Status CheckRemovable(absl::string_view name) const = 0;
  // The map must be closed. `clock`: where it stood; 0: unknown. OK also where there is nothing.
  virtual absl::Status Delete(absl::string_view name, std::uint64_t clock) const = 0;
  // Of shared ones: as another engine asks for it by an edit, EditKind::kDeleteMap, which is over
  // with it; ABORTED where it waits no more. The rest of what was deleted so, for who has asked.
  virtual absl::Status DeleteAsAsked(absl::string_view name) const {
    return absl::UnimplementedError(absl::StrCat("map ", name, ": its store is not shared"));
  }
  virtual absl::Status FinishDeletions() const { return absl::OkStatus(); }
  // As of StoredMap, of a map that need not be there.
  virtual std::filesystem::path FileOf(absl::string_view name) const = 0;
};

// Those of options.store; `directory`, which must outlive them, is where files lie.
absl::StatusOr<std::unique_ptr<MapStores>> OpenMapStores(const EngineOptions& options,
                                                         const MapDirectory& directory);

// How an engine comes to its stores.
using OpenStores = absl::FunctionRef<absl::StatusOr<std::unique_ptr<MapStores>>(
    const EngineOptions& options, const MapDirectory& directory)>;

// A map in a file of any name.
absl::StatusOr<StoredMap> OpenMapFile(const std::filesystem::path& file,
                                      const EngineOptions& options);

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_MAP_MAP_STORES_H_
