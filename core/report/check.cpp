#include "core/report/check.h"

#include <cmath>

#include "core/base/error.h"
#include "core/output/format.h"

namespace sim::report {
namespace {

// "1%" or "0.01".
double share(const std::string& option, const std::string& text) {
  const bool percent = text.ends_with('%');
  const auto value = parse_number(percent ? text.substr(0, text.size() - 1) : text);
  if (!value || !(*value >= 0))
    throw Error(ErrorKind::kUsage, {"bad value", option + " '" + text + "'",
                                    "expected a share of 0 or more", "write it like 1% or 0.01"});
  return percent ? *value / 100 : *value;
}

// `unknown`: the reason why there may be nothing to check.
void hold(const std::string& name, const std::optional<double>& limit, double value,
          const std::string& system, const std::string& unknown, const std::string& remedy) {
  if (!limit || value <= *limit) return;
  const std::string allowed = percent(*limit, 1, 4);
  throw Error(ErrorKind::kCheck,
              {"check failed", system + ", " + name,
               std::isnan(value) ? "there is nothing to check: " + unknown
                                 : percent(value, 1, 4) + " is above " + allowed,
               std::isnan(value) ? "leave " + name + " out of --check" : remedy});
}

}  // namespace

Checks parse_checks(const std::string& option, const std::string& text) {
  Checks checks;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    const std::string entry = text.substr(begin, end - begin);
    const std::size_t equals = entry.find('=');
    const std::string name = entry.substr(0, equals);
    begin = end + 1;
    if (entry == "verified") {
      checks.verified = true;
      continue;
    }
    std::optional<double>* const limit = name == "energy"   ? &checks.energy
                                         : name == "strain" ? &checks.strain
                                         : name == "dt"     ? &checks.dt
                                                            : nullptr;
    if (!limit || equals == std::string::npos)
      throw Error(ErrorKind::kUsage, {"bad value", option + " '" + entry + "'",
                                      "it is none of verified, energy=, strain= and dt=",
                                      "write it like verified,energy=1%,dt=90%"});
    if (*limit)
      throw Error(ErrorKind::kUsage, {"bad value", option + " '" + text + "'",
                                      "'" + name + "' is listed twice", "keep one of them"});
    *limit = share(option, entry.substr(equals + 1));
  }
  return checks;
}

void check(const Checks& checks, const study::Verdict& verdict, const std::string& system) {
  constexpr const char* kSmaller = "take a smaller --dt";
  const study::Figures& figures = verdict.figures;
  if (checks.verified && verdict.trust != study::Trust::kTrusted)
    throw Error(
        ErrorKind::kCheck,
        {"check failed", system + ", verified",
         std::string("the run is ") + study::trust_name(verdict.trust) + ": " + verdict.reason,
         verdict.trust == study::Trust::kUnverified ? "add --verify" : kSmaller});
  hold("energy", checks.energy, figures.energy, system,
       "not all that changes the energy of this system is known", kSmaller);
  const double strain = figures.strain.a < 0 ? std::nan("") : std::abs(figures.strain.strain);
  hold("strain", checks.strain, strain, system, "the system has no springs with a length",
       "take stiffer springs or smaller loads");
  hold("dt", checks.dt, figures.dt_share, system,
       "the method chooses its own steps, or its limit is not known", kSmaller);
}

}  // namespace sim::report
