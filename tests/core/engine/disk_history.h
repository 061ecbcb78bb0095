// A short life of a map, step by step, and what a reader can tell of the map after each: what disk
// faults are held against.
#ifndef STRATA_TESTS_CORE_ENGINE_DISK_HISTORY_H_
#define STRATA_TESTS_CORE_ENGINE_DISK_HISTORY_H_

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

#include "core/api/database.h"
#include "core/engine/engine.h"
#include "core/world/job.h"
#include "core/world/map_info.h"

namespace strata::testing {

inline constexpr char kHistoryMap[] = "yard";

// Says whether waiting is in vain: nothing will come of what is under way. Asked while a step
// waits; never, where it is empty.
using Hopeless = std::function<bool()>;

// A step that is not gradual is whole or has not happened when it fails. It may be repeated until
// it succeeds, and then has happened once.
struct HistoryStep {
  std::string name;
  std::function<absl::Status(api::Database&, const Hopeless&)> run;
  bool changes = true;   // what a reader can tell
  bool gradual = false;  // scan by scan: when it fails, some may be done
};

// Makes the map; uploads scans, one of them broken off and gone on with; moves, labels and deletes
// scans; sets profile, class and constraint; trains, classifies, optimises and fades; makes a
// backup and watches.
const std::vector<HistoryStep>& DiskHistory();

// What the map says of itself, thing by thing: scans with their points, labels, poses and faded
// points, profiles, classes, classifiers, constraints, served tiles, content digest. Without
// numbers that depend on how often a step was tried. Empty where there is no such map. A thing that
// cannot be read is its error.
using WorldState = std::map<std::string, std::string>;
WorldState Observe(api::Database& database);
// What differs between the two, in one line.
std::string Difference(const WorldState& expected, const WorldState& found);

// Waits until no scan is pending and no job under way. UNAVAILABLE where that is hopeless;
// DEADLINE_EXCEEDED after a minute.
absl::Status Settle(api::Database& database, const Hopeless& hopeless = {});
// Runs a job to its end; one that fails is INTERNAL with its message.
absl::Status RunToEnd(api::Database& database,
                      const std::string& kind,
                      const JobParameters& parameters = {},
                      const Hopeless& hopeless = {});
// Verify succeeds, and a rebuild changes nothing of the state.
absl::Status CheckSound(api::Database& database);
// The digest of a new map that is given the scans of this one, at their poses and without what has
// faded, in place of this map's.
absl::StatusOr<std::string> FreshDigest(api::Database& database);

// Whether a call may answer so while its disk is in trouble.
bool IsTroubleOfDisk(const absl::Status& status);

// Of the yard; other parameters have their defaults.
MapParameters ParametersOfYard();
// Scan `i` of the yard as "robot/i", announced.
absl::Status UploadScan(api::Database& database, std::uint64_t i);
// Half of its points come, then the client goes; nothing is promised of them.
absl::Status BreakOff(api::Database& database, std::uint64_t i);
// How many of them are there to go on with.
absl::StatusOr<std::uint64_t> PointsHeld(api::Database& database, std::uint64_t i);

EngineOptions HistoryOptions(const std::filesystem::path& directory);

}  // namespace strata::testing

#endif  // STRATA_TESTS_CORE_ENGINE_DISK_HISTORY_H_
