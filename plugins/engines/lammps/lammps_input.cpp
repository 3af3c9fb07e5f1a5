#include "lammps_input.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <map>
#include <unordered_map>
#include <vector>

#include "core/base/error.h"
#include "core/base/layout.h"
#include "core/base/text.h"
#include "core/output/output.h"

namespace sim::engine {
namespace {

constexpr int kMostSpringsOfOne = 1000;  // its tables have so many columns for every particle
constexpr std::size_t kMostMasses = 8;   // it has 32 groups, and a mass takes two
constexpr std::int64_t kMostStepsThere = 1'000'000'000;  // then it would look for neighbours

// Springs of one stiffness and rest length are of one type.
struct Law {
  double k, rest;
  bool operator==(const Law&) const = default;
};
struct LawHash {
  std::size_t operator()(const Law& law) const {
    const auto word = [](double value) { return std::bit_cast<std::uint64_t>(value); };
    return word(law.k) * 0x9e3779b97f4a7c15 ^ std::rotl(word(law.rest), 32);
  }
};

// Properties of the scene that have to be known before its first line is written.
class Survey {
 public:
  explicit Survey(const Exchange& scene);

  bool own_masses() const { return masses.size() > kMostMasses; }
  int type_of(double mass) const { return own_masses() ? 1 : masses.at(mass); }
  double mass_of(const Exchange& scene, int i) const {
    return scene.free(i) ? scene.mass(i) : pinned_mass;
  }
  // Springs whose ends are both pinned move nothing.
  static bool moves(const Exchange& scene, int a, int b) { return scene.free(a) || scene.free(b); }

  std::map<double, int> masses;  // kg, and their types
  double pinned_mass = 1;        // kg; any, for they do not move
  std::unordered_map<Law, int, LawHash> laws;
  std::vector<Law> law_list;
  std::int64_t springs = 0;
  double longest = 0;                            // m, of the springs as they are now
  Vec3 low = Vec3::Zero(), high = Vec3::Zero();  // of a box around all, m
  double bin = 0;                                // m, of the cells by which it sorts; 0: none

