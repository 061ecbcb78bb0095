// Reads DXF text: group codes and values, nothing else.
#ifndef STRATA_TESTS_SUPPORT_DXF_ENTITIES_H_
#define STRATA_TESTS_SUPPORT_DXF_ENTITIES_H_

#include <map>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

namespace strata::testing {

struct DxfEntity {
  std::string kind;
  std::map<int, std::string> values;  // the first of each group code

  std::string layer() const { return values.at(8); }
  // The point whose x has the group code.
  Eigen::Vector3d Point(int code) const {
    return {std::stod(values.at(code)),
            std::stod(values.at(code + 10)),
            std::stod(values.at(code + 20))};
  }
};

// Of a section, with what a table has; without the section's own begin and end.
inline std::vector<DxfEntity> DxfSection(const std::string& text, const std::string& name) {
  std::vector<DxfEntity> entities;
  std::istringstream lines(text);
  std::string code, value;
  bool begins = false, inside = false;
  while (std::getline(lines, code) && std::getline(lines, value)) {
    if (std::stoi(code) == 0 && value == "ENDSEC") inside = false;
    if (inside && std::stoi(code) == 0) entities.push_back({value, {}});
    if (inside && std::stoi(code) != 0 && !entities.empty()) {
      entities.back().values.emplace(std::stoi(code), value);
    }
    if (begins && std::stoi(code) == 2) inside = value == name;
    begins = std::stoi(code) == 0 && value == "SECTION";
  }
  return entities;
}

}  // namespace strata::testing

#endif  // STRATA_TESTS_SUPPORT_DXF_ENTITIES_H_
