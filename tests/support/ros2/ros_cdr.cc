#include "tests/support/ros2/ros_cdr.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include <fastcdr/Cdr.h>
#include <fastcdr/FastBuffer.h>

namespace strata::testing {
namespace {

using eprosima::fastcdr::Cdr;
using eprosima::fastcdr::FastBuffer;

constexpr std::int64_t kSecondNs = 1'000'000'000;

class Writing {
 public:
  Writing() : cdr_(buffer_, Cdr::DEFAULT_ENDIAN, Cdr::DDS_CDR) { cdr_.serialize_encapsulation(); }

  template <typename T>
  Writing& Put(const T& value) {
    cdr_ << value;
    return *this;
  }
  Writing& Header(const CdrHeader& header) {
    Put(static_cast<std::int32_t>(header.stamp_ns / kSecondNs));
    Put(static_cast<std::uint32_t>(header.stamp_ns % kSecondNs));
    return Put(header.frame);
  }
  Writing& Place(const Pose& pose) {
    const Eigen::Quaterniond q(pose.rotation());
    for (int i = 0; i < 3; ++i) Put(pose.translation()[i]);
    return Put(q.x()).Put(q.y()).Put(q.z()).Put(q.w());
  }
  Writing& Zeros(int count) {
    for (int i = 0; i < count; ++i) Put(0.0);
    return *this;
  }
  Writing& Raw(const std::string& data) {
    Put(static_cast<std::uint32_t>(data.size()));
    cdr_.serializeArray(data.data(), data.size());
    return *this;
  }
  std::string Take() { return {buffer_.getBuffer(), cdr_.getSerializedDataLength()}; }

 private:
  FastBuffer buffer_;
  Cdr cdr_;
};

class Reading {
 public:
  explicit Reading(const std::string& bytes)
      : bytes_(bytes),
        buffer_(bytes_.data(), bytes_.size()),
        cdr_(buffer_, Cdr::DEFAULT_ENDIAN, Cdr::DDS_CDR) {
    cdr_.read_encapsulation();
  }
  template <typename T>
  T Get() {
    T value{};
    cdr_ >> value;
    return value;
  }
  CdrHeader Header() {
    CdrHeader header;
    header.stamp_ns = Get<std::int32_t>() * kSecondNs;
    header.stamp_ns += Get<std::uint32_t>();
    header.frame = Get<std::string>();
    return header;
  }
  Pose Place() {
    std::array<double, 7> n{};
    for (double& number : n) number = Get<double>();
    return MakePose(Eigen::Quaterniond(n[6], n[3], n[4], n[5]), {n[0], n[1], n[2]});
  }

 private:
  std::string bytes_;  // Fast CDR reads from what it may write
  FastBuffer buffer_;
  Cdr cdr_;
};

}  // namespace

std::string CloudCdr(const CdrHeader& header, const std::string& data) {
  constexpr std::uint32_t kStep = 16;
  constexpr std::uint8_t kFloat32 = 7;
  const auto points = static_cast<std::uint32_t>(data.size() / kStep);
  Writing cdr;
  cdr.Header(header).Put(std::uint32_t{1}).Put(points).Put(std::uint32_t{4});
  std::uint32_t offset = 0;
  for (const char* name : {"x", "y", "z", "intensity"}) {
    cdr.Put(std::string(name)).Put(offset).Put(kFloat32).Put(std::uint32_t{1});
    offset += 4;
  }
  cdr.Put(false).Put(kStep).Put(points * kStep).Raw(data).Put(true);
  return cdr.Take();
}

std::string OdometryCdr(const CdrHeader& header, const std::string& child, const Pose& pose) {
  return Writing().Header(header).Put(child).Place(pose).Zeros(36).Zeros(6).Zeros(36).Take();
}

std::string TransformCdr(const CdrHeader& header, const std::string& child, const Pose& pose) {
  return Writing().Put(std::uint32_t{1}).Header(header).Put(child).Place(pose).Take();
}

std::string PoseCdr(const CdrHeader& header, const Pose& pose) {
  return Writing().Header(header).Place(pose).Take();
}

std::string InitialPoseCdr(const CdrHeader& header, const Pose& pose) {
  return Writing().Header(header).Place(pose).Zeros(36).Take();
}

std::vector<CdrTransform> ReadTransforms(const std::string& cdr) {
  Reading reading(cdr);
  std::vector<CdrTransform> transforms(reading.Get<std::uint32_t>());
  for (CdrTransform& transform : transforms) {
    transform.header = reading.Header();
    transform.child = reading.Get<std::string>();
    transform.pose = reading.Place();
  }
  return transforms;
}

CdrGrid ReadGrid(const std::string& cdr) {
  Reading reading(cdr);
  CdrGrid grid;
  grid.header = reading.Header();
  reading.Get<std::int32_t>();  // when it was loaded
  reading.Get<std::uint32_t>();
  grid.resolution_m = reading.Get<float>();
  grid.width = reading.Get<std::uint32_t>();
  grid.height = reading.Get<std::uint32_t>();
  grid.origin = reading.Place();
  grid.data = reading.Get<std::vector<std::int8_t>>();
  return grid;
}

CdrPath ReadPath(const std::string& cdr) {
  Reading reading(cdr);
  CdrPath path;
  path.header = reading.Header();
  path.poses.resize(reading.Get<std::uint32_t>());
  for (Pose& pose : path.poses) {
    reading.Header();
    pose = reading.Place();
  }
  return path;
}

CdrPose ReadPoseWithCovariance(const std::string& cdr) {
  Reading reading(cdr);
  CdrPose pose;
  pose.header = reading.Header();
  pose.pose = reading.Place();
  for (double& number : pose.covariance) number = reading.Get<double>();
  return pose;
}

CdrDiagnosis ReadDiagnosis(const std::string& cdr) {
  Reading reading(cdr);
  CdrDiagnosis diagnosis;
  diagnosis.header = reading.Header();
  reading.Get<std::uint32_t>();
  diagnosis.level = reading.Get<std::uint8_t>();
  diagnosis.name = reading.Get<std::string>();
  diagnosis.message = reading.Get<std::string>();
  reading.Get<std::string>();  // of which hardware
  const auto values = reading.Get<std::uint32_t>();
  for (std::uint32_t i = 0; i < values; ++i) {
    const auto key = reading.Get<std::string>();
    diagnosis.values[key] = reading.Get<std::string>();
  }
  return diagnosis;
}

CdrCloud ReadCloud(const std::string& cdr) {
  Reading reading(cdr);
  CdrCloud cloud;
  cloud.header = reading.Header();
  cloud.height = reading.Get<std::uint32_t>();
  cloud.width = reading.Get<std::uint32_t>();
  const auto fields = reading.Get<std::uint32_t>();
  for (std::uint32_t i = 0; i < fields; ++i) {
    cloud.fields.push_back(reading.Get<std::string>());
    reading.Get<std::uint32_t>();
    reading.Get<std::uint8_t>();
    reading.Get<std::uint32_t>();
  }
  reading.Get<bool>();
  cloud.point_step = reading.Get<std::uint32_t>();
  reading.Get<std::uint32_t>();
  cloud.data = reading.Get<std::vector<std::uint8_t>>();
  return cloud;
}

}  // namespace strata::testing
