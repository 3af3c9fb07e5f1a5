// Contact of surfaces with each other and themselves.
#include "core/particles/constraints/constraint_system.h"
#include "core/particles/contact_task.h"
#include "core/plugin/plugin.h"
#include "surface_correction.h"

namespace {

std::unique_ptr<sim::StepCorrection> make_contact(const sim::Params& params,
                                                  const sim::ContactTask& task) {
  const auto refuse = [](const std::string& what, const std::string& why,
                         const std::string& remedy) {
    throw sim::Error(sim::ErrorKind::kScene, {what, "", why, remedy});
  };
  if (task.surfaces.empty())
    refuse("contact 'surfaces'", "it acts on surfaces, and there are none", "name some");
  for (const char* const name : {"thickness", "strain_limit"})
    if (params.has(name) && !(params.number(name) > 0))
      refuse(std::string("bad ") + name + " of sim.contact", "it must be > 0",
             "give a positive number");
  sim::ContactMaterial material{.friction = params.number("friction")};
  if (params.has("law")) {
    if (material.friction != 0)
      refuse("bad law of sim.contact", "friction is given beside it, and it has its own",
             "give either the law or friction");
    material = sim::surface_of(params.law("law"));
    if (material.restitution != 0)
      refuse("bad law of sim.contact", "it bounces, and surfaces meet without restitution",
             "give a law whose restitution is 0, such as sim.law.stribeck");
  }
  if (task.constraint_system && task.constraint_system->constraints().feedback() > 0)
    refuse("sim.contact and constraints",
           "constraints with feedback are not obeyed at each step, and contact would have to put "
           "them back",
           "leave feedback out");
  return std::make_unique<sim::SurfaceCorrection>(
      sim::SurfaceContactSpec{task.surfaces, params.number("thickness"), material,
                              params.flag("self"),
                              params.has("strain_limit") ? params.number("strain_limit") : 0.0},
      task.particles, task.constraint_system, task.particles.view(0, task.initial));
}

}  // namespace

SIM_PLUGIN(StepCorrection, "surfaces") {
  using sim::ParamType;
  registrar.add(sim::Plugin<sim::StepCorrection>{
      {.name = "surfaces",
       .summary = "surfaces that never pass through each other, themselves or rigid bodies",
       .formula =
           "n . sum_k w_k (v_k' - v_k) m_k = p >= 0, |p_t| <= friction p, along the rows of pairs\n"
           "nearer than the thickness or that meet on their way through the step; what meets all\n"
           "the same moves as one. sim.contact { ... } is this contact",
       .source = "Bridson, Fedkiw & Anderson (2002), Robust treatment of collisions, contact and "
                 "friction for cloth animation, ACM Trans. Graph. 21, 594-603; Provot (1997); Li, "
                 "Kaufman & Jiang (2021), ACM Trans. Graph. 40(4), section 6",
       .params = {{.name = "thickness",
                   .unit = "m",
                   .doc = "> 0: the distance that layers keep; at most half of the shortest edge",
                   .required = true,
                   .min = 0},
                  {.name = "friction",
                   .default_value = 0.0,
                   .doc = "of layers on each other, Coulomb's",
                   .min = 0},
                  {.name = "law",
                   .type = ParamType::kLaw,
                   .doc = "how they rub, in place of friction; it must not bounce"},
                  {.name = "self",
                   .type = ParamType::kFlag,
                   .default_value = true,
                   .doc = "whether a surface touches itself, or only the others"},
                  {.name = "strain_limit",
                   .doc = "> 0: edges of the surfaces are held to (1 + strain_limit) times their "
                          "length at the start, as far as some sweeps over them reach",
                   .min = 0}},
       .element_bytes = 1500,  // boxes and parts of a triangle
       .example = {{"thickness", 0.01}}},
      make_contact});
}
