// Arrays for numpy: a zip file of .npy files, stored as they are.
#include <bit>
#include <iostream>

#include "core/output/bytes.h"
#include "core/output/deflate.h"
#include "core/output/output.h"
#include "core/output/writer.h"
#include "core/plugin/plugin.h"

namespace {

// One array: doubles or 64-bit integers, a shape of which the first number is the frames.
struct Array {
  std::string name, inner;  // inner: "" or ", 64, 3": the rest of the shape
  bool integers = false;
  std::size_t frames = 0;
  std::string data;

  std::string file() const {
    std::string header = "{'descr': '";
    header += integers ? "<i8" : "<f8";
    header += "', 'fortran_order': False, 'shape': (" + std::to_string(frames);
    header += (inner.empty() ? "," : inner) + "), }";
    header.append(63 - (10 + header.size()) % 64, ' ');
    header += '\n';
    std::string out = "\x93NUMPY";
    out += std::string("\1\0", 2);
    sim::append_bytes(out, static_cast<std::uint16_t>(header.size()));
    return out + header + data;
  }
};

class Npz final : public sim::Writer {
 public:
  explicit Npz(const sim::WriterTask& task) : task_(task), output_({task.file}, std::cout) {
    for (const sim::Model& model : task.models) {
      const std::string prefix = task.world ? model.name + "." : "";
      const std::string points = ", " + std::to_string(model.particles) + ", 3";
      std::vector<Array> arrays{{prefix + "step", "", true, 0, ""},
                                {prefix + "t", "", false, 0, ""},
                                {prefix + "x", model.flat ? "" : points, false, 0, ""}};
      if (model.second_order)
        for (const char* name : {"v", "kinetic", "potential", "work", "drift"})
          arrays.push_back({prefix + name, std::string(name) == "v" ? points : "", false, 0, ""});
      systems_.push_back(std::move(arrays));
    }
  }

  sim::Pace pace() const override { return sim::Pace::kSteps; }

  void add(const sim::Moment& moment) override {
    for (std::size_t m = 0; m < moment.size(); ++m) {
      std::vector<Array>& arrays = systems_[m];
      const sim::Frame& frame = moment[m];
      for (Array& array : arrays) ++array.frames;
      sim::append_bytes(arrays[0].data, frame.step);
      sim::append_bytes(arrays[1].data, frame.t);
      const std::vector<double>& x = task_.models[m].flat ? frame.components : frame.x;
      if (task_.models[m].flat) arrays[2].inner = ", " + std::to_string(x.size());
      sim::append_bytes(arrays[2].data, std::span<const double>(x));
      if (arrays.size() == 3) continue;
      sim::append_bytes(arrays[3].data, std::span<const double>(frame.v));
      sim::append_bytes(arrays[4].data, frame.kinetic);
      sim::append_bytes(arrays[5].data, frame.potential);
      sim::append_bytes(arrays[6].data, frame.work);
      sim::append_bytes(arrays[7].data, frame.drift);
    }
  }

  // PKWARE's APPNOTE 4.3: files one after the other, then their directory.
  void commit() override {
    std::string directory;
    std::uint64_t at = 0, files = 0;
    for (const auto& arrays : systems_)
      for (const Array& array : arrays) {
        const std::string name = array.name + ".npy", data = array.file();
        if (at + data.size() > 0xFFFF0000U)
          throw sim::Error(sim::ErrorKind::kIo, {"too much for one .npz", task_.file,
                                                 "it would be above 4 GB", "a larger --every"});
        std::string common;
        for (const int word : {20, 0, 0, 0, 0x21})  // version, flags, stored, 1980-01-01
          sim::append_bytes(common, static_cast<std::uint16_t>(word));
        sim::append_bytes(common, sim::crc32_of(data));
        for (int times = 0; times < 2; ++times)
          sim::append_bytes(common, static_cast<std::uint32_t>(data.size()));
        sim::append_bytes(common, static_cast<std::uint16_t>(name.size()));
        sim::append_bytes(common, std::uint16_t{0});
        std::string& out = output_.buffer();
        out += "PK\3\4" + common + name + data;
        directory += std::string("PK\1\2\x14\0", 6) + common + std::string(10, '\0');
        sim::append_bytes(directory, static_cast<std::uint32_t>(at));
        directory += name;
        at += 4 + common.size() + name.size() + data.size();
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
