#include "core/ode/explicit/order_conditions.h"

#include <catch2/catch.hpp>

using namespace sim;

namespace {

constexpr Tableau<4> kRk4{.a = {{{0, 0, 0, 0}, {0.5, 0, 0, 0}, {0, 0.5, 0, 0}, {0, 0, 1, 0}}},
                          .b = {1.0 / 6, 1.0 / 3, 1.0 / 3, 1.0 / 6},
                          .c = {0, 0.5, 0.5, 1}};

// Dormand & Prince (1980), J. Comput. Appl. Math. 6, 19-26: RK5(4)7M.
constexpr Tableau<7> kDormandPrince{
    .a = {{{},
           {1.0 / 5},
           {3.0 / 40, 9.0 / 40},
           {44.0 / 45, -56.0 / 15, 32.0 / 9},
           {19372.0 / 6561, -25360.0 / 2187, 64448.0 / 6561, -212.0 / 729},
           {9017.0 / 3168, -355.0 / 33, 46732.0 / 5247, 49.0 / 176, -5103.0 / 18656},
           {35.0 / 384, 0, 500.0 / 1113, 125.0 / 192, -2187.0 / 6784, 11.0 / 84}}},
    .b = {35.0 / 384, 0, 500.0 / 1113, 125.0 / 192, -2187.0 / 6784, 11.0 / 84, 0},
    .c = {0, 1.0 / 5, 3.0 / 10, 4.0 / 5, 8.0 / 9, 1, 1}};

}  // namespace

TEST_CASE("order conditions find the order of known methods", "[ode]") {
  CHECK(order_conditions(kRk4) == 4);
  CHECK(order_conditions(kDormandPrince) == 5);
  CHECK(order_conditions(Tableau<1>{.a = {}, .b = {1}, .c = {0}}) == 1);
}

TEST_CASE("a wrong sign or a wrong weight costs the order", "[ode]") {
  Tableau<4> wrong = kRk4;
  wrong.b = {1.0 / 6, 1.0 / 3, 1.0 / 6, 1.0 / 3};
  CHECK(order_conditions(wrong) == 1);
  Tableau<7> sign = kDormandPrince;
  sign.a[4][1] = -sign.a[4][1];
  CHECK(order_conditions(sign) == 0);  // its row no longer adds up to c
  Tableau<7> swapped = kDormandPrince;
  std::swap(swapped.b[2], swapped.b[3]);
  CHECK(order_conditions(swapped) == 1);
}

TEST_CASE("the trees of each order are all there", "[ode]") {
  // 1, 1, 2, 4, 9, 20, 48, 115 rooted trees with 1 .. 8 vertices; without weights none can fail.
  order::Conditions<1, 0> conditions(Tableau<1>{}, {});
  for (const int expected : {1, 2, 4, 8, 17, 37, 85, 200}) {
    CHECK(conditions.next());
    CHECK(conditions.trees() == expected);
  }
}
