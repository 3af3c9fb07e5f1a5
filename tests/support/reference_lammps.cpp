#include "tests/support/reference_lammps.h"

#include <cmath>
#include <cstdint>
#include <sstream>
#include <stdexcept>

namespace sim_test {

ReferenceLammps::ReferenceLammps(const std::filesystem::path& folder) : folder_(folder) {
  read_data();
  read_script();
}

void ReferenceLammps::read_data() {
  std::ifstream file(folder_ / "scene.data");
  std::string section;
  std::map<int, double> masses;
  std::map<int, Bond> laws;
  std::getline(file, section);
  section.clear();
  for (std::string line; std::getline(file, line);) {
    if (line.empty()) continue;
    std::istringstream in(line);
    if (std::isalpha(static_cast<unsigned char>(line[0]))) {
      section = line;
      continue;
    }
    std::size_t id = 0;
    if (section.empty()) {
      std::string what;
      if (in >> id >> what && what == "atoms") {
        for (auto* list : {&x, &v, &f, &gravity}) list->assign(3 * id, 0.0);
        mass.assign(id, 0);
        weight.assign(id, 0);
        group.assign(id, 0);
        type_.assign(id, 0);
      }
      continue;
    }
    in >> id;
    const std::size_t i = id - 1;
    if (section == "Masses") in >> masses[static_cast<int>(id)];
    if (section == "Bond Coeffs")
      in >> laws[static_cast<int>(id)].k >> laws[static_cast<int>(id)].rest;
    if (section == "Atoms # bond")
      in >> group.at(i) >> type_.at(i) >> x.at(3 * i) >> x.at(3 * i + 1) >> x.at(3 * i + 2);
    if (section == "Velocities") in >> v.at(3 * i) >> v.at(3 * i + 1) >> v.at(3 * i + 2);
    if (section == "Inertia") in >> mass.at(i) >> weight.at(i);
    if (section == "Bonds") {
      int law = 0, a = 0, b = 0;
      in >> law >> a >> b;
      bonds.push_back({laws.at(law).k, laws.at(law).rest, a - 1, b - 1});
    }
    if (!in) throw std::runtime_error("bad line of data: " + line);
  }
  for (std::size_t i = 0; i < mass.size(); ++i)
    if (weight[i] == 0) mass[i] = masses.at(type_[i]);
}

void ReferenceLammps::read_script() {
  std::ifstream file(folder_ / "scene.in");
  for (std::string line; std::getline(file, line);) {
    std::istringstream in(line);
    std::string word, id, of, style, skip;
    in >> word;
    if (word.empty() || word[0] == '#') continue;
    lines[word] = line;
    if (word == "timestep") in >> h;
    if (word == "reset_timestep") in >> first;
    if (word == "run") in >> steps;
    if (word != "fix") continue;
    in >> id >> of >> style;
    if (style == "viscous") in >> drag;
    double g[3] = {}, size = 0, length = 1;
    if (style == "gravity") in >> size >> skip;
    if (style != "gravity" && style != "efield") continue;
    in >> g[0] >> g[1] >> g[2];
    if (style == "gravity") length = std::sqrt(g[0] * g[0] + g[1] * g[1] + g[2] * g[2]);
    for (std::size_t i = 0; i < mass.size(); ++i)
      if (of == "free" || of == "mass" + std::to_string(type_[i]))
        for (std::size_t k = 0; k < 3; ++k)
          gravity[3 * i + k] =
              style == "gravity" ? mass[i] * size * g[k] / length : weight[i] * g[k];
  }
  std::ifstream list(folder_ / "moments.txt");
  for (long step = 0; list >> step;) moments.push_back(step);
}

void ReferenceLammps::forces() {
  f.assign(x.size(), 0.0);
  for (const Bond& bond : bonds) {
    const auto a = static_cast<std::size_t>(3 * bond.a), b = static_cast<std::size_t>(3 * bond.b);
    double d[3], square = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      d[k] = x[a + k] - x[b + k];
      square += d[k] * d[k];
    }
    const double r = std::sqrt(square);
    for (std::size_t k = 0; k < 3 && r > 0; ++k) {
      const double pull = -2 * bond.k * (r - bond.rest) / r * d[k];
      f[a + k] += pull;
      f[b + k] -= pull;
    }
  }
  for (std::size_t c = 0; c < f.size(); ++c)
    if (group[c / 3] == 1) f[c] += gravity[c] - drag * v[c];
}

void ReferenceLammps::run(int chunks) {
  std::ofstream out(folder_ / "frames.bin", std::ios::binary);
  forces();
  write_frame(out, first, chunks);
  std::size_t next = 0;
  for (long step = first + 1; step <= first + steps; ++step) {
    for (std::size_t c = 0; c < x.size(); ++c) {
      if (group[c / 3] != 1) continue;
      v[c] += h / 2 * f[c] / mass[c / 3];
      x[c] += h * v[c];
    }
    forces();
    for (std::size_t c = 0; c < x.size(); ++c)
      if (group[c / 3] == 1) v[c] += h / 2 * f[c] / mass[c / 3];
    if (step != moments.at(next)) continue;
    ++next;
    write_frame(out, step, chunks);
  }
}

void ReferenceLammps::write_frame(std::ofstream& out, long step, int chunks) const {
  const auto put = [&](auto value) {
    out.write(reinterpret_cast<const char*>(&value), sizeof value);
  };
  const std::string name = "DUMPCUSTOM", units = "si", columns = "id x y z vx vy vz fx fy fz ";
  const auto n = static_cast<int>(mass.size());
  put(-static_cast<std::int64_t>(name.size()));
  out << name;
  put(1);
  put(2);
  put(static_cast<std::int64_t>(step));
  put(static_cast<std::int64_t>(n));
  for (int k = 0; k < 7; ++k) put(0);
  for (int k = 0; k < 6; ++k) put(0.0);
  put(10);
  put(static_cast<int>(units.size()));
  out << units;
  put('\0');
  put(static_cast<int>(columns.size()));
  out << columns;
  put(chunks);
  for (int chunk = 0; chunk < chunks; ++chunk) {
    const int begin = n * chunk / chunks, end = n * (chunk + 1) / chunks;
    put(10 * (end - begin));
    for (int i = end - 1; i >= begin; --i) {
      put(static_cast<double>(i + 1));
      for (const auto* list : {&x, &v, &f})
        for (int k = 0; k < 3; ++k) put((*list)[static_cast<std::size_t>(3 * i + k)]);
    }
  }
}

}  // namespace sim_test
