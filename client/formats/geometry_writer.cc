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
#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/string_view.h"
#include <Eigen/Geometry>

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
  STRATA_RETURN_IF_ERROR(CheckColumn("normals", geometry.normals.size(), geometry));
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

void AppendFloats(const Eigen::Vector3f& vector, std::string& out) {
  for (const float coordinate : vector) Append(out, coordinate);
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
  if (!geometry.normals.empty()) {
    header += "property float nx\nproperty float ny\nproperty float nz\n";
  }
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

constexpr std::uint32_t kGlbMagic = 0x46546C67;  // "glTF"
constexpr std::uint32_t kJsonChunk = 0x4E4F534A;
constexpr std::uint32_t kBinaryChunk = 0x004E4942;
constexpr std::size_t kMostGlbBytes = 0xFFFFFFFF;

// The columns of a GLB one after the other, and what its JSON says of them.
struct GlbColumns {
  std::string bytes, views, accessors;
  std::size_t ended = 0;  // bytes of those that are complete
  int count = 0;

  // What was appended to `bytes` since is a column; returns its number.
  int End(absl::string_view accessor, bool of_vertices) {
    const char* const comma = count == 0 ? "" : ",";
    absl::StrAppendFormat(&views,
                          R"(%s{"buffer":0,"byteOffset":%d,"byteLength":%d,"target":%d})",
                          comma,
                          ended,
                          bytes.size() - ended,
                          of_vertices ? 34962 : 34963);
    absl::StrAppendFormat(&accessors, R"(%s{"bufferView":%d,%s})", comma, count, accessor);
    ended = bytes.size();
    return count++;
  }
};

int AddPositions(const Geometry& geometry, const Eigen::Vector3d& middle, GlbColumns& glb) {
  Eigen::AlignedBox3f box;
  for (const Eigen::Vector3d& v : geometry.vertices) {
    const Eigen::Vector3f position = (v - middle).cast<float>();
    box.extend(position);
    AppendFloats(position, glb.bytes);
  }
  const auto text = [](const Eigen::Vector3f& v) {
    return absl::StrFormat("[%.9g,%.9g,%.9g]", v.x(), v.y(), v.z());
  };
  return glb.End(
      absl::StrFormat(R"("componentType":5126,"type":"VEC3","count":%d,"min":%s,"max":%s)",
                      geometry.vertices.size(),
                      text(box.min()),
                      text(box.max())),
      true);
}

// The columns of the one mesh, and its JSON.
std::string AddPrimitive(const Geometry& geometry, const Eigen::Vector3d& middle, GlbColumns& glb) {
  const std::string count = absl::StrFormat(R"("count":%d)", geometry.vertices.size());
  std::string names = absl::StrCat(R"("POSITION":)", AddPositions(geometry, middle, glb));
  if (!geometry.normals.empty()) {
    for (const Eigen::Vector3f& normal : geometry.normals) AppendFloats(normal, glb.bytes);
    absl::StrAppend(
        &names, R"(,"NORMAL":)", glb.End(R"("componentType":5126,"type":"VEC3",)" + count, true));
  }
  if (!geometry.colour.empty()) {
    // Four channels, since an element begins at a multiple of four bytes.
    for (const Colour& c : geometry.colour) {
      Append(glb.bytes, 0xFF000000U | std::uint32_t{c.b} << 16 | std::uint32_t{c.g} << 8 | c.r);
    }
    absl::StrAppend(
        &names,
        R"(,"COLOR_0":)",
        glb.End(R"("componentType":5121,"normalized":true,"type":"VEC4",)" + count, true));
  }
  for (const auto& triangle : geometry.triangles) {
    for (const std::uint32_t index : triangle) Append(glb.bytes, index);
  }
  const int indices = glb.End(absl::StrFormat(R"("componentType":5125,"type":"SCALAR","count":%d)",
                                              3 * geometry.triangles.size()),
                              false);
  return absl::StrFormat(R"({"attributes":{%s},"indices":%d,"material":0})", names, indices);
}

// z up becomes y up: a quarter turn about x; (x, y, z) is then (x, z, −y).
std::string GlbJson(const Geometry& geometry, GlbColumns& glb) {
  if (geometry.triangles.empty()) {
    return R"({"asset":{"version":"2.0","generator":"strata"},"scene":0,"scenes":[{}]})";
  }
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& v : geometry.vertices) box.extend(v);
  const Eigen::Vector3d middle = box.center().array().round();
  const std::string primitive = AddPrimitive(geometry, middle, glb);
  return absl::StrFormat(
      R"({"asset":{"version":"2.0","generator":"strata"},"scene":0,"scenes":[{"nodes":[0]}],)"
      R"("nodes":[{"mesh":0,"rotation":[-0.70710678118654757,0,0,0.70710678118654757],)"
      R"("translation":[%.17g,%.17g,%.17g]}],"meshes":[{"primitives":[%s]}],)"
      R"("materials":[{"doubleSided":true,"pbrMetallicRoughness":{"metallicFactor":0}}],)"
      R"("buffers":[{"byteLength":%d}],"bufferViews":[%s],"accessors":[%s]})",
      middle.x(),
      middle.z(),
      -middle.y(),
      primitive,
      glb.bytes.size(),
      glb.views,
      glb.accessors);
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
    if (!geometry.normals.empty()) AppendFloats(geometry.normals[i], out);
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

absl::StatusOr<std::string> StlBytes(const Geometry& geometry) {
  STRATA_RETURN_IF_ERROR(Check(geometry));
  if (NeedsDouble(geometry)) {
    return absl::FailedPreconditionError(
        "coordinates beyond 8192 m lose millimetres in STL's floats; --relative-to X,Y,Z makes "
        "them "
        "small, and ply, obj and glb keep them");
  }
  std::string out(80, ' ');
  out.replace(0, 14, "metres, z up  ");
  Append(out, static_cast<std::uint32_t>(geometry.triangles.size()));
  for (const auto& [a, b, c] : geometry.triangles) {
    const Eigen::Vector3d &p = geometry.vertices[a], &q = geometry.vertices[b],
                          &r = geometry.vertices[c];
    AppendFloats((q - p).cross(r - p).stableNormalized().cast<float>(), out);
    for (const Eigen::Vector3d* corner : {&p, &q, &r}) AppendFloats(corner->cast<float>(), out);
    Append(out, std::uint16_t{0});
  }
  return out;
}

absl::StatusOr<std::string> GlbBytes(const Geometry& geometry) {
  STRATA_RETURN_IF_ERROR(Check(geometry));
  GlbColumns glb;
  std::string json = GlbJson(geometry, glb);
  json.resize((json.size() + 3) / 4 * 4, ' ');
  const bool has_binary = !glb.bytes.empty();
  const std::size_t size = 12 + 8 + json.size() + (has_binary ? 8 + glb.bytes.size() : 0);
  if (size > kMostGlbBytes) {
    return absl::ResourceExhaustedError(
        "the mesh takes more than the 4 GiB of a GLB file: mesh a smaller part, or --simplify it");
  }
  std::string out;
  out.reserve(size);
  for (const std::uint32_t number : {kGlbMagic,
                                     2U,
                                     static_cast<std::uint32_t>(size),
                                     static_cast<std::uint32_t>(json.size()),
                                     kJsonChunk}) {
    Append(out, number);
  }
  out += json;
  if (has_binary) {
    Append(out, static_cast<std::uint32_t>(glb.bytes.size()));
    Append(out, kBinaryChunk);
    out += glb.bytes;
  }
  return out;
}

absl::StatusOr<MeshFormat> MeshFormatOf(absl::string_view file_or_format) {
  const std::string ending =
      absl::AsciiStrToLower(file_or_format.substr(file_or_format.rfind('.') + 1));
  if (ending == "ply") return MeshFormat::kPly;
  if (ending == "obj") return MeshFormat::kObj;
  if (ending == "stl") return MeshFormat::kStl;
  if (ending == "glb") return MeshFormat::kGlb;
  return absl::InvalidArgumentError(
      absl::StrCat("meshes are written as .ply, .obj, .stl and .glb, got ", file_or_format));
}

absl::StatusOr<std::string> MeshBytes(MeshFormat format, const Geometry& geometry) {
  if (format == MeshFormat::kPly) return PlyBytes(geometry);
  if (format == MeshFormat::kObj) return ObjText(geometry);
  if (format == MeshFormat::kStl) return StlBytes(geometry);
  return GlbBytes(geometry);
}

}  // namespace strata
