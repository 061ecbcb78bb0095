// Lines and faces on layers as a DXF file, which any CAD program reads.
#ifndef STRATA_CLIENT_FORMATS_PLANES_DXF_DRAWING_H_
#define STRATA_CLIENT_FORMATS_PLANES_DXF_DRAWING_H_

#include <string>
#include <utility>
#include <vector>

#include "absl/strings/string_view.h"
#include <Eigen/Geometry>

#include "client/formats/planes/polygon_pieces.h"

namespace strata {

// How the lines of a layer look; the numbers of colours are AutoCAD's (1 red … 7 black or white).
struct DxfLayer {
  std::string name;  // capital letters
  int colour = 7;
  bool dashed = false;
};

// DXF R12 (AC1009) in ASCII with 6 decimals, in the unit of what is added. Entities are finite and
// on a layer of the constructor.
class DxfDrawing {
 public:
  explicit DxfDrawing(std::vector<DxfLayer> layers) : layers_(std::move(layers)) {}

  void AddLine(absl::string_view layer, const Eigen::Vector3d& a, const Eigen::Vector3d& b);
  // A closed line of three points or more.
  void AddRing(absl::string_view layer, const std::vector<Eigen::Vector3d>& ring);
  // A 3DFACE whose edges are not drawn: rings say where the borders are.
  void AddFace(absl::string_view layer, const FlatPiece& corners);
  // A filled SOLID over a level box, at z = 0.
  void AddSolid(absl::string_view layer, const Eigen::AlignedBox2d& box);

  std::string Text() const;

 private:
  void AddPoint(int code, const Eigen::Vector3d& p);

  std::vector<DxfLayer> layers_;
  std::string entities_;
  Eigen::AlignedBox3d box_;
};

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_PLANES_DXF_DRAWING_H_
