// Films: pictures piped into ffmpeg, which is another program and has to be there.
#include <algorithm>
#include <exception>
#include <memory>
#include <thread>

#include "core/base/team.h"
#include "core/base/text.h"
#include "core/output/process.h"
#include "core/output/writer.h"
#include "core/plugin/plugin.h"

namespace {

constexpr std::size_t kMostAtOnce = 8;  // pictures drawn side by side

// How ffmpeg is asked for each format.
std::vector<std::string> codec(const std::string& format) {
  if (format == "webm")
    return {"-c:v",      "libvpx-vp9", "-crf",      "32", "-b:v",     "0",
            "-deadline", "realtime",   "-cpu-used", "6",  "-pix_fmt", "yuv420p"};
  if (format == "gif")
    return {"-filter_complex",
            "[0:v]split[a][b];[a]palettegen=max_colors=128[p];[b][p]paletteuse=dither=bayer"};
  return {"-c:v", "libx264",  "-preset", "veryfast",  "-crf",
          "20",   "-pix_fmt", "yuv420p", "-movflags", "+faststart"};
}

class Film final : public sim::Writer {
 public:
  explicit Film(const sim::WriterTask& task)
      : task_(task), program_(found_ffmpeg(task.file)), file_(task.file) {
    // Both sides even, as most codecs want.
    task_.look.width &= ~1;
    task_.look.height &= ~1;
  }

  sim::Pace pace() const override { return sim::Pace::kFilm; }

  void add(const sim::Moment& moment) override { moments_.push_back(moment); }

  void commit() override {
    if (moments_.empty()) return;
    // Pictures are drawn side by side, one a processor, and passed on in their order.
    const std::size_t at_once =
        std::clamp<std::size_t>(std::thread::hardware_concurrency(), 1, kMostAtOnce);
    sim::Gallery gallery(task_.models, moments_, task_.look, task_.panels);
    const int width = gallery.width(), height = gallery.height();
    std::vector<sim::Gallery> galleries(std::min(at_once, moments_.size()), gallery);
    std::vector<std::string> words{program_,   "-loglevel",
                                   "error",    "-y",
                                   "-f",       "rawvideo",
                                   "-pix_fmt", "rgb24",
                                   "-s",       std::to_string(width) + "x" + std::to_string(height),
                                   "-r",       sim::shortest(task_.fps),
                                   "-i",       "-"};
    for (const std::string& word : codec(task_.format)) words.push_back(word);
    words.push_back("file:" + file_.temporary());
    sim::Process ffmpeg(words);
    sim::Team team(static_cast<int>(galleries.size()));
    std::vector<const sim::Image*> images(galleries.size());
    std::vector<std::exception_ptr> failures(galleries.size());
    bool reads = true;
    for (std::size_t i = 0; i < moments_.size() && reads; i += galleries.size()) {
      if (task_.stop && task_.stop()) return;
      team.run([&](int rank) {
        const auto k = static_cast<std::size_t>(rank);
        try {
          images[k] = i + k < moments_.size() ? &galleries[k].draw(i + k) : nullptr;
        } catch (...) {
          failures[k] = std::current_exception();
        }
      });
      for (const std::exception_ptr& failure : failures)
        if (failure) std::rethrow_exception(failure);
      for (const sim::Image* image : images)
        reads = reads && (!image || ffmpeg.write({reinterpret_cast<const char*>(image->rgb.data()),
                                                  image->rgb.size()}));
    }
    if (const std::string why = ffmpeg.finish(); !why.empty())
      throw sim::Error(sim::ErrorKind::kIo, {"no film", task_.file, "ffmpeg says: " + why,
                                             "pictures always work: --out frame-%04d.png"});
    file_.commit();
  }

 private:
  static std::string found_ffmpeg(const std::string& file) {
    std::string program = sim::find_program("ffmpeg");
    if (!program.empty()) return program;
    throw sim::Error(sim::ErrorKind::kIo,
                     {"no program to make films", file, "ffmpeg is not in PATH",
                      "apt-get install ffmpeg, or write pictures: --out frame-%04d.png"});
  }

  sim::WriterTask task_;
  std::string program_;
  sim::FileBeside file_;
  std::vector<sim::Moment> moments_;
};

}  // namespace

SIM_PLUGIN(Writer, "mp4/webm/gif") {
  registrar.add(sim::Plugin<sim::Writer>{
      {.name = "mp4",
       .summary = "a film of the run in its own time, by ffmpeg; also .webm and .gif",
       .formula = "--out run.mp4 --fps 30"},
      [](const sim::Params&, const sim::WriterTask& task) {
        return std::make_unique<Film>(task);
      }});
}
