#include "client/formats/bags/ros_messages.h"

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "absl/strings/strip.h"
#include <Eigen/Core>

#include "client/formats/bags/ros_cursor.h"
#include "client/formats/parsing/cloud_builder.h"
#include "client/formats/parsing/point_fields.h"
#include "client/formats/parsing/scalar.h"
#include "core/cloud/deskew.h"
#include "core/cloud/point_cloud.h"
#include "core/common/status.h"

namespace strata {
namespace {

constexpr std::size_t kMaxRosFields = 1000;

// sensor_msgs/PointField: 1 is INT8, …
constexpr ScalarType kRosTypes[] = {ScalarType::kInt8,
                                    ScalarType::kUint8,
                                    ScalarType::kInt16,
                                    ScalarType::kUint16,
                                    ScalarType::kInt32,
                                    ScalarType::kUint32,
                                    ScalarType::kFloat32,
                                    ScalarType::kFloat64};

struct RosField {
  absl::string_view name;
  std::uint32_t offset = 0;
  std::uint8_t type = 0;
  std::uint32_t count = 0;
};

// sensor_msgs/PointCloud2; the bytes belong to the message.
struct RosCloud {
  RosHeader header;
  std::uint32_t height = 0, width = 0;
  std::vector<RosField> fields;
  bool big_endian = false;
  std::uint32_t point_step = 0, row_step = 0;
  absl::string_view data;

