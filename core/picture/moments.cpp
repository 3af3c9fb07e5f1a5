#include "core/picture/moments.h"

namespace sim {

const Moment& Moments::at(std::size_t i, Moment& room) const {
  if (!store_ && system_ < 0) return moments_[i];
  const auto system = static_cast<std::size_t>(system_);
  if (!store_) return room = {moments_[i][system]};
  room = store_->get(i);
  if (system_ >= 0) room = {Frame(std::move(room[system]))};
  return room;
}

const Frame& Moments::head(std::size_t i, std::size_t system) const {
  const Moment& moment = store_ ? store_->head(i) : moments_[i];
  return moment[system_ < 0 ? system : static_cast<std::size_t>(system_)];
}

Moments Moments::of_system(std::size_t system) const {
  Moments moments = *this;
  moments.system_ = static_cast<int>(system);
  return moments;
}

}  // namespace sim
