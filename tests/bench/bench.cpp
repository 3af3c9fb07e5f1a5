// sim_bench: speed of the kernel, against the limits of the machine and against its peers.
#include <cstdlib>
#include <exception>
#include <iostream>
#include <vector>

#include "core/base/error.h"
#include "core/base/text.h"
#include "core/simd/simd_targets.h"
#include "tests/bench/body_peers.h"
#include "tests/bench/cloth.h"
#include "tests/bench/field_peers.h"
#include "tests/bench/implicit.h"
#include "tests/bench/kernel.h"
#include "tests/bench/machine.h"
#include "tests/bench/many.h"
#include "tests/bench/memory.h"
#include "tests/bench/options.h"
#include "tests/bench/peer_build.h"
#include "tests/bench/peers.h"
#include "tests/bench/reach.h"
#include "tests/bench/solid_steps.h"
#include "tests/bench/ways.h"

namespace sim_bench {
namespace {

Table machine_table(const Machine& m) {
  Table table(
      "machine",
      "The machine: " + m.processor + ", " + std::to_string(m.cores) + " cores, with " + m.vector,
      {{"measured on one core", "what", false}, {"value", "value"}, {"unit", "unit", false}});
  table.add({"clock, from dependent multiplications", short_number(m.ghz), "GHz"});
  table.add({"multiplications and additions, doubles", short_number(m.flops_per_ns), "a ns"});
  table.add({"vectors of them a cycle", short_number(m.flops_per_ns / m.lanes / m.ghz),
             "of " + std::to_string(m.lanes) + " doubles"});
  table.add({"square root and division, doubles", short_number(m.double_root_ns), "ns a pair"});
  table.add({"square root and division, floats", short_number(m.single_root_ns), "ns a pair"});
  table.add({"limit of a spring evaluation", short_number(m.spring_limit_ns()), "ns"});
  for (const Bandwidth& b : m.triad)
    table.add({"triad, " + b.level + ", " + short_number(b.kib) + " KiB", short_number(b.gb_per_s),
               "GB/s"});
  table.note("load average at the start: " + short_number(m.load) +
             (m.load > 0.5 ? "; the machine is not idle, so do not trust the times" : ""));
  table.note(
      "limit: 35 operations on doubles, or a square root and a division in floats, whichever "
      "takes longer; the rate is the measured one of multiplications and additions, half each.");
  return table;
}

class Printer {
 public:
  explicit Printer(Format format) : format_(format) {
    if (format_ == Format::kJson) std::cout << "{";
    if (format_ == Format::kMarkdown)
      std::cout << "# Results of the benchmark\n\nPrinted by `./dev bench --peers --markdown`.\n\n";
  }
  ~Printer() {
    if (format_ == Format::kJson) std::cout << "}\n";
  }
  Printer(const Printer&) = delete;
  Printer& operator=(const Printer&) = delete;

  void print(const Table& table) {
    if (table.empty()) return;
    if (format_ == Format::kJson) std::cout << (first_ ? "" : ",\n ") << table.json();
    if (format_ == Format::kText) std::cout << (first_ ? "" : "\n") << table.text();
    if (format_ == Format::kMarkdown) std::cout << (first_ ? "" : "\n") << table.markdown();
    std::cout.flush();
    first_ = false;
  }

 private:
  Format format_;
  bool first_ = true;
};

int print_fields(const Options& options, sim::Registry& registry, Printer& printer) {
  std::vector<std::string> notes;
  const FieldReport report = measure_fields(options, registry, notes);
  printer.print(field_ratio_table(report));
  printer.print(field_front_table(report));
  printer.print(field_speed_table(report));
  const std::string folder =
      options.charts.empty() ? (peer_folder() / "charts").string() : options.charts;
  write_field_charts(report, folder);
  notes.push_back("the charts are in " + folder);
  for (const std::string& note : notes) std::cerr << "bench: " << note << "\n";
  return 0;
}

int run(int argc, char** argv) {
  const Options options = parse_options(argc, argv);
  if (options.help) {
    std::cout << kUsage;
    return 0;
  }
  if (!options.simd.empty()) setenv("SIM_SIMD", options.simd.c_str(), 1);
  if (!options.memory_of.empty()) return print_memory(options.sizes.front(), options.memory_of);

  sim::Registry registry = make_registry();
  choose_integrators(options, registry);  // a wrong name is told before anything is measured
  Printer printer(options.format);
  if (options.only_fields) return print_fields(options, registry, printer);
  std::cerr << "bench: the machine\n";
  const Machine machine = measure_machine();
  printer.print(machine_table(machine));
  if (options.only_implicit) {
    printer.print(implicit_table(measure_implicit(options, registry)));
    return 0;
  }
  if (options.only_solids) {
    printer.print(solid_step_table(measure_solid_steps(options, registry)));
    return 0;
  }
  if (options.only_ways) {
    printer.print(way_table(measure_ways(options, registry)));
    return 0;
  }
  if (options.only_contact || options.only_fluid || options.only_bodies) {
    std::vector<std::string> notes;
    std::vector<PeerKind> peers;
    if (options.only_contact || options.only_bodies)
      peers = build_peers(options.simd, notes, PeersOf::kContact);
    if (options.only_contact)
      printer.print(contact_table(measure_contact(peers, options, registry)));
    if (options.only_bodies) {
      printer.print(pile_table(measure_piles(peers, options, registry)));
      printer.print(many_table(measure_many(options, registry)));
    }
    if (options.only_fluid) printer.print(fluid_table(measure_fluid(options, registry, notes)));
    for (const std::string& note : notes) std::cerr << "bench: " << note << "\n";
    return 0;
  }
  std::cerr << "bench: the kernel\n";
  const std::vector<KernelResult> kernel = measure_kernel(options, registry);
  printer.print(kernel_table(kernel, machine));
  std::cerr << "bench: springs given in other ways\n";
  const std::vector<Variation> variations = measure_variations(options, registry);
  printer.print(variation_table(variations));
  std::cerr << "bench: implicit steps\n";
  printer.print(implicit_table(measure_implicit(options, registry)));
  PeerReport peers;
  if (options.peers) {
    peers = measure_peers(options, registry);
    printer.print(peer_table(peers));
    printer.print(contact_table(peers.contact));
    printer.print(fluid_table(peers.fluid));
  }
  printer.print(reach_table(kernel, variations, peers));
  if (all_agree(peers)) return 0;
  std::cerr << "bench: a peer and the kernel do not agree\n";
  return static_cast<int>(sim::ErrorKind::kCheck);
}

}  // namespace
}  // namespace sim_bench

int main(int argc, char** argv) {
  try {
    return sim_bench::run(argc, argv);
  } catch (const sim::Error& error) {
    std::cerr << "sim: error: " << error.what() << "\n";
    return static_cast<int>(error.kind());
  } catch (const std::exception& error) {
    std::cerr << "sim: error: " << error.what() << "\n";
    return 1;
  }
}
