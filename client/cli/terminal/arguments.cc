#include "client/cli/terminal/arguments.h"

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/ascii.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "absl/strings/string_view.h"

#include "client/cli/terminal/angles.h"
#include "client/cli/terminal/names.h"

namespace strata::cli {
namespace {

constexpr char kPoseShape[] = "X,Y,Z[,YAW|,QX,QY,QZ,QW]";

}  // namespace

std::optional<std::vector<double>> ParseNumbers(const std::string& text,
                                                std::size_t min_count,
                                                std::size_t max_count,
                                                std::size_t angle) {
  const std::vector<absl::string_view> parts = absl::StrSplit(text, ',');
  std::vector<double> numbers;
  for (const absl::string_view part : parts) {
    double number = 0.0;
    if (numbers.size() == angle && parts.size() == angle + 1) {
      const std::optional<double> turn = ParseAngle(part);
      if (!turn.has_value()) return std::nullopt;
      number = *turn;
    } else if (!absl::SimpleAtod(absl::StripAsciiWhitespace(part), &number) ||
               !std::isfinite(number)) {
      return std::nullopt;
    }
    numbers.push_back(number);
  }
  if (numbers.size() < min_count || numbers.size() > max_count) return std::nullopt;
  return numbers;
}

CLI::Option* AddNumbers(CLI::App* app,
                        const std::string& name,
                        const std::string& shape,
                        std::size_t min_count,
                        std::size_t max_count,
                        std::function<void(const std::vector<double>&)> set,
                        const std::string& description,
                        std::size_t angle) {
  return app
      ->add_option_function<std::string>(
          name,
          [=, set = std::move(set)](const std::string& text) {
            const auto numbers = ParseNumbers(text, min_count, max_count, angle);
            if (!numbers.has_value()) {
              throw CLI::ValidationError(name, absl::StrCat("expected ", shape, ", got ", text));
            }
            set(*numbers);
          },
          description)
      ->type_name(shape);
}

CLI::Option* AddPose(CLI::App* app,
                     const std::string& name,
                     std::function<void(const Pose&, std::size_t)> set,
                     const std::string& description) {
  const auto set_pose = [name, set = std::move(set)](const std::vector<double>& n) {
    Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
    if (n.size() == 4) {
      rotation = Eigen::AngleAxisd(n[3], Eigen::Vector3d::UnitZ());
    } else if (n.size() == 7) {
      rotation = Eigen::Quaterniond(n[6], n[3], n[4], n[5]);
      if (rotation.norm() < 1e-6) throw CLI::ValidationError(name, "the quaternion is zero");
      rotation.normalize();
    } else if (n.size() != 3) {
      throw CLI::ValidationError(name, absl::StrCat("expected ", kPoseShape));
    }
    set(MakePose(rotation, {n[0], n[1], n[2]}), n.size());
  };
  constexpr std::size_t kYaw = 3;
  return AddNumbers(app, name, kPoseShape, 3, 7, set_pose, description, kYaw);
}

CLI::Option* AddRegion(CLI::App* app, std::optional<Eigen::AlignedBox3d>& region) {
  const auto set = [&region](const std::vector<double>& n) {
    constexpr double kAnyHeight = 1e7;
    const bool heights = n.size() == 6;
    if (n.size() == 5 || n[0] >= n[2] || n[1] >= n[3] || (heights && n[4] >= n[5])) {
      throw CLI::ValidationError("--region", "expected X0 < X1, Y0 < Y1 and Z0 < Z1");
    }
    region = Eigen::AlignedBox3d(Eigen::Vector3d(n[0], n[1], heights ? n[4] : -kAnyHeight),
                                 Eigen::Vector3d(n[2], n[3], heights ? n[5] : kAnyHeight));
  };
  return AddNumbers(app,
                    "--region",
                    "X0,Y0,X1,Y1[,Z0,Z1]",
                    4,
                    6,
                    set,
                    "Only this part of the map [m]; default: all of it");
}

void AddMapName(CLI::App* app, std::string& map) {
  TakesName(app->add_option("NAME", map, "Name of the map")->required(), kMapNames);
}

void AddScanId(CLI::App* app, ScanId& id) {
  app->add_option_function<std::string>(
         "ID",
         [&id](const std::string& text) {
           const absl::Status status = ParseScanId(text, id);
           if (!status.ok()) throw CLI::ValidationError("ID", std::string(status.message()));
         },
         "The scan")
      ->type_name("TRAJECTORY/SEQUENCE")
      ->required();
}

void AddTileKey(CLI::App* app, TileKey& key) {
  app->add_option_function<std::string>(
         "KEY",
         [&key](const std::string& text) {
           const std::vector<std::string> parts = absl::StrSplit(text, '/');
           if (parts.size() != 3 || !absl::SimpleAtoi(parts[0], &key.level) ||
               !absl::SimpleAtoi(parts[1], &key.x) || !absl::SimpleAtoi(parts[2], &key.y)) {
             throw CLI::ValidationError("KEY", "expected LEVEL/X/Y, got " + text);
           }
         },
         "The tile")
      ->type_name("LEVEL/X/Y")
      ->required();
}

RobotProfile ProfileOverrides::Over(RobotProfile profile) const {
  profile.radius_m = radius_m.value_or(profile.radius_m);
  profile.height_m = height_m.value_or(profile.height_m);
  profile.max_step_m = max_step_m.value_or(profile.max_step_m);
  profile.max_slope_rad = max_slope_rad.value_or(profile.max_slope_rad);
  profile.max_gap_m = max_gap_m.value_or(profile.max_gap_m);
  profile.max_roughness_m = max_roughness_m.value_or(profile.max_roughness_m);
  return profile;
}

void AddProfileOptions(CLI::App* app, ProfileOverrides& overrides) {
  app->add_option("--radius", overrides.radius_m, "Radius of the robot's footprint [m]");
  app->add_option("--height", overrides.height_m, "Height the robot needs above a surface [m]");
  app->add_option("--max-step", overrides.max_step_m, "Highest step between cells [m]");
  TakesAngle(app->add_option(
      "--max-slope", overrides.max_slope_rad, "Steepest ground, in degrees or as 0.35rad"));
  app->add_option("--max-gap", overrides.max_gap_m, "Longest unobserved stretch to bridge [m]");
  app->add_option(
      "--max-roughness", overrides.max_roughness_m, "Largest sigma around the local plane [m]");
}

CLI::Option* AddInferred(CLI::App* app, InferredAs& inferred) {
  return app
      ->add_option_function<std::string>(
          "--inferred",
          [&inferred](const std::string& as) {
            const bool obstacle = as == ToString(InferredAs::kObstacle);
            inferred = obstacle ? InferredAs::kObstacle : InferredAs::kIgnore;
          },
          "What objects complete inferred, which nobody saw: keep out of it as of what was "
          "measured, or not")
      ->check(CLI::IsMember({"ignore", "obstacle"}))
      ->default_str("ignore");
}

}  // namespace strata::cli
