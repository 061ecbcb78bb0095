#include "tests/support/simulator/sweep.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "absl/strings/str_format.h"

namespace strata::testing {
namespace {

using Eigen::Vector3d;

constexpr double kStepM = 0.05;   // along the path
constexpr double kLevelM = 0.15;  // up the cylinder
constexpr int kDirections = 16;

std::string At(const Vector3d& p, const char* what, double value) {
  return absl::StrFormat("(%.2f, %.2f, %.2f): %s %.2f m", p.x(), p.y(), p.z(), what, value);
}

bool Holds(const Solid& solid, const Vector3d& p) {
  return solid.box.contains(p) &&
         std::all_of(solid.faces.begin(), solid.faces.end(), [&p](const Solid::Face& face) {
           return face.normal.dot(p) <= face.offset;
         });
}

class Sweeper {
 public:
  Sweeper(const Scene& scene, const RobotProfile& profile, double slack_m)
      : scene_(scene), profile_(profile), slack_m_(slack_m) {}

  // How much the ground may rise or fall within `run_m`.
  double Rise(double run_m) const {
    return profile_.max_step_m + run_m * std::tan(profile_.max_slope_rad) + slack_m_;
  }
  std::optional<double> GroundAt(double x, double y, double z, double run_m) const {
    return scene_.GroundBelow(x, y, z + Rise(run_m));
  }

  // What is wrong with standing at `foot`; empty if nothing.
  std::string Stand(const Vector3d& foot) const {
    const double radius = std::max(0.0, profile_.radius_m - slack_m_);
    std::string wrong = Above(foot, 0.0);
    if (wrong.empty()) wrong = Inside(foot, radius);
    for (int k = 0; k < kDirections && wrong.empty(); ++k) {
      const double angle = 2.0 * std::numbers::pi * k / kDirections;
      const Vector3d out(std::cos(angle), std::sin(angle), 0.0);
      wrong = Beside(foot, out, radius);
      if (!wrong.empty()) return wrong;
      const Vector3d rim = foot + radius * out;
      const std::optional<double> ground = GroundAt(rim.x(), rim.y(), foot.z(), radius);
      if (!ground.has_value()) return At(foot, "no ground within the radius of", radius);
      const double drop = foot.z() - *ground;
      if (drop > Rise(radius)) return At(foot, "drop of", drop);
      wrong = Above({rim.x(), rim.y(), *ground}, Rise(radius));
    }
    return wrong;
  }

 private:
  // What hangs into the cylinder over a ground point that may differ by `rise` from the robot's.
  std::string Above(const Vector3d& ground, double rise) const {
    const double need = profile_.height_m - rise - slack_m_;
    const std::optional<double> free = scene_.Cast(ground + Vector3d(0, 0, 1e-3), {0, 0, 1}, need);
    return free.has_value() ? At(ground, "clearance of", *free) : "";
  }
  // A ray out of a solid does not hit it, so the axis itself must be free.
  std::string Inside(const Vector3d& foot, double radius) const {
    const double low = Rise(radius);
    for (const Solid& solid : scene_.solids()) {
      if (solid.box.exteriorDistance(foot) > profile_.height_m) continue;
      for (double h = low; h < profile_.height_m - slack_m_; h += kLevelM) {
        if (Holds(solid, foot + Vector3d(0, 0, h))) return At(foot, "inside a solid at height", h);
      }
    }
    return "";
  }
  std::string Beside(const Vector3d& foot, const Vector3d& out, double radius) const {
    for (double h = Rise(radius); h < profile_.height_m - slack_m_; h += kLevelM) {
      const Vector3d axis = foot + Vector3d(0, 0, h);
      const std::optional<double> hit = scene_.Cast(axis, out, radius);
      if (hit.has_value()) return At(axis, "obstacle at a distance of", *hit);
    }
    return "";
  }

  const Scene& scene_;
  const RobotProfile& profile_;
  const double slack_m_;
};

}  // namespace

Swept Sweep(const Scene& scene,
            const std::vector<Vector3d>& waypoints,
            const RobotProfile& profile,
            double slack_m) {
  constexpr double kWaypointM = 0.15;
  const Sweeper sweeper(scene, profile, slack_m);
  Swept swept;
  double z = waypoints.empty() ? 0.0 : waypoints.front().z();
  for (std::size_t w = 1; w < waypoints.size(); ++w) {
    const Vector3d along = waypoints[w] - waypoints[w - 1];
    const int steps = static_cast<int>(std::ceil(along.head<2>().norm() / kStepM)) + 1;
    for (int s = 0; s <= steps; ++s) {
      Vector3d foot = waypoints[w - 1] + along * s / steps;
      const std::optional<double> ground = sweeper.GroundAt(foot.x(), foot.y(), z, kStepM);
      foot.z() = ground.value_or(z);
      swept.collision = !ground.has_value()                  ? At(foot, "no ground below", z)
                        : z - *ground > sweeper.Rise(kStepM) ? At(foot, "falls", z - *ground)
                                                             : sweeper.Stand(foot);
      if (!swept.collision.empty()) return swept;
      z = foot.z();
      swept.ground.push_back(foot);
    }
    if (std::abs(z - waypoints[w].z()) > kWaypointM) {
      swept.collision = At(waypoints[w], "waypoint off the ground by", z - waypoints[w].z());
      return swept;
    }
  }
  return swept;
}

}  // namespace strata::testing
