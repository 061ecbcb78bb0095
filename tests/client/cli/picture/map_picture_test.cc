#include "client/cli/picture/map_picture.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <png.h>

#include "tests/support/status_matchers.h"

namespace strata::picture {
namespace {

using Eigen::Vector3d;

// A tile whose cells (x, y) in [0, side)² have the surface that `at` gives.
template <typename F>
SurfaceTile TileOf(int side, const F& at) {
  SurfaceTile tile;
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      Surface surface = at(x, y);
      surface.cell = CellInTile({x, y});
      tile.surfaces.push_back(surface);
    }
  }
  tile.IndexRows();
  return tile;
}

Surface Ground(Traversability traversability, float z = 0.0F) {
  return {.traversability = traversability, .z_m = z, .sigma_m = 0.01F};
}

// The pixel where a point of the map is drawn.
Colour PixelAt(const Picture& picture, const Vector3d& p_map) {
  const Vector3d p = picture.camera.Project(p_map);
  const int x = static_cast<int>(std::floor(0.5 * picture.image.width + p.x()));
  const int y = static_cast<int>(std::floor(0.5 * (picture.image.height - kLegendPixels) + p.y()));
  return picture.image.At(x, y);
}

bool IsYellow(Colour c) { return c.r > 180 && c.g > 140 && c.b < 120; }
bool IsRed(Colour c) { return c.r > 150 && c.g < 110 && c.b < 110; }
bool IsBlue(Colour c) { return c.b > 130 && c.r < 120 && c.b > c.g + 40; }

TEST(MapPictureTest, PlanShowsEachKindOfSurfaceInItsColour) {
  const SurfaceTile tile = TileOf(60, [](int x, int) {
    if (x < 20) return Ground(Traversability::kTraversable);
    if (x < 40) return Ground(Traversability::kNonTraversable);
    Surface wall = Ground(Traversability::kNonTraversable, 2.0F);
    wall.depth_m = 2.0F;
    return wall;
  });
  const Picture picture = DrawMap({tile}, 0.1, {}, {.width = 400, .height = 444});
  EXPECT_TRUE(IsYellow(PixelAt(picture, {1.0, 3.0, 0.0})));
  EXPECT_TRUE(IsRed(PixelAt(picture, {3.0, 3.0, 0.0})));
  EXPECT_TRUE(IsBlue(PixelAt(picture, {5.0, 3.0, 2.0})));
}

TEST(MapPictureTest, SurfacesHaveTheirOwnColours) {
  const SurfaceTile tile = TileOf(60, [](int x, int) {
    Surface surface = Ground(Traversability::kTraversable);
    if (x < 20) surface.colour = {20, 200, 40};
    if (x >= 40) surface.colour = {200, 30, 40};
    return surface;
  });
  const Picture picture =
      DrawMap({tile}, 0.1, {}, {.width = 400, .height = 444, .own_colours = true});
  const Colour green = PixelAt(picture, {1.0, 3.0, 0.0});
  EXPECT_GT(green.g, green.r + 60);
  const Colour none = PixelAt(picture, {3.0, 3.0, 0.0});
  EXPECT_LT(std::abs(none.r - none.b), 30);
  EXPECT_TRUE(IsRed(PixelAt(picture, {5.0, 3.0, 0.0})));
}

