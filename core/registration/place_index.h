// Finds the places of a map that look like a given one.
#ifndef STRATA_CORE_REGISTRATION_PLACE_INDEX_H_
#define STRATA_CORE_REGISTRATION_PLACE_INDEX_H_

#include <cstddef>
#include <cstdint>
#include <map>
#include <vector>

#include "absl/functional/function_ref.h"

#include "core/registration/place_descriptor.h"

namespace strata {

// Places by number. Two steps: the invariant parts of all places are compared, then the spectra of
// the best few. Answers depend on what is held and not on the order of Add() and Remove().
// Concurrent const use is safe. About 3 kB a place.
class PlaceIndex {
 public:
  struct Neighbour {
    std::uint64_t number = 0;
    PlaceSimilarity similarity;  // a: the neighbour, b: the place asked for
  };

  // Replaces the place of that number. An empty descriptor is held but is near to nothing.
  void Add(std::uint64_t number, const PlaceDescriptor& descriptor);
  // False if there is no such place.
  bool Remove(std::uint64_t number);
  std::size_t size() const { return places_.size(); }
  // nullptr if there is no such place.
  const PlaceDescriptor* Find(std::uint64_t number) const;

  // Up to `count` places most alike, best first (ties: lower number first), without those for which
  // `excluded` is true. 20,000 places take a few ms.
  std::vector<Neighbour> Nearest(const PlaceDescriptor& descriptor,
                                 std::size_t count,
                                 absl::FunctionRef<bool(std::uint64_t)> excluded) const;

 private:
  struct Place {
    std::uint64_t number = 0;
    PlaceDescriptor descriptor;
  };
  std::vector<Place> places_;
  std::vector<float> invariants_;  // of the places, one after the other
  std::map<std::uint64_t, std::size_t> index_of_;
};

}  // namespace strata

#endif  // STRATA_CORE_REGISTRATION_PLACE_INDEX_H_
