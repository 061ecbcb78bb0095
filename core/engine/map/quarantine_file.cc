#include "core/engine/map/quarantine_file.h"

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "absl/strings/strip.h"

#include "core/common/status.h"
#include "core/engine/map/idle_map.h"
#include "core/engine/map/quarantine.h"
#include "core/engine/map/scan_lookup.h"
#include "core/storage/storage.h"

namespace strata {
namespace {

constexpr absl::string_view kRebuild = "rebuild";
constexpr absl::string_view kLook = "look";
constexpr absl::string_view kPrepare = "prepare";

// Work of which a map has one.
absl::string_view NameOfKind(WorkKind kind) {
  if (kind == WorkKind::kRecovery) return kRebuild;
  return kind == WorkKind::kLook ? kLook : kPrepare;
}

absl::StatusOr<ScanId> ParseScan(absl::string_view text) {
  const std::size_t slash = text.rfind('/');
  ScanId id;
  if (slash != absl::string_view::npos && absl::SimpleAtoi(text.substr(slash + 1), &id.sequence)) {
    id.trajectory = std::string(text.substr(0, slash));
    return id;
  }
  return absl::InvalidArgumentError(
      absl::StrCat("scan '", text, "': write TRAJECTORY/SEQUENCE, as robot/7"));
}

absl::StatusOr<WorkId> ParseWork(StorageReader& reader, absl::string_view what) {
  absl::string_view rest = what;
  std::uint64_t job = 0;
  if (what == kRebuild) return WorkId{WorkKind::kRecovery, 0};
  if (what == kLook) return WorkId{WorkKind::kLook, 0};
  if (what == kPrepare) return WorkId{WorkKind::kPrepare, 0};
  if (absl::ConsumePrefix(&rest, "job ") && absl::SimpleAtoi(rest, &job)) {
    return WorkId{WorkKind::kJob, job};
  }
  if (!absl::ConsumePrefix(&rest, "scan ")) {
    return absl::InvalidArgumentError(absl::StrCat("'",
                                                   what,
                                                   "': write scan TRAJECTORY/SEQUENCE, job ID, ",
                                                   kRebuild,
                                                   ", ",
                                                   kLook,
                                                   " or ",
                                                   kPrepare));
  }
  STRATA_ASSIGN_OR_RETURN(const ScanId id, ParseScan(rest));
  STRATA_ASSIGN_OR_RETURN(const MapClock clock, reader.GetClock());
  STRATA_ASSIGN_OR_RETURN(const PosedScan posed, GetScanById(reader, id, clock.epoch));
  return WorkId{WorkKind::kScan, posed.scan.number};
}

absl::Status DescribeScan(StorageReader& reader, QuarantineEntry& entry, bool& matters) {
  STRATA_ASSIGN_OR_RETURN(const MapClock clock, reader.GetClock());
  const absl::StatusOr<PosedScan> scan = reader.GetScan(entry.attempt.work.id, clock.epoch);
  if (!scan.ok()) {
    matters = !absl::IsNotFound(scan.status());
    entry.name = absl::StrCat("scan number ", entry.attempt.work.id);
    entry.message = std::string(scan.status().message());
    return absl::OkStatus();
  }
  entry.name = absl::StrCat("scan ", scan->scan.header.id.ToString());
  entry.message = scan->scan.message;
  entry.held = scan->scan.state == ScanState::kFailed;
  matters = entry.held || scan->scan.state == ScanState::kPending;
  return absl::OkStatus();
}

absl::Status DescribeJob(StorageReader& reader, QuarantineEntry& entry, bool& matters) {
  STRATA_ASSIGN_OR_RETURN(const std::optional<JobInfo> job, reader.FindJob(entry.attempt.work.id));
  matters = job.has_value() && (!IsFinal(job->state) || IsQuarantined(*job));
  if (!matters) return absl::OkStatus();
  entry.name = absl::StrCat("job ", job->id, " (", job->kind, ")");
  entry.message = job->message;
  entry.held = IsQuarantined(*job);
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<std::vector<QuarantineEntry>> ListQuarantine(const MapPlace& place,
                                                            absl::string_view name) {
  std::vector<QuarantineEntry> entries;
  STRATA_RETURN_IF_ERROR(OnIdleMap(place, name, [&](StorageWriter& writer) -> absl::Status {
    StorageReader& reader = writer.reader();
    STRATA_ASSIGN_OR_RETURN(const std::vector<Attempt> attempts, reader.ListAttempts());
    for (const Attempt& attempt : attempts) {
      QuarantineEntry entry;
      entry.attempt = attempt;
      entry.attempt.deaths += attempt.under_way ? 1 : 0;
      bool matters = true;
      if (attempt.work.kind == WorkKind::kScan) {
        STRATA_RETURN_IF_ERROR(DescribeScan(reader, entry, matters));
      } else if (attempt.work.kind == WorkKind::kJob) {
        STRATA_RETURN_IF_ERROR(DescribeJob(reader, entry, matters));
      } else {
        entry.name = std::string(NameOfKind(attempt.work.kind));
        entry.held = attempt.deaths >= kMostDeaths;
      }
      if (matters) entries.push_back(std::move(entry));
    }
    return absl::OkStatus();
  }));
  return entries;
}

absl::Status AddToQuarantine(const MapPlace& place,
                             absl::string_view name,
                             absl::string_view what) {
  return OnIdleMap(place, name, [&](StorageWriter& writer) -> absl::Status {
    STRATA_ASSIGN_OR_RETURN(const WorkId work, ParseWork(writer.reader(), what));
    return Hold(writer, work, "put aside by hand; stratad quarantine release takes it back");
  });
}

absl::Status ReleaseFromQuarantine(const MapPlace& place,
                                   absl::string_view name,
                                   absl::string_view what) {
  return OnIdleMap(place, name, [&](StorageWriter& writer) -> absl::Status {
    STRATA_ASSIGN_OR_RETURN(const WorkId work, ParseWork(writer.reader(), what));
    return Release(writer, work);
  });
}

}  // namespace strata
