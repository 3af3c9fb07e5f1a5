#include "core/session/checkpoint.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include "core/base/assert.h"
#include "core/base/error.h"
#include "core/base/hash.h"
#include "core/base/text.h"

namespace sim {
namespace {

constexpr std::string_view kMagic = "SIMSNAP\n";
constexpr std::uint64_t kVersion = 4;
constexpr std::uint64_t kWithoutProvenance = 3;  // a version that is read, too
constexpr std::uint64_t kWithBroken = 5;         // if some tie is broken

[[noreturn]] void refuse(const std::string& file, const std::string& why,
                         const std::string& remedy) {
  throw Error(ErrorKind::kCheckpoint, {"cannot resume", file, why, remedy});
}

std::uint64_t word_at(const char* bytes) {
  std::uint64_t word;
  std::memcpy(&word, bytes, 8);
  return word;
}

// The hash of bytes that come in blocks: words of 8 bytes, then the remaining bytes.
class ByteHash {
 public:
  // All blocks but the last are whole words.
  void add(std::string_view bytes) {
    SIM_ASSERT(!ended_);
    ended_ = bytes.size() % 8 != 0;
    for (; bytes.size() >= 8; bytes.remove_prefix(8)) hash_.add(word_at(bytes.data()));
    for (const char c : bytes) hash_.add(static_cast<std::uint64_t>(static_cast<unsigned char>(c)));
  }
  std::uint64_t value() const { return hash_.value(); }

 private:
  StateHash hash_;
  bool ended_ = false;
};

std::uint64_t hash_of(std::string_view bytes) {
  ByteHash hash;
  hash.add(bytes);
  return hash.value();
}

using Sink = std::function<void(std::string_view)>;

// Whole numbers and doubles as 8 bytes; texts and lists after their length; the hash at the end.
class ByteWriter {
 public:
  explicit ByteWriter(const Sink& sink) : sink_(sink) {}

  void raw(std::string_view value) {
    bytes_.append(value);
    pass();
  }
  void integer(std::uint64_t value) {
    char word[8];
    std::memcpy(word, &value, 8);
    raw({word, 8});
  }
  void number(double value) { integer(std::bit_cast<std::uint64_t>(value)); }
  void text(std::string_view value) {
    integer(value.size());
    raw(value);
  }
  // `zeros`: indices of numbers that are written as 0, ascending.
  void numbers(std::span<const double> values, std::span<const std::size_t> zeros = {}) {
    SIM_ASSERT(std::ranges::is_sorted(zeros) && (zeros.empty() || zeros.back() < values.size()));
    integer(values.size());
    for (std::size_t begin = 0; begin < values.size(); begin += kBlock) {
      const std::size_t count = std::min(kBlock, values.size() - begin), at = bytes_.size();
      bytes_.append(reinterpret_cast<const char*>(values.data() + begin), 8 * count);
      for (; !zeros.empty() && zeros.front() < begin + count; zeros = zeros.subspan(1))
        std::memset(bytes_.data() + at + 8 * (zeros.front() - begin), 0, 8);
      pass();
    }
  }
  void seal() {
    hash_.add(bytes_);
    sink_(bytes_);
    const std::uint64_t hash = hash_.value();
    sink_({reinterpret_cast<const char*>(&hash), 8});
  }

 private:
  static constexpr std::size_t kBlock = 256;  // numbers

  // Passes on all whole words.
  void pass() {
    if (bytes_.size() < 8 * kBlock) return;
    const std::string_view whole = std::string_view(bytes_).substr(0, bytes_.size() / 8 * 8);
    hash_.add(whole);
    sink_(whole);
    bytes_.erase(0, whole.size());
  }

  const Sink& sink_;
  ByteHash hash_;
  std::string bytes_;
};

class Reader {
 public:
  Reader(std::string_view bytes, const std::string& file) : rest_(bytes), file_(file) {}

  std::uint64_t integer() { return word_at(take(8).data()); }
  double number() { return std::bit_cast<double>(integer()); }
  std::size_t length(std::size_t size) {  // of a list with entries of so many bytes at least
    const std::uint64_t count = integer();
    if (count > rest_.size() / size) refuse(file_, "the file is damaged", "make it again");
    return static_cast<std::size_t>(count);
  }
  std::string text() { return std::string(take(length(1))); }
  std::vector<double> numbers() {
    std::vector<double> values(length(8));
    const std::string_view bytes = take(8 * values.size());
    if (!values.empty()) std::memcpy(values.data(), bytes.data(), bytes.size());
    return values;
  }
  bool empty() const { return rest_.empty(); }

