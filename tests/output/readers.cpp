#include "tests/output/readers.h"

#include <zlib.h>

#include <algorithm>
#include <cstdlib>
#include <sstream>

namespace sim_test {
namespace {

void require(bool holds, const std::string& what) {
  if (!holds) throw std::runtime_error(what);
}

std::uint32_t big_endian(const std::string& bytes, std::size_t at) {
  require(at + 4 <= bytes.size(), "the file is too short");
  std::uint32_t value = 0;
  for (std::size_t k = 0; k < 4; ++k) value = value << 8 | static_cast<std::uint8_t>(bytes[at + k]);
  return value;
}

std::uint32_t checksum(const std::string& bytes) {
  return static_cast<std::uint32_t>(
      crc32(0, reinterpret_cast<const Bytef*>(bytes.data()), static_cast<uInt>(bytes.size())));
}

// The value of an attribute of the XML tag that begins here; "" without it.
std::string attribute(const std::string& tag, const std::string& name) {
  const std::size_t at = tag.find(" " + name + "=\"");
  if (at == std::string::npos) return "";
  const std::size_t begin = at + name.size() + 3;
  return tag.substr(begin, tag.find('"', begin) - begin);
}

}  // namespace

TextRows read_csv(const std::string& text) {
  std::vector<std::vector<std::string>> lines(1, std::vector<std::string>(1));
  bool quoted = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    std::string& field = lines.back().back();
    if (quoted && c == '"' && i + 1 < text.size() && text[i + 1] == '"') {
      field += text[++i];
    } else if (c == '"') {
      quoted = !quoted;
    } else if (!quoted && c == ',') {
      lines.back().emplace_back();
    } else if (!quoted && c == '\n') {
      lines.emplace_back(1);
    } else {
      field += c;
    }
  }
  require(!quoted && lines.back() == std::vector<std::string>(1), "the last line has no end");
  lines.pop_back();
  require(!lines.empty(), "no line of names");
  TextRows table{lines.front(), {}};
  for (std::size_t i = 1; i < lines.size(); ++i) {
    require(lines[i].size() == table.names.size(), "a row has another number of fields");
    auto& row = table.rows.emplace_back();
    for (std::size_t k = 0; k < lines[i].size(); ++k) row[table.names[k]] = lines[i][k];
  }
  return table;
}

TextRows read_json_lines(const std::string& text) {
  TextRows table;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) {
    require(line.size() >= 2 && line.front() == '{' && line.back() == '}', "no object");
    auto& row = table.rows.emplace_back();
    std::size_t at = 1;
    const auto word = [&] {
      const std::size_t end = line.find('"', at + 1);
      require(line[at] == '"' && end != std::string::npos, "no string");
      const std::string value = line.substr(at + 1, end - at - 1);
      require(value.find('\\') == std::string::npos, "no plain string");
      at = end + 1;
      return value;
    };
    while (line[at] != '}') {
      const std::string name = word();
      require(line[at++] == ':', "no colon");
      std::string value;
      if (line[at] == '"') {
        value = word();
      } else {
        const std::size_t end = line.find_first_of(",}", at);
        value = line.substr(at, end - at);
        at = end;
      }
      require(row.emplace(name, value).second, "a name comes twice");
      if (std::ranges::find(table.names, name) == table.names.end()) table.names.push_back(name);
      if (line[at] == ',') ++at;
    }
    require(at + 1 == line.size(), "text behind the object");
  }
  return table;
}

std::map<std::string, std::string> read_zip(const std::string& bytes) {
  std::map<std::string, std::string> files;
  require(bytes.size() >= 22, "no zip file");
  const std::size_t end = bytes.size() - 22;
  require(bytes.compare(end, 4, "PK\5\6") == 0, "no end of a central directory");
  const auto count = number_at<std::uint16_t>(bytes, end + 10);
  std::size_t at = number_at<std::uint32_t>(bytes, end + 16);
  require(at + number_at<std::uint32_t>(bytes, end + 12) == end, "another size of the directory");
  for (int i = 0; i < count; ++i) {
    require(bytes.compare(at, 4, "PK\1\2") == 0, "no entry of the directory");
    require(number_at<std::uint16_t>(bytes, at + 10) == 0, "a file is compressed");
    const auto size = number_at<std::uint32_t>(bytes, at + 24);
    const auto length = number_at<std::uint16_t>(bytes, at + 28);
    const std::size_t local = number_at<std::uint32_t>(bytes, at + 42);
    const std::string name = bytes.substr(at + 46, length);
    require(bytes.compare(local, 4, "PK\3\4") == 0, "no local header");
    require(bytes.compare(local + 30, length, name) == 0, "another name in the local header");
    // Version, flags, method, time, date, checksum and sizes are the same in both headers.
    require(bytes.substr(local + 4, 22) == bytes.substr(at + 6, 22), "the headers differ");
    const std::string data = bytes.substr(local + 30 + length, size);
    require(data.size() == size && checksum(data) == number_at<std::uint32_t>(bytes, at + 16),
            "a wrong checksum");
    require(files.emplace(name, data).second, "a name comes twice");
    at += 46 + length;
  }
  require(at == end, "more entries than the directory counts");
  return files;
}

