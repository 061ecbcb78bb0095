#include "core/planes/scan_planes_codec.h"

#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include <Eigen/Core>

#include "core/codec/blob.h"
#include "core/codec/bytes.h"
#include "core/common/status.h"
#include "core/planes/scan_planes.h"

namespace strata {
namespace {

constexpr std::uint64_t kMaxFeatures = 10000;
constexpr std::size_t kMaxFootprintRows = 32;
constexpr double kMaxNumber = 1e15;
constexpr std::size_t kNumberBytes = 8;

// Both directions visit the same fields in the same order.
class NumberWriter {
 public:
  explicit NumberWriter(std::string& out) : out_(out) {}
  void operator()(const double& value) { PutFixed(out_, std::bit_cast<std::uint64_t>(value)); }

 private:
  std::string& out_;
};

class NumberReader {
 public:
  explicit NumberReader(ByteReader& in) : in_(in) {}
  void operator()(double& value) {
    value = std::bit_cast<double>(in_.Fixed<std::uint64_t>());
    if (!(std::abs(value) <= kMaxNumber)) ok_ = false;
  }
  bool ok() const { return ok_ && in_.ok(); }

 private:
  ByteReader& in_;
  bool ok_ = true;
};

template <typename Vector, typename Number>
void Each(Vector& vector, Number& number) {
  for (auto& x : vector.reshaped()) number(x);
}

template <typename Patch, typename Number>
void PatchNumbers(Patch& patch, Number& number) {
  Each(patch.plane.normal, number);
  number(patch.plane.distance);
  for (int row = 0; row < 4; ++row) {
    for (int column = row; column < 4; ++column) number(patch.moments(row, column));
  }
  Each(patch.centroid, number);
  Each(patch.axis_u, number);
  Each(patch.extent_min, number);
  Each(patch.extent_max, number);
  number(patch.rms_m);
  number(patch.footprint_cell_m);
  Each(patch.curvature, number);
}

template <typename Edge, typename Number>
void EdgeNumbers(Edge& edge, Number& number) {
  for (auto& point : edge.points) Each(point, number);
  Each(edge.line.origin, number);
  Each(edge.line.direction, number);
  number(edge.length_m);
  number(edge.rms_m);
}

bool IsUnit(const Eigen::Vector3d& v) { return std::abs(v.norm() - 1.0) < 1e-6; }

bool Valid(const PlanePatch& patch) {
  return IsUnit(patch.plane.normal) && IsUnit(patch.axis_u) && patch.area_m2 > 0.0 &&
         patch.rms_m >= 0.0 && patch.footprint_cell_m > 0.0 &&
         (patch.extent_min.array() <= patch.extent_max.array()).all();
}

absl::StatusOr<PlanePatch> TakePatch(ByteReader& reader) {
  PlanePatch patch;
  NumberReader number(reader);
  PatchNumbers(patch, number);
  patch.moments = patch.moments.selfadjointView<Eigen::Upper>();
  patch.area_m2 = patch.moments(3, 3);
  const std::uint64_t point_count = reader.Varint();
  const auto rows = reader.Fixed<std::uint8_t>();
  if (!number.ok() || !Valid(patch) || point_count > UINT32_MAX || rows > kMaxFootprintRows) {
    return absl::DataLossError("scan planes: a patch is out of range or cut short");
  }
  patch.point_count = static_cast<std::uint32_t>(point_count);
  for (std::size_t i = 0; i < rows; ++i) patch.footprint.push_back(reader.Fixed<std::uint32_t>());
  return patch;
}

absl::StatusOr<EdgeFeature> TakeEdge(ByteReader& reader) {
  EdgeFeature edge;
  const std::uint64_t vertices = reader.Varint();
  if (vertices < 2 || vertices > reader.remaining() / (3 * kNumberBytes)) {
    return absl::DataLossError(absl::StrCat("scan planes: an edge of ", vertices, " vertices"));
  }
  edge.points.resize(vertices);
  NumberReader number(reader);
  EdgeNumbers(edge, number);
  if (!number.ok() || !IsUnit(edge.line.direction) || !(edge.length_m > 0.0) ||
      !(edge.rms_m >= 0.0)) {
    return absl::DataLossError("scan planes: an edge is out of range or cut short");
  }
  return edge;
}

}  // namespace

std::string EncodeScanPlanes(const ScanPlanes& planes) {
  std::string body;
  NumberWriter number(body);
  PutVarint(body, planes.patches.size());
  PutVarint(body, planes.edges.size());
  for (const PlanePatch& patch : planes.patches) {
    PatchNumbers(patch, number);
    PutVarint(body, patch.point_count);
    PutFixed(body, static_cast<std::uint8_t>(patch.footprint.size()));
    for (const std::uint32_t row : patch.footprint) PutFixed(body, row);
  }
  for (const EdgeFeature& edge : planes.edges) {
    PutVarint(body, edge.points.size());
    EdgeNumbers(edge, number);
  }
  return SealBlob(BlobKind::kScanPlanes, kScanPlanesVersion, body);
}

absl::StatusOr<ScanPlanes> DecodeScanPlanes(absl::string_view bytes) {
  STRATA_ASSIGN_OR_RETURN(const absl::string_view body,
                          OpenBlob(BlobKind::kScanPlanes, kScanPlanesVersion, bytes));
  ByteReader reader(body);
  const std::uint64_t patches = reader.Varint();
  const std::uint64_t edges = reader.Varint();
  if (!reader.ok() || patches > kMaxFeatures || edges > kMaxFeatures) {
    return absl::DataLossError(
        absl::StrCat("scan planes: ", patches, " patches and ", edges, " edges"));
  }
  ScanPlanes planes;
  for (std::uint64_t i = 0; i < patches; ++i) {
    STRATA_ASSIGN_OR_RETURN(PlanePatch patch, TakePatch(reader));
    planes.patches.push_back(std::move(patch));
  }
  for (std::uint64_t i = 0; i < edges; ++i) {
    STRATA_ASSIGN_OR_RETURN(EdgeFeature edge, TakeEdge(reader));
    planes.edges.push_back(std::move(edge));
  }
  if (!reader.ok() || reader.remaining() != 0) {
    return absl::DataLossError(
        absl::StrCat("scan planes: ", reader.remaining(), " bytes left over, or too few"));
  }
  return planes;
}

}  // namespace strata
