#include "core/base/memory.h"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>

#include "core/base/error.h"

namespace sim {
namespace {

// "NAME:  1234 kB" of a file of /proc; 0 where it is not.
double kilobytes_of(const char* file, const std::string& name) {
  std::ifstream in(file);
  for (std::string word; in >> word;)
    if (double value = 0; word == name && in >> value) return 1024 * value;
  return 0;
}

double number_in(const char* file) {
  std::ifstream in(file);
  double value = 0;
  return in >> value ? value : HUGE_VAL;  // "max" is no number
}

double machine() {
  const double available = kilobytes_of("/proc/meminfo", "MemAvailable:");
  if (available > 0) return available + kilobytes_of("/proc/meminfo", "SwapFree:");
  const double pages = static_cast<double>(sysconf(_SC_PHYS_PAGES));
  return pages > 0 ? pages * static_cast<double>(sysconf(_SC_PAGESIZE)) : HUGE_VAL;
}

// In a container the group of this process is the root that it sees.
double control_group() {
  const double limit = number_in("/sys/fs/cgroup/memory.max");
  const double used = number_in("/sys/fs/cgroup/memory.current");
  if (std::isfinite(limit) && std::isfinite(used)) return std::max(0.0, limit - used);
  const double old_limit = number_in("/sys/fs/cgroup/memory/memory.limit_in_bytes");
  const double old_used = number_in("/sys/fs/cgroup/memory/memory.usage_in_bytes");
  return std::isfinite(old_limit) && std::isfinite(old_used) ? std::max(0.0, old_limit - old_used)
                                                             : HUGE_VAL;
}

// The remainder of the limit `which`, less the use that /proc reports under the name `counted`.
double limited(decltype(RLIMIT_AS) which, const char* counted) {
  rlimit limit{};
  if (getrlimit(which, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return HUGE_VAL;
  const double used = kilobytes_of("/proc/self/status", counted);
  return std::max(0.0, static_cast<double>(limit.rlim_cur) - used);
}

}  // namespace

double memory_left() {
  return std::min(
      {machine(), control_group(), limited(RLIMIT_AS, "VmSize:"), limited(RLIMIT_DATA, "VmData:")});
}

void limit_memory(double bytes) {
  rlimit limit{};
  if (getrlimit(RLIMIT_DATA, &limit) != 0) return;
  // A sanitizer has taken terabytes of addresses by then.
  if (kilobytes_of("/proc/self/status", "VmData:") > bytes) return;
  limit.rlim_cur = std::min<rlim_t>(limit.rlim_max, static_cast<rlim_t>(bytes));
  setrlimit(RLIMIT_DATA, &limit);
}

std::string bytes_text(double bytes) {
  char text[32];
  if (bytes < 1e9)
    std::snprintf(text, sizeof text, "%.0f MB", std::ceil(bytes / 1e6));
  else
    std::snprintf(text, sizeof text, "%.3g GB", bytes / 1e9);
  return text;
}

void require_memory(double bytes, const std::string& what, const std::string& where,
                    const std::string& remedy) {
  constexpr double kNoLook = 64e6;  // bytes, which every machine has
  if (bytes < kNoLook) return;
  const double left = memory_left();
  if (bytes <= left) return;
  throw Error(ErrorKind::kIo,
              {"too little memory", where,
               what + " at least " + bytes_text(bytes) + ", and " + bytes_text(left) + " are left",
               remedy});
}

}  // namespace sim
