// The elements of a force or constraint: pairs, triples, quadruples or cells of particles, or
// single ones, as a scene lists them.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <initializer_list>
#include <map>
#include <numeric>
#include <span>
#include <string>
#include <vector>

#include "core/plugin/params.h"

namespace sim {

struct PluginInfo;

// The declaration of the elements that a plugin takes. Param::per_tie says which parameters an
// element may have values of its own for.
struct ElementKind {
  int arity = 0;             // particles that one joins, 1 to 4; 0: the plugin takes none
  const char* name = "tie";  // the name of one element
  bool cells = false;        // cells that fill a body, of 4 particles or of 10

  bool takes(int count) const { return arity > 0 && (count == arity || (cells && count == 10)); }
};

// The same pair at every position of a grid where both ends exist: (i, j, k) and (i, j, k) + step,
// where (i, j, k) is the particle first + (i * size[1] + j) * size[2] + k.
struct GridPairs {
  int first = 0;
  std::array<int, 3> size{0, 0, 1}, step{};
  double length = std::nan("");  // m, of the step in the grid

  std::array<int, 2> range(int axis) const;  // [begin, end) of the coordinate of the first end
  std::size_t count() const;
  // Equal parts of the step that are steps themselves: 2 of (0, 2), which passes over a particle.
  int parts() const { return std::gcd(std::gcd(step[0], step[1]), step[2]); }
};

// One element.
struct Element {
  std::span<const int> ids;
  std::ptrdiff_t index;  // in the list; -1: a pair of a grid
  double length;         // m, of a pair of a grid as the grid implies it; nan in the list
  int parts = 1;         // of a pair of a grid, see GridPairs
};

struct Elements {
  int arity = 2;
  bool cells = false;              // cells that fill a body
  std::vector<GridPairs> grids{};  // only of arity 2
  std::vector<int> ids{};          // the list: `arity` each
  // The parameter values of single elements, one number each; nan: not given.
  std::map<std::string, std::vector<double>> values{};

  // Numbers of each particle of the scene by their names, for plugins that ask for them: its mass
  // as "m", in kg and whether it is pinned or not, and the numbers it carries.
  std::map<std::string, std::vector<double>> carried{};

  bool empty() const { return grids.empty() && ids.empty(); }
  std::size_t listed() const { return ids.size() / static_cast<std::size_t>(arity); }
  std::size_t count() const;

  // Lists an element with the values it gives.
  void add(std::initializer_list<int> particles, const std::map<std::string, double>& given = {});

  // Calls visit(const Element&) for each, grids first, in a fixed order.
  template <class Visit>
  void for_each(Visit visit) const {
    for (const GridPairs& g : grids) {
      const auto [i0, i1] = g.range(0);
      const auto [j0, j1] = g.range(1);
      const auto [k0, k1] = g.range(2);
      const int stride = (g.step[0] * g.size[1] + g.step[1]) * g.size[2] + g.step[2];
      const int parts = g.parts();
      for (int i = i0; i < i1; ++i)
        for (int j = j0; j < j1; ++j)
          for (int k = k0; k < k1; ++k) {
            const int a = g.first + (i * g.size[1] + j) * g.size[2] + k;
            const int ends[2] = {a, a + stride};
            visit(Element{ends, -1, g.length, parts});
          }
    }
    const auto size = static_cast<std::size_t>(arity);
    for (std::size_t e = 0; e < listed(); ++e)
      visit(Element{{ids.data() + e * size, size}, static_cast<std::ptrdiff_t>(e), std::nan("")});
  }
};

// One parameter of every element: the element's own value, else that of the force; nan without
// either. The elements outlive it.
class ElementValues {
 public:
  ElementValues() = default;
  ElementValues(const Elements& elements, const Params& params, const std::string& name);

  double operator()(const Element& element) const {
    const double own = own_ && element.index >= 0 ? own_[element.index] : std::nan("");
    return std::isnan(own) ? otherwise_ : own;
  }

 private:
  const double* own_ = nullptr;
  double otherwise_ = std::nan("");
};

// Throws Error{kScene} unless the plugin takes such elements of `particles` particles, and all
// given and required values are complete.
void check_elements(const Elements& elements, const PluginInfo& plugin, const Params& params,
                    int particles, const SourceLocation& place);

}  // namespace sim
