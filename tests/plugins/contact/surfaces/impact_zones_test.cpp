// Impact zones against plain sums over their members, whatever the numbers of these are.
#include "plugins/contact/surfaces/impact_zones.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <random>
#include <set>

using sim::ImpactZones;
using sim::KinematicFit;
using sim::Vec3;

namespace {

using Random = std::minstd_rand;

double any(Random& random) { return std::uniform_real_distribution<double>(-1, 1)(random); }
Vec3 any_vector(Random& random) { return {any(random), any(random), any(random)}; }

// Particles with what is known of them: an inverse mass, 0 of those that no force moves.
struct Crowd {
  std::vector<double> inverse_mass;
  std::vector<Vec3> places, moves;

  Crowd(int count, const std::set<int>& kinematic, Random& random) {
    for (int i = 0; i < count; ++i) {
      inverse_mass.push_back(kinematic.contains(i) ? 0 : 1.5 + any(random));
      places.push_back(any_vector(random));
      moves.push_back(any_vector(random));
    }
  }

  // The motion that all of a zone share, at the place of one of them.
  Vec3 shared(const std::set<int>& zone, int at) const {
    double mass = 0;
    Vec3 momentum{0, 0, 0};
    KinematicFit fit;
    std::vector<int> kinematic;
    for (const int i : zone) {
      const auto slot = static_cast<std::size_t>(i);
      if (inverse_mass[slot] > 0) {
        mass += 1 / inverse_mass[slot];
        momentum += moves[slot] / inverse_mass[slot];
      } else {
        kinematic.push_back(i);
        fit.add(places[slot], moves[slot]);
      }
    }
    if (kinematic.empty()) return momentum / mass;
    if (kinematic.size() == 1) return moves[static_cast<std::size_t>(kinematic.front())];
    return fit.at(places[static_cast<std::size_t>(at)]);
  }

  // Checks that everything moves by w + a (d - w), or by d itself outside of zones.
  void check(const std::vector<std::set<int>>& zones, const std::vector<double>& shares,
             const std::vector<Vec3>& found) const {
    for (std::size_t i = 0; i < moves.size(); ++i) {
      Vec3 expected = moves[i];
      for (std::size_t z = 0; z < zones.size(); ++z)
        if (zones[z].contains(static_cast<int>(i)) && inverse_mass[i] > 0) {
          const Vec3 with = shared(zones[z], static_cast<int>(i));
          expected = with + shares[z] * (moves[i] - with);
        }
      INFO("particle " << i);
      CHECK((found[i] - expected).norm() < 1e-13);
    }
  }
};

}  // namespace

TEST_CASE("zones move by the mean of their mass, or as what leads them, at any numbers",
          "[contact]") {
  Random random(3);
  // Four that meet, and none, one or two of them led, in each order of the numbers 0 to 3.
  for (int led = 0; led <= 2; ++led) {
    std::array<int, 4> ids{0, 1, 2, 3};
    do {
      const std::set<int> kinematic(ids.begin(), ids.begin() + led);
      Crowd crowd(6, kinematic, random);
      ImpactZones zones;
      zones.begin(crowd.moves);
      CHECK(zones.empty());
      zones.join(ids, 0.5);
      CHECK(zones.members().size() == 4);
      std::vector<Vec3> moved = crowd.moves;
      REQUIRE(zones.apply(crowd.inverse_mass, crowd.places, moved));
      INFO(led << " led, first " << ids[0] << ids[1]);
      crowd.check({{0, 1, 2, 3}}, {0.8 * 0.5}, moved);
      std::vector<Vec3> slowed = crowd.moves;
      zones.slow(crowd.inverse_mass, crowd.places, slowed);
      crowd.check({{0, 1, 2, 3}}, {0.8 * 0.5}, slowed);
    } while (std::next_permutation(ids.begin(), ids.end()));
  }
}

TEST_CASE("zones that touch become one, with the least share of their ways", "[contact]") {
  Random random(5);
  Crowd crowd(12, {}, random);
  ImpactZones zones;
  zones.begin(crowd.moves);
  zones.join({7, 8, 9, 10}, 0.75);
  zones.join({1, 2, 3, 4}, 0.5);
  std::vector<Vec3> apart = crowd.moves;
  REQUIRE(zones.apply(crowd.inverse_mass, crowd.places, apart));
  crowd.check({{7, 8, 9, 10}, {1, 2, 3, 4}}, {0.8 * 0.75, 0.8 * 0.5}, apart);
  zones.join({10, 11, 0, 1}, 0.9);
  std::vector<Vec3> together = crowd.moves;
  REQUIRE(zones.apply(crowd.inverse_mass, crowd.places, together));
  crowd.check({{0, 1, 2, 3, 4, 7, 8, 9, 10, 11}}, {0.8 * 0.5}, together);
  // Velocities lose energy, and no momentum.
  Vec3 before{0, 0, 0}, after{0, 0, 0};
  double energy_before = 0, energy_after = 0;
  std::vector<Vec3> slowed = crowd.moves;
  zones.slow(crowd.inverse_mass, crowd.places, slowed);
  for (std::size_t i = 0; i < slowed.size(); ++i) {
    before += crowd.moves[i] / crowd.inverse_mass[i];
    after += slowed[i] / crowd.inverse_mass[i];
    energy_before += crowd.moves[i].squaredNorm() / crowd.inverse_mass[i];
    energy_after += slowed[i].squaredNorm() / crowd.inverse_mass[i];
  }
  CHECK((after - before).norm() < 1e-13);
  CHECK(energy_after < energy_before);
}

TEST_CASE("a zone that meets again and again is slowed by halves, then moves as one, then stops",
          "[contact]") {
  Random random(7);
  for (const int led : {-1, 0, 5}) {
    const std::set<int> kinematic = led < 0 ? std::set<int>{} : std::set<int>{led};
    Crowd crowd(6, kinematic, random);
    ImpactZones zones;
    zones.begin(crowd.moves);
    for (int again = 0; again <= 8; ++again) {
      INFO("led " << led << ", again " << again);
      zones.join({5, 2, 0, 3}, 0.5);
      std::vector<Vec3> moved = crowd.moves;
      const bool allowed = zones.apply(crowd.inverse_mass, crowd.places, moved);
      if (again <= 7) {
        REQUIRE(allowed);
        crowd.check({{0, 2, 3, 5}}, {again <= 6 ? 0.8 * std::ldexp(0.5, -again) : 0}, moved);
        continue;
      }
      // A prescribed particle cannot stop, and is named.
      CHECK(allowed == (led < 0));
      CHECK(zones.culprit() == led);
      for (const int i : {0, 2, 3, 5})
        if (led < 0) CHECK(moved[static_cast<std::size_t>(i)] == Vec3(0, 0, 0));
    }
  }
}
