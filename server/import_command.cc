#include "server/import_command.h"

#include <memory>
#include <ostream>
#include <string>

#include "absl/status/status.h"

#include "core/common/status.h"
#include "core/common/stop.h"
#include "core/engine/map/idle_map.h"

namespace strata::server {
namespace {

struct WrittenImport {
  std::string map;
  std::string file;
  std::string directory;
  std::string store;
};

absl::Status Import(const WrittenImport& written, std::ostream& out) {
  STRATA_RETURN_IF_ERROR(
      ImportMap({written.directory, written.store}, written.map, written.file, Stop()));
  out << "map " << written.map << " imported" << std::endl;
  return absl::OkStatus();
}

}  // namespace

void AddImportCommand(CLI::App& app, CommandAction& selected) {
  const auto written = std::make_shared<WrittenImport>();
  CLI::App* import = app.add_subcommand(
      "import", "Make a map of a map file: a backup, or one of another directory");
  import->add_option("MAP", written->map, "Name of the new map")->required();
  import->add_option("FILE", written->file, "As strata map backup writes it")->required();
  CLI::Option_group* place = import->add_option_group("Where the map is to lie, one of");
  place
      ->add_option("--data",
                   written->directory,
                   "The directory that stratad --data names; no server may have it")
      ->type_name("DIR");
  place
      ->add_option("--store",
                   written->store,
                   "The database that stratad --store names; servers may go on using it")
      ->type_name("postgresql://USER@HOST/DATABASE");
  place->require_option(1);
  import->footer(
      "All of it or nothing, also when it is killed. FILE stays as it is. A database takes files\n"
      "of this program's format that no server has: import an older one into an empty directory\n"
      "first, and then its file there.\n\n"
      "Example:\n  stratad import campus campus.strata --data ./maps");
  import->callback([written, &selected] {
    selected = [written](std::ostream& out) { return Import(*written, out);
};
}  // namespace strata::server
);
}

}  // namespace strata::server
