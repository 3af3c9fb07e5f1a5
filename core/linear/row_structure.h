// The order of rows and the places of entries, which all matrices of the same rows share.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/linear/row_pattern.h"
#include "core/math/sparsity.h"

namespace sim {

struct RowStructure {
  // The arguments are those of RowMatrix.
  RowStructure(const RowPattern& pattern, std::span<const double> weights,
               std::span<const std::uint8_t> orthogonal);

  struct Product {  // w_i g_a . g_b, a part of one entry of A
    int a, b, node;
  };
  struct Place {
    int column, slot;
  };
  struct Component {
    int begin = 0, end = 0;   // places of the order
    std::size_t work = 0;     // of it and those before
    bool in_panels = false;   // so much fill that its factors are dense panels, not lists
    bool orthogonal = false;  // its rows, for equal weights
  };

  Sparsity entries_of(const Component& component) const;  // of A, from its first place on

  int size;
  std::size_t fill = 0;  // numbers of L below its diagonal
  std::vector<Component> components;
  std::vector<int> row_at;  // the row that stands at each place of the order
  // Entries of A on and above the diagonal, column by column, the diagonal last.
  std::vector<int> entry_begin, entry_row, product_begin;
  std::vector<Product> products;
  // L by columns without its diagonal; row k of it as the columns with an entry, ascending. Columns
  // of components in panels are left out.
  std::vector<int> column_begin, rows, place_begin;
  std::vector<Place> places;
};

}  // namespace sim
