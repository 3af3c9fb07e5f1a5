// Thresholds of the verdict: what is found just below and just above each.
#include <catch2/catch.hpp>
#include <cmath>

#include "core/base/text.h"
#include "core/report/goal_report.h"
#include "core/study/verdict/criterion.h"
#include "tests/lua/scene_text.h"
#include "tests/support/scenes.h"

using namespace sim;
using namespace sim::study;
using sim_test::make_registry;
using Outcome = RunDeviation::Outcome;

namespace {

bool found(const Finding& finding, Trust trust, const std::string& words) {
  INFO(trust_name(finding.trust) << ": " << finding.words);
  CHECK(finding.trust == trust);
  CHECK(finding.words == words);
  return finding.trust == trust && finding.words == words;
}

Finding conclusion(Criterion& criterion) {
  Figures figures;
  std::vector<Finding> findings;
  criterion.conclude(figures, findings);
  return findings.empty() ? Finding() : findings.back();
}

}  // namespace

TEST_CASE("a deviation is right up to 2 % of the size and 1 % of the energy") {
  Registry registry = make_registry();
  const Simulation points(sim_test::make_falling(1, 0), registry);
  const SystemSpec numbers = test::load_text(
                                 "return sim.scene { state = {1}, dt = 0.5, duration = 2,\n"
                                 "  field = sim.field.formula { '-x', names = {'x'} },\n"
                                 "  integrator = 'rk4' }")
                                 .systems[0];
  const Simulation flat(numbers, registry);
  const RunDeviation good{.outcome = Outcome::kCompared,
                          .error = 0.0123,
                          .at_end = 0.01,
                          .share = 0.02,
                          .energy = 0.01,
                          .growth = 50};
  const auto changed = [&](auto change) {
    RunDeviation deviation = good;
    change(deviation);
    return finding_of(deviation, points);
  };
  CHECK(found(finding_of({}, points), Trust::kTrusted, ""));
  CHECK(found(finding_of(good, points), Trust::kTrusted, "positions to 0.01 m (verified)"));
  CHECK(found(finding_of(good, flat), Trust::kTrusted, "numbers to 0.01 (verified)"));
  CHECK(found(changed([](RunDeviation& d) { d.rms = 0.0012; }), Trust::kTrusted,
              "positions to 0.0012 m rms, 0.01 m of a particle (verified)"));
  CHECK(found(changed([](RunDeviation& d) { d.until = 3.25; }), Trust::kTrusted,
              "positions to 0.01 m until t = 3.2 s (verified)"));
  CHECK(found(changed([](RunDeviation& d) { d.energy = 0.0101; }), Trust::kSuspect,
              "energy off by 1 %"));
  CHECK(found(changed([](RunDeviation& d) { d.share = 0.0201; }), Trust::kSuspect,
              "off by about 1 cm by the end, 2 % of the size"));
  CHECK(found(changed([](RunDeviation& d) { d.share = std::nan(""); }), Trust::kSuspect,
              "off by about 1 cm by the end, nan % of the size"));
  // An error that was asked for is judged by the largest rms, as asked.
  const sim::study::GoalChoice asked{.size = 2, .allowed = 0.1, .error = 0.06, .largest = 0.3};
  const auto judged = [&](double allowed) {
    sim::study::GoalChoice choice = asked;
    choice.allowed = allowed;
    choice.kept = choice.error <= allowed;
    return finding_of(sim::report::goal_deviation(choice, ""), points);
  };
  CHECK(found(judged(0.1), Trust::kTrusted,
              "positions to 0.06 m rms, 0.3 m of a particle (verified)"));
  CHECK(found(judged(0.05), Trust::kTrusted, ""));  // not kept: it is verified by itself
  // By the end: at least half of the largest.
  CHECK(found(changed([](RunDeviation& d) { d.share = 0.5, d.error = 0.02; }), Trust::kSuspect,
              "off by about 1 cm by the end, 50 % of the size"));
  CHECK(found(changed([](RunDeviation& d) { d.share = 0.5, d.error = 0.0201; }), Trust::kSuspect,
              "off by up to 2 cm on the way, 50 % of the size"));
  CHECK(found(changed([](RunDeviation& d) { d.share = 0.5, d.until = 3; }), Trust::kSuspect,
              "off by about 1 cm at t = 3 s already, 50 % of the size"));
  // Centimetres from 1 mm up to 10 cm.
  for (const auto& [length, words] :
       {std::pair(0.0999, "10 cm"), {0.1, "0.1 m"}, {1e-3, "0.1 cm"}, {0.99e-3, "0.00099 m"}})
    CHECK(found(
        changed([&, most = length](RunDeviation& d) { d.share = 0.5, d.error = d.at_end = most; }),
        Trust::kSuspect, "off by about " + std::string(words) + " by the end, 50 % of the size"));

  // Neighbours that part by 1e5 are chaos; only where 1e-7 has grown to 2 % is it the positions'.
  const auto parts = [&](double growth, double share) {
    return changed(
        [&](RunDeviation& d) { d.growth = growth, d.share = share, d.rate = 30, d.horizon = 1.5; });
  };
  const std::string chaos =
      "positions are right until about t = 1.5 s (neighbours part by x30 a second)";
  CHECK(found(parts(1e5, 0.5), Trust::kSuspect, "off by about 1 cm by the end, 50 % of the size"));
  CHECK(found(parts(1.01e5, 0.5), Trust::kChaotic, chaos));
  CHECK(found(parts(2.01e5, 0.01), Trust::kChaotic, chaos));
  CHECK(found(parts(1.99e5, 0.01), Trust::kTrusted, "positions to 0.01 m (verified)"));
  CHECK(found(changed([](RunDeviation& d) { d.growth = 1e9, d.rate = 1e5, d.horizon = 1.5; }),
              Trust::kChaotic,
              "positions are right until about t = 1.5 s (neighbours part tenfold within 0.2 s)"));

  CHECK(found(changed([](RunDeviation& d) { d.missed_at = 0.5; }), Trust::kSuspect,
              "a force has a pulse near t = 0.5 s that no step has seen"));
  RunDeviation missed = good;
  missed.missed_at = 0.5;
  CHECK(found(finding_of(missed, flat), Trust::kSuspect,
              "the right-hand side has a pulse near t = 0.5 s that no step has seen"));
  CHECK(found(changed([](RunDeviation& d) { d.others_broke_at = 1, d.horizon = 0.75; }),
              Trust::kChaotic,
              "positions are right until about t = 0.75 s (with a finer step other springs or rods "
              "break)"));
  CHECK(found(changed([](RunDeviation& d) { d.pinched_at = 1, d.pinch.a = 3, d.pinch.b = 8; }),
              Trust::kChaotic,
              "positions are right until about t = 1 s (spring 3-8 comes to a point there, and may "
              "leave it on either side)"));
  CHECK(found(changed([](RunDeviation& d) { d.outcome = Outcome::kShadowFailed; }), Trust::kSuspect,
              "the same run with half the step or a tenth of the tolerance fails"));
  CHECK(
      found(changed([](RunDeviation& d) { d.outcome = Outcome::kStopped; }), Trust::kTrusted, ""));
  CHECK(found(changed([](RunDeviation& d) { d.outcome = Outcome::kStopped, d.until = 2; }),
              Trust::kTrusted, "positions to 0.01 m until t = 2 s (verified)"));
}

