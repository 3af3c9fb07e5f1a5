// Films: pictures piped into ffmpeg, which is another program and has to be there.
#include <algorithm>
#include <condition_variable>
#include <exception>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>

#include "core/base/text.h"
#include "core/base/thread_start.h"
#include "core/output/process.h"
#include "core/output/stored_moments.h"
#include "core/output/writer.h"
#include "core/picture/gallery.h"
#include "core/plugin/plugin.h"

namespace {

constexpr std::size_t kMostAtOnce = 8;  // threads that draw

// The options of ffmpeg for each format.
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

// Pictures of a film, drawn ahead by one thread a processor and taken in their order. Where the
// system gives no thread, the taker draws.
class Drawers {
 public:
  // Each thread has a copy of the gallery.
  Drawers(sim::Gallery& gallery, std::size_t pictures) : gallery_(gallery), pictures_(pictures) {
    const std::size_t most = std::min(
        pictures, std::clamp<std::size_t>(std::thread::hardware_concurrency(), 1, kMostAtOnce));
    drawn_.resize(most);
    for (std::size_t k = 0; k < most; ++k) {
      std::jthread thread;
      if (!sim::start_thread(thread,
                             [this, own = std::make_shared<sim::Gallery>(gallery)] { draw(*own); }))
        break;
      threads_.push_back(std::move(thread));
    }
  }

  // The i-th, valid until the next call.
  const sim::Image& take(std::size_t i) {
    if (threads_.empty()) return gallery_.draw(i);
    std::unique_lock lock(mutex_);
    std::optional<sim::Image>& drawn = drawn_[i % drawn_.size()];
    changed_.wait(lock, [&] { return drawn || failure_; });
    if (failure_) std::rethrow_exception(failure_);
    std::swap(taken_, *drawn);
    drawn.reset();
    taken_to_ = i + 1;
    changed_.notify_all();
    return taken_;
  }

 private:
  // Whichever picture is next, one ahead of the taker.
  void draw(sim::Gallery& gallery) {
    try {
      std::unique_lock lock(mutex_);
      while (next_ < pictures_ && !over_) {
        const std::size_t i = next_++;
        lock.unlock();
        const sim::Image& image = gallery.draw(i);
        lock.lock();
        std::optional<sim::Image>& drawn = drawn_[i % drawn_.size()];
        changed_.wait(lock, [&] { return over_ || (!drawn && i < taken_to_ + drawn_.size()); });
        if (over_) return;
        drawn = image;
        changed_.notify_all();
      }
    } catch (...) {
      const std::lock_guard lock(mutex_);
      failure_ = std::current_exception();
      changed_.notify_all();
    }
  }

  sim::Gallery& gallery_;
  std::size_t pictures_, next_ = 0, taken_to_ = 0;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<std::optional<sim::Image>> drawn_;  // the i-th picture at i, in turns
  sim::Image taken_;
  std::exception_ptr failure_;
  bool over_ = false;
  std::vector<std::jthread> threads_;  // destroyed before the data that they use
  // The first to go, also where the constructor fails: the threads do not wait any more.
  struct End {
    Drawers& drawers;
    ~End() {
      {
        const std::lock_guard lock(drawers.mutex_);
        drawers.over_ = true;
      }
      drawers.changed_.notify_all();
    }
  } end_{*this};
};

class Film final : public sim::Writer {
 public:
  explicit Film(const sim::WriterTask& task)
      : task_(task), program_(found_ffmpeg(task.file)), file_(task.file), moments_(task.file) {
    // Both sides even, as most codecs want.
    task_.look.width &= ~1;
    task_.look.height &= ~1;
  }

  sim::CostEstimate pace() const override { return sim::CostEstimate::kFilm; }

  void add(const sim::Moment& moment) override { moments_.add(moment); }

  void commit() override {
    if (moments_.size() == 0) return;
    sim::Gallery gallery(task_.models, moments_, task_.look, task_.panels);
    const int width = gallery.width(), height = gallery.height();
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
    Drawers drawers(gallery, moments_.size());
    bool taken = true;
    for (std::size_t i = 0; taken && i < moments_.size(); ++i) {
      if (task_.stop && task_.stop()) return;
      const sim::Image& image = drawers.take(i);
      taken = ffmpeg.write({reinterpret_cast<const char*>(image.rgb.data()), image.rgb.size()});
    }
    std::string why = ffmpeg.finish();
    if (why.empty() && !taken) why = "nothing, and took no more pictures";
    if (!why.empty())
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
  sim::StoredMoments moments_;
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
