#include "core/completion/upright_box.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

#include <Eigen/Geometry>

namespace strata {
namespace {

// The share of the points' distance to the sides of the box along the principal components that a
// box with another turn has to do with, so that noise does not turn boxes.
constexpr double kMuchNearer = 0.8;
constexpr int kTurns = 90;                    // of a right angle
constexpr std::size_t kMostWeighed = 20'000;  // points

using Points2 = std::vector<Eigen::Vector2d>;

double Cross(const Eigen::Vector2d& o, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return (a - o).x() * (b - o).y() - (a - o).y() * (b - o).x();
}

// Of points sorted by x and y, counterclockwise (Andrew 1979).
Points2 HullOf(const Points2& sorted) {
  Points2 hull;
  const auto add = [&hull](const Eigen::Vector2d& p, std::size_t least) {
    while (hull.size() >= least + 2 && Cross(hull[hull.size() - 2], hull.back(), p) <= 0.0) {
      hull.pop_back();
    }
    hull.push_back(p);
  };
  for (const Eigen::Vector2d& p : sorted) add(p, 0);
  const std::size_t lower = hull.size() - 1;
  for (std::size_t i = sorted.size() - 1; i-- > 0;) add(sorted[i], lower);
  if (hull.size() > 1) hull.pop_back();
  return hull;
}

struct Rectangle {
  Eigen::Vector2d along = Eigen::Vector2d::UnitX();
  Eigen::AlignedBox2d extent;  // along it and across
};

Rectangle RectangleAlong(const Eigen::Vector2d& along, const Points2& hull) {
  Rectangle rectangle{along, {}};
  for (const Eigen::Vector2d& p : hull) {
    rectangle.extent.extend(Eigen::Vector2d(along.dot(p), along.x() * p.y() - along.y() * p.x()));
  }
  return rectangle;
}

// Mean distance of every `step`-th point to the side that is nearest to it (the closeness of Zhang
// et al. 2017, "Efficient L-shape fitting").
double DistanceToSides(const Rectangle& rectangle, const Points2& points, std::size_t step) {
  double sum = 0.0;
  std::size_t count = 0;
  for (std::size_t i = 0; i < points.size(); i += step, ++count) {
    const Eigen::Vector2d& u = rectangle.along;
    const Eigen::Vector2d p(u.dot(points[i]), u.x() * points[i].y() - u.y() * points[i].x());
    sum +=
        std::min((p - rectangle.extent.min()).minCoeff(), (rectangle.extent.max() - p).minCoeff());
  }
  return sum / static_cast<double>(count);
}

// The rectangle around the points whose sides they are nearest to.
Rectangle NearestRectangle(const Points2& points, const Points2& hull, const Rectangle& first) {
  const std::size_t step = points.size() / kMostWeighed + 1;
  Rectangle nearest = first;
  double least = kMuchNearer * DistanceToSides(first, points, step);
  const auto consider = [&](const Eigen::Vector2d& along) {
    const Rectangle other = RectangleAlong(along, hull);
    const double distance = DistanceToSides(other, points, step);
    if (distance >= least) return;
    least = distance;
    nearest = other;
  };
  for (int turn = 0; turn < kTurns; ++turn) {
    const double angle = turn * 0.5 * std::numbers::pi / kTurns;
    consider({std::cos(angle), std::sin(angle)});
  }
  const Eigen::Vector2d found = nearest.along;
  for (std::size_t i = 0; i < hull.size(); ++i) {  // finer than a degree: a side of the hull
    const Eigen::Vector2d side = hull[(i + 1) % hull.size()] - hull[i];
    if (side.norm() <= 0.0) continue;
    const double sine = std::abs(Cross(Eigen::Vector2d::Zero(), found, side.normalized()));
    if (std::min(sine, std::sqrt(std::max(0.0, 1.0 - sine * sine))) < 0.02) {
      consider(side.normalized());
    }
  }
  return nearest;
}

// The larger eigenvector of the points' covariance.
Eigen::Vector2d PrincipalDirection(const Points2& points) {
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (const Eigen::Vector2d& p : points) mean += p;
  mean /= static_cast<double>(points.size());
  double xx = 0.0, xy = 0.0, yy = 0.0;
  for (const Eigen::Vector2d& p : points) {
    const Eigen::Vector2d d = p - mean;
    xx += d.x() * d.x();
    xy += d.x() * d.y();
    yy += d.y() * d.y();
  }
  const double turn = 0.5 * std::atan2(2.0 * xy, xx - yy);
  return {std::cos(turn), std::sin(turn)};
}

UprightBox BoxOf(Rectangle rectangle, double low, double high) {
  UprightBox box;
  const Eigen::Vector2d& u = rectangle.along;
  const Eigen::Vector2d middle = rectangle.extent.center();
  box.centre << middle.x() * u.x() - middle.y() * u.y(), middle.x() * u.y() + middle.y() * u.x(),
      0.5 * (low + high);
  box.size << rectangle.extent.sizes(), high - low;
  box.yaw_rad = std::atan2(u.y(), u.x());
  if (box.size.x() < box.size.y()) {
    std::swap(box.size.x(), box.size.y());
    box.yaw_rad += 0.5 * std::numbers::pi;
  }
  box.yaw_rad = std::fmod(box.yaw_rad + 2.0 * std::numbers::pi, std::numbers::pi);
  return box;
}

}  // namespace

UprightBox UprightBoxOf(std::span<const Eigen::Vector3d> points) {
  if (points.empty()) return {};
  const Eigen::Vector3d origin = points.front();
  Points2 plan;
  plan.reserve(points.size());
  double low = 0.0, high = 0.0;
  for (const Eigen::Vector3d& p : points) {
    plan.emplace_back((p - origin).head<2>());
    low = std::min(low, p.z() - origin.z());
    high = std::max(high, p.z() - origin.z());
  }
  const Eigen::Vector2d principal = PrincipalDirection(plan);
  std::sort(plan.begin(), plan.end(), [](const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    return a.x() != b.x() ? a.x() < b.x() : a.y() < b.y();
  });
  const Points2 hull = HullOf(plan);
  const Rectangle along = RectangleAlong(principal, hull);
  UprightBox box = BoxOf(NearestRectangle(plan, hull, along), low, high);
  box.centre += origin;
  return box;
}

}  // namespace strata
