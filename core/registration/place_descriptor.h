// What a place looks like, in a few hundred numbers that do not depend on where the robot stood in
// it nor on its heading: finds the scans that may show the same place.
//
// Walls, trunks and posts of a local map, seen from above, are an image. The magnitude of its
// Fourier transform does not change when the image is shifted, and turns when the image is turned;
// by the projection-slice theorem a slice of it in one direction is the transform of the image's
// projection onto that direction. (Lu et al., "One RING to Rule Them All", ICRA 2022, and Xu et
// al., "RING++", T-RO 2023, recognise places so.) The magnitudes of a Fourier series over the
// directions do not change with the heading either.
#ifndef STRATA_CORE_REGISTRATION_PLACE_DESCRIPTOR_H_
#define STRATA_CORE_REGISTRATION_PLACE_DESCRIPTOR_H_

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

#include "core/mls/mls_map.h"

namespace strata {

struct PlaceDescriptor {
  static constexpr int kDirections = 60;  // over half a turn, 3° each
  static constexpr int kWaves = 24;       // a direction
  static constexpr int kHarmonics = 12;   // of a wave, over the directions

  // spectrum[wave · kDirections + direction]: magnitude, less the wave's mean over all directions,
  // in units of the wave's spread / 20. All zero: nothing to be recognised by.
  std::array<std::int8_t, kDirections * kWaves> spectrum{};

  bool empty() const;
  friend bool operator==(const PlaceDescriptor&, const PlaceDescriptor&) = default;
};

struct PlaceDescriptorOptions {
  double radius_m = 60.0;     // what is farther from the frame's origin does not count; [5, 1000]
  double cell_m = 1.0;        // of the image; [0.1, 10]
  double min_height_m = 0.5;  // lower vertical patches do not count; [0, 100]
  double max_height_m = 2.0;  // taller ones count no more than this; (min_height_m, 100]
  int min_cells = 20;         // fewer with structure in them: an empty descriptor; [1, 100000]

  absl::Status Validate() const;
};

// Describes a local map in the frame of its scan, z up within some 10°. Pure; some ms a scan.
// REQUIRES: valid options.
PlaceDescriptor DescribePlace(const MlsMap& local_map, const PlaceDescriptorOptions& options = {});

// How alike two places look.
struct PlaceSimilarity {
  // 1 − correlation of the spectra in their best relative heading; in [0, 2], 0 for the same place.
  // 1 where one of them is empty.
  double distance = 1.0;
  // R_a_b ≈ Rz(heading) or Rz(heading + π): magnitudes cannot tell which. In [0, π).
  double heading_rad = 0.0;
};
PlaceSimilarity ComparePlaces(const PlaceDescriptor& a, const PlaceDescriptor& b);

// The part that does not depend on the heading, with unit length (or zero): for an index.
std::vector<float> InvariantOf(const PlaceDescriptor& descriptor);

// 1 + kDirections · kWaves bytes.
std::string EncodePlace(const PlaceDescriptor& descriptor);
// DATA_LOSS for another version or size.
absl::StatusOr<PlaceDescriptor> DecodePlace(absl::string_view bytes);

}  // namespace strata

#endif  // STRATA_CORE_REGISTRATION_PLACE_DESCRIPTOR_H_
