// strata scan list|show|export|delete; import, topics, label, mesh and register have files of their
// own.
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"

#include "client/cli/heights/scan_heights.h"
#include "client/cli/mesh/mesh_commands.h"
#include "client/cli/scan/scan_import.h"
#include "client/cli/scan/scan_label.h"
#include "client/cli/scan/scan_register.h"
#include "client/cli/scan/scan_topics.h"
#include "client/cli/terminal/arguments.h"
#include "client/cli/terminal/command.h"
#include "client/cli/terminal/confirm.h"
#include "client/cli/terminal/json.h"
#include "client/formats/file_bytes.h"
#include "client/formats/geometry_writer.h"
#include "core/common/status.h"

namespace strata::cli {
namespace {

struct ScanOptions {
  std::string map;
  ScanId id;
  api::ScanFilter filter;
  std::string format = "pcd";
  std::string frame = "scan";
  std::string out;
  std::string faded = "with";
  bool yes = false;
};

absl::Status List(Context& context, const ScanOptions& options) {
  Json rows = Json::array();
  STRATA_RETURN_IF_ERROR(context.database.scans().List(
      context.call, options.map, options.filter, [&](const ScanInfo& info) {
        rows.push_back(ToJson(info));
        return absl::OkStatus();
      }));
  context.output.List(rows,
                      {{"id", "ID"},
                       {"state", "STATE"},
                       {"points", "POINTS"},
                       {"point_bytes", "BYTES"},
                       {"time", "TIME"},
                       {"message", "MESSAGE"}});
  return absl::OkStatus();
}

absl::Status Show(Context& context, const ScanOptions& options) {
  STRATA_ASSIGN_OR_RETURN(const ScanInfo info,
                          context.database.scans().Get(context.call, options.map, options.id));
  context.output.Object(ToJson(info));
  return absl::OkStatus();
}

// The points of `chunk`, the first of which is `first` of its scan, that have faded, with the
// number of scans that looked through them as intensity; or those that have not.
PointCloud FadedOrNot(const PointCloud& chunk,
                      const std::vector<std::uint16_t>& faded,
                      std::size_t first,
                      bool wanted) {
  PointCloud part;
  for (std::size_t i = 0; i < chunk.size(); ++i) {
    const std::uint16_t scans = first + i < faded.size() ? faded[first + i] : std::uint16_t{0};
    if ((scans != 0) != wanted) continue;
    part.points.push_back(chunk.points[i]);
    if (wanted) {
      part.intensity.push_back(scans);
    } else if (!chunk.intensity.empty()) {
      part.intensity.push_back(chunk.intensity[i]);
    }
    if (!chunk.colour.empty()) part.colour.push_back(chunk.colour[i]);
    if (!chunk.label.empty()) part.label.push_back(chunk.label[i]);
  }
  return part;
}

// The points with their columns; a grid is not kept, since no writer of ours has one.
absl::Status Export(Context& context, const ScanOptions& options) {
  STRATA_ASSIGN_OR_RETURN(const ScanInfo info,
                          context.database.scans().Get(context.call, options.map, options.id));
  std::vector<std::uint16_t> faded;
  if (options.faded != "with") {
    STRATA_ASSIGN_OR_RETURN(
        faded, context.database.scans().GetFaded(context.call, options.map, options.id));
  }
  Geometry all;
  std::size_t first = 0;
  STRATA_RETURN_IF_ERROR(context.database.scans().GetPoints(
      context.call, options.map, options.id, [&](const PointCloud& chunk) {
        const Geometry piece = GeometryOf(
            options.faded == "with" ? chunk
                                    : FadedOrNot(chunk, faded, first, options.faded == "only"));
        first += chunk.size();
        const auto append = [](auto& to, const auto& from) {
          to.insert(to.end(), from.begin(), from.end());
        };
        append(all.vertices, piece.vertices);
        append(all.colour, piece.colour);
        append(all.intensity, piece.intensity);
        append(all.label, piece.label);
        return absl::OkStatus();
      }));
  if (options.frame == "map") {
    for (Eigen::Vector3d& p : all.vertices) {
      p = info.T_map_scan * p;
    }
  }
  STRATA_ASSIGN_OR_RETURN(const std::string bytes,
                          options.format == "pcd" ? PcdBytes(all) : PlyBytes(all));
  STRATA_RETURN_IF_ERROR(WriteFileBytes(options.out, bytes));
  context.output.Object({{"file", options.out},
                         {"id", options.id.ToString()},
                         {"frame", options.frame},
                         {"points", all.vertices.size()},
                         {"bytes", bytes.size()}});
  return absl::OkStatus();
}

absl::Status Delete(Context& context, const ScanOptions& options) {
  STRATA_RETURN_IF_ERROR(Confirm(
      options.yes,
      absl::StrCat("delete scan ", options.id.ToString(), " of ", options.map, " for good?")));
  STRATA_RETURN_IF_ERROR(context.database.scans().Delete(context.call, options.map, options.id));
  context.output.Object({{"deleted", options.id.ToString()}});
  return absl::OkStatus();
}

void AddList(Commands& commands, CLI::App* noun, const std::shared_ptr<ScanOptions>& options) {
  CLI::App* list = commands.Verb(noun,
                                 "list",
                                 "Scans of a map in the order in which they were committed",
                                 "strata scan list campus --trajectory segway --state failed",
                                 [options](Context& context) { return List(context, *options); });
  AddMapName(list, options->map);
  list->add_option("--trajectory", options->filter.trajectory, "Only this trajectory");
  list->add_option_function<std::string>(
          "--state",
          [options](const std::string& text) {
            options->filter.state = text == "pending"      ? ScanState::kPending
                                    : text == "integrated" ? ScanState::kIntegrated
                                                           : ScanState::kFailed;
          },
          "Only scans in this state")
      ->check(CLI::IsMember({"pending", "integrated", "failed"}));
  AddNumbers(
      list,
      "--box",
      "X0,Y0,X1,Y1",
      4,
      4,
      [options](const std::vector<double>& n) {
        if (n[0] > n[2] || n[1] > n[3]) {
          throw CLI::ValidationError("--box", "expected X0 <= X1 and Y0 <= Y1");
        }
        options->filter.box =
            Eigen::AlignedBox2d(Eigen::Vector2d(n[0], n[1]), Eigen::Vector2d(n[2], n[3]));
      },
      "Only scans whose points reach into this box [m]");
}

void AddExport(Commands& commands, CLI::App* noun, const std::shared_ptr<ScanOptions>& options) {
  CLI::App* app =
      commands.Verb(noun,
                    "export",
                    "Write the points of a scan as they were uploaded, with the labels that count: "
                    "a person's, else the uploaded one, else a classifier's",
                    "strata scan export campus segway/12 --format pcd --out scan.pcd",
                    [options](Context& context) { return Export(context, *options); });
  AddMapName(app, options->map);
  AddScanId(app, options->id);
  app->add_option(
         "--format",
         options->format,
         "pcd or ply, binary: x y z and, where the scan has them, intensity, colour, label")
      ->check(CLI::IsMember({"pcd", "ply"}))
      ->capture_default_str();
  app->add_option("--frame", options->frame, "scan: as uploaded; map: at its current pose")
      ->check(CLI::IsMember({"scan", "map"}))
      ->capture_default_str();
  app->add_option(
         "--faded",
         options->faded,
         "with: all points; without: those that the map holds; only: those that have faded, "
         "with the number of scans that looked through them as intensity")
      ->check(CLI::IsMember({"with", "without", "only"}))
      ->capture_default_str();
  app->add_option("--out", options->out, "The file to write")->type_name("FILE")->required();
}

}  // namespace

void AddScanCommands(Commands& commands) {
  auto options = std::make_shared<ScanOptions>();
  CLI::App* noun = commands.Noun(
      "scan", "Uploads of robots", "strata scan import campus scans/ --poses poses.txt --wait");
  AddScanImport(commands, noun);
  AddScanTopics(commands, noun);
  AddList(commands, noun, options);
  const auto map_verb = MapVerbs(commands, noun, options);
  const auto verb = [&](const char* name, const char* description, const char* example, auto run) {
    CLI::App* app = map_verb(name, description, example, run);
    AddScanId(app, options->id);
    return app;
  };
  verb("show",
       "One scan, its state and how it was aligned",
       "strata scan show campus segway/12",
       Show);
  AddExport(commands, noun, options);
  AddScanLabel(commands, noun);
  AddScanMesh(commands, noun);
  AddScanHeights(commands, noun);
  AddScanRegister(commands, noun);
  AddYes(verb("delete",
              "Take a scan and its contribution out of the map",
              "strata scan delete campus segway/12",
              Delete),
         options->yes);
}

}  // namespace strata::cli
