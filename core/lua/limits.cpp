#include "core/lua/limits.h"

#include <algorithm>

#include "core/base/error.h"
#include "core/base/units.h"

namespace sim {
namespace {

constexpr double kMostOfBudget = 1e15;

[[noreturn]] void refuse_budget(const std::string& where, const std::string& why,
                                const std::string& remedy) {
  throw Error(ErrorKind::kUsage, {"bad value", where, why, remedy});
}

double amount_of(const std::string& where, const std::string& text) {
  const double value = positive_number(where, text);
  if (value > kMostOfBudget)
    refuse_budget(where + " '" + text + "'", "it is out of range", "give at most 1e15");
  return value;
}

}  // namespace

LuaLimits with_budget(LuaLimits limits, const std::string& name, const std::string& text) {
  constexpr double kMostMegabytes = 1e12;
  for (std::size_t begin = 0; begin <= text.size() && !text.empty();) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    const std::string word = text.substr(begin, end - begin);
    const std::size_t equals = std::min(word.find('='), word.size());
    const std::string key = word.substr(0, equals);
    if (key != "time" && key != "memory" && key != "steps")
      refuse_budget(name + " '" + text + "'", "it limits time (in s), memory (in MB) and steps",
                    "write it like time=60,memory=4096");
    const double value =
        amount_of(name + " " + key, word.substr(std::min(equals + 1, word.size())));
    if (key == "time") {
      limits.seconds = value;
      limits.seconds_in_all = true;
    }
    if (key == "memory")
      limits.memory = static_cast<std::size_t>(std::min(value, kMostMegabytes) * 0x1p20);
    if (key == "steps") limits.steps = static_cast<std::uint64_t>(std::max(1.0, value));
    begin = end + 1;
  }
  return limits;
}

}  // namespace sim
