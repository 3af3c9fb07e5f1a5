#include "core/engine/mesh_file.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <sstream>

#include "core/base/error.h"
#include "core/base/text.h"
#include "core/output/read_file.h"
#include "core/output/writer.h"

namespace sim::engine {
namespace {

constexpr std::size_t kMostBytes = 1'000'000'000;
constexpr std::size_t kMostPoints = 5'000'000;
constexpr std::size_t kMostCorners = 1000;  // of a polygon

[[noreturn]] void bad_mesh(const std::string& where, const std::string& why) {
  throw Error(ErrorKind::kUsage,
              {"bad mesh", where, why, "sim import reads .obj and .ply (text, or little-endian)"});
}

// The contents of a file, before points are dropped.
struct Reading {
  std::vector<Vec3> points;
  std::vector<std::array<int, 3>> triangles;
  std::string where;

  void add_point(const Vec3& p) {
    if (!p.allFinite()) bad_mesh(where, "a point is not finite");
    if (points.size() == kMostPoints) bad_mesh(where, "it has more than 5 million points");
    points.push_back(p);
  }
  void add_polygon(const std::vector<std::int64_t>& corners) {
    for (const std::int64_t corner : corners)
      if (corner < 0 || corner >= static_cast<std::int64_t>(points.size()))
        bad_mesh(where, "a face has a point that is not there");
    for (std::size_t i = 2; i < corners.size(); ++i)
      triangles.push_back({static_cast<int>(corners[0]), static_cast<int>(corners[i - 1]),
                           static_cast<int>(corners[i])});
    if (triangles.size() > 2 * kMostPoints)
      bad_mesh(where, "it has more than 10 million triangles");
  }
};

// "v x y z" and "f 1 2 3", "f 1/2/3 ..", negative numbers from the end; all else is passed over.
void read_obj(const std::string& text, const std::string& file, Reading& mesh) {
  std::istringstream in(text);
  std::string line;
  for (std::size_t number = 1; std::getline(in, line); ++number) {
    mesh.where = file + ":" + std::to_string(number);
    std::istringstream words(line);
    std::string word;
    words >> word;
    if (word == "v") {
      Vec3 p{0, 0, 0};
      for (int axis = 0; axis < 3; ++axis) {
        const auto value = words >> word ? parse_number(word) : std::nullopt;
        if (!value) bad_mesh(mesh.where, "a point has three numbers");
        p[axis] = *value;
      }
      mesh.add_point(p);
    } else if (word == "f") {
      std::vector<std::int64_t> corners;
      while (words >> word && corners.size() < kMostCorners) {
        const auto index = parse_integer(word.substr(0, word.find('/')));
        if (!index || *index == 0) bad_mesh(mesh.where, "'" + word + "' is no point of a face");
        corners.push_back(*index > 0 ? *index - 1
                                     : static_cast<std::int64_t>(mesh.points.size()) + *index);
      }
      mesh.add_polygon(corners);
    }
  }
}

struct PlyProperty {
  std::string name, type, count_type;  // of a list: the type of its count
};
struct PlyElement {
  std::string name;
  std::int64_t count = 0;
  std::vector<PlyProperty> properties;
};

// The numbers of a .ply file behind its header, one after the other.
class PlyNumbers {
 public:
  PlyNumbers(const std::string& text, std::size_t at, bool binary, const std::string& file)
      : text_(text), at_(at), binary_(binary), file_(file) {}

  double next(const std::string& type) {
    if (!binary_) {
      while (at_ < text_.size() && std::isspace(static_cast<unsigned char>(text_[at_]))) ++at_;
      const std::size_t begin = at_;
      while (at_ < text_.size() && !std::isspace(static_cast<unsigned char>(text_[at_]))) ++at_;
      const auto value = parse_number(text_.substr(begin, at_ - begin));
      if (!value) bad_mesh(where(), begin == at_ ? "it ends too early" : "a number is expected");
      return *value;
    }
    if (type == "char" || type == "int8") return read<std::int8_t>();
    if (type == "uchar" || type == "uint8") return read<std::uint8_t>();
    if (type == "short" || type == "int16") return read<std::int16_t>();
    if (type == "ushort" || type == "uint16") return read<std::uint16_t>();
    if (type == "int" || type == "int32") return read<std::int32_t>();
    if (type == "uint" || type == "uint32") return read<std::uint32_t>();
    if (type == "float" || type == "float32") return static_cast<double>(read<float>());
    if (type == "double" || type == "float64") return read<double>();
    bad_mesh(where(), "'" + type + "' is no type of .ply");
  }

  std::string where() const { return file_ + ", byte " + std::to_string(at_); }

 private:
  template <class Number>
  Number read() {
    Number value{};
    if (at_ + sizeof value > text_.size()) bad_mesh(where(), "it ends too early");
    std::memcpy(&value, text_.data() + at_, sizeof value);
    at_ += sizeof value;
    return value;
  }

