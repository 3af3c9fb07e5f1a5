#include "tests/bench/reach.h"

#include <cmath>
#include <string>

namespace sim_bench {
namespace {

// The state of a particle: position, velocity and mass.
constexpr double kSceneBytes = 7 * sizeof(double);

const KernelResult* find(const std::vector<KernelResult>& results, int n, const std::string& method,
                         int threads) {
  for (const KernelResult& r : results)
    if (r.n == n && r.integrator == method && r.threads == threads) return &r;
  return nullptr;
}

class Rows {
 public:
  explicit Rows(Table& table) : table_(table) {}

  // sign: +1 where more is better, -1 where less is.
  void add(const std::string& what, double value, double must, double aim, int sign,
           const std::string& unit) {
    const auto text = [&](double v) { return std::isnan(v) ? "" : short_number(v); };
    const bool met = sign * value >= sign * must;
    const bool aimed = !std::isnan(aim) && sign * value >= sign * aim;
    table_.add({what, text(value), text(must), text(aim), unit,
                aimed ? "aim"
                : met ? "must"
                      : "missed"});
  }

 private:
  Table& table_;
};

void add_peers(const PeerReport& peers, Rows& rows) {
  for (const PeerResult& r : peers.results)
    for (std::size_t i = 0; i < r.ours.size(); ++i) {
      const std::string size = "n = " + std::to_string(r.n);
      const int threads = r.threads[i];
      if (r.name == "odeint" && threads == 1)
        rows.add("rk4 against odeint, one thread, " + size, r.ratio(i), r.n <= 8 ? 4.5 : 5,
                 r.n <= 8 ? 5.5 : 7, 1, "times");
      if (r.name == "odeint" && threads == 2 && r.n >= 128)
        rows.add("rk4 on two threads against odeint's one, " + size, r.ratio(i), 9, 12, 1, "times");
      if (r.name == "lammps" && threads == 1 && r.n >= 32)
        rows.add("verlet against LAMMPS, one thread, " + size, r.ratio(i), 7, 10, 1, "times");
    }
}

}  // namespace

Table reach_table(const std::vector<KernelResult>& kernel, const std::vector<Variation>& variations,
                  const PeerReport& peers) {
  constexpr double kNone = NAN;
  Table table("reach", "What has to be reached",
              {{"figure", "figure", false},
               {"measured", "measured"},
               {"must", "must"},
               {"aim", "aim"},
               {"unit", "unit", false},
               {"", "verdict", false}});
  Rows rows(table);
  add_peers(peers, rows);

  const KernelResult* const small = find(kernel, 8, "rk4", 1);
  if (small)
    rows.add("rk4, n = 8, one thread", small->times.median * 1e6, 1.35, 1.1, -1, "us a step");
  if (const KernelResult* const two = find(kernel, 8, "rk4", 2); small && two)
    rows.add("rk4, n = 8, two threads over one", two->times.median / small->times.median, 1.05, 1,
             -1, "of the time");
  for (const Variation& v : variations)
    if (v.name == "random net")
      rows.add("random net, n = 128, rk4", v.spring_ns, 3, 2.5, -1, "ns a spring");
  if (!variations.empty())
    rows.add("three plugins against one fused force, n = 128",
             100 * (variations[0].times.median / variations[2].times.median - 1), 10, 5, -1,
             "% more");
  if (const KernelResult* const r = find(kernel, 512, "rk4", 1))
    rows.add("rk4, n = 512, beyond the scene", r->bytes - kSceneBytes, 210, 64, -1, "B a particle");
  if (const KernelResult* const r = find(kernel, 512, "symplectic_euler", 1))
    rows.add("symplectic_euler, n = 512, beyond the scene", r->bytes - kSceneBytes, 64, 64, -1,
             "B a particle");
  const KernelResult* const middle = find(kernel, 128, "rk4", 1);
  if (const KernelResult* const large = find(kernel, 1024, "rk4", 1); middle && large)
    rows.add("rk4, ns a spring at n = 1024 over n = 128", large->spring_ns() / middle->spring_ns(),
             1.5, kNone, -1, "times");
  return table;
}

}  // namespace sim_bench
