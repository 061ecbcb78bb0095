#include "client/formats/foxglove/foxglove_messages.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/string_view.h"

namespace strata {
namespace {

constexpr std::uint64_t kSecondNs = 1'000'000'000;
// foxglove.NumericType.
constexpr int kUint8 = 1;
constexpr int kUint16 = 3;
constexpr int kFloat32 = 7;

// Pieces of schemas.
#define STRATA_TIME_SCHEMA                                                                \
  R"("timestamp":{"type":"object","title":"time","properties":{"sec":{"type":"integer",)" \
  R"("minimum":0},"nsec":{"type":"integer","minimum":0,"maximum":999999999}}})"
#define STRATA_VECTOR_SCHEMA                                                            \
  R"({"title":"foxglove.Vector3","type":"object","properties":{"x":{"type":"number"},)" \
  R"("y":{"type":"number"},"z":{"type":"number"}},"required":["x","y","z"]})"
#define STRATA_QUATERNION_SCHEMA                                                           \
  R"({"title":"foxglove.Quaternion","type":"object","properties":{"x":{"type":"number"},)" \
  R"("y":{"type":"number"},"z":{"type":"number"},"w":{"type":"number"}},)"                 \
  R"("required":["x","y","z","w"]})"
#define STRATA_POSE_SCHEMA                                                                     \
  R"({"title":"foxglove.Pose","type":"object","properties":{"position":)" STRATA_VECTOR_SCHEMA \
  R"(,"orientation":)" STRATA_QUATERNION_SCHEMA R"(},"required":["position","orientation"]})"

constexpr char kFrameTransformText[] =
    R"({"title":"foxglove.FrameTransform","type":"object","properties":{)" STRATA_TIME_SCHEMA
    R"(,"parent_frame_id":{"type":"string"},"child_frame_id":{"type":"string"},"translation":)" STRATA_VECTOR_SCHEMA
    R"(,"rotation":)" STRATA_QUATERNION_SCHEMA
    R"(},"required":["timestamp","parent_frame_id","child_frame_id","translation","rotation"]})";

constexpr char kPosesInFrameText[] =
    R"({"title":"foxglove.PosesInFrame","type":"object","properties":{)" STRATA_TIME_SCHEMA
    R"(,"frame_id":{"type":"string"},"poses":{"type":"array","items":)" STRATA_POSE_SCHEMA
    R"(}},"required":["timestamp","frame_id","poses"]})";

constexpr char kPointCloudText[] =
    R"({"title":"foxglove.PointCloud","type":"object","properties":{)" STRATA_TIME_SCHEMA
    R"(,"frame_id":{"type":"string"},"pose":)" STRATA_POSE_SCHEMA
    R"(,"point_stride":{"type":"integer","minimum":0},"fields":{"type":"array","items":{)"
    R"("title":"foxglove.PackedElementField","type":"object","properties":{"name":)"
    R"({"type":"string"},"offset":{"type":"integer","minimum":0},"type":{)"
    R"("title":"foxglove.NumericType","oneOf":[{"title":"UNKNOWN","const":0},)"
    R"({"title":"UINT8","const":1},{"title":"INT8","const":2},{"title":"UINT16","const":3},)"
    R"({"title":"INT16","const":4},{"title":"UINT32","const":5},{"title":"INT32","const":6},)"
    R"({"title":"FLOAT32","const":7},{"title":"FLOAT64","const":8}]}},)"
    R"("required":["name","offset","type"]}},"data":{"type":"string","contentEncoding":"base64"}},)"
    R"("required":["timestamp","frame_id","pose","point_stride","fields","data"]})";

#undef STRATA_POSE_SCHEMA
#undef STRATA_QUATERNION_SCHEMA
#undef STRATA_VECTOR_SCHEMA
#undef STRATA_TIME_SCHEMA

std::string TimeJson(std::uint64_t time_ns) {
  return absl::StrCat(
      R"("timestamp":{"sec":)", time_ns / kSecondNs, R"(,"nsec":)", time_ns % kSecondNs, "}");
}

std::string VectorJson(const Eigen::Vector3d& p) {
  return absl::StrFormat(R"({"x":%.6f,"y":%.6f,"z":%.6f})", p.x(), p.y(), p.z());
}

std::string QuaternionJson(const Pose& pose) {
  const Eigen::Quaterniond q(pose.rotation());
  return absl::StrFormat(
      R"({"x":%.12f,"y":%.12f,"z":%.12f,"w":%.12f})", q.x(), q.y(), q.z(), q.w());
}

std::string PoseJson(const Pose& pose) {
  return absl::StrCat(R"({"position":)",
                      VectorJson(pose.translation()),
                      R"(,"orientation":)",
                      QuaternionJson(pose),
                      "}");
}

Eigen::Vector3d MiddleOf(const std::vector<Eigen::Vector3d>& points) {
  if (points.empty()) return Eigen::Vector3d::Zero();
  Eigen::Vector3d low = points.front(), high = points.front();
  for (const Eigen::Vector3d& p : points) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  // Whole metres: the sum with a float is what it looks like.
  return (0.5 * (low + high)).array().round();
}

// The layout of a cloud's points.
struct PointLayout {
  std::string fields;  // JSON
  std::size_t stride = 0;

