#include "client/cli/picture/map_picture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include <Eigen/Geometry>

namespace strata::picture {
namespace {

using Eigen::Vector3d;

constexpr Colour kBackground = {250, 250, 247};
constexpr Colour kInk = {40, 42, 46};
constexpr std::array<Colour, 4> kPathColours = {
    {{16, 24, 32}, {0, 150, 90}, {200, 0, 170}, {0, 160, 200}}};
constexpr double kPathWidthPixels = 4.0;

struct BlockColours {
  Colour top, side;
};

// A surface cut to the slice, in map coordinates.
struct Block {
  double x = 0.0, y = 0.0;  // lower left corner of the cell
  double top = 0.0, bottom = 0.0;
  bool vertical = false;
  BlockColours colours = {};
};

Colour TraversabilityColour(const Surface& surface, bool cut) {
  if (cut) return kVerticalColour;
  switch (surface.traversability) {
    case Traversability::kTraversable:
      return kTraversableColour;
    case Traversability::kNonTraversable:
      return surface.vertical() ? kVerticalColour : kNonTraversableColour;
    case Traversability::kUnknown:
    case Traversability::kUnderside:
      break;
  }
  return surface.vertical() ? kVerticalColour : kUnknownColour;
}

Colour ClassColour(const Surface& surface, const ClassStyles& classes) {
  const auto style = classes.find(surface.class_id);
  return style == classes.end() ? kUnknownColour : style->second.colour;
}

// `cut`: the top is where the slice ends.
BlockColours ColoursOf(const Surface& surface, bool cut, const PictureOptions& options) {
  if (options.own_colours) {
    const Colour colour = surface.coloured() ? surface.colour : kUnknownColour;
    return {colour, colour};
  }
  if (options.classes.has_value()) {
    const Colour colour = ClassColour(surface, *options.classes);
    return {colour, colour};
  }
  const Colour top = TraversabilityColour(surface, cut);
  return {top, surface.vertical() ? kVerticalColour : top};
}

bool HasTops(const std::vector<SurfaceTile>& tiles) {
  return std::ranges::any_of(tiles, [](const SurfaceTile& tile) {
    return !std::ranges::all_of(tile.surfaces, &Surface::underside);
  });
}

std::vector<Block> BlocksOf(const std::vector<SurfaceTile>& tiles,
                            double cell,
                            const PictureOptions& options) {
  const auto [low, high] = options.slice_m.value_or(std::make_pair(-1e9, 1e9));
  // Whoever looks from above sees no ceiling, but the floor that it would hide.
  const bool skip_undersides = !options.slice_m.has_value() && HasTops(tiles);
  std::vector<Block> blocks;
  for (const SurfaceTile& tile : tiles) {
    for (const Surface& surface : tile.surfaces) {
      if (skip_undersides && surface.underside()) continue;
      if (surface.z_m < low || surface.bottom_m() > high ||
          (!surface.vertical() && surface.z_m > high)) {
        continue;
      }
      const CellIndex index = CellOf(tile.key, surface.cell);
      blocks.push_back({.x = index.x * cell,
                        .y = index.y * cell,
                        .top = std::min<double>(surface.z_m, high),
                        .bottom = std::max<double>(surface.bottom_m(), low),
                        .vertical = surface.vertical(),
                        .colours = ColoursOf(surface, surface.z_m > high, options)});
    }
  }
  return blocks;
}

// The values between which all but `share` of the numbers lie at either end; all of them if the
// strays are not far out.
std::pair<double, double> Bulk(std::vector<double> values, double share) {
  if (values.empty()) {
    return {-1.0, 1.0};
  }
  std::sort(values.begin(), values.end());
  const auto skip = static_cast<std::size_t>(share * static_cast<double>(values.size()));
  const double low = values[skip];
  const double high = values[values.size() - 1 - skip];
  if (values.back() - values.front() < 1.25 * (high - low)) {
    return {values.front(), values.back()};
  }
  return {low, high};
}

Camera Frame(const std::vector<Block>& blocks, double cell, const PictureOptions& options) {
  Camera camera = Camera::From(options.azimuth_rad, options.elevation_rad);
  camera.metres_per_pixel = 1.0;
  constexpr double kStrays = 0.012;
  std::array<std::vector<double>, 3> projected;
  for (const Block& block : blocks) {
    const Vector3d p(block.x + 0.5 * cell, block.y + 0.5 * cell, block.top);
    projected[0].push_back(camera.right.dot(p));
    projected[1].push_back(camera.up.dot(p));
    projected[2].push_back(camera.forward.dot(p));
  }
  const auto [left, right] = Bulk(std::move(projected[0]), kStrays);
  const auto [down, up] = Bulk(std::move(projected[1]), kStrays);
  const auto [near, far] = Bulk(std::move(projected[2]), kStrays);
  camera.centre = 0.5 * ((left + right) * camera.right + (down + up) * camera.up +
                         (near + far) * camera.forward);
  constexpr double kMargin = 1.04;
  const int height = options.height - kLegendPixels;
  camera.metres_per_pixel = kMargin * std::max({(right - left + 2.0 * cell) / options.width,
                                                (up - down + 2.0 * cell) / height,
                                                1e-4});
  return camera;
}

Colour Lit(Colour colour, double factor) {
  return factor <= 1.0 ? Blend({0, 0, 0}, colour, factor)
                       : Blend(colour, {255, 255, 255}, std::min(factor - 1.0, 1.0));
}

// Draws cells as boxes: the top, and the two sides that face the viewer.
class BlockPainter {
 public:
  BlockPainter(Raster& raster, const Camera& camera, double cell, std::pair<double, double> heights)
      : raster_(raster), camera_(camera), cell_(cell), heights_(heights) {}