TEST_CASE("samples are spread over a run, the first after its first step") {
  const auto taken = [](std::int64_t steps, int times, int stride = 1) {
    Spread spread(steps, times);
    std::vector<std::int64_t> at;
    for (std::int64_t step = 0; step <= steps; step += stride)
      if (spread.take(step)) {
        at.push_back(step);
        CHECK(spread.last() == step);
      }
    return at;
  };
  using Steps = std::vector<std::int64_t>;
  CHECK(taken(12, 3) == Steps{1, 5, 9});
  CHECK(taken(12, 1) == Steps{1});
  CHECK(taken(13, 3) == Steps{1, 5, 9, 13});
  CHECK(taken(3, 12) == Steps{1, 2, 3});
  CHECK(taken(12, 0).empty());
  CHECK(taken(0, 3).empty());
  CHECK(taken(12, 3, 3) == Steps{3, 9});
  CHECK(Spread(5, 2).last() == -1);
}

TEST_CASE("an exact solution may be missed by 1 % of its size, at any look") {
  Registry registry = make_registry();
  for (const auto& [share, trust] :
       {std::pair(0.0099, Trust::kTrusted), {0.0101, Trust::kSuspect}}) {
    SystemSpec spec = sim_test::make_circle();
    double off = 0;  // of a solution of size 4
    spec.exact = [&](double) { return std::vector<double>{4 + off, 0, 0}; };
    Simulation system(spec, registry);
    system.set_position(0, {4, 0, 0});
    const auto criterion = watch_exact({spec, system, 10, nullptr, nullptr});
    REQUIRE(criterion);
    criterion->look(nullptr);
    CHECK(
        found(conclusion(*criterion), Trust::kTrusted, "largest error 0 of a solution of size 4"));
    off = -4 * share / (1 + share);  // below: the size is 4 all the same
    criterion->look(nullptr);
    off = 0;
    criterion->look(nullptr);
    CHECK(conclusion(*criterion).trust ==
          (4 * share / (1 + share) <= 0.04 ? Trust::kTrusted : trust));
    off = 4 * share / (1 - share);  // above: its size grows with it
    criterion->look(nullptr);
    CHECK(conclusion(*criterion).trust == trust);
    off = std::nan("");
    criterion->look(nullptr);
    CHECK(conclusion(*criterion).trust == Trust::kSuspect);
  }
  SystemSpec spec = sim_test::make_circle();
  spec.exact = [](double) { return std::vector<double>{1, 0}; };  // of another system
  Simulation system(spec, registry);
  const auto criterion = watch_exact({spec, system, 10, nullptr, nullptr});
  criterion->look(nullptr);
  CHECK(conclusion(*criterion).trust == Trust::kSuspect);
}

