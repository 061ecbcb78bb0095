// Messages of ROS 2 by eProsima's Fast CDR.
#ifndef STRATA_TESTS_SUPPORT_ROS2_ROS_CDR_H_
#define STRATA_TESTS_SUPPORT_ROS2_ROS_CDR_H_

#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "core/geometry/pose.h"

namespace strata::testing {

struct CdrHeader {
  std::int64_t stamp_ns = 0;
  std::string frame;
};

// x, y, z, intensity: 16 bytes a point; `data` has them.
std::string CloudCdr(const CdrHeader& header, const std::string& data);
std::string OdometryCdr(const CdrHeader& header, const std::string& child, const Pose& pose);
std::string TransformCdr(const CdrHeader& header, const std::string& child, const Pose& pose);
std::string PoseCdr(const CdrHeader& header, const Pose& pose);
// geometry_msgs/PoseWithCovarianceStamped, as of RViz.
std::string InitialPoseCdr(const CdrHeader& header, const Pose& pose);

struct CdrTransform {
  CdrHeader header;
  std::string child;
  Pose pose = Pose::Identity();
};
std::vector<CdrTransform> ReadTransforms(const std::string& cdr);

struct CdrGrid {
  CdrHeader header;
  float resolution_m = 0.0F;
  std::uint32_t width = 0, height = 0;
  Pose origin = Pose::Identity();
  std::vector<std::int8_t> data;
};
CdrGrid ReadGrid(const std::string& cdr);

struct CdrPath {
  CdrHeader header;
  std::vector<Pose> poses;
};
CdrPath ReadPath(const std::string& cdr);

struct CdrPose {
  CdrHeader header;
  Pose pose = Pose::Identity();
  std::array<double, 36> covariance{};
};
CdrPose ReadPoseWithCovariance(const std::string& cdr);

struct CdrDiagnosis {
  CdrHeader header;
  std::uint8_t level = 0;
  std::string name, message;
  std::map<std::string, std::string> values;
};
// Of the first status; there must be one.
CdrDiagnosis ReadDiagnosis(const std::string& cdr);

struct CdrCloud {
  CdrHeader header;
  std::uint32_t width = 0, height = 0, point_step = 0;
  std::vector<std::string> fields;
  std::vector<std::uint8_t> data;
};
CdrCloud ReadCloud(const std::string& cdr);

}  // namespace strata::testing

#endif  // STRATA_TESTS_SUPPORT_ROS2_ROS_CDR_H_
