// What is known of a voxel, in bits (thesis 4.4.2).
#ifndef STRATA_CORE_OCCUPANCY_INFORMATION_H_
#define STRATA_CORE_OCCUPANCY_INFORMATION_H_

namespace strata {

// Eq. 4.11 of the probability that it is occupied, in [0, 1]: 1 at 0.5, 0 where it is certain.
double EntropyBits(double probability);

// Eq. 4.12: what the entropy falls by from one probability to another. Below 0 where a measurement
// contradicts what is known.
inline double InformationGainBits(double before, double after) {
  return EntropyBits(before) - EntropyBits(after);
}

}  // namespace strata

#endif  // STRATA_CORE_OCCUPANCY_INFORMATION_H_
