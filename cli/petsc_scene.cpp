#include "cli/petsc_scene.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>

namespace sim::petsc {
namespace {

class Reader {
 public:
  Reader() : file_(::open(engine::kPetscScene, O_RDONLY | O_CLOEXEC)) {}
  ~Reader() {
    if (file_ >= 0) ::close(file_);
  }
  Reader(const Reader&) = delete;
  Reader& operator=(const Reader&) = delete;

  // Numbers [begin, end) of an array that stands at `at`.
  template <class Number>
  bool read(std::vector<Number>& out, std::int64_t at, std::int64_t begin, std::int64_t end) const {
    out.resize(static_cast<std::size_t>(end - begin));
    return bytes(out.data(), out.size() * sizeof(Number),
                 at + begin * static_cast<std::int64_t>(sizeof(Number)));
  }
  bool bytes(void* out, std::size_t count, std::int64_t at) const {
    for (std::size_t done = 0; done < count;) {
      const ssize_t got = ::pread(file_, static_cast<char*>(out) + done, count - done,
                                  static_cast<off_t>(at) + static_cast<off_t>(done));
      if (got <= 0) return false;
      done += static_cast<std::size_t>(got);
    }
    return true;
  }

 private:
  int file_;
};

}  // namespace

bool read_scene(Scene& scene, int rank, int ranks) {
  const Reader file;
  engine::PetscHead& head = scene.head;
  if (!file.bytes(&head, sizeof head, 0) || std::memcmp(head.magic, engine::kPetscMagic, 8) != 0 ||
      head.n < 1 || head.ends < 0 || head.moments < 1)
    return false;
  const std::int64_t n = head.n, share = n / ranks, more = n % ranks;
  scene.begin = static_cast<PetscInt>(rank * share + std::min<std::int64_t>(rank, more));
  scene.end = scene.begin + static_cast<PetscInt>(share + (rank < more ? 1 : 0));
  std::int64_t at = sizeof head;
  const auto take = [&](auto& out, std::int64_t begin, std::int64_t end, std::int64_t count) {
    const bool good = file.read(out, at, begin, end);
    at += count * 8;
    return good;
  };
  if (!take(scene.first, scene.begin, scene.end + 1, n + 1)) return false;
  const std::int64_t low = scene.first.front(), high = scene.first.back();
  if (!take(scene.mass, scene.begin, scene.end, n) ||
      !take(scene.x, 3 * scene.begin, 3 * scene.end, 3 * n) ||
      !take(scene.v, 3 * scene.begin, 3 * scene.end, 3 * n) ||
      !take(scene.k, low, high, head.ends) || !take(scene.rest, low, high, head.ends) ||
      !take(scene.other, low, high, head.ends) ||
      !take(scene.moments, 0, head.moments, head.moments))
    return false;
  for (std::int64_t& each : scene.first) each -= low;
  for (std::int64_t& each : scene.other) {
    scene.moves.push_back(each >= 0);
    if (each < 0) each = -1 - each;
    if (each >= n) return false;
  }
  for (const std::int64_t each : scene.other)
    if (each < scene.begin || each >= scene.end)
      scene.ghosts.push_back(static_cast<PetscInt>(each));
  std::ranges::sort(scene.ghosts);
  scene.ghosts.erase(std::unique(scene.ghosts.begin(), scene.ghosts.end()), scene.ghosts.end());
  for (const std::int64_t each : scene.other) {
    const auto other = static_cast<PetscInt>(each);
    const auto ghost = std::ranges::lower_bound(scene.ghosts, other) - scene.ghosts.begin();
    scene.local.push_back(other >= scene.begin && other < scene.end
                              ? other - scene.begin
                              : scene.own() + static_cast<PetscInt>(ghost));
  }
  return true;
}

}  // namespace sim::petsc
