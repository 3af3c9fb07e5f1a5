// The active mutant of a build and the mutants reached; ./dev mutate compiles all with this.
#pragma once

namespace sim_mutants {
extern int active;              // the number of the mutant that is on, 0 for none
extern unsigned char* reached;  // a byte for each mutant, 1 where it was evaluated

__attribute__((always_inline)) inline bool on(int number) {
  reached[number] = 1;
  return number == active;
}

// The same in code that the compiler may evaluate, too: then no mutant is on.
__attribute__((always_inline)) constexpr bool on_or_constant(int number) {
  return !__builtin_is_constant_evaluated() && on(number);
}
}  // namespace sim_mutants
