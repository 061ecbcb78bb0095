#include "client/cli/scan/scan_import.h"

#include <algorithm>
#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"

#include "client/cli/scan/import_run.h"
#include "client/cli/scan/import_sources.h"
#include "client/cli/scan/scan_uploader.h"
#include "client/cli/scan/spool_commands.h"
#include "client/cli/terminal/arguments.h"
#include "client/cli/terminal/json.h"
#include "client/formats/bags/bag_scans.h"
#include "core/common/status.h"

namespace strata::cli {
namespace {

absl::Status Import(Context& context, ImportOptions options) {
  if (options.trajectory.empty()) options.trajectory = TrajectoryOf(options.paths.front());
  STRATA_ASSIGN_OR_RETURN(ImportSources sources, FindImportSources(context, options));
  if (options.as_local_maps) {
    STRATA_ASSIGN_OR_RETURN(const MapInfo map,
                            context.database.maps().Get(context.call, options.map));
    for (UploadSource& source : sources.missing) source.as_local_map = map.parameters;
  }
  ImportSummary summary = Begun(sources);
  Upload(context, options, sources.missing, summary);
  TakeCounts(*sources.counts, summary, context.output);
  const absl::Status waited =
      options.wait && !summary.interrupted ? Wait(context, options, summary) : absl::OkStatus();
  summary.interrupted = context.call.stop.requested();
  Print(options, summary, context.output);
  if (summary.interrupted) {
    return absl::CancelledError("interrupted; the same command goes on where this one stopped");
  }
  STRATA_RETURN_IF_ERROR(waited);
  return ErrorsOf(summary.errors, summary.files);
}

absl::Status ImportBySpool(FileContext& context, ImportOptions options) {
  if (options.trajectory.empty()) options.trajectory = TrajectoryOf(options.paths.front());
  STRATA_ASSIGN_OR_RETURN(const ImportSources sources, FindImportSources(context, options));
  Json json = {{"map", options.map},
               {"trajectory", options.trajectory},
               {"files", sources.files},
               {"errors", Begun(sources).errors}};
  STRATA_RETURN_IF_ERROR(
      ImportIntoSpool(context, options.spool, options.map, sources.missing, json));
  json["range_0"] = sources.counts->at_sensor.load();
  json["deskewed"] = sources.counts->deskewed.load();
  json["not_deskewed"] = sources.counts->not_deskewed();
  TalkOfMotion(*sources.counts, context.output);
  if (std::any_of(sources.missing.begin(), sources.missing.end(), [](const UploadSource& source) {
        return source.pose_information.has_value();
      })) {
    context.output.Talk("by way of a spool poses of GPS become no priors of the pose graph");
  }
  const Json errors = json["errors"];
  TalkOf(errors, context.output);
  if (context.output.text()) json.erase("errors");
  context.output.Object(json);
  return ErrorsOf(errors, sources.files);
}

// Selects the one of the two ways that the options say.
void Select(Commands& commands, const std::shared_ptr<ImportOptions>& options) {
  if (!options->spool.empty()) {
    commands.selected_on_files = [options](FileContext& context) {
      return ImportBySpool(context, *options);
    };
    return;
  }
  commands.selected = [options](Context& context) { return Import(context, *options); };
}

void AddRecordingOptions(CLI::App* import, const std::shared_ptr<ImportOptions>& options) {
  import
      ->add_option(
          "--topic",
          options->topic,
          "Of a recording: the topic of sensor_msgs/PointCloud2, or of sensor_msgs/LaserScan; not "
          "needed where there is one only. 'strata scan topics' lists them")
      ->type_name("TOPIC");
  import
      ->add_option(
          "--poses-from",
          options->poses_from,
          "Of a recording: a topic of nav_msgs/Odometry, geometry_msgs/PoseStamped or "
          "geometry_msgs/PoseWithCovarianceStamped, or transforms as in 'tf:map->base_link'. "
          "The pose of a cloud is interpolated at its stamp")
      ->type_name("TOPIC|tf:A->B");
  import
      ->add_option(
          "--every",
          options->every,
          absl::StrCat("Of a recording: keep a cloud when it lies so far from the one kept "
                       "last, turned or later: m, deg, rad, s, with commas between; 0m: all "
                       "[",
                       kDefaultEvery,
                       "]"))
      ->type_name("DISTANCE");
  AddPose(
      import,
      "--mount",
      [options](const Pose& pose, std::size_t) { options->mount = pose; },
      "Of a recording without the transforms: where the sensor is on what the poses are those of "
      "[m, degrees]");
  import
      ->add_option("--urdf",
                   options->urdf,
                   "Of a recording without the transforms: the robot's description, whose joints "
                   "move as sensor_msgs/JointState says")
      ->type_name("FILE");
  import
      ->add_option("--sweep",
                   options->sweep_s,
                   absl::StrCat("Of a laser (sensor_msgs/LaserScan) that a joint turns or tilts: "
                                "the lines of so many seconds are a scan [",
                                kDefaultSweepS,
                                "]"))
      ->check(CLI::Range(0.01, 600.0))
      ->type_name("SECONDS");
}

}  // namespace

void AddScanImport(Commands& commands, CLI::App* noun) {
  auto options = std::make_shared<ImportOptions>();
  CLI::App* import = commands.Verb(
      noun,
      "import",
      "Upload files or folders of scans, a folder with a folder of scans, or the keyframes of a "
      "recording of ROS 1 or 2; what the trajectory already has is skipped",
      "strata scan import campus scans/ --poses poses.txt --trajectory segway --wait\n"
      "  strata scan import campus drive.mcap --topic /points --poses-from /odom --every 0.5m",
      [options](Context& context) { return Import(context, *options); });
  AddMapName(import, options->map);
  import
      ->add_option("PATH",
                   options->paths,
                   "Files or folders of scans, of .ptx and .e57 all that a file holds, with its "
                   "poses, of .pcap (Velodyne VLP-16, HDL-32E) all revolutions; or one recording: "
                   ".mcap, .db3, .bag, a folder of rosbag2")
      ->required();
  AddRecordingOptions(import, options);
  import
      ->add_option("--format",
                   options->format,
                   "Format of the scans; auto: by content or ending (.pcd .ply .bin .pcd.bin .vtk "
                   ".3d .las .laz .ptx .e57 .pcap "
                   ".xyz .csv .asc .pts, .txt if named)")
      ->check(CLI::IsMember({"auto",
                             "3dtk",
                             "pcd",
                             "ply",
                             "kitti",
                             "nuscenes",
                             "vtk",
                             "xyz",
                             "oakland",
                             "las",
                             "ptx",
                             "e57",
                             "velodyne"}))
      ->capture_default_str();
  import
      ->add_option(
          "--poses",
          options->poses,
          "File with the poses T_map_scan of the scans, or a folder of .pose files; without it "
          ".pose files beside .3d files, or the one poses*.txt|tum|csv in the folder; none: every "
          "scan is at the origin. Not for .las, .laz, .ptx and .e57, which say where they are. A "
          "trajectory of strata egomotion gives each scan the pose of the "
          "time that its name is (1432235498.028276.pcd); on earth, poses and their covariance "
          "every 10 "
          "s become priors of the pose graph, which optimize may reject")
      ->type_name("FILE|none");
  AddPose(
      import,
      "--sensor",
      [options](const Pose& pose, std::size_t) { options->T_body_scan = pose; },
      "Where the sensor sits on the robot, for poses of a trajectory [m, degrees]");
  import
      ->add_option(
          "--pose-format",
          options->pose_format,
          "tum: time x y z qx qy qz qw; index-tum: index before that, the last number in a "
          "file's name; kitti: 12 numbers, line 0 for index 0, a camera's taken to the lidar "
          "by the Tr of calib.txt; 3dtk: .pose files")
      ->check(CLI::IsMember({"auto", "tum", "index-tum", "kitti", "3dtk"}))
      ->capture_default_str();
  import->add_option("--trajectory",
                     options->trajectory,
                     "Its name; default: that of the folder or of the recording");
  import
      ->add_option(
          "--align", options->align, "on: register each scan to the map; off: take its pose")
      ->check(CLI::IsMember({"on", "off"}))
      ->capture_default_str();
  import
      ->add_option("--deskew",
                   options->deskew,
                   "on: where points have times (fields t, time, timestamp, offset_time, …) and "
                   "poses are known over time (a recording, or --poses with a trajectory), move "
                   "each to where it was at the scan's stamp; off: the clouds are without "
                   "distortion already")
      ->check(CLI::IsMember({"on", "off"}))
      ->capture_default_str();
  CLI::Option* classes =
      import
          ->add_option("--classes",
                       options->classes,
                       "Which labels of the files are which class of the map, to which new ones "
                       "are added; other labels are left out. Without it labels are ids of classes")
          ->type_name("'NAME=LABEL,…;…'|FILE");
  import->add_flag("--no-labels", options->without_labels, "Leave out what files say points are")
      ->excludes(classes);
  import->add_flag("--far", options->far, "Also scans more than 10 km from the map and each other");
  import->add_flag("--level", options->level, "Turn all poses so that the dominant floor is level");
  CLI::Option* wait =
      import->add_flag("--wait", options->wait, "Return when every scan is integrated or failed");
  CLI::Option* local_maps = import->add_flag(
      "--local-maps",
      options->as_local_maps,
      "Make the local maps here and send them in place of the points, of which there are fewer "
      "bytes; such scans have no points to export, label or classify");
  import
      ->add_option("--spool",
                   options->spool,
                   "Put the scans into this directory first, where they are safe until the server "
                   "has acknowledged them; done also when it is away: strata spool send goes on")
      ->type_name("DIR")
      ->excludes(classes)
      ->excludes(wait)
      ->excludes(local_maps);
  import->callback(std::bind(&Select, std::ref(commands), options));
}

}  // namespace strata::cli
