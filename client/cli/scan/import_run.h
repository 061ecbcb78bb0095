// Scans on their way into a map, and what is said of them at the end.
#ifndef STRATA_CLIENT_CLI_SCAN_IMPORT_RUN_H_
#define STRATA_CLIENT_CLI_SCAN_IMPORT_RUN_H_

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "absl/strings/strip.h"

#include "client/cli/scan/alignment_health.h"
#include "client/cli/scan/import_sources.h"
#include "client/cli/scan/scan_uploader.h"
#include "client/cli/terminal/command.h"
#include "client/cli/terminal/json.h"

namespace strata::cli {

// What became of the files of one call.
struct ImportSummary {
  std::size_t files = 0;
  std::vector<ScanId> present;  // in the map now: uploaded or there before
  std::size_t uploaded = 0;
  std::size_t skipped = 0;
  std::uint64_t points = 0;
  std::uint64_t at_sensor = 0;                   // returns of range 0, left out
  std::size_t priors = 0;                        // of GPS, given to the pose graph
  std::uint64_t deskewed = 0, not_deskewed = 0;  // scans whose points have times
  std::uint64_t local_map_bytes = 0;             // with --local-maps
  double seconds = 0.0;
  std::size_t integrated = 0, aligned = 0, integration_failed = 0;  // with --wait
  AlignmentHealth health;                                           // likewise
  std::optional<double> level_rad;                                  // with --level
  bool interrupted = false;                                         // by the user
  Json errors = Json::array();

  // Messages about files begin with their name, about scans with "scan ID".
  void AddError(const std::string& where, absl::string_view message) {
    absl::ConsumePrefix(&message, "scan ");
    absl::ConsumePrefix(&message, where + ": ");
    errors.push_back({{"scan", where}, {"error", std::string(message)}});
  }
};

// What of the files is clear before any of them is sent.
ImportSummary Begun(const ImportSources& sources);

// Sends the scans in their order, and gives the pose graph what is known of their poses by
// themselves. May be called again for those that come later.
void Upload(Context& context,
            const ImportOptions& options,
            const std::vector<UploadSource>& sources,
            ImportSummary& summary);

// What reading the scans has counted; says which of them keep their distortion.
void TakeCounts(const ReadCounts& counts, ImportSummary& summary, Output& output);
void TalkOfMotion(const ReadCounts& counts, Output& output);

// Waits until no scan of the run is pending. They are integrated in order, so one after the other
// is asked for.
absl::Status Wait(Context& context, const ImportOptions& options, ImportSummary& summary);

// To people.
void TalkOf(const Json& errors, Output& output);
// The summary, for people and programs, and `more` of what was done.
void Print(const ImportOptions& options,
           const ImportSummary& summary,
           Output& output,
           const Json& more = Json::object());
// Not OK if there are errors.
absl::Status ErrorsOf(const Json& errors, std::size_t files);

}  // namespace strata::cli

#endif  // STRATA_CLIENT_CLI_SCAN_IMPORT_RUN_H_
