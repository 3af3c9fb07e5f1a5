// read_h5md FILE OUT: an H5MD file as a Lua scene. A program of its own, with limits on memory and
// time: the HDF5 library does not survive every damaged file, and `sim import` does.
#include <sys/resource.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iostream>
#include <map>
#include <set>
#include <unordered_map>

#include "cli/h5md_file.h"
#include "core/base/text.h"

namespace {

using sim::shortest;
using sim::hdf5::Handle;
using namespace sim::h5md;

// Text that is harmless in a comment and in a string of Lua.
std::string harmless(const std::string& text) {
  constexpr std::size_t kLongest = 200;
  std::string out = text.substr(0, kLongest);
  for (char& c : out)
    if (c < ' ' || c == 127 || c == '"' || c == '\\') c = '_';
  return out;
}

// A name that scenes accept.
std::string plain(const std::string& text) {
  constexpr std::size_t kLongest = 60;
  std::string out = text.substr(0, kLongest);
  for (char& c : out)
    if (!std::isalnum(static_cast<unsigned char>(c)) && !std::strchr(" -._", c)) c = '_';
  return out.empty() ? "_" : out;
}

std::string quoted(const std::string& text) { return '"' + text + '"'; }

struct Spring {
  int a, b, family;
  double k, rest;
};

class Scene {
 public:
  Scene(hid_t file, const std::string& name, bool only);
  void write(std::ostream& out) const;
  const std::set<std::string>& notes() const { return notes_; }
  const std::string& name() const { return name_; }

 private:
  void read_particles(hid_t group);
  void read_box(hid_t group);
  void read_springs(hid_t file, hid_t group, hid_t parameters, bool only);
  void read_ties(hid_t ties, const std::string& name, hid_t parameters);
  double length_of(const Spring& spring) const;
  void write_family(std::ostream& out, int family) const;

