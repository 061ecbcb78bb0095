#include "client/formats/bags/keyframes.h"

#include <numbers>
#include <optional>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "absl/strings/string_view.h"
#include "absl/strings/strip.h"

#include "client/formats/parsing/text_cursor.h"

namespace strata {
namespace {

struct SpacingUnit {
  absl::string_view ending;
  std::optional<double> KeyframeSpacing::*value;
  double factor;
};

// In this order: "rad" and "deg" do not end with the others.
constexpr SpacingUnit kUnits[] = {
    {"deg", &KeyframeSpacing::angle_rad, std::numbers::pi / 180.0},
    {"rad", &KeyframeSpacing::angle_rad, 1.0},
    {"m", &KeyframeSpacing::distance_m, 1.0},
    {"s", &KeyframeSpacing::time_s, 1.0},
};

bool SetOne(absl::string_view word, KeyframeSpacing& spacing) {
  for (const SpacingUnit& unit : kUnits) {
    if (!absl::ConsumeSuffix(&word, unit.ending)) continue;
    const std::optional<double> number = ParseNumber(word);
    if (!number.has_value() || !(*number >= 0.0 && *number < 1e9)) return false;
    spacing.*unit.value = *number * unit.factor;
    return true;
  }
  return false;
}

// Ten steps of 5 cm are half a metre, whatever their sum is rounded to.
bool Reaches(double value, const std::optional<double>& bound) {
  constexpr double kRounding = 1e-6;
  return bound.has_value() && value >= *bound * (1.0 - kRounding);
}

}  // namespace

absl::StatusOr<KeyframeSpacing> ParseKeyframeSpacing(absl::string_view text) {
  KeyframeSpacing spacing;
  for (const absl::string_view word : absl::StrSplit(text, ',')) {
    if (SetOne(word, spacing)) continue;
    return absl::InvalidArgumentError(
        absl::StrCat("'", word.substr(0, 40), "' is no distance, angle or time: 0.5m, 20deg, 2s"));
  }
  return spacing;
}

bool KeyframeChooser::WouldKeep(double time_s, const Pose& pose) const {
  if (!last_.has_value()) return true;
  const Pose step = last_->inverse() * pose;
  return Reaches(step.translation().norm(), spacing_.distance_m) ||
         Reaches(RotationAngleRad(step), spacing_.angle_rad) ||
         Reaches(time_s - last_time_s_, spacing_.time_s);
}

bool KeyframeChooser::Keep(double time_s, const Pose& pose) {
  if (!WouldKeep(time_s, pose)) return false;
  last_ = pose;
  last_time_s_ = time_s;
  return true;
}

}  // namespace strata
