#include "tests/support/labelled_clouds.h"

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>

#include "tests/support/data_dir.h"

namespace strata::testing {
namespace {

// Class ids by the labels of the files.
using Mapping = std::map<int, std::uint16_t>;

Mapping MappingOf(const std::vector<std::vector<int>>& labels_of_class) {
  Mapping mapping;
  std::uint16_t id = 0;
  for (const std::vector<int>& labels : labels_of_class) {
    ++id;
    for (const int label : labels) mapping[label] = id;
  }
  return mapping;
}

std::uint16_t Mapped(const Mapping& mapping, int label) {
  const auto found = mapping.find(label);
  return found == mapping.end() ? std::uint16_t{0} : found->second;
}

// Lines "x y z label confidence", comments between them.
PointCloud ReadText(const std::filesystem::path& path, const Mapping& mapping) {
  PointCloud cloud;
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) {
    std::istringstream words(line);
    Eigen::Vector3f p;
    int label = 0;
    if (!(words >> p.x() >> p.y() >> p.z() >> label)) continue;
    cloud.points.push_back(p);
    cloud.label.push_back(Mapped(mapping, label));
  }
  return cloud;
}

}  // namespace

LabelledClouds ReadOakland(const std::string& part) {
  const Mapping mapping =
      MappingOf({{1200, 1202, 1203, 1204, 1205, 1206, 1301},
                 {1400, 1401, 1402, 1403, 1404, 1405, 1406, 1410, 1411, 1412},
                 {1300, 1304, 1306},
                 {1103, 1106, 1107, 1110, 1111, 1112, 1114, 1115, 1116, 1302, 1303, 1305},
                 {1100, 1101, 1102, 1104, 1105},
                 {1501}});
  LabelledClouds oakland;
  oakland.classes = {
      {1, "ground"}, {2, "facade"}, {3, "vegetation"}, {4, "pole"}, {5, "wire"}, {6, "vehicle"}};
  const auto folder = FindData("oakland3d");
  if (!folder.has_value()) return oakland;
  std::vector<std::filesystem::path> paths;
  for (const auto& entry : std::filesystem::directory_iterator(*folder)) {
    if (entry.path().filename().string().find(part) != std::string::npos) {
      paths.push_back(entry.path());
    }
  }
  std::sort(paths.begin(), paths.end());
  for (const std::filesystem::path& path : paths) {
    oakland.clouds.push_back(ReadText(path, mapping));
  }
  return oakland;
}

LabelledClouds ReadWachtbergHalves() {
  const Mapping mapping = MappingOf({{2, 7, 11, 12}, {8, 16, 17}, {3, 14, 15}, {6, 13}, {1}});
  LabelledClouds wachtberg;
  wachtberg.classes = {
      {1, "ground"}, {2, "facade"}, {3, "vegetation"}, {4, "pole"}, {5, "vehicle"}};
  const auto folder = FindData("wachtberg_labelled");
  if (!folder.has_value()) return wachtberg;
  wachtberg.clouds.resize(2);
  std::ifstream points(*folder / "scan_004_points.dat");
  std::ifstream labels(*folder / "scan_004_labels.dat");
  Eigen::Vector3f sensor;
  Eigen::Vector3f p;
  int label = 0;
  while (points >> sensor.x() >> sensor.y() >> sensor.z() >> p.x() >> p.y() >> p.z() &&
         labels >> label) {
    PointCloud& half = wachtberg.clouds[p.y() >= 0.0F ? 0 : 1];
    half.sensor_origin = sensor;
    half.points.push_back(p);
    half.label.push_back(Mapped(mapping, label));
  }
  return wachtberg;
}

}  // namespace strata::testing
