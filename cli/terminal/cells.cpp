#include "cli/terminal/cells.h"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>

namespace sim::cli {
namespace {

constexpr const char* kHalfBlock = "\xe2\x96\x80";

std::string environment_variable(const char* name) {
  const char* value = std::getenv(name);
  return value ? value : "";
}

bool many_colours() {
  const std::string colours = environment_variable("COLORTERM");
  return colours == "truecolor" || colours == "24bit";
}

// The nearest of the 6 x 6 x 6 colours, or of the 24 greys.
std::uint32_t of_256(const std::uint8_t* rgb) {
  const int least = std::min({rgb[0], rgb[1], rgb[2]}), most = std::max({rgb[0], rgb[1], rgb[2]});
  if (most - least < 14) {
    const int grey = (rgb[0] + rgb[1] + rgb[2]) / 3;
    const int code = grey < 4 ? 16 : grey > 246 ? 231 : 232 + std::clamp((grey - 3) / 10, 0, 23);
    return static_cast<std::uint32_t>(code);
  }
  const auto step = [](int v) { return v < 48 ? 0 : v < 115 ? 1 : (v - 35) / 40; };
  return static_cast<std::uint32_t>(16 + 36 * step(rgb[0]) + 6 * step(rgb[1]) + step(rgb[2]));
}

}  // namespace

std::string no_pictures() {
  if (::isatty(1) == 0) return "standard output is no terminal";
  const std::string term = environment_variable("TERM");
  if (term == "dumb" || term.empty()) return "the terminal has no colours";
  if (!environment_variable("NO_COLOR").empty()) return "NO_COLOR is set";
  return "";
}

CellSize terminal_size() {
  winsize size{};
  if (::ioctl(1, TIOCGWINSZ, &size) != 0 || size.ws_col < 20 || size.ws_row < 12) return {};
  return {size.ws_col, size.ws_row};
}

Cells::Cells() : exact_(many_colours()) {}

std::uint32_t Cells::code_of(const std::uint8_t* rgb) const {
  if (!exact_) return of_256(rgb);
  return static_cast<std::uint32_t>(rgb[0] << 16 | rgb[1] << 8 | rgb[2]);
}

std::string Cells::colour(int what, std::uint32_t code) const {
  std::string text = "\x1b[" + std::to_string(what);
  if (!exact_) return text + ";5;" + std::to_string(code) + "m";
  text += ";2";
  for (const int shift : {16, 8, 0}) text += ";" + std::to_string(code >> shift & 255U);
  return text + "m";
}

std::string Cells::row(const Image& image, int y) const {
  std::string out;
  std::uint32_t before[2] = {~0U, ~0U};
  for (int x = 0; x < image.width; ++x) {
    for (const int half : {0, 1}) {
      const std::uint32_t code = code_of(image.pixel(x, 2 * y + half));
      if (code == before[half]) continue;
      before[half] = code;
      out += colour(half == 0 ? 38 : 48, code);
    }
    out += kHalfBlock;
  }
  return out + "\x1b[0m";
}

std::string Cells::changes(const Image& image) {
  const auto count =
      static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height / 2);
  const bool all = shown_.size() != count || columns_ != image.width;
  if (all) shown_.assign(count, {});
  columns_ = image.width;
  std::string out;
  std::uint32_t before[2] = {~0U, ~0U};
  std::size_t at = 0;
  for (int y = 0; y < image.height / 2; ++y) {
    bool here = false;  // the cursor is where the next cell goes
    for (int x = 0; x < image.width; ++x, ++at) {
      const Cell cell{code_of(image.pixel(x, 2 * y)), code_of(image.pixel(x, 2 * y + 1))};
      if (!all && cell == shown_[at]) {
        here = false;
        continue;
      }
      shown_[at] = cell;
      if (!here) out += "\x1b[" + std::to_string(y + 1) + ";" + std::to_string(x + 1) + "H";
      here = true;
      if (cell.upper != before[0]) out += colour(38, before[0] = cell.upper);
      if (cell.lower != before[1]) out += colour(48, before[1] = cell.lower);
      out += kHalfBlock;
    }
  }
  return out + "\x1b[0m";
}

}  // namespace sim::cli
