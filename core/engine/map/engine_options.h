// What an engine is opened with.
#ifndef STRATA_CORE_ENGINE_MAP_ENGINE_OPTIONS_H_
#define STRATA_CORE_ENGINE_MAP_ENGINE_OPTIONS_H_

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>

#include "absl/status/status.h"
#include "absl/time/time.h"

namespace strata {

// How long the store is left alone after an error of it (a full disk, say), until the next try.
inline constexpr absl::Duration kRetryDelay = absl::Seconds(1);

struct EngineOptions {
  // Where the maps lie, one file each; made if it is not there. Owned by one engine at a time.
  std::filesystem::path directory;
  // The database that the maps are in instead, "postgresql://USER@HOST/DATABASE"; the directory
  // then holds copies while they are sent. Empty: none. Other engines may have the same one; a map
  // is open in one of them at a time.
  std::string store;
  // What other engines on `store` tell people of this one; empty: its directory's identity.
  std::string server_name;
  // Whether it takes maps of `store`, integrates their scans and changes their tiles and poses, by
  // jobs, too. Else it answers what can be answered beside those that do. Set without `store`.
  bool integrates = true;
  // Whether it runs jobs that leave that to others: of its own maps, and on `store` of any. Set
  // without `store`.
  bool works = true;
  // How long an engine that does not answer keeps its maps from others on `store`; in [1 s, 1 h].
  absl::Duration map_lease = absl::Seconds(10);
  // Larger scans are refused.
  std::uint64_t max_points_per_scan = 100'000'000;
  // Acknowledged scans of a map that may wait for integration; more are refused until it caught up.
  std::uint64_t max_pending_scans = 100'000;
  // Bytes of points of a map that may wait for the disk; uploads block beyond it. In [1 MiB, …).
  std::size_t queue_bytes = std::size_t{64} << 20;
  // What is kept in memory of all maps together: tiles, features of scans, what planning prepares
  // and the searches under way.
  std::size_t cache_bytes = std::size_t{160} << 20;
  // Maps there may be; one more is refused with RESOURCE_EXHAUSTED.
  std::uint64_t max_maps = 10'000;
  // Maps that are open at a time, each with three threads and some files. One more is opened where
  // another one is not in use and has nothing to do; otherwise it is refused with
  // RESOURCE_EXHAUSTED. At least 1.
  std::uint64_t max_open_maps = 1'000;
  // A map that nobody has used for so long, and that has nothing to do, is let go.
  absl::Duration map_idle = absl::Minutes(5);
  // How often it looks for what nobody asks it: which maps are idle, and on `store` which scans and
  // jobs for its maps came in at other engines. Above zero. No flag of a program sets it.
  absl::Duration look_interval = absl::Seconds(1);
  // Largest size of a map's file; 0: none. Not with `store`.
  std::uint64_t max_map_bytes = 0;
  // Threads that each map uses for integration, edits, plans, the search for places and, where a
  // job says no other number, for jobs; in [1, 64]. Results do not depend on it. No flag of a
  // program sets it.
  int worker_threads = 2;
  // How long the points of an announced scan (ScanHeader::content_hash) whose stream ended stay for
  // its client to go on with; zero: not at all. What has stayed longer goes when the next stream
  // begins or ends.
  absl::Duration upload_keep = absl::Hours(1);
  // Bytes of such points a map keeps, the newest; those of streams under way are not counted.
  std::uint64_t max_kept_upload_bytes = std::uint64_t{4} << 30;
  // And so many of them.
  std::size_t max_kept_uploads = 10'000;
  // Scans integrated in one transaction when there is a backlog; at least 1. Tiles do not depend on
  // it.
  int max_batch_scans = 16;
  // After a verified closure, and at most so often, a map's poses are optimised without being
  // asked; zero: never.
  absl::Duration optimize_interval = absl::ZeroDuration();
  // Tiles that nothing has changed for so long are prepared for plans of the map's default robot
  // when its worker has nothing else to do, and kept in its file; infinite: never.
  absl::Duration prepare_after = absl::Seconds(10);
  // How the last process that had the directory ended, if not well: killed by somebody or with the
  // machine, neither by a fault of its own nor for want of memory. What was under way then is tried
  // alone, but not put aside.
  bool killed_from_outside = false;

  // INVALID_ARGUMENT naming every field out of its range.
  absl::Status Validate() const;
};

// What an engine does, as others on its store are told: "gateway,integrator,worker".
std::string RolesOf(const EngineOptions& options);

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_MAP_ENGINE_OPTIONS_H_
