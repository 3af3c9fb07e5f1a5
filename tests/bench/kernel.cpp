#include "tests/bench/kernel.h"

#include <algorithm>

#include "core/base/error.h"
#include "core/geometry/triangle_mesh.h"
#include "tests/bench/cloth.h"
#include "tests/bench/memory.h"
#include "tests/support/allocations.h"

namespace sim_bench {

using sim::MethodChoice;

namespace {

// Below this, a few pages more or less would decide the bytes a particle.
constexpr int kLeastSideForMemory = 128;

// Takes steps like a run that nobody observes.
void take_steps(sim::Simulation& simulation, long count) {
  while (count > 0) {
    const int taken = simulation.steps(count);
    if (taken == 0)
      throw sim::Error(sim::ErrorKind::kDiverged,
                       {"the cloth left the finite numbers", simulation.method().name(),
                        "step " + std::to_string(simulation.divergence().step), ""});
    count -= taken;
  }
}

double allocations_a_step(sim::Simulation& simulation) {
  constexpr int kSteps = 20;
  const std::size_t before = sim_test::allocation_count();
  take_steps(simulation, kSteps);
  return static_cast<double>(sim_test::allocation_count() - before) / kSteps;
}

std::string percent(double part) { return short_number(100 * part); }

// All integrators and numbers of threads at one size, in turns.
void measure_size(int n, const Options& options, sim::Registry& registry,
                  const std::vector<MethodChoice>& integrators,
                  std::vector<KernelResult>& results) {
  const sim::SystemSpec spec = load_cloth(n, registry);
  std::vector<sim::Simulation> simulations;
  const std::size_t first = results.size();
  for (const MethodChoice& integrator : integrators)
    for (const int threads : options.threads) {
      sim::RunOptions run = run_options(integrator, n, registry);
      run.threads = threads;
      simulations.emplace_back(spec, registry, run);
      KernelResult& r = results.emplace_back();
      r.n = n;
      r.integrator = simulations.back().method().label();
      r.threads = threads;
      const sim::IntegratorInfo info = simulations.back().integrator_info();
      r.evaluations = std::max(1, info.evaluations);
      r.in_double = info.precision == sim::Precision::kDouble;
      r.springs = count_springs(spec);
    }

  std::vector<Contestant> contestants;
  for (sim::Simulation& simulation : simulations) contestants.push_back(contestant(simulation));
  const std::vector<Times> times = measure(contestants, options.timing);
  for (std::size_t i = 0; i < times.size(); ++i) {
    results[first + i].times = times[i];
    results[first + i].allocations = allocations_a_step(simulations[i]);
  }
  simulations.clear();

  if (n < kLeastSideForMemory) return;
  for (std::size_t i = first; i < results.size(); ++i) {
    if (results[i].threads != options.threads.front()) continue;
    const MemoryUse use = measure_memory(n, results[i].integrator);
    results[i].bytes = use.resident / results[i].particles();
    results[i].peak_bytes = use.peak / results[i].particles();
  }
}

}  // namespace

Contestant contestant(sim::Simulation& simulation) {
  return {[&simulation](long count) {
    const double start = seconds_now();
    take_steps(simulation, count);
    return seconds_now() - start;
  }};
}

std::vector<MethodChoice> choose_integrators(const Options& options, sim::Registry& registry) {
  const std::vector<std::string> known = registry.names<sim::Integrator>();
  if (options.integrators.empty()) {
    std::vector<MethodChoice> chosen;
    for (const std::string name : {"euler", "trapezoid", "rk4", "symplectic_euler", "verlet"})
      if (std::find(known.begin(), known.end(), name) != known.end()) {
        chosen.push_back(name);
        if (name == "rk4" || name == "verlet")
          chosen.push_back({name, {{"precision", std::string("single")}}});
      }
    return chosen;
  }
  for (const MethodChoice& integrator : options.integrators) run_options(integrator, 3, registry);
  return options.integrators;
}

std::vector<KernelResult> measure_kernel(const Options& options, sim::Registry& registry) {
  const std::vector<MethodChoice> integrators = choose_integrators(options, registry);
  std::vector<KernelResult> results;
  for (const int n : options.sizes) measure_size(n, options, registry, integrators, results);
  return results;
}

Table kernel_table(const std::vector<KernelResult>& results, const Machine& machine) {
  Table table("kernel", "n x n cloth of scenes/cloth.lua",
              {{"n", "n"},
               {"integrator", "integrator", false},
               {"threads", "threads"},
               {"us/step", "us_per_step"},
               {"min", "us_min"},
               {"max", "us_max"},
               {"ns/spring", "ns_per_spring"},
               {"M/s", "million_particle_steps_per_s"},
               {"% limit", "percent_of_limit"},
               {"allocs", "allocations_per_step"},
               {"B/p", "bytes_per_particle"},
               {"peak", "peak_bytes_per_particle"}});
  for (const KernelResult& r : results) {
    const double limit = machine.spring_limit_ns() / std::min(r.threads, machine.cores);
    table.add({std::to_string(r.n), r.integrator, std::to_string(r.threads),
               short_number(r.times.median * 1e6), short_number(r.times.least * 1e6),
               short_number(r.times.most * 1e6), short_number(r.spring_ns()),
               short_number(r.million_steps()), r.in_double ? percent(limit / r.spring_ns()) : "",
               short_number(r.allocations), r.bytes > 0 ? short_number(r.bytes) : "",
               r.bytes > 0 ? short_number(r.peak_bytes) : ""});
  }
  table.note(
      "us/step: the median, with the least and the most, as many steps at once as the method "
      "takes; ns/spring: of one evaluation; "
      "M/s: million particle-steps a second; allocs: allocations a step.");
  table.note(
      "% limit: " + short_number(machine.spring_limit_ns()) +
      " ns a spring a core in double precision, over the threads asked for, against ns/spring.");
  table.note(
      "B/p: bytes a particle that compiling the scene and four steps add to the process, all "
      "arrays and spring runs; peak: with what compiling needs for a while. The scene as "
      "plain data comes before that and is not in it. Measured in a process of its own.");
  return table;
}

sim::SystemSpec with_sphere(sim::SystemSpec cloth, double gap, double friction) {
  constexpr double kRadius = 0.4;
  sim::PartSpec sphere;
  sphere.plugin = "sphere";
  const double height = gap < 0 ? kRadius - gap : -kRadius - gap;
  sphere.given = {
      {"radius", kRadius}, {"center", sim::Vec3(0.5, height, 0.5)}, {"friction", friction}};
  cloth.colliders = {sphere};
  return cloth;
}

namespace {

// The cloth as it lies on the ground with all of it.
sim::SystemSpec on_plane(sim::SystemSpec cloth) {
  sim::PartSpec plane;
  plane.plugin = "plane";
  cloth.colliders = {plane};
  return cloth;
}

// In a wind, without a breeze.
sim::SystemSpec in_wind(sim::SystemSpec cloth, int n) {
  sim::PartSpec wind;
  wind.plugin = "wind";
  wind.given = {{"velocity", sim::Vec3(1.5, 0, 0)},
                {"surface", std::make_shared<const sim::TriangleMesh>(
                                n * n, sim::grid_triangles({n, n, 1}, false))}};
  cloth.forces.push_back(wind);
  return cloth;
}

}  // namespace

std::vector<Variation> measure_variations(const Options& options, sim::Registry& registry) {
  constexpr int kSide = 128;
  const sim::SystemSpec cloth = load_cloth(kSide, registry);
  const sim::SystemSpec plain = tied_cloth(cloth, Ties::kPlain);
  const sim::SystemSpec fused = springs_only(plain);
  struct Entry {
    std::string name, meaning;
    sim::SystemSpec spec;
    int side = kSide;
    std::string integrator = "rk4";
  };
  constexpr int kLargeSide = 512;
  const sim::SystemSpec large = tied_cloth(load_cloth(kLargeSide, registry), Ties::kShuffled);
  const std::vector<Entry> entries = {
      {"cloth", "gravity, drag, three forces over the grid", cloth},
      {"springs", "the three forces alone", springs_only(cloth)},
      {"fused", "the same springs in one list, alone", fused},
      {"fused + affine", "the list, gravity, drag", plain},
      {"jittered", "every rest length its own, gravity, drag", tied_cloth(cloth, Ties::kJittered)},
      {"random net", "renumbered at random, gravity, drag", tied_cloth(cloth, Ties::kShuffled)},
      {"large net", "512 x 512, renumbered at random, gravity, drag", large, kLargeSide},
      {"near a sphere", "the cloth, and a sphere that it does not touch",
       with_sphere(cloth, -0.1, 0)},
      {"on a sphere", "the cloth falls on a sphere and lies there", with_sphere(cloth, 0.001, 0.5)},
      {"verlet", "the cloth with verlet", cloth, kSide, "verlet"},
      {"verlet, near", "verlet, and a sphere that the cloth does not touch",
       with_sphere(cloth, -0.1, 0), kSide, "verlet"},
      {"verlet, on", "verlet, and a sphere that the cloth lies on", with_sphere(cloth, 0.001, 0.5),
       kSide, "verlet"},
      {"on a plane", "the cloth lies on a plane with all of it", on_plane(cloth)},
      {"verlet, on a plane", "the same with verlet", on_plane(cloth), kSide, "verlet"},
      {"wind", "wind on its surface, without a breeze", in_wind(cloth, kSide)},
  };

  std::vector<sim::Simulation> simulations;
  for (const Entry& entry : entries)
    simulations.emplace_back(entry.spec, registry,
                             run_options(entry.integrator, entry.side, registry));
  std::vector<Contestant> contestants;
  for (sim::Simulation& simulation : simulations) contestants.push_back(contestant(simulation));
  const std::vector<Times> times = measure(contestants, options.timing);

  std::vector<Variation> variations;
  for (std::size_t i = 0; i < entries.size(); ++i) {
    const auto springs = static_cast<double>(count_springs(entries[i].spec));
    const int evaluations = entries[i].integrator == "rk4" ? 4 : 1;
    variations.push_back({entries[i].name, entries[i].meaning, times[i],
                          times[i].median * 1e9 / springs / evaluations});
  }
  return variations;
}

Table variation_table(const std::vector<Variation>& variations) {
  Table table("variations", "128 x 128 cloth given in other ways, rk4 unless said, one thread",
              {{"springs", "name", false},
               {"us/step", "us_per_step"},
               {"min", "us_min"},
               {"max", "us_max"},
               {"ns/spring", "ns_per_spring"},
               {"what it is", "meaning", false}});
  for (const Variation& v : variations)
    table.add({v.name, short_number(v.times.median * 1e6), short_number(v.times.least * 1e6),
               short_number(v.times.most * 1e6), short_number(v.spring_ns), v.meaning});
  const double all = variations[0].times.median, alone = variations[2].times.median;
  table.note("Five forces against one: cloth takes " + short_number(100 * (all / alone - 1)) +
             " % more time than fused.");
  const auto more = [&](std::size_t with, std::size_t without) {
    return short_number(100 *
                        (variations[with].times.median / variations[without].times.median - 1));
  };
  table.note("A sphere that is not touched takes " + more(7, 0) + " % more time of rk4 and " +
             more(10, 9) + " % of verlet, one that the cloth lies on " + more(8, 0) + " % and " +
             more(11, 9) + " %; a plane under all of it " + more(12, 0) + " % and " + more(13, 9) +
             " %; wind on its surface " + more(14, 0) + " % of rk4.");
  return table;
}

}  // namespace sim_bench
