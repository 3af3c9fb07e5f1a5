// Arrays for numpy: a zip file of .npy files, stored as they are.
#include <bit>
#include <iostream>

#include "core/output/bytes.h"
#include "core/output/deflate.h"
#include "core/output/output.h"
#include "core/output/scratch_file.h"
#include "core/output/writer.h"
#include "core/plugin/plugin.h"

namespace {

// One array: doubles or 64-bit integers, a shape of which the first number is the frames. The
// numbers are in a scratch file, in blocks.
struct Array {
  std::string name, inner = "";  // inner: "" or ", 64, 3": the rest of the shape
  bool integers = false;
  std::size_t frames = 0;
  std::string block = "";
  std::vector<std::pair<std::uint64_t, std::uint64_t>> blocks = {};  // where, bytes
  std::uint64_t size = 0;
  std::uint32_t crc = 0;

  std::string header() const {
    std::string header = "{'descr': '";
    header += integers ? "<i8" : "<f8";
    header += "', 'fortran_order': False, 'shape': (" + std::to_string(frames);
    header += (inner.empty() ? "," : inner) + "), }";
    header.append(63 - (10 + header.size()) % 64, ' ');
    header += '\n';
    std::string out = "\x93NUMPY";
    out += std::string("\1\0", 2);
    sim::append_bytes(out, static_cast<std::uint16_t>(header.size()));
    return out + header;
  }

  template <class Numbers>
  void add(const Numbers& numbers, sim::ScratchFile& file) {
    sim::append_bytes(block, numbers);
    if (block.size() >= kBlock) store(file);
  }

  void store(sim::ScratchFile& file) {
    crc = sim::crc32_of(block, crc);
    size += block.size();
    blocks.emplace_back(file.append(block), block.size());
    block.clear();
  }

  static constexpr std::size_t kBlock = std::size_t{1} << 16;
};

class Npz final : public sim::Writer {
 public:
  explicit Npz(const sim::WriterTask& task)
      : task_(task), output_({task.file}, std::cout), numbers_(task.file) {
    for (const sim::Model& model : task.models) {
      const std::string prefix = task.world ? model.name + "." : "";
      const std::string points = ", " + std::to_string(model.particles) + ", 3";
      std::vector<Array> arrays{
          {prefix + "step", "", true}, {prefix + "t"}, {prefix + "x", model.flat ? "" : points}};
      if (model.second_order)
        for (const char* name : {"v", "kinetic", "potential", "work", "drift"})
          arrays.push_back({prefix + name, std::string(name) == "v" ? points : ""});
      systems_.push_back(std::move(arrays));
    }
  }

  sim::CostEstimate pace() const override { return sim::CostEstimate::kSteps; }

  void add(const sim::Moment& moment) override {
    for (std::size_t m = 0; m < moment.size(); ++m) {
      std::vector<Array>& arrays = systems_[m];
      const sim::Frame& frame = moment[m];
      for (Array& array : arrays) ++array.frames;
      arrays[0].add(frame.step, numbers_);
      arrays[1].add(frame.t, numbers_);
      const std::vector<double>& x = task_.models[m].flat ? frame.components : frame.x;
      if (task_.models[m].flat) arrays[2].inner = ", " + std::to_string(x.size());
      arrays[2].add(std::span<const double>(x), numbers_);
      if (arrays.size() == 3) continue;
      arrays[3].add(std::span<const double>(frame.v), numbers_);
      arrays[4].add(frame.kinetic, numbers_);
      arrays[5].add(frame.potential, numbers_);
      arrays[6].add(frame.work, numbers_);
      arrays[7].add(frame.drift, numbers_);
    }
  }

  // PKWARE's APPNOTE 4.3: files one after the other, then their directory.
  void commit() override {
    std::string directory;
    std::uint64_t at = 0, files = 0;
    for (auto& arrays : systems_)
      for (Array& array : arrays) {
        array.store(numbers_);
        const std::string name = array.name + ".npy", header = array.header();
        const std::uint64_t size = header.size() + array.size;
        if (at + size > 0xFFFF0000U)
          throw sim::Error(sim::ErrorKind::kIo, {"too much for one .npz", task_.file,
                                                 "it would be above 4 GB", "a larger --every"});
        std::string common;
        for (const int word : {20, 0, 0, 0, 0x21})  // version, flags, stored, 1980-01-01
          sim::append_bytes(common, static_cast<std::uint16_t>(word));
        sim::append_bytes(common, sim::joined_crc32(sim::crc32_of(header), array.crc, array.size));
        for (int times = 0; times < 2; ++times)
          sim::append_bytes(common, static_cast<std::uint32_t>(size));
        sim::append_bytes(common, static_cast<std::uint16_t>(name.size()));
        sim::append_bytes(common, std::uint16_t{0});
        std::string& out = output_.buffer();
        out += "PK\3\4" + common + name + header;
        for (const auto& [begin, bytes] : array.blocks)
          sim::append_scratch(output_, numbers_, begin, bytes);
        directory += std::string("PK\1\2\x14\0", 6) + common + std::string(10, '\0');
        sim::append_bytes(directory, static_cast<std::uint32_t>(at));
        directory += name;
        at += 4 + common.size() + name.size() + size;
        ++files;
        output_.flush_if_full();
      }
    std::string& out = output_.buffer();
    out += directory + "PK\5\6" + std::string(4, '\0');
    for (int times = 0; times < 2; ++times)
      sim::append_bytes(out, static_cast<std::uint16_t>(files));
    sim::append_bytes(out, static_cast<std::uint32_t>(directory.size()));
    sim::append_bytes(out, static_cast<std::uint32_t>(at));
    sim::append_bytes(out, std::uint16_t{0});
    output_.commit();
  }

 private:
  sim::WriterTask task_;
  sim::Output output_;
  sim::ScratchFile numbers_;
  std::vector<std::vector<Array>> systems_;
};

}  // namespace

SIM_PLUGIN(Writer, "npz") {
  registrar.add(sim::Plugin<sim::Writer>{
      {.name = "npz",
       .summary = "arrays for numpy: step, t, x, v and energies; in a world NAME.x",
       .formula = "np.load(\"run.npz\")[\"x\"]  # frames, particles, 3"},
      [](const sim::Params&, const sim::WriterTask& task) { return std::make_unique<Npz>(task); }});
}
