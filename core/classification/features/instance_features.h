// What an instance-based network sees of a point (thesis 9.4): the features of its nodes.
#ifndef STRATA_CORE_CLASSIFICATION_FEATURES_INSTANCE_FEATURES_H_
#define STRATA_CORE_CLASSIFICATION_FEATURES_INSTANCE_FEATURES_H_

#include "core/classification/features/labelled_features.h"

namespace strata {

// τ of eq. 9.9 (Instances::Distances), every row divided by its mean, and the constant 1 as the
// last column. Which class is nearest does not change, and d_1 = d_2 stays the line d_1 / Σ d = ½
// (Fig. 9.5). But training points are nearer to each other, scan lines apart, than those of another
// scene are to them: weights learned from absolute distances would be asked far from where they
// were learned. A row of zeros stays one.
FeatureMatrix InstanceFeatures(FeatureMatrix distances);

}  // namespace strata

#endif  // STRATA_CORE_CLASSIFICATION_FEATURES_INSTANCE_FEATURES_H_
