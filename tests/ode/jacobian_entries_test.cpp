// Entries of Jacobians that no one told, against the derivatives of formulas.
#include "core/ode/implicit/jacobian_entries.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <random>
#include <vector>

#include "core/base/slot.h"
#include "core/ode/ode_system.h"

using namespace sim;

namespace {

// f_i = sum_j a_ij sin(x_j) e^t over the entries of a pattern; x_j counts only above its threshold.
class Woven final : public OdeSystem {
 public:
  Woven(Sparsity pattern, unsigned seed) : pattern_(std::move(pattern)) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> uniform(0.5, 2);
    for (std::size_t k = 0; k < pattern_.count(); ++k) a_.push_back(uniform(random));
    thresholds.assign(slot(pattern_.size()), -HUGE_VAL);
  }
  std::size_t size() const noexcept override { return slot(pattern_.size()); }
  void eval(double t, const Stage& stage, double* y, double* dydt) override {
    ++evaluations;
    combine(stage, y);
    std::fill_n(dydt, size(), 0.0);
    for (int j = 0; j < pattern_.size(); ++j)
      for (int k = pattern_.begin_of(j); k < pattern_.end_of(j); ++k)
        if (y[j] > thresholds[slot(j)])
          dydt[pattern_.row(k)] += a_[slot(k)] * std::sin(y[j]) * std::exp(t);
    if (fails && y[0] != exact) dydt[0] = std::nan("");
  }
  void combine(const Stage& stage, double* out) override {
    for (std::size_t i = 0; i < size(); ++i) {
      double sum = stage.x[i];
      for (const auto& term : stage.terms) sum += term.coef * term.k[i];
      out[i] = sum;
    }
  }
  double entry(int k, double t, double x) const { return a_[slot(k)] * std::cos(x) * std::exp(t); }

  std::vector<double> thresholds;
  std::int64_t evaluations = 0;
  bool fails = false;  // where x_0 is not `exact`
  double exact = 0;

 private:
  Sparsity pattern_;
  std::vector<double> a_;
};

Sparsity band(int n, int below, int above) {
  std::vector<std::pair<int, int>> entries;
  for (int column = 0; column < n; ++column)
    for (int row = std::max(0, column - above); row <= std::min(n - 1, column + below); ++row)
      entries.emplace_back(column, row);
  return {n, entries};
}

Sparsity scattered(int n, unsigned seed) {
  std::mt19937 random(seed);
  std::vector<std::pair<int, int>> entries;
  for (int column = 0; column < n; ++column)
    for (int k = 0; k < 3; ++k)
      if (column % 4 != 2) entries.emplace_back(column, static_cast<int>(random() % slot(n)));
  return {n, entries};
}

std::vector<double> state_of(int n) {
  std::vector<double> x;
  for (int i = 0; i < n; ++i) x.push_back(i % 5 == 3 ? 0 : 0.7 + 0.01 * (i % 37));
  return x;
}

}  // namespace

TEST_CASE("differences find the entries of a Jacobian, all of them and no others") {
  std::vector<Sparsity> patterns;
  for (const int n : {2, 3, 4, 5, 8, 9, 33}) {
    patterns.push_back(band(n, 1, 1));
    patterns.push_back(band(n, 0, 0));
    patterns.push_back(band(n, 2, 0));
    patterns.push_back(band(n, n, n));
    patterns.push_back(scattered(n, slot(n) & 7u));
  }
  for (const Sparsity& pattern : patterns) {
    INFO(pattern.size() << " numbers, " << pattern.count() << " entries");
    Woven system(pattern, 3);
    std::vector<double> x = state_of(pattern.size());
    const auto entries = difference_entries(system, 0.1, x.data());
    REQUIRE(entries->sparsity() == pattern);
    CHECK(entries->evaluations() == system.evaluations);
    const std::int64_t before = system.evaluations;
    std::vector<double> values(pattern.count());
    for (double& number : x) number += 0.05;
    entries->at(0.3, x.data(), values);
    for (int column = 0; column < pattern.size(); ++column)
      for (int k = pattern.begin_of(column); k < pattern.end_of(column); ++k)
        CHECK(values[slot(k)] == Approx(system.entry(k, 0.3, x[slot(column)])).epsilon(3e-5));
    std::vector<int> colours(slot(pattern.size()));
    CHECK(system.evaluations - before == 1 + color_columns(pattern, colours));
    CHECK(entries->evaluations() == system.evaluations);
  }
}

