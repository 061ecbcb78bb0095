// strata localize
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_format.h"

#include "client/cli/terminal/arguments.h"
#include "client/cli/terminal/command.h"
#include "client/cli/terminal/world_json.h"
#include "client/formats/scan_reader.h"
#include "core/common/status.h"

namespace strata::cli {
namespace {

struct LocalizeOptions {
  std::string map;
  std::string file;
  std::string format = "auto";
  std::optional<Pose> T_map_file_guess;
  double radius_m = LocalizeQuery().guess_radius_m;
};

// The search for a cloud whose coordinates in the file begin at `origin`: T_map_cloud is
// T_map_file with the origin in it.
LocalizeQuery QueryOf(PointCloud cloud, const LocalizeOptions& options) {
  LocalizeQuery query;
  query.guess_radius_m = options.radius_m;
  query.T_map_scan_guess = options.T_map_file_guess;
  if (query.T_map_scan_guess.has_value()) query.T_map_scan_guess->translate(cloud.origin);
  query.cloud = std::move(cloud);
  query.cloud.origin.setZero();
  return query;
}

void PrintText(const LocalizeResult& result, Output& output) {
  output.Verdict((result.found ? "found: " : "not found: ") + result.message, result.found);
  if (result.found) {
    const Json best = ToJson(result.best);
    output.Object(best);
    const Vector6d sigma = result.covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
    output.Text(
        absl::StrFormat("sigma  %.3f m, %.4f rad", sigma.tail<3>().norm(), sigma.head<3>().norm()));
  }
  if (result.others.empty()) return;
  output.Text("");
  Json rows = Json::array();
  for (const LocalizeCandidate& other : result.others) rows.push_back(ToJson(other));
  output.List(rows,
              {{"place", "ALSO LIKE"},
               {"confidence", "CONFIDENCE"},
               {"overlap", "OVERLAP"},
               {"rms_m", "RMS"},
               {"pose", "X, Y, Z, QX, QY, QZ, QW"}});
}

absl::Status Localize(Context& context, const LocalizeOptions& options) {
  STRATA_ASSIGN_OR_RETURN(const ScanFormat format, ParseScanFormat(options.format));
  STRATA_ASSIGN_OR_RETURN(PointCloud cloud, ReadScan(options.file, format));
  const Eigen::Vector3d origin = cloud.origin;
  STRATA_ASSIGN_OR_RETURN(LocalizeResult result,
                          context.database.posegraph().Localize(
                              context.call, options.map, QueryOf(std::move(cloud), options)));
  result.best.T_map_scan.translate(-origin);
  for (LocalizeCandidate& other : result.others) other.T_map_scan.translate(-origin);
  if (context.output.text()) {
    PrintText(result, context.output);
  } else {
    context.output.Object(ToJson(result));
  }
  return absl::OkStatus();
}

}  // namespace

void AddLocalizeCommand(Commands& commands) {
  auto options = std::make_shared<LocalizeOptions>();
  CLI::App* app = commands.Verb(
      &commands.root,
      "localize",
      "Where a scan was taken: the pose of its frame in the map, and how sure that is; exit 0 also "
      "when no place is good enough",
      "strata localize campus scan.pcd --guess 12,-3,0.5,1.57 --radius 10",
      [options](Context& context) { return Localize(context, *options); });
  AddMapName(app, options->map);
  app->add_option("FILE", options->file, "A scan in any format that scan import takes")->required();
  app->add_option("--format",
                  options->format,
                  "auto, 3dtk, pcd, ply, kitti, nuscenes, vtk, xyz, oakland, las, ptx, e57 "
                  "or velodyne")
      ->capture_default_str();
  AddPose(
      app,
      "--guess",
      [options](const Pose& pose, std::size_t) { options->T_map_file_guess = pose; },
      "Roughly where its frame is in the map [m, degrees]; without it, anywhere");
  app->add_option("--radius", options->radius_m, "Only places so near to the guess [m]")
      ->capture_default_str();
}

}  // namespace strata::cli
