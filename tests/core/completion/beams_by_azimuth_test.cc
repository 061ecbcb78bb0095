#include "core/completion/beams_by_azimuth.h"

#include <cstddef>
#include <cstdint>
#include <limits>
#include <random>
#include <set>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace strata {
namespace {

using Eigen::AlignedBox3d;
using Eigen::Vector3d;

class Draw {
 public:
  explicit Draw(std::uint64_t seed) : random_(seed) {}
  double Uniform(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }
  Vector3d Point(double most) {
    const double x = Uniform(-most, most);
    const double y = Uniform(-most, most);
    const double z = Uniform(-most, most);
    return {x, y, z};
  }
  Pose AnyPose(double most) {
    const Vector3d place = Point(most);
    const Vector3d axis = Point(1.0).normalized();
    return Pose(Eigen::Translation3d(place) * Eigen::AngleAxisd(Uniform(0.0, 6.0), axis));
  }

 private:
  std::mt19937_64 random_;
};

// In steps along the beam, so that no way to clip it is trusted.
bool GoesThrough(const AlignedBox3d& box, const Vector3d& from, const Vector3d& to) {
  for (int k = 0; k <= 400; ++k) {
    if (box.contains(from + k / 400.0 * (to - from))) return true;
  }
  return false;
}

TEST(BeamsByAzimuthTest, NoBeamThroughTheBoxIsLeftOut) {
  std::size_t through = 0, given = 0, all = 0;
  for (std::uint64_t seed = 1; seed <= 500; ++seed) {
    SCOPED_TRACE(seed);
    Draw draw(seed);
    const Pose T_map_scan = draw.AnyPose(5.0);
    const Pose T_map_box = draw.AnyPose(15.0);
    PointCloud cloud;
    cloud.origin = draw.Point(2.0);
    cloud.sensor_origin = draw.Point(0.5).cast<float>();
    for (int i = 0; i < 400; ++i) {
      cloud.points.emplace_back(draw.Point(20.0).cast<float>());
      cloud.label.push_back(static_cast<std::uint16_t>(i));
    }
    const Vector3d low = draw.Point(2.0);
    const AlignedBox3d box(low, low + Vector3d::Constant(0.1) + draw.Point(1.5).cwiseAbs());
    const PointCloud part = BeamsByAzimuth(cloud, T_map_scan).Towards(box, T_map_box);
    EXPECT_EQ(part.origin, cloud.origin);
    EXPECT_EQ(part.sensor_origin, cloud.sensor_origin);
    const std::set<std::uint16_t> there(part.label.begin(), part.label.end());
    const Pose T_box_scan = T_map_box.inverse() * T_map_scan;
    const Vector3d from = T_box_scan * (cloud.sensor_origin.cast<double>() + cloud.origin);
    for (std::size_t i = 0; i < cloud.size(); ++i) {
      const Vector3d to = T_box_scan * (cloud.points[i].cast<double>() + cloud.origin);
      if (!GoesThrough(box, from, to)) continue;
      ++through;
      EXPECT_TRUE(there.contains(cloud.label[i])) << i;
    }
    given += part.size();
    all += cloud.size();
  }
  EXPECT_GT(through, 50U);
  EXPECT_LT(given, all / 4);
}

TEST(BeamsByAzimuthTest, BeamsThatAreNotFiniteGoNowhereAndTheRestKeepTheirOrder) {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  PointCloud cloud;
  cloud.points = {{5, 0, 0}, {kNan, 0, 0}, {-5, 0, 0}, {5, 0.1F, 0}, {0, 0, 0}};
  const BeamsByAzimuth beams(cloud, Pose::Identity());
  const AlignedBox3d ahead(Vector3d(3, -0.5, -0.5), Vector3d(4, 0.5, 0.5));
  const PointCloud part = beams.Towards(ahead, Pose::Identity());
  EXPECT_THAT(part.points,
              ::testing::ElementsAre(cloud.points[0], cloud.points[3], cloud.points[4]));
  // Where the sensor stands in it.
  const AlignedBox3d around(Vector3d(-1, -1, -1), Vector3d(1, 1, 1));
  EXPECT_EQ(beams.Towards(around, Pose::Identity()).size(), 4U);
}

}  // namespace
}  // namespace strata
