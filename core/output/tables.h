// Tables of a run: the state (--dump), the energy (--energy) and what the scene observes
// (--observe), as CSV or as JSON lines.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "core/output/output.h"
#include "core/output/svg.h"
#include "core/scene/simulation.h"

namespace sim {

// The systems of a run and whether they come from a sim.world, whose tables have a first column
// `system`.
struct TableScope {
  std::span<const Simulation* const> systems;
  bool world = false;
};

// One row a particle: step,t,particle,x,y,z,vx,vy,vz in m and m/s. A first-order system of points
// has no velocities: without v columns, or with these cells empty where another system of the world
// has them. A flat state is step,t,component,value; beside particles in one world the component
// stands under `particle` and its value under x. Internal variables of forces are in no row. JSON
// lines name what each row has. Where a system has constraints their force on each particle
// follows, as cx,cy,cz in N.
class DumpTable {
 public:
  DumpTable(const Target& target, std::ostream& standard_output, const TableScope& scope);

  void frame(const Simulation& system);
  void commit() { output_.commit(); }

 private:
  Output output_;
  TableFormat format_;
  bool world_;
  std::size_t columns_ = 1;  // of numbers, for the widest system
  bool forces_ = false;      // of constraints
};

// step,t,kinetic,potential,total,work,drift in s and J: work is the energy taken so far by drag and
// other forces that do work, drift = total + work - total at step 0; not a number: unknown, an
// empty field. Second-order systems only. A file ending in .svg is a plot of kinetic, potential and
// total energy.
class EnergyTable {
 public:
  EnergyTable(const Target& target, std::ostream& standard_output, const TableScope& scope);

  void row(const Simulation& system, const Energy& energy, double work, double drift);
  void commit();

 private:
  Output output_;
  TableFormat format_;
  bool world_;
  TimeChart chart_;  // instead of rows, for .svg
};

// step,t,NAME,...: the quantities that the scenes observe, in alphabetical order; a number that is
// not finite, and one that a system of the world lacks, is an empty field.
class ObserveTable {
 public:
  ObserveTable(const Target& target, std::ostream& standard_output, const TableScope& scope,
               std::span<const SystemSpec> systems);

  void row(const Simulation& system, std::span<const ObserverSpec> observers,
           std::span<const double> values);
  void commit() { output_.commit(); }

 private:
  Output output_;
  TableFormat format_;
  bool world_;
  std::vector<std::string> names_;
};

// step,t,constraint,a,b,tension,fx,fy,fz: the forces of constraints, in N; of a rod its tension and
// its force on a; of all others, with b empty, |f| and f on a.
class TensionTable {
 public:
  TensionTable(const Target& target, std::ostream& standard_output, const TableScope& scope);

  void rows(const Simulation& system);
  void commit() { output_.commit(); }

 private:
  Output output_;
  TableFormat format_;
  bool world_;
};

}  // namespace sim
