// First-order systems for the peers, as their users would write them, and the conversation about
// them.
#pragma once

#include <time.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iostream>
#include <limits>
#include <string>
#include <type_traits>
#include <vector>

namespace peer {

// Numbers with one derivative, for exact Jacobians.
struct Dual {
  double value = 0, slope = 0;
  Dual() = default;
  Dual(double number, double derivative = 0) : value(number), slope(derivative) {}
};
inline Dual operator+(Dual a, Dual b) { return {a.value + b.value, a.slope + b.slope}; }
inline Dual operator-(Dual a, Dual b) { return {a.value - b.value, a.slope - b.slope}; }
inline Dual operator-(Dual a) { return {-a.value, -a.slope}; }
inline Dual operator*(Dual a, Dual b) {
  return {a.value * b.value, a.slope * b.value + a.value * b.slope};
}
inline Dual operator/(Dual a, Dual b) {
  const double q = a.value / b.value;
  return {q, (a.slope - q * b.slope) / b.value};
}
inline Dual sin(Dual a) { return {std::sin(a.value), a.slope * std::cos(a.value)}; }
inline Dual sqrt(Dual a) {
  const double root = std::sqrt(a.value);
  return {root, a.slope / (2 * root)};
}
inline double sin(double a) { return std::sin(a); }
inline double sqrt(double a) { return std::sqrt(a); }

// Each problem has the number of its unknowns, those of the band of its Jacobian on either side (0:
// it has no narrow one) and x' = f(x) of doubles or Duals; the equations are those of the scene of
// its name in scripts/scenes.
struct Lorenz {
  static constexpr const char* kName = "lorenz";
  static constexpr int kSize = 3, kBand = 0;
  int size() const { return kSize; }
  template <class T>
  void operator()(const T* x, T* f) const {
    f[0] = 10.0 * (x[1] - x[0]);
    f[1] = x[0] * (28.0 - x[2]) - x[1];
    f[2] = x[0] * x[1] - (8.0 / 3) * x[2];
  }
};

struct VanDerPol {
  static constexpr const char* kName = "van_der_pol";
  static constexpr int kSize = 2, kBand = 0;
  double mu;
  int size() const { return kSize; }
  template <class T>
  void operator()(const T* x, T* f) const {
    f[0] = x[1];
    f[1] = mu * (1.0 - x[0] * x[0]) * x[1] - x[0];
  }
};

struct Robertson {
  static constexpr const char* kName = "robertson";
  static constexpr int kSize = 3, kBand = 0;
  int size() const { return kSize; }
  template <class T>
  void operator()(const T* x, T* f) const {
    f[0] = 1e4 * x[1] * x[2] - 0.04 * x[0];
    f[2] = 3e7 * x[1] * x[1];
    f[1] = -f[0] - f[2];
  }
};

struct Hires {
  static constexpr const char* kName = "hires";
  static constexpr int kSize = 8, kBand = 0;
  int size() const { return kSize; }
  template <class T>
  void operator()(const T* x, T* f) const {
    const T product = 280.0 * x[5] * x[7];
    f[0] = -1.71 * x[0] + 0.43 * x[1] + 8.32 * x[2] + 0.0007;
    f[1] = 1.71 * x[0] - 8.75 * x[1];
    f[2] = -10.03 * x[2] + 0.43 * x[3] + 0.035 * x[4];
    f[3] = 8.32 * x[1] + 1.71 * x[2] - 1.12 * x[3];
    f[4] = -1.745 * x[4] + 0.43 * x[5] + 0.43 * x[6];
    f[5] = -product + 0.69 * x[3] + 1.71 * x[4] - 0.43 * x[5] + 0.69 * x[6];
    f[6] = product - 1.81 * x[6];
    f[7] = -f[6];
  }
};

struct Oregonator {
  static constexpr const char* kName = "oregonator";
  static constexpr int kSize = 3, kBand = 0;
  int size() const { return kSize; }
  template <class T>
  void operator()(const T* x, T* f) const {
    f[0] = 77.27 * (x[1] + x[0] * (1.0 - 8.375e-6 * x[0] - x[1]));
    f[1] = (x[2] - (1.0 + x[0]) * x[1]) / 77.27;
    f[2] = 0.161 * (x[0] - x[2]);
  }
};

// All x of the seven stars, then all y, x', y'.
struct Pleiades {
  static constexpr const char* kName = "pleiades";
  static constexpr int kStars = 7, kSize = 4 * kStars, kBand = 0;
  int size() const { return kSize; }
  template <class T>
  void operator()(const T* x, T* f) const {
    constexpr int n = kStars;
    for (int i = 0; i < 2 * n; ++i) {
      f[i] = x[2 * n + i];
      f[2 * n + i] = 0.0;
    }
    for (int i = 0; i < n; ++i)
      for (int j = i + 1; j < n; ++j) {
        const T dx = x[j] - x[i], dy = x[n + j] - x[n + i], square = dx * dx + dy * dy;
        const T weight = 1.0 / (square * sqrt(square));
        const T ax = weight * dx, ay = weight * dy;
        f[2 * n + i] = f[2 * n + i] + (j + 1.0) * ax;
        f[2 * n + j] = f[2 * n + j] - (i + 1.0) * ax;
        f[3 * n + i] = f[3 * n + i] + (j + 1.0) * ay;
        f[3 * n + j] = f[3 * n + j] - (i + 1.0) * ay;
      }
  }
};

struct Arenstorf {
  static constexpr const char* kName = "arenstorf";
  static constexpr int kSize = 4, kBand = 0;
  int size() const { return kSize; }
  template <class T>
  void operator()(const T* x, T* f) const {
    constexpr double m = 0.012277471, n = 1 - m;
    const T from_earth = x[0] + m, from_moon = x[0] - n, yy = x[1] * x[1];
    const T e = from_earth * from_earth + yy, l = from_moon * from_moon + yy;
    const T earth = n / (e * sqrt(e)), moon = m / (l * sqrt(l));
    f[0] = x[2];
    f[1] = x[3];
    f[2] = x[0] + 2.0 * x[3] - earth * from_earth - moon * from_moon;
    f[3] = x[1] - 2.0 * x[2] - (earth + moon) * x[1];
  }
};

struct Brusselator {
  static constexpr const char* kName = "brusselator";
  static constexpr int kSize = 0, kBand = 2;
  int cells;
  int size() const { return 2 * cells; }
  template <class T>
  void operator()(const T* x, T* f) const {
    const double a = 0.02 * (cells + 1) * (cells + 1);
    const auto cell = [&](int i, T u, T v, T u0, T v0, T u1, T v1) {
      const T product = u * u * v;
      f[2 * i] = 1.0 + product - 4.0 * u + a * (u0 - 2.0 * u + u1);
      f[2 * i + 1] = 3.0 * u - product + a * (v0 - 2.0 * v + v1);
    };
    const int last = cells - 1;
    cell(0, x[0], x[1], 1.0, 3.0, x[2], x[3]);
    for (int i = 1; i < last; ++i)
      cell(i, x[2 * i], x[2 * i + 1], x[2 * i - 2], x[2 * i - 1], x[2 * i + 2], x[2 * i + 3]);
    cell(last, x[2 * last], x[2 * last + 1], x[2 * last - 2], x[2 * last - 1], 1.0, 3.0);
  }
};

// f(i, of the cell, of its four neighbours) for all cells of a square whose sides meet; two numbers
// a cell.
template <class Cell>
void for_square(int n, const Cell& cell) {
  for (int i = 0; i < n; ++i) {
    const int up = (i + n - 1) % n * n, down = (i + 1) % n * n, row = i * n;
    cell(row, row + n - 1, row + 1, up, down);
    for (int j = 1; j < n - 1; ++j) cell(row + j, row + j - 1, row + j + 1, up + j, down + j);
    cell(row + n - 1, row + n - 2, row, up + n - 1, down + n - 1);
  }
}

struct Brusselator2d {
  static constexpr const char* kName = "brusselator2d";
  static constexpr int kSize = 0, kBand = 0;
  int n;
  int size() const { return 2 * n * n; }
  template <class T>
  void operator()(const T* x, T* f) const {
    const double a = 0.1 * n * n;
    for_square(n, [&](int c, int west, int east, int north, int south) {
      const T u = x[2 * c], v = x[2 * c + 1], product = u * u * v;
      f[2 * c] = 1.0 + product - 4.4 * u +
                 a * (x[2 * west] + x[2 * east] + x[2 * north] + x[2 * south] - 4.0 * u);
      f[2 * c + 1] =
          3.4 * u - product +
          a * (x[2 * west + 1] + x[2 * east + 1] + x[2 * north + 1] + x[2 * south + 1] - 4.0 * v);
    });
  }
};

struct Heat {
  static constexpr const char* kName = "heat";
  static constexpr int kSize = 0, kBand = 1;
  int cells;
  int size() const { return cells; }
  template <class T>
  void operator()(const T* x, T* f) const {
    const double a = (cells + 1.0) * (cells + 1.0);
    const int last = cells - 1;
    f[0] = a * (x[1] - 2.0 * x[0]);
    for (int i = 1; i < last; ++i) f[i] = a * (x[i - 1] - 2.0 * x[i] + x[i + 1]);
    f[last] = a * (x[last - 1] - 2.0 * x[last]);
  }
};

struct GrayScott {
  static constexpr const char* kName = "gray_scott";
  static constexpr int kSize = 0, kBand = 0;
  int n;
  int size() const { return 2 * n * n; }
  template <class T>
  void operator()(const T* x, T* f) const {
    constexpr double p = 0.16, q = 0.08, feed = 0.035, kill = 0.065;
    for_square(n, [&](int c, int west, int east, int north, int south) {
      const T u = x[2 * c], v = x[2 * c + 1], product = u * v * v;
      f[2 * c] = p * (x[2 * west] + x[2 * east] + x[2 * north] + x[2 * south] - 4.0 * u) - product +
                 feed * (1.0 - u);
      f[2 * c + 1] =
          q * (x[2 * west + 1] + x[2 * east + 1] + x[2 * north + 1] + x[2 * south + 1] - 4.0 * v) +
          product - (feed + kill) * v;
    });
  }
};

struct Kuramoto {
  static constexpr const char* kName = "kuramoto";
  static constexpr int kSize = 0, kBand = 0;
  int n;
  int size() const { return 2 * n; }
  // The sine of a difference serves both of its ends.
  template <class T>
  void operator()(const T* x, T* f) const {
    const T around = sin(x[0] - x[2 * (n - 1)]);
    T before = around;
    for (int i = 0; i < n; ++i) {
      const T next = i + 1 < n ? sin(x[2 * i + 2] - x[2 * i]) : around;
      f[2 * i] = x[2 * i + 1] + next - before;
      f[2 * i + 1] = 0.0;
      before = next;
    }
  }
};

// The task: x(0) and the duration, to |error_i| <= rtol (floor + |x_i|) a step.
struct Task {
  std::string problem;
  double number = 0;  // of cells, a side, or mu
  double duration = 0, floor = 0;
  std::vector<double> start;
};

struct Solution {
  bool done = false;
  double seconds = 0;
  long evaluations = 0;
  std::vector<double> x;
};

// Calls visit(problem) with the one of that name.
template <class Visit>
void with_problem(const Task& task, const Visit& visit) {
  const auto is = [&](const char* name) { return task.problem == name; };
  const int count = static_cast<int>(task.number);
  if (is(Lorenz::kName)) return visit(Lorenz{});
  if (is(VanDerPol::kName)) return visit(VanDerPol{task.number});
  if (is(Robertson::kName)) return visit(Robertson{});
  if (is(Hires::kName)) return visit(Hires{});
  if (is(Oregonator::kName)) return visit(Oregonator{});
  if (is(Pleiades::kName)) return visit(Pleiades{});
  if (is(Arenstorf::kName)) return visit(Arenstorf{});
  if (is(Brusselator::kName)) return visit(Brusselator{count});
  if (is(Brusselator2d::kName)) return visit(Brusselator2d{count});
  if (is(Heat::kName)) return visit(Heat{count});
  if (is(GrayScott::kName)) return visit(GrayScott{count});
  if (is(Kuramoto::kName)) return visit(Kuramoto{count});
  std::exit(2);
}

// Processor time of this thread, which other programs do not lengthen.
inline double processor_seconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

// Counts evaluations; true once they have taken too long: the method is not for that problem.
class Patience {
 public:
  bool ends() {
    if (++count_ % kLook == 0 && processor_seconds() - begin_ > kLongest) ended_ = true;
    return ended_;
  }
  long count() const { return count_; }

