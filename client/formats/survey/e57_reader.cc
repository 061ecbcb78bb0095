#include "client/formats/survey/e57_reader.h"

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include <Eigen/Geometry>

#include "client/formats/parsing/cloud_builder.h"
#include "client/formats/survey/e57_file.h"
#include "client/formats/survey/e57_node.h"
#include "client/formats/survey/e57_points.h"
#include "core/common/status.h"

namespace strata {
namespace {

constexpr double kQuaternionTolerance = 1e-3;
constexpr std::array<absl::string_view, 3> kE57Channels = {"colorRed", "colorGreen", "colorBlue"};

struct NamedRole {
  absl::string_view name;
  E57Role role;
};
constexpr NamedRole kCartesian[] = {{"cartesianX", E57Role::kX},
                                    {"cartesianY", E57Role::kY},
                                    {"cartesianZ", E57Role::kZ},
                                    {"cartesianInvalidState", E57Role::kInvalid}};
constexpr NamedRole kSpherical[] = {{"sphericalRange", E57Role::kX},
                                    {"sphericalAzimuth", E57Role::kY},
                                    {"sphericalElevation", E57Role::kZ},
                                    {"sphericalInvalidState", E57Role::kInvalid}};
constexpr NamedRole kOthers[] = {{"intensity", E57Role::kIntensity},
                                 {"colorRed", E57Role::kRed},
                                 {"colorGreen", E57Role::kGreen},
                                 {"colorBlue", E57Role::kBlue},
                                 {"timeStamp", E57Role::kTime}};

std::optional<E57Role> RoleNamed(absl::string_view name, bool spherical) {
  for (const auto& [known, role] : spherical ? kSpherical : kCartesian) {
    if (name == known) return role;
  }
  for (const auto& [known, role] : kOthers) {
    if (name == known) return role;
  }
  // Of an extension, as that for LAS.
  const std::size_t colon = name.find(':');
  const bool label =
      colon != absl::string_view::npos && MeaningOf(name.substr(colon + 1)) == Meaning::kLabel;
  return label ? std::optional(E57Role::kLabel) : std::nullopt;
}

absl::StatusOr<E57Field> FieldOf(const E57Node& node) {
  E57Field field;
  const absl::string_view type = node.type();
  if (type == "Float") {
    const std::string* const precision = node.Attribute("precision");
    const bool single = precision != nullptr && *precision == "single";
    field.encoding = single ? E57Encoding::kSingle : E57Encoding::kDouble;
    return field;
  }
  if (type != "Integer" && type != "ScaledInteger") return field;
  field.encoding = type == "Integer" ? E57Encoding::kInteger : E57Encoding::kScaledInteger;
  STRATA_ASSIGN_OR_RETURN(field.minimum, node.WholeAttribute("minimum", field.minimum));
  STRATA_ASSIGN_OR_RETURN(field.maximum, node.WholeAttribute("maximum", field.maximum));
  if (field.maximum < field.minimum) {
    return absl::InvalidArgumentError(absl::StrCat(
        "'", node.name.substr(0, 40), "': minimum ", field.minimum, " > maximum ", field.maximum));
  }
  if (type == "Integer") return field;
  STRATA_ASSIGN_OR_RETURN(field.scale, node.NumberAttribute("scale", 1.0));
  STRATA_ASSIGN_OR_RETURN(field.offset, node.NumberAttribute("offset", 0.0));
  return field;
}

// The fields below a node in their order, those of structures in it among them.
absl::Status AddFields(const E57Node& node, bool top, E57Points& points) {
  for (const E57Node& child : node.children) {
    if (child.type() == "Structure" || child.type() == "Vector") {
      STRATA_RETURN_IF_ERROR(AddFields(child, false, points));
      continue;
    }
    STRATA_ASSIGN_OR_RETURN(E57Field field, FieldOf(child));
    if (top && field.encoding != E57Encoding::kOther) {
      field.role = RoleNamed(child.name, points.spherical);
    }
    for (const E57Field& before : points.fields) {
      if (field.role && before.role == field.role) field.role.reset();  // the first counts
    }
    points.fields.push_back(field);
  }
  return absl::OkStatus();
}

// What the channels span: as the scan says, else what their integers may be.
absl::Status FindColourLimits(const E57Node& scan, const E57Node& prototype, E57Points& points) {
  std::array<double, 3> low{};
  std::array<double, 3> high{};
  const E57Node* const limits = scan.Child("colorLimits");
  for (std::size_t k = 0; k < kE57Channels.size(); ++k) {
    const E57Node* const channel = prototype.Child(kE57Channels[k]);
    if (channel == nullptr) return absl::OkStatus();
    double least = 0.0;
    double most = 0.0;
    if (channel->type() != "Float") {
      STRATA_ASSIGN_OR_RETURN(const E57Field field, FieldOf(*channel));
      least = static_cast<double>(field.minimum) * field.scale + field.offset;
      most = static_cast<double>(field.maximum) * field.scale + field.offset;
    }
    if (limits != nullptr) {
      STRATA_ASSIGN_OR_RETURN(least,
                              limits->NumberOf(absl::StrCat(kE57Channels[k], "Minimum"), least));
      STRATA_ASSIGN_OR_RETURN(most,
                              limits->NumberOf(absl::StrCat(kE57Channels[k], "Maximum"), most));
    }
    if (!(most > least) || !std::isfinite(most - least)) return absl::OkStatus();
    low[k] = least;
    high[k] = most;
  }
  points.colour_low = low;
  points.colour_high = high;
  return absl::OkStatus();
}

absl::StatusOr<E57Points> PointsOf(const E57Node& scan) {
  const E57Node* const vector = scan.Child("points");
  const E57Node* const prototype = vector == nullptr ? nullptr : vector->Child("prototype");
  if (prototype == nullptr || vector->type() != "CompressedVector") {
    return absl::InvalidArgumentError("expected points of type CompressedVector with a prototype");
  }
  STRATA_ASSIGN_OR_RETURN(const std::int64_t at, vector->WholeAttribute("fileOffset", -1));
  STRATA_ASSIGN_OR_RETURN(const std::int64_t count, vector->WholeAttribute("recordCount", -1));
  if (at < 0 || count < 0) {
    return absl::InvalidArgumentError("points: expected a fileOffset and a recordCount");
  }
  E57Points points;
  points.at = static_cast<std::uint64_t>(at);
  points.count = static_cast<std::uint64_t>(count);
  points.spherical =
      prototype->Child("cartesianX") == nullptr && prototype->Child("sphericalRange") != nullptr;
  STRATA_RETURN_IF_ERROR(AddFields(*prototype, true, points));
  STRATA_RETURN_IF_ERROR(FindColourLimits(scan, *prototype, points));
  return points;
}

absl::StatusOr<std::array<double, 4>> NumbersOf(const E57Node* node,
                                                const std::array<absl::string_view, 4>& names,
                                                const std::array<double, 4>& otherwise) {
  std::array<double, 4> numbers = otherwise;
  for (std::size_t k = 0; node != nullptr && k < names.size(); ++k) {
    STRATA_ASSIGN_OR_RETURN(numbers[k], node->NumberOf(names[k], otherwise[k]));
  }
  return numbers;
}

absl::StatusOr<Pose> PoseOf(const E57Node& scan) {
  const E57Node* const pose = scan.Child("pose");
  if (pose == nullptr) return Pose::Identity();
  STRATA_ASSIGN_OR_RETURN(
      const auto q, NumbersOf(pose->Child("rotation"), {"w", "x", "y", "z"}, {1.0, 0.0, 0.0, 0.0}));
  STRATA_ASSIGN_OR_RETURN(const auto t,
                          NumbersOf(pose->Child("translation"), {"x", "y", "z", ""}, {}));
  const Eigen::Quaterniond rotation(q[0], q[1], q[2], q[3]);
  if (!(std::abs(rotation.norm() - 1.0) <= kQuaternionTolerance)) {
    return absl::InvalidArgumentError(
        absl::StrCat("pose: expected a unit quaternion, found one of norm ", rotation.norm()));
  }
  const Pose T = MakePose(rotation, Eigen::Vector3d(t[0], t[1], t[2]));
  STRATA_RETURN_IF_ERROR(ValidatePose(T));
  return T;
}

absl::StatusOr<Station> StationOf(const std::filesystem::path& path, const E57Node& scan) {
  Station station;
  STRATA_ASSIGN_OR_RETURN(station.T_file_scan, PoseOf(scan));
  STRATA_ASSIGN_OR_RETURN(E57Points points, PointsOf(scan));
  station.read = [path, points = std::move(points)] { return ReadE57Points(path, points); };
  return station;
}

}  // namespace

absl::StatusOr<std::vector<Station>> ListE57Stations(const std::filesystem::path& path) {
  STRATA_ASSIGN_OR_RETURN(E57File file, E57File::Open(path));
  std::string xml;
  STRATA_RETURN_IF_ERROR(file.Read(file.xml_at(), file.xml_bytes(), xml));
  STRATA_ASSIGN_OR_RETURN(const E57Node root, ParseE57Xml(xml));
  const E57Node* const scans = root.Child("data3D");
  if (scans == nullptr || scans->children.empty()) {
    return absl::InvalidArgumentError("the file has no scan: data3D is empty");
  }
  std::vector<Station> stations;
  for (std::size_t i = 0; i < scans->children.size(); ++i) {
    absl::StatusOr<Station> station = StationOf(path, scans->children[i]);
    if (station.ok()) {
      stations.push_back(*std::move(station));
    } else {  // the others are none the worse
      const absl::Status fault = Annotate(station.status(), absl::StrCat("scan ", i));
      stations.push_back({.read = [fault] { return fault; }});
    }
  }
  return stations;
}

}  // namespace strata
