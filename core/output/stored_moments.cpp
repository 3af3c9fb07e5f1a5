#include "core/output/stored_moments.h"

#include <array>

namespace sim {
namespace {

constexpr std::array kArrays{&Frame::x, &Frame::v, &Frame::components, &Frame::values};

// A copy without its arrays.
Frame head_of(const Frame& frame) {
  Frame head;
  head.step = frame.step, head.t = frame.t;
  head.solids = frame.solids;
  head.kinetic = frame.kinetic, head.potential = frame.potential;
  head.work = frame.work, head.drift = frame.drift;
  head.note = frame.note;
  head.torn = frame.torn;
  head.paths = frame.paths;
  return head;
}

}  // namespace

void StoredMoments::add(const Moment& moment) {
  StoredFrame kept;
  kept.at = file_.size();
  for (const Frame& frame : moment) {
    kept.head.push_back(head_of(frame));
    for (const auto array : kArrays) {
      const std::vector<double>& values = frame.*array;
      kept.sizes.push_back(values.size());
      file_.append({reinterpret_cast<const char*>(values.data()), 8 * values.size()});
    }
  }
  kept_.push_back(std::move(kept));
}

Moment StoredMoments::get(std::size_t i) const {
  const StoredFrame& kept = kept_[i];
  Moment moment = kept.head;
  std::uint64_t at = kept.at;
  std::size_t next = 0;
  for (Frame& frame : moment)
    for (const auto array : kArrays) {
      std::vector<double>& values = frame.*array;
      values.resize(kept.sizes[next++]);
      file_.read(at, reinterpret_cast<char*>(values.data()), 8 * values.size());
      at += 8 * values.size();
    }
  return moment;
}

}  // namespace sim
