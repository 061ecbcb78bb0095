// Disks that fail, fill up and lose power at every moment of a map's short life.
//
//   disk_campaign [--only NAME…] [--every N] [--first N] [--seed N]
//   disk_campaign --flips N [--only blob|column|anywhere|TABLE.COLUMN…] [--seed N]
//
// Progress on stderr, a table on stdout; 1 where a promise was broken. A disk that ignores syncs
// must break them: the row "syncs ignored" has to have violations.
#include "tests/core/engine/disk_campaign.h"

#include <algorithm>
#include <cstdint>
#include <functional>
#include <iostream>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/str_format.h"
#include <CLI/CLI.hpp>
#include <glog/logging.h>

#include "tests/core/engine/bit_flips.h"

namespace strata::testing {
namespace {

constexpr std::int64_t kPageBytes = 4096;  // a disk fills up byte by byte, a map by pages

struct Campaign {
  std::string name;
  std::function<SweepResult(const DiskCampaign&, const Sweep&)> run;
  bool must_break = false;
};

std::vector<Campaign> Campaigns() {
  const std::vector<std::pair<std::string, DiskFault>> faults = {{"write", DiskFault::kWrite},
                                                                 {"fsync", DiskFault::kSync},
                                                                 {"open", DiskFault::kOpen},
                                                                 {"truncate", DiskFault::kTruncate},
                                                                 {"delete", DiskFault::kDelete},
                                                                 {"shm", DiskFault::kShm},
                                                                 {"read", DiskFault::kRead}};
  std::vector<Campaign> campaigns;
  for (const auto& [name, fault] : faults) {
    const DiskFault kind = fault;
    campaigns.push_back({name + ", once", [kind](const DiskCampaign& disks, const Sweep& sweep) {
                           return disks.FailOnce(kind, sweep);
                         }});
    campaigns.push_back(
        {name + ", until mended", [kind](const DiskCampaign& disks, const Sweep& sweep) {
           return disks.FailUntilMended(kind, sweep);
         }});
    campaigns.push_back(
        {name + ", on opening", [kind](const DiskCampaign& disks, const Sweep& sweep) {
           return disks.FailOnOpening(kind, sweep);
         }});
  }
  campaigns.push_back({"full", [](const DiskCampaign& disks, const Sweep& sweep) {
                         Sweep pages = sweep;
                         pages.every *= kPageBytes;
                         return disks.FillUp(pages);
                       }});
  campaigns.push_back({"power", [](const DiskCampaign& disks, const Sweep& sweep) {
                         return disks.CutPower(false, sweep);
                       }});
  campaigns.push_back(
      {"syncs ignored",
       [](const DiskCampaign& disks, const Sweep& sweep) { return disks.CutPower(true, sweep); },
       true});
  return campaigns;
}

void PrintAll(const std::string& what, const std::vector<std::string>& texts) {
  for (const std::string& text : texts) std::cerr << what << ": " << text << '\n';
}

int RunCampaigns(const std::vector<std::string>& only, Sweep sweep) {
  const auto prepared = DiskCampaign::Prepare();
  if (!prepared.ok()) {
    std::cerr << "undisturbed: " << prepared.status() << '\n';
    return 1;
  }
  bool broken = false;
  std::cout << absl::StreamFormat("seed %d, every %d\n", sweep.seed, sweep.every);
  std::cout << absl::StreamFormat("%-24s %8s %8s %8s %8s %10s\n",
                                  "disk",
                                  "moments",
                                  "trials",
                                  "steps",
                                  "restarts",
                                  "violations");
  for (const Campaign& campaign : Campaigns()) {
    if (!only.empty() && std::none_of(only.begin(), only.end(), [&](const std::string& name) {
          return absl::StartsWith(campaign.name, name);
        })) {
      continue;
    }
    sweep.progress = [&](const std::string& trial) {
      std::cerr << campaign.name << ": " << trial << '\n';
    };
    const SweepResult result = campaign.run(*prepared, sweep);
    std::cout << absl::StreamFormat("%-24s %8d %8d %8d %8d %10d\n",
                                    campaign.name,
                                    result.moments,
                                    result.trials,
                                    result.steps_failed,
                                    result.restarts,
                                    result.violations.size())
              << std::flush;
    if (!campaign.must_break) PrintAll("violation", result.violations);
    broken = broken || result.violations.empty() == campaign.must_break;
  }
  return broken ? 1 : 0;
}

constexpr char kFlipRow[] = "%-70s %7d %7d %7d %7d %7d %7d %7d %10d\n";

void PrintFlips(const std::string& name, const FlipResult& r) {
  std::cout << absl::StreamFormat(kFlipRow,
                                  name,
                                  r.trials,
                                  r.refused,
                                  r.told,
                                  r.same,
                                  r.wrong,
                                  r.unnamed,
                                  r.mended,
                                  r.violations.size())
            << std::flush;
  PrintAll("violation", r.violations);
  PrintAll("wrong", r.wrong_answers);
}

// `seeds` of every column, and ten times as many anywhere.
int RunFlips(const std::vector<std::string>& only, std::uint64_t first, std::uint64_t seeds) {
  bool broken = false;
  std::cout << absl::StreamFormat("seeds %d to %d\n%-70s %7s %7s %7s %7s %7s %7s %7s %10s\n",
                                  first,
                                  first + seeds - 1,
                                  "bit of",
                                  "trials",
                                  "refused",
                                  "told",
                                  "same",
                                  "wrong",
                                  "unnamed",
                                  "mended",
                                  "violations");
  for (const bool keep_points : {true, false}) {
    const auto flips = BitFlips::Prepare(keep_points);
    if (!flips.ok()) {
      std::cerr << "sound map: " << flips.status() << '\n';
      return 1;
    }
    const auto wanted = [&only](const std::string& name) {
      return only.empty() || std::any_of(only.begin(), only.end(), [&](const std::string& begin) {
               return absl::StartsWith(name, begin);
             });
    };
    for (const FlipKind& kind : flips->kinds()) {
      if (!keep_points && kind.table != "truth_local_map") continue;
      if (!wanted(kind.blob ? "blob" : "column") && !wanted(kind.name())) continue;
      FlipResult result;
      for (std::uint64_t i = 0; i < seeds; ++i) flips->FlipIn(kind, first + i, result);
      PrintFlips(kind.name(), result);
      broken = broken || !result.violations.empty();
    }
    if (!wanted("anywhere")) continue;
    FlipResult result;
    for (std::uint64_t i = 0; i < 10 * seeds; ++i) flips->FlipAnywhere(first + i, result);
    PrintFlips(keep_points ? "anywhere" : "anywhere, no points", result);
    broken = broken || !result.violations.empty();
  }
  return broken ? 1 : 0;
}

}  // namespace
}  // namespace strata::testing

int main(int argc, char** argv) {
  CLI::App app("Disks that fail, fill up and lose power at every moment of a map's short life.");
  std::vector<std::string> only;
  strata::testing::Sweep sweep;
  app.add_option("--only", only, "rows of the table that begin so");
  app.add_option(
         "--every", sweep.every, "moments from trial to trial; of a disk that fills up, pages")
      ->check(CLI::PositiveNumber);
  app.add_option("--first", sweep.first, "moment of the first trial")
      ->check(CLI::NonNegativeNumber);
  app.add_option("--seed", sweep.seed, "of what survives a cut");
  std::uint64_t flips = 0;
  app.add_option("--flips", flips, "bits of every column, in place of the disks");
  CLI11_PARSE(app, argc, argv);
  FLAGS_minloglevel = google::GLOG_FATAL;  // errors are what this is about
  return flips > 0 ? strata::testing::RunFlips(only, sweep.seed, flips)
                   : strata::testing::RunCampaigns(only, sweep);
}
