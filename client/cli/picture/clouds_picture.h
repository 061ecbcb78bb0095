// Two clouds over each other as a picture.
#ifndef STRATA_CLIENT_CLI_PICTURE_CLOUDS_PICTURE_H_
#define STRATA_CLIENT_CLI_PICTURE_CLOUDS_PICTURE_H_

#include <string>
#include <vector>

#include <Eigen/Core>

#include "client/cli/picture/image.h"

namespace strata::picture {

// Points in one frame and what they are called in the legend: letters that DrawText() knows.
struct PictureCloud {
  std::string name;
  std::vector<Eigen::Vector3d> points;  // finite
  Colour colour;
};

// From above (x to the right, y up) and below that from the side (x to the right, z up), to one
// scale, which holds all but the outermost hundredths; later clouds above earlier ones. The legend
// is in the upper left corner, a scale bar in the lower one.
Image DrawClouds(const std::vector<PictureCloud>& clouds);

}  // namespace strata::picture

#endif  // STRATA_CLIENT_CLI_PICTURE_CLOUDS_PICTURE_H_
