#include "core/lua/dimension.h"

#include <cctype>
#include <cmath>

namespace sim {
namespace {

struct NamedUnit {
  std::string_view name;
  int m, s, kg;
  double size;
};

constexpr double kDegree = 3.14159265358979323846 / 180;
constexpr NamedUnit kNamedUnits[] = {
    {"1", 0, 0, 0, 1},         {"rad", 0, 0, 0, 1},     {"degrees", 0, 0, 0, kDegree},
    {"deg", 0, 0, 0, kDegree}, {"m", 1, 0, 0, 1},       {"km", 1, 0, 0, 1e3},
    {"cm", 1, 0, 0, 1e-2},     {"mm", 1, 0, 0, 1e-3},   {"um", 1, 0, 0, 1e-6},
    {"s", 0, 1, 0, 1},         {"ms", 0, 1, 0, 1e-3},   {"us", 0, 1, 0, 1e-6},
    {"Hz", 0, -1, 0, 1},       {"kg", 0, 0, 1, 1},      {"g", 0, 0, 1, 1e-3},
    {"N", 1, -2, 1, 1},        {"kN", 1, -2, 1, 1e3},   {"mN", 1, -2, 1, 1e-3},
    {"J", 2, -2, 1, 1},        {"kJ", 2, -2, 1, 1e3},   {"mJ", 2, -2, 1, 1e-3},
    {"W", 2, -3, 1, 1},        {"Pa", -1, -2, 1, 1},    {"kPa", -1, -2, 1, 1e3},
    {"MPa", -1, -2, 1, 1e6},   {"GPa", -1, -2, 1, 1e9},
};

// "m", "s2", "m^3": one factor to the power that stands behind it, `sign` being -1 below a line.
bool multiply(Dimension& product, std::string_view factor, int sign) {
  std::size_t end = factor.size();
  while (end > 1 && std::isdigit(static_cast<unsigned char>(factor[end - 1]))) --end;
  int power = 1;
  if (end < factor.size()) {
    if (factor.size() - end > 1) return false;
    power = factor[end] - '0';
    if (factor[end - 1] == '^') --end;
  }
  const std::string_view name = factor.substr(0, end);
  for (const NamedUnit& unit : kNamedUnits) {
    if (unit.name != name) continue;
    const int by = sign * power;
    product.power[0] += by * unit.m;
    product.power[1] += by * unit.s;
    product.power[2] += by * unit.kg;
    product.size *= std::pow(unit.size, by);
    return true;
  }
  return false;
}

}  // namespace

bool operator==(const Dimension& a, const Dimension& b) {
  constexpr double kRounding = 1e-12;
  return a.power == b.power && std::abs(a.size - b.size) <= kRounding * std::abs(a.size);
}

std::optional<Dimension> dimension_of(std::string_view text) {
  Dimension product;
  int sign = 1;
  bool wanted = true;  // a factor
  for (std::size_t i = 0; i < text.size();) {
    if (text[i] == ' ' || text[i] == '*' || text[i] == '/') {
      if (text[i] != ' ' && wanted) return {};
      if (text[i] != ' ') wanted = true;
      sign = text[i] == '/' ? -1 : text[i] == '*' ? 1 : wanted ? sign : 1;
      ++i;
      continue;
    }
    std::size_t end = i;
    while (end < text.size() && text[end] != ' ' && text[end] != '*' && text[end] != '/') ++end;
    if (!multiply(product, text.substr(i, end - i), sign)) return {};
    i = end;
    wanted = false;
  }
  return wanted ? std::nullopt : std::optional(product);
}

}  // namespace sim
