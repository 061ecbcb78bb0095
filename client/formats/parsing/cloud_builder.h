// Collects the points of a file, whatever its fields are called, and makes a PointCloud of them.
#ifndef STRATA_CLIENT_FORMATS_PARSING_CLOUD_BUILDER_H_
#define STRATA_CLIENT_FORMATS_PARSING_CLOUD_BUILDER_H_

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include <Eigen/Core>

#include "core/cloud/point_cloud.h"

namespace strata {

// What a field of a point means to us.
enum class Meaning : std::uint8_t {
  kX,
  kY,
  kZ,
  kIntensity,
  kRed,
  kGreen,
  kBlue,
  kPackedColour,  // 0x00RRGGBB, as the number or as the bits of a float
  kLabel,
  kTime,  // of the point, in any unit
  kIgnored,
};
inline constexpr std::size_t kMeanings = 11;

// By the names in use, whatever their case: x, intensity, reflectance, scalar_intensity, red, r,
// rgb, label, class, classification, t, time, timestamp, ….
Meaning MeaningOf(absl::string_view field_name);

// The values of points that follow each other, column by column: `count` numbers for each meaning
// of their fields, null for the others.
struct PointBlock {
  std::size_t count = 0;
  std::array<double*, kMeanings> columns{};

  std::span<double> of(Meaning meaning) const {
    return {columns[static_cast<std::size_t>(meaning)], count};
  }
};

class CloudBuilder {
 public:
  // `meanings`: of each field of a point, in order. INVALID_ARGUMENT naming what is missing of x, y
  // and z.
  static absl::StatusOr<CloudBuilder> Create(std::vector<Meaning> meanings);

  // All coordinates will be numbers that floats hold: half the memory. REQUIRES: no point was
  // added.
  void HoldFloats() { hold_floats_ = true; }
  void Reserve(std::size_t points);
  // The values of the fields; a packed colour as its 24 bits. REQUIRES: one for each meaning.
  void Add(const double* values);
  // As Add for each of many points, but faster; the columns serve as scratch.
  void AddBlock(PointBlock block);

  void SetGrid(std::uint32_t rows, std::uint32_t columns);
  // Where the file says the sensor stood, in the file's coordinates; zero stands for not saying.
  void SetSensorOrigin(const Eigen::Vector3d& position) { sensor_origin_ = position; }

  // The cloud. Without a grid points that are not finite are left out; in one they become NaN.
  // Along an axis where all points but (0, 0, 0), which stands for no return, lie on one side of
  // zero and their middle beyond 1000 m, `origin`
  // is that middle rounded to 100 m: floats inside are then as fine as those of a local cloud, and
  // the difference to a float of the file is exact. Where no sensor position was set and what would
  // stand for it, `origin`, is farther from the points' box than 100 m and than the box's diagonal,
  // no sensor stood there, and `origin` is the box's centre rounded to 1 m. `sensor_origin` is what
  // was set; else the zero of the file's coordinates, or, with an origin, the origin itself.
  // Colours come in 0–255, 0–65535 or, with fractions, 0–1, and are scaled to 8 bits; labels
  // that are not in 0–65535 become 0, and a column of labels with fractions is none and is left
  // out. INVALID_ARGUMENT without any finite point, or as ValidateCloud.
  absl::StatusOr<PointCloud> Build() &&;

 private:
  struct Range {
    double low = std::numeric_limits<double>::infinity();
    double high = -low;
    void Widen(double value) {  // NaN does not
      low = value < low ? value : low;
      high = value > high ? value : high;
    }
  };

  explicit CloudBuilder(std::vector<Meaning> meanings);
  bool Has(Meaning meaning) const { return has_[static_cast<std::size_t>(meaning)]; }
  Eigen::Array3d Low() const { return {box_[0].low, box_[1].low, box_[2].low}; }
  Eigen::Array3d High() const { return {box_[0].high, box_[1].high, box_[2].high}; }
  void SettleHoles(PointBlock& block);
  void WidenBox(const PointBlock& block);
  void AddLabels(std::span<const double> labels);
  void AddColours(const PointBlock& block);
  void AddChannels(const PointBlock& block);
  Eigen::Vector3d ChooseOrigin() const;
  absl::Status CheckDistances(const Eigen::Vector3d& origin) const;
  std::vector<Eigen::Vector3f> TakeLocalPoints(const Eigen::Vector3d& origin);
  std::vector<Colour> ScaledColours() const;

  std::vector<Meaning> meanings_;
  std::array<bool, kMeanings> has_{};
  bool has_colour_ = false;
  bool hold_floats_ = false;
  std::vector<Eigen::Vector3f> floats_;   // the points, if hold_floats_,
  std::vector<Eigen::Vector3d> doubles_;  // else here
  std::array<Range, 3> box_;              // of the finite points but (0, 0, 0)
  std::vector<float> intensity_;
  std::vector<Colour> colour_;             // as long as all channels are whole and in 0–255,
  std::vector<Eigen::Vector3f> channels_;  // else here
  std::vector<std::uint16_t> label_;
  std::vector<double> time_;
  bool whole_labels_ = true;
  std::size_t added_ = 0;  // finite or not
  std::size_t finite_ = 0;
  std::uint32_t rows_ = 0;
  std::uint32_t columns_ = 0;
  Eigen::Vector3d sensor_origin_ = Eigen::Vector3d::Zero();
};

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_PARSING_CLOUD_BUILDER_H_
