// SUNDIALS ARKODE: ERKStep with the classical Runge-Kutta table and a fixed step.
//
// A peer in speed only. ERKStep 6.4.1 takes the last stage for the derivative at the end of the
// step because its abscissa is 1; with this table it therefore makes three evaluations a step
// instead of four and is of third order. Debian's library is compiled without optimization, which
// shows.
#include <arkode/arkode_erkstep.h>
#include <nvector/nvector_serial.h>
#include <sundials/sundials_version.h>

#include <algorithm>

#include "tests/bench/peers/springs.h"

namespace {

void check(int flag, const char* what) {
  if (flag >= 0) return;
  std::fprintf(stderr, "%s failed: %d\n", what, flag);
  std::exit(1);
}

class Sundials {
 public:
  explicit Sundials(peer::Scene scene) : scene_(std::move(scene)), f_(scene_) {
    check(SUNContext_Create(nullptr, &context_), "SUNContext_Create");
    x_ = N_VNew_Serial(6 * scene_.n, context_);
    reset();
  }
  ~Sundials() {
    ERKStepFree(&ark_);
    N_VDestroy(x_);
    SUNContext_Free(&context_);
  }
  Sundials(const Sundials&) = delete;
  Sundials& operator=(const Sundials&) = delete;

  std::string about() const {
    return "SUNDIALS " SUNDIALS_VERSION " ERKStep, rk4 table but 3 evaluations a step, " +
           f_.about();
  }

  void reset() {
    double* const x = N_VGetArrayPointer(x_);
    std::copy(scene_.x.begin(), scene_.x.end(), x);
    std::copy(scene_.v.begin(), scene_.v.end(), x + scene_.x.size());
    if (ark_) ERKStepFree(&ark_);
    ark_ = ERKStepCreate(&Sundials::eval, 0, x_, context_);
    double c[] = {0, 0.5, 0.5, 1}, b[] = {1. / 6, 1. / 3, 1. / 3, 1. / 6};
    double a[] = {0, 0, 0, 0, 0.5, 0, 0, 0, 0, 0.5, 0, 0, 0, 0, 1, 0};
    const ARKodeButcherTable table = ARKodeButcherTable_Create(4, 4, 0, c, a, b, nullptr);
    check(ERKStepSetTable(ark_, table), "ERKStepSetTable");
    ARKodeButcherTable_Free(table);
    check(ERKStepWFtolerances(ark_, &Sundials::weigh), "ERKStepWFtolerances");
    check(ERKStepSetInterpolantDegree(ark_, 0), "ERKStepSetInterpolantDegree");
    check(ERKStepSetFixedStep(ark_, scene_.h), "ERKStepSetFixedStep");
    check(ERKStepSetMaxNumSteps(ark_, -1), "ERKStepSetMaxNumSteps");
    check(ERKStepSetUserData(ark_, &f_), "ERKStepSetUserData");
    done_ = 0;
  }

  double run(long steps) {
    const double start = peer::seconds_now();
    double t = 0;
    for (long i = 0; i < steps; ++i)
      check(ERKStepEvolve(ark_, static_cast<double>(++done_) * scene_.h, x_, &t, ARK_ONE_STEP),
            "ERKStepEvolve");
    return peer::seconds_now() - start;
  }

  std::vector<double> positions() const {
    const double* const x = N_VGetArrayPointer(x_);
    return {x, x + scene_.x.size()};
  }

 private:
  static int eval(double, N_Vector x, N_Vector dx, void* f) {
    (*static_cast<peer::RightHandSide*>(f))(N_VGetArrayPointer(x), N_VGetArrayPointer(dx));
    return 0;
  }

  // Without weights of our own it takes 2e-308 for each, and its norms crawl through subnormal
  // numbers.
  static int weigh(N_Vector, N_Vector weights, void*) {
    N_VConst(1, weights);
    return 0;
  }

  peer::Scene scene_;
  peer::RightHandSide f_;
  SUNContext context_ = nullptr;
  N_Vector x_ = nullptr;
  void* ark_ = nullptr;
  long done_ = 0;
};

}  // namespace

int main(int argc, char** argv) { return peer::serve<Sundials>(argc, argv); }
