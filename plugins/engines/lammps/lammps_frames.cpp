#include "lammps_frames.h"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "core/base/error.h"
#include "lammps_input.h"

namespace sim::engine {

LammpsFrames::LammpsFrames(const std::string& folder, const Exchange& scene, Simulation& system)
    : file_(folder + "/" + kLammpsFrames),
      scene_(&scene),
      system_(&system),
      layout_(scene.particles()),
      state_(system.snapshot()),
      seen_(static_cast<std::size_t>(scene.particles())),
      first_(system.step_count()),
      step_(-1) {}

void LammpsFrames::refuse(const std::string& why) const {
  throw Error(ErrorKind::kCheckpoint, {"cannot read results", file_, why,
                                       "give the folder that sim export wrote, with the frames of "
                                       "its own run and no other"});
}

template <class T>
bool LammpsFrames::read(T* values, std::size_t count) {
  const auto bytes = static_cast<std::streamsize>(count * sizeof(T));
  stream_.read(reinterpret_cast<char*>(values), bytes);
  return stream_.gcount() == bytes;
}

// The header as LAMMPS's tools/binary2txt.cpp reads it, revision 2: a name, the order of bytes, the
// revision, the step, the box, the names of the columns.
bool LammpsFrames::read_head() {
  constexpr std::int64_t kLongestName = 64;
  const std::string wanted = "id x y z vx vy vz fx fy fz";
  std::int64_t name = 0, atoms = 0;
  std::int32_t order = 0, revision = 0, triclinic = 0, sides[6], columns = 0, length = 0;
  double box[9];
  char letters[kLongestName];
  if (!read(&name, 1)) return false;
  if (name >= 0 || name < -kLongestName) refuse("it is no binary dump of revision 2");
  if (!read(letters, static_cast<std::size_t>(-name)) || !read(&order, 1) || !read(&revision, 1) ||
      !read(&step_, 1))
    return false;
  if (order != 1 || revision < 2) refuse("it is no binary dump of revision 2");
  if (!read(&atoms, 1) || !read(&triclinic, 1) || !read(sides, 6) ||
      !read(box, triclinic ? 9 : 6) || !read(&columns, 1))
    return false;
  if (atoms != layout_.n())
    refuse("it has " + std::to_string(atoms) + " particles, the scene " +
           std::to_string(layout_.n()));
  if (!read(&length, 1)) return false;
  if (length < 0 || length > kLongestName) refuse("it is damaged");
  char timed = 0;
  double time = 0;
  if (!read(letters, static_cast<std::size_t>(length)) || !read(&timed, 1) ||
      (timed && !read(&time, 1)) || !read(&length, 1))
    return false;
  if (length < 0 || length > kLongestName) refuse("it is damaged");
  if (!read(letters, static_cast<std::size_t>(length))) return false;
  std::string names(letters, static_cast<std::size_t>(length));
  while (!names.empty() && names.back() == ' ') names.pop_back();
  if (columns != kLammpsColumns || names != wanted) refuse("its columns are not " + wanted);
  return true;
}

bool LammpsFrames::read_rows() {
  std::int32_t chunks = 0, numbers = 0;
  if (!read(&chunks, 1)) return false;
  seen_.assign(seen_.size(), false);
  std::int64_t left = std::int64_t{kLammpsColumns} * layout_.n();
  for (; chunks > 0; --chunks) {
    if (!read(&numbers, 1)) return false;
    if (numbers < 0 || numbers % kLammpsColumns != 0 || numbers > left) refuse("it is damaged");
    left -= numbers;
    rows_.resize(static_cast<std::size_t>(numbers));
    if (!read(rows_.data(), rows_.size())) return false;
    for (std::size_t at = 0; at < rows_.size(); at += kLammpsColumns) take(rows_.data() + at);
  }
  if (left != 0) refuse("a frame lacks particles");
  return true;
}

void LammpsFrames::take(const double* row) {
  if (!(row[0] >= 1 && row[0] <= layout_.n()) || row[0] != std::floor(row[0]))
    refuse("it has a particle that the scene has not");
  const int i = static_cast<int>(row[0]) - 1;
  if (seen_[static_cast<std::size_t>(i)]) refuse("it has a particle twice");
  seen_[static_cast<std::size_t>(i)] = true;
  const Vec3 x(row[1], row[2], row[3]), w(row[4], row[5], row[6]), f(row[7], row[8], row[9]);
  if (step_ == first_) {
    const Vec3 start = scene_->position(i);
    same_start_ = same_start_ && x == start;
    return;
  }
  if (!scene_->free(i)) return;
  const Vec3 v = scene_->map(i).velocity(w, f);
  for (int axis = 0; axis < 3; ++axis) {
    finite_ = finite_ && std::isfinite(x[axis]) && std::isfinite(v[axis]);
    layout_.block(state_.x.data(), axis)[i] = x[axis];
    layout_.block(state_.x.data(), 3 + axis)[i] = v[axis];
  }
}

Frames::Next LammpsFrames::next(std::int64_t last) {
  const std::int64_t before = step_;
  if (!stream_.is_open()) stream_.open(file_, std::ios::binary);
  // Half a frame is not tried: it is written in one go, soon.
  std::error_code failed;
  const auto size = static_cast<std::streamoff>(std::filesystem::file_size(file_, failed));
  const std::streamoff least = std::streamoff{8} * kLammpsColumns * layout_.n();
  if (!stream_.is_open() || failed || size < frame_ + least) return Next::kNone;
  stream_.clear();
  stream_.seekg(frame_);
  if (!read_head() || !read_rows()) {
    step_ = before;
    return Next::kNone;
  }
  frame_ = stream_.tellg();
  if (before < 0 && step_ != first_) refuse("it does not begin at step " + std::to_string(first_));
  if (before >= 0 && step_ <= before) refuse("its steps do not go on");
  if (!same_start_) refuse("it began with other positions");
  // The first one is ours: there, velocities are those that lead to the first step.
  if (step_ == first_) return next(last);
  if (step_ > last) return Next::kNone;
  if (!finite_) return Next::kNotFinite;
  state_.step = step_;
  system_->restore(state_);
  return Next::kState;
}

}  // namespace sim::engine
