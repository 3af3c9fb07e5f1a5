#include "core/base/duration_text.h"

#include <cmath>

#include "core/base/text.h"

namespace sim {

std::string rough_time(double seconds) {
  constexpr double kMinute = 60, kHour = 3600;
  const auto told = [](double amount, const char* unit) {
    return brief(amount, amount < 10 ? 1 : 2) + unit;
  };
  if (seconds < 95) return told(seconds, " s");
  if (seconds < 95 * kMinute) return told(seconds / kMinute, " min");
  return brief(std::round(seconds / kHour)) + " h";
}

}  // namespace sim