 private:
  static constexpr long kLook = 1024;
  static constexpr double kLongest = 0.3;  // s

  bool ended_ = false;
  long count_ = 0;
  double begin_ = processor_seconds();
};

// Answers, one a line, until the input ends:
//   methods                                          their names
//   task PROBLEM NUMBER DURATION FLOOR SIZE x0 ..    ok
//   run METHOD RTOL SECONDS    the least seconds of runs that fill that time (at least one), the
//                              evaluations of one, and its x; "failed"
//   steps H COUNT              seconds of so many classical Runge-Kutta steps, or "failed"
// A solver has names(), about(), solve(problem, task, method, rtol) -> Solution and
// steps(problem, task, h, count) -> seconds, negative where it has none.
template <class Solver>
int serve_fields() {
  std::cout.precision(17);
  std::cout << Solver::about() << std::endl;
  Task task;
  for (std::string command; std::cin >> command;) {
    if (command == "methods") {
      std::cout << Solver::names() << std::endl;
    } else if (command == "task") {
      std::size_t size = 0;
      std::cin >> task.problem >> task.number >> task.duration >> task.floor >> size;
      task.start.resize(size);
      for (double& x : task.start) std::cin >> x;
      std::cout << "ok" << std::endl;
    } else if (command == "run") {
      std::string method;
      double rtol = 0, fill = 0;
      std::cin >> method >> rtol >> fill;
      Solution best;
      with_problem(task, [&](const auto& problem) {
        double spent = 0;
        do {
          Solution now = Solver::solve(problem, task, method, rtol);
          if (!now.done) break;
          spent += now.seconds;
          if (!best.done || now.seconds < best.seconds) best = std::move(now);
        } while (spent < fill);
      });
      if (!best.done) {
        std::cout << "failed" << std::endl;
        continue;
      }
      std::cout << best.seconds << ' ' << best.evaluations;
      for (const double x : best.x) std::cout << ' ' << x;
      std::cout << std::endl;
    } else if (command == "steps") {
      double h = 0, seconds = -1;
      long count = 0;
      std::cin >> h >> count;
      with_problem(task,
                   [&](const auto& problem) { seconds = Solver::steps(problem, task, h, count); });
      if (seconds < 0)
        std::cout << "failed" << std::endl;
      else
        std::cout << seconds << std::endl;
    } else {
      return 2;
    }
  }
  return 0;
}

}  // namespace peer
