#include "core/output/tables.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <initializer_list>

#include "core/base/text.h"
#include "core/output/format.h"
#include "core/particles/constraints/constraint_system.h"

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

// The beginning of all rows of one frame: [system,]step,t.
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

// The numbers that a row of the table holds: those of one item of the first kind.
std::vector<StateNumber> columns_of(const StateShape& shape) {
  std::vector<StateNumber> columns;
  for (const StatePart& part : shape.parts())
    for (std::size_t c = 0; c < part.components.size() && part.item == shape.first().item; ++c)
      columns.push_back({&part, 0, c, part.at(0, c)});
  return columns;
}

std::vector<ConstraintForce> holding_forces(const Simulation& system) {
  if (!system.constraint_system()) return {};
  return system.constraint_system()->forces(system.t(), system.state().data());
}

// The constraint force on each particle; empty if a system has no constraints.
std::vector<Vec3> forces_on_particles(const Simulation& system) {
  std::vector<Vec3> sums(system.constraint_system() ? static_cast<std::size_t>(system.particles())
                                                    : 0);
  for (const ConstraintForce& each : holding_forces(system)) {
    sums[static_cast<std::size_t>(each.a)] += each.force;
    if (each.b >= 0) sums[static_cast<std::size_t>(each.b)] -= each.force;
  }
  return sums;
}

}  // namespace

DumpTable::DumpTable(const Target& target, std::ostream& standard_output, const TableScope& scope)
    : output_(target, standard_output), format_(target.format), world_(scope.world) {
  std::vector<StateNumber> widest;
  for (const Simulation* system : scope.systems)
    if (auto columns = columns_of(system->shape()); columns.size() > widest.size())
      widest = columns;
  columns_ = widest.size();
  for (const Simulation* system : scope.systems) forces_ = forces_ || system->constraint_system();
  if (format_ != TableFormat::kCsv) return;
  std::string& out = output_.buffer();
  out += world_ ? "system,step,t" : "step,t";
  out += columns_ == 1 ? ",component,value" : ",particle";
  for (const StateNumber& column : widest)
    if (columns_ > 1) out += "," + column.name();
  if (forces_) out += ",cx,cy,cz";
  out += '\n';
}

void DumpTable::frame(const Simulation& system) {
  const bool csv = format_ == TableFormat::kCsv;
  const std::string prefix = csv ? csv_prefix(system, world_) : json_prefix(system, world_);
  const std::vector<StateNumber> columns = columns_of(system.shape());
  const std::span<const double> x = system.state();
  const std::vector<Vec3> held = forces_ ? forces_on_particles(system) : std::vector<Vec3>();
  std::string& out = output_.buffer();
  for (std::size_t i = 0; i < columns.front().part->count; ++i) {
    out += prefix;
    out += csv ? "," : system.flat() ? ",\"component\":" : ",\"particle\":";
    append_integer(out, static_cast<std::int64_t>(i));
    for (const StateNumber& column : columns) {
      const double value = x[column.part->at(i, column.component)];
      if (csv)
        append_csv(out, {value});
      else
        append_json(out, system.flat() ? "value" : column.name(), value);
    }
    if (csv) out.append(columns_ - columns.size(), ',');
    if (forces_ && csv) {
      if (held.empty())
        out += ",,,";
      else
        append_csv(out, {held[i].x(), held[i].y(), held[i].z()});
    } else if (!held.empty()) {
      append_json(out, "cx", held[i].x());
      append_json(out, "cy", held[i].y());
      append_json(out, "cz", held[i].z());
    }
    if (!csv) out += '}';
    out += '\n';
    output_.flush_if_full();
  }
}

EnergyTable::EnergyTable(const Target& target, std::ostream& standard_output,
                         const TableScope& scope)
    : output_(target, standard_output), format_(target.format), world_(scope.world) {
  if (format_ == TableFormat::kSvg) {
    std::string names;
    for (const Simulation* system : scope.systems)
      names += (names.empty() ? "" : ", ") + system->name();
    chart_ = {.title = "Energy: " + names, .y_name = "energy [J]", .curves = {}};
    chart_.sizes_name = "size of drift [J]";
  }
  if (format_ != TableFormat::kCsv) return;
  output_.buffer() += world_ ? "system," : "";
  output_.buffer() += "step,t,kinetic,potential,total,work,drift\n";
}