  std::uint64_t points() const { return std::uint64_t{height} * width; }
};

std::string FrameOf(absl::string_view name) {
  absl::ConsumePrefix(&name, "/");
  return PrintableName(name);
}

RosHeader GetHeader(RosCursor& cursor) {
  if (cursor.is_ros1()) cursor.Get<std::uint32_t>();  // a number in sequence
  RosHeader header;
  const std::int64_t seconds =
      cursor.is_ros1() ? std::int64_t{cursor.Get<std::uint32_t>()} : cursor.Get<std::int32_t>();
  header.stamp_ns = seconds * 1'000'000'000 + cursor.Get<std::uint32_t>();
  header.frame = FrameOf(cursor.Text());
  return header;
}

template <std::size_t N>
void GetNumbers(RosCursor& cursor, std::array<double, N>& numbers) {
  for (double& number : numbers) number = cursor.Get<double>();
}

RosField GetField(RosCursor& cursor) {
  RosField field;
  field.name = cursor.Text();
  field.offset = cursor.Get<std::uint32_t>();
  field.type = cursor.Get<std::uint8_t>();
  field.count = cursor.Get<std::uint32_t>();
  return field;
}

absl::StatusOr<RosCloud> ParseCloud(absl::string_view bytes, MessageEncoding encoding) {
  STRATA_ASSIGN_OR_RETURN(RosCursor cursor, RosCursor::Create(bytes, encoding));
  RosCloud cloud;
  cloud.header = GetHeader(cursor);
  cloud.height = cursor.Get<std::uint32_t>();
  cloud.width = cursor.Get<std::uint32_t>();
  const auto fields = cursor.Get<std::uint32_t>();
  STRATA_RETURN_IF_ERROR(cursor.status());
  if (fields > kMaxRosFields) {
    return absl::InvalidArgumentError(
        absl::StrCat("the cloud has ", fields, " fields, at most ", kMaxRosFields, " are read"));
  }
  for (std::uint32_t i = 0; i < fields; ++i) cloud.fields.push_back(GetField(cursor));
  cloud.big_endian = cursor.Get<std::uint8_t>() != 0;
  cloud.point_step = cursor.Get<std::uint32_t>();
  cloud.row_step = cursor.Get<std::uint32_t>();
  cloud.data = cursor.Bytes();
  STRATA_RETURN_IF_ERROR(cursor.status());
  return cloud;
}

absl::StatusOr<std::vector<PointField>> PointFieldsOf(const RosCloud& cloud) {
  std::vector<PointField> fields;
  for (const RosField& field : cloud.fields) {
    const bool known = field.type >= 1 && field.type <= std::size(kRosTypes);
    const Meaning meaning = field.count <= 1 ? MeaningOf(field.name) : Meaning::kIgnored;
    if (meaning == Meaning::kIgnored) continue;
    if (!known) {
      return absl::InvalidArgumentError(absl::StrCat(
          "field ", PrintableName(field.name), " has no known type: ", int{field.type}));
    }
    const ScalarType type = kRosTypes[field.type - 1];
    if (std::uint64_t{field.offset} + SizeOf(type) > cloud.point_step) {
      return absl::InvalidArgumentError(absl::StrCat("field ",
                                                     PrintableName(field.name),
                                                     " at byte ",
                                                     field.offset,
                                                     " of points of ",
                                                     cloud.point_step,
                                                     " bytes"));
    }
    fields.push_back({.meaning = meaning,
                      .type = type,
                      .first = cloud.data.data() + field.offset,
                      .stride = cloud.point_step});
  }
  return fields;
}

// Where rows end with bytes of no point, `packed` becomes the points alone, and the cloud's data.
// REQUIRES: the cloud has points.
absl::Status SettleRows(RosCloud& cloud, std::string& packed) {
  const std::uint64_t row = std::uint64_t{cloud.width} * cloud.point_step;
  const bool close = cloud.height <= 1 || cloud.row_step == 0 || cloud.row_step == row;
  const std::uint64_t step = close ? row : cloud.row_step;
  const std::uint64_t size = cloud.data.size();
  const bool fits =
      row > 0 && step >= row && row <= size && cloud.height - 1 <= (size - row) / step;
  if (!fits) {
    return absl::InvalidArgumentError(absl::StrCat(cloud.height,
                                                   " rows of ",
                                                   cloud.width,
                                                   " points of ",
                                                   cloud.point_step,
                                                   " bytes, each row of ",
                                                   step,
                                                   ", do not fit the ",
                                                   size,
                                                   " bytes of the message"));
  }
  if (close) return absl::OkStatus();
  for (std::uint64_t i = 0; i < cloud.height; ++i) {
    const absl::string_view points =
        cloud.data.substr(static_cast<std::size_t>(i * step), static_cast<std::size_t>(row));
    packed.append(points.data(), points.size());
  }
  cloud.data = packed;
  return absl::OkStatus();
}

// A sequence of numbers; empty, and the cursor at its end, where there are fewer than it says.
template <typename T>
std::vector<T> GetSequence(RosCursor& cursor) {
  const std::size_t count = cursor.Get<std::uint32_t>();
  std::vector<T> numbers;
  if (count <= cursor.remaining() / sizeof(T)) numbers.reserve(count);
  for (std::size_t i = 0; i < count && cursor.status().ok(); ++i) {
    numbers.push_back(cursor.Get<T>());
  }
  return numbers;
}

// What of a laser's message the points come from.
struct LaserReturns {
  double first_rad = 0.0, step_rad = 0.0, step_s = 0.0;
  float nearest_m = 0.0F, farthest_m = 0.0F;
  std::vector<float> ranges_m, intensities;
};

LaserReturns GetReturns(RosCursor& cursor) {
  LaserReturns returns;
  returns.first_rad = cursor.Get<float>();
  cursor.Get<float>();  // the last angle
  returns.step_rad = cursor.Get<float>();
  returns.step_s = cursor.Get<float>();
  cursor.Get<float>();  // seconds from line to line
  returns.nearest_m = cursor.Get<float>();
  returns.farthest_m = cursor.Get<float>();
  returns.ranges_m = GetSequence<float>(cursor);
  returns.intensities = GetSequence<float>(cursor);
  return returns;
}

PointCloud LineOf(const LaserReturns& returns) {
  const bool has_intensity = returns.intensities.size() == returns.ranges_m.size();
  PointCloud line;
  for (std::size_t i = 0; i < returns.ranges_m.size(); ++i) {
    const float d = returns.ranges_m[i];
    if (!(d > 0.0F && d >= returns.nearest_m && d <= returns.farthest_m)) continue;
    const auto at = static_cast<double>(i);
    const double angle = returns.first_rad + at * returns.step_rad;
    line.points.push_back(
        Eigen::Vector3d(d * std::cos(angle), d * std::sin(angle), 0.0).cast<float>());
    if (has_intensity) line.intensity.push_back(returns.intensities[i]);
    if (returns.step_s != 0.0) line.time.push_back(at * returns.step_s);
  }
  return line;
}

RosPose GetPose(RosCursor& cursor, bool has_child) {
  RosPose pose;
  pose.header = GetHeader(cursor);
  if (has_child) pose.child_frame = FrameOf(cursor.Text());
  GetNumbers(cursor, pose.position_m);
  GetNumbers(cursor, pose.quaternion);
  return pose;
}

}  // namespace

bool IsPoseType(absl::string_view type) {
  return type == "nav_msgs/Odometry" || type == "geometry_msgs/PoseStamped" ||
         type == "geometry_msgs/PoseWithCovarianceStamped";
}

bool IsTransformsType(absl::string_view type) {
  return type == "tf2_msgs/TFMessage" || type == "tf/tfMessage";
}

absl::StatusOr<RosCloudHead> ReadRosCloudHead(absl::string_view bytes, MessageEncoding encoding) {
  STRATA_ASSIGN_OR_RETURN(const RosCloud cloud, ParseCloud(bytes, encoding));
  RosCloudHead head = {.header = cloud.header, .points = cloud.points()};
  for (const RosField& field : cloud.fields) {
    head.has_point_times = head.has_point_times || MeaningOf(field.name) == Meaning::kTime;
  }
  return head;
}

absl::StatusOr<PointCloud> ReadRosCloud(absl::string_view bytes, MessageEncoding encoding) {
  STRATA_ASSIGN_OR_RETURN(RosCloud cloud, ParseCloud(bytes, encoding));
  if (cloud.points() == 0) return absl::InvalidArgumentError("the cloud has no points");
  std::string packed;
  STRATA_RETURN_IF_ERROR(SettleRows(cloud, packed));
  STRATA_ASSIGN_OR_RETURN(const std::vector<PointField> fields, PointFieldsOf(cloud));
  std::vector<Meaning> meanings;
  for (const PointField& field : fields) meanings.push_back(field.meaning);
  STRATA_ASSIGN_OR_RETURN(CloudBuilder builder, CloudBuilder::Create(std::move(meanings)));
  if (cloud.height > 1) builder.SetGrid(cloud.height, cloud.width);
  AddPoints(fields, static_cast<std::size_t>(cloud.points()), cloud.big_endian, builder);
  return std::move(builder).Build();
}

absl::StatusOr<RosLaserScan> ReadRosLaserScan(absl::string_view bytes, MessageEncoding encoding) {
  STRATA_ASSIGN_OR_RETURN(RosCursor cursor, RosCursor::Create(bytes, encoding));
  RosLaserScan scan;
  scan.header = GetHeader(cursor);
  const LaserReturns returns = GetReturns(cursor);
  STRATA_RETURN_IF_ERROR(cursor.status());
  const double lasts_s = std::abs(returns.step_s) * static_cast<double>(returns.ranges_m.size());
  if (!std::isfinite(returns.first_rad) || !std::isfinite(returns.step_rad) ||
      !(lasts_s <= kLongestScanS)) {
    return absl::InvalidArgumentError(absl::StrCat("a laser's line from ",
                                                   returns.first_rad,
                                                   " rad on in steps of ",
                                                   returns.step_rad,
                                                   " rad and ",
                                                   returns.step_s,
                                                   " s"));
  }
  scan.line = LineOf(returns);
  STRATA_RETURN_IF_ERROR(ValidateCloud(scan.line));
  return scan;
}

absl::StatusOr<RosJointState> ReadRosJointState(absl::string_view bytes, MessageEncoding encoding) {
  STRATA_ASSIGN_OR_RETURN(RosCursor cursor, RosCursor::Create(bytes, encoding));
  RosJointState state;
  state.header = GetHeader(cursor);
  const auto count = cursor.Get<std::uint32_t>();
  for (std::uint32_t i = 0; i < count && cursor.status().ok(); ++i) {
    state.names.emplace_back(cursor.Text());
  }
  state.positions = GetSequence<double>(cursor);
  STRATA_RETURN_IF_ERROR(cursor.status());
  if (!state.positions.empty() && state.positions.size() != state.names.size()) {
    return absl::InvalidArgumentError(absl::StrCat(
        state.names.size(), " joints and ", state.positions.size(), " positions of joints"));
  }
  return state;
}

absl::StatusOr<std::vector<RosPose>> ReadRosPoses(const BagTopic& topic, absl::string_view bytes) {
  STRATA_ASSIGN_OR_RETURN(RosCursor cursor, RosCursor::Create(bytes, topic.encoding));
  std::vector<RosPose> poses;
  if (!IsTransformsType(topic.type)) {
    poses.push_back(GetPose(cursor, topic.type == "nav_msgs/Odometry"));
  } else {
    const auto count = cursor.Get<std::uint32_t>();
    for (std::uint32_t i = 0; i < count && cursor.status().ok(); ++i) {
      poses.push_back(GetPose(cursor, true));
    }
  }
  STRATA_RETURN_IF_ERROR(cursor.status());
  return poses;
}

}  // namespace strata