std::size_t NpyArray::size() const {
  std::size_t product = 1;
  for (const std::size_t each : shape) product *= each;
  return product;
}

double NpyArray::at(std::size_t i) const {
  return type == "<i8" ? static_cast<double>(number_at<std::int64_t>(data, 8 * i))
                       : number_at<double>(data, 8 * i);
}

NpyArray read_npy(const std::string& bytes) {
  require(bytes.compare(0, 8, std::string("\x93NUMPY\1\0", 8)) == 0, "no npy file");
  const std::size_t length = number_at<std::uint16_t>(bytes, 8);
  require((10 + length) % 64 == 0 && bytes[9 + length] == '\n', "a header that is not aligned");
  const std::string header = bytes.substr(10, length);
  NpyArray array;
  const std::size_t type = header.find("'descr': '") + 10;
  array.type = header.substr(type, header.find('\'', type) - type);
  require(array.type == "<f8" || array.type == "<i8", "an unknown type");
  require(header.find("'fortran_order': False") != std::string::npos, "another order");
  for (const double n : numbers_behind(header, "'shape': "))
    array.shape.push_back(static_cast<std::size_t>(n));
  array.data = bytes.substr(10 + length);
  require(array.data.size() == 8 * array.size(), "another size than the shape says");
  return array;
}

VtpFile read_vtp(const std::string& bytes) {
  VtpFile file;
  const std::size_t mark = bytes.find("<AppendedData encoding=\"raw\">\n_");
  require(mark != std::string::npos && bytes.ends_with("\n</AppendedData>\n</VTKFile>\n"),
          "no appended data");
  const std::size_t data = mark + 31;
  std::size_t used = 0;
  std::string section;
  for (std::size_t at = bytes.find('<'); at < mark; at = bytes.find('<', at + 1)) {
    const std::string tag = bytes.substr(at, bytes.find('>', at) - at);
    const std::string kind = tag.substr(1, tag.find(' ') - 1);
    if (kind == "Piece")
      for (const char* name : {"NumberOfPoints", "NumberOfVerts", "NumberOfLines", "NumberOfPolys"})
        file.counts[name] = std::stol(attribute(tag, name));
    if (kind != "DataArray") {
      section = kind;
      continue;
    }
    auto& values = file.arrays[section + "/" + attribute(tag, "Name")];
    values.components = std::stoi(attribute(tag, "NumberOfComponents"));
    const std::size_t offset = std::stoul(attribute(tag, "offset"));
    require(offset == used, "arrays that do not follow each other");
    const std::size_t size = number_at<std::uint64_t>(bytes, data + offset);
    const bool integers = attribute(tag, "type") == "Int64";
    for (std::size_t i = 0; i < size; i += 8)
      values.numbers.push_back(
          integers ? static_cast<double>(number_at<std::int64_t>(bytes, data + offset + 8 + i))
                   : number_at<double>(bytes, data + offset + 8 + i));
    used += 8 + size;
  }
  require(data + used + 28 == bytes.size(), "data that no array names");
  return file;
}

PlyFile read_ply(const std::string& bytes) {
  PlyFile file;
  std::size_t at = bytes.find("end_header\n");
  require(at != std::string::npos && bytes.starts_with("ply\nformat binary_little_endian 1.0\n"),
          "no PLY file");
  const std::string header = bytes.substr(0, at);
  at += 11;
  const auto count = [&](const char* element) {
    const std::string key = std::string("element ") + element + " ";
    return header.find(key) == std::string::npos ? 0 : number_behind(header, key);
  };
  for (double i = 0; i < count("vertex"); ++i, at += 24)
    file.points.push_back({number_at<double>(bytes, at), number_at<double>(bytes, at + 8),
                           number_at<double>(bytes, at + 16)});
  for (double i = 0; i < count("face"); ++i) {
    auto& face = file.faces.emplace_back(number_at<std::uint8_t>(bytes, at++));
    for (int& corner : face) {
      corner = number_at<int>(bytes, at);
      at += 4;
    }
  }
  for (double i = 0; i < count("edge"); ++i, at += 8)
    file.edges.push_back({number_at<int>(bytes, at), number_at<int>(bytes, at + 4)});
  require(at == bytes.size(), "bytes behind the last element");
  return file;
}

PlyFile read_obj(const std::string& text) {
  PlyFile file;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) {
    std::istringstream words(line);
    std::string kind;
    words >> kind;
    std::vector<double> numbers;
    for (std::string word; words >> word;) numbers.push_back(std::stod(word));
    if (kind == "v") {
      require(numbers.size() == 3, "a vertex has three coordinates");
      file.points.push_back({numbers[0], numbers[1], numbers[2]});
    } else if (kind == "f") {
      auto& face = file.faces.emplace_back();
      for (const double id : numbers) face.push_back(static_cast<int>(id) - 1);
    } else {
      require(kind == "l" && numbers.size() == 2, "an unknown line");
      file.edges.push_back({static_cast<int>(numbers[0]) - 1, static_cast<int>(numbers[1]) - 1});
    }
  }
  return file;
}

