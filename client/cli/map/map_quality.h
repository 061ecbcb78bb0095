// How good a map is, by what its scans and loops say of it.
#ifndef STRATA_CLIENT_CLI_MAP_MAP_QUALITY_H_
#define STRATA_CLIENT_CLI_MAP_MAP_QUALITY_H_

#include <cstddef>
#include <string>

#include "absl/status/statusor.h"

#include "client/cli/scan/alignment_health.h"
#include "client/cli/terminal/json.h"
#include "core/api/database.h"

namespace strata::cli {

struct MapQuality {
  AlignmentHealth alignment;            // of the scans that lie where their alignment put them
  std::size_t scans_moved_by_jobs = 0;  // the others
  std::string optimized;                // what the last optimize or revert said that succeeded
  // Relative poses that optimize found or a person gave,
  std::size_t loops_closed = 0;        // that the poses agree with,
  std::size_t loops_open = 0;          // that they are off from by more than 0.5 m or 3°,
  std::size_t loops_not_believed = 0;  // that are switched off
};

absl::StatusOr<MapQuality> QualityOf(api::Database& database,
                                     const api::Call& call,
                                     const std::string& map);

// Adds to what `map show` prints; nothing where no scan was aligned and there is no loop.
void AddQuality(const MapQuality& quality, bool for_programs, Json& json);

}  // namespace strata::cli

#endif  // STRATA_CLIENT_CLI_MAP_MAP_QUALITY_H_
