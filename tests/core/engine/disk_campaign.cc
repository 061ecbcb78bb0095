#include "tests/core/engine/disk_campaign.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"

#include "core/common/status.h"
#include "core/engine/engine.h"
#include "tests/support/faults/power_cut_disk.h"

namespace strata::testing {
namespace {

// Answers yes some time after `trouble` did first: what needs no disk gets done meanwhile.
class Patience {
 public:
  explicit Patience(std::function<bool()> trouble) : trouble_(std::move(trouble)) {}
  bool IsOver() {
    if (!trouble_()) return false;
    const absl::Time now = absl::Now();
    since_ = std::min(since_, now);
    return now - since_ > absl::Milliseconds(50);
  }

 private:
  std::function<bool()> trouble_;
  absl::Time since_ = absl::InfiniteFuture();
};

// A job that fails says of the store why.
bool MayAnswer(const absl::Status& status) {
  return IsTroubleOfDisk(status) ||
         (absl::IsInternal(status) && absl::StrContains(status.message(), "store: "));
}

absl::Status RunStep(const absl::StatusOr<std::unique_ptr<api::Database>>& database,
                     const HistoryStep& step,
                     const Hopeless& hopeless) {
  STRATA_RETURN_IF_ERROR(database.status());
  return step.run(**database, hopeless);
}

absl::StatusOr<std::unique_ptr<api::Database>> Open(const std::filesystem::path& directory) {
  return OpenEngine(HistoryOptions(directory));
}

// What a disk has to do for an engine that is opened, takes the steps and is closed.
absl::Status Count(const std::filesystem::path& directory,
                   const std::vector<HistoryStep>& steps,
                   std::array<std::int64_t, kDiskFaults>& operations,
                   std::int64_t& grown) {
  const FaultyDisk disk;
  {
    STRATA_ASSIGN_OR_RETURN(const auto database, Open(directory));
    for (const HistoryStep& step : steps) STRATA_RETURN_IF_ERROR(step.run(*database, {}));
  }
  for (int i = 0; i < kDiskFaults; ++i) {
    operations[static_cast<std::size_t>(i)] = disk.operations(static_cast<DiskFault>(i));
  }
  grown = disk.grown();
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<DiskCampaign> DiskCampaign::Prepare() {
  DiskCampaign campaign;
  {
    const TempDir directory;
    STRATA_ASSIGN_OR_RETURN(const auto database, Open(directory.path()));
    campaign.states_.emplace_back();
    for (const HistoryStep& step : DiskHistory()) {
      const absl::Status done = step.run(*database, {});
      if (!done.ok()) return Annotate(done, step.name);
      STRATA_RETURN_IF_ERROR(Settle(*database));
      campaign.states_.push_back(Observe(*database));
      const std::size_t last = campaign.states_.size() - 1;
      if (step.changes == (campaign.states_[last] == campaign.states_[last - 1])) {
        return absl::InternalError(
            absl::StrCat(step.name, " changes what it should not, or nothing"));
      }
      STRATA_ASSIGN_OR_RETURN(const std::string fresh, FreshDigest(*database));
      if (absl::StrContains(campaign.states_.back().at("content"), fresh)) continue;
      return absl::InternalError(absl::StrCat("after ", step.name, " a new map is another"));
    }
    STRATA_RETURN_IF_ERROR(CheckSound(*database));
  }
  const TempDir counted;
  STRATA_RETURN_IF_ERROR(
      Count(counted.path(), DiskHistory(), campaign.operations_, campaign.grown_));
  const TempDir whole;
  const auto cut = std::make_shared<TempDir>();
  {
    PowerCutDisk disk(whole.path());
    STRATA_ASSIGN_OR_RETURN(const auto database, Open(whole.path()));
    for (const HistoryStep& step : DiskHistory()) STRATA_RETURN_IF_ERROR(step.run(*database, {}));
    campaign.cuts_ = disk.operations();
    disk.CutAfter(0, 1, cut->path());
    // The first thing that would be written.
    database->planning().SetProfile({}, kHistoryMap, "cut", RobotProfile()).IgnoreError();
  }
  campaign.cut_ = cut;
  const TempDir opened;
  std::filesystem::copy(cut->path(), opened.path());
  std::int64_t grown = 0;
  STRATA_RETURN_IF_ERROR(Count(opened.path(), {}, campaign.opening_, grown));
  return campaign;
}

std::string DiskCampaign::CompareAfter(api::Database& database, std::size_t steps) const {
  if (const absl::Status settled = Settle(database);
      !settled.ok() && !(steps == 0 && absl::IsNotFound(settled))) {
    return settled.ToString();
  }
  const WorldState found = Observe(database);
  const std::string before = Difference(states_[steps], found);
  if (before.empty() || steps + 1 == states_.size()) return before;
  const std::string after = Difference(states_[steps + 1], found);
  if (after.empty()) return "";
  if (DiskHistory()[steps].gradual) {
    const absl::Status sound = CheckSound(database);
    return sound.ok() ? "" : sound.ToString();
  }
  return absl::StrCat("before it: ", before, " | after it: ", after);
}

DiskCampaign::Trial DiskCampaign::RunOnFaultyDisk(const Arm& arm,
                                                  bool until_mended,
                                                  bool reopen) const {
  Trial trial;
  const TempDir directory;
  FaultyDisk disk;
  arm(disk);
  Patience patience([&] { return until_mended && disk.failed() > 0; });
  Hopeless hopeless = [&] { return patience.IsOver(); };
  auto database = Open(directory.path());
  const auto open_again = [&] {
    database = absl::UnavailableError("closed");
    disk.Mend();
    database = Open(directory.path());
  };
  const auto violated = [&](absl::string_view step, const std::string& how) {
    trial.violation = absl::StrCat(step, ": ", how);
    return trial;
  };
  int tries = 0;
  const std::vector<HistoryStep>& history = DiskHistory();
  for (std::size_t i = 0; i < history.size();) {
    const absl::Status done = RunStep(database, history[i], hopeless);
    trial.failed = disk.failed() > 0;
    if (done.ok()) {
      ++i;
      tries = 0;
      continue;
    }
    ++trial.steps_failed;
    if (!trial.failed) return violated(history[i].name, done.ToString());
    if (!MayAnswer(done)) return violated(history[i].name, absl::StrCat("says ", done.ToString()));
    if (until_mended) {
      if (database.ok()) Observe(**database);  // whatever it says
      if (reopen) open_again();
      disk.Mend();
      hopeless = {};
      until_mended = false;
    } else if (++tries > 2) {
      ++trial.restarts;
      open_again();
      if (tries > 5) return violated(history[i].name, absl::StrCat("never, ", done.ToString()));
    }
    if (!database.ok()) continue;
    const std::string wrong = CompareAfter(**database, i);
    if (!wrong.empty()) return violated(history[i].name, wrong);
  }
  disk.Mend();  // a fault that begins after the last step would hide what is there
  const std::string end = CompareAfter(**database, history.size());
  if (!end.empty()) return violated("the end", end);
  open_again();
  if (!database.ok()) return violated("opening again", database.status().ToString());
  const std::string again = CompareAfter(**database, history.size());
  if (!again.empty()) return violated("opened again", again);
  const absl::Status sound = CheckSound(**database);
  if (!sound.ok()) return violated("opened again", sound.ToString());
  return trial;
}

DiskCampaign::Trial DiskCampaign::RunOpening(const Arm& arm) const {
  Trial trial;
  const TempDir directory;
  std::filesystem::copy(cut_->path(), directory.path());
  FaultyDisk disk;
  arm(disk);
  const std::size_t steps = DiskHistory().size();
  const auto violated = [&](const std::string& how) {
    trial.violation = how;
    return trial;
  };
  for (int tries = 0; tries < 2; ++tries) {
    const auto database = Open(directory.path());
    Patience patience([&] { return disk.failed() > 0; });
    absl::Status done = database.status();
    if (done.ok()) done = Settle(**database, [&] { return tries == 0 && patience.IsOver(); });
    trial.failed = disk.failed() > 0;
    if (!done.ok() && (!trial.failed || tries > 0 || !MayAnswer(done))) {
      return violated(absl::StrCat("says ", done.ToString()));
    }
    trial.steps_failed += done.ok() ? 0 : 1;
    disk.Mend();
    if (!done.ok()) continue;
    const std::string wrong = CompareAfter(**database, steps);
    if (!wrong.empty()) return violated(wrong);
    const absl::Status sound = CheckSound(**database);
    return sound.ok() ? trial : violated(sound.ToString());
  }
  return trial;
}

DiskCampaign::Trial DiskCampaign::RunUntilCut(std::int64_t moment,
                                              std::uint64_t seed,
                                              bool lying) const {
  Trial trial;
  const TempDir directory;
  const std::filesystem::path before = directory.path() / "before";
  const std::filesystem::path after = directory.path() / "after";
  std::filesystem::create_directory(before);
  const std::vector<HistoryStep>& history = DiskHistory();
  std::size_t acknowledged = 0;
  {
    PowerCutDisk disk(before);
    if (lying) disk.IgnoreSyncs();
    disk.CutAfter(moment, seed, after);
    Patience patience([&] { return disk.is_cut(); });
    auto database = Open(before);
    for (const HistoryStep& step : history) {
      const absl::Status done = RunStep(database, step, [&] { return patience.IsOver(); });
      if (done.ok()) {
        ++acknowledged;
        continue;
      }
      ++trial.steps_failed;
      if (!disk.is_cut()) trial.violation = absl::StrCat(step.name, ": ", done.ToString());
      break;
    }
    database = absl::UnavailableError("closed");
    trial.failed = disk.is_cut();
  }
  if (!trial.failed || !trial.violation.empty()) return trial;
  const auto violated = [&](const std::string& how) {
    const std::string step = acknowledged < history.size() ? history[acknowledged].name : "the end";
    trial.violation = absl::StrCat(step, ": ", how);
    return trial;
  };
  const auto database = Open(after);
  if (!database.ok()) return violated(database.status().ToString());
  const std::string wrong = CompareAfter(**database, acknowledged);
  if (!wrong.empty()) return violated(wrong);
  for (std::size_t i = acknowledged; i < history.size(); ++i) {
    const absl::Status done = history[i].run(**database, {});
    if (!done.ok()) return violated(absl::StrCat("afterwards ", done.ToString()));
  }
  const std::string end = CompareAfter(**database, history.size());
  if (!end.empty()) return violated(absl::StrCat("afterwards ", end));
  const absl::Status sound = CheckSound(**database);
  return sound.ok() ? trial : violated(sound.ToString());
}

SweepResult DiskCampaign::Run(const Sweep& sweep,
                              std::int64_t moments,
                              const std::function<Trial(std::int64_t)>& trial) {
  SweepResult result;
  result.moments = moments;
  for (std::int64_t n = sweep.first; n < moments; n += sweep.every) {
    const Trial tried = trial(n);
    result.trials += tried.failed ? 1 : 0;
    result.steps_failed += tried.steps_failed;
    result.restarts += tried.restarts;
    std::string text = absl::StrCat("moment ", n, " of ", moments);
    if (!tried.violation.empty()) {
      absl::StrAppend(&text, ": ", tried.violation);
      result.violations.push_back(text);
    }
    if (sweep.progress) sweep.progress(text);
  }
  return result;
}

SweepResult DiskCampaign::FailOnce(DiskFault fault, const Sweep& sweep) const {
  return Run(sweep, moments(fault), [&](std::int64_t n) {
    return RunOnFaultyDisk([&](FaultyDisk& disk) { disk.Fail(fault, n, 1); }, false, false);
  });
}

SweepResult DiskCampaign::FailUntilMended(DiskFault fault, const Sweep& sweep) const {
  return Run(sweep, moments(fault), [&](std::int64_t n) {
    const bool reopen = (n / sweep.every + static_cast<std::int64_t>(sweep.seed)) % 2 == 0;
    return RunOnFaultyDisk([&](FaultyDisk& disk) { disk.Fail(fault, n); }, true, reopen);
  });
}

SweepResult DiskCampaign::FillUp(const Sweep& sweep) const {
  return Run(sweep, grown_, [&](std::int64_t n) {
    const bool reopen = (n / sweep.every + static_cast<std::int64_t>(sweep.seed)) % 2 == 0;
    return RunOnFaultyDisk([&](FaultyDisk& disk) { disk.LeaveRoom(n); }, true, reopen);
  });
}

SweepResult DiskCampaign::FailOnOpening(DiskFault fault, const Sweep& sweep) const {
  return Run(sweep, moments_of_opening(fault), [&](std::int64_t n) {
    const std::int64_t times = n % 2 == 0 ? 1 : INT64_MAX / 2;
    return RunOpening([&](FaultyDisk& disk) { disk.Fail(fault, n, times); });
  });
}

SweepResult DiskCampaign::CutPower(bool lying, const Sweep& sweep) const {
  return Run(sweep, cuts_, [&](std::int64_t n) {
    return RunUntilCut(n, sweep.seed * 1'000'003 + static_cast<std::uint64_t>(n), lying);
  });
}

}  // namespace strata::testing
