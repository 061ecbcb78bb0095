#include "core/planes/models/plane_model_codec.h"

#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/time/time.h"
#include <Eigen/Core>

#include "core/codec/blob.h"
#include "core/codec/bytes.h"
#include "core/common/status.h"

namespace strata {
namespace {

constexpr std::uint16_t kModelVersion = 1;
constexpr std::uint16_t kColourVersion = 2;  // of a plane that has a colour
constexpr double kMaxModelNumber = 1e15;
constexpr std::size_t kPointBytes = 3 * 8;
constexpr std::size_t kDirectionBytes = 3 * 8 + 4 + 8;

void Put(std::string& out, double value) { PutFixed(out, std::bit_cast<std::uint64_t>(value)); }

void Put(std::string& out, const Eigen::Vector3d& v) {
  for (const double x : v) Put(out, x);
}

void Put(std::string& out, const PlaneRing& ring) {
  PutVarint(out, ring.size());
  for (const Eigen::Vector3d& p : ring) Put(out, p);
}

absl::Status Damaged(absl::string_view what) {
  return absl::DataLossError(absl::StrCat("plane model: ", what, " is out of range or cut short"));
}

// What was read may be anything; ok() says at last whether it was in range.
class ModelReader {
 public:
  explicit ModelReader(absl::string_view bytes) : in_(bytes) {}

  std::uint64_t Count() { return in_.Varint(); }
  double Number() {
    const double value = std::bit_cast<double>(in_.Fixed<std::uint64_t>());
    if (std::abs(value) <= kMaxModelNumber) return value;
    fits_ = false;
    return 0.0;
  }
  double NotNegative() {
    const double value = Number();
    if (value < 0.0) fits_ = false;
    return value;
  }
  Eigen::Vector3d Vector() {
    const double x = Number(), y = Number(), z = Number();
    return {x, y, z};
  }
  Eigen::Vector3d Unit() {
    const Eigen::Vector3d v = Vector();
    if (!(std::abs(v.norm() - 1.0) < 1e-6)) fits_ = false;
    return v;
  }
  // How many of `size` bytes each follow; 0 where there cannot be so many.
  std::size_t Sized(std::size_t size) {
    const std::uint64_t count = in_.Varint();
    if (count <= in_.remaining() / size) return count;
    fits_ = false;
    return 0;
  }
  PlaneRing Ring() {
    PlaneRing ring(Sized(kPointBytes));
    if (ring.size() < 3) fits_ = false;
    for (Eigen::Vector3d& p : ring) p = Vector();
    return ring;
  }
  std::uint32_t Fixed32() { return in_.Fixed<std::uint32_t>(); }
  std::int64_t Micros() { return in_.Fixed<std::int64_t>(); }
  std::uint8_t Byte(std::uint8_t least, std::uint8_t most) {
    const auto value = in_.Fixed<std::uint8_t>();
    if (value < least || value > most) fits_ = false;
    return value;
  }
  bool ok() const { return fits_ && in_.ok(); }
  bool AtEnd() const { return ok() && in_.remaining() == 0; }

