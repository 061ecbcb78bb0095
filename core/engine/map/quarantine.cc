#include "core/engine/map/quarantine.h"

#include <algorithm>
#include <cstdint>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include <glog/logging.h>

#include "core/common/guarded.h"
#include "core/common/log_line.h"
#include "core/common/status.h"
#include "core/engine/map/job_context.h"

namespace strata {
namespace {

absl::StatusOr<PosedScan> GetScan(StorageWriter& writer, ScanNumber number) {
  STRATA_ASSIGN_OR_RETURN(const MapClock clock, writer.reader().GetClock());
  return writer.reader().GetScan(number, clock.epoch);
}

std::string NameOf(const WorkId& work) {
  switch (work.kind) {
    case WorkKind::kScan:
      return absl::StrCat("scan number ", work.id);
    case WorkKind::kJob:
      return absl::StrCat("job ", work.id);
    case WorkKind::kRecovery:
      return "the rebuild after a start";
    case WorkKind::kLook:
      return "the look for jobs that are due";
    case WorkKind::kPrepare:
      return "preparing tiles";
  }
  return "unknown work";
}

absl::Status NotInQuarantine(const WorkId& work) {
  return absl::FailedPreconditionError(absl::StrCat(NameOf(work), " is not in quarantine"));
}

absl::Status HoldScan(StorageWriter& writer, ScanNumber number, absl::string_view why) {
  STRATA_ASSIGN_OR_RETURN(const PosedScan posed, GetScan(writer, number));
  if (posed.scan.state != ScanState::kPending) {
    return absl::FailedPreconditionError(
        absl::StrCat("scan ", posed.scan.header.id.ToString(), " does not wait for integration"));
  }
  return writer.SetScanState(number, ScanState::kFailed, absl::StrCat(kQuarantined, why));
}

absl::Status ReleaseScan(StorageWriter& writer, ScanNumber number) {
  STRATA_ASSIGN_OR_RETURN(const PosedScan posed, GetScan(writer, number));
  if (posed.scan.state != ScanState::kFailed ||
      !absl::StartsWith(posed.scan.message, kQuarantined)) {
    return NotInQuarantine({WorkKind::kScan, number});
  }
  return writer.SetScanState(number, ScanState::kPending, "");
}

absl::StatusOr<JobInfo> GetJob(StorageWriter& writer, std::uint64_t id) {
  STRATA_ASSIGN_OR_RETURN(std::optional<JobInfo> job, writer.reader().FindJob(id));
  if (job.has_value()) return *std::move(job);
  return absl::NotFoundError(absl::StrCat("job ", id, " does not exist"));
}

absl::Status PutJobAs(StorageWriter& writer, JobInfo job, JobState state, std::string message) {
  job.state = state;
  job.parameters.erase(kToldToEnd);
  job.phase.clear();
  job.message = std::move(message);
  job.updated = absl::FromUnixMicros(absl::ToUnixMicros(absl::Now()));
  return writer.PutJob(job);
}

absl::Status HoldJob(StorageWriter& writer, std::uint64_t id, absl::string_view why) {
  STRATA_ASSIGN_OR_RETURN(JobInfo job, GetJob(writer, id));
  if (IsFinal(job.state)) {
    return absl::FailedPreconditionError(absl::StrCat("job ", id, " has ended"));
  }
  return PutJobAs(writer, std::move(job), JobState::kFailed, absl::StrCat(kQuarantined, why));
}

absl::Status ReleaseJob(StorageWriter& writer, std::uint64_t id) {
  STRATA_ASSIGN_OR_RETURN(JobInfo job, GetJob(writer, id));
  if (!IsQuarantined(job)) return NotInQuarantine({WorkKind::kJob, id});
  return PutJobAs(writer, std::move(job), JobState::kQueued, "");
}

// Whether the attempt still says anything: its scan or job is there, and waits or is put aside.
absl::StatusOr<bool> Matters(StorageWriter& writer, const Attempt& attempt) {
  const bool held = attempt.deaths >= kMostDeaths;
  if (attempt.work.kind == WorkKind::kScan) {
    const absl::StatusOr<PosedScan> posed = GetScan(writer, attempt.work.id);
    if (absl::IsNotFound(posed.status())) return false;
    if (absl::IsDataLoss(posed.status())) return true;
    STRATA_RETURN_IF_ERROR(posed.status());
    return posed->scan.state == ScanState::kPending ||
           (held && posed->scan.state == ScanState::kFailed);
  }
  if (attempt.work.kind == WorkKind::kJob) {
    STRATA_ASSIGN_OR_RETURN(const std::optional<JobInfo> job,
                            writer.reader().FindJob(attempt.work.id));
    return job.has_value() && (!IsFinal(job->state) || (held && IsQuarantined(*job)));
  }
  return true;
}

std::string Why(const WorkId& work, std::uint32_t deaths) {
  return absl::StrCat("the server died ",
                      deaths,
                      " times while ",
                      work.kind == WorkKind::kScan ? "integrating it" : "it ran",
                      "; stratad quarantine release takes it back");
}

}  // namespace

bool IsQuarantined(const JobInfo& job) {
  return job.state == JobState::kFailed && absl::StartsWith(job.message, kQuarantined);
}

absl::Status Hold(StorageWriter& writer,
                  const WorkId& work,
                  absl::string_view why,
                  std::uint32_t deaths) {
  if (work.kind == WorkKind::kScan) STRATA_RETURN_IF_ERROR(HoldScan(writer, work.id, why));
  if (work.kind == WorkKind::kJob) STRATA_RETURN_IF_ERROR(HoldJob(writer, work.id, why));
  return writer.PutAttempt({work, deaths, false});
}

absl::Status Release(StorageWriter& writer, const WorkId& work) {
  if (work.kind == WorkKind::kScan) STRATA_RETURN_IF_ERROR(ReleaseScan(writer, work.id));
  if (work.kind == WorkKind::kJob) STRATA_RETURN_IF_ERROR(ReleaseJob(writer, work.id));
  return writer.DeleteAttempt(work);
}

absl::StatusOr<std::unique_ptr<Quarantine>> Quarantine::Open(MapCore& core, bool died) {
  std::unique_ptr<Quarantine> quarantine(new Quarantine(core));
  {
    STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, core.Reader());
    const absl::StatusOr<std::vector<Attempt>> attempts = reader->ListAttempts();
    // Without what is damaged everything is tried again, as if nobody had died.
    if (absl::IsDataLoss(attempts.status())) return quarantine;
    STRATA_RETURN_IF_ERROR(attempts.status());
    if (attempts->empty()) return quarantine;
  }
  STRATA_RETURN_IF_ERROR(core.writer().Run(
      Durability::kRelaxed, 0, Stop(), [&quarantine, died](StorageWriter& writer) {
        return quarantine->CountDeaths(writer, died);
      }));
  return quarantine;
}

