// The actions of the commands of a session, for the table of commands.
#pragma once

#include "cli/prompt/repl_commands.h"

namespace sim::cli::actions {

// repl_time.cpp
Answer step(Call& call);
Answer run(Call& call);
Answer until(Call& call);
Answer reset(Call& call);
Answer back(Call& call);
Answer go_to(Call& call);
Answer undo(Call& call);
Answer rest(Call& call);
Answer t(Call& call);
Answer taken(Call& call);
Answer branch(Call& call);
Answer switch_to(Call& call);
Answer diff(Call& call);

// repl_state.cpp
Answer energy(Call& call);
Answer position(Call& call);
Answer velocity(Call& call);
Answer component(Call& call);
Answer set_position(Call& call);
Answer set_velocity(Call& call);
Answer set_component(Call& call);
Answer pin(Call& call);
Answer unpin(Call& call);
Answer hand(Call& call);
Answer toggle(Call& call);
Answer forces(Call& call);
Answer dump(Call& call);
Answer hash(Call& call);

// repl_facts.cpp
Answer n(Call& call);
Answer mass(Call& call);
Answer pins(Call& call);
Answer args(Call& call);
Answer springs(Call& call);
Answer open(Call& call);
Answer load(Call& call);
Answer save(Call& call);

// repl_study.cpp
Answer verdict(Call& call);
Answer stability(Call& call);
Answer tradeoff(Call& call);
Answer error(Call& call);
Answer minimal(Call& call);
Answer order(Call& call);

// repl_record.cpp
Answer record(Call& call);
Answer plot(Call& call);

// repl_picture.cpp
Answer show(Call& call);

// repl_view.cpp
Answer view(Call& call);

// repl_setup.cpp
Answer integrator(Call& call);
Answer dt(Call& call);
Answer set(Call& call);
Answer reload(Call& call);
Answer system(Call& call);
Answer snap(Call& call);
Answer resume(Call& call);
Answer plugins(Call& call);
Answer mode(Call& call);
Answer time(Call& call);
Answer read(Call& call);
Answer help(Call& call);
Answer quit(Call& call);

}  // namespace sim::cli::actions

namespace sim::cli {

// A warning line if the step exceeds the largest stable one; else "".
std::string limit_warning(Simulation& system);

}  // namespace sim::cli
