// Plain readers of the files that writers write; they share nothing with the kernel. Each throws
// std::runtime_error for a file that is not what its format says.
#pragma once

#include <array>
#include <cstdint>
#include <cstring>
#include <map>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

namespace sim_test {

struct TextRows {
  std::vector<std::string> names;
  std::vector<std::map<std::string, std::string>> rows;
};

// RFC 4180: fields in quotes may hold commas, quotes that are doubled, and ends of lines.
TextRows read_csv(const std::string& text);
// One flat object a line; names in the order in which they first come.
TextRows read_json_lines(const std::string& text);

template <class Number>
Number number_at(const std::string& bytes, std::size_t at) {
  Number value{};
  if (at > bytes.size() || bytes.size() - at < sizeof value)
    throw std::runtime_error("the file is too short");
  std::memcpy(&value, bytes.data() + at, sizeof value);
  return value;
}

// The files in a zip file that stores them as they are, by the central directory.
std::map<std::string, std::string> read_zip(const std::string& bytes);

struct NpyArray {
  std::string type;  // "<f8"
  std::vector<std::size_t> shape;
  std::string data;

  std::size_t size() const;
  double at(std::size_t i) const;
};
NpyArray read_npy(const std::string& bytes);

struct VtpFile {
  std::map<std::string, long> counts;  // NumberOfPoints, NumberOfLines, ..
  struct Values {
    int components = 0;
    std::vector<double> numbers;
  };
  std::map<std::string, Values> arrays;  // "PointData/velocity"
};
VtpFile read_vtp(const std::string& bytes);

struct PlyFile {
  std::vector<std::array<double, 3>> points;
  std::vector<std::vector<int>> faces;
  std::vector<std::array<int, 2>> edges;
};
PlyFile read_ply(const std::string& bytes);
PlyFile read_obj(const std::string& text);

struct Pixels {
  int width = 0, height = 0;
  std::vector<std::uint8_t> rgb;
};
// 8 bits a channel without an interlace, any filter; the checksum of each chunk is checked.
Pixels read_png(const std::string& bytes);

std::string from_base64(const std::string& text);
std::string inflated(const std::string& bytes);

// The first number in the text behind this key, or all up to the end of the brackets there.
double number_behind(const std::string& text, const std::string& key, std::size_t from = 0);
std::vector<double> numbers_behind(const std::string& text, const std::string& key,
                                   std::size_t from = 0);

}  // namespace sim_test
