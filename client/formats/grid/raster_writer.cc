#include "client/formats/grid/raster_writer.h"

#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>

#include "absl/strings/str_format.h"

namespace strata {
namespace {

void AppendNumber(float value, std::string& text) {
  std::array<char, 64> digits{};
  const auto end = std::to_chars(digits.data(),
                                 digits.data() + digits.size(),
                                 std::isfinite(value) ? double{value} : kNoData,
                                 std::chars_format::fixed,
                                 std::isfinite(value) ? 4 : 0);
  text.append(digits.data(), end.ptr);
}

}  // namespace

std::string AscText(const Raster& raster, const RasterBand& band) {
  std::string text = absl::StrFormat(
      "ncols %d\nnrows %d\nxllcorner %.15g\nyllcorner %.15g\ncellsize %.15g\nNODATA_value %g\n",
      raster.width,
      raster.height,
      raster.x_m,
      raster.y_m,
      raster.cell_size_m,
      kNoData);
  text.reserve(text.size() + 8 * band.values.size());
  for (int y = raster.height - 1; y >= 0; --y) {
    for (int x = 0; x < raster.width; ++x) {
      AppendNumber(band.values[static_cast<std::size_t>(y) * raster.width + x], text);
      text += x + 1 < raster.width ? ' ' : '\n';
    }
  }
  return text;
}

}  // namespace strata
