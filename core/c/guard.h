// Exceptions of calls as codes and texts of sim.h, and arguments that are checked.
#pragma once

#include <algorithm>
#include <cstring>
#include <exception>
#include <string>

#include "core/base/error.h"
#include "core/c/sim.h"

namespace sim::c {

// A callback asked to stop.
struct Stopped : std::exception {};

[[noreturn]] inline void refuse(const std::string& what, const std::string& where,
                                const std::string& why, const std::string& remedy) {
  throw Error(ErrorKind::kUsage, {what, where, why, remedy});
}

template <class Handle>
Handle& checked(Handle* handle, const char* name) {
  if (!handle) refuse("null handle", name, "there is nothing to work on", "give one that is open");
  return *handle;
}

inline const char* checked_text(const char* text, const char* name) {
  if (!text) refuse("null text", name, "a text is wanted", "give one that ends with a zero byte");
  return text;
}

// A structure of a program that was compiled against another version of the header: what it does
// not know is 0, and what it knows and this library does not has to be. `begin`: how it begins.
template <class Structure>
Structure whole_of(const Structure& given, const std::string& begin) {
  constexpr std::size_t kLeast = sizeof(std::size_t), kMost = 4096;
  const std::string where = "size " + std::to_string(given.size);
  if (given.size < kLeast || given.size > kMost || given.size % alignof(Structure) != 0)
    refuse("bad options", where, "it is that of no version", "begin with " + begin);
  const auto* const bytes = reinterpret_cast<const unsigned char*>(&given);
  for (std::size_t i = sizeof given; i < given.size; ++i)
    if (bytes[i] != 0)
      refuse("unknown option", where,
             "a member of a later version is set, and this library is version " +
                 std::to_string(SIM_MAJOR) + "." + std::to_string(SIM_MINOR),
             "leave it 0, or install the later library");
  Structure whole{};
  std::memcpy(&whole, bytes, std::min(given.size, sizeof whole));
  return whole;
}

// Stores the exception that is being handled, and returns its code. One that does not say where it
// was has the function of the interface for that.
int tell(sim_error* error, const char* function) noexcept;

// Calls work(); the code of what it throws, which never goes further.
template <class Work>
int guarded(sim_error* error, Work work, const char* function = __builtin_FUNCTION()) noexcept {
  try {
    work();
    return SIM_OK;
  } catch (...) {
    return tell(error, function);
  }
}

// The same for what returns a pointer: null on failure.
template <class Work>
auto guarded_pointer(sim_error* error, Work work,
                     const char* function = __builtin_FUNCTION()) noexcept -> decltype(work()) {
  try {
    return work();
  } catch (...) {
    tell(error, function);
    return nullptr;
  }
}

char* given_away(const std::string& text);  // for sim_free(); throws std::bad_alloc

}  // namespace sim::c
