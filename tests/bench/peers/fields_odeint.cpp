// Boost.odeint on first-order systems: controlled Dormand & Prince 5(4), Fehlberg 7(8),
// Bulirsch & Stoer, and the Rosenbrock method of order 4 for small stiff ones.
#include <array>
#include <boost/numeric/odeint.hpp>
#include <boost/numeric/ublas/matrix.hpp>
#include <boost/numeric/ublas/vector.hpp>
#include <boost/version.hpp>

#include "tests/bench/peers/fields.h"

namespace {

namespace odeint = boost::numeric::odeint;
namespace ublas = boost::numeric::ublas;
using peer::Task;

struct TooMany {};

// A right-hand side that counts.
template <class Problem>
struct Counted {
  const Problem* problem;
  peer::Patience* patience;
  template <class State>
  void operator()(const State& x, State& f, double) const {
    if (patience->ends()) throw TooMany{};
    (*problem)(&x[0], &f[0]);
  }
};

template <class Problem>
struct ExactJacobian {
  const Problem* problem;
  void operator()(const ublas::vector<double>& x, ublas::matrix<double>& j, double,
                  ublas::vector<double>& dfdt) const {
    std::array<peer::Dual, Problem::kSize> point, f;
    for (std::size_t k = 0; k < point.size(); ++k) {
      for (std::size_t i = 0; i < point.size(); ++i) point[i] = {x[i], i == k ? 1.0 : 0.0};
      (*problem)(point.data(), f.data());
      for (std::size_t i = 0; i < point.size(); ++i) j(i, k) = f[i].slope;
      dfdt[k] = 0;
    }
  }
};

// Systems of a few numbers are arrays, as the documentation of odeint has them.
template <class Problem>
using StateOf =
    std::conditional_t<(Problem::kSize > 0), std::array<double, std::max(Problem::kSize, 1)>,
                       std::vector<double>>;

template <class State>
struct IsArray : std::false_type {};
template <std::size_t N>
struct IsArray<std::array<double, N>> : std::true_type {};

template <class State>
State start_of(const Task& task) {
  State x{};
  if constexpr (!IsArray<State>::value) x = State(task.start.size());
  std::copy(task.start.begin(), task.start.end(), x.begin());
  return x;
}

struct Odeint {
  static std::string about() {
    return "odeint of Boost " + std::to_string(BOOST_VERSION / 100000) + "." +
           std::to_string(BOOST_VERSION / 100 % 1000);
  }
  static std::string names() { return "dopri5 fehlberg78 bulirsch_stoer rosenbrock4"; }

  template <class Problem>
  static peer::Solution solve(const Problem& problem, const Task& task, const std::string& method,
                              double rtol) {
    using State = StateOf<Problem>;
    const double atol = rtol * task.floor, first = 1e-6 * task.duration;
    peer::Solution result;
    const auto run = [&](auto stepper, auto system, auto x) {
      const double begin = peer::processor_seconds();
      odeint::integrate_adaptive(stepper, system, x, 0.0, task.duration, first);
      result.seconds = peer::processor_seconds() - begin;
      result.x.assign(x.begin(), x.end());
      result.done = std::all_of(x.begin(), x.end(), [](double v) { return std::isfinite(v); });
    };
    peer::Patience patience;
    const Counted<Problem> counted{&problem, &patience};
    try {
      if (method == "dopri5") {
        run(odeint::make_controlled<odeint::runge_kutta_dopri5<State>>(atol, rtol), counted,
            start_of<State>(task));
      } else if (method == "fehlberg78") {
        run(odeint::make_controlled<odeint::runge_kutta_fehlberg78<State>>(atol, rtol), counted,
            start_of<State>(task));
      } else if (method == "bulirsch_stoer") {
        run(odeint::bulirsch_stoer<State>(atol, rtol), counted, start_of<State>(task));
      } else if constexpr (Problem::kSize > 0) {
        if (method == "rosenbrock4")
          run(odeint::make_controlled<odeint::rosenbrock4<double>>(atol, rtol),
              std::make_pair(counted, ExactJacobian<Problem>{&problem}),
              start_of<ublas::vector<double>>(task));
      }
    } catch (const TooMany&) {
      result.done = false;
    } catch (const std::exception&) {  // no step is small enough
      result.done = false;
    }
    result.evaluations = patience.count();
    return result;
  }

  template <class Problem>
  static double steps(const Problem& problem, const Task& task, double h, long count) {
    using State = StateOf<Problem>;
    auto x = start_of<State>(task);
    odeint::runge_kutta4<State> stepper;
    const auto system = [&problem](const State& from, State& f, double) {
      problem(&from[0], &f[0]);
    };
    const double begin = peer::processor_seconds();
    for (long i = 0; i < count; ++i) stepper.do_step(system, x, static_cast<double>(i) * h, h);
    const double seconds = peer::processor_seconds() - begin;
    return std::isfinite(x[0]) ? seconds : -1;
  }
};

}  // namespace

int main() { return peer::serve_fields<Odeint>(); }