  void Paint(const Block& block) {
    const double x0 = block.x;
    const double y0 = block.y;
    const double x1 = x0 + cell_;
    const double y1 = y0 + cell_;
    const double top = block.top;
    const double light = Light(top);
    raster_.FillQuad({{{x0, y0, top}, {x1, y0, top}, {x1, y1, top}, {x0, y1, top}}},
                     Lit(block.colours.top, light));
    // A horizontal patch gets sides too, so that slopes have no cracks.
    const double bottom = block.vertical ? block.bottom : top - 0.6 * cell_;
    const Colour side = block.colours.side;
    const double x = camera_.forward.x() < 0.0 ? x1 : x0;
    const double y = camera_.forward.y() < 0.0 ? y1 : y0;
    PaintSide({x, y0, 0.0}, {x, y1, 0.0}, bottom, top, block.vertical, Lit(side, 0.92), light);
    PaintSide({x0, y, 0.0}, {x1, y, 0.0}, bottom, top, block.vertical, Lit(side, 0.78), light);
  }

 private:
  double Light(double z) const {
    const double share = (z - heights_.first) / std::max(heights_.second - heights_.first, 0.5);
    return 0.86 + 0.3 * std::clamp(share, 0.0, 1.0);
  }

  // Tall sides get lighter with height in pieces of a metre.
  void PaintSide(Vector3d a,
                 Vector3d b,
                 double bottom,
                 double top,
                 bool vertical,
                 Colour colour,
                 double light) {
    const int pieces = vertical ? std::clamp(static_cast<int>(top - bottom), 1, 64) : 1;
    for (int piece = 0; piece < pieces; ++piece) {
      const double low = bottom + (top - bottom) * piece / pieces;
      const double high = bottom + (top - bottom) * (piece + 1) / pieces;
      const double factor = vertical ? Light(0.5 * (low + high)) : light;
      raster_.FillQuad(
          {{{a.x(), a.y(), low}, {b.x(), b.y(), low}, {b.x(), b.y(), high}, {a.x(), a.y(), high}}},
          Lit(colour, factor));
    }
  }