  void Add(absl::string_view name, int type, std::size_t bytes) {
    absl::StrAppend(&fields,
                    fields.empty() ? "" : ",",
                    R"({"name":")",
                    name,
                    R"(","offset":)",
                    stride,
                    R"(,"type":)",
                    type,
                    "}");
    stride += bytes;
  }
};

PointLayout LayoutOf(const Geometry& points) {
  PointLayout layout;
  for (const char* name : {"x", "y", "z"}) layout.Add(name, kFloat32, sizeof(float));
  if (!points.colour.empty()) {
    for (const char* name : {"red", "green", "blue", "alpha"}) layout.Add(name, kUint8, 1);
  }
  if (!points.label.empty()) layout.Add("label", kUint16, sizeof(std::uint16_t));
  return layout;
}

std::string PackedPoints(const Geometry& points, const Eigen::Vector3d& middle) {
  std::string data;
  data.reserve(points.vertices.size() * LayoutOf(points).stride);
  for (std::size_t i = 0; i < points.vertices.size(); ++i) {
    const Eigen::Vector3f p = (points.vertices[i] - middle).cast<float>();
    data.append(reinterpret_cast<const char*>(p.data()), 3 * sizeof(float));
    if (!points.colour.empty()) {
      const Colour& c = points.colour[i];
      for (const int part : {int{c.r}, int{c.g}, int{c.b}, 255}) data += static_cast<char>(part);
    }
    if (points.label.empty()) continue;
    data.append(reinterpret_cast<const char*>(&points.label[i]), sizeof(std::uint16_t));
  }
  return data;
}

}  // namespace

const McapSchema kFrameTransformSchema = {
    "foxglove.FrameTransform", "jsonschema", kFrameTransformText};
const McapSchema kPosesInFrameSchema = {"foxglove.PosesInFrame", "jsonschema", kPosesInFrameText};
const McapSchema kPointCloudSchema = {"foxglove.PointCloud", "jsonschema", kPointCloudText};

std::string FrameTransformJson(std::uint64_t time_ns,
                               absl::string_view parent,
                               absl::string_view child,
                               const Pose& T_parent_child) {
  return absl::StrCat("{",
                      TimeJson(time_ns),
                      R"(,"parent_frame_id":")",
                      parent,
                      R"(","child_frame_id":")",
                      child,
                      R"(","translation":)",
                      VectorJson(T_parent_child.translation()),
                      R"(,"rotation":)",
                      QuaternionJson(T_parent_child),
                      "}");
}

std::string PosesInFrameJson(std::uint64_t time_ns,
                             absl::string_view frame,
                             std::span<const Pose> poses) {
  std::string json =
      absl::StrCat("{", TimeJson(time_ns), R"(,"frame_id":")", frame, R"(","poses":[)");
  for (std::size_t i = 0; i < poses.size(); ++i) {
    absl::StrAppend(&json, i > 0 ? "," : "", PoseJson(poses[i]));
  }
  return json + "]}";
}

absl::StatusOr<std::string> PointCloudJson(std::uint64_t time_ns,
                                           absl::string_view frame,
                                           const Geometry& points) {
  const PointLayout layout = LayoutOf(points);
  const std::size_t bytes = points.vertices.size() * layout.stride;
  if (bytes > kMostPointBytes) {
    return absl::ResourceExhaustedError(
        absl::StrCat(points.vertices.size(),
                     " points take ",
                     bytes,
                     " bytes, which viewers cannot hold in a message: at most ",
                     kMostPointBytes,
                     "; a coarser level has fewer"));
  }
  Pose middle = Pose::Identity();
  middle.translation() = MiddleOf(points.vertices);
  return absl::StrCat("{",
                      TimeJson(time_ns),
                      R"(,"frame_id":")",
                      frame,
                      R"(","pose":)",
                      PoseJson(middle),
                      R"(,"point_stride":)",
                      layout.stride,
                      R"(,"fields":[)",
                      layout.fields,
                      R"(],"data":")",
                      absl::Base64Escape(PackedPoints(points, middle.translation())),
                      R"("})");
}

}  // namespace strata
