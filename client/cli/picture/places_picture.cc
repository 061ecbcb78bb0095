#include "client/cli/picture/places_picture.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>

namespace strata::picture {
namespace {

constexpr int kWidth = 1600, kHeight = 1100;
constexpr int kMostPixels = 16;  // a cell
constexpr int kLegendHeight = 40;
constexpr Colour kUnseenColour = {236, 236, 234};
constexpr Colour kOccupiedColour = {40, 40, 44};
constexpr Colour kGroundColour = {196, 196, 192};
constexpr Colour kTextColour = {20, 20, 20};

Colour ColourOf(PlaceKind kind) {
  return kind == PlaceKind::kRoom       ? kRoomColour
         : kind == PlaceKind::kCorridor ? kCorridorColour
                                        : kDoorwayColour;
}

// Cells to pixels.
class Sheet {
 public:
  Sheet(const Floor& floor, double cell_m) : cell_m_(cell_m) {
    std::int64_t low_x = std::numeric_limits<std::int32_t>::max(), low_y = low_x;
    std::int64_t high_x = std::numeric_limits<std::int32_t>::min(), high_y = high_x;
    for (const FloorBlock& block : floor.blocks) {
      low_x = std::min<std::int64_t>(low_x, block.x);
      low_y = std::min<std::int64_t>(low_y, block.y);
      high_x = std::max<std::int64_t>(high_x, block.x);
      high_y = std::max<std::int64_t>(high_y, block.y);
    }
    if (floor.blocks.empty()) low_x = low_y = high_x = high_y = 0;
    const double columns = static_cast<double>(high_x - low_x + 1) * kFloorBlockCells;
    const double rows = static_cast<double>(high_y - low_y + 1) * kFloorBlockCells;
    const double fit = std::min(kWidth / columns, kHeight / rows);
    scale_ = fit >= 1.0 ? std::min<double>(kMostPixels, std::floor(fit)) : fit;
    left_ = static_cast<double>(low_x) * kFloorBlockCells;
    top_ = static_cast<double>(high_y + 1) * kFloorBlockCells;
    image_ = Image(std::max(260, static_cast<int>(std::ceil(columns * scale_))),
                   static_cast<int>(std::ceil(rows * scale_)) + kLegendHeight,
                   kUnseenColour);
  }

  void Paint(std::int32_t block_x, std::int32_t block_y, std::uint64_t cells, Colour colour) {
    const int side = std::max(1, static_cast<int>(std::ceil(scale_)));
    for (int cell = 0; cell < kFloorBlockCells * kFloorBlockCells; ++cell) {
      if ((cells >> cell & 1U) == 0) continue;
      const double x = double{kFloorBlockCells} * block_x + cell % kFloorBlockCells;
      const double y = double{kFloorBlockCells} * block_y + cell / kFloorBlockCells;
      FillRectangle(image_, Column(x), Row(y + 1), side, side, colour);
    }
  }
  void Name(const Eigen::Vector2d& at_m, const std::string& text) {
    DrawText(image_,
             Column(at_m.x() / cell_m_) - 6 * static_cast<int>(text.size()),
             Row(at_m.y() / cell_m_) - 7,
             2,
             text,
             kTextColour);
  }
  void Legend() {
    int x = 8;
    const int y = image_.height - kLegendHeight + 12;
    FillRectangle(image_, 0, y - 12, image_.width, kLegendHeight, {255, 255, 255});
    for (const PlaceKind kind : kPlaceKinds) {
      FillRectangle(image_, x, y, 16, 16, ColourOf(kind));
      x = DrawText(image_, x + 22, y + 1, 1, std::string(ToString(kind)), kTextColour) + 12;
    }
  }
  const Image& image() const { return image_; }

 private:
  int Column(double cell_x) const {
    return static_cast<int>(std::floor((cell_x - left_) * scale_));
  }
  int Row(double cell_y) const { return static_cast<int>(std::floor((top_ - cell_y) * scale_)); }

  double cell_m_;
  double scale_ = 1.0;  // pixels a cell
  double left_ = 0.0, top_ = 0.0;
  Image image_;
};

}  // namespace

Image DrawPlaces(const FloorPlaces& places, const Floor& floor) {
  Sheet sheet(floor, places.cell_size_m);
  for (const FloorBlock& block : floor.blocks) {
    sheet.Paint(block.x, block.y, block.ground | block.free, kGroundColour);
    sheet.Paint(block.x, block.y, block.occupied, kOccupiedColour);
  }
  for (const Place& place : places.places) {
    for (const PlaceBlock& block : place.blocks) {
      sheet.Paint(block.x, block.y, block.cells, ColourOf(place.kind));
    }
  }
  for (std::size_t i = 0; i < places.places.size(); ++i) {
    if (places.places[i].kind == PlaceKind::kDoorway) continue;
    sheet.Name(places.places[i].middle, std::to_string(i));
  }
  sheet.Legend();
  return sheet.image();
}

}  // namespace strata::picture
