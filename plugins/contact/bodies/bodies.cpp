// Contact of rigid bodies with colliders, each other and single particles.
#include "core/plugin/plugin.h"
#include "rigid_correction.h"

namespace {

std::unique_ptr<sim::StepCorrection> make_contact(const sim::Params& params,
                                                  const sim::ContactTask& task) {
  if (task.bodies.bodies.empty())
    throw sim::Error(sim::ErrorKind::kScene,
                     {"contact 'bodies'", "", "it acts on rigid bodies, and on no surfaces",
                      "give contact = sim.contact { surfaces = ... }"});
  return std::make_unique<sim::RigidCorrection>(
      sim::BodyCollision(task.bodies, task.particles, task.initial), task.particles,
      task.constraint_system, params.number("tolerance"));
}

}  // namespace

SIM_PLUGIN(StepCorrection, "bodies") {
  registrar.add(sim::Plugin<sim::StepCorrection>{
      {.name = "bodies",
       .summary = "rigid bodies that touch colliders, each other and particles, with friction",
       .formula =
           "0 <= v_n + restitution v_n(before), 0 <= p_n, one of them 0, at the moment of a touch\n"
           "|p_t| <= friction p_n, along the slip where that is an equation\n"
           "what rests is pressed by a constant force through the step. Of two surfaces friction\n"
           "is the geometric mean, restitution the larger: sim.rigid { friction =, restitution = }",
       .source = "Moreau (1988), Unilateral contact and dry friction; Jean (1999), The non-smooth "
                 "contact dynamics method, Comput. Methods Appl. Mech. Eng. 177, 235-257",
       .params = {{.name = "tolerance",
                   .default_value = sim::RigidContact::kToRounding,
                   .unit = "1",
                   .doc = "of the velocities at hand, where the impulses are solved to, and of the "
                          "radius of a body, by what bodies may overlap; default: to rounding",
                   .min = sim::RigidContact::kToRounding,
                   .max = 0.01}}},
      make_contact});
}
