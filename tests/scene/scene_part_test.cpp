// A scene of some particles of another one, against plain loops over both.
#include "core/scene/scene_part.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <map>
#include <numeric>

#include "tests/support/scenes.h"

using namespace sim_test;

namespace {

// Two grids of 2 x 3 and 3 x 2 particles, with a loose one before, between and behind them, and
// listed pairs in the grids with values of their own.
sim::SystemSpec make_grids() {
  sim::SystemSpec spec = make_falling(1, 0);
  spec.particles->list.clear();
  for (int i = 0; i < 15; ++i)
    spec.particles->list.push_back({.position = {1.0 * i, 0.1 * i * i, 0}, .mass = 1.0 + i});
  spec.particles->pinned = {2, 7, 11};
  sim::PartSpec grids = make_springs("grids", 10), listed = make_springs("listed", 5);
  for (const int first : {1, 8})
    for (const std::array<int, 3> step : {std::array{0, 1, 0}, {1, 0, 0}, {1, -1, 0}})
      grids.elements.grids.push_back({.first = first,
                                      .size = {first == 1 ? 2 : 3, first == 1 ? 3 : 2, 1},
                                      .step = step,
                                      .length = 0.5});
  listed.elements.add({1, 6}, {{"rest", 2}});
  listed.elements.add({8, 13});
  listed.elements.add({9, 12}, {{"rest", 3}});
  sim::PartSpec drag = make_drag(1);
  drag.particles = std::vector<int>{0, 3, 9, 14};
  spec.forces = {grids, listed, drag};
  for (int i = 0; i < 15; ++i) spec.loads.push_back(sim::Vec3(i, 0, 0));
  return spec;
}

using Pairs = std::vector<std::pair<std::array<int, 2>, double>>;  // with values of `name`

Pairs pairs_of(const sim::Elements& elements, const std::string& name) {
  Pairs list;
  elements.for_each([&](const sim::Element& element) {
    double value = element.length;
    if (const auto own = elements.values.find(name); own != elements.values.end())
      value = element.index < 0 ? -1 : own->second[static_cast<std::size_t>(element.index)];
    list.push_back({{element.ids[0], element.ids[1]}, std::isnan(value) ? -1 : value});
  });
  return list;
}

}  // namespace

TEST_CASE("a part of a scene has the elements and numbers of its own particles") {
  const sim::SystemSpec whole = make_grids();
  const auto range = [](int begin, int end) {
    std::vector<int> ids(static_cast<std::size_t>(end - begin));
    std::iota(ids.begin(), ids.end(), begin);
    return ids;
  };
  std::vector<int> both = range(1, 7), apart = range(8, 14);
  both.insert(both.end(), apart.begin(), apart.end());
  for (const std::vector<int>& ids :
       {range(0, 15), range(1, 7), range(8, 14), range(0, 7), range(1, 8), range(8, 15), both,
        range(7, 8), range(14, 15)}) {
    CAPTURE(ids);
    const sim::SystemSpec part = sim::scene_part(whole, ids);
    std::map<int, int> number;
    for (std::size_t k = 0; k < ids.size(); ++k) number[ids[k]] = static_cast<int>(k);
    REQUIRE(part.particles->list.size() == ids.size());
    for (std::size_t k = 0; k < ids.size(); ++k) {
      const auto& from = whole.particles->list[static_cast<std::size_t>(ids[k])];
      CHECK(part.particles->list[k].position == from.position);
      CHECK(part.particles->list[k].mass == from.mass);
      CHECK(part.loads[k].x() == ids[k]);
    }
    const auto left = [&](const std::vector<int>& all) {
      std::vector<int> list;
      for (const int id : all)
        if (number.contains(id)) list.push_back(number[id]);
      return list;
    };
    CHECK(part.particles->pinned == left(whole.particles->pinned));

    std::vector<std::string> names;
    for (const sim::PartSpec& force : part.forces) {
      names.push_back(force.plugin == "drag" ? "drag"
                                             : std::get<std::string>(force.given.at("family")));
      if (force.plugin == "drag") CHECK(*force.particles == left(*whole.forces[2].particles));
    }
    for (const int k : {0, 1}) {
      const sim::Elements& all = whole.forces[static_cast<std::size_t>(k)].elements;
      const std::string name = k == 0 ? "grids" : "listed";
      Pairs wanted;
      for (auto [ends, value] : pairs_of(all, "rest"))
        if (number.contains(ends[0])) wanted.push_back({{number[ends[0]], number[ends[1]]}, value});
      const auto own = std::ranges::find(names, name);
      CHECK((own != names.end()) == !wanted.empty());
      if (own == names.end()) continue;
      const sim::Elements& found =
          part.forces[static_cast<std::size_t>(own - names.begin())].elements;
      CHECK(pairs_of(found, "rest") == wanted);
      // Grids stay grids.
      std::size_t grids = 0;
      for (const sim::GridPairs& grid : all.grids)
        grids += number.contains(grid.first) && number.contains(grid.first + 5);
      CHECK(found.grids.size() == grids);
      CHECK(found.listed() == (k == 0 ? 0 : wanted.size()));
    }
    CHECK((std::ranges::find(names, "drag") != names.end()) ==
          !left(*whole.forces[2].particles).empty());
  }
}
