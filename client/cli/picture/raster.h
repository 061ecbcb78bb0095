// Flat shapes seen through an orthographic camera: a depth buffer, shading from it, and lines on
// top.
#ifndef STRATA_CLIENT_CLI_PICTURE_RASTER_H_
#define STRATA_CLIENT_CLI_PICTURE_RASTER_H_

#include <array>
#include <cstddef>
#include <vector>

#include <Eigen/Geometry>

#include "client/cli/picture/image.h"

namespace strata::picture {

// Parallel projection. `right`, `up` and `forward` (into the picture) are orthonormal; `centre` is
// the point of the map in the middle of the picture.
struct Camera {
  Eigen::Vector3d right = Eigen::Vector3d::UnitX();
  Eigen::Vector3d up = Eigen::Vector3d::UnitY();
  Eigen::Vector3d forward = -Eigen::Vector3d::UnitZ();
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  double metres_per_pixel = 0.1;

  // Looks down from azimuth_rad (where the viewer stands, from x towards y) and elevation_rad over
  // the ground. π/2 is the plan: x to the right and y up with azimuth −π/2.
  static Camera From(double azimuth_rad, double elevation_rad);
  // Pixels to the right of and below the middle, and metres into the picture.
  Eigen::Vector3d Project(const Eigen::Vector3d& p_map) const;
};

// A picture in the making, drawn at `kOversampling` times its size.
class Raster {
 public:
  static constexpr int kOversampling = 2;

  Raster(int width, int height, const Camera& camera, Colour background);

  // A convex quadrilateral in one plane; nearer shapes hide farther ones.
  void FillQuad(const std::array<Eigen::Vector3d, 4>& corners_map, Colour colour);

  // Darkens every pixel by how far its neighbours stand in front of it, so that edges and steps
  // show (eye-dome lighting, Boucheny 2009). `strength` 0 changes nothing. Before lines.
  void ShadeByDepth(double strength);

  // A line of `width` pixels of the picture with a pale casing; where something hides it by more
  // than `tolerance_m` it shows through faintly.
  void DrawLine(const std::vector<Eigen::Vector3d>& points_map,
                double width,
                Colour colour,
                double tolerance_m);

  // The mean of the oversampled pixels.
  Image Finish() const;

 private:
  Eigen::Vector3d ToPixel(const Eigen::Vector3d& p_map) const;
  void FillTriangle(const Eigen::Vector3d& a,
                    const Eigen::Vector3d& b,
                    const Eigen::Vector3d& c,
                    Colour colour);
  void FillDisc(const Eigen::Vector3d& pixel, double radius, Colour colour, double tolerance_m);
  std::size_t Index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(image_.width) +
           static_cast<std::size_t>(x);
  }

  Camera camera_;
  Image image_;
  std::vector<float> depth_;
};

}  // namespace strata::picture

#endif  // STRATA_CLIENT_CLI_PICTURE_RASTER_H_
