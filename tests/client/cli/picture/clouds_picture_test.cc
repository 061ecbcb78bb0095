#include "client/cli/picture/clouds_picture.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace strata::picture {
namespace {

constexpr Colour kRed = {200, 0, 0};
constexpr Colour kBlue = {0, 0, 200};

std::vector<Eigen::Vector3d> Square(double left, double height) {
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < 100; ++i) {
    for (int k = 0; k < 100; ++k) points.emplace_back(left + 0.1 * i, 0.1 * k, height);
  }
  return points;
}

// Where pixels of a colour are, without the legend's.
Eigen::AlignedBox2i BoxOf(const Image& image, Colour colour) {
  Eigen::AlignedBox2i box;
  for (int y = 70; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      if (image.At(x, y) == colour) box.extend(Eigen::Vector2i(x, y));
    }
  }
  return box;
}

TEST(CloudsPictureTest, CloudsAreWhereTheyAreAndTheLaterIsAbove) {
  const Image image = DrawClouds({{"a", Square(0.0, 0.0), kRed}, {"b", Square(10.0, 1.0), kBlue}});
  const Eigen::AlignedBox2i red = BoxOf(image, kRed);
  const Eigen::AlignedBox2i blue = BoxOf(image, kBlue);
  EXPECT_LT(red.max().x(), blue.min().x());
  EXPECT_NEAR(red.sizes().x(), 500, 15);
  // From the side the upper one is above.
  EXPECT_LT(blue.max().y(), red.max().y());
  const Image over = DrawClouds({{"a", Square(0.0, 0.0), kRed}, {"b", Square(0.0, 0.0), kBlue}});
  EXPECT_TRUE(BoxOf(over, kRed).isEmpty());
}

TEST(CloudsPictureTest, StrayPointsAndNothingAreDrawn) {
  std::vector<Eigen::Vector3d> points = Square(0.0, 0.0);
  points.emplace_back(1e6, -1e6, 1e6);
  const Image image = DrawClouds({{"a", points, kRed}});
  EXPECT_GT(BoxOf(image, kRed).sizes().x(), 900);
  EXPECT_GT(DrawClouds({{"none", {}, kRed}}).width, 0);
}

}  // namespace
}  // namespace strata::picture
