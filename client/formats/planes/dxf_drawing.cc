#include "client/formats/planes/dxf_drawing.h"

#include <cstddef>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/string_view.h"

namespace strata {
namespace {

constexpr int kClosed3dLine = 1 | 8;  // flags of a POLYLINE
constexpr int kPointOf3dLine = 32;    // of its VERTEX
constexpr int kNoEdgeShown = 15;      // of a 3DFACE, a bit an edge

// A value behind its group code, each on a line of its own.
template <typename T>
void AddGroup(std::string& out, int code, const T& value) {
  absl::StrAppend(&out, code, "\n", value, "\n");
}

void AddEntity(std::string& out, absl::string_view kind, absl::string_view layer) {
  AddGroup(out, 0, kind);
  AddGroup(out, 8, layer);
}

void BeginTable(std::string& out, absl::string_view name, std::size_t rows) {
  AddGroup(out, 0, "TABLE");
  AddGroup(out, 2, name);
  AddGroup(out, 70, rows);
}

void AddPointOf(std::string& out, int code, const Eigen::Vector3d& p) {
  for (int axis = 0; axis < 3; ++axis) {
    absl::StrAppendFormat(&out, "%d\n%.6f\n", code + 10 * axis, p[axis]);
  }
}

// Of dashes and gaps 0.25 long; solid: none.
void AddLineType(std::string& out, absl::string_view name, bool dashed) {
  AddGroup(out, 0, "LTYPE");
  AddGroup(out, 2, name);
  AddGroup(out, 70, 0);
  AddGroup(out, 3, dashed ? "_ _ _" : "solid");
  AddGroup(out, 72, 65);
  AddGroup(out, 73, dashed ? 2 : 0);
  AddGroup(out, 40, dashed ? "0.5" : "0.0");
  if (!dashed) return;
  AddGroup(out, 49, "0.25");
  AddGroup(out, 49, "-0.25");
}

void AddLayer(std::string& out, const DxfLayer& layer) {
  AddGroup(out, 0, "LAYER");
  AddGroup(out, 2, layer.name);
  AddGroup(out, 70, 0);
  AddGroup(out, 62, layer.colour);
  AddGroup(out, 6, layer.dashed ? "DASHED" : "CONTINUOUS");
}

}  // namespace

void DxfDrawing::AddPoint(int code, const Eigen::Vector3d& p) {
  AddPointOf(entities_, code, p);
  box_.extend(p);
}

void DxfDrawing::AddLine(absl::string_view layer,
                         const Eigen::Vector3d& a,
                         const Eigen::Vector3d& b) {
  AddEntity(entities_, "LINE", layer);
  AddPoint(10, a);
  AddPoint(11, b);
}

void DxfDrawing::AddRing(absl::string_view layer, const std::vector<Eigen::Vector3d>& ring) {
  AddEntity(entities_, "POLYLINE", layer);
  AddGroup(entities_, 66, 1);
  AddPointOf(entities_, 10, Eigen::Vector3d::Zero());
  AddGroup(entities_, 70, kClosed3dLine);
  for (const Eigen::Vector3d& p : ring) {
    AddEntity(entities_, "VERTEX", layer);
    AddPoint(10, p);
    AddGroup(entities_, 70, kPointOf3dLine);
  }
  AddEntity(entities_, "SEQEND", layer);
}

void DxfDrawing::AddFace(absl::string_view layer, const FlatPiece& corners) {
  AddEntity(entities_, "3DFACE", layer);
  for (int i = 0; i < 4; ++i) AddPoint(10 + i, corners[static_cast<std::size_t>(i)]);
  AddGroup(entities_, 70, kNoEdgeShown);
}

void DxfDrawing::AddSolid(absl::string_view layer, const Eigen::AlignedBox2d& box) {
  AddEntity(entities_, "SOLID", layer);
  // Row by row, not around.
  for (int i = 0; i < 4; ++i) {
    const auto corner = static_cast<Eigen::AlignedBox2d::CornerType>(i);
    const Eigen::Vector2d p = box.corner(corner);
    AddPoint(10 + i, {p.x(), p.y(), 0.0});
  }
}

std::string DxfDrawing::Text() const {
  std::string out;
  AddGroup(out, 0, "SECTION");
  AddGroup(out, 2, "HEADER");
  AddGroup(out, 9, "$ACADVER");
  AddGroup(out, 1, "AC1009");
  if (!box_.isEmpty()) {
    AddGroup(out, 9, "$EXTMIN");
    AddPointOf(out, 10, box_.min());
    AddGroup(out, 9, "$EXTMAX");
    AddPointOf(out, 10, box_.max());
  }
  AddGroup(out, 0, "ENDSEC");
  AddGroup(out, 0, "SECTION");
  AddGroup(out, 2, "TABLES");
  BeginTable(out, "LTYPE", 2);
  AddLineType(out, "CONTINUOUS", false);
  AddLineType(out, "DASHED", true);
  AddGroup(out, 0, "ENDTAB");
  BeginTable(out, "LAYER", layers_.size() + 1);
  AddLayer(out, {"0"});  // every drawing has it
  for (const DxfLayer& layer : layers_) AddLayer(out, layer);
  AddGroup(out, 0, "ENDTAB");
  AddGroup(out, 0, "ENDSEC");
  AddGroup(out, 0, "SECTION");
  AddGroup(out, 2, "ENTITIES");
  out += entities_;
  AddGroup(out, 0, "ENDSEC");
  AddGroup(out, 0, "EOF");
  return out;
}

}  // namespace strata