  std::string name_, title_, integrator_ = "verlet";
  int n_ = 0;
  std::vector<double> x_, v_, mass_, gravity_;
  std::unordered_map<std::int64_t, int> places_;  // of ids
  std::vector<int> pinned_;
  std::vector<Spring> springs_;
  std::vector<std::string> families_;
  double drag_ = 0, dt_ = 0;
  std::set<std::string> notes_;
};

Scene::Scene(hid_t file, const std::string& name, bool only) : name_(name), title_(name) {
  const Handle group = open(file, "particles/" + name);
  if (!group.valid() || !is_group(group)) refuse("particles/" + name + " is no group");
  read_particles(group);
  read_box(group);
  const Handle parameters = open(file, "parameters/sim/" + name);
  if (parameters.valid() && is_group(parameters)) {
    if (const auto given = attribute(parameters, "dt"); given.size() == 1) dt_ = given[0];
    if (const auto given = attribute(parameters, "drag"); given.size() == 1) drag_ = given[0];
    if (const auto given = attribute(parameters, "gravity"); given.size() == 3) gravity_ = given;
    if (const auto given = text_of(parameters, "name")) title_ = *given;
    if (const auto given = text_of(parameters, "integrator")) integrator_ = *given;
    if (const auto others = text_of(parameters, "others"); others && !others->empty())
      notes_.insert("not in the file: " + *others);
    for (const double id : element(parameters, "pinned").values) {
      if (!(id >= 0 && id < n_)) refuse("it pins a particle that is not there");
      pinned_.push_back(static_cast<int>(id));
    }
  }
  for (double& each : gravity_)
    if (!std::isfinite(each)) refuse("its gravity is not finite");
  if (!(drag_ >= 0) || !std::isfinite(drag_)) refuse("its drag is no drag");
  read_springs(file, group, parameters, only);
}

void Scene::read_particles(hid_t group) {
  const auto points = [&](const char* name) {
    Numbers found = element(group, name);
    const bool good = found.size.size() == 2 && found.size[1] == 3;
    if (found.any() && !good) refuse(std::string(name) + " is not three numbers a particle");
    for (const double each : found.values)
      if (!std::isfinite(each)) refuse(std::string(name) + " has a number that is not finite");
    if (!found.unit.empty() && found.unit != "m" && found.unit != "m s-1")
      notes_.insert(std::string(name) + " is in " + found.unit + ", and taken as in m and s");
    return found;
  };
  Numbers x = points("position");
  if (!x.any()) refuse("particles/" + name_ + " has no positions");
  constexpr hsize_t kMostParticles = 5'000'000;
  if (x.size[0] > kMostParticles) refuse("it has more than 5 million particles");
  n_ = static_cast<int>(x.size[0]);
  x_ = std::move(x.values);
  v_ = points("velocity").values;
  if (!v_.empty() && v_.size() != x_.size()) refuse("velocity and position differ in length");
  mass_ = element(group, "mass").values;
  if (mass_.empty()) {
    notes_.insert("there are no masses: 1 kg each");
    mass_.assign(static_cast<std::size_t>(n_), 1);
  }
  if (mass_.size() != static_cast<std::size_t>(n_)) refuse("mass and position differ in length");
  for (const double each : mass_)
    if (!(each > 0) || !std::isfinite(each)) refuse("a mass is not positive");
  const Numbers id = element(group, "id");
  if (id.any() && id.values.size() != mass_.size()) refuse("id and position differ in length");
  for (int i = 0; i < n_; ++i) {
    const double own = id.any() ? id.values[static_cast<std::size_t>(i)] : i;
    if (!(std::fabs(own) < 1e15)) refuse("an id is no number of a particle");
    places_.emplace(static_cast<std::int64_t>(own), i);
  }
  if (places_.size() != mass_.size()) refuse("an id stands twice");
}

void Scene::read_box(hid_t group) {
  const Handle box = open(group, "box");
  if (!box.valid()) return;
  const auto boundary = texts(box, "boundary");
  if (std::ranges::count(boundary, "periodic") > 0)
    notes_.insert("the box is periodic there, and has no walls here");
}

void Scene::read_springs(hid_t file, hid_t group, hid_t parameters, bool only) {
  const Handle connectivity = open(file, "connectivity");
  if (!connectivity.valid() || !is_group(connectivity)) return;
  H5O_info_t own, other;
  if (H5Oget_info2(group, &own, H5O_INFO_BASIC) < 0) refuse(sim::hdf5::last_failure());
  for (const std::string& name : names_in(connectivity)) {
    const Handle ties = open(connectivity, name);
    if (!is_dataset(ties)) continue;
    const Handle space(H5Dget_space(ties), H5Sclose);
    const Size size = size_of(space);
    if (size.size() != 2 || size[1] != 2 || size[0] == 0) continue;  // angles, and the like
    if (H5Aexists(ties, "particles_group") > 0) {
      const Handle reference(H5Aopen(ties, "particles_group", H5P_DEFAULT), H5Aclose);
      const Handle type(H5Aget_type(reference), H5Tclose);
      hobj_ref_t target = 0;
      if (H5Tequal(type, H5T_STD_REF_OBJ) <= 0 || H5Aread(reference, H5T_STD_REF_OBJ, &target) < 0)
        refuse("connectivity/" + name + " is of no group");
      const Handle of(H5Rdereference2(ties, H5P_DEFAULT, H5R_OBJECT, &target), H5Oclose);
      if (!of.valid() || H5Oget_info2(of, &other, H5O_INFO_BASIC) < 0)
        refuse("connectivity/" + name + " is of no group");
      if (other.addr != own.addr) continue;
    } else if (!only) {
      continue;
    }
    read_ties(ties, name, parameters);
  }
}

double Scene::length_of(const Spring& spring) const {
  double square = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const double d = x_[static_cast<std::size_t>(3 * spring.a + axis)] -
                     x_[static_cast<std::size_t>(3 * spring.b + axis)];
    square += d * d;
  }
  return std::sqrt(square);
}

