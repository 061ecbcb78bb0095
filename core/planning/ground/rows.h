// Loops over the rows of a grid, by several threads where whoever plans has some.
#ifndef STRATA_CORE_PLANNING_GROUND_ROWS_H_
#define STRATA_CORE_PLANNING_GROUND_ROWS_H_

#include <algorithm>
#include <cstddef>
#include <functional>
#include <new>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"

namespace strata {

// Calls body(i) for every i in [0, count), each once, in no order and perhaps from several threads;
// an error is that of an allocation that failed. Empty: in order, in the caller's thread.
using ParallelLoop =
    std::function<absl::Status(std::size_t count, absl::FunctionRef<absl::Status(std::size_t)>)>;

inline constexpr int kRowBands = 8;  // more than threads: some rows are fuller than others

// Calls body(band, y) for y in [low, high): rows of a band in order, bands of rising y side by
// side.
template <typename Body>
void ForRows(const ParallelLoop& loop, int low, int high, const Body& body) {
  const auto run_band = [&](int band) {
    const int rows = std::max(0, high - low);
    const int end = low + rows * (band + 1) / kRowBands;
    for (int y = low + rows * band / kRowBands; y < end; ++y) body(band, y);
  };
  if (loop == nullptr) {
    for (int band = 0; band < kRowBands; ++band) run_band(band);
    return;
  }
  const absl::Status done = loop(kRowBands, [&](std::size_t band) {
    run_band(static_cast<int>(band));
    return absl::OkStatus();
  });
  // As where the caller's own thread finds no memory.
  if (!done.ok()) throw std::bad_alloc();
}

}  // namespace strata

#endif  // STRATA_CORE_PLANNING_GROUND_ROWS_H_