TEST(MapPictureTest, ClassesHaveTheirColoursAndALegend) {
  const SurfaceTile tile = TileOf(60, [](int x, int) {
    Surface surface = Ground(Traversability::kTraversable, x < 40 ? 0.0F : 2.0F);
    surface.class_id = x < 20 ? 7 : x < 40 ? 0 : 9;
    surface.depth_m = x < 40 ? 0.0F : 2.0F;
    return surface;
  });
  PictureOptions options = {.width = 400, .height = 444};
  options.classes = {{7, {"Lawn_1", {20, 160, 40}}}, {9, {"wall", {200, 30, 40}}}};
  const Picture picture = DrawMap({tile}, 0.1, {}, options);
  const Colour lawn = PixelAt(picture, {1.0, 3.0, 0.0});
  EXPECT_GT(lawn.g, lawn.r + 60);
  const Colour none = PixelAt(picture, {3.0, 3.0, 0.0});
  EXPECT_LT(std::abs(none.r - none.b), 30);
  EXPECT_TRUE(IsRed(PixelAt(picture, {5.0, 3.0, 2.0})));
  // The squares of the column: lawn, wall, no class.
  EXPECT_EQ(picture.image.At(10, 10), (Colour{20, 160, 40}));
  EXPECT_EQ(picture.image.At(10, 22), (Colour{200, 30, 40}));
  EXPECT_EQ(picture.image.At(10, 34), kUnknownColour);
  // Classes that no surface has are not in it.
  options.classes->emplace(11, ClassStyle{"pond", {1, 2, 250}});
  EXPECT_EQ(DrawMap({tile}, 0.1, {}, options).image.pixels, picture.image.pixels);
}

TEST(MapPictureTest, PlanHasXToTheRightAndYUp) {
  const Picture picture = DrawMap(
      {TileOf(50, [](int, int) { return Ground(Traversability::kTraversable); })}, 0.1, {}, {});
  const Vector3d right = picture.camera.Project(picture.camera.centre + Vector3d::UnitX());
  const Vector3d up = picture.camera.Project(picture.camera.centre + Vector3d::UnitY());
  EXPECT_NEAR(right.x(), 1.0 / picture.camera.metres_per_pixel, 1e-9);
  EXPECT_NEAR(right.y(), 0.0, 1e-9);
  EXPECT_NEAR(up.y(), -1.0 / picture.camera.metres_per_pixel, 1e-9);
}

TEST(MapPictureTest, UpperLevelHidesTheLowerAndASliceShowsIt) {
  SurfaceTile tile;
  for (int cell = 0; cell < 40 * 40; ++cell) {
    Surface road = Ground(Traversability::kNonTraversable, 0.0F);
    Surface deck = Ground(Traversability::kTraversable, 3.0F);
    road.cell = deck.cell = CellInTile({cell % 40, cell / 40});
    tile.surfaces.push_back(road);
    tile.surfaces.push_back(deck);
  }
  PictureOptions options{.width = 300, .height = 344};
  EXPECT_TRUE(IsYellow(PixelAt(DrawMap({tile}, 0.1, {}, options), {2, 2, 3})));
  options.slice_m = {-1.0, 1.0};
  EXPECT_TRUE(IsRed(PixelAt(DrawMap({tile}, 0.1, {}, options), {2, 2, 0})));
}

TEST(MapPictureTest, ACeilingHidesNoFloor) {
  SurfaceTile tile;
  for (int cell = 0; cell < 60 * 60; ++cell) {
    Surface floor = Ground(Traversability::kTraversable);
    Surface ceiling = Ground(Traversability::kUnderside, 3.0F);
    floor.cell = ceiling.cell = CellInTile({cell % 60, cell / 60});
    if (cell % 60 < 30) tile.surfaces.push_back(floor);
    tile.surfaces.push_back(ceiling);
  }
  tile.IndexRows();
  const PictureOptions options{.width = 400, .height = 444};
  const Picture whole = DrawMap({tile}, 0.1, {}, options);
  EXPECT_TRUE(IsYellow(PixelAt(whole, {1.0, 3.0, 0.0})));
  PictureOptions slice = options;
  slice.slice_m = {2.0, 4.0};
  const Colour asked_for = PixelAt(DrawMap({tile}, 0.1, {}, slice), {1.0, 3.0, 3.0});
  EXPECT_FALSE(IsYellow(asked_for));
  EXPECT_LT(asked_for.r, 220);  // grey, not the background
  std::erase_if(tile.surfaces, [](const Surface& s) { return !s.underside(); });
  tile.IndexRows();
  EXPECT_LT(PixelAt(DrawMap({tile}, 0.1, {}, options), {1.0, 3.0, 3.0}).r, 220);
}

