#include "tests/support/pcd.h"

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"

namespace strata::testing {
namespace {

struct PcdLayout {
  std::size_t point_bytes = 0;
  std::map<std::string, std::size_t> offset;
  std::size_t points = 0;
  bool binary = false;
};

PcdLayout ReadHeader(std::istream& in) {
  PcdLayout layout;
  std::vector<std::string> fields;
  std::vector<std::size_t> sizes;
  std::vector<std::size_t> counts;
  for (std::string line; std::getline(in, line);) {
    std::istringstream words(line);
    std::string key;
    words >> key;
    if (key == "FIELDS") {
      for (std::string f; words >> f;) fields.push_back(f);
    } else if (key == "SIZE") {
      for (std::size_t s = 0; words >> s;) sizes.push_back(s);
    } else if (key == "COUNT") {
      for (std::size_t c = 0; words >> c;) counts.push_back(c);
    } else if (key == "POINTS") {
      words >> layout.points;
    } else if (key == "DATA") {
      std::string kind;
      words >> kind;
      layout.binary = kind == "binary";
      break;
    }
  }
  counts.resize(fields.size(), 1);
  sizes.resize(fields.size(), 4);
  for (std::size_t i = 0; i < fields.size(); ++i) {
    layout.offset[fields[i]] = layout.point_bytes;
    layout.point_bytes += sizes[i] * counts[i];
  }
  return layout;
}

}  // namespace

absl::StatusOr<PointCloud> ReadBinaryPcd(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  const PcdLayout layout = ReadHeader(in);
  if (!in || !layout.binary || layout.offset.count("z") == 0) {
    return absl::InvalidArgumentError(absl::StrCat(path.string(), ": no binary PCD with x y z"));
  }
  std::string bytes(layout.points * layout.point_bytes, '\0');
  in.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  if (!in) return absl::InvalidArgumentError(absl::StrCat(path.string(), ": cut short"));
  PointCloud cloud;
  cloud.points.reserve(layout.points);
  const std::size_t offsets[3] = {
      layout.offset.at("x"), layout.offset.at("y"), layout.offset.at("z")};
  const auto rgb = layout.offset.find("rgb");
  for (std::size_t i = 0; i < layout.points; ++i) {
    Eigen::Vector3f p;
    for (int k = 0; k < 3; ++k) {
      std::memcpy(&p[k], bytes.data() + i * layout.point_bytes + offsets[k], sizeof(float));
    }
    if (!p.allFinite()) continue;
    cloud.points.push_back(p);
    if (rgb == layout.offset.end()) continue;
    Colour colour;  // packed as 0x00rrggbb
    std::memcpy(&colour.b, bytes.data() + i * layout.point_bytes + rgb->second, 1);
    std::memcpy(&colour.g, bytes.data() + i * layout.point_bytes + rgb->second + 1, 1);
    std::memcpy(&colour.r, bytes.data() + i * layout.point_bytes + rgb->second + 2, 1);
    cloud.colour.push_back(colour);
  }
  return cloud;
}

absl::StatusOr<std::map<int, TimedPose>> ReadIndexedPoses(const std::filesystem::path& path) {
  std::ifstream in(path);
  if (!in) return absl::NotFoundError(path.string());
  std::map<int, TimedPose> poses;
  for (std::string line; std::getline(in, line);) {
    if (line.empty() || line[0] == '#') continue;
    std::istringstream words(line);
    int index = 0;
    TimedPose pose;
    Eigen::Vector3d t;
    Eigen::Quaterniond q;
    words >> index >> pose.time_s >> t.x() >> t.y() >> t.z() >> q.x() >> q.y() >> q.z() >> q.w();
    if (!words) return absl::InvalidArgumentError(absl::StrCat(path.string(), ": ", line));
    pose.T_world_scan = MakePose(q, t);
    poses[index] = pose;
  }
  return poses;
}

std::map<int, std::filesystem::path> ListScans(const std::filesystem::path& folder) {
  std::map<int, std::filesystem::path> scans;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().extension() != ".pcd") continue;
    const std::string stem = entry.path().stem().string();
    const std::size_t last = stem.find_last_of("0123456789");
    if (last == std::string::npos) continue;
    const std::size_t before = stem.find_last_not_of("0123456789", last);
    const std::size_t first = before == std::string::npos ? 0 : before + 1;
    scans[std::stoi(stem.substr(first, last - first + 1))] = entry.path();
  }
  return scans;
}

}  // namespace strata::testing
