/* Every structure and callback of sim.h in one signature, compiled with debug information: from it
 * abidw knows their layouts, which a release build of the library does not tell. */
#include "sim.h"

int sim_layout(const sim_error* error, const sim_options* options, const sim_part* part,
               const sim_energies* energies, const sim_spring* spring, const sim_verdict* verdict,
               sim_watch watch, sim_field field);

int sim_layout(const sim_error* error, const sim_options* options, const sim_part* part,
               const sim_energies* energies, const sim_spring* spring, const sim_verdict* verdict,
               sim_watch watch, sim_field field) {
  return error && options && part && energies && spring && verdict && watch && field;
}
