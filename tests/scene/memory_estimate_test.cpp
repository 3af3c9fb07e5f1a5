// Memory that a scene will take: what counts, and that it counts in proportion.
#include "core/scene/memory_estimate.h"

#include <catch2/catch.hpp>

#include "tests/support/scenes.h"

using namespace sim;

namespace {

double part(const MemoryEstimate& estimate, const std::string& name) {
  for (const auto& [each, bytes] : estimate.parts)
    if (each == name) return bytes;
  return 0;
}

}  // namespace

TEST_CASE("files of frames take a model each, one more while they are made, and frames") {
  const SystemSpec cloth = sim_test::make_cloth(20);
  const MemoryEstimate none = memory_estimate_of_files(cloth, 0),
                       one = memory_estimate_of_files(cloth, 1),
                       three = memory_estimate_of_files(cloth, 3);
  CHECK(none.parts.empty());
  CHECK(none.total() == 0);
  const double model = part(one, "models of the scene");
  CHECK(model > 0);
  CHECK(part(three, "models of the scene") == 2 * model);
  CHECK(part(three, "frames") == part(one, "frames"));
  CHECK(one.total() == model + part(one, "frames"));
  // Four times the particles.
  const MemoryEstimate four = memory_estimate_of_files(sim_test::make_cloth(40), 1);
  CHECK(part(four, "frames") == 4 * part(one, "frames"));
  CHECK(part(four, "models of the scene") == Approx(4 * model).epsilon(0.1));
  // A state without particles is small.
  CHECK(memory_estimate_of_files(sim_test::make_circle(), 3).parts.empty());
}

TEST_CASE("stages, ties and implicit vectors count where they are") {
  Registry registry = sim_test::make_registry();
  const SystemSpec cloth = sim_test::make_cloth(20);
  const auto of = [&](const IntegratorInfo& info) {
    return memory_estimate(cloth, info, registry);
  };
  const MemoryEstimate plain = of({.evaluations = 1}), four = of({.evaluations = 4}),
                       adaptive = of({.evaluations = 4, .adaptive = true}),
                       implicit = of({.evaluations = 4, .implicit = true});
  CHECK(part(plain, "particles") == part(implicit, "particles"));
  CHECK(part(four, "the method") == 4 * part(plain, "the method"));
  CHECK(part(adaptive, "the method") > 10 * part(four, "the method"));
  CHECK(part(implicit, "the method") > part(adaptive, "the method"));
  CHECK(part(implicit, "their derivatives") > 0);
  CHECK(part(four, "their derivatives") == 0);
  CHECK(part(implicit, "vectors of GMRES") == 0);
  CHECK(part(plain, "constraints") == 0);
  CHECK(plain.total() > 0);
}
