#include "tests/integration/campaigns/clock_campaign.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <memory>
#include <string>
#include <thread>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include "core/cloud/cloud_slice.h"
#include "core/common/status.h"
#include "core/common/steady_time.h"
#include "tests/integration/campaigns/campaign_scans.h"
#include "tests/integration/numbered_scans.h"
#include "tests/support/paths.h"

namespace strata::testing {
namespace {

constexpr absl::Duration kLongest = absl::Seconds(60);  // that anything may take

// The wall clock of the processes that are started while it lives.
class SetClock {
 public:
  explicit SetClock(const std::filesystem::path& file) {
    const int descriptor = open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
    if (descriptor < 0 || ftruncate(descriptor, sizeof(std::int64_t)) != 0) std::abort();
    void* page =
        mmap(nullptr, sizeof(std::int64_t), PROT_READ | PROT_WRITE, MAP_SHARED, descriptor, 0);
    close(descriptor);
    if (page == MAP_FAILED) std::abort();
    offset_ = static_cast<std::atomic<std::int64_t>*>(page);
    setenv("STRATA_CLOCK_FILE", file.c_str(), 1);
    setenv("LD_PRELOAD", BuiltPath("tests/support/libstrata_jumping_clock.so").c_str(), 1);
  }
  ~SetClock() {
    unsetenv("LD_PRELOAD");
    munmap(offset_, sizeof(std::int64_t));
  }
  SetClock(const SetClock&) = delete;
  SetClock& operator=(const SetClock&) = delete;

  void Set(absl::Duration offset) { *offset_ = absl::ToInt64Nanoseconds(offset); }

 private:
  std::atomic<std::int64_t>* offset_ = nullptr;
};

struct Moment {
  std::string name;
  absl::Duration offset;  // of the set clock to the true one
};

class ClockCampaign {
 public:
  explicit ClockCampaign(const ClockOptions& options)
      : options_(options), clock_(options.world.folder / "clock"), world_(options.world) {}

  CampaignReport Run();

 private:
  // An upload that its client left half-way, with what of it is durable.
  void LeaveHalf(std::uint64_t sequence);
  // It goes on, where it was if it was `held`.
  void GoOnWithHalf(std::uint64_t sequence, bool held, const std::string& after);
  void JumpWhileServing(std::uint64_t jump, const Moment& to);
  void JumpBetweenRuns(std::uint64_t jump, const Moment& to, bool back);
  // Robots, a job with its watch, a deadline and the history.
  void CheckWorks(const std::string& after);

