#include "core/output/png.h"

#include <cstdlib>

#include "core/output/deflate.h"

namespace sim {
namespace {

void append_word(std::string& out, std::uint32_t value) {
  for (int shift = 24; shift >= 0; shift -= 8) out += static_cast<char>((value >> shift) & 255U);
}

void append_chunk(std::string& out, const std::string& name, const std::string& data) {
  append_word(out, static_cast<std::uint32_t>(data.size()));
  const std::string body = name + data;
  out += body;
  append_word(out, crc32_of(body));
}

// The predictor of Paeth: whichever of left, above, above left is nearest to left + above - corner.
int paeth(int left, int above, int corner) {
  const int p = left + above - corner;
  const int a = std::abs(p - left), b = std::abs(p - above), c = std::abs(p - corner);
  return a <= b && a <= c ? left : b <= c ? above : corner;
}

}  // namespace

std::string png(const Image& image, const std::function<bool()>& stop) {
  std::string header;
  append_word(header, static_cast<std::uint32_t>(image.width));
  append_word(header, static_cast<std::uint32_t>(image.height));
  header += std::string("\x08\x02\0\0\0", 5);

  const std::size_t row = 3 * static_cast<std::size_t>(image.width);
  // Compressed in parts of whole rows, which have the bytes of the whole.
  constexpr std::size_t kPart = std::size_t{1} << 18;
  Deflater deflater(9);
  std::string lines;
  for (int y = 0; y < image.height; ++y) {
    const std::uint8_t* now = image.rgb.data() + row * static_cast<std::size_t>(y);
    const std::uint8_t* above = y > 0 ? now - row : nullptr;
    lines += '\4';
    for (std::size_t i = 0; i < row; ++i) {
      const int left = i >= 3 ? now[i - 3] : 0, up = above ? above[i] : 0,
                corner = above && i >= 3 ? above[i - 3] : 0;
      lines += static_cast<char>(now[i] - paeth(left, up, corner));
    }
    if (lines.size() < kPart) continue;
    if (stop && stop()) return "";
    deflater.add(lines);
    lines.clear();
  }
  deflater.add(lines);
  std::string file = "\x89PNG\r\n\x1a\n";
  append_chunk(file, "IHDR", header);
  append_chunk(file, "sRGB", std::string(1, '\0'));
  append_chunk(file, "IDAT", deflater.finish());
  append_chunk(file, "IEND", "");
  return file;
}

}  // namespace sim