TEST(MapPictureTest, ObliqueViewShowsTheFacingSideOfAWallAndItsDrivableTop) {
  const SurfaceTile tile = TileOf(60, [](int x, int y) {
    Surface surface = Ground(Traversability::kTraversable);
    if (x >= 20 && x < 40 && y >= 20 && y < 40) {
      surface.z_m = 3.0F;
      surface.depth_m = 3.0F;
    }
    return surface;
  });
  PictureOptions options{.width = 500, .height = 544};
  options.azimuth_rad = -1.2;  // from the south
  options.elevation_rad = 0.6;
  const Picture picture = DrawMap({tile}, 0.1, {}, options);
  EXPECT_TRUE(IsBlue(PixelAt(picture, {3.05, 2.0, 1.5})));
  EXPECT_TRUE(IsYellow(PixelAt(picture, {3.05, 3.05, 3.0})));
  EXPECT_TRUE(IsYellow(PixelAt(picture, {3.05, 0.5, 0.0})));
  // The ground right behind the block is hidden by it.
  EXPECT_TRUE(IsYellow(PixelAt(picture, {3.05, 5.9, 0.0})) ||
              IsBlue(PixelAt(picture, {3.05, 5.9, 0.0})));
}

TEST(MapPictureTest, PathIsDrawnOnTopAndFaintWhereSomethingHidesIt) {
  SurfaceTile tile = TileOf(
      80, [](int x, int) { return Ground(Traversability::kTraversable, x < 40 ? 0.0F : 4.0F); });
  const Path path = {{1.0, 4.0, 0.0}, {7.0, 4.0, 0.0}};
  const PictureOptions options{.width = 400, .height = 444};
  const Picture without = DrawMap({tile}, 0.1, {}, options);
  const Picture with = DrawMap({tile}, 0.1, {path}, options);
  const Colour open = PixelAt(with, {2.0, 4.0, 0.0});
  EXPECT_LT(open.r + open.g + open.b, 200);
  EXPECT_TRUE(IsYellow(PixelAt(without, {2.0, 4.0, 0.0})));
  const Colour hidden = PixelAt(with, {6.0, 4.0, 0.0});
  EXPECT_GT(hidden.r + hidden.g + hidden.b, 250);
  EXPECT_NE(hidden, PixelAt(without, {6.0, 4.0, 0.0}));
}

TEST(MapPictureTest, AnOverlayIsDrawnAboveWhatHidesItAndWithItsMeaning) {
  const SurfaceTile tile =
      TileOf(80, [](int, int) { return Ground(Traversability::kTraversable, 4.0F); });
  const PictureOptions options{.width = 400, .height = 444};
  const Colour green = {0, 120, 0};
  const Colour violet = {120, 0, 200};
  const Overlay overlay = {.strokes = {{{{1.0, 2.0, 0.0}, {7.0, 2.0, 0.0}}, green, 4.0, false},
                                       {{{1.0, 6.0, 0.0}, {7.0, 6.0, 0.0}}, violet, 4.0, true}},
                           .legend = {{green, "solid"}, {violet, "dashed"}}};
  const Picture picture = DrawMap({tile}, 0.1, {}, options, overlay);
  const auto drawn = [&](double y, Colour colour) {
    int count = 0;
    for (int i = 0; i < 100; ++i) {
      const Colour c = PixelAt(picture, {1.5 + 0.05 * i, y, 0.0});
      if (std::abs(c.r - colour.r) + std::abs(c.g - colour.g) + std::abs(c.b - colour.b) < 60) {
        ++count;
      }
    }
    return count;
  };
  EXPECT_EQ(drawn(2.0, green), 100);
  EXPECT_GT(drawn(6.0, violet), 30);
  EXPECT_LT(drawn(6.0, violet), 80);
  EXPECT_EQ(drawn(4.0, green) + drawn(4.0, violet), 0);
  // The legend, a row each.
  EXPECT_EQ(picture.image.At(12, 11), green);
  EXPECT_EQ(picture.image.At(12, 23), violet);
}

