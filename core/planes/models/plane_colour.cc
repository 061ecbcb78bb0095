#include "core/planes/models/plane_colour.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include <Eigen/Core>
#include <Eigen/LU>

namespace strata {
namespace {

constexpr double kLightness = 0.3;         // L*'s weight
constexpr double kDegreesOfFreedom = 4.0;  // of Student's t
constexpr double kScreenVolume = 821'515;  // of sRGB's colours in CIELAB
constexpr double kEpsilon = 216.0 / 24389.0, kKappa = 24389.0 / 27.0;  // CIE 15:2004

// sRGB's primaries under D65 (IEC 61966-2-1), rows divided by those of white.
Eigen::Matrix3d MatrixOfScreen() {
  Eigen::Matrix3d xyz;
  xyz << 0.4124564, 0.3575761, 0.1804375,  //
      0.2126729, 0.7151522, 0.0721750,     //
      0.0193339, 0.1191920, 0.9503041;
  return xyz.rowwise().sum().cwiseInverse().asDiagonal() * xyz;
}

double Linear(double channel) {
  return channel <= 0.04045 ? channel / 12.92 : std::pow((channel + 0.055) / 1.055, 2.4);
}

double OfScreen(double linear) {
  return linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1.0 / 2.4) - 0.055;
}

double Lab(double t) { return t > kEpsilon ? std::cbrt(t) : (kKappa * t + 16.0) / 116.0; }

double OfLab(double f) {
  const double cube = f * f * f;
  return cube > kEpsilon ? cube : (116.0 * f - 16.0) / kKappa;
}

}  // namespace

LabColour LabOf(const Colour& colour) {
  static const Eigen::Matrix3d matrix = MatrixOfScreen();
  static const std::array<double, 256> linear = [] {
    std::array<double, 256> table{};
    for (std::size_t i = 0; i < table.size(); ++i) table[i] = Linear(static_cast<double>(i) / 255);
    return table;
  }();
  const Eigen::Vector3d xyz =
      matrix * Eigen::Vector3d(linear[colour.r], linear[colour.g], linear[colour.b]);
  const Eigen::Vector3d f(Lab(xyz.x()), Lab(xyz.y()), Lab(xyz.z()));
  return {kLightness * (116.0 * f.y() - 16.0), 500.0 * (f.x() - f.y()), 200.0 * (f.y() - f.z())};
}

Colour ColourOf(const LabColour& lab) {
  static const Eigen::Matrix3d inverse = MatrixOfScreen().inverse();
  const double y = (lab.x() / kLightness + 16.0) / 116.0;
  const Eigen::Vector3d linear =
      inverse * Eigen::Vector3d(OfLab(y + lab.y() / 500.0), OfLab(y), OfLab(y - lab.z() / 200.0));
  const auto channel = [](double value) {
    const double rounded = std::round(255.0 * OfScreen(std::max(0.0, value)));
    return static_cast<std::uint8_t>(std::clamp(rounded, 0.0, 255.0));
  };
  return {channel(linear.x()), channel(linear.y()), channel(linear.z())};
}

double ColourLog(double squared_distance) {
  constexpr double nu = kDegreesOfFreedom;
  // Γ((ν + 3)/2) / (Γ(ν/2) (ν π)^(3/2) σ₂³) for ν = 4.
  static const double peak = std::log(15.0 / (64.0 * M_PI * std::pow(kColourSigma, 3)));
  const double distance = squared_distance / (kColourSigma * kColourSigma);
  return peak - 0.5 * (nu + 3.0) * std::log1p(distance / nu);
}

double ColourWeight(double squared_distance) {
  constexpr double nu = kDegreesOfFreedom;
  return (nu + 3.0) / (nu + squared_distance / (kColourSigma * kColourSigma));
}

double AnyColourLog() {
  static const double log = -std::log(kLightness * kScreenVolume);
  return log;
}

bool AreAlike(const LabColour& a, const LabColour& b) {
  return ColourLog((a - b).squaredNorm()) >= AnyColourLog();
}

}  // namespace strata
