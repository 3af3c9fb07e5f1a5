#include "core/lua/scene/printer.h"

#include <cstdio>
#include <string_view>

#include "core/base/text.h"
#include "core/base/utf8.h"
#include "core/lua/library/order.h"

namespace sim {

Printer::Printer(std::size_t most, Write write) : most_(most), write_(std::move(write)) {}

Printer::~Printer() {
  try {
    finish();
  } catch (const std::exception&) {  // nobody is left to be told
  }
}

void Printer::to_standard_error(const std::string& text) {
  const std::string shown = visible_text(text);
  std::fwrite(shown.data(), 1, shown.size(), stderr);
}

void Printer::print(lua_State* L) {
  constexpr std::uint64_t kUnitBytes = 64;  // that cost as much as an instruction
  const int count = lua_gettop(L);
  std::string line;
  std::uint64_t size = 1;  // with the end of the line
  for (int i = 1; i <= count; ++i) {
    std::size_t length = 0;
    const char* const text = push_text(L, i, &length);
    size += length + (i > 1);
    if (size <= most_ - written_ && lines_left_out_ == 0)
      line.append(i > 1 ? "\t" : "").append(text, length);
    lua_pop(L, 1);
  }
  charge(L, size / kUnitBytes + 1);
  if (size > most_ - written_ || lines_left_out_ > 0) {
    bytes_left_out_ += size;
    ++lines_left_out_;
    return;
  }
  written_ += static_cast<std::size_t>(size);
  write_(line + '\n');
}

void Printer::finish() {
  const std::uint64_t bytes = std::exchange(bytes_left_out_, 0);
  const std::uint64_t lines = std::exchange(lines_left_out_, 0);
  written_ = 0;
  if (lines == 0) return;
  write_("sim: note: print: " + std::to_string(bytes) + " bytes in " + std::to_string(lines) +
         (lines == 1 ? " line" : " lines") + " were left out, beyond " +
         brief(static_cast<double>(most_) / 1e6) + " MB\n");
}

}  // namespace sim