  Raster& raster_;
  const Camera& camera_;
  double cell_;
  std::pair<double, double> heights_;
};

// The longest 1, 2 or 5 · 10^n metres within `limit_m`.
double RoundLength(double limit_m) {
  const double power = std::pow(10.0, std::floor(std::log10(limit_m)));
  for (const double digit : {5.0, 2.0}) {
    if (digit * power <= limit_m) {
      return digit * power;
    }
  }
  return power;
}

constexpr std::array<std::pair<Colour, const char*>, 4> kEntries = {
    {{kTraversableColour, "traversable"},
     {kNonTraversableColour, "not traversable"},
     {kVerticalColour, "vertical"},
     {kUnknownColour, "unknown"}}};

// Where the text of the legend begins, `scale` pixels a dot.
int LegendTop(const Image& image, int scale) {
  return image.height - kLegendPixels + (kLegendPixels - 7 * scale) / 2;
}

// Returns where the entries end.
int DrawEntries(Image& image, int scale) {
  const int y = LegendTop(image, scale);
  int x = 10 * scale;
  for (const auto& [colour, text] : kEntries) {
    FillRectangle(image, x, y - scale, 9 * scale, 9 * scale, colour);
    x = DrawText(image, x + 13 * scale, y, scale, text, kInk) + 13 * scale;
  }
  return x;
}

// Returns where the bar begins.
int DrawScaleBar(Image& image, const Camera& camera, int scale) {
  const double length = RoundLength(0.2 * image.width * camera.metres_per_pixel);
  const int pixels = static_cast<int>(std::lround(length / camera.metres_per_pixel));
  const std::string label = absl::StrCat(length, " m");
  const int text = image.width - 12 * scale - static_cast<int>(label.size()) * 6 * scale;
  const int begin = text - 6 * scale - pixels;
  const int y = LegendTop(image, scale);
  FillRectangle(image, begin, y + 3 * scale, pixels, 3, kInk);
  FillRectangle(image, begin, y, 3, 7 * scale, kInk);
  FillRectangle(image, begin + pixels - 3, y, 3, 7 * scale, kInk);
  DrawText(image, text, y, scale, label, kInk);
  return begin;
}

// As large as fits; the scale bar alone where nothing else does, or where colours do not say what
// is traversable.
void DrawLegend(Image& image, const Camera& camera, bool traversability) {
  if (!traversability) {
    DrawScaleBar(image, camera, image.width >= 1000 ? 2 : 1);
    return;
  }
  for (const int scale : {2, 1}) {
    Image trial(image.width, image.height, kBackground);
    if (DrawEntries(trial, scale) <= DrawScaleBar(trial, camera, scale)) {
      DrawEntries(image, scale);
      DrawScaleBar(image, camera, scale);
      return;
    }
  }
  DrawScaleBar(image, camera, 1);
}

using Entries = std::vector<std::pair<Colour, std::string>>;

// The classes that surfaces have; those that nobody styled, and none, are the last entry.
Entries ClassEntries(const std::vector<SurfaceTile>& tiles, const PictureOptions& options) {
  Entries entries;
  if (!options.classes.has_value()) return entries;
  std::set<std::uint8_t> seen;
  for (const SurfaceTile& tile : tiles) {
    for (const Surface& surface : tile.surfaces) seen.insert(surface.class_id);
  }
  bool none = false;
  for (const std::uint8_t id : seen) {
    const auto style = options.classes->find(id);
    none = none || style == options.classes->end();
    if (style == options.classes->end()) continue;
    entries.emplace_back(style->second.colour, absl::AsciiStrToLower(style->second.name));
  }
  if (none) entries.emplace_back(kUnknownColour, "no class");
  return entries;
}

// One below the other, on a ground of their own: areas as squares, lines as dashes.
void DrawColumnLegend(Image& image, const Entries& areas, const Overlay& overlay) {
  Entries all = areas;
  all.insert(all.end(), overlay.legend.begin(), overlay.legend.end());
  if (all.empty()) return;
  const int scale = image.width >= 1000 ? 2 : 1;
  const int row = 12 * scale;
  std::size_t longest = 0;
  for (const auto& [colour, text] : all) longest = std::max(longest, text.size());
  const int width = (20 + 6 * static_cast<int>(longest)) * scale;
  const int height = row * static_cast<int>(all.size()) + 6 * scale;
  FillRectangle(image, 4 * scale, 4 * scale, width, height, kBackground);
  int y = 8 * scale;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const bool area = i < areas.size();
    FillRectangle(image,
                  8 * scale,
                  area ? y - scale : y + 2 * scale,
                  9 * scale,
                  (area ? 9 : 3) * scale,
                  all[i].first);
    DrawText(image, 20 * scale, y, scale, all[i].second, kInk);
    y += row;
  }
}

// Every second piece of `length_m` of the line.
std::vector<Path> Dashes(const Path& line, double length_m) {
  std::vector<Path> dashes;
  for (std::size_t i = 1; i < line.size(); ++i) {
    const Vector3d along = line[i] - line[i - 1];
    const int pieces = std::clamp(static_cast<int>(along.norm() / length_m), 1, 1000);
    for (int piece = 0; piece < pieces; piece += 2) {
      dashes.push_back(
          {line[i - 1] + along * piece / pieces, line[i - 1] + along * (piece + 1) / pieces});
    }
  }
  return dashes;
}

// Above everything: a diagram of what is below a roof must be seen too.
void DrawStroke(Raster& raster, const Camera& camera, const Stroke& stroke) {
  constexpr double kDashPixels = 9.0;
  constexpr double kNothingHidesM = 1e9;
  const std::vector<Path> lines = stroke.dashed
                                      ? Dashes(stroke.points, kDashPixels * camera.metres_per_pixel)
                                      : std::vector<Path>{stroke.points};
  for (const Path& line : lines) {
    raster.DrawLine(line, stroke.width_pixels, stroke.colour, kNothingHidesM);
  }
}

// The axes of the map in the lower left corner, as far as the view shows them.
void DrawAxes(Image& image, const Camera& camera) {
  const int length = std::clamp(image.width / 40, 14, 36);
  const int scale = length > 24 ? 2 : 1;  // of the letters
  const int left = length + 14;
  const int bottom = image.height - kLegendPixels - length - 14;
  const std::array<std::pair<Vector3d, const char*>, 3> axes = {
      {{Vector3d::UnitX(), "x"}, {Vector3d::UnitY(), "y"}, {Vector3d::UnitZ(), "z"}}};
  for (const int width : {4, 2}) {  // light below dark, to be seen on any ground
    for (const auto& [axis, name] : axes) {
      const double right = length * camera.right.dot(axis);
      const double down = -length * camera.up.dot(axis);
      if (std::hypot(right, down) < 0.2 * length) continue;  // looks along it
      for (int step = 0; step <= length; ++step) {
        const double share = static_cast<double>(step) / length;
        const int x = left + static_cast<int>(std::lround(share * right)) - width / 2;
        const int y = bottom + static_cast<int>(std::lround(share * down)) - width / 2;
        FillRectangle(image, x, y, width, width, width == 2 ? kInk : kBackground);
      }
      const double beyond = 1.0 + 7.0 * scale / std::hypot(right, down);
      DrawText(image,
               left + static_cast<int>(std::lround(beyond * right)) - 5 * scale / 2,
               bottom + static_cast<int>(std::lround(beyond * down)) - 7 * scale / 2,
               scale,
               name,
               kInk);
    }
  }
}

// To the right of and above their places.
void DrawNames(Image& image, const Camera& camera, int width, int height, const Overlay& overlay) {
  for (const PlaceName& name : overlay.names) {
    const Vector3d pixel = camera.Project(name.at);
    const int x = static_cast<int>(std::lround(0.5 * width + pixel.x())) + 4;
    const int y = static_cast<int>(std::lround(0.5 * height + pixel.y())) - 9;
    if (x < 0 || y < 0 || x >= width || y + 7 >= height) continue;
    DrawText(image, x, y, 1, name.name, kInk);
  }
}

}  // namespace

