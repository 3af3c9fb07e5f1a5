// The elements of charts.
#pragma once

#include <string>
#include <vector>

namespace sim::svg_parts {

// Colours of important curves on white: black is the last.
const char* curve_colour(std::size_t i);

std::string number(double value);  // of a coordinate, two decimals
std::string begin(double width, double height);
std::string text(double x, double y, const std::string& words, const std::string& more = "");
std::string line(double x1, double y1, double x2, double y2, const std::string& style);
std::string disc(double x, double y, double r, const std::string& style);

// A scale of decades a little wider than the values, which are > 0, and where a value stands on it.
struct DecadeScale {
  double low = 0, high = 1, from = 0, to = 1;  // exponents of ten, px

  DecadeScale(const std::vector<double>& values, double begin, double end);
  double at(double value) const;
  double every() const;  // decades between two labels
};
// Ten with a raised exponent.
std::string decade(double x, double y, double exponent, const std::string& anchor);

// Keeps labels off each other and off occupied areas.
class Places {
 public:
  void take(double x, double y, double half_width, double half_height);
  // The height nearest to y at which a label from x on is free of others; occupies it.
  double beside(double x, double y, const std::string& words, double least, double most);
  // The occupied share of a box.
  double crowd(double x, double y, double half_width, double half_height) const;

 private:
  struct Box {
    double x, y, half_width, half_height;
  };
  std::vector<Box> boxes_;
};

double width_of(const std::string& words);  // about, at 13 px

}  // namespace sim::svg_parts
