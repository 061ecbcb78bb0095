#include "client/cli/scan/import_run.h"

#include <algorithm>
#include <cstddef>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/string_view.h"
#include "absl/time/clock.h"

#include "client/cli/terminal/patience.h"
#include "client/cli/terminal/progress.h"
#include "core/common/status.h"
#include "core/common/steady_time.h"

namespace strata::cli {
namespace {

constexpr int kWorkers = 4;
// Scans of which the same is told one by one.
constexpr std::size_t kSaidAlike = 3;

// What is known of a scan's pose by itself, for optimize to weigh.
absl::Status AddPrior(Context& context,
                      const ImportOptions& options,
                      const UploadSource& source,
                      ImportSummary& summary) {
  if (!source.pose_information.has_value()) return absl::OkStatus();
  Constraint prior;
  prior.j = source.header.id;
  prior.T_i_j = source.header.T_map_scan;
  prior.information = *source.pose_information;
  prior.may_be_false = true;
  prior.note = absl::StrCat("by GPS, from ", options.poses.substr(0, 500));
  STRATA_RETURN_IF_ERROR(
      context.database.posegraph().AddConstraint(context.call, options.map, prior).status());
  ++summary.priors;
  return absl::OkStatus();
}

// Where a scan that is not integrated for this long is said to be stuck.
constexpr absl::Duration kStuck = absl::Minutes(1);

// The scan once it is no longer pending. A server that is away may come back: it goes on by itself.
absl::StatusOr<ScanInfo> AwaitScan(Context& context,
                                   const std::string& map,
                                   const ScanId& id,
                                   const std::function<void()>& idle) {
  Patience patience;
  absl::Duration pause = absl::Milliseconds(10);
  while (true) {
    absl::StatusOr<ScanInfo> info = context.database.scans().Get(context.call, map, id);
    if (info.ok() && info->state != ScanState::kPending) return info;
    if (!patience.Has(info.status())) return info;
    STRATA_RETURN_IF_ERROR(context.call.stop.status());
    idle();
    absl::SleepFor(pause);
    pause = std::min(2 * pause, absl::Milliseconds(300));
  }
}

constexpr absl::string_view kDoubtful =
    "the poses are probably those of other scans, or far off; see 'map render', and 'map delete' "
    "to begin again with other --poses";

}  // namespace

ImportSummary Begun(const ImportSources& sources) {
  ImportSummary summary;
  summary.files = sources.files;
  summary.skipped = sources.there.size();
  summary.present = sources.there;
  summary.level_rad = sources.level_rad;
  for (const auto& [file, message] : sources.errors) summary.AddError(file, message);
  return summary;
}

void Upload(Context& context,
            const ImportOptions& options,
            const std::vector<UploadSource>& sources,
            ImportSummary& summary) {
  Progress progress(context.output.talk(), TalksToTerminal(), "uploading");
  const absl::Time start = SteadyNow();
  std::vector<UploadResult> results =
      UploadScans(context.database,
                  context.call,
                  options.map,
                  sources,
                  kWorkers,
                  [&](const UploadProgress& done) {
                    progress.Update(done.scans, sources.size(), done.points);
                  });
  progress.Clear();
  summary.seconds += absl::ToDoubleSeconds(SteadyNow() - start);
  summary.interrupted = context.call.stop.requested();
  for (std::size_t i = 0; i < sources.size(); ++i) {
    if (results[i].status.ok() && results[i].pose_as_said) {
      results[i].status = AddPrior(context, options, sources[i], summary);
    }
    if (summary.interrupted && absl::IsCancelled(results[i].status)) {
      continue;  // not sent
    }
    if (!results[i].status.ok()) {
      summary.AddError(sources[i].file, results[i].status.message());
      continue;
    }
    ++summary.uploaded;
    summary.points += results[i].points;
    summary.local_map_bytes += results[i].local_map_bytes;
    summary.present.push_back(sources[i].header.id);
  }
}

void TalkOfMotion(const ReadCounts& counts, Output& output) {
  if (counts.not_deskewed() == 0) return;
  output.Talk(absl::StrCat("warning: ",
                           counts.not_deskewed(),
                           " scan(s) keep the distortion of their motion; the first: ",
                           counts.why_not()));
}

void TakeCounts(const ReadCounts& counts, ImportSummary& summary, Output& output) {
  summary.at_sensor = counts.at_sensor;
  summary.deskewed = counts.deskewed;
  summary.not_deskewed = counts.not_deskewed();
  TalkOfMotion(counts, output);
}

absl::Status Wait(Context& context, const ImportOptions& options, ImportSummary& summary) {
  Progress progress(context.output.talk(), TalksToTerminal(), "integrating");
  std::sort(summary.present.begin(), summary.present.end());
  absl::Time moved = SteadyNow();
  for (std::size_t i = 0; i < summary.present.size(); ++i) {
    const auto idle = [&] {
      progress.Update(i, summary.present.size(), 0);
      if (SteadyNow() - moved < kStuck) return;
      progress.Clear();
      context.output.Talk(absl::StrCat("no scan integrated for ",
                                       absl::FormatDuration(kStuck),
                                       "; the log of stratad says why (is its disk full?)"));
      moved = SteadyNow();
    };
    STRATA_ASSIGN_OR_RETURN(const ScanInfo info,
                            AwaitScan(context, options.map, summary.present[i], idle));
    moved = SteadyNow();
    if (info.state == ScanState::kFailed) {
      ++summary.integration_failed;
      summary.AddError(summary.present[i].ToString(), info.message);
      continue;
    }
    ++summary.integrated;
    summary.aligned += info.alignment.aligned ? 1 : 0;
    summary.health.Add(info);
    if (!info.message.empty()) {
      progress.Clear();
      context.output.Talk(absl::StrCat(summary.present[i].ToString(), ": ", info.message));
    }
  }
  return absl::OkStatus();
}

void TalkOf(const Json& errors, Output& output) {
  std::map<std::string, std::size_t> said;
  for (const Json& error : errors) {
    const auto message = error["error"].get<std::string>();
    if (++said[message] > kSaidAlike) continue;
    output.Talk(absl::StrCat("error: ", error["scan"].get<std::string>(), ": ", message));
  }
  for (const auto& [message, times] : said) {
    if (times <= kSaidAlike) continue;
    output.Talk(absl::StrCat("error: ", times - kSaidAlike, " scans more: ", message));
  }
}

void Print(const ImportOptions& options,
           const ImportSummary& summary,
           Output& output,
           const Json& more) {
  Json json = {
      {"map", options.map},
      {"trajectory", options.trajectory},
      {"files", summary.files},
      {"uploaded", summary.uploaded},
      {"skipped", summary.skipped},
      {"failed", summary.errors.size()},
      {"points", summary.points},
      {"range_0", summary.at_sensor},
      {"gps_priors", summary.priors},
      {"deskewed", summary.deskewed},
      {"not_deskewed", summary.not_deskewed},
      {"seconds", summary.seconds},
      {"points_per_second",
       summary.seconds > 0.0 ? static_cast<double>(summary.points) / summary.seconds : 0.0}};
  if (options.as_local_maps) json["local_map_bytes"] = summary.local_map_bytes;
  if (options.wait) {
    json["integrated"] = summary.integrated;
    json["aligned"] = summary.aligned;
    json["integration_failed"] = summary.integration_failed;
    AddHealth(summary.health, !output.text(), json);
  }
  if (summary.level_rad.has_value()) {
    json["level_rad"] = *summary.level_rad;
  }
  if (summary.interrupted) {
    json["interrupted"] = true;
  }
  json.update(more);
  json["errors"] = summary.errors;
  TalkOf(summary.errors, output);
  if (summary.health.Doubtful()) {
    output.Talk(absl::StrCat("warning: ", summary.health.Summary(), ": ", kDoubtful));
  }
  if (output.text()) {
    json.erase("errors");
    for (const char* count : {"range_0", "gps_priors", "deskewed", "not_deskewed"}) {
      if (json[count] == 0) json.erase(count);
    }
    if (summary.uploaded == 0 && summary.skipped > 0) {
      json = {{"map", options.map},
              {"trajectory", options.trajectory},
              {"already there", summary.skipped},
              {"failed", summary.errors.size()}};
      return output.Object(json);
    }
    json["seconds"] = absl::StrFormat("%.2f", summary.seconds);
    json["points_per_second"] = absl::StrFormat("%.0f", json["points_per_second"].get<double>());
  }
  output.Object(json);
}

absl::Status ErrorsOf(const Json& errors, std::size_t files) {
  if (errors.empty()) return absl::OkStatus();
  return absl::UnknownError(absl::StrCat(errors.size(), " of ", files, " scans failed"));
}

}  // namespace strata::cli
