#include "tests/integration/campaigns/term_campaign.h"

#include <algorithm>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <memory>
#include <string>
#include <system_error>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"

#include "tests/integration/campaigns/campaign_scans.h"
#include "tests/integration/clients.h"
#include "tests/support/simulator/simulator.h"

namespace strata::testing {
namespace {

constexpr int kReaders = 4;

// A server that is away or going is nothing wrong.
bool Expected(const absl::Status& status) {
  return status.ok() || absl::IsUnavailable(status) || absl::IsCancelled(status);
}

class TermCampaign {
 public:
  explicit TermCampaign(const TermOptions& options)
      : options_(options), random_(options.world.seed), world_(options.world) {}

  CampaignReport Run();

 private:
  void StartReaders();
  void Read(api::Database& db, const api::Call& call);
  void Round(int round);
  // Waits for the end of a server that was told to end.
  void AwaitGoodEnd();
  // The whole map is in its file once its server has ended well.
  void CheckNoJournal();

  const TermOptions options_;
  Random random_;
  CampaignWorld world_;
  Clients readers_;
  int rounds_whole_ = 0;
  double longest_s_ = 0.0;
};

void TermCampaign::Read(api::Database& db, const api::Call& call) {
  const auto check = [this](const char* what, const absl::Status& status) {
    if (!Expected(status)) world_.violations().Check(what, status);
  };
  const auto take = [](const auto&) { return absl::OkStatus(); };
  check("fetch", db.tiles().Fetch(call, kCampaignMap, {}, {}, take));
  check("list", db.scans().List(call, kCampaignMap, {}, take));
  check("poses", db.posegraph().Get(call, kCampaignMap).status());
}

void TermCampaign::StartReaders() {
  for (int i = 0; i < kReaders; ++i) {
    readers_.Add(world_.address(), [this](auto& db, const auto& call) { Read(db, call); });
  }
  readers_.Add(world_.address(), [](auto& db, const auto& call) {
    db.maps()
        .Watch(call, kCampaignMap, {}, [](const auto&) { return absl::OkStatus(); })
        .IgnoreError();
  });
}

void TermCampaign::CheckNoJournal() {
  const std::filesystem::path file =
      world_.folder() / "maps" / absl::StrCat(kCampaignMap, ".strata-wal");
  std::error_code none;
  if (std::filesystem::exists(file, none) && std::filesystem::file_size(file, none) > 0) {
    world_.violations().Add("a journal is left after a good end");
  }
}

void TermCampaign::AwaitGoodEnd() {
  const auto begin = std::chrono::steady_clock::now();
  const int end = world_.AwaitServerEnd();
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
  longest_s_ = std::max(longest_s_, took.count());
  ++rounds_whole_;
  if (end != 0) world_.violations().Add(absl::StrCat("SIGTERM: the server ended with ", end));
  if (took.count() > options_.longest_s) {
    world_.violations().Add(absl::StrCat("SIGTERM: the server ended after ", took.count(), " s"));
  }
  CheckNoJournal();
}

void TermCampaign::Round(int round) {
  const auto up_to = [this](double ms) {
    absl::SleepFor(absl::Milliseconds(random_.Uniform(0.0, ms)));
  };
  const char* const kind = round % 2 == 0 ? "rebuild" : "verify";
  world_.violations().Check(kind, world_.db().jobs().Start({}, kCampaignMap, kind, {}).status());
  world_.AwaitAcknowledged(static_cast<std::size_t>(random_.Uniform(0.0, 6.0)), absl::Seconds(20));
  up_to(200.0);
  world_.server().Signal(SIGTERM);
  const int way = round % 4;
  if (way == 1) {
    up_to(100.0);
    world_.server().Signal(SIGTERM);
  }
  if (way == 3) {
    up_to(100.0);
    world_.server().Signal(SIGKILL);
    world_.AwaitServerEnd();  // by either
  } else {
    AwaitGoodEnd();
  }
  world_.StartServer();
  world_.CheckAcknowledged();
}

CampaignReport TermCampaign::Run() {
  world_.StartRobots();
  StartReaders();
  for (int round = 0; round < options_.terms; ++round) Round(round);
  readers_.Stop();
  world_.RetireRobotsAndCheck();
  const std::size_t scans = world_.CheckContent(true);
  return {{{"terms", options_.terms},
           {"terms_without_kill", rounds_whole_},
           {"longest_end_s", longest_s_},
           {"scans", static_cast<double>(scans)}},
          world_.violations().All()};
}

}  // namespace

CampaignReport RunTermCampaign(const TermOptions& options) { return TermCampaign(options).Run(); }

}  // namespace strata::testing
