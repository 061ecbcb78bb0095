// Maps as pictures, in the colours of the thesis (Fig. 6.6): traversable yellow, horizontal but not
// traversable red, vertical blue; surfaces that nobody judged, or saw from below only, are grey. Or
// in those of classes, or in their own.
#ifndef STRATA_CLIENT_CLI_PICTURE_MAP_PICTURE_H_
#define STRATA_CLIENT_CLI_PICTURE_MAP_PICTURE_H_

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Geometry>

#include "client/cli/picture/image.h"
#include "client/cli/picture/raster.h"
#include "core/mls/surface_tile.h"

namespace strata::picture {

inline constexpr Colour kTraversableColour = {255, 214, 48};
inline constexpr Colour kNonTraversableColour = {222, 62, 50};
inline constexpr Colour kVerticalColour = {62, 104, 214};
inline constexpr Colour kUnknownColour = {176, 176, 172};
// Pixels at the lower edge that belong to the legend.
inline constexpr int kLegendPixels = 44;

// Drawn over the map; each in its own colour.
using Path = std::vector<Eigen::Vector3d>;

// A line over the map.
struct Stroke {
  Path points;
  Colour colour;
  double width_pixels = 4.0;
  bool dashed = false;
};

// A word over the map, beside a place of it; what DrawText() has letters for.
struct PlaceName {
  Eigen::Vector3d at = Eigen::Vector3d::Zero();
  std::string name;
};

// What is drawn over a map beside paths, and what it means: a column in the upper left corner.
struct Overlay {
  std::vector<Stroke> strokes;  // above the map, later ones above earlier ones
  std::vector<std::pair<Colour, std::string>> legend;
  std::vector<PlaceName> names = {};  // above the lines
};

// How surfaces of a class are drawn, and what they are called in the legend.
struct ClassStyle {
  std::string name;
  Colour colour;
};
using ClassStyles = std::map<std::uint8_t, ClassStyle>;  // by class id

struct PictureOptions {
  int width = 1600;
  int height = 1100;
  // Where the viewer stands (see Camera::From); the default is the plan.
  double azimuth_rad = -1.5707963267948966;
  double elevation_rad = 1.5707963267948966;
  // Only what lies between these heights; vertical patches are cut.
  std::optional<std::pair<double, double>> slice_m = std::nullopt;
  // Instead of by traversability: tops and sides by class; grey without one that is here.
  std::optional<ClassStyles> classes = std::nullopt;
  // Instead of both: tops and sides as their points are; grey where none had a colour.
  bool own_colours = false;
};

struct Picture {
  Image image;
  Camera camera;  // the map's point `centre` is in the middle of the part above the legend
};

// Tiles are of one level of detail with cells of `cell_size_m`. The view holds all surfaces but a
// few stray ones. Without surfaces it shows a metre around the origin.
// The legend is below, as much of it as fits the width, with a scale bar; the axes of the map are
// in the lower left corner.
// With classes, those that surfaces have are in a column in the upper left corner, by id.
//   A traversable top is yellow even on a vertical patch (a deck seen from both sides); the sides
//   are blue then. Higher surfaces are lighter.
Picture DrawMap(const std::vector<SurfaceTile>& tiles,
                double cell_size_m,
                const std::vector<Path>& paths,
                const PictureOptions& options,
                const Overlay& overlay = {});

}  // namespace strata::picture

#endif  // STRATA_CLIENT_CLI_PICTURE_MAP_PICTURE_H_