 private:
  void count_springs(const Exchange& scene);
  void find_box(const Exchange& scene);
};

Survey::Survey(const Exchange& scene) {
  for (int i = 0; i < scene.particles(); ++i)
    if (scene.free(i) && !own_masses()) masses.try_emplace(scene.mass(i), 0);
  if (masses.empty()) masses.emplace(1.0, 0);
  int type = 0;
  for (auto& [mass, number] : masses) number = ++type;
  pinned_mass = masses.begin()->first;
  count_springs(scene);
  find_box(scene);
}

void Survey::count_springs(const Exchange& scene) {
  std::vector<int> degree(static_cast<std::size_t>(scene.particles()));
  scene.each_spring([&](int a, int b, double k, double rest) {
    if (!moves(scene, a, b)) return;
    ++springs;
    ++degree[static_cast<std::size_t>(a)];
    ++degree[static_cast<std::size_t>(b)];
    longest = std::max(longest, length(scene.position(a) - scene.position(b)));
    const auto [found, added] = laws.try_emplace({k, rest}, static_cast<int>(law_list.size()) + 1);
    if (added) law_list.push_back({k, rest});
  });
  const auto hub = std::ranges::max_element(degree);
  if (hub == degree.end() || *hub <= kMostSpringsOfOne) return;
  constexpr double kBytes = 12, kGiga = 1e9;  // of an end of a spring there
  throw Error(ErrorKind::kScene,
              {"not for lammps", "particle " + std::to_string(hub - degree.begin()),
               std::to_string(*hub) +
                   " springs meet there, and it makes room for as many at each "
                   "particle: " +
                   brief(kBytes * *hub * scene.particles() / kGiga, 2) + " GB",
               "at most " + std::to_string(kMostSpringsOfOne) + " may; or run it here"});
}

// Finds a box that is never flat and has no particle on its sides, however large the coordinates
// are.
void Survey::find_box(const Exchange& scene) {
  double most = 0;
  for (int i = 0; i < scene.particles(); ++i) {
    const Vec3 x = scene.position(i);
    for (int axis = 0; axis < 3; ++axis) {
      low[axis] = i == 0 ? x[axis] : std::min(low[axis], x[axis]);
      high[axis] = i == 0 ? x[axis] : std::max(high[axis], x[axis]);
      most = std::max(most, std::fabs(x[axis]));
    }
  }
  const Vec3 size = high - low;
  const double side = std::max({size.x(), size.y(), size.z()});
  const double margin = std::max({1e-3 * side, 1e-6 * most, 1e-3 * longest, 1e-9});
  for (int axis = 0; axis < 3; ++axis) {
    low[axis] -= margin;
    high[axis] += margin;
  }
  if (longest == 0) return;
  // Springs as long as a cell keep near what belongs together; of few cells there are many in one.
  for (bin = longest;; bin *= 2) {
    double cells = 1;
    for (int axis = 0; axis < 3; ++axis) cells *= std::max(1.0, (high[axis] - low[axis]) / bin);
    if (cells <= 8.0 * scene.particles() + 100) return;
  }
}

void add_row(std::string& out, std::int64_t id, const Vec3& v) {
  out += std::to_string(id);
  for (int axis = 0; axis < 3; ++axis) {
    out += ' ';
    append_number(out, v[axis]);
  }
  out += '\n';
}

// Comments end with their line.
std::string plain(const std::string& text) {
  std::string out;
  for (const char c : text.substr(0, 60)) out += c >= ' ' && c < 127 && c != '&' ? c : '_';
  return out;
}

void write_data(const Exchange& scene, const Survey& survey, const std::string& folder) {
  Output file(folder + "/" + kLammpsData);
  std::string& out = file.buffer();
  const int n = scene.particles();
  out += "Scene '" + plain(scene.name()) + "' at step " + std::to_string(scene.step()) + "\n\n" +
         std::to_string(n) + " atoms\n";
  const bool tied = survey.springs > 0;
  if (tied) out += std::to_string(survey.springs) + " bonds\n";
  out += std::to_string(survey.own_masses() ? 1 : survey.masses.size()) + " atom types\n";
  if (tied) out += std::to_string(survey.law_list.size()) + " bond types\n";
  out += '\n';
  for (int axis = 0; axis < 3; ++axis) {
    const char name = static_cast<char>('x' + axis);
    out += shortest(survey.low[axis]) + ' ' + shortest(survey.high[axis]) + ' ' + name + "lo " +
           name + "hi\n";
  }

  const auto mass_there = [&](double mass) { return scene.kick_map(mass).mass(); };
  out += "\nMasses\n\n";
  if (survey.own_masses())
    out += "1 1\n";
  else
    for (const auto& [mass, type] : survey.masses)
      out += std::to_string(type) + ' ' + shortest(mass_there(mass)) + '\n';
  if (tied) {
    // Energy K (|d| - rest)^2 of a bond.
    out += "\nBond Coeffs\n\n";
    for (std::size_t i = 0; i < survey.law_list.size(); ++i, file.flush_if_full())
      out += std::to_string(i + 1) + ' ' + shortest(survey.law_list[i].k / 2) + ' ' +
             shortest(survey.law_list[i].rest) + '\n';
  }

  out += "\nAtoms # bond\n\n";
  for (int i = 0; i < n; ++i, file.flush_if_full()) {
    out += std::to_string(i + 1) + (scene.free(i) ? " 1 " : " 2 ");
    add_row(out, survey.type_of(survey.mass_of(scene, i)), scene.position(i));
  }
  out += "\nVelocities\n\n";
  const Array sums = scene.accelerations();
  const auto [ax, ay, az] = Layout(n, 3).axes(sums.data());
  for (int i = 0; i < n; ++i, file.flush_if_full())
    add_row(out, i + 1,
            scene.free(i) ? scene.map(i).start(scene.velocity(i), {ax[i], ay[i], az[i]})
                          : Vec3::Zero());
  if (tied) {
    out += "\nBonds\n\n";
    std::int64_t id = 0;
    scene.each_spring([&](int a, int b, double k, double rest) {
      if (!Survey::moves(scene, a, b)) return;
      out += std::to_string(++id) + ' ' + std::to_string(survey.laws.at({k, rest})) + ' ' +
             std::to_string(a + 1) + ' ' + std::to_string(b + 1) + '\n';
      file.flush_if_full();
    });
  }
  if (survey.own_masses()) {
    // The charge is the mass that gravity acts on.
    out += "\nInertia\n\n";
    for (int i = 0; i < n; ++i, file.flush_if_full()) {
      const double mass = survey.mass_of(scene, i);
      out += std::to_string(i + 1) + ' ' + shortest(mass_there(mass)) + ' ' + shortest(mass) + '\n';
    }
  }
  file.commit();
}

// Weight: m' g' = m g, so g' = phi g for each mass.
std::string weights(const Exchange& scene, const Survey& survey) {
  const Vec3 g = scene.gravity();
  if (g == Vec3::Zero()) return "";
  const std::string along = ' ' + shortest(g.x()) + ' ' + shortest(g.y()) + ' ' + shortest(g.z());
  if (survey.own_masses()) return "fix weight free efield" + along + '\n';
  std::string out;
  for (const auto& [mass, type] : survey.masses) {
    const std::string number = std::to_string(type);
    const double phi = scene.kick_map(mass).phi();
    out += "group mass" + number + " type " + number + "\nfix weight" + number + " mass" + number +
           " gravity " + shortest(phi * length(g)) + " vector" + along + '\n';
  }
  return out;
}

void write_script(const Exchange& scene, const Survey& survey, std::int64_t end,
                  const std::string& folder) {
  Output file(folder + "/" + kLammpsScript);
  const bool tied = survey.springs > 0;
  file.buffer() +=
      "# Scene '" + plain(scene.name()) + "' from step " + std::to_string(scene.step()) +
      ". In this folder: lmp -in " + kLammpsScript + ", or mpirun -np 4 lmp -in " + kLammpsScript +
      "\n# then: sim import FOLDER. Masses and velocities of the data file are not those of the\n"
      "# scene, but those with which this program makes the same steps, the drag exact.\n"
      "units si\natom_style bond\nboundary f f f\nnewton on\n" +
      "atom_modify sort " + (survey.bin > 0 ? "1000 " + shortest(survey.bin) : "0 0") +
      "\npair_style none\nbond_style " + (tied ? "harmonic" : "none") +
      "\nspecial_bonds lj/coul 1 1 1\ncomm_style tiled\ncomm_modify cutoff " +
      shortest(survey.longest > 0 ? 1.001 * survey.longest : survey.high.x() - survey.low.x()) +
      "\n# Springs stay what they are and may stretch: neighbours are never looked for again.\n"
      "neighbor 0 bin\nneigh_modify delay 0 every 1000000000 check no\n" +
      (survey.own_masses() ? std::string("fix inertia all property/atom rmass q\nread_data ") +
                                 kLammpsData + " fix inertia NULL Inertia\n"
                           : std::string("read_data ") + kLammpsData + '\n') +
      "balance 1.0 rcb\ngroup free molecule 1\nfix move free nve\n" + weights(scene, survey) +
      (scene.drag() > 0 ? "fix drag free viscous " + shortest(scene.drag()) + '\n' : "") +
      "variable energy equal \"ke < 1e200\"\n"
      "fix guard all halt 100 v_energy != 1 error hard\n"
      "reset_timestep " +
      std::to_string(scene.step()) + "\ntimestep " + shortest(scene.h()) +
      "\nvariable moments file " + kLammpsMoments + "\nvariable moment equal next(moments)\n" +
      "dump frames all custom 1 " + kLammpsFrames + " id x y z vx vy vz fx fy fz\n" +
      "dump_modify frames every v_moment first yes\n"
      "thermo_style custom step ke\nthermo_modify flush yes\nthermo 1000000000\nrun " +
      std::to_string(end - scene.step()) + '\n';
  file.commit();
}

}  // namespace

void write_lammps(const Exchange& scene, std::span<const std::int64_t> moments,
                  const std::string& folder) {
  if (moments.back() - moments.front() > kMostStepsThere)
    throw Error(ErrorKind::kUsage,
                {"not for lammps", std::to_string(moments.back() - moments.front()) + " steps",
                 "a run there has at most 1e9", "run it in parts, with --snap and --resume"});
  const Survey survey(scene);
  write_data(scene, survey, folder);
  Output file(folder + "/" + kLammpsMoments);
  for (const std::int64_t step : moments.subspan(1)) {
    file.buffer() += std::to_string(step) + '\n';
    file.flush_if_full();
  }
  file.buffer() += std::to_string(moments.back() + 1) + '\n';  // it wants one beyond the end
  file.commit();
  write_script(scene, survey, moments.back(), folder);
}

}  // namespace sim::engine
