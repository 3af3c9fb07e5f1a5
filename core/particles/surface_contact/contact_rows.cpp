#include "core/particles/surface_contact/contact_rows.h"

namespace sim {

void ContactRows::clear(std::size_t particles) {
  rows_.clear();
  state_.clear();
  moved_.assign(particles, 0);
  clock_ = 0;
}

void ContactRows::add(const ContactRow& row, std::span<const double> inverse_mass) {
  double sum = 0;
  for (std::size_t k = 0; k < 4 && row.ids[k] >= 0; ++k)
    sum += row.weights[k] * row.weights[k] * inverse_mass[static_cast<std::size_t>(row.ids[k])];
  rows_.push_back(row);
  state_.push_back({.mass = sum > 0 ? 1 / sum : 0});
}

}  // namespace sim