void EnergyTable::row(const Simulation& system, const Energy& energy, double work, double drift) {
  std::string& out = output_.buffer();
  if (format_ == TableFormat::kSvg) {
    const auto add = [&](std::vector<ChartCurve>& curves, const std::string& name, double value) {
      const std::string full = world_ ? system.name() + " " + name : name;
      auto curve = std::ranges::find(curves, full, &ChartCurve::name);
      if (curve == curves.end()) {
        curves.push_back({full, {}});
        curve = curves.end() - 1;
      }
      curve->points.emplace_back(system.t(), value);
    };
    add(chart_.curves, "kinetic", energy.kinetic);
    add(chart_.curves, "potential", energy.potential);
    add(chart_.curves, "total", energy.total());
    add(chart_.sizes, "drift", std::abs(drift));
    return;
  }
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

ObserveTable::ObserveTable(const Target& target, std::ostream& standard_output,
                           const TableScope& scope, std::span<const SystemSpec> systems)
    : output_(target, standard_output), format_(target.format), world_(scope.world) {
  for (const SystemSpec& system : systems)
    for (const ObserverSpec& observer : system.observers) names_.push_back(observer.name);
  std::ranges::sort(names_);
  names_.erase(std::unique(names_.begin(), names_.end()), names_.end());
  if (format_ != TableFormat::kCsv) return;
  output_.buffer() += world_ ? "system,step,t" : "step,t";
  for (const std::string& name : names_) output_.buffer() += "," + name;
  output_.buffer() += '\n';
}

void ObserveTable::row(const Simulation& system, std::span<const ObserverSpec> observers,
                       std::span<const double> values) {
  std::string& out = output_.buffer();
  const bool csv = format_ == TableFormat::kCsv;
  out += csv ? csv_prefix(system, world_) : json_prefix(system, world_);
  for (const std::string& name : names_) {
    const auto found = std::ranges::find(observers, name, &ObserverSpec::name);
    const bool here = found != observers.end();
    double value = std::nan("");
    if (here) value = values[static_cast<std::size_t>(found - observers.begin())];
    if (!std::isfinite(value)) value = std::nan("");
    if (csv)
      append_csv(out, {value});
    else if (here)
      append_json(out, name, value);
  }
  out += csv ? "\n" : "}\n";
  output_.flush_if_full();
}

TensionTable::TensionTable(const Target& target, std::ostream& standard_output,
                           const TableScope& scope)
    : output_(target, standard_output), format_(target.format), world_(scope.world) {
  if (format_ != TableFormat::kCsv) return;
  output_.buffer() += world_ ? "system," : "";
  output_.buffer() += "step,t,constraint,a,b,tension,fx,fy,fz\n";
}

void TensionTable::rows(const Simulation& system) {
  const bool csv = format_ == TableFormat::kCsv;
  const std::string prefix = csv ? csv_prefix(system, world_) : json_prefix(system, world_);
  std::string& out = output_.buffer();
  for (const ConstraintForce& each : holding_forces(system)) {
    out += prefix;
    if (csv) {
      out += "," + csv_field(each.constraint) + "," + std::to_string(each.a) + ",";
      if (each.b >= 0) out += std::to_string(each.b);
      append_csv(out, {each.tension, each.force.x(), each.force.y(), each.force.z()});
    } else {
      JsonObject pair;
      pair.text("constraint", each.constraint).integer("a", each.a);
      if (each.b >= 0) pair.integer("b", each.b);
      const std::string text = pair.str();
      out += "," + text.substr(1, text.size() - 2);
      append_json(out, "tension", each.tension);
      append_json(out, "fx", each.force.x());
      append_json(out, "fy", each.force.y());
      append_json(out, "fz", each.force.z());
      out += '}';
    }
    out += '\n';
    output_.flush_if_full();
  }
}

void EnergyTable::commit() {
  if (format_ == TableFormat::kSvg) output_.buffer() = svg(chart_);
  output_.commit();
}

}  // namespace sim