// Twelve looks of a long run, each at all springs; what other states showed counts where it is
// more.
TEST_CASE("the worst strain is that of any look or of the states between") {
  Registry registry = make_registry();
  const SystemSpec spec = sim_test::make_row();  // springs of 1 m at rest
  const auto told = [&](std::int64_t steps, int stretched_at, double strain_between) {
    Simulation system(spec, registry, {.integrator = "rk4", .dt = 0.001});
    const auto criterion = watch_strain({spec, system, steps, nullptr, nullptr});
    REQUIRE(criterion);
    for (int step = 1; step <= stretched_at + 1; ++step) {
      REQUIRE(system.step());
      const Snapshot before = system.snapshot();
      const Vec3 x = system.position(9);
      if (step == stretched_at) system.set_position(9, x + Vec3(0.25, 0, 0));
      criterion->look(nullptr);
      if (step == stretched_at) system.restore(before);
    }
    Figures figures;
    figures.strain.strain = strain_between;
    if (strain_between != 0) figures.strain.a = 1, figures.strain.b = 2;
    std::vector<Finding> findings;
    criterion->conclude(figures, findings);
    if (findings.empty()) return 0.0;  // nothing is strained
    CHECK(findings[0].trust == Trust::kTrusted);
    CHECK(findings[0].words == "strain " + percent(figures.strain.strain, 1, 2));
    return figures.strain.strain;
  };
  // Four evaluations a step, one look for 130 of them: 1300 / 12 = 108 steps apart.
  CHECK(std::abs(told(1300, 109, 0)) == Approx(0.25));
  CHECK(std::abs(told(1300, 108, 0)) < 1e-9);
  CHECK(std::abs(told(1300, 1, 0)) == Approx(0.25));
  CHECK(std::abs(told(66, 34, 0)) == Approx(0.25));  // two looks
  CHECK(std::abs(told(64, 34, 0)) < 1e-9);
  CHECK(std::abs(told(1300, 109, 0.2)) == Approx(0.25));
  CHECK(told(1300, 109, 0.3) == 0.3);
  CHECK(told(1300, 109, -0.3) == -0.3);
}

