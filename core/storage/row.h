// A row as a store found it. What is in it is not trusted: a value that is missing or of another
// type reads as 0 or as no bytes, and the readers of rows.h check what can be checked.
#ifndef STRATA_CORE_STORAGE_ROW_H_
#define STRATA_CORE_STORAGE_ROW_H_

#include <cstdint>
#include <string>

#include "absl/strings/string_view.h"

namespace strata {

class Row {
 public:
  virtual ~Row() = default;

  virtual std::int64_t Int(int column) const = 0;
  virtual double Real(int column) const = 0;
  // Text or bytes; valid until the store's next row.
  virtual absl::string_view Bytes(int column) const = 0;

  std::uint64_t Unsigned(int column) const { return static_cast<std::uint64_t>(Int(column)); }
  bool Bool(int column) const { return Int(column) != 0; }
  std::string Text(int column) const { return std::string(Bytes(column)); }

 protected:
  Row() = default;
  Row(const Row&) = default;
  Row& operator=(const Row&) = default;
};

}  // namespace strata

#endif  // STRATA_CORE_STORAGE_ROW_H_
