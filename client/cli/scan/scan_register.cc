// strata scan register: where one scan is in the frame of another, without a map.
#include "client/cli/scan/scan_register.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_format.h"
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>

#include "client/cli/picture/clouds_picture.h"
#include "client/cli/picture/image.h"
#include "client/cli/terminal/arguments.h"
#include "client/cli/terminal/json.h"
#include "client/formats/file_bytes.h"
#include "client/formats/scan_reader.h"
#include "core/common/status.h"
#include "core/mls/build.h"
#include "core/registration/clouds/icp.h"
#include "core/registration/clouds/thinning.h"
#include "core/registration/mls_registration.h"
#include "core/registration/upright_offsets.h"

namespace strata::cli {
namespace {

constexpr Colour kTargetColour = {150, 150, 146};
constexpr Colour kGuessColour = {240, 190, 150};
constexpr Colour kSourceColour = {34, 84, 160};
// Twice the default, as for maps: a registration depends less on its sample.
constexpr int kSamples = 4000;

struct RegisterOptions {
  std::string source, target;
  std::string format = "auto";
  std::string method = "mls";
  Pose T_target_source_guess = Pose::Identity();
  double max_distance_m = 2.0;
  double thinning_m = 0.1;
  double keep_share = 0.7;
  int max_iterations = 100;
  MlsParameters parameters;
  std::string picture;
};

// Coordinates of the files in, so that both clouds are near zero: T maps origin + p to origin + p.
PointCloud AtZero(PointCloud cloud) {
  cloud.origin.setZero();
  return cloud;
}
Pose FromZero(const PointCloud& source, const PointCloud& target, const Pose& T) {
  return Pose(Eigen::Translation3d(target.origin)) * T * Pose(Eigen::Translation3d(-source.origin));
}

absl::StatusOr<ScanFeatures> FeaturesOf(const PointCloud& cloud, const MlsParameters& parameters) {
  const PointCloud near = AtZero(cloud);
  STRATA_ASSIGN_OR_RETURN(const MlsBuildResult built,
                          BuildMlsMap(near, Pose::Identity(), SensorModel(), parameters));
  ScanFeatureOptions options;
  options.sample_count = kSamples;
  options.sensor_origin = cloud.sensor_origin.cast<double>();
  UprightOffsets offsets(built.map, options.samples_per_metre);
  offsets.Add(near.points);
  return ScanFeatures::FromMap(built.map, options, &offsets);
}

absl::StatusOr<RegistrationResult> RegisterMaps(const PointCloud& source,
                                                const PointCloud& target,
                                                const RegisterOptions& options) {
  MlsRegistrationOptions registration;
  registration.initial_gate_m = options.max_distance_m;
  registration.final_gate_m = std::min(registration.final_gate_m, options.max_distance_m);
  registration.max_iterations = options.max_iterations;
  registration.max_samples = kSamples;
  STRATA_RETURN_IF_ERROR(registration.Validate());
  STRATA_ASSIGN_OR_RETURN(const ScanFeatures moving, FeaturesOf(source, options.parameters));
  STRATA_ASSIGN_OR_RETURN(const ScanFeatures fixed, FeaturesOf(target, options.parameters));
  const Pose guess = Pose(Eigen::Translation3d(-target.origin)) * options.T_target_source_guess *
                     Pose(Eigen::Translation3d(source.origin));
  const RegistrationTarget into(std::vector<PlacedScan>{{&fixed, Pose::Identity()}},
                                {.centre = guess.translation()});
  RegistrationResult result = RegisterScan(moving, into, guess, registration);
  result.T_target_source = FromZero(source, target, result.T_target_source);
  return result;
}

absl::StatusOr<RegistrationResult> RegisterPoints(const PointCloud& source,
                                                  const PointCloud& target,
                                                  const RegisterOptions& options) {
  IcpOptions icp;
  icp.max_distance_m = options.max_distance_m;
  icp.max_iterations = options.max_iterations;
  if (options.method == "trimmed") icp.keep_share = options.keep_share;
  if (options.method == "trimmed" || options.method == "plane") {
    icp.metric = IcpMetric::kPointToPlane;
  }
  if (options.method == "gicp") icp.metric = IcpMetric::kPlaneToPlane;
  return RegisterClouds(ThinCloud(source, options.thinning_m),
                        ThinCloud(target, options.thinning_m),
                        options.T_target_source_guess,
                        icp);
}

// Along the least certain axis; 0 where the matches leave a direction open.
double SigmaOf(const Eigen::Matrix3d& information) {
  const double least = information.selfadjointView<Eigen::Lower>().eigenvalues().minCoeff();
  return least > 0.0 ? 1.0 / std::sqrt(least) : 0.0;
}

Json ReportOf(const RegistrationResult& result, const RegisterOptions& options) {
  return {{"method", options.method},
          {"termination", std::string(ToString(result.termination))},
          {"converged", result.converged()},
          {"T_target_source", ToJson(result.T_target_source)},
          {"overlap", result.overlap},
          {"rms_m", result.rms_m},
          {"inliers", result.inliers},
          {"iterations", result.iterations},
          {"sigma_m", SigmaOf(result.information.bottomRightCorner<3, 3>())},
          {"sigma_rad", SigmaOf(result.information.topLeftCorner<3, 3>())},
          {"undetermined_directions", result.degenerate_directions.size()}};
}

// In the target's axes about the target's origin.
std::vector<Eigen::Vector3d> PointsOf(const PointCloud& cloud,
                                      const Pose& T_target_cloud,
                                      const Eigen::Vector3d& origin) {
  std::vector<Eigen::Vector3d> points;
  for (const Eigen::Vector3f& p : cloud.points) {
    if (p.allFinite()) {
      points.emplace_back(T_target_cloud * (p.cast<double>() + cloud.origin) - origin);
    }
  }
  return points;
}

absl::Status DrawPicture(const PointCloud& source,
                         const PointCloud& target,
                         const Pose& T_target_source,
                         const RegisterOptions& options) {
  const Eigen::Vector3d& origin = target.origin;
  const picture::Image image = picture::DrawClouds({
      {"source as guessed", PointsOf(source, options.T_target_source_guess, origin), kGuessColour},
      {"target", PointsOf(target, Pose::Identity(), origin), kTargetColour},
      {"source", PointsOf(source, T_target_source, origin), kSourceColour},
  });
  STRATA_ASSIGN_OR_RETURN(const std::string bytes, picture::PngBytes(image));
  return WriteFileBytes(options.picture, bytes);
}

absl::Status Run(FileContext& context, const RegisterOptions& options) {
  STRATA_ASSIGN_OR_RETURN(const ScanFormat format, ParseScanFormat(options.format));
  STRATA_ASSIGN_OR_RETURN(const PointCloud source, ReadScan(options.source, format));
  STRATA_ASSIGN_OR_RETURN(const PointCloud target, ReadScan(options.target, format));
  STRATA_ASSIGN_OR_RETURN(const RegistrationResult result,
                          options.method == "mls" ? RegisterMaps(source, target, options)
                                                  : RegisterPoints(source, target, options));
  Json json = ReportOf(result, options);
  if (!options.picture.empty()) {
    STRATA_RETURN_IF_ERROR(DrawPicture(source, target, result.T_target_source, options));
    json["picture"] = options.picture;
  }
  context.output.Object(json);
  if (!result.converged()) {
    context.output.Talk(absl::StrFormat(
        "not converged: %s; a nearer --guess, a larger --max-distance or another --method may help",
        ToString(result.termination)));
  }
  return absl::OkStatus();
}

}  // namespace

void AddScanRegister(Commands& commands, CLI::App* noun) {
  auto options = std::make_shared<RegisterOptions>();
  CLI::App* app = commands.FileVerb(
      noun,
      "register",
      "Where the scan SOURCE is in the frame of TARGET, from files and without a map: the pose, "
      "how much of the source it brings onto the target and how exactly; exit 0 also when it did "
      "not converge",
      "strata scan register b.pcd a.pcd --guess 1.2,0,0,0.1 --method gicp --picture both.png",
      [options](FileContext& context) { return Run(context, *options); });
  app->add_option("SOURCE", options->source, "The scan to move, in any format of scan import")
      ->required();
  app->add_option("TARGET", options->target, "The scan to move it onto")->required();
  app->add_option("--format",
                  options->format,
                  "auto, 3dtk, pcd, ply, kitti, nuscenes, vtk, xyz, oakland, las, ptx, e57 "
                  "or velodyne")
      ->capture_default_str();
  app->add_option(
         "--method",
         options->method,
         "mls: multi-level surfaces, as maps are aligned; of points: icp (point to point), "
         "plane (point to plane), trimmed (that of the nearest pairs only), gicp (plane to plane)")
      ->check(CLI::IsMember({"mls", "icp", "trimmed", "plane", "gicp"}))
      ->capture_default_str();
  AddPose(
      app,
      "--guess",
      [options](const Pose& pose, std::size_t) { options->T_target_source_guess = pose; },
      "Roughly where the source is in the target's frame [m, degrees]; without it, where it says");
  app->add_option("--max-distance",
                  options->max_distance_m,
                  "Farther pairs are none; beyond the guess's "
                  "error [m]")
      ->check(CLI::Range(0.01, 100.0))
      ->capture_default_str();
  app->add_option("--max-iterations", options->max_iterations, "Then it ends where it is")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  app->add_option("--cell-size", options->parameters.cell_size_m, "Of mls: edge of a cell [m]")
      ->check(CLI::Range(0.01, 10.0))
      ->capture_default_str();
  app->add_option("--thin", options->thinning_m, "Of points: one a cube of this edge [m]")
      ->check(CLI::Range(0.001, 10.0))
      ->capture_default_str();
  app->add_option("--keep", options->keep_share, "Of trimmed: the share of pairs that is kept")
      ->check(CLI::Range(0.05, 1.0))
      ->capture_default_str();
  app->add_option("--picture", options->picture, "Draw target and source over each other")
      ->type_name("FILE.png");
}

}  // namespace strata::cli
