#include "core/output/tables.h"

#include <array>
#include <charconv>
#include <cmath>
#include <initializer_list>

#include "core/base/text.h"
#include "core/output/format.h"

namespace sim {
namespace {

void append_integer(std::string& out, std::int64_t value) {
  std::array<char, 24> buffer;
  const auto end = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value).ptr;
  out.append(buffer.data(), end);
}

void append_csv(std::string& out, std::initializer_list<double> values) {
  for (const double value : values) {
    out += ',';
    if (!std::isnan(value)) append_number(out, value);
  }
}

void append_json(std::string& out, std::string_view key, double value) {
  out.append(",\"").append(key).append("\":");
  if (std::isnan(value))
    out += "null";
  else
    append_number(out, value);
}

// What all rows of one frame begin with: [system,]step,t.
std::string csv_prefix(const Simulation& system, bool world) {
  std::string prefix = world ? csv_field(system.name()) + "," : "";
  append_integer(prefix, system.step_count());
  append_csv(prefix, {system.t()});
  return prefix;
}

std::string json_prefix(const Simulation& system, bool world) {
  JsonObject object;
  if (world) object.text("system", system.name());
  std::string prefix = object.integer("step", system.step_count()).number("t", system.t()).str();
  prefix.pop_back();
  return prefix;
}

}  // namespace

DumpTable::DumpTable(const Target& target, std::ostream& standard_output, const TableScope& scope)
    : output_(target, standard_output), format_(target.format), world_(scope.world) {
  for (const Simulation* system : scope.systems) {
    if (system->second_order()) {
      columns_ = Columns::kParticles;
    } else if (!system->flat() && columns_ == Columns::kFlat) {
      columns_ = Columns::kPoints;
    }
  }
  if (format_ != TableFormat::kCsv) return;
  std::string& out = output_.buffer();
  out += world_ ? "system,step,t" : "step,t";
  if (columns_ == Columns::kFlat) out += ",component,value";
  if (columns_ != Columns::kFlat) out += ",particle,x,y,z";
  if (columns_ == Columns::kParticles) out += ",vx,vy,vz";
  out += '\n';
}

void DumpTable::frame(const Simulation& system) {
  if (format_ == TableFormat::kCsv) {
    csv_rows(system, csv_prefix(system, world_));
  } else {
    json_rows(system, json_prefix(system, world_));
  }
}

void DumpTable::csv_rows(const Simulation& system, const std::string& prefix) {
  std::string& out = output_.buffer();
  const int rows = system.flat() ? system.components() : system.particles();
  for (int i = 0; i < rows; ++i) {
    out += prefix;
    out += ',';
    append_integer(out, i);
    if (system.flat()) {
      append_csv(out, {system.component(i)});
      if (columns_ != Columns::kFlat) out += ",,";
    } else {
      const Vec3 x = system.position(i);
      append_csv(out, {x[0], x[1], x[2]});
    }
    if (system.second_order()) {
      const Vec3 v = system.velocity(i);
      append_csv(out, {v[0], v[1], v[2]});
    } else if (columns_ == Columns::kParticles) {
      out += ",,,";
    }
    out += '\n';
    output_.flush_if_full();
  }
}

void DumpTable::json_rows(const Simulation& system, const std::string& prefix) {
  std::string& out = output_.buffer();
  const int rows = system.flat() ? system.components() : system.particles();
  for (int i = 0; i < rows; ++i) {
    out += prefix;
    out += system.flat() ? ",\"component\":" : ",\"particle\":";
    append_integer(out, i);
    if (system.flat()) {
      append_json(out, "value", system.component(i));
    } else {
      const Vec3 x = system.position(i);
      append_json(out, "x", x[0]);
      append_json(out, "y", x[1]);
      append_json(out, "z", x[2]);
    }
    if (system.second_order()) {
      const Vec3 v = system.velocity(i);
      append_json(out, "vx", v[0]);
      append_json(out, "vy", v[1]);
      append_json(out, "vz", v[2]);
    }
    out += "}\n";
    output_.flush_if_full();
  }
}

EnergyTable::EnergyTable(const Target& target, std::ostream& standard_output,
                         const TableScope& scope)
    : output_(target, standard_output), format_(target.format), world_(scope.world) {
  if (format_ != TableFormat::kCsv) return;
  output_.buffer() += world_ ? "system," : "";
  output_.buffer() += "step,t,kinetic,potential,total,work,drift\n";
}

void EnergyTable::row(const Simulation& system, const Energy& energy, double work, double drift) {
  std::string& out = output_.buffer();
  if (format_ == TableFormat::kCsv) {
    out += csv_prefix(system, world_);
    append_csv(out, {energy.kinetic, energy.potential, energy.total(), work, drift});
    out += '\n';
  } else {
    out += json_prefix(system, world_);
    append_json(out, "kinetic", energy.kinetic);
    append_json(out, "potential", energy.potential);
    append_json(out, "total", energy.total());
    append_json(out, "work", work);
    append_json(out, "drift", drift);
    out += "}\n";
  }
  output_.flush_if_full();
}

}  // namespace sim
