#include "client/cli/picture/confusion_picture.h"

#include <algorithm>

#include <gtest/gtest.h>

namespace strata::picture {
namespace {

// The share of the picture's pixels that are this colour.
double ShareOf(const Image& image, Colour colour) {
  return static_cast<double>(std::count(image.pixels.begin(), image.pixels.end(), colour)) /
         static_cast<double>(image.pixels.size());
}

TEST(ConfusionPictureTest, IsDarkWhereTheClassesAreRight) {
  constexpr Colour kFull = {34, 84, 160};
  const std::vector<std::string> names = {"ground", "Facade_1", "vegetation"};
  const Image right = DrawConfusion({{9, 0, 0}, {0, 5, 0}, {0, 0, 1}}, names);
  EXPECT_GT(ShareOf(right, kFull), 0.1);
  const Image mixed = DrawConfusion({{3, 3, 3}, {2, 2, 2}, {1, 1, 1}}, names);
  EXPECT_EQ(ShareOf(mixed, kFull), 0.0);
  EXPECT_EQ(mixed.width, right.width);
  // Rows without points are blank.
  const Image blank = DrawConfusion({{0, 0, 0}, {0, 0, 0}, {0, 0, 0}}, names);
  EXPECT_GT(ShareOf(blank, {250, 250, 247}), 0.9);
}

TEST(ConfusionPictureTest, HoldsOneClassAndLongNames) {
  const Image one = DrawConfusion({{1}}, {std::string(300, 'a')});
  EXPECT_GT(one.width, 100);
  EXPECT_LT(one.width, 1000);
}

}  // namespace
}  // namespace strata::picture
