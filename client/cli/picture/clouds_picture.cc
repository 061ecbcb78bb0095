#include "client/cli/picture/clouds_picture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"

namespace strata::picture {
namespace {

constexpr Colour kPaper = {250, 250, 247};
constexpr Colour kInk = {40, 42, 46};
constexpr int kScale = 2;  // pixels a dot of the text
constexpr int kMargin = 16;
constexpr int kSide = 1000;  // of the longer side of the plan
constexpr int kGap = 24;     // between the two views
constexpr double kOutermost = 0.005;

using Range = std::pair<double, double>;

// The range of one coordinate, without the outermost at either end.
Range RangeOf(const std::vector<PictureCloud>& clouds, int axis) {
  std::vector<double> values;
  for (const PictureCloud& cloud : clouds) {
    for (const Eigen::Vector3d& p : cloud.points) values.push_back(p[axis]);
  }
  if (values.empty()) return {0.0, 1.0};
  const auto left_out =
      static_cast<std::ptrdiff_t>(kOutermost * static_cast<double>(values.size()));
  const auto low = values.begin() + left_out;
  const auto high = values.end() - 1 - left_out;
  std::nth_element(values.begin(), low, values.end());
  const double from = *low;
  std::nth_element(values.begin(), high, values.end());
  return {from, std::max(*high, from + 0.1)};
}

double Length(const Range& range) { return range.second - range.first; }

// One of the views: x to the right, another axis up.
struct View {
  Range x, up;
  int axis = 1;
  int top = 0;
  int height = 0;
};

void DrawPoints(Image& image,
                const View& view,
                double metres_per_pixel,
                const PictureCloud& cloud) {
  for (const Eigen::Vector3d& p : cloud.points) {
    const double right = (p.x() - view.x.first) / metres_per_pixel;
    const double down = (view.up.second - p[view.axis]) / metres_per_pixel;
    if (!(right >= 0.0 && down >= 0.0 && down < view.height)) continue;
    const int x = kMargin + static_cast<int>(right);
    if (x >= image.width - kMargin) continue;
    image.At(x, view.top + static_cast<int>(down)) = cloud.colour;
  }
}

// The longest of 1, 2, 5, 10, … metres that takes at most a quarter of the width.
double ScaleBar(double width_m) {
  double best = 0.01;
  for (double decade = 0.01; decade < 1e7; decade *= 10.0) {
    for (const double step : {1.0, 2.0, 5.0}) {
      if (step * decade <= 0.25 * width_m) best = step * decade;
    }
  }
  return best;
}

}  // namespace

Image DrawClouds(const std::vector<PictureCloud>& clouds) {
  const std::array<Range, 3> ranges = {RangeOf(clouds, 0), RangeOf(clouds, 1), RangeOf(clouds, 2)};
  const double metres_per_pixel =
      std::max({Length(ranges[0]), Length(ranges[1]), Length(ranges[2])}) / kSide;
  const auto pixels = [&](const Range& range) {
    return 1 + static_cast<int>(Length(range) / metres_per_pixel);
  };
  const View plan{ranges[0], ranges[1], 1, kMargin, pixels(ranges[1])};
  const View side{ranges[0], ranges[2], 2, kMargin + plan.height + kGap, pixels(ranges[2])};
  const int text = 10 * kScale;
  Image image(std::max(pixels(ranges[0]), kSide / 2) + 2 * kMargin,
              side.top + side.height + 2 * text + kMargin,
              kPaper);
  for (const PictureCloud& cloud : clouds) {
    DrawPoints(image, plan, metres_per_pixel, cloud);
    DrawPoints(image, side, metres_per_pixel, cloud);
  }
  int y = kMargin;
  for (const PictureCloud& cloud : clouds) {
    FillRectangle(image, kMargin, y, 7 * kScale, 7 * kScale, cloud.colour);
    DrawText(image, kMargin + text, y, kScale, cloud.name, kInk);
    y += text;
  }
  const double bar_m = ScaleBar(Length(ranges[0]));
  const int bar = static_cast<int>(bar_m / metres_per_pixel);
  const int bottom = image.height - kMargin;
  FillRectangle(image, kMargin, bottom - 4, bar, 4, kInk);
  DrawText(
      image, kMargin + bar + text, bottom - 7 * kScale, kScale, absl::StrCat(bar_m, " m"), kInk);
  return image;
}

}  // namespace strata::picture
