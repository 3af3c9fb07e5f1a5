// SUNDIALS on first-order systems: CVODE by BDF and Adams formulas, ARKODE by explicit and
// diagonally implicit Runge-Kutta methods. Implicit equations by dense matrices with the exact
// Jacobian for a few numbers, by a band and differences where there is one, else by GMRES.
//
// Debian's library is compiled without optimization.
#include <arkode/arkode_arkstep.h>
#include <arkode/arkode_erkstep.h>
#include <cvode/cvode.h>
#include <nvector/nvector_serial.h>
#include <sundials/sundials_version.h>
#include <sunlinsol/sunlinsol_band.h>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunlinsol/sunlinsol_spgmr.h>
#include <sunmatrix/sunmatrix_band.h>
#include <sunmatrix/sunmatrix_dense.h>
#include <sunnonlinsol/sunnonlinsol_fixedpoint.h>

#include <array>

#include "tests/bench/peers/fields.h"

namespace {

using peer::Task;

template <class Problem>
struct User {
  const Problem* problem;
  peer::Patience patience = {};

  static int eval(double, N_Vector x, N_Vector f, void* self) {
    User& user = *static_cast<User*>(self);
    if (user.patience.ends()) return -1;
    (*user.problem)(N_VGetArrayPointer(x), N_VGetArrayPointer(f));
    return 0;
  }

  static int jacobian(double, N_Vector x, N_Vector, SUNMatrix j, void* self, N_Vector, N_Vector,
                      N_Vector) {
    if constexpr (Problem::kSize > 0) {
      const double* const at = N_VGetArrayPointer(x);
      std::array<peer::Dual, Problem::kSize> point, f;
      for (int k = 0; k < Problem::kSize; ++k) {
        for (int i = 0; i < Problem::kSize; ++i) point[i] = {at[i], i == k ? 1.0 : 0.0};
        (*static_cast<User*>(self)->problem)(point.data(), f.data());
        for (int i = 0; i < Problem::kSize; ++i) SM_ELEMENT_D(j, i, k) = f[i].slope;
      }
    }
    return 0;
  }
};

// The vector of a run, and what solves its equations.
template <class Problem>
class Parts {
 public:
  explicit Parts(const Task& task) : size_(static_cast<int>(task.start.size())) {
    SUNContext_Create(nullptr, &context);
    x = N_VNew_Serial(size_, context);
    std::copy(task.start.begin(), task.start.end(), N_VGetArrayPointer(x));
  }
  ~Parts() {
    if (nonlinear) SUNNonlinSolFree(nonlinear);
    if (solver) SUNLinSolFree(solver);
    if (matrix) SUNMatDestroy(matrix);
    N_VDestroy(x);
    SUNContext_Free(&context);
  }
  Parts(const Parts&) = delete;
  Parts& operator=(const Parts&) = delete;

  void make_solver() {
    if constexpr (Problem::kSize > 0) {
      matrix = SUNDenseMatrix(size_, size_, context);
      solver = SUNLinSol_Dense(x, matrix, context);
    } else if constexpr (Problem::kBand > 0) {
      matrix = SUNBandMatrix(size_, Problem::kBand, Problem::kBand, context);
      solver = SUNLinSol_Band(x, matrix, context);
    } else {
      solver = SUNLinSol_SPGMR(x, SUN_PREC_NONE, 0, context);
    }
  }

  SUNContext context = nullptr;
  N_Vector x = nullptr;
  SUNMatrix matrix = nullptr;
  SUNLinearSolver solver = nullptr;
  SUNNonlinearSolver nonlinear = nullptr;

 private:
  int size_;
};

void quiet(int, const char*, const char*, char*, void*) {}

struct Sundials {
  static std::string about() { return "SUNDIALS " SUNDIALS_VERSION; }
  static std::string names() {
    return "cvode_bdf cvode_adams arkode_erk4 arkode_erk5 arkode_erk8 arkode_dirk4 arkode_dirk5";
  }

  template <class Problem>
  static peer::Solution solve(const Problem& problem, const Task& task, const std::string& method,
                              double rtol) {
    if (method.rfind("cvode", 0) == 0) return cvode(problem, task, method == "cvode_bdf", rtol);
    const int order = method.back() - '0';
    return method.rfind("arkode_erk", 0) == 0 ? explicit_arkode(problem, task, order, rtol)
                                              : implicit_arkode(problem, task, order, rtol);
  }