void Scene::read_ties(hid_t ties, const std::string& name, hid_t parameters) {
  constexpr double kStiffness = 100;  // N/m, of ties that have none
  const Numbers ends = read(ties, "connectivity/" + name, false);
  const std::size_t count = ends.values.size() / 2;
  Numbers k, rest, family;
  std::vector<std::string> names;
  if (parameters >= 0) {
    k = element(parameters, "spring_stiffness");
    rest = element(parameters, "spring_rest");
    family = element(parameters, "spring_family");
    if (const Handle kinds = open(parameters, "spring_family"); kinds.valid())
      names = texts(kinds, "names");
  }
  if (k.values.size() != count || rest.values.size() != count) {
    notes_.insert("ties of '" + name + "' are springs of " + shortest(kStiffness) +
                  " N/m, as long as they are");
    k = rest = {};
  }
  if (family.values.size() != count || names.empty()) {
    family.values.assign(count, 0);
    names = {name};
  }
  const int first = static_cast<int>(families_.size());
  families_.insert(families_.end(), names.begin(), names.end());
  for (std::size_t i = 0; i < count; ++i) {
    int at[2];
    for (std::size_t end = 0; end < 2; ++end) {
      const double id = ends.values[2 * i + end];
      const auto place =
          std::fabs(id) < 1e15 ? places_.find(static_cast<std::int64_t>(id)) : places_.end();
      if (place == places_.end())
        refuse("connectivity/" + name + " ties a particle that is not there");
      at[end] = place->second;
    }
    const double kind = family.values[i];
    if (!(kind >= 0 && kind < static_cast<double>(names.size()))) refuse("a family has no name");
    Spring spring{at[0], at[1], first + static_cast<int>(kind), k.any() ? k.values[i] : kStiffness,
                  0};
    if (spring.a == spring.b) refuse("connectivity/" + name + " ties a particle to itself");
    spring.rest = rest.any() ? rest.values[i] : length_of(spring);
    if (!(spring.k >= 0 && spring.rest >= 0) || !std::isfinite(spring.k + spring.rest))
      refuse("a spring has a stiffness or rest length below 0");
    springs_.push_back(spring);
  }
}

void Scene::write_family(std::ostream& out, int family) const {
  out << "local links = {  -- a, b, stiffness in N/m, rest length in m\n";
  for (const Spring& each : springs_)
    if (each.family == family)
      out << each.a << ',' << each.b << ',' << shortest(each.k) << ',' << shortest(each.rest)
          << ",\n";
  out << "}\nlocal springs = sim.force.spring { family = "
      << quoted(plain(families_[static_cast<std::size_t>(family)])) << ", stiffness = 1 }\n"
      << "for i = 1, #links, 4 do\n  springs:tie(links[i], links[i + 1], { stiffness = links[i + "
         "2], rest = links[i + 3] })\nend\nforces[#forces + 1] = springs\n";
}

