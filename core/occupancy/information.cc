#include "core/occupancy/information.h"

#include <cmath>

namespace strata {
namespace {

double Term(double p) { return p > 0.0 ? -p * std::log2(p) : 0.0; }

}  // namespace

double EntropyBits(double probability) { return Term(probability) + Term(1.0 - probability); }

}  // namespace strata
