// Recorded clouds of which every point's class is known.
#ifndef STRATA_TESTS_SUPPORT_LABELLED_CLOUDS_H_
#define STRATA_TESTS_SUPPORT_LABELLED_CLOUDS_H_

#include <string>
#include <vector>

#include "core/classification/classifier.h"
#include "core/cloud/point_cloud.h"

namespace strata::testing {

struct LabelledClouds {
  std::vector<ClassName> classes;
  std::vector<PointCloud> clouds;  // labels are ids of `classes`, or 0
};

// The files of Oakland 3-D whose names hold `part` ("part3", "part2"), in the classes that the
// folder's README suggests. Empty where the data are absent.
LabelledClouds ReadOakland(const std::string& part);

// The scan of Wachtberg as two clouds, left and right of the car, in the classes of its mapping.
LabelledClouds ReadWachtbergHalves();

}  // namespace strata::testing

#endif  // STRATA_TESTS_SUPPORT_LABELLED_CLOUDS_H_