void Scene::write(std::ostream& out) const {
  const auto list = [&](const char* name, const std::vector<double>& values, std::size_t columns) {
    out << "local " << name << " = {\n";
    for (std::size_t i = 0; i < values.size(); ++i)
      out << shortest(values[i]) << ((i + 1) % columns == 0 ? ",\n" : ",");
    out << "}\n";
  };
  out << "do  -- " << plain(name_) << ": " << n_ << " particles, " << springs_.size()
      << " springs\n";
  list("x", x_, 3);
  if (!v_.empty()) list("v", v_, 3);
  const bool alike = std::ranges::all_of(mass_, [&](double m) { return m == mass_[0]; });
  if (!alike) list("m", mass_, 1);
  out << "local p = sim.particles { mass = " << shortest(mass_[0]) << " }\nfor i = 0, " << n_ - 1
      << " do\n  p:add({ x[3 * i + 1], x[3 * i + 2], x[3 * i + 3] }, {"
      << (alike ? "" : " mass = m[i + 1],")
      << (v_.empty() ? "" : " velocity = { v[3 * i + 1], v[3 * i + 2], v[3 * i + 3] }")
      << " })\nend\nfor _, i in ipairs {";
  for (const int i : pinned_) out << ' ' << i << ',';
  out << " } do p:pin(i) end\nlocal forces = {}\n";
  if (std::ranges::any_of(gravity_, [](double each) { return each != 0; }))
    out << "forces[#forces + 1] = sim.force.gravity { g = {" << shortest(gravity_[0]) << ", "
        << shortest(gravity_[1]) << ", " << shortest(gravity_[2]) << "} }\n";
  if (drag_ > 0) out << "forces[#forces + 1] = sim.force.drag { k = " << shortest(drag_) << " }\n";
  std::vector<bool> used(families_.size());
  double most = 0;
  std::vector<double> degree(static_cast<std::size_t>(n_));
  for (const Spring& each : springs_) {
    used[static_cast<std::size_t>(each.family)] = true;
    for (const int i : {each.a, each.b}) {
      double& sum = degree[static_cast<std::size_t>(i)];
      sum += each.k / mass_[static_cast<std::size_t>(i)];
      most = std::max(most, sum);
    }
  }
  for (std::size_t i = 0; i < families_.size(); ++i)
    if (used[i]) {
      out << "do\n";
      write_family(out, static_cast<int>(i));
      out << "end\n";
    }
  // At most half of the stability limit, as far as springs determine it.
  const double guess = most > 0 ? 0.5 * std::sqrt(2 / most) : 0.01;
  out << "systems[" << quoted(plain(name_)) << "] = sim.scene { name = " << quoted(plain(title_))
      << ", particles = p, forces = forces,\n  integrator = " << quoted(harmless(integrator_))
      << ", dt = " << shortest(dt_ > 0 && std::isfinite(dt_) ? dt_ : guess)
      << ", duration = 2 }\nend\n";
}

void convert(const char* name, const char* out_name) {
  const Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  H5Pset_file_locking(access, false, true);
  const Handle file(H5Fopen(name, H5F_ACC_RDONLY, access), H5Fclose);
  if (!file.valid()) refuse("it is no HDF5 file, or cut off: " + sim::hdf5::last_failure());
  const Handle head = open(file, "h5md"), particles = open(file, "particles");
  const auto version = head.valid() ? attribute(head, "version") : std::vector<double>();
  if (version.size() != 2 || version[0] != 1) refuse("it is not in the layout of H5MD, version 1");
  if (!particles.valid() || !is_group(particles)) refuse("it has no particles");
  const std::vector<std::string> names = names_in(particles);
  if (names.empty()) refuse("it has no particles");
  if (names.size() > 100) refuse("it has too many groups of particles");
  std::vector<Scene> scenes;
  std::set<std::string> notes;
  for (const std::string& each : names) {
    scenes.emplace_back(file, each, names.size() == 1);
    notes.insert(scenes.back().notes().begin(), scenes.back().notes().end());
  }
  std::set<std::string> different;
  for (const std::string& each : names)
    if (!different.insert(plain(each)).second) refuse("two groups have nearly the same name");
  std::ofstream out(out_name);
  for (const std::string& note : notes) out << "-- note: " << harmless(note) << '\n';
  out << "local sim = require \"sim\"\nlocal systems = {}\n";
  for (const Scene& each : scenes) each.write(out);
  if (scenes.size() == 1)
    out << "return systems[" << quoted(plain(scenes[0].name())) << "]\n";
  else
    out << "return sim.world(systems)\n";
  out.close();
  if (!out) refuse(std::string("its scene cannot be written: ") + std::strerror(errno));
}

void limit(decltype(RLIMIT_AS) what, rlim_t most) {
  const rlimit both{most, most};
  ::setrlimit(what, &both);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    std::cerr << "sim import FILE.h5 starts it\n";
    return 2;
  }
  constexpr rlim_t kBytes = rlim_t{8} << 30, kSeconds = 600;
  limit(RLIMIT_AS, kBytes);
  limit(RLIMIT_CPU, kSeconds);
  limit(RLIMIT_CORE, 0);
  sim::hdf5::be_quiet();
  H5PLset_loading_state(0);  // a file brings no code
  try {
    convert(argv[1], argv[2]);
    return 0;
  } catch (const Refused& refused) {
    std::cerr << refused.why << '\n';
  } catch (const std::exception& error) {
    std::cerr << "it takes too much memory: " << error.what() << '\n';
  }
  return 1;
}
