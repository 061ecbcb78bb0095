#include "client/formats/geometry_writer.h"

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <string>
#include <type_traits>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/string_view.h"

#include "core/common/status.h"

namespace strata {
namespace {

// A float is within half a millimetre up to here.
constexpr double kFloatIsFineMetres = 8192.0;

template <typename T>
void Append(std::string& out, T value) {
  using Bits = std::conditional_t<sizeof(T) == 8,
                                  std::uint64_t,
                                  std::conditional_t<sizeof(T) == 4, std::uint32_t, std::uint16_t>>;
  const auto bits = std::bit_cast<Bits>(value);
  for (std::size_t i = 0; i < sizeof(T); ++i) {
    out.push_back(static_cast<char>(static_cast<std::uint64_t>(bits) >> (8 * i) & 0xFF));
  }
}

absl::Status CheckColumn(absl::string_view name, std::size_t length, const Geometry& geometry) {
  if (length == 0 || length == geometry.vertices.size()) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat(
      "geometry: ", name, " has ", length, " entries for ", geometry.vertices.size(), " vertices"));
}

template <typename Indices>
absl::Status CheckIndices(const std::vector<Indices>& all, const Geometry& geometry) {
  for (const Indices& indices : all) {
    for (const std::uint32_t index : indices) {
      if (index < geometry.vertices.size()) continue;
      return absl::InvalidArgumentError(
          absl::StrCat("geometry: index ", index, " of ", geometry.vertices.size(), " vertices"));
    }
  }
  return absl::OkStatus();
}

absl::Status Check(const Geometry& geometry) {
  STRATA_RETURN_IF_ERROR(CheckColumn("colour", geometry.colour.size(), geometry));
  STRATA_RETURN_IF_ERROR(CheckColumn("intensity", geometry.intensity.size(), geometry));
  STRATA_RETURN_IF_ERROR(CheckColumn("label", geometry.label.size(), geometry));
  STRATA_RETURN_IF_ERROR(CheckIndices(geometry.triangles, geometry));
  return CheckIndices(geometry.lines, geometry);
}

void AppendPoint(const Eigen::Vector3d& point, bool as_double, std::string& out) {
  for (const double coordinate : point) {
    as_double ? Append(out, coordinate) : Append(out, static_cast<float>(coordinate));
  }
}

std::string PlyHeader(const Geometry& geometry, bool as_double) {
  const char* const type = as_double ? "double" : "float";
  std::string header = absl::StrFormat(
      "ply\nformat binary_little_endian 1.0\ncomment metres, z up\nelement vertex %d\n"
      "property %s x\nproperty %s y\nproperty %s z\n",
      geometry.vertices.size(),
      type,
      type,
      type);
  if (!geometry.intensity.empty()) header += "property float intensity\n";
  if (!geometry.colour.empty()) {
    header += "property uchar red\nproperty uchar green\nproperty uchar blue\n";
  }
  if (!geometry.label.empty()) header += "property ushort label\n";
  if (!geometry.triangles.empty()) {
    absl::StrAppend(&header,
                    "element face ",
                    geometry.triangles.size(),
                    "\nproperty list uchar int vertex_indices\n");
  }
  if (!geometry.lines.empty()) {
    absl::StrAppend(&header,
                    "element edge ",
                    geometry.lines.size(),
                    "\nproperty int vertex1\nproperty int vertex2\n");
  }
  return header + "end_header\n";
}

}  // namespace

bool NeedsDouble(const Geometry& geometry) {
  return std::any_of(geometry.vertices.begin(), geometry.vertices.end(), [](const auto& v) {
    return v.cwiseAbs().maxCoeff() > kFloatIsFineMetres;
  });
}

Geometry GeometryOf(const PointCloud& cloud) {
  Geometry geometry;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    if (!cloud.points[i].allFinite()) continue;
    geometry.vertices.emplace_back(cloud.origin + cloud.points[i].cast<double>());
    if (!cloud.intensity.empty()) geometry.intensity.push_back(cloud.intensity[i]);
    if (!cloud.colour.empty()) geometry.colour.push_back(cloud.colour[i]);
    if (!cloud.label.empty()) geometry.label.push_back(cloud.label[i]);
  }
  return geometry;
}