TEST_CASE("one number has one entry, and many have few evaluations") {
  Woven one(band(1, 0, 0), 1);
  const double x = 0.4;
  const auto entry = difference_entries(one, 0, &x);
  double value = 0;
  entry->at(0, &x, {&value, 1});
  CHECK(value == Approx(one.entry(0, 0, x)).epsilon(1e-7));

  // Groups that share no row are changed at once: of neighbours three, in two halves each time.
  constexpr int kNumbers = 1024, kHalvings = 10;
  Woven many(band(kNumbers, 1, 1), 1);
  const std::vector<double> state = state_of(kNumbers);
  const auto entries = difference_entries(many, 0, state.data());
  CHECK(entries->sparsity() == band(kNumbers, 1, 1));
  CHECK(many.evaluations <= 1 + 2 * 3 * kHalvings);
  CHECK(many.evaluations >= 1 + 2 * kHalvings);
}

TEST_CASE("columns of one colour share no row, and neighbours take as many as they must") {
  for (const int n : {1, 2, 3, 7, 40})
    for (const auto& [pattern, most] : {std::pair(band(n, 1, 1), std::min(n, 3)),
                                        {band(n, 0, 0), 1},
                                        {band(n, 0, 1), std::min(n, 2)},
                                        {band(n, n, n), n},
                                        {scattered(n, 5), n}}) {
      std::vector<int> colours(slot(n), -1);
      const int count = color_columns(pattern, colours);
      CHECK(count <= most);
      CHECK(*std::ranges::max_element(colours) == count - 1);
      std::vector<std::vector<bool>> taken(slot(count), std::vector<bool>(slot(n), false));
      for (int column = 0; column < n; ++column)
        for (int k = pattern.begin_of(column); k < pattern.end_of(column); ++k) {
          REQUIRE(colours[slot(column)] >= 0);
          auto here = taken[slot(colours[slot(column)])].begin() + pattern.row(k);
          CHECK_FALSE(*here);
          *here = true;
        }
    }
}

TEST_CASE("entries that come later are found when it looks again, and kept") {
  const Sparsity whole = band(12, 1, 1);
  Woven system(whole, 9);
  system.thresholds[4] = 1;
  system.thresholds[7] = -1;
  std::vector<double> x = state_of(12);
  x[7] = 0.5, x[4] = 0.5;
  const auto entries = difference_entries(system, 0, x.data());
  CHECK(entries->sparsity().count() == whole.count() - 3);
  CHECK(entries->sparsity().begin_of(4) == entries->sparsity().end_of(4));
  CHECK_FALSE(entries->look_again(0, x.data()));
  x[4] = 1.5, x[7] = -1.5;  // the one is there now, the other no more
  CHECK(entries->look_again(0, x.data()));
  CHECK(entries->sparsity() == whole);
  CHECK_FALSE(entries->look_again(0, x.data()));
  std::vector<double> values(whole.count());
  entries->at(0, x.data(), values);
  for (int k = whole.begin_of(4); k < whole.end_of(4); ++k)
    CHECK(values[slot(k)] == Approx(system.entry(k, 0, 1.5)).epsilon(1e-5));
  for (int k = whole.begin_of(7); k < whole.end_of(7); ++k) CHECK(values[slot(k)] == 0);
}