  const ClockOptions options_;
  SetClock clock_;
  CampaignWorld world_;
  double slowest_s_ = 0.0;
};

constexpr std::size_t kHalf = 60'000;  // points; some of them have become durable by themselves

absl::StatusOr<std::unique_ptr<api::ScanUpload>> BeginHalf(api::Database& db,
                                                           std::uint64_t sequence,
                                                           PointCloud& cloud) {
  cloud = NumberedCloud(sequence, 2 * kHalf);
  ScanHeader header = NumberedHeader(sequence, cloud);
  header.id.trajectory = "half";
  header.content_hash = ContentHashOf(header, cloud);
  return db.scans().Upload({}, kCampaignMap, header);
}

absl::Status WriteUpTo(api::ScanUpload& upload, const PointCloud& cloud, std::size_t end) {
  constexpr std::size_t kPiece = 10'000;
  for (std::size_t at = upload.points_held(); at < end; at += kPiece) {
    STRATA_RETURN_IF_ERROR(upload.Write(SliceOf(cloud, at, std::min(end, at + kPiece))));
  }
  return absl::OkStatus();
}

void ClockCampaign::LeaveHalf(std::uint64_t sequence) {
  PointCloud cloud;
  const auto upload = BeginHalf(world_.db(), sequence, cloud);
  world_.violations().Check("half an upload", upload.status());
  if (upload.ok()) world_.violations().Check("write", WriteUpTo(**upload, cloud, kHalf));
}

void ClockCampaign::GoOnWithHalf(std::uint64_t sequence, bool held, const std::string& after) {
  PointCloud cloud;
  const auto upload = BeginHalf(world_.db(), sequence, cloud);
  world_.violations().Check(after, upload.status());
  if (!upload.ok()) return;
  if (held && (*upload)->points_held() == 0) {
    world_.violations().Add(absl::StrCat(after, ": half an upload is lost"));
  }
  world_.violations().Check(after, WriteUpTo(**upload, cloud, cloud.size()));
  world_.violations().Check(after, (*upload)->Finish().status());
}

void ClockCampaign::CheckWorks(const std::string& after) {
  const auto begin = SteadyNow();
  if (!world_.AwaitAcknowledged(2 * world_.robots(), kLongest)) {
    world_.violations().Add(absl::StrCat(after, ": robots are not heard any more"));
  }
  world_.RunJob("verify");
  api::Call patient;
  patient.stop = Stop(SteadyNow() + kLongest);
  world_.violations().Check(after, world_.db().maps().Stats(patient, kCampaignMap).status());
  world_.violations().Check(after, world_.db().maps().History(patient, kCampaignMap).status());
  world_.CheckAcknowledged();
  slowest_s_ = std::max(slowest_s_, absl::ToDoubleSeconds(SteadyNow() - begin));
}

void ClockCampaign::JumpWhileServing(std::uint64_t jump, const Moment& to) {
  const std::string after = absl::StrCat("after the clock was set ", to.name);
  LeaveHalf(2 * jump);
  const auto job = world_.db().jobs().Start({}, kCampaignMap, "rebuild", {});
  world_.violations().Check("rebuild", job.status());
  std::thread watch([&] {  // its deadline is far away, whatever the clock says
    if (!job.ok()) return;
    api::Call call;
    call.stop = Stop(SteadyNow() + 10 * kLongest);
    const auto take = [](const JobInfo&) { return absl::OkStatus(); };
    world_.violations().Check(after, world_.db().jobs().Watch(call, kCampaignMap, job->id, take));
  });
  absl::SleepFor(absl::Milliseconds(100));
  clock_.Set(to.offset);
  GoOnWithHalf(2 * jump, true, after);
  CheckWorks(after);
  watch.join();
}

void ClockCampaign::JumpBetweenRuns(std::uint64_t jump, const Moment& to, bool back) {
  const std::string after = absl::StrCat("after a start at a clock set ", to.name);
  LeaveHalf(2 * jump + 1);
  world_.server().Signal(SIGTERM);
  if (const int end = world_.AwaitServerEnd(); end != 0) {
    world_.violations().Add(absl::StrCat("SIGTERM: the server ended with ", end));
  }
  clock_.Set(to.offset);
  world_.StartServer();
  // gRPC's timers wait by the wall clock (Debian's Abseil): set back, a channel that was about to
  // connect again does not. A robot that is started anew does.
  for (std::size_t i = 0; back && i < world_.robots(); ++i) world_.robot(i).Kill();
  world_.CheckAcknowledged();
  // Forward it was left alone for so long, as far as anybody knows.
  GoOnWithHalf(2 * jump + 1, back, after);
  CheckWorks(after);
}

CampaignReport ClockCampaign::Run() {
  const absl::Duration to_1970 = absl::UnixEpoch() - absl::Now();
  const std::array<Moment, 4> moments = {{{"a day back", -absl::Hours(24)},
                                          {"ten years forward", 3650 * absl::Hours(24)},
                                          {"to 1970", to_1970 + absl::Hours(1)},
                                          {"right", absl::ZeroDuration()}}};
  world_.StartRobots();
  for (int jump = 0; jump < options_.jumps; ++jump) {
    const auto number = static_cast<std::uint64_t>(jump) + 1;
    const Moment& serving = moments.at(static_cast<std::size_t>(jump) % moments.size());
    const Moment& between = moments.at(static_cast<std::size_t>(jump + 2) % moments.size());
    std::cerr << serving.name << ", then " << between.name << std::endl;
    JumpWhileServing(number, serving);
    JumpBetweenRuns(number, between, between.offset < serving.offset);
  }
  world_.RetireRobotsAndCheck();
  const std::size_t scans = world_.CheckContent(false);
  return {{{"jumps", 2 * options_.jumps},
           {"slowest_s", slowest_s_},
           {"scans", static_cast<double>(scans)}},
          world_.violations().All()};
}

}  // namespace

CampaignReport RunClockCampaign(const ClockOptions& options) {
  return ClockCampaign(options).Run();
}

}  // namespace strata::testing
