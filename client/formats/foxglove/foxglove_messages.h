// Messages of Foxglove (https://docs.foxglove.dev/docs/sdk/schemas) as JSON, and the JSON schemas
// that files say them with.
#ifndef STRATA_CLIENT_FORMATS_FOXGLOVE_FOXGLOVE_MESSAGES_H_
#define STRATA_CLIENT_FORMATS_FOXGLOVE_FOXGLOVE_MESSAGES_H_

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

#include "client/formats/bags/mcap_writer.h"
#include "client/formats/geometry_writer.h"
#include "core/geometry/pose.h"

namespace strata {

// Strings must be fit for JSON as they are, as names (core/world/names.h) are; times are since
// 1970 [ns].

extern const McapSchema kFrameTransformSchema;
// foxglove.FrameTransform, T_parent_child.
std::string FrameTransformJson(std::uint64_t time_ns,
                               absl::string_view parent,
                               absl::string_view child,
                               const Pose& T_parent_child);

extern const McapSchema kPosesInFrameSchema;
// foxglove.PosesInFrame.
std::string PosesInFrameJson(std::uint64_t time_ns,
                             absl::string_view frame,
                             std::span<const Pose> poses);

extern const McapSchema kPointCloudSchema;
// A string of JSON that viewers in browsers can hold has 512 M characters: base64 of this [bytes].
inline constexpr std::size_t kMostPointBytes = std::size_t{380} << 20;
// foxglove.PointCloud of the vertices: x, y, z (float32), relative to the middle of all, which is
// the message's pose; red, green, blue, alpha (uint8) where there are colours; label (uint16) where
// there are. RESOURCE_EXHAUSTED beyond kMostPointBytes.
absl::StatusOr<std::string> PointCloudJson(std::uint64_t time_ns,
                                           absl::string_view frame,
                                           const Geometry& points);

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_FOXGLOVE_FOXGLOVE_MESSAGES_H_
