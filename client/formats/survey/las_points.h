// The records of a LAS file's points, made a cloud of.
#ifndef STRATA_CLIENT_FORMATS_SURVEY_LAS_POINTS_H_
#define STRATA_CLIENT_FORMATS_SURVEY_LAS_POINTS_H_

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include <Eigen/Core>

#include "client/formats/parsing/cloud_builder.h"
#include "client/formats/parsing/scalar.h"
#include "client/formats/survey/las_header.h"
#include "client/formats/survey/las_units.h"
#include "core/cloud/point_cloud.h"

namespace strata {

class LasPoints {
 public:
  static constexpr std::size_t kMostAtOnce = 1024;

  // `header` must outlive it.
  static absl::StatusOr<LasPoints> Create(const LasHeader& header, const LasUnits& units);

  // For all points that will come.
  void Reserve(std::size_t points) { builder_.Reserve(points); }
  // Whole records that follow each other, at most kMostAtOnce.
  void Add(std::span<const char> records);
  // As ReadLas() has it.
  absl::StatusOr<PointCloud> Build() &&;

 private:
  struct Field {
    Meaning meaning = Meaning::kIgnored;
    ScalarType type = ScalarType::kUint16;
    std::size_t at = 0;
    bool any = false;  // point has something else than zero in it
  };

  LasPoints(const LasHeader& header,
            const LasUnits& units,
            std::vector<Field> fields,
            CloudBuilder builder);
  static std::vector<Field> FieldsOf(const LasFormat& format);
  bool Any(Meaning meaning) const;
  bool IsWithheld(const char* point) const;
  void ReadCoordinates(std::span<const char> records, PointBlock& block) const;

  const LasHeader* header_;
  Eigen::Vector3d unit_m_;
  std::vector<Field> fields_;
  CloudBuilder builder_;
};

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_SURVEY_LAS_POINTS_H_
