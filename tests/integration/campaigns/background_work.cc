#include "tests/integration/campaigns/background_work.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <system_error>
#include <utility>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"

#include "core/common/random.h"
#include "core/common/status.h"
#include "tests/integration/campaigns/campaign_scans.h"
#include "tests/integration/marked_yard.h"

namespace strata::testing {
namespace {

constexpr char kOtherMap[] = "other";
constexpr std::uint64_t kLabelledScans = 12;
constexpr absl::Duration kLongestJob = absl::Seconds(6);
constexpr std::array<const char*, 9> kKinds = {
    "optimize", "fade", "verify", "train", "classify", "planes", "objects", "complete", "rebuild"};

// Whether a job may fail for want of labels, or of what other jobs make of them.
bool MayLackLabels(absl::string_view kind, absl::string_view message) {
  if (kind == "objects") return absl::StrContains(message, "has a class");
  if (kind == "complete") return absl::StrContains(message, "objects find");
  return kind == "train" || kind == "classify";
}

// Of a scan that labels are written to; what else happens to scans leaves it alone.
ScanId LabelledScan(std::uint64_t i) { return YardScan(1 + static_cast<int>(i % 4), 1 + i / 4); }

absl::Status WriteBackup(api::Database& db,
                         const api::Call& call,
                         const std::filesystem::path& file) {
  std::ofstream out(file, std::ios::binary);
  return db.maps().Backup(call, kCampaignMap, [&out](const api::BackupPiece& piece) {
    out << piece.bytes;
    return out ? absl::OkStatus() : absl::InternalError("backup file");
  });
}

}  // namespace

BackgroundWork::BackgroundWork(CampaignWorld& world, std::uint64_t seed)
    : world_(world), seed_(seed) {
  const auto add = [&](void (BackgroundWork::*step)(api::Database&, const api::Call&)) {
    clients_.Add(world_.address(), [this, step](auto& db, const auto& call) {
      (this->*step)(db, call);
      absl::SleepFor(absl::Milliseconds(100));
    });
  };
  add(&BackgroundWork::StepJobs);
  add(&BackgroundWork::StepLabels);
  add(&BackgroundWork::StepDeletions);
  add(&BackgroundWork::StepBackups);
  add(&BackgroundWork::StepOtherMap);
}

void BackgroundWork::StepJobs(api::Database& db, const api::Call& call) {
  SplitMix64 random(seed_ + static_cast<std::uint64_t>(jobs_started_));
  const std::string kind = kKinds.at(random.Below(kKinds.size()));
  JobParameters parameters;
  if (kind == "optimize") parameters = {{"rounds", "2"}};
  if (kind == "train") parameters = {{"name", "only"}, {"folds", "0"}, {"reduce", "depth=6"}};
  if (kind == "classify") parameters = {{"model", "only"}};
  ++jobs_started_;
  const auto job = db.jobs().Start(call, kCampaignMap, kind, parameters);
  if (!job.ok()) return;
  const absl::Time begun = absl::Now();
  JobInfo last = *job;
  while (!call.stop.requested() && !IsFinal(last.state)) {
    absl::SleepFor(absl::Milliseconds(50));
    if (absl::Now() - begun > kLongestJob)
      db.jobs().Cancel(call, kCampaignMap, job->id).IgnoreError();
    const auto now = db.jobs().Get(call, kCampaignMap, job->id);
    if (now.ok()) last = *now;
    if (absl::IsNotFound(now.status())) {
      return world_.violations().Add(absl::StrCat("job ", job->id, " was started and is lost"));
    }
  }
  ++jobs_[absl::StrCat(kind, last.state == JobState::kSucceeded ? "_succeeded" : "_ended")];
  if (last.state != JobState::kFailed) return;
  if (MayLackLabels(kind, last.message)) return;
  world_.violations().Add(absl::StrCat("job ", kind, " failed: ", last.message));
}

void BackgroundWork::StepLabels(api::Database& db, const api::Call& call) {
  SplitMix64 random(seed_ + 31 * labels_.size() + absl::ToUnixMicros(absl::Now()));
  const ScanId id = LabelledScan(random.Below(kLabelledScans));
  const auto info = db.scans().Get(call, kCampaignMap, id);
  if (!info.ok()) return;
  const auto label = static_cast<std::uint16_t>(1 + random.Below(3));
  labels_.erase(id);  // unknown, unless the answer comes
  const std::vector<std::uint16_t> labels(info->header.point_count, label);
  const absl::Status set =
      db.scans().SetLabels(call, kCampaignMap, id, labels, api::LabelMode::kReplace);
  if (set.ok()) labels_[id] = label;
}

void BackgroundWork::StepDeletions(api::Database& db, const api::Call& call) {
  absl::SleepFor(absl::Milliseconds(500));
  const std::set<ScanId> acknowledged = world_.Acknowledged();
  const auto victim = std::find_if(acknowledged.begin(), acknowledged.end(), [](const ScanId& id) {
    return id.sequence > kLabelledScans;
  });
  if (victim == acknowledged.end()) return;
  const ScanId id = *victim;
  world_.MayBeGone(id);
  if (db.scans().Delete(call, kCampaignMap, id).ok()) deleted_.insert(id);
}

void BackgroundWork::StepBackups(api::Database& db, const api::Call& call) {
  absl::SleepFor(absl::Milliseconds(500));
  const std::set<ScanId> before = world_.Acknowledged();
  const std::filesystem::path part = world_.folder() / "backup.part";
  if (!WriteBackup(db, call, part).ok()) return;
  std::filesystem::create_directories(world_.folder() / "backup");
  std::filesystem::rename(part, world_.folder() / "backup" / absl::StrCat(kCampaignMap, ".strata"));
  backup_holds_ = before;
  ++backups_;
}

void BackgroundWork::StepOtherMap(api::Database& db, const api::Call& call) {
  absl::SleepFor(absl::Milliseconds(200));
  const auto there = db.maps().Get(call, kOtherMap);
  if (there.ok() && other_gone_) world_.violations().Add("a map that was deleted is there again");
  if (absl::IsNotFound(there.status())) {
    other_gone_ = false;
    if (db.maps().Create(call, kOtherMap, {}).ok()) ++other_maps_;
    return;
  }
  if (!there.ok()) return;
  const ScanId id = YardScan(1, 1);
  const PointCloud cloud = CampaignCloud(id, 120);
  const auto upload =
      db.scans().Upload(call, kOtherMap, CampaignHeader(id, cloud, Alignment::kOff));
  if (upload.ok() && (*upload)->Write(cloud).ok()) (*upload)->Finish().status().IgnoreError();
  other_gone_ = db.maps().Delete(call, kOtherMap).ok();
}

void BackgroundWork::CheckLabels(api::Database& db) {
  for (const auto& [id, label] : labels_) {
    const auto check = [&, expected = label](const PointCloud& piece) -> absl::Status {
      const bool all = piece.label.size() == piece.size() &&
                       std::all_of(piece.label.begin(), piece.label.end(), [&](auto given) {
                         return given == expected;
                       });
      return all ? absl::OkStatus() : absl::DataLossError("other labels than were acknowledged");
    };
    world_.violations().Check(id.ToString(), db.scans().GetPoints({}, kCampaignMap, id, check));
  }
}

// A copy of a map is a map, and verifies.
void BackgroundWork::CheckBackup() {
  if (backups_ == 0) return;
  StratadProcess server(
      {"--data", (world_.folder() / "backup").string(), "--listen", "127.0.0.1:0"});
  const auto db = ConnectTo(server.Address());
  if (db == nullptr) return world_.violations().Add("no server of the backup");
  for (const ScanId& id : backup_holds_) {
    const absl::Status there = db->scans().Get({}, kCampaignMap, id).status();
    if (world_.Acknowledged().contains(id)) world_.violations().Check("backup", there);
  }
  const auto job = db->jobs().Start({}, kCampaignMap, "verify", {});
  world_.violations().Check("backup: verify", job.status());
  if (!job.ok()) return;
  const auto follow = [&](const JobInfo& now) -> absl::Status {
    return now.state == JobState::kFailed ? absl::DataLossError(now.message) : absl::OkStatus();
  };
  world_.violations().Check("backup", db->jobs().Watch({}, kCampaignMap, job->id, follow));
}

void BackgroundWork::StopAndCheck(api::Database& db) {
  clients_.Stop();
  const auto jobs = db.jobs().List({}, kCampaignMap);
  world_.violations().Check("jobs", jobs.status());
  for (const JobInfo& job : jobs.value_or(std::vector<JobInfo>())) {
    if (!IsFinal(job.state)) db.jobs().Cancel({}, kCampaignMap, job.id).IgnoreError();
  }
  const std::map<ScanId, std::string> stored = world_.StoredHashes();
  for (const ScanId& id : deleted_) {
    if (stored.contains(id)) {
      world_.violations().Add(absl::StrCat(id.ToString(), " was deleted and is there again"));
    }
  }
  CheckLabels(db);
  CheckBackup();
}

std::map<std::string, double> BackgroundWork::Numbers() const {
  std::map<std::string, double> numbers = {{"labelled_scans", static_cast<double>(labels_.size())},
                                           {"deleted_scans", static_cast<double>(deleted_.size())},
                                           {"backups", backups_},
                                           {"other_maps", other_maps_},
                                           {"jobs_started", jobs_started_}};
  for (const auto& [kind, count] : jobs_) numbers["jobs_" + kind] = count;
  return numbers;
}

}  // namespace strata::testing
