// Points, paths and meshes as PLY, PCD, OBJ, STL and GLB files.
#ifndef STRATA_CLIENT_FORMATS_GEOMETRY_WRITER_H_
#define STRATA_CLIENT_FORMATS_GEOMETRY_WRITER_H_

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include <Eigen/Core>

#include "core/cloud/point_cloud.h"

namespace strata {

// What is to be drawn. Columns are empty or as long as `vertices`; faces and lines hold indices of
// vertices. A path is vertices and the lines between them.
struct Geometry {
  std::vector<Eigen::Vector3d> vertices;
  std::vector<Colour> colour;
  std::vector<Eigen::Vector3f> normals;  // unit
  std::vector<float> intensity;
  std::vector<std::uint16_t> label;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<std::array<std::uint32_t, 2>> lines;
};

// The finite points of a cloud with its columns, `origin` added.
Geometry GeometryOf(const PointCloud& cloud);
// The points one after the other, joined by lines.
Geometry PathGeometry(const std::vector<Eigen::Vector3d>& waypoints);

// True if the coordinates of PLY and PCD are doubles.
bool NeedsDouble(const Geometry& geometry);

// The bytes of a file. INVALID_ARGUMENT if a column's length or an index does not fit.
// Coordinates are float where that is fine to 0.5 mm (all within ±8192 m), else double, which PCL's
// own point types do not read.
//
// PLY: binary_little_endian; vertex x y z, then nx ny nz, intensity, red green blue, label where
// given; elements face (list uchar int vertex_indices) and edge (vertex1, vertex2) where there are
// any.
absl::StatusOr<std::string> PlyBytes(const Geometry& geometry);
// PCD 0.7, DATA binary; x y z, intensity, rgb, label. Normals, triangles and lines are left out.
absl::StatusOr<std::string> PcdBytes(const Geometry& geometry);
// Wavefront OBJ, text with 6 decimals; colour as three numbers after x y z, as MeshLab and Blender
// read it; without faces or lines every vertex is a point element. No normals, intensity, label.
absl::StatusOr<std::string> ObjText(const Geometry& geometry);
// STL, binary: triangles alone, each with its normal. FAILED_PRECONDITION for coordinates that are
// not fine as floats, which is all that STL has.
absl::StatusOr<std::string> StlBytes(const Geometry& geometry);
// Binary glTF 2.0: one mesh of triangles with normals and colours where given; without triangles no
// mesh. Its node turns z up into glTF's y up and moves the mesh to its place, so that the floats of
// glTF are fine anywhere. No lines, intensity, label. RESOURCE_EXHAUSTED beyond 4 GiB.
absl::StatusOr<std::string> GlbBytes(const Geometry& geometry);

// The file formats of meshes.
enum class MeshFormat : std::uint8_t { kPly, kObj, kStl, kGlb };
// By the ending of a file's name, or the name of the format; INVALID_ARGUMENT naming those there
// are.
absl::StatusOr<MeshFormat> MeshFormatOf(absl::string_view file_or_format);
absl::StatusOr<std::string> MeshBytes(MeshFormat format, const Geometry& geometry);

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_GEOMETRY_WRITER_H_