 private:
  std::string_view take(std::size_t count) {
    if (count > rest_.size()) refuse(file_, "the file is damaged", "make it again");
    const std::string_view bytes = rest_.substr(0, count);
    rest_.remove_prefix(count);
    return bytes;
  }

  std::string_view rest_;
  const std::string& file_;
};

// The alternatives of Value that can be stored, by their index.
void write_value(ByteWriter& out, const Value& value) {
  out.integer(value.index());
  if (const auto* flag = std::get_if<bool>(&value)) {
    out.integer(*flag);
  } else if (const auto* integer = std::get_if<std::int64_t>(&value)) {
    out.integer(static_cast<std::uint64_t>(*integer));
  } else if (const auto* number = std::get_if<double>(&value)) {
    out.number(*number);
  } else if (const auto* text = std::get_if<std::string>(&value)) {
    out.text(*text);
  } else if (const auto* v = std::get_if<Vec3>(&value)) {
    for (int axis = 0; axis < 3; ++axis) out.number((*v)[axis]);
  } else if (value.index() > 5) {
    throw Error(ErrorKind::kCheckpoint,
                {"cannot save", "", "the integrator has a function among its parameters", ""});
  }
}

Value read_value(Reader& in, const std::string& file) {
  switch (in.integer()) {
    case 0:
      return {};
    case 1:
      return in.integer() != 0;
    case 2:
      return static_cast<std::int64_t>(in.integer());
    case 3:
      return in.number();
    case 4:
      return in.text();
    case 5: {
      Vec3 v;
      for (int axis = 0; axis < 3; ++axis) v[axis] = in.number();
      return v;
    }
    default:
      refuse(file, "the file is damaged", "make it again");
  }
}

bool all_finite(const std::vector<double>& values) {
  return std::ranges::all_of(values, [](double value) { return std::isfinite(value); });
}

// The first few of a list, and the number of the others.
std::string first_of(const std::vector<std::string>& names) {
  constexpr std::size_t kMost = 4;
  const std::size_t count = std::min(kMost, names.size());
  std::string text =
      join({names.begin(), names.begin() + static_cast<std::ptrdiff_t>(count)}, ", ");
  return names.size() > count ? text + " and " + std::to_string(names.size() - count) + " more"
                              : text;
}

// The digests of the parts of a scene.
void write_identity(ByteWriter& out, const SceneIdentity& identity) {
  out.integer(identity.size());
  for (const auto& [path, digest] : identity) {
    out.text(path);
    out.integer(digest);
  }
}

SceneIdentity read_identity(Reader& in) {
  SceneIdentity identity;
  for (std::size_t left = in.length(16); left > 0; --left) {
    std::string path = in.text();
    identity[std::move(path)] = in.integer();
  }
  return identity;
}

void write_provenance(ByteWriter& out, const Provenance& provenance) {
  out.text(provenance.program);
  out.integer(provenance.files.size());
  for (const InputFile& file : provenance.files) {
    out.text(file.name);
    out.text(file.path);
    out.integer(file.hash);
  }
  out.integer(provenance.arguments.size());
  for (const auto& [name, value] : provenance.arguments) {
    out.text(name);
    out.text(value);
  }
  out.text(provenance.doubt);
}

Provenance read_provenance(Reader& in) {
  Provenance provenance{in.text(), {}, {}, {}};
  for (std::size_t left = in.length(24); left > 0; --left) {
    InputFile& file = provenance.files.emplace_back();
    file.name = in.text();
    file.path = in.text();
    file.hash = in.integer();
  }
  for (std::size_t left = in.length(16); left > 0; --left) {
    std::string name = in.text();
    provenance.arguments[std::move(name)] = in.text();
  }
  provenance.doubt = in.text();
  return provenance;
}

}  // namespace

Checkpoint::System live_checkpoint(const Simulation& simulation, const SystemSpec& spec,
                                   double start_energy) {
  Snapshot snapshot = simulation.snapshot_without_state();
  const Settings& settings = *snapshot.settings;
  // A user's hold does not persist: a held particle is pinned.
  std::vector<std::size_t> zeros;
  for (const int i : settings.held)
    for (std::size_t axis = 0; axis < 3; ++axis)
      zeros.push_back(simulation.shape().find("velocity")->at(static_cast<std::size_t>(i), axis));
  std::ranges::sort(zeros);
  SIM_ASSERT(snapshot.n0 <= snapshot.step && settings.h > 0);
  return {simulation.name(),
          scene_identity(spec),
          settings.method.choice(),
          settings.h,
          snapshot.t0,
          snapshot.step,
          snapshot.n0,
          start_energy,
          settings.fixed(),
          settings.off,
          {},
          std::move(snapshot.memory),
          {},
          simulation.state(),
          std::move(zeros),
          settings.broken,
          settings.broken_energy};
}

Checkpoint::System checkpoint(const Simulation& simulation, const SystemSpec& spec,
                              double start_energy) {
  Checkpoint::System saved = live_checkpoint(simulation, spec, start_energy);
  saved.x.assign(saved.live.begin(), saved.live.end());
  for (const std::size_t i : saved.zeros) saved.x[i] = 0;
  saved.live = {};
  saved.zeros.clear();
  return saved;
}

void resume(Simulation& simulation, const SystemSpec& spec, const Checkpoint::System& saved,
            Registry& registry) {
  const std::string where = "system '" + saved.name + "'";
  std::vector<std::string> others;
  if (!saved.identity.empty()) others = differing(saved.identity, scene_identity(spec));
  if (!others.empty() || saved.x.size() != simulation.state().size())
    refuse(where,
           "the checkpoint is of another scene, or of one that was changed since" +
               (others.empty() ? "" : ", in " + first_of(others)),
           "give the scene and the --set it was made with");
  constexpr std::int64_t kMostSteps = std::int64_t{1} << 53;  // counted exactly in a double
  const auto ids_below = [](const std::vector<int>& ids, int count) {
    return std::ranges::is_sorted(ids, std::ranges::less_equal{}) &&
           (ids.empty() || (ids.front() >= 0 && ids.back() < count));
  };
  const bool timed = saved.h > 0 && std::isfinite(saved.h) && saved.t0 >= 0 && saved.n0 >= 0 &&
                     saved.n0 <= saved.step && saved.step < kMostSteps &&
                     std::isfinite(saved.t0 + static_cast<double>(saved.step - saved.n0) * saved.h);
  const bool ordered = ids_below(saved.pinned, simulation.particles()) &&
                       ids_below(saved.broken, simulation.breakable_ties());
  const bool finite = all_finite(saved.x) && all_finite(saved.memory) && all_finite(saved.work) &&
                      std::isfinite(saved.broken_energy);
  if (!ordered || !timed || !finite || (!saved.pinned.empty() && !simulation.second_order()))
    refuse(where, "its contents are inconsistent", "make the checkpoint again");
  std::vector<std::string> names;
  for (const auto& each : simulation.switches()) names.push_back(each.first);
  if (!std::ranges::is_sorted(saved.off, std::ranges::less_equal{}) ||
      !std::ranges::includes(names, saved.off))
    refuse(where, "it turns off what the scene has no switch for",
           "give the scene it was made with");
  const auto settings =
      std::make_shared<const Settings>(Settings{Method(registry, saved.integrator),
                                                saved.h,
                                                saved.pinned,
                                                saved.off,
                                                {},
                                                saved.broken,
                                                saved.broken_energy});
  const Snapshot before = simulation.snapshot();
  simulation.restore({settings, saved.step, saved.n0, saved.t0, saved.x, saved.memory});
  if (simulation.snapshot().memory == saved.memory) return;
  simulation.restore(before);
  refuse(where, "its integrator does not take what it says of the last steps",
         "make the checkpoint again");
}

void encode(const Checkpoint& checkpoint, const Sink& sink) {
  static_assert(std::endian::native == std::endian::little);
  ByteWriter out(sink);
  out.raw(kMagic);
  const bool any_broken = std::ranges::any_of(
      checkpoint.systems, [](const auto& system) { return !system.broken.empty(); });
  out.integer(any_broken ? kWithBroken : kVersion);
  out.text(checkpoint.scene);
  out.integer(checkpoint.seed);
  out.integer(checkpoint.settings.size());
  for (const auto& [name, value] : checkpoint.settings) {
    out.text(name);
    out.text(value);
  }
  write_provenance(out, checkpoint.provenance.value_or(Provenance()));
  out.integer(checkpoint.systems.size());
  for (const Checkpoint::System& system : checkpoint.systems) {
    out.text(system.name);
    write_identity(out, system.identity);
    out.text(system.integrator.name);
    out.integer(system.integrator.given.size());
    for (const auto& [name, value] : system.integrator.given) {
      out.text(name);
      write_value(out, value);
    }
    for (const double number : {system.h, system.t0, system.start_energy}) out.number(number);
    for (const std::int64_t number : {system.step, system.n0})
      out.integer(static_cast<std::uint64_t>(number));
    out.integer(system.pinned.size());
    for (const int id : system.pinned) out.integer(static_cast<std::uint64_t>(id));
    out.integer(system.off.size());
    for (const std::string& name : system.off) out.text(name);
    out.numbers(system.live.empty() ? system.x : system.live, system.zeros);
    out.numbers(system.memory);
    out.numbers(system.work);
    if (!any_broken) continue;
    out.integer(system.broken.size());
    for (const int tie : system.broken) out.integer(static_cast<std::uint64_t>(tie));
    out.number(system.broken_energy);
  }
  out.seal();
}

std::string encode(const Checkpoint& checkpoint) {
  std::string bytes;
  encode(checkpoint, [&](std::string_view block) { bytes += block; });
  return bytes;
}

std::string sealed(std::string_view bytes) {
  std::string all;
  const Sink sink = [&](std::string_view block) { all += block; };
  ByteWriter out(sink);
  out.raw(bytes);
  out.seal();
  return all;
}

bool looks_like_checkpoint(std::string_view bytes) { return bytes.starts_with(kMagic); }

Checkpoint decode(std::string_view bytes, const std::string& file) {
  if (!looks_like_checkpoint(bytes))
    refuse(file, "it is not a checkpoint file", "give a file that --snap or .snap wrote");
  Reader head(bytes.substr(kMagic.size()), file);
  const std::uint64_t version = head.integer();
  const bool has_provenance = version != kWithoutProvenance;
  if (version != kVersion && version != kWithBroken && has_provenance)
    refuse(file,
           "it is of version " + std::to_string(version) + ", not " + std::to_string(kVersion),
           "make it again with this program");
  std::uint64_t hash = 0;
  if (bytes.size() >= kMagic.size() + 16) std::memcpy(&hash, bytes.data() + bytes.size() - 8, 8);
  if (bytes.size() < kMagic.size() + 16 || hash != hash_of(bytes.substr(0, bytes.size() - 8)))
    refuse(file, "the file is damaged or cut off", "make it again");
  Reader in(bytes.substr(kMagic.size() + 8, bytes.size() - kMagic.size() - 16), file);
  Checkpoint checkpoint;
  checkpoint.scene = in.text();
  checkpoint.seed = in.integer();
  for (std::size_t left = in.length(16); left > 0; --left) {
    std::string name = in.text();
    checkpoint.settings[std::move(name)] = in.text();
  }
  if (has_provenance) checkpoint.provenance = read_provenance(in);
  for (std::size_t systems = in.length(16); systems > 0; --systems) {
    Checkpoint::System& system = checkpoint.systems.emplace_back();
    system.name = in.text();
    if (has_provenance)
      system.identity = read_identity(in);
    else
      in.integer();  // the hash of the scene as it was made then
    system.integrator.name = in.text();
    for (std::size_t left = in.length(16); left > 0; --left) {
      std::string name = in.text();
      system.integrator.given[std::move(name)] = read_value(in, file);
    }
    for (double* number : {&system.h, &system.t0, &system.start_energy}) *number = in.number();
    for (std::int64_t* number : {&system.step, &system.n0})
      *number = static_cast<std::int64_t>(in.integer());
    const auto read_ids = [&](std::vector<int>& ids) {
      for (std::size_t left = in.length(8); left > 0; --left) {
        const std::uint64_t id = in.integer();
        if (id >> 31) refuse(file, "the file is damaged", "make it again");
        ids.push_back(static_cast<int>(id));
      }
    };
    read_ids(system.pinned);
    for (std::size_t left = in.length(8); left > 0; --left) system.off.push_back(in.text());
    system.x = in.numbers();
    system.memory = in.numbers();
    system.work = in.numbers();
    if (version != kWithBroken) continue;
    read_ids(system.broken);
    system.broken_energy = in.number();
  }
  if (!in.empty()) refuse(file, "the file is damaged", "make it again");
  return checkpoint;
}

}  // namespace sim
