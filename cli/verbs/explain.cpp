#include "cli/verbs/explain.h"

#include "core/base/error.h"

namespace sim::cli {
namespace {

constexpr const char* kVerdict =
    R"(Every run ends with one line: a word and what was found, each in numbers.

trusted     Positions were verified: a refined run, with half the step (if
            adaptive, a tenth of the tolerance; of single precision, double),
            stays within 2 % of the size of the scene, or the exact solution is
            met within 1 %. All else that was checked is as it should be.
unverified  All that was checked is as it should be, but positions were not
            verified, or not to the end: the line says until when. --verify does
            it, and the line says how long that takes.
chaotic     Neighbouring states part so fast that no method knows positions for
            long. They are right until the time that is given.
suspect     Something is wrong, or too much to believe the result.
diverged    The run has no finite state, or energy rose a million times.

positions to 1e-05 m (verified)
    The largest distance of any particle, at any time that was compared, from
    where it really is: estimated from the refined run and the order that a run
    with twice the step shows. "numbers to" is the same of a first-order state.
positions to 0.0057 m rms, 0.07 m of a particle (verified)
    With --error: the root mean square of all particles, which was asked for and
    is not held against 2 % of the size, and the largest of one.
positions to 1e-05 m until t = 0.3 s (verified)
    The same up to that time, where verifying was not worth more.
off by about 3.3 m by the end, 210 % of the size
off by about 3.3 m at t = 2 s already, 210 % of the size
    The same where it is more than 2 % of the size: the largest extent of the
    scene along an axis, at the start or at that time.
positions are right until about t = 19 s (neighbours part by x1.9 a second)
    A run that began 1e-7 of the size away parted from this one by that factor
    each second. At that time the error reaches 2 % of the size.
energy to 0.0002 %
    The largest |E(t) + W(t) - E(0)| over the energy in play, which is the
    largest kinetic energy plus change of potential energy so far. W is what
    drag, forces that are not conservative and contact took. More than 1 % is
    suspect.
hardly anything moves
    The energy in play is that of roundings alone.
dt 53 % of limit, dt < 53 % of limit
    The step over the largest one at which the fastest vibration or decay of the
    scene does not grow, by the stability of the method; with < by a bound of
    that frequency from masses and stiffnesses.
the fastest mode grows by e^12 over the run
    By how much what is unstable grows from its start to the end.
strain 31 %
    The worst spring that was seen: its length over its rest length, less 1.
cells stretched by -12 % to 31 %, right angles off by 14 degrees
    The least and the largest stretch in any cell of a body, and the largest
    change of a right angle in one. "inside out", "crushed": a cell of no or
    little volume. "too coarse for its load": the strain of a cell differs by
    more than 0.5 from the mean of those around a corner of it.
step error 2e-09 m
    One step against two of half of it, the largest of some that were tried.
momentum changed by 2 %
    Where nothing holds or brakes it must stay.
largest error 8e-07 of a solution of size 1
    The difference from the exact solution that the scene gives.
contact: none, contact: 5 particles, deepest 0 m, took 4.1 J
    How many touched, how far one was inside, and the energy that contact took;
    "colliders did" is what those that move gave.
bodies touched nothing, bodies touched at up to 16 points, took 0.12 J
    The same of rigid bodies, in one step. What surfaces of sim.contact do to
    bodies is told with those: "bodies touched nothing rigid" leaves it out.
contact kept none apart, contact kept up to 32 pairs apart
    The same of surfaces that sim.contact keeps apart: pairs of their parts.
37 springs broke, took 0.4 J, 37 springs and 2 rods broke, took 0.4 J
    The springs and rods that broke, and the energy that was in them and in
    bending across the tear.
constraints to 2e-15 m and 9e-16 m/s, holding with up to 27 N
    The furthest that one was off, its rate, and the largest force of one.
no surface crosses another or itself
    Edges that go through triangles were counted up to 20 times in the run.
)";

}  // namespace

std::string explanation(const std::string& what) {
  if (what == "verdict") return kVerdict;
  throw Error(ErrorKind::kUsage, {"nothing to explain", "'" + what + "'", "no page of it is here",
                                  "write sim explain verdict"});
}

}  // namespace sim::cli
