#include "client/cli/picture/raster.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>
#include <vector>

namespace strata::picture {
namespace {

using Eigen::Vector3d;

constexpr float kFar = std::numeric_limits<float>::infinity();
constexpr Colour kCasing = {255, 255, 255};

Colour Scaled(Colour colour, double factor) {
  const auto scale = [factor](std::uint8_t channel) {
    return static_cast<std::uint8_t>(std::clamp(channel * factor, 0.0, 255.0));
  };
  return {scale(colour.r), scale(colour.g), scale(colour.b)};
}

// Twice the signed area of the triangle (a, b, (x, y)).
double Side(const Vector3d& a, const Vector3d& b, double x, double y) {
  return (b.x() - a.x()) * (y - a.y()) - (b.y() - a.y()) * (x - a.x());
}

}  // namespace

Camera Camera::From(double azimuth_rad, double elevation_rad) {
  Camera camera;
  const double horizontal = std::cos(elevation_rad);
  camera.forward = -Vector3d(horizontal * std::cos(azimuth_rad),
                             horizontal * std::sin(azimuth_rad),
                             std::sin(elevation_rad));
  camera.right = Vector3d(-std::sin(azimuth_rad), std::cos(azimuth_rad), 0.0);
  camera.up = camera.right.cross(camera.forward);
  return camera;
}

Vector3d Camera::Project(const Vector3d& p_map) const {
  const Vector3d offset = p_map - centre;
  return {right.dot(offset) / metres_per_pixel,
          -up.dot(offset) / metres_per_pixel,
          forward.dot(offset)};
}

Raster::Raster(int width, int height, const Camera& camera, Colour background)
    : camera_(camera),
      image_(width * kOversampling, height * kOversampling, background),
      depth_(image_.pixels.size(), kFar) {}

Vector3d Raster::ToPixel(const Vector3d& p_map) const {
  const Vector3d p = camera_.Project(p_map);
  return {0.5 * image_.width + kOversampling * p.x(),
          0.5 * image_.height + kOversampling * p.y(),
          p.z()};
}

void Raster::FillQuad(const std::array<Vector3d, 4>& corners_map, Colour colour) {
  const Vector3d a = ToPixel(corners_map[0]);
  const Vector3d b = ToPixel(corners_map[1]);
  const Vector3d c = ToPixel(corners_map[2]);
  const Vector3d d = ToPixel(corners_map[3]);
  FillTriangle(a, b, c, colour);
  FillTriangle(a, c, d, colour);
}

void Raster::FillTriangle(const Vector3d& a, const Vector3d& b, const Vector3d& c, Colour colour) {
  const double area = Side(a, b, c.x(), c.y());
  if (std::abs(area) < 1e-9) {
    return;
  }
  const auto [x_low, x_high] = std::minmax({a.x(), b.x(), c.x()});
  const auto [y_low, y_high] = std::minmax({a.y(), b.y(), c.y()});
  if (x_high < 0 || y_high < 0 || x_low >= image_.width || y_low >= image_.height) {
    return;
  }
  // Pixels are taken at their centres.
  const int x_begin = static_cast<int>(std::ceil(std::max(x_low, 0.0) - 0.5));
  const int y_begin = static_cast<int>(std::ceil(std::max(y_low, 0.0) - 0.5));
  const int x_end = static_cast<int>(std::floor(std::min(x_high, image_.width - 1.0) + 0.5));
  const int y_end = static_cast<int>(std::floor(std::min(y_high, image_.height - 1.0) + 0.5));
  for (int y = std::max(y_begin, 0); y <= std::min(y_end, image_.height - 1); ++y) {
    for (int x = std::max(x_begin, 0); x <= std::min(x_end, image_.width - 1); ++x) {
      const double u = Side(b, c, x + 0.5, y + 0.5) / area;
      const double v = Side(c, a, x + 0.5, y + 0.5) / area;
      const double w = 1.0 - u - v;
      if (u < -1e-9 || v < -1e-9 || w < -1e-9) {
        continue;
      }
      const auto depth = static_cast<float>(u * a.z() + v * b.z() + w * c.z());
      if (depth < depth_[Index(x, y)]) {
        depth_[Index(x, y)] = depth;
        image_.At(x, y) = colour;
      }
    }
  }
}

void Raster::ShadeByDepth(double strength) {
  constexpr int kReach = kOversampling;
  // Opposite neighbours together, so that a plane has no shade however it is tilted.
  constexpr std::array<std::pair<int, int>, 4> kDirections = {{{1, 0}, {1, 1}, {0, 1}, {-1, 1}}};
  // A pair that stands this far in front gives full shade.
  const double full_m = std::max(0.4, 6.0 * camera_.metres_per_pixel);
  std::vector<Colour> shaded = image_.pixels;
  for (int y = 0; y < image_.height; ++y) {
    for (int x = 0; x < image_.width; ++x) {
      const float depth = depth_[Index(x, y)];
      if (depth == kFar) {
        continue;
      }
      const auto in_front = [&](int dx, int dy) {
        const float other = depth_[Index(std::clamp(x + dx * kReach, 0, image_.width - 1),
                                         std::clamp(y + dy * kReach, 0, image_.height - 1))];
        return std::clamp<double>(depth - other, -full_m, full_m);
      };
      double shade = 0.0;
      for (const auto& [dx, dy] : kDirections) {
        shade += std::max(0.0, in_front(dx, dy) + in_front(-dx, -dy)) / full_m;
      }
      shade /= kDirections.size();
      shaded[Index(x, y)] = Scaled(image_.At(x, y), std::exp(-strength * shade));
    }
  }
  image_.pixels = std::move(shaded);
}

void Raster::FillDisc(const Vector3d& pixel, double radius, Colour colour, double tolerance_m) {
  const int x_low = std::max(static_cast<int>(pixel.x() - radius), 0);
  const int y_low = std::max(static_cast<int>(pixel.y() - radius), 0);
  const int x_high = std::min(static_cast<int>(pixel.x() + radius) + 1, image_.width - 1);
  const int y_high = std::min(static_cast<int>(pixel.y() + radius) + 1, image_.height - 1);
  for (int y = y_low; y <= y_high; ++y) {
    for (int x = x_low; x <= x_high; ++x) {
      if (std::hypot(x + 0.5 - pixel.x(), y + 0.5 - pixel.y()) > radius) {
        continue;
      }
      const bool hidden = pixel.z() - depth_[Index(x, y)] > tolerance_m;
      image_.At(x, y) = hidden ? Blend(image_.At(x, y), colour, 0.06) : colour;
    }
  }
}

void Raster::DrawLine(const std::vector<Vector3d>& points_map,
                      double width,
                      Colour colour,
                      double tolerance_m) {
  const double radius = 0.5 * width * kOversampling;
  for (const bool casing : {true, false}) {
    for (std::size_t i = 0; i + 1 < points_map.size(); ++i) {
      const Vector3d a = ToPixel(points_map[i]);
      const Vector3d b = ToPixel(points_map[i + 1]);
      const int steps = static_cast<int>((b - a).head<2>().norm() / (0.4 * radius)) + 1;
      for (int step = 0; step <= steps; ++step) {
        const Vector3d at = a + (b - a) * (static_cast<double>(step) / steps);
        FillDisc(at, casing ? 1.5 * radius : radius, casing ? kCasing : colour, tolerance_m);
      }
    }
  }
}

Image Raster::Finish() const {
  Image result(image_.width / kOversampling, image_.height / kOversampling, {});
  constexpr int kSamples = kOversampling * kOversampling;
  for (int y = 0; y < result.height; ++y) {
    for (int x = 0; x < result.width; ++x) {
      std::array<int, 3> sum{};
      for (int sample = 0; sample < kSamples; ++sample) {
        const Colour& colour = image_.At(x * kOversampling + sample % kOversampling,
                                         y * kOversampling + sample / kOversampling);
        sum[0] += colour.r;
        sum[1] += colour.g;
        sum[2] += colour.b;
      }
      const auto mean = [](int total) {
        return static_cast<std::uint8_t>((total + kSamples / 2) / kSamples);
      };
      result.At(x, y) = {mean(sum[0]), mean(sum[1]), mean(sum[2])};
    }
  }
  return result;
}

}  // namespace strata::picture