Geometry PathGeometry(const std::vector<Eigen::Vector3d>& waypoints) {
  Geometry geometry;
  geometry.vertices = waypoints;
  for (std::uint32_t i = 1; i < waypoints.size(); ++i) geometry.lines.push_back({i - 1, i});
  return geometry;
}

absl::StatusOr<std::string> PlyBytes(const Geometry& geometry) {
  STRATA_RETURN_IF_ERROR(Check(geometry));
  const bool as_double = NeedsDouble(geometry);
  std::string out = PlyHeader(geometry, as_double);
  for (std::size_t i = 0; i < geometry.vertices.size(); ++i) {
    AppendPoint(geometry.vertices[i], as_double, out);
    if (!geometry.intensity.empty()) Append(out, geometry.intensity[i]);
    if (!geometry.colour.empty()) {
      const Colour& c = geometry.colour[i];
      for (const std::uint8_t channel : {c.r, c.g, c.b}) out.push_back(static_cast<char>(channel));
    }
    if (!geometry.label.empty()) Append(out, geometry.label[i]);
  }
  for (const auto& triangle : geometry.triangles) {
    out.push_back('\3');
    for (const std::uint32_t index : triangle) Append(out, index);
  }
  for (const auto& line : geometry.lines) {
    for (const std::uint32_t index : line) Append(out, index);
  }
  return out;
}

absl::StatusOr<std::string> PcdBytes(const Geometry& geometry) {
  STRATA_RETURN_IF_ERROR(Check(geometry));
  const bool as_double = NeedsDouble(geometry);
  std::string fields = "x y z";
  std::string sizes = as_double ? "8 8 8" : "4 4 4";
  std::string types = "F F F";
  std::string counts = "1 1 1";
  const auto add = [&](bool has, const char* field, const char* size, const char* type) {
    if (!has) return;
    absl::StrAppend(&fields, " ", field);
    absl::StrAppend(&sizes, " ", size);
    absl::StrAppend(&types, " ", type);
    absl::StrAppend(&counts, " 1");
  };
  add(!geometry.intensity.empty(), "intensity", "4", "F");
  add(!geometry.colour.empty(), "rgb", "4", "U");
  add(!geometry.label.empty(), "label", "2", "U");
  const std::size_t n = geometry.vertices.size();
  std::string out = absl::StrFormat(
      "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS %s\nSIZE %s\nTYPE %s\n"
      "COUNT %s\nWIDTH %d\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS %d\nDATA binary\n",
      fields,
      sizes,
      types,
      counts,
      n,
      n);
  for (std::size_t i = 0; i < n; ++i) {
    AppendPoint(geometry.vertices[i], as_double, out);
    if (!geometry.intensity.empty()) Append(out, geometry.intensity[i]);
    if (!geometry.colour.empty()) {
      const Colour& c = geometry.colour[i];
      Append(out, std::uint32_t{c.r} << 16 | std::uint32_t{c.g} << 8 | c.b);
    }
    if (!geometry.label.empty()) Append(out, geometry.label[i]);
  }
  return out;
}

absl::StatusOr<std::string> ObjText(const Geometry& geometry) {
  STRATA_RETURN_IF_ERROR(Check(geometry));
  std::string out = "# metres, z up\n";
  for (std::size_t i = 0; i < geometry.vertices.size(); ++i) {
    const Eigen::Vector3d& v = geometry.vertices[i];
    absl::StrAppendFormat(&out, "v %.6f %.6f %.6f", v.x(), v.y(), v.z());
    if (!geometry.colour.empty()) {
      const Colour& c = geometry.colour[i];
      absl::StrAppendFormat(&out, " %.4f %.4f %.4f", c.r / 255.0, c.g / 255.0, c.b / 255.0);
    }
    out += '\n';
  }
  for (const auto& t : geometry.triangles) {
    absl::StrAppend(&out, "f ", t[0] + 1, " ", t[1] + 1, " ", t[2] + 1, "\n");
  }
  for (const auto& l : geometry.lines) absl::StrAppend(&out, "l ", l[0] + 1, " ", l[1] + 1, "\n");
  if (geometry.triangles.empty() && geometry.lines.empty()) {
    for (std::size_t i = 1; i <= geometry.vertices.size(); ++i)
      absl::StrAppend(&out, "p ", i, "\n");
  }
  return out;
}

}  // namespace strata
