// Colours by which planes are told apart (thesis 5.5).
// Internal to core/planes, not installed.
//
// Differs from the thesis: CIELAB in place of RGB, of which lightness counts 0.3, since shadows
// change that alone; Student's t in place of a Gaussian, since reflections give surfaces colours
// that are not theirs. 5.24's η is that of two scalars, and 5.25 has σ₂ where 5.24 has σ₁: here
// each density is that of its distance, three dimensions of colour and one of space.
#ifndef STRATA_CORE_PLANES_MODELS_PLANE_COLOUR_H_
#define STRATA_CORE_PLANES_MODELS_PLANE_COLOUR_H_

#include <Eigen/Core>

#include "core/cloud/point_cloud.h"

namespace strata {

// (0.3 L*, a*, b*) of sRGB under D65: distances 5.23 are taken between these.
using LabColour = Eigen::Vector3d;
// σ₂: texture, shades and a camera's noise.
inline constexpr double kColourSigma = 8.0;
LabColour LabOf(const Colour& colour);
// Of a mean; what no screen shows becomes the nearest a channel.
Colour ColourOf(const LabColour& lab);

// ln of the density of a colour whose squared distance to its plane's is this.
double ColourLog(double squared_distance);
// What it counts in its plane's mean: less the farther it is. Σ of weighted squares is a bound on
// −ColourLog() that touches it at this distance, so that EM's objective never falls.
double ColourWeight(double squared_distance);
// ln of the density where all colours of a screen are as likely: that of clutter.
double AnyColourLog();
// Nearer to each other than to just any colour.
bool AreAlike(const LabColour& a, const LabColour& b);

}  // namespace strata

#endif  // STRATA_CORE_PLANES_MODELS_PLANE_COLOUR_H_
