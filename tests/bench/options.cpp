#include "tests/bench/options.h"

#include <string_view>

#include "core/base/error.h"
#include "core/base/text.h"
#include "core/simd/simd_targets.h"

namespace sim_bench {

const char* const kUsage =
    "sim_bench [options]    speed of the kernel on the cloth, against the machine and its peers\n"
    "  --n 8,32,...         particles a side (8,32,128,512,1024)\n"
    "  --integrators a,b    which ones, with parameters as for sim -i (euler, trapezoid, rk4,\n"
    "                       symplectic_euler, verlet; rk4 and verlet in single precision too)\n"
    "  --threads 1,2        numbers of threads (1,2)\n"
    "  --quick              n = 8,32,128 and shorter samples\n"
    "  --implicit           only the table of implicit steps\n"
    "  --solids             only implicit steps of an elastic beam against a factorisation;\n"
    "                       --quick: without 100000 nodes\n"
    "  --contact            only the table of contact against its peers\n"
    "  --fluid              only the table of a fluid against its peer\n"
    "  --fields             only first-order systems: time to accuracy against SUNDIALS and "
    "odeint,\n"
    "                       and a chart of each problem\n"
    "  --charts FOLDER      where those charts go (build/peers/charts)\n"
    "  --bodies             only piles of boxes against their peer, and scenes of many bodies and\n"
    "                       rods\n"
    "  --ways               only scenes in more than one way: stiff parts, sleep, formulas,\n"
    "                       threads\n"
    "  --only WORD          of --fields, --bodies and --ways, the ones whose names hold it\n"
    "  --peers              also build and time other programs on the same scene\n"
    "  --simd sse2|fma|avx2|avx512    kernel and peers with that instruction set (the best here)\n"
    "  --json, --markdown   the same tables in another form\n";

namespace {

[[noreturn]] void fail(const std::string& what, const std::string& why) {
  throw sim::Error(sim::ErrorKind::kUsage, {what, "on the command line", why, "see --help"});
}

std::vector<std::string> split(const std::string& option, std::string_view text) {
  std::vector<std::string> parts;
  for (;;) {
    const auto comma = text.find(',');
    parts.emplace_back(text.substr(0, comma));
    if (parts.back().empty()) fail(option, "an empty entry in its list");
    if (comma == std::string_view::npos) return parts;
    text.remove_prefix(comma + 1);
  }
}

std::vector<int> split_integers(const std::string& option, const std::string& text, int least,
                                int most) {
  std::vector<int> numbers;
  for (const std::string& part : split(option, text)) {
    const auto number = sim::parse_integer(part);
    if (!number || *number < least || *number > most)
      fail(option, "'" + part + "' is not a whole number from " + std::to_string(least) + " to " +
                       std::to_string(most));
    numbers.push_back(static_cast<int>(*number));
  }
  return numbers;
}

std::string simd_of(const std::string& option, const std::string& name) {
  std::vector<std::string> names;
  for (const sim::SimdLevel level : sim::simd_levels()) {
    names.emplace_back(sim::simd_name(level));
    if (names.back() == name) return name;
  }
  fail(option, "'" + name + "' is none of this machine's: " + sim::join(names, ", "));
}

}  // namespace

Options parse_options(int argc, char** argv) {
  constexpr int kMostSide = 4096, kMostThreads = 256;
  Options options;
  for (int i = 1; i < argc; ++i) {
    const std::string argument = argv[i];
    const auto value = [&]() -> std::string {
      if (++i >= argc) fail(argument, "it needs a value");
      return argv[i];
    };
    if (argument == "--json")
      options.format = Format::kJson;
    else if (argument == "--markdown")
      options.format = Format::kMarkdown;
    else if (argument == "--implicit")
      options.only_implicit = true;
    else if (argument == "--solids")
      options.only_solids = true;
    else if (argument == "--contact")
      options.only_contact = true;
    else if (argument == "--fluid")
      options.only_fluid = true;
    else if (argument == "--fields")
      options.only_fields = true;
    else if (argument == "--only")
      options.only = value();
    else if (argument == "--charts")
      options.charts = value();
    else if (argument == "--bodies")
      options.only_bodies = true;
    else if (argument == "--ways")
      options.only_ways = true;
    else if (argument == "--peers")
      options.peers = true;
    else if (argument == "--simd")
      options.simd = simd_of(argument, value());
    else if (argument == "--help" || argument == "-h")
      options.help = true;
    else if (argument == "--n")
      options.sizes = split_integers(argument, value(), 3, kMostSide);
    else if (argument == "--threads")
      options.threads = split_integers(argument, value(), 1, kMostThreads);
    else if (argument == "--integrators")
      options.integrators = sim::cli::parse_integrators(argument, value());
    else if (argument == "--quick") {
      options.quick = true;
      options.sizes = {8, 32, 128};
      options.timing = {.repeats = 5, .seconds = 0.03};
    } else if (argument == "--memory-of") {
      options.sizes = split_integers(argument, value(), 3, kMostSide);
      options.memory_of = value();
    } else
      fail("unknown option '" + argument + "'", "it is not one of sim_bench");
  }
  return options;
}

}  // namespace sim_bench