// A cube of cells, stretched evenly: its volumes and stretches are the factors.
TEST_CASE("cells may be pressed to a tenth of their volume and a fifth of their thickness") {
  Registry registry = make_registry();
  const SystemSpec spec =
      test::load_text(
          "local bar = sim.grid { 3, 3, 3, du = {1, 0, 0}, dv = {0, 1, 0}, dw = {0, 0, 1} }\n"
          "return sim.scene { particles = bar, dt = 1e-4, forces = { sim.force.fem {\n"
          "  cells = sim.cells { grid = bar }, young = 1e5, poisson = 0.3, density = 900 } },\n"
          "  integrator = 'verlet', duration = 1 }")
          .systems[0];
  const auto judged = [&](const Vec3& factors, double corner, Figures& figures) {
    Simulation system(spec, registry);
    for (int i = 0; i < system.particles(); ++i) {
      Vec3 x = system.position(i);
      for (std::size_t axis = 0; axis < 3; ++axis) x[axis] *= factors[axis];
      if (i == 0) x[0] += corner;
      system.set_position(i, x);
    }
    const auto criterion = watch_cells({spec, system, 10, nullptr, nullptr});
    REQUIRE(criterion);
    std::vector<Finding> findings;
    criterion->conclude(figures, findings);
    REQUIRE(findings.size() == 1);
    return findings.front();
  };
  const auto words = [&](const Vec3& factors, Trust trust, const std::string& part) {
    Figures figures;
    const Finding finding = judged(factors, 0, figures);
    INFO(trust_name(finding.trust) << ": " << finding.words);
    CHECK(finding.trust == trust);
    CHECK(finding.words.find(part) != std::string::npos);
    CHECK(figures.cells.cells > 0);
  };
  words({1, 1, 1}, Trust::kTrusted, "cells stretched by 0 % to 0 %, right angles off by 0 degrees");
  words({1.2, 1, 0.75}, Trust::kTrusted, "cells stretched by -25 % to 20 %, right angles off by ");
  words({0.201, 1, 1}, Trust::kTrusted, "cells stretched by -80 % to 0 %");
  words({0.199, 1, 1}, Trust::kSuspect, "a cell is pressed to 20 % of its thickness");
  words({0.5, 0.5, 0.401}, Trust::kTrusted, "cells stretched by -60 % to 0 %");
  words({0.5, 0.5, 0.399}, Trust::kSuspect, "is crushed to 10 % of its volume");
  words({0.5, 0.5, -0.5}, Trust::kSuspect, " cells are inside out, as cell ");
  // A corner that is drawn out strains its cells more than those beside them.
  double low = 0, high = -1.5;
  for (int i = 0; i < 40; ++i) {
    const double middle = 0.5 * (low + high);
    Figures figures;
    judged({1, 1, 1}, middle, figures);
    (figures.cells.strain_jump <= 0.5 ? low : high) = middle;
  }
  Figures below, above;
  CHECK(judged({1, 1, 1}, low + 1e-9, below).trust == Trust::kTrusted);
  const Finding finding = judged({1, 1, 1}, high - 1e-9, above);
  CHECK(finding.trust == Trust::kSuspect);
  CHECK(below.cells.strain_jump == Approx(0.5).epsilon(1e-6));
  CHECK(above.cells.strain_jump == Approx(0.5).epsilon(1e-6));
  CHECK(finding.words == "the mesh is too coarse for its load: the strain of cell " +
                             std::to_string(above.cells.jumps) +
                             " is off by 50 % from that of the cells around it");
}
