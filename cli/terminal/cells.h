// Pictures in the cells of a terminal: two pixels a cell, the upper one the colour of a half block,
// the lower one that behind it.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/picture/raster/raster.h"

namespace sim::cli {

// "" or the reason why this terminal shows no pictures.
std::string no_pictures();

struct CellSize {
  int columns = 80, rows = 24;
};
CellSize terminal_size();  // of standard output

class Cells {
 public:
  Cells();  // in as many colours as the terminal says it has

  // A row of the picture, from the left.
  std::string row(const Image& image, int y) const;

  // The cells that changed since the last call, the picture in the upper left corner. Everything at
  // first, and after forget().
  std::string changes(const Image& image);
  void forget() { shown_.clear(); }

 private:
  struct Cell {
    std::uint32_t upper = 0, lower = 0;
    bool operator==(const Cell&) const = default;
  };
  std::uint32_t code_of(const std::uint8_t* rgb) const;
  std::string colour(int what, std::uint32_t code) const;

  bool exact_;
  int columns_ = 0;
  std::vector<Cell> shown_;
};

}  // namespace sim::cli
