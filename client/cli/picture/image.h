// Pictures in memory, small text on them, and PNG files.
#ifndef STRATA_CLIENT_CLI_PICTURE_IMAGE_H_
#define STRATA_CLIENT_CLI_PICTURE_IMAGE_H_

#include <cstddef>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

#include "core/cloud/point_cloud.h"

namespace strata::picture {

// Rows from the top, pixels from the left.
struct Image {
  int width = 0;
  int height = 0;
  std::vector<Colour> pixels;

  Image() = default;
  Image(int w, int h, Colour colour)
      : width(w),
        height(h),
        pixels(static_cast<std::size_t>(w) * static_cast<std::size_t>(h), colour) {}
  Colour& At(int x, int y) {
    return pixels[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                  static_cast<std::size_t>(x)];
  }
  const Colour& At(int x, int y) const { return const_cast<Image*>(this)->At(x, y); }
};

// a · (1 − share) + b · share.
Colour Blend(Colour a, Colour b, double share);

// Fills the part of the rectangle that lies inside the image.
void FillRectangle(Image& image, int x, int y, int width, int height, Colour colour);

// Lower-case letters, digits, '.', '-', '_' and blanks in a 5 × 7 face, `scale` pixels a dot; other
// characters stay blank. (x, y) is the upper left corner. Returns the x after the text.
int DrawText(Image& image, int x, int y, int scale, absl::string_view text, Colour colour);

// The bytes of a PNG file, 8 bits a channel, RGB. INTERNAL if libpng fails.
absl::StatusOr<std::string> PngBytes(const Image& image);

}  // namespace strata::picture

#endif  // STRATA_CLIENT_CLI_PICTURE_IMAGE_H_