// f_0 = x_0 x_1, f_1 = x_1, f_2 = x_0 x_2: where x_0 = x_1 = 0 all products are 0, and so are most
// derivatives.
class Products final : public OdeSystem {
 public:
  std::size_t size() const noexcept override { return 3; }
  void eval(double, const Stage& stage, double* y, double* dydt) override {
    combine(stage, y);
    dydt[0] = y[0] * y[1];
    dydt[1] = y[1];
    dydt[2] = y[0] * y[2];
  }
  void combine(const Stage& stage, double* out) override {
    for (std::size_t i = 0; i < 3; ++i) {
      out[i] = stage.x[i];
      for (const auto& term : stage.terms) out[i] += term.coef * term.k[i];
    }
  }
};

TEST_CASE("entries that are 0 by chance are entries") {
  Products system;
  const double x[] = {0, 0, 0};
  const auto entries = difference_entries(system, 0, x);
  CHECK(entries->sparsity() == Sparsity(3, {{0, 0}, {0, 2}, {1, 0}, {1, 1}, {2, 2}}));
}

// Beside the state there may be no values, as for a root of what is 0 there.
TEST_CASE("entries are sought at the state itself where there is nothing beside it") {
  const Sparsity pattern = band(6, 1, 1);
  Woven system(pattern, 2);
  std::vector<double> x = state_of(6);
  system.fails = true;
  system.exact = x[0];
  const auto entries = difference_entries(system, 0, x.data());
  for (int column = 1; column < 6; ++column)
    for (int row = 0; row < 6; ++row)
      CHECK((entries->sparsity().find(column, row) >= 0) == (pattern.find(column, row) >= 0));
}

// J dx by central differences, whatever the size of dx; only its own numbers are written.
TEST_CASE("differences write as many numbers as there are") {
  const Sparsity pattern = band(5, 1, 1);
  Woven system(pattern, 8);
  const std::vector<double> x = state_of(5);
  const auto jacobian = difference_jacobian(system);
  jacobian->at(0.2, x.data());
  for (const double size : {1e-6, 1.0, 1e6}) {
    std::vector<double> dx(5), df(7, 42);
    for (std::size_t i = 0; i < 5; ++i) dx[i] = size * (1 - 0.3 * static_cast<double>(i));
    jacobian->apply(dx.data(), df.data() + 1);
    CHECK((df[0] == 42 && df[6] == 42));
    for (int row = 0; row < 5; ++row) {
      double sum = 0;
      for (int column = 0; column < 5; ++column)
        if (const int k = pattern.find(column, row); k >= 0)
          sum += system.entry(k, 0.2, x[slot(column)]) * dx[slot(column)];
      CHECK(df[slot(row + 1)] == Approx(sum).epsilon(1e-7).margin(1e-9 * size));
    }
  }
  const std::int64_t before = system.evaluations;
  std::vector<double> none(5, 0.0), df(7, 42);
  jacobian->apply(none.data(), df.data() + 1);
  CHECK(df == std::vector<double>{42, 0, 0, 0, 0, 0, 42});
  CHECK(system.evaluations == before);
}

TEST_CASE("all entries of a small system stand column by column") {
  const Sparsity pattern = scattered(7, 4);
  Woven system(pattern, 8);
  const std::vector<double> x = state_of(7);
  const auto entries = all_entries(system);
  CHECK(entries->sparsity() == band(7, 7, 7));
  std::vector<double> values(49);
  for (const double t : {0.0, 0.4}) {
    entries->at(t, x.data(), values);
    for (int column = 0; column < 7; ++column)
      for (int row = 0; row < 7; ++row) {
        const int k = pattern.find(column, row);
        CHECK(values[slot(7 * column + row)] ==
              Approx(k < 0 ? 0 : system.entry(k, t, x[slot(column)])).epsilon(1e-8).margin(1e-12));
      }
  }
  CHECK(entries->evaluations() == system.evaluations);
  CHECK(system.evaluations == 2 * 2 * 7);
}