  const std::string& text_;
  std::size_t at_;
  bool binary_;
  std::string file_;
};

std::vector<PlyElement> read_ply_header(const std::string& text, const std::string& file,
                                        std::size_t& end, bool& binary) {
  std::vector<PlyElement> elements;
  std::size_t at = 0;
  for (int number = 1;; ++number) {
    const std::size_t line_end = text.find('\n', at);
    const std::string where = file + ":" + std::to_string(number);
    if (line_end == std::string::npos || number > 1000) bad_mesh(where, "its header has no end");
    std::istringstream words(text.substr(at, line_end - at));
    at = line_end + 1;
    std::string first, second, third;
    words >> first;
    if (number == 1 && first != "ply") bad_mesh(where, "it does not begin with ply");
    if (first == "format") {
      words >> second;
      if (second != "ascii" && second != "binary_little_endian")
        bad_mesh(where, "format " + second + " is not read");
      binary = second != "ascii";
    } else if (first == "element") {
      PlyElement element;
      words >> element.name >> third;
      const auto count = parse_integer(third);
      if (!count || *count < 0 || *count > static_cast<std::int64_t>(2 * kMostPoints))
        bad_mesh(where, "it has a bad number of elements");
      element.count = *count;
      elements.push_back(element);
    } else if (first == "property") {
      PlyProperty property;
      words >> property.type;
      if (property.type == "list") words >> property.count_type >> property.type;
      words >> property.name;
      if (elements.empty() || property.name.empty()) bad_mesh(where, "a property of nothing");
      elements.back().properties.push_back(property);
    } else if (first == "end_header") {
      end = at;
      return elements;
    }
  }
}

void read_ply(const std::string& text, const std::string& file, Reading& mesh) {
  std::size_t begin = 0;
  bool binary = false;
  const std::vector<PlyElement> elements = read_ply_header(text, file, begin, binary);
  PlyNumbers numbers(text, begin, binary, file);
  for (const PlyElement& element : elements)
    for (std::int64_t i = 0; i < element.count; ++i) {
      Vec3 p{0, 0, 0};
      std::vector<std::int64_t> corners;
      mesh.where = numbers.where();
      if (element.properties.empty()) break;
      for (const PlyProperty& property : element.properties) {
        if (property.count_type.empty()) {
          const double value = numbers.next(property.type);
          for (int axis = 0; axis < 3; ++axis)
            if (property.name == std::string(1, "xyz"[axis])) p[axis] = value;
          continue;
        }
        const double count = numbers.next(property.count_type);
        if (!(count >= 0 && count <= static_cast<double>(kMostCorners)))
          bad_mesh(mesh.where, "a list has more than 1000 entries");
        for (int k = 0; k < static_cast<int>(count); ++k) {
          const double value = numbers.next(property.type);
          if (!(std::abs(value) < 1e15)) bad_mesh(mesh.where, "a face has no such point");
          if (property.name == "vertex_indices" || property.name == "vertex_index")
            corners.push_back(static_cast<std::int64_t>(value));
        }
      }
      if (element.name == "vertex") mesh.add_point(p);
      if (element.name == "face") mesh.add_polygon(corners);
    }
}

// Points without a triangle would fall on their own.
Mesh used_part(const Reading& reading) {
  Mesh mesh;
  std::vector<int> place(reading.points.size(), -1);
  const auto at = [&](int i) { return reading.points[static_cast<std::size_t>(i)]; };
  for (const auto& [a, b, c] : reading.triangles) {
    const Vec3 normal = (at(b) - at(a)).cross(at(c) - at(a));
    if (!(normal.norm() > 0)) {
      ++mesh.dropped;
      continue;
    }
    mesh.triangles.push_back({a, b, c});
    for (const int i : {a, b, c}) place[static_cast<std::size_t>(i)] = 0;
  }
  for (std::size_t i = 0; i < place.size(); ++i) {
    if (place[i] < 0) continue;
    place[i] = static_cast<int>(mesh.points.size());
    mesh.points.push_back(reading.points[i]);
  }
  for (auto& triangle : mesh.triangles)
    for (int& i : triangle) i = place[static_cast<std::size_t>(i)];
  return mesh;
}

}  // namespace

Mesh read_mesh(const std::string& file) {
  const std::string text = read_whole_file(
      file, {"cannot read a mesh", file, "", "give a file .obj or .ply"}, kMostBytes);
  Reading reading;
  reading.where = file;
  const std::string ending = ending_of(file);
  if (ending == "obj")
    read_obj(text, file, reading);
  else if (ending == "ply")
    read_ply(text, file, reading);
  else
    bad_mesh(file, "its ending is neither .obj nor .ply");
  Mesh mesh = used_part(reading);
  if (mesh.triangles.empty()) bad_mesh(file, "it has no triangle");
  return mesh;
}

}  // namespace sim::engine
