// A confusion matrix as a picture.
#ifndef STRATA_CLIENT_CLI_PICTURE_CONFUSION_PICTURE_H_
#define STRATA_CLIENT_CLI_PICTURE_CONFUSION_PICTURE_H_

#include <cstdint>
#include <string>
#include <vector>

#include "client/cli/picture/image.h"

namespace strata::picture {

// A square for each count, darker the larger its share of the row, with that share in per cent;
// rows are true classes, named on the left, columns classes given, named below. Rows without a
// point are blank. REQUIRES: `rows` is square, of as many rows as there are names.
Image DrawConfusion(const std::vector<std::vector<std::uint64_t>>& rows,
                    const std::vector<std::string>& names);

}  // namespace strata::picture

#endif  // STRATA_CLIENT_CLI_PICTURE_CONFUSION_PICTURE_H_
