#include "client/cli/picture/confusion_picture.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"

namespace strata::picture {
namespace {

constexpr Colour kPaper = {250, 250, 247};
constexpr Colour kInk = {40, 42, 46};
constexpr Colour kFull = {34, 84, 160};
constexpr int kScale = 2;  // pixels a dot of the text
constexpr int kLetter = 6 * kScale;
constexpr int kLine = 10 * kScale;
constexpr int kMargin = 12;
constexpr std::size_t kLongestName = 20;

std::string Shown(const std::string& name) {
  return absl::AsciiStrToLower(name.substr(0, kLongestName));
}

int WidthOf(const std::string& text) { return static_cast<int>(text.size()) * kLetter; }

void DrawSquare(Image& image, int x, int y, int side, double share) {
  FillRectangle(image, x, y, side - 2, side - 2, Blend(kPaper, kFull, share));
  const std::string text = absl::StrCat(std::lround(100.0 * share));
  DrawText(image,
           x + (side - WidthOf(text)) / 2,
           y + (side - 7 * kScale) / 2,
           kScale,
           text,
           share > 0.5 ? kPaper : kInk);
}

}  // namespace

Image DrawConfusion(const std::vector<std::vector<std::uint64_t>>& rows,
                    const std::vector<std::string>& names) {
  const auto classes = static_cast<int>(names.size());
  int longest = 0;
  for (const std::string& name : names) longest = std::max(longest, WidthOf(Shown(name)));
  const std::string axes = "row - true class. column - class given. per cent of the row";
  const int side = std::max(longest + kLetter, 56);
  const int left = kMargin + longest + kLetter;
  const int matrix = classes * side;
  Image image(std::max(left + matrix, kMargin + WidthOf(axes)) + kMargin,
              kMargin + matrix + 2 * kLine + kMargin,
              kPaper);
  for (int row = 0; row < classes; ++row) {
    const std::vector<std::uint64_t>& counts = rows[static_cast<std::size_t>(row)];
    const auto sum =
        static_cast<double>(std::accumulate(counts.begin(), counts.end(), std::uint64_t{0}));
    const int y = kMargin + row * side;
    const std::string name = Shown(names[static_cast<std::size_t>(row)]);
    DrawText(image, kMargin, y + (side - 7 * kScale) / 2, kScale, name, kInk);
    DrawText(image,
             left + row * side + (side - WidthOf(name)) / 2,
             kMargin + matrix + kScale,
             kScale,
             name,
             kInk);
    for (int given = 0; given < classes && sum > 0.0; ++given) {
      const auto count = static_cast<double>(counts[static_cast<std::size_t>(given)]);
      DrawSquare(image, left + given * side, y, side, count / sum);
    }
  }
  DrawText(image, kMargin, kMargin + matrix + kLine + kScale, kScale, axes, kInk);
  return image;
}

}  // namespace strata::picture
