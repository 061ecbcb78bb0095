#include "client/cli/terminal/angles.h"

#include <cmath>
#include <numbers>
#include <optional>
#include <string>

#include "absl/strings/ascii.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/strip.h"

namespace strata::cli {

std::optional<double> ParseAngle(absl::string_view text, AngleUnit unit) {
  text = absl::StripAsciiWhitespace(text);
  if (absl::ConsumeSuffix(&text, "deg") || absl::ConsumeSuffix(&text, "°")) {
    unit = AngleUnit::kDegrees;
  } else if (absl::ConsumeSuffix(&text, "rad")) {
    unit = AngleUnit::kRadians;
  }
  double number = 0.0;
  if (!absl::SimpleAtod(absl::StripAsciiWhitespace(text), &number) || !std::isfinite(number)) {
    return std::nullopt;
  }
  return unit == AngleUnit::kDegrees ? number * std::numbers::pi / 180.0 : number;
}

CLI::Option* TakesAngle(CLI::Option* option, AngleUnit unit) {
  const auto to_radians = [unit](std::string& text) {
    const std::optional<double> angle = ParseAngle(text, unit);
    if (!angle.has_value())
      return absl::StrCat("expected an angle as 20deg or 0.35rad, got ", text);
    text = absl::StrFormat("%.17g", *angle);
    return std::string();
  };
  return option->transform(CLI::Validator(to_radians, "", "angle"))->type_name("ANGLE");
}

}  // namespace strata::cli
