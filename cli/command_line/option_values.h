// Values of options from their text, strictly: the whole text, finite, in range.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "cli/run/run.h"
#include "cli/verbs/adjacency.h"
#include "core/base/thread_count_tuner.h"
#include "core/base/units.h"
#include "core/lua/limits.h"

namespace sim::cli {

[[noreturn]] void usage_error(const std::string& what, const std::string& where,
                              const std::string& why, const std::string& remedy);

// Each throws Error{kUsage} naming the option and the expected value.
// Simulated time in s: "0.005", "5ms", "2 min".
double positive_time(const std::string& option, const std::string& text);
double non_negative_time(const std::string& option, const std::string& text);
std::optional<double> seconds_of(const std::string& text);             // the same, for any number
double wall_time(const std::string& option, const std::string& text);  // "30s", "5min", "1h": in s
// Reads --verify-time: "30s", or "50%" of the time of the run.
void allow(study::VerificationPlan& plan, const std::string& option, const std::string& text);
std::string checkpoint_name(const std::string& option, const std::string& text);
std::int64_t integer_between(const std::string& option, const std::string& text, std::int64_t low,
                             std::int64_t high);
ParticleChoice particle_choice(const std::string& option, const std::string& text);
std::vector<std::string> comma_list(const std::string& option, const std::string& text);  // a,b,c

// The value that is given as an option or as an argument; "" if neither. Throws if both are.
std::string once(const std::string& option, const std::string& argument);

// The value of an option that may be repeated, but not here; "" if it is not given.
std::string only(const std::string& option, const std::vector<std::string>& texts);

// The words of the command line, the last one first. An option whose value is optional takes it
// only behind "=": a bare one gets "-". An empty value would make CLI11 take the next word.
std::vector<std::string> command_words(const std::vector<std::string>& given);

std::map<std::string, std::string> settings(const std::vector<std::string>& texts);

// The limits in $SIM_LUA_BUDGET, which those in --lua-budget override:
// "time=60,memory=4096,steps=1e9", each if it is there.
LuaLimits lua_limits(const std::string& option, bool safe = false);

// Reads --threads: a number, or auto.
Threads threads_of(const std::string& text);

// Reads --progress: auto, on or off.
ShowProgress show_progress(const std::string& text);

}  // namespace sim::cli