  template <class Problem>
  static double steps(const Problem&, const Task&, double, long) {
    return -1;
  }

 private:
  template <class Problem, class Run>
  static peer::Solution timed(const Task& task, Parts<Problem>& parts, const User<Problem>& user,
                              const Run& run) {
    peer::Solution result;
    const double begin = peer::processor_seconds();
    const int flag = run();
    result.seconds = peer::processor_seconds() - begin;
    result.evaluations = user.patience.count();
    const double* const x = N_VGetArrayPointer(parts.x);
    result.x.assign(x, x + task.start.size());
    result.done = flag >= 0;
    for (const double value : result.x) result.done = result.done && std::isfinite(value);
    return result;
  }

  template <class Problem>
  static peer::Solution cvode(const Problem& problem, const Task& task, bool bdf, double rtol) {
    Parts<Problem> parts(task);
    User<Problem> user{&problem};
    void* memory = CVodeCreate(bdf ? CV_BDF : CV_ADAMS, parts.context);
    CVodeSetErrHandlerFn(memory, &quiet, nullptr);
    CVodeInit(memory, &User<Problem>::eval, 0, parts.x);
    CVodeSStolerances(memory, rtol, rtol * task.floor);
    CVodeSetUserData(memory, &user);
    CVodeSetMaxNumSteps(memory, -1);
    if (bdf) {
      parts.make_solver();
      CVodeSetLinearSolver(memory, parts.solver, parts.matrix);
      if constexpr (Problem::kSize > 0) CVodeSetJacFn(memory, &User<Problem>::jacobian);
    } else {
      parts.nonlinear = SUNNonlinSol_FixedPoint(parts.x, 0, parts.context);
      CVodeSetNonlinearSolver(memory, parts.nonlinear);
    }
    const peer::Solution result = timed(task, parts, user, [&] {
      double t = 0;
      CVodeSetStopTime(memory, task.duration);
      return CVode(memory, task.duration, parts.x, &t, CV_NORMAL);
    });
    CVodeFree(&memory);
    return result;
  }

  template <class Problem>
  static peer::Solution explicit_arkode(const Problem& problem, const Task& task, int order,
                                        double rtol) {
    Parts<Problem> parts(task);
    User<Problem> user{&problem};
    void* memory = ERKStepCreate(&User<Problem>::eval, 0, parts.x, parts.context);
    ERKStepSetErrHandlerFn(memory, &quiet, nullptr);
    ERKStepSStolerances(memory, rtol, rtol * task.floor);
    ERKStepSetUserData(memory, &user);
    ERKStepSetMaxNumSteps(memory, -1);
    ERKStepSetOrder(memory, order);
    const peer::Solution result = timed(task, parts, user, [&] {
      double t = 0;
      ERKStepSetStopTime(memory, task.duration);
      return ERKStepEvolve(memory, task.duration, parts.x, &t, ARK_NORMAL);
    });
    ERKStepFree(&memory);
    return result;
  }

  template <class Problem>
  static peer::Solution implicit_arkode(const Problem& problem, const Task& task, int order,
                                        double rtol) {
    Parts<Problem> parts(task);
    User<Problem> user{&problem};
    void* memory = ARKStepCreate(nullptr, &User<Problem>::eval, 0, parts.x, parts.context);
    ARKStepSetErrHandlerFn(memory, &quiet, nullptr);
    ARKStepSStolerances(memory, rtol, rtol * task.floor);
    ARKStepSetUserData(memory, &user);
    ARKStepSetMaxNumSteps(memory, -1);
    ARKStepSetOrder(memory, order);
    parts.make_solver();
    ARKStepSetLinearSolver(memory, parts.solver, parts.matrix);
    if constexpr (Problem::kSize > 0) ARKStepSetJacFn(memory, &User<Problem>::jacobian);
    const peer::Solution result = timed(task, parts, user, [&] {
      double t = 0;
      ARKStepSetStopTime(memory, task.duration);
      return ARKStepEvolve(memory, task.duration, parts.x, &t, ARK_NORMAL);
    });
    ARKStepFree(&memory);
    return result;
  }
};

}  // namespace

int main() { return peer::serve_fields<Sundials>(); }
