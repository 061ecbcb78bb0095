// The parts of a point that LAZ codes each in bytes of its own, layer by layer: POINT14, RGB14,
// RGBNIR14 and BYTE14 of versions 3 and 4 (LASzip for LAS 1.4, native extension, specification
// document).
#ifndef STRATA_CLIENT_FORMATS_LAZ_LAYERED_ITEMS_H_
#define STRATA_CLIENT_FORMATS_LAZ_LAYERED_ITEMS_H_

#include <cstddef>
#include <memory>
#include <vector>

#include "client/formats/laz/arithmetic_decoder.h"
#include "client/formats/laz/laz_format.h"

namespace strata {

class LayeredItem {
 public:
  virtual ~LayeredItem() = default;
  // Writes the bytes of the next point, of the same channel of the scanner as POINT14, which comes
  // first and sets it.
  virtual void Next(std::size_t& channel, char* item) = 0;
  // Whether the layers held what was read.
  virtual bool ok() const = 0;
};

// How many layers an item has.
std::size_t LayersOf(const LazItem& item);

// Of a chunk with these layers, whose first point has these bytes; `channel` is that of the first
// point, which POINT14 sets. REQUIRES: ReadLazFormat() gave the item, of a file that is layered.
std::unique_ptr<LayeredItem> MakeLayeredItem(const LazItem& item,
                                             std::vector<ArithmeticDecoder> layers,
                                             const char* first,
                                             std::size_t& channel);

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_LAZ_LAYERED_ITEMS_H_
