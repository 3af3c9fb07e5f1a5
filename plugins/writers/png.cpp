// Pictures: the last moment of a run, or all of them under numbered names.
#include <filesystem>
#include <iostream>
#include <optional>

#include "core/output/output.h"
#include "core/output/png.h"
#include "core/output/staging_folder.h"
#include "core/output/stored_moments.h"
#include "core/output/writer.h"
#include "core/picture/gallery.h"
#include "core/plugin/plugin.h"

namespace {

constexpr int kMostTrails = 80;  // particles of a scene whose last picture may show a trail

// "%d" or "%04d" in the name of a file, not of its folder.
class Numbering {
 public:
  explicit Numbering(const std::string& file) : at_(file.find('%', file.find_last_of('/') + 1)) {
    if (single()) return;
    std::size_t end = at_ + 1;
    for (; end < file.size() && file[end] >= '0' && file[end] <= '9' && width_ < 20; ++end)
      width_ = 10 * width_ + static_cast<std::size_t>(file[end] - '0');
    if (end >= file.size() || file[end] != 'd' || width_ > 12 ||
        file.find('%', end) != std::string::npos)
      throw sim::Error(sim::ErrorKind::kUsage,
                       {"bad name of pictures", file, "their number is %d or %04d, once",
                        "as in frame-%04d.png"});
    length_ = end + 1 - at_;
  }
  bool single() const { return at_ == std::string::npos; }
  std::string name(const std::string& file, std::size_t number) const {
    std::string digits = std::to_string(number);
    if (digits.size() < width_) digits.insert(0, width_ - digits.size(), '0');
    return std::string(file).replace(at_, length_, digits);
  }

 private:
  std::size_t at_, length_ = 0, width_ = 0;
};

class Png final : public sim::Writer {
 public:
  explicit Png(const sim::WriterTask& task) : task_(task), numbering_(task.file) {
    if (numbering_.single()) {
      single_.emplace(sim::Target{task.file}, std::cout);
    } else {  // errors of the folder are reported before the run
      sim::Output(sim::Target{numbering_.name(task.file, 0)}, std::cout);
      series_.emplace(std::filesystem::path(task.file).parent_path());
    }
    int particles = 0;
    for (const sim::Model& model : task.models) particles += model.particles;
    if (!numbering_.single() || particles <= kMostTrails) stored_.emplace(task.file);
  }

  // A trail needs the moments before.
  sim::CostEstimate pace() const override {
    return stored_ ? sim::CostEstimate::kFilm : sim::CostEstimate::kLast;
  }

  void add(const sim::Moment& moment) override {
    if (stored_)
      stored_->add(moment);
    else
      last_ = {moment};
  }

  void commit() override {
    const sim::Moments moments = stored_ ? sim::Moments(*stored_) : sim::Moments(last_);
    if (moments.empty()) return;
    sim::Gallery gallery(task_.models, moments, task_.look, task_.panels);
    if (numbering_.single()) {
      single_->buffer() = sim::png(gallery.draw(moments.size() - 1));
      single_->commit();
      return;
    }
    std::size_t count = 0;
    for (; count < moments.size() && !(task_.stop && task_.stop()); ++count) {
      const std::string name = numbering_.name(task_.file, count);
      sim::Output file(series_->temporary() / std::filesystem::path(name).filename(), name);
      file.buffer() = sim::png(gallery.draw(count));
      file.commit();
    }
    series_->commit();
    sim::remove_later_files(count, [&](std::size_t i) { return numbering_.name(task_.file, i); });
  }

 private:
  sim::WriterTask task_;
  Numbering numbering_;
  std::optional<sim::Output> single_;
  std::optional<sim::StagingFolder> series_;
  std::optional<sim::StoredMoments> stored_;  // all moments, or only the last one
  std::vector<sim::Moment> last_;
};

}  // namespace

SIM_PLUGIN(Writer, "png") {
  registrar.add(sim::Plugin<sim::Writer>{
      {.name = "png",
       .summary = "a picture of the last moment; with %04d in its name one of each",
       .formula = "--out last.png, --out frame-%04d.png",
       .source = "ISO/IEC 15948"},
      [](const sim::Params&, const sim::WriterTask& task) { return std::make_unique<Png>(task); }});
}