Picture DrawMap(const std::vector<SurfaceTile>& tiles,
                double cell_size_m,
                const std::vector<Path>& paths,
                const PictureOptions& options,
                const Overlay& overlay) {
  const std::vector<Block> blocks = BlocksOf(tiles, cell_size_m, options);
  Picture picture;
  picture.camera = Frame(blocks, cell_size_m, options);
  std::vector<double> heights;
  heights.reserve(blocks.size());
  for (const Block& block : blocks) {
    heights.push_back(block.top);
  }
  Raster raster(options.width, options.height - kLegendPixels, picture.camera, kBackground);
  BlockPainter painter(raster, picture.camera, cell_size_m, Bulk(std::move(heights), 0.02));
  for (const Block& block : blocks) {
    painter.Paint(block);
  }
  raster.ShadeByDepth(2.2);
  const double tolerance_m = std::max(0.4, 2.0 * cell_size_m);
  for (const Stroke& stroke : overlay.strokes) DrawStroke(raster, picture.camera, stroke);
  for (std::size_t i = 0; i < paths.size(); ++i) {
    raster.DrawLine(paths[i], kPathWidthPixels, kPathColours[i % kPathColours.size()], tolerance_m);
  }
  const Image map = raster.Finish();
  picture.image = Image(options.width, options.height, kBackground);
  std::copy(map.pixels.begin(), map.pixels.end(), picture.image.pixels.begin());
  DrawNames(picture.image, picture.camera, options.width, options.height - kLegendPixels, overlay);
  DrawAxes(picture.image, picture.camera);
  DrawColumnLegend(picture.image, ClassEntries(tiles, options), overlay);
  DrawLegend(picture.image, picture.camera, !options.classes.has_value() && !options.own_colours);
  return picture;
}

}  // namespace strata::picture