absl::Status Quarantine::CountDeaths(StorageWriter& writer, bool process_died) {
  STRATA_ASSIGN_OR_RETURN(std::vector<Attempt> attempts, writer.reader().ListAttempts());
  std::map<WorkId, std::uint32_t> deaths;
  for (Attempt& attempt : attempts) {
    const bool died = std::exchange(attempt.under_way, false) && process_died;
    // Whom somebody else killed may have had innocent work: it becomes a suspect, no more.
    const bool innocent =
        core_.options().killed_from_outside && core_.last_owner() == LastOwner::kSelf;
    if (died && (attempt.deaths == 0 || !innocent)) ++attempt.deaths;
    STRATA_ASSIGN_OR_RETURN(const bool matters, Matters(writer, attempt));
    if (!matters || attempt.deaths == 0) {
      STRATA_RETURN_IF_ERROR(writer.DeleteAttempt(attempt.work));
      continue;
    }
    deaths[attempt.work] = attempt.deaths;
    // What is so damaged that it cannot be put aside is not begun either.
    if (died && attempt.deaths >= most_deaths_ &&
        Hold(writer, attempt.work, Why(attempt.work, attempt.deaths), attempt.deaths).ok()) {
      LOG(ERROR) << LogLine("quarantine")
                        .Add("map", core_.name())
                        .Add("work", NameOf(attempt.work))
                        .Add("deaths", attempt.deaths);
    } else {
      STRATA_RETURN_IF_ERROR(writer.PutAttempt(attempt));
    }
  }
  absl::MutexLock lock(&mutex_);
  deaths_ = std::move(deaths);
  return absl::OkStatus();
}

std::uint32_t Quarantine::DeathsOf(const WorkId& work) const {
  absl::MutexLock lock(&mutex_);
  const auto it = deaths_.find(work);
  return it == deaths_.end() ? 0 : it->second;
}

absl::StatusOr<bool> Quarantine::SuspectScanWaits() const {
  std::vector<ScanNumber> suspects;
  {
    absl::MutexLock lock(&mutex_);
    for (const auto& [work, deaths] : deaths_) {
      if (work.kind == WorkKind::kScan) suspects.push_back(work.id);
    }
  }
  if (suspects.empty()) return false;
  STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, core_.Reader());
  for (const ScanNumber number : suspects) {
    const auto posed = reader->GetScan(number, core_.snapshots().current().epoch);
    if (posed.ok() && posed->scan.state == ScanState::kPending) return true;
  }
  return false;
}