 private:
  ByteReader in_;
  bool fits_ = true;
};

PlanePolygon TakePolygon(ModelReader& in) {
  PlanePolygon polygon;
  polygon.outer = in.Ring();
  polygon.area_m2 = in.NotNegative();
  const std::size_t holes = in.Sized(1 + 3 * kPointBytes);
  for (std::size_t i = 0; i < holes && in.ok(); ++i) {
    PlaneHole hole;
    hole.seen_open = in.Byte(0, 1) != 0;
    hole.ring = in.Ring();
    polygon.holes.push_back(std::move(hole));
  }
  return polygon;
}

}  // namespace

std::string EncodePlaneModelInfo(const PlaneModelInfo& info) {
  std::string body;
  PutVarint(body, info.job);
  PutVarint(body, info.epoch);
  PutFixed(body, absl::ToUnixMicros(info.made));
  PutVarint(body, info.scans);
  PutVarint(body, info.points);
  PutVarint(body, info.planes);
  PutVarint(body, info.directions.size());
  for (const MainDirection& direction : info.directions) {
    Put(body, direction.direction);
    PutFixed(body, direction.planes);
    Put(body, direction.sigma_rad);
  }
  return SealBlob(BlobKind::kPlaneModel, kModelVersion, body);
}

absl::StatusOr<PlaneModelInfo> DecodePlaneModelInfo(absl::string_view bytes) {
  STRATA_ASSIGN_OR_RETURN(const absl::string_view body,
                          OpenBlob(BlobKind::kPlaneModel, kModelVersion, bytes));
  ModelReader in(body);
  PlaneModelInfo info;
  info.job = in.Count();
  info.epoch = in.Count();
  info.made = absl::FromUnixMicros(in.Micros());
  info.scans = in.Count();
  info.points = in.Count();
  info.planes = in.Count();
  info.directions.resize(in.Sized(kDirectionBytes));
  for (MainDirection& direction : info.directions) {
    direction.direction = in.Unit();
    direction.planes = in.Fixed32();
    direction.sigma_rad = in.NotNegative();
  }
  if (!in.AtEnd()) return Damaged("its head");
  return info;
}

std::string EncodeModelPlane(const ModelPlane& plane) {
  std::string body;
  PutVarint(body, plane.id);
  Put(body, plane.plane.normal);
  Put(body, plane.plane.distance);
  PutFixed(body, static_cast<std::uint8_t>(plane.kind));
  PutFixed(body, plane.direction);
  Put(body, plane.area_m2);
  PutVarint(body, plane.point_count);
  Put(body, plane.rms_m);
  Put(body, plane.sigma_m);
  Put(body, plane.sigma_rad);
  PutVarint(body, plane.polygons.size());
  for (const PlanePolygon& polygon : plane.polygons) {
    Put(body, polygon.outer);
    Put(body, polygon.area_m2);
    PutVarint(body, polygon.holes.size());
    for (const PlaneHole& hole : polygon.holes) {
      PutFixed(body, static_cast<std::uint8_t>(hole.seen_open));
      Put(body, hole.ring);
    }
  }
  if (!plane.colour.has_value()) return SealBlob(BlobKind::kModelPlane, kModelVersion, body);
  for (const std::uint8_t channel : {plane.colour->r, plane.colour->g, plane.colour->b}) {
    PutFixed(body, channel);
  }
  return SealBlob(BlobKind::kModelPlane, kColourVersion, body);
}

absl::StatusOr<ModelPlane> DecodeModelPlane(absl::string_view bytes) {
  STRATA_ASSIGN_OR_RETURN(const absl::string_view body,
                          OpenBlob(BlobKind::kModelPlane, kColourVersion, bytes));
  ModelReader in(body);
  ModelPlane plane;
  plane.id = in.Count();
  plane.plane.normal = in.Unit();
  plane.plane.distance = in.Number();
  plane.kind = static_cast<PlaneKind>(in.Byte(static_cast<std::uint8_t>(PlaneKind::kWall),
                                              static_cast<std::uint8_t>(PlaneKind::kSloped)));
  plane.direction = in.Fixed32();
  plane.area_m2 = in.NotNegative();
  plane.point_count = in.Count();
  plane.rms_m = in.NotNegative();
  plane.sigma_m = in.NotNegative();
  plane.sigma_rad = in.NotNegative();
  const std::size_t polygons = in.Sized(3 * kPointBytes);
  for (std::size_t i = 0; i < polygons && in.ok(); ++i) plane.polygons.push_back(TakePolygon(in));
  if (VersionOfBlob(bytes) == kColourVersion) {
    const std::uint8_t r = in.Byte(0, 255), g = in.Byte(0, 255), b = in.Byte(0, 255);
    plane.colour = Colour{r, g, b};
  }
  if (!in.AtEnd()) return Damaged("a plane");
  return plane;
}

}  // namespace strata