TEST(MapPictureTest, AFewStraySurfacesDoNotShrinkTheView) {
  SurfaceTile tile = TileOf(100, [](int, int) { return Ground(Traversability::kTraversable); });
  SurfaceTile stray;
  stray.key = {0, 100, 0};
  stray.surfaces.push_back(Ground(Traversability::kUnknown));
  stray.IndexRows();
  const Picture picture = DrawMap({tile, stray}, 0.1, {}, {.width = 500, .height = 544});
  EXPECT_LT(picture.camera.metres_per_pixel, 0.03);
}

TEST(MapPictureTest, AnEmptyMapIsAnEmptyPicture) {
  const Picture picture = DrawMap({}, 0.1, {}, {.width = 200, .height = 200});
  EXPECT_EQ(picture.image.width, 200);
  EXPECT_EQ(picture.image.At(100, 50), picture.image.At(10, 10));
}

// The first x of the scale bar: the only stroke of the legend longer than a letter is wide.
int ScaleBarOf(const Image& image) {
  constexpr int kLetter = 12;
  int first = image.width;
  for (int y = image.height - kLegendPixels; y < image.height; ++y) {
    int run = 0;
    for (int x = 0; x < image.width; ++x) {
      const Colour c = image.At(x, y);
      run = std::max({c.r, c.g, c.b}) < 60 ? run + 1 : 0;
      if (run > kLetter) first = std::min(first, x - kLetter);
    }
  }
  return first;
}

TEST(MapPictureTest, LegendOfANarrowPictureLeavesTheScaleBarFree) {
  for (const int width : {200, 300, 450, 600, 800, 1600}) {
    const Picture picture = DrawMap({}, 0.1, {}, {.width = width, .height = 300});
    const int bar = ScaleBarOf(picture.image);
    EXPECT_LT(bar, width - 30) << width;
    int last_swatch = -1;
    for (int x = 0; x < width; ++x) {
      if (picture.image.At(x, 300 - kLegendPixels / 2) == kUnknownColour) last_swatch = x;
    }
    EXPECT_LT(last_swatch + 7 * 6, bar) << width;  // and "unknown" after it
    EXPECT_EQ(last_swatch >= 0, width >= 600) << width;
  }
}

TEST(MapPictureTest, AxesOfTheMapAreInTheLowerLeftCorner) {
  const Picture picture = DrawMap({}, 0.1, {}, {.width = 800, .height = 600});
  const auto ink = [&](int x, int y) {
    return picture.image.At(x, 600 - kLegendPixels - 1 - y).r < 100;
  };
  EXPECT_TRUE(ink(44, 34));  // along x: 20 pixels long from (34, 34)
  EXPECT_TRUE(ink(34, 44));  // along y
  EXPECT_FALSE(ink(24, 34));
  EXPECT_FALSE(ink(34, 24));
}

TEST(ImageTest, PngReadsBackAsItWasWritten) {
  Image image(31, 17, {1, 2, 3});
  for (int i = 0; i < 17; ++i) {
    image.At(i, i) = {static_cast<std::uint8_t>(10 * i), 200, static_cast<std::uint8_t>(i)};
  }
  STRATA_ASSERT_OK_AND_ASSIGN(const std::string bytes, PngBytes(image));
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  ASSERT_EQ(png_image_begin_read_from_memory(&png, bytes.data(), bytes.size()), 1);
  png.format = PNG_FORMAT_RGB;
  std::vector<Colour> pixels(PNG_IMAGE_SIZE(png) / 3);
  ASSERT_EQ(png_image_finish_read(&png, nullptr, pixels.data(), 0, nullptr), 1);
  EXPECT_EQ(png.width, 31U);
  EXPECT_EQ(png.height, 17U);
  EXPECT_EQ(pixels, image.pixels);
}

TEST(ImageTest, TextStaysInsideTheImage) {
  Image image(20, 10, {255, 255, 255});
  EXPECT_EQ(DrawText(image, 2, 1, 1, "l2", {0, 0, 0}), 14);
  EXPECT_EQ(image.At(4, 3), (Colour{0, 0, 0}));  // the stem of the l
  DrawText(image, 15, 6, 3, "wide text that leaves the image", {0, 0, 0});
}

}  // namespace
}  // namespace strata::picture
