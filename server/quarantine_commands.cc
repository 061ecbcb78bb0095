#include "server/quarantine_commands.h"

#include <memory>
#include <ostream>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"

#include "core/common/status.h"
#include "core/engine/map/idle_map.h"
#include "core/engine/map/quarantine_file.h"

namespace strata::server {
namespace {

struct Written {
  std::string directory;
  std::string store;
  std::string map;
  std::vector<std::string> work;  // "scan" "robot/7"

  MapPlace place() const { return {directory, store}; }
};

const char* StateOf(const QuarantineEntry& entry) {
  if (entry.held) return "quarantined";
  return entry.attempt.under_way ? "under way" : "suspect";
}

absl::Status List(const Written& written, std::ostream& out) {
  STRATA_ASSIGN_OR_RETURN(const std::vector<QuarantineEntry> entries,
                          ListQuarantine(written.place(), written.map));
  constexpr char kRow[] = "%-32s %-12s %-7s %s\n";
  out << absl::StreamFormat(kRow, "work", "state", "deaths", "message");
  for (const QuarantineEntry& entry : entries) {
    out << absl::StreamFormat(
        kRow, entry.name, StateOf(entry), std::to_string(entry.attempt.deaths), entry.message);
  }
  return absl::OkStatus();
}

CLI::App* AddVerb(CLI::App& quarantine,
                  const std::string& name,
                  const std::string& help,
                  Written& written) {
  CLI::App* verb = quarantine.add_subcommand(name, help);
  verb->add_option("MAP", written.map, "Name of the map")->required();
  CLI::Option_group* place = verb->add_option_group("Where the map lies, one of");
  place->add_option("--data", written.directory, "The directory that stratad --data names")
      ->type_name("DIR");
  place
      ->add_option("--store",
                   written.store,
                   "The database that stratad --store names; no server may have the map open")
      ->type_name("postgresql://USER@HOST/DATABASE");
  place->require_option(1);
  return verb;
}

void AddWork(CLI::App& verb, const std::string& what, Written& written) {
  verb.add_option("WORK", written.work, what)->required()->expected(1, 2);
}

}  // namespace

void AddQuarantineCommands(CLI::App& app, CommandAction& selected) {
  const auto written = std::make_shared<Written>();
  CLI::App* quarantine = app.add_subcommand(
      "quarantine", "Work that the server died of twice, of a map that no server has open");
  quarantine->require_subcommand(1);
  CLI::App* list = AddVerb(*quarantine,
                           "list",
                           "What is in quarantine, suspected, or was under way at the last end",
                           *written);
  list->footer("Example:\n  stratad quarantine list campus --data ./maps");
  list->callback([written, &selected] {
    selected = [written](std::ostream& out) { return List(*written, out); };
  });
  CLI::App* add =
      AddVerb(*quarantine, "add", "Put a scan or job that waits into quarantine", *written);
  AddWork(*add, "scan TRAJECTORY/SEQUENCE or job ID", *written);
  add->footer("Example:\n  stratad quarantine add campus scan robot/7 --data ./maps");
  add->callback([written, &selected] {
    selected = [written](std::ostream&) {
      return AddToQuarantine(written->place(), written->map, absl::StrJoin(written->work, " "));
    };
  });
  CLI::App* release = AddVerb(*quarantine,
                              "release",
                              "Take it back: it waits again, and its deaths are forgotten",
                              *written);
  AddWork(*release, "scan TRAJECTORY/SEQUENCE, job ID, rebuild, look or prepare", *written);
  release->footer("Example:\n  stratad quarantine release campus job 3 --data ./maps");
  release->callback([written, &selected] {
    selected = [written](std::ostream&) {
      return ReleaseFromQuarantine(
          written->place(), written->map, absl::StrJoin(written->work, " "));
    };
  });
}

}  // namespace strata::server