std::string inflated(const std::string& bytes) {
  z_stream stream{};
  require(inflateInit(&stream) == Z_OK, "no zlib");
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
  stream.avail_in = static_cast<uInt>(bytes.size());
  std::string out;
  int state = Z_OK;
  while (state == Z_OK) {
    char piece[65536];
    stream.next_out = reinterpret_cast<Bytef*>(piece);
    stream.avail_out = sizeof piece;
    state = inflate(&stream, Z_NO_FLUSH);
    out.append(piece, sizeof piece - stream.avail_out);
  }
  const bool whole = state == Z_STREAM_END && stream.avail_in == 0;
  inflateEnd(&stream);
  require(whole, "no whole stream of zlib");
  return out;
}

namespace {

// Section 9 of ISO/IEC 15948: the byte that a filter predicts from its neighbours.
int predicted(int filter, int left, int above, int corner) {
  if (filter == 1) return left;
  if (filter == 2) return above;
  if (filter == 3) return (left + above) / 2;
  if (filter != 4) return 0;
  const int estimate = left + above - corner;
  const int to_left = std::abs(estimate - left), to_above = std::abs(estimate - above),
            to_corner = std::abs(estimate - corner);
  if (to_left <= to_above && to_left <= to_corner) return left;
  return to_above <= to_corner ? above : corner;
}

}  // namespace

Pixels read_png(const std::string& bytes) {
  require(bytes.starts_with("\x89PNG\r\n\x1a\n"), "no PNG file");
  Pixels image;
  std::string packed, name;
  for (std::size_t at = 8; at < bytes.size();) {
    const std::size_t length = big_endian(bytes, at);
    name = bytes.substr(at + 4, 4);
    const std::string body = bytes.substr(at + 4, 4 + length);
    require(checksum(body) == big_endian(bytes, at + 8 + length), "a wrong checksum of " + name);
    if (name == "IHDR") {
      image.width = static_cast<int>(big_endian(bytes, at + 8));
      image.height = static_cast<int>(big_endian(bytes, at + 12));
      require(body.substr(12) == std::string("\x08\x02\0\0\0", 5), "another kind of pixels");
    }
    if (name == "IDAT") packed += body.substr(4);
    at += 12 + length;
  }
  require(name == "IEND", "no end");
  const std::string lines = inflated(packed);
  const std::size_t row = 3 * static_cast<std::size_t>(image.width);
  require(lines.size() == (row + 1) * static_cast<std::size_t>(image.height), "another size");
  image.rgb.resize(row * static_cast<std::size_t>(image.height));
  for (std::size_t i = 0; i < image.rgb.size(); ++i) {
    const std::size_t y = i / row, x = i % row;
    const int filter = lines[y * (row + 1)];
    require(filter >= 0 && filter <= 4, "an unknown filter");
    const int left = x >= 3 ? image.rgb[i - 3] : 0, above = y > 0 ? image.rgb[i - row] : 0,
              corner = x >= 3 && y > 0 ? image.rgb[i - row - 3] : 0;
    image.rgb[i] =
        static_cast<std::uint8_t>(static_cast<std::uint8_t>(lines[y * (row + 1) + 1 + x]) +
                                  predicted(filter, left, above, corner));
  }
  return image;
}

std::string from_base64(const std::string& text) {
  const std::string digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  std::uint32_t bits = 0;
  int count = 0;
  for (const char c : text.substr(0, text.find('='))) {
    const std::size_t digit = digits.find(c);
    require(digit != std::string::npos, "no digit of base64");
    bits = bits << 6 | static_cast<std::uint32_t>(digit);
    count += 6;
    if (count < 8) continue;
    count -= 8;
    out += static_cast<char>(bits >> count & 255U);
  }
  return out;
}

double number_behind(const std::string& text, const std::string& key, std::size_t from) {
  const std::size_t at = text.find(key, from);
  require(at != std::string::npos, "no " + key);
  return std::strtod(text.c_str() + at + key.size(), nullptr);
}

std::vector<double> numbers_behind(const std::string& text, const std::string& key,
                                   std::size_t from) {
  std::size_t at = text.find(key, from);
  require(at != std::string::npos, "no " + key);
  std::vector<double> numbers;
  int depth = 0;
  for (at += key.size(); at < text.size();) {
    const char c = text[at];
    if (c == '[' || c == '(') ++depth;
    if ((c == ']' || c == ')') && --depth == 0) return numbers;
    char* end = nullptr;
    const double value = std::strtod(text.c_str() + at, &end);
    if (end != text.c_str() + at) numbers.push_back(value);
    at = std::max(at + 1, static_cast<std::size_t>(end - text.c_str()));
  }
  throw std::runtime_error("brackets that do not end");
}

}  // namespace sim_test
