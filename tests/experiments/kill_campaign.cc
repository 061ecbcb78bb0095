// Processes that are killed under load: what was acknowledged must be there, once and whole.
// Numbers and what did not hold as JSON on stdout; 1 if anything did not.
#include "tests/integration/campaigns/kill_campaign.h"

#include <cstdlib>
#include <filesystem>
#include <functional>
#include <iostream>
#include <memory>
#include <string>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "tests/integration/campaigns/clock_campaign.h"
#include "tests/integration/campaigns/term_campaign.h"
#include "tests/integration/cluster/cluster_campaign.h"
#include "tests/support/temp_dir.h"

namespace strata::testing {
namespace {

constexpr int kLeftOut = 77;

int Print(const std::string& campaign, const CampaignOptions& world, const CampaignReport& report) {
  nlohmann::ordered_json out;
  out["campaign"] = campaign;
  out["seed"] = world.seed;
  for (const auto& [name, number] : report.numbers) out[name] = number;
  out["violations"] = report.violations;
  std::cout << out.dump(2) << std::endl;
  return report.violations.empty() ? 0 : 1;
}

int Main(int argc, char** argv) {
  setenv("GLOG_minloglevel", "1", 0);  // of the servers
  CLI::App app("Campaigns of killed processes");
  const TempDir folder;
  CampaignOptions world;
  world.folder = folder.path();
  app.add_option("--seed", world.seed, "Of all choices")->capture_default_str();
  app.add_option("--robots", world.robots, "At most 8")->capture_default_str();
  app.add_option("--period-ms", world.period_ms, "Of a robot, between scans")
      ->capture_default_str();
  app.add_option("--columns", world.columns, "Of a scan, with 32 rings")->capture_default_str();
  app.add_flag("--align", world.align, "Let the server align the scans");
  app.fallthrough();
  app.require_subcommand(1);
  std::function<int()> run;
  int several_servers = 3;

  KillOptions kills;
  CLI::App* kill = app.add_subcommand("kills", "Server and robots are killed (SIGKILL)");
  kill->add_option("--server-kills", kills.server_kills, "")->capture_default_str();
  kill->add_option("--robot-kills", kills.robot_kills, "")->capture_default_str();
  kill->add_flag("--work", kills.work, "Jobs, deletions, labels, backups, another map meanwhile");
  kill->callback([&] {
    run = [&] {
      kills.world = world;
      return Print("kills", world, RunKillCampaign(kills));
    };
  });

  TermOptions terms;
  CLI::App* term = app.add_subcommand("terms", "The server is told to end (SIGTERM) under load");
  term->add_option("--terms", terms.terms, "")->capture_default_str();
  term->callback([&] {
    run = [&] {
      terms.world = world;
      return Print("terms", world, RunTermCampaign(terms));
    };
  });

  ClockOptions jumps;
  CLI::App* clock = app.add_subcommand("clock", "The wall clock is set forward and back");
  clock->add_option("--jumps", jumps.jumps, "While it serves, and as many between runs")
      ->capture_default_str();
  clock->callback([&] {
    run = [&] {
      jumps.world = world;
      return Print("clock", world, RunClockCampaign(jumps));
    };
  });

  ClusterOptions several;
  CLI::App* cluster = app.add_subcommand(
      "cluster", "Servers of one database are killed and frozen, and the database crashes");
  cluster->add_option("--servers", several_servers, "")->capture_default_str();
  cluster->add_option("--role", world.roles, "Of one server after the other, again for each")
      ->delimiter(';');
  cluster->add_option("--faults", several.faults, "")->capture_default_str();
  cluster->add_option("--robot-kills", several.robot_kills, "")->capture_default_str();
  cluster->add_flag(
      "--work", several.work, "Jobs, deletions, labels, backups, another map meanwhile");
  cluster->add_flag(
      "!--no-fence", several.fenced, "Commits do not ask whose the map is; 1 unless that is found");
  cluster->callback([&] {
    run = [&] {
      several.world = world;
      several.world.servers = several_servers;
      const auto report = RunClusterCampaign(several);
      if (absl::IsFailedPrecondition(report.status())) return kLeftOut;
      const int found = Print(
          "cluster", world, report.value_or(CampaignReport{{}, {report.status().ToString()}}));
      return several.fenced ? found : 1 - found;
    };
  });

  CLI11_PARSE(app, argc, argv);
  std::cerr << "seed " << world.seed << std::endl;
  return run();
}

}  // namespace
}  // namespace strata::testing

int main(int argc, char** argv) { return strata::testing::Main(argc, argv); }
