#include "client/formats/motion/rig_file.h"

#include <cmath>
#include <filesystem>
#include <functional>
#include <map>
#include <numbers>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <yaml-cpp/yaml.h>

#include "client/formats/file_bytes.h"
#include "core/common/status.h"
#include "core/geometry/euler.h"

namespace strata {
namespace {

constexpr double kRadiansPerDegree = std::numbers::pi / 180.0;

using Setter = std::function<absl::Status(const YAML::Node&)>;
using Section = std::map<std::string, Setter>;

Setter Number(double& value, double unit = 1.0) {
  return [&value, unit](const YAML::Node& node) {
    double number = 0.0;
    if (!node.IsScalar() || !YAML::convert<double>::decode(node, number) ||
        !std::isfinite(number)) {
      return absl::InvalidArgumentError("expected a number");
    }
    value = unit * number;
    return absl::OkStatus();
  };
}

Setter Vector(Eigen::Vector3d& value) {
  return [&value](const YAML::Node& node) {
    if (!node.IsSequence() || node.size() != 3) {
      return absl::InvalidArgumentError("expected three numbers, as in [0.2, 0, 1.1]");
    }
    for (int i = 0; i < 3; ++i) STRATA_RETURN_IF_ERROR(Number(value(i))(node[i]));
    return absl::OkStatus();
  };
}

Setter Orientation(Rig& rig) {
  return [&rig](const YAML::Node& node) {
    Eigen::Vector3d angles;
    STRATA_RETURN_IF_ERROR(Vector(angles)(node));
    angles *= kRadiansPerDegree;
    rig.R_body_imu = QuaternionOf({angles.x(), angles.y(), angles.z()});
    return absl::OkStatus();
  };
}

std::map<std::string, Section> SectionsOf(Rig& rig) {
  return {{"imu",
           {{"orientation", Orientation(rig)},
            {"position", Vector(rig.imu_body_m)},
            {"yaw_mount", Number(rig.yaw_mount_rad, kRadiansPerDegree)},
            {"gyro_noise", Number(rig.imu.gyro_noise)},
            {"accelerometer_noise", Number(rig.imu.accelerometer_noise)},
            {"gyro_bias", Number(rig.imu.gyro_bias_rad_s)},
            {"accelerometer_bias", Number(rig.imu.accelerometer_bias_m_s2)},
            {"gyro_bias_walk", Number(rig.imu.gyro_bias_walk)},
            {"accelerometer_bias_walk", Number(rig.imu.accelerometer_bias_walk)}}},
          {"gps",
           {{"antenna", Vector(rig.gps.antenna_body_m)},
            {"least_sigma", Number(rig.gps.least_sigma_m)},
            {"lag", Number(rig.gps.lag_s)}}},
          {"wheels",
           {{"speed", Number(rig.wheels.speed_m_s)},
            {"side_slip", Number(rig.wheels.side_slip_m_s)},
            {"climb", Number(rig.wheels.climb_m_s)},
            {"yaw_rate", Number(rig.wheels.yaw_rate_rad_s)},
            {"yaw_rate_share", Number(rig.wheels.yaw_rate_share)},
            {"scale", Number(rig.wheels.scale)},
            {"lag", Number(rig.wheels.lag_s)}}}};
}

template <typename Value>
std::string NamesOf(const std::map<std::string, Value>& table) {
  return absl::StrJoin(
      table, ", ", [](std::string* out, const auto& entry) { out->append(entry.first); });
}

absl::Status SetSection(const std::string& name, const YAML::Node& node, const Section& section) {
  if (!node.IsMap()) {
    return absl::InvalidArgumentError(
        absl::StrCat(name, ": expected keys below it, of ", NamesOf(section)));
  }
  for (const auto& entry : node) {
    const std::string key = entry.first.Scalar();
    const auto setter = section.find(key);
    if (setter == section.end()) {
      return absl::InvalidArgumentError(
          absl::StrCat(name, " has no key '", key, "'; it has ", NamesOf(section)));
    }
    STRATA_RETURN_IF_ERROR(Annotate(setter->second(entry.second), absl::StrCat(name, ".", key)));
  }
  return absl::OkStatus();
}

absl::Status SetRig(const YAML::Node& root, Rig& rig) {
  const std::map<std::string, Section> sections = SectionsOf(rig);
  if (root.IsNull()) return absl::OkStatus();
  if (!root.IsMap()) {
    return absl::InvalidArgumentError(absl::StrCat("expected the keys ", NamesOf(sections)));
  }
  for (const auto& entry : root) {
    const std::string name = entry.first.Scalar();
    const auto section = sections.find(name);
    if (section == sections.end()) {
      return absl::InvalidArgumentError(
          absl::StrCat("a rig has no key '", name, "'; it has ", NamesOf(sections)));
    }
    STRATA_RETURN_IF_ERROR(SetSection(name, entry.second, section->second));
  }
  return ValidateRig(rig);
}

// The library's exceptions end here.
absl::StatusOr<YAML::Node> ParseYaml(const std::string& text) {
  try {
    return YAML::Load(text);
  } catch (const YAML::Exception& error) {
    return absl::InvalidArgumentError(error.what());
  }
}

}  // namespace

absl::Status ReadRig(const std::filesystem::path& path, Rig& rig) {
  STRATA_ASSIGN_OR_RETURN(const std::string text, ReadFileBytes(path));
  absl::StatusOr<YAML::Node> root = ParseYaml(text);
  if (!root.ok()) return Annotate(root.status(), path.string());
  return Annotate(SetRig(*root, rig), path.string());
}

}  // namespace strata