absl::StatusOr<int> Quarantine::BeginScans(int most) {
  ScanQuery query;
  query.state = ScanState::kPending;
  query.skip_damaged = true;  // as they are integrated
  query.limit = static_cast<std::uint32_t>(most);
  std::set<WorkId> scans;
  {
    STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, core_.Reader());
    STRATA_ASSIGN_OR_RETURN(const std::vector<PosedScan> pending,
                            reader->ListScans(query, core_.snapshots().current().epoch));
    for (const PosedScan& posed : pending) {
      const WorkId work{WorkKind::kScan, posed.scan.number};
      const bool alone = IsSuspect(work);
      if (alone && !scans.empty()) break;
      scans.insert(work);
      if (alone) break;
    }
  }
  const auto count = static_cast<int>(scans.size());
  if (count > 0) STRATA_RETURN_IF_ERROR(PutScansUnderWay(std::move(scans)));
  return count;
}

absl::Status Quarantine::PutScansUnderWay(std::set<WorkId> scans) {
  if (scans == scans_under_way_) return absl::OkStatus();
  std::vector<Attempt> begun;
  for (const WorkId& work : scans) begun.push_back({work, DeathsOf(work), true});
  STRATA_RETURN_IF_ERROR(core_.writer().Run(
      Durability::kRelaxed, 0, Stop(), [&](StorageWriter& writer) -> absl::Status {
        for (const WorkId& work : scans_under_way_) {
          STRATA_RETURN_IF_ERROR(writer.DeleteAttempt(work));
        }
        for (const Attempt& attempt : begun) STRATA_RETURN_IF_ERROR(writer.PutAttempt(attempt));
        return absl::OkStatus();
      }));
  scans_under_way_.swap(scans);
  return absl::OkStatus();
}

void Quarantine::EndScans() {
  const auto pause = [this](StorageWriter& writer) -> absl::Status {
    for (const WorkId& work : scans_under_way_) {
      STRATA_RETURN_IF_ERROR(Pause(writer, work));
    }
    return absl::OkStatus();
  };
  const absl::Status ended =
      Guarded([&] { return core_.writer().Run(Durability::kRelaxed, 0, Stop(), pause); });
  if (ended.ok()) scans_under_way_.clear();
}

absl::Status Quarantine::HoldNextScan(absl::string_view why) {
  STRATA_ASSIGN_OR_RETURN(const int scans, BeginScans(1));
  if (scans == 0) return absl::OkStatus();
  const WorkId work = *scans_under_way_.begin();
  STRATA_RETURN_IF_ERROR(
      core_.writer().Run(Durability::kRelaxed, 0, Stop(), [&](StorageWriter& writer) {
        return Hold(writer, work, why);
      }));
  scans_under_way_.clear();
  return absl::OkStatus();
}

absl::Status Quarantine::Begin(StorageWriter& writer, const WorkId& work) const {
  return writer.PutAttempt({work, DeathsOf(work), true});
}

absl::Status Quarantine::End(StorageWriter& writer, const WorkId& work) {
  STRATA_RETURN_IF_ERROR(writer.DeleteAttempt(work));
  absl::MutexLock lock(&mutex_);
  deaths_.erase(work);
  return absl::OkStatus();
}

absl::Status Quarantine::Pause(StorageWriter& writer, const WorkId& work) const {
  const std::uint32_t deaths = DeathsOf(work);
  return deaths == 0 ? writer.DeleteAttempt(work) : writer.PutAttempt({work, deaths, false});
}

absl::Status Quarantine::Begin(const WorkId& work) {
  return core_.writer().Run(
      Durability::kRelaxed, 0, Stop(), [&](StorageWriter& writer) { return Begin(writer, work); });
}

absl::Status Quarantine::Pause(const WorkId& work) {
  return core_.writer().Run(
      Durability::kRelaxed, 0, Stop(), [&](StorageWriter& writer) { return Pause(writer, work); });
}

absl::StatusOr<bool> Quarantine::NothingElseUnderWay(const WorkId& work) {
  if (!scans_under_way_.empty()) EndScans();  // those of the last batch
  STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, core_.Reader());
  STRATA_ASSIGN_OR_RETURN(const std::vector<Attempt> attempts, reader->ListAttempts());
  return std::none_of(attempts.begin(), attempts.end(), [&work](const Attempt& attempt) {
    return attempt.under_way && attempt.work != work;
  });
}

absl::Status Quarantine::End(const WorkId& work) {
  return core_.writer().Run(
      Durability::kRelaxed, 0, Stop(), [&](StorageWriter& writer) { return End(writer, work); });
}

}  // namespace strata
