// What an engine counts, for whoever watches over it.
#ifndef STRATA_CORE_ENGINE_MAP_NUMBERS_H_
#define STRATA_CORE_ENGINE_MAP_NUMBERS_H_

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/time/time.h"

#include "core/api/database.h"
#include "core/world/job.h"

namespace strata {

class StorageReader;

// What is measured of one map. Counts of what happened begin with the engine.
struct MapNumbers {
  std::string map;
  std::string owner;             // of a map in a shared store that is open here: this server's name
  std::uint64_t file_bytes = 0;  // with its journal
  std::uint64_t journal_bytes = 0;              // of that
  absl::Time verified = absl::InfinitePast();   // the last time that all was found sound
  absl::Time backed_up = absl::InfinitePast();  // the last whole backup since the engine began
  std::uint64_t scans = 0;
  std::uint64_t scans_pending = 0;  // acknowledged, not joined yet
  absl::Duration pending_age;       // of the oldest of those, since the engine began at most
  std::uint64_t scans_failed = 0;
  std::uint64_t tiles = 0;         // level of detail 0
  std::uint64_t queued_bytes = 0;  // points that wait for the disk
  std::uint64_t commits = 0;
  std::uint64_t commit_parts = 0;  // uploads and other works that they were made of
  absl::Duration commit_time;      // that they took, in all
  std::map<std::pair<std::string, JobState>, std::uint64_t> jobs;  // by kind and state
};

// Parts of them: of all jobs of a map; of its scans, and its tiles up to `tile_version`; of the
// file that it lies in, if any.
void AddJobs(const std::vector<JobInfo>& jobs, MapNumbers& numbers);
absl::Status AddContents(StorageReader& reader, std::uint64_t tile_version, MapNumbers& numbers);
void AddFileBytes(const std::filesystem::path& file, MapNumbers& numbers);

struct EngineNumbers {
  // By name: those that are open, and those that are not as they were last known; in a database
  // only those that were open once.
  std::vector<MapNumbers> maps;
  std::uint64_t maps_not_opened = 0;  // files that are damaged or of another version
  std::uint64_t maps_lost = 0;        // to other servers on the store, while they were open here
};

// Whether an engine can do its work.
struct EngineHealth {
  std::vector<std::string> maps_not_opened;  // names
  // Whose file was removed or replaced while it was open, as "NAME: what to do".
  std::vector<std::string> maps_taken_away;
  // Whose last commit failed in the store, seconds ago, as "NAME: why"; but for those that merely
  // had no room.
  std::vector<std::string> maps_not_written;
  std::uint64_t disk_bytes = 0;       // of the file system that holds the maps
  std::uint64_t disk_free_bytes = 0;  // for this process
};

// What a database is that has numbers.
class NumbersSource {
 public:
  virtual ~NumbersSource() = default;
  virtual EngineNumbers Numbers() = 0;
  virtual EngineHealth Health() = 0;
};

// `engine`: what OpenEngine returned; of another database there are none. Reads a little of every
// map: for once in some seconds. Thread-safe.
inline EngineNumbers NumbersOf(api::Database& engine) {
  auto* const source = dynamic_cast<NumbersSource*>(&engine);
  return source == nullptr ? EngineNumbers() : source->Numbers();
}

// For once a second. Thread-safe.
inline EngineHealth HealthOf(api::Database& engine) {
  auto* const source = dynamic_cast<NumbersSource*>(&engine);
  return source == nullptr ? EngineHealth() : source->Health();
}

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_MAP_NUMBERS_H_
