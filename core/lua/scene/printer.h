// The lines that a scene prints.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "core/lua/lua_state.h"

namespace sim {

// Writes so many bytes and then no more. At the end a line says how much was left out.
class Printer {
 public:
  using Write = std::function<void(const std::string& text)>;

  explicit Printer(std::size_t most, Write write = to_standard_error);
  ~Printer();
  Printer(const Printer&) = delete;
  Printer& operator=(const Printer&) = delete;

  // The arguments on the stack as Lua's print has them. Passes on what the writer throws.
  void print(lua_State* L);
  // Says what was left out, and begins anew.
  void finish();

  static void to_standard_error(const std::string& text);  // as visible_text

 private:
  std::size_t most_, written_ = 0;
  std::uint64_t bytes_left_out_ = 0, lines_left_out_ = 0;
  Write write_;
};

}  // namespace sim
