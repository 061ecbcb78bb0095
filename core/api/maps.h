// Maps: create, find, measure and delete whole worlds.
#ifndef STRATA_CORE_API_MAPS_H_
#define STRATA_CORE_API_MAPS_H_

#include <cstdint>
#include <string>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"

#include "core/api/call.h"
#include "core/mls/tile_key.h"
#include "core/world/epoch.h"
#include "core/world/map_class.h"
#include "core/world/map_info.h"
#include "core/world/scan.h"

namespace strata::api {

// How often changes of a map that another engine has are looked for.
inline constexpr absl::Duration kWatchLag = absl::Milliseconds(250);

// From where a map is watched.
struct WatchOptions {
  // Changes after this commit sequence. What happened long ago, before the server's last start, or
  // in another map of that name that was deleted cannot be told: the state comes as a whole then.
  // 0: it does at once, as it must after somebody put back an older file of the map.
  std::uint64_t since = 0;
  std::uint64_t epoch = 0;  // that the watcher knows; another one is announced with its reason
  std::string trajectory;   // scans of this one only; empty: of all
  bool tiles = true;        // false: scans and epochs only
  bool once = false;        // end when there is nothing newer
  // For those who look again and again: how old what they are told may be where another engine has
  // the map. Whoever looks first sees what is there.
  absl::Duration lag = absl::ZeroDuration();
};

// Where a scan is now; a scan that was deleted is `gone`.
struct ScanChange {
  ScanId id;
  ScanState state = ScanState::kPending;
  Pose T_map_scan = Pose::Identity();
  bool gone = false;
};

// A tile of level 0 that is another now.
struct TileChangeNotice {
  TileKey key;
  std::uint64_t version = 0;
  bool gone = false;
};

// What changed since the message before. Poses and tiles are of `epoch`.
struct MapUpdate {
  // `scans` and `tiles` are all there are: what the watcher knew before is void.
  bool whole = false;
  std::uint64_t commit_sequence = 0;  // resume from here
  std::uint64_t epoch = 0;
  std::string epoch_reason;  // set when the watcher knew an epoch and this is another
  std::vector<ScanChange> scans;
  std::vector<TileChangeNotice> tiles;
  // What Objects::ListInferred() gives may be another than before the update. Not set where all is
  // void.
  bool inferred = false;
};

// A part of a map's backup, in order.
struct BackupPiece {
  std::string bytes;              // at most 1 MiB
  std::uint64_t total_bytes = 0;  // of the whole
  std::string content_hash;       // of the whole, with the last piece: XXH3-128, hexadecimal
};

// Thread-safe. An unknown map is NOT_FOUND in every call of every interface.
class Maps {
 public:
  virtual ~Maps() = default;

  // INVALID_ARGUMENT for a bad name or parameter; ALREADY_EXISTS.
  virtual absl::StatusOr<MapInfo> Create(const Call& call,
                                         absl::string_view name,
                                         const MapParameters& parameters) = 0;
  virtual absl::StatusOr<MapInfo> Get(const Call& call, absl::string_view name) = 0;
  // By name.
  virtual absl::StatusOr<std::vector<MapInfo>> List(const Call& call) = 0;
  // Deletes the map and its file; a job that runs on it ends. FAILED_PRECONDITION for a file of
  // that name that is no map.
  virtual absl::Status Delete(const Call& call, absl::string_view name) = 0;
  virtual absl::StatusOr<MapStats> Stats(const Call& call, absl::string_view name) = 0;
  // The epochs, newest first.
  virtual absl::StatusOr<std::vector<EpochInfo>> History(const Call& call,
                                                         absl::string_view name) = 0;
  // The classes that have a name, by id.
  virtual absl::StatusOr<std::vector<MapClass>> ListClasses(const Call& call,
                                                            absl::string_view name) = 0;
  // Names a class, or gives it another name or colour. INVALID_ARGUMENT (ValidateMapClass);
  // ALREADY_EXISTS where another id has the name.
  virtual absl::Status SetClass(const Call& call,
                                absl::string_view name,
                                const MapClass& map_class) = 0;
  // Says where the map's origin is on earth; its coordinates stay. INVALID_ARGUMENT
  // (ValidateGeodeticOrigin).
  virtual absl::Status SetOrigin(const Call& call,
                                 absl::string_view name,
                                 const GeodeticOrigin& origin) = 0;
  // Delivers what changes until the call is stopped, or, with `once`, what has changed. The first
  // message comes at once, even if it says nothing but where the map stands. A sink's error ends
  // the stream and is handed back.
  virtual absl::Status Watch(const Call& call,
                             absl::string_view name,
                             const WatchOptions& options,
                             absl::FunctionRef<absl::Status(const MapUpdate&)> sink) = 0;
  // Delivers the file of the map as it is at one moment, with every scan that was acknowledged
  // before the call; uploads go on meanwhile. The server's disk holds a copy until it is delivered.
  // RESOURCE_EXHAUSTED while another backup of the map runs and for a full disk; DATA_LOSS if the
  // file cannot be read, or if what arrived is not what was sent. A sink's error ends the stream
  // and is handed back.
  virtual absl::Status Backup(const Call& call,
                              absl::string_view name,
                              absl::FunctionRef<absl::Status(const BackupPiece&)> sink) = 0;
};

}  // namespace strata::api

#endif  // STRATA_CORE_API_MAPS_H_
