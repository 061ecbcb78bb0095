#include "tests/integration/campaigns/kill_campaign.h"

#include <algorithm>
#include <chrono>
#include <iostream>
#include <memory>

#include "absl/time/clock.h"
#include "absl/time/time.h"

#include "tests/integration/campaigns/background_work.h"
#include "tests/support/simulator/simulator.h"

namespace strata::testing {
namespace {

using Seconds = std::chrono::duration<double>;

class KillCampaign {
 public:
  explicit KillCampaign(const KillOptions& options)
      : options_(options), random_(options.world.seed), world_(options.world) {}

  CampaignReport Run();

 private:
  int Kills() const { return kills_busy_ + kills_early_ + kills_starting_; }
  void SleepUpTo(double ms) { absl::SleepFor(absl::Milliseconds(random_.Uniform(0.0, ms))); }
  // Ends just before the server is to be killed.
  void AwaitMoment();
  // Those that are due by now, all in a moment.
  void KillRobots();
  // Kills the server, now and then also while it starts again, and ends when it serves.
  void KillServer();
  void CheckEnd();

  const KillOptions options_;
  Random random_;
  CampaignWorld world_;
  std::unique_ptr<BackgroundWork> work_;
  int kills_busy_ = 0;      // scans had been acknowledged since the start
  int kills_early_ = 0;     // soon after it had begun to serve
  int kills_starting_ = 0;  // before it served
  int kills_robots_ = 0;
  int idle_ = 0;
  std::map<std::string, double> numbers_;
};

void KillCampaign::AwaitMoment() {
  if (random_.Uniform(0.0, 1.0) < 0.4) {
    SleepUpTo(300.0);
    ++kills_early_;
    return;
  }
  const auto more = static_cast<std::size_t>(random_.Uniform(1.0, 9.0));
  if (!world_.AwaitAcknowledged(more, absl::Seconds(20))) ++idle_;
  SleepUpTo(60.0);
  ++kills_busy_;
}

void KillCampaign::KillRobots() {
  const double share = static_cast<double>(Kills()) / options_.server_kills;
  while (kills_robots_ < share * options_.robot_kills && kills_robots_ < options_.robot_kills) {
    const double robots = static_cast<double>(world_.robots());
    world_.robot(static_cast<std::size_t>(random_.Uniform(0.0, robots))).Kill();
    ++kills_robots_;
    if (random_.Uniform(0.0, 1.0) < 0.5) SleepUpTo(40.0);
  }
}

void KillCampaign::KillServer() {
  world_.KillServer();
  while (Kills() < options_.server_kills && random_.Uniform(0.0, 1.0) < 0.25) {
    world_.LaunchServer();
    SleepUpTo(150.0);
    world_.KillServer();
    ++kills_starting_;
  }
  const auto begin = std::chrono::steady_clock::now();
  world_.StartServer();
  const double took = Seconds(std::chrono::steady_clock::now() - begin).count();
  numbers_["restart_longest_s"] = std::max(numbers_["restart_longest_s"], took);
}

void KillCampaign::CheckEnd() {
  if (work_ != nullptr) {
    work_->StopAndCheck(world_.db());
    for (const auto& [name, number] : work_->Numbers()) numbers_[name] = number;
  }
  world_.RetireRobotsAndCheck();
  numbers_["scans"] = static_cast<double>(world_.CheckContent(!options_.work));
}

CampaignReport KillCampaign::Run() {
  world_.StartRobots();
  if (options_.work) work_ = std::make_unique<BackgroundWork>(world_, options_.world.seed);
  const auto begin = std::chrono::steady_clock::now();
  for (int restart = 1; Kills() < options_.server_kills; ++restart) {
    AwaitMoment();
    KillRobots();
    KillServer();
    world_.CheckAcknowledged();
    if (restart % options_.verify_every == 0) {
      world_.RunJob("verify");
      std::cerr << Kills() << " kills, " << world_.Acknowledged().size() << " scans acknowledged"
                << std::endl;
    }
  }
  const double took = Seconds(std::chrono::steady_clock::now() - begin).count();
  CheckEnd();
  numbers_["kills_busy"] = kills_busy_;
  numbers_["kills_early"] = kills_early_;
  numbers_["kills_starting"] = kills_starting_;
  numbers_["kills_robots"] = kills_robots_;
  numbers_["kills_without_traffic"] = idle_;
  numbers_["seconds_of_kills"] = took;
  numbers_["server_kills_per_minute"] = 60.0 * Kills() / took;
  return {numbers_, world_.violations().All()};
}

}  // namespace

CampaignReport RunKillCampaign(const KillOptions& options) { return KillCampaign(options).Run(); }

}  // namespace strata::testing
