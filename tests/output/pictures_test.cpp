// Pictures, films and pages, decoded by other code than wrote them.
#include <catch2/catch.hpp>

#include "core/output/png.h"
#include "tests/output/readers.h"
#include "tests/output/written.h"
#include "tests/support/skip.h"

namespace sim_test {
namespace {

std::vector<std::string> run_of(const std::vector<std::string>& files) {
  std::vector<std::string> words{"strip.lua", "-q",     "--no-verify", "--every",
                                 "1",         "--size", "160x90"};
  for (const std::string& file : files) words.insert(words.end(), {"--out", file});
  return words;
}

// The pixels of the frames of a film, as ffmpeg decodes them.
std::vector<std::string> film_frames(const WritingFolder& folder, const std::string& file) {
  folder.run({"-v", "error", "-i", file, "-f", "rawvideo", "-pix_fmt", "rgb24", file + ".rgb"},
             "/usr/bin/ffmpeg");
  const std::string all = folder.text(file + ".rgb");
  constexpr std::size_t kFrame = 3UL * 160 * 90;
  REQUIRE(all.size() % kFrame == 0);
  std::vector<std::string> frames;
  for (std::size_t at = 0; at < all.size(); at += kFrame) frames.push_back(all.substr(at, kFrame));
  return frames;
}

double mean_difference(const std::string& pixels, const Pixels& image) {
  REQUIRE(pixels.size() == image.rgb.size());
  double sum = 0;
  for (std::size_t i = 0; i < pixels.size(); ++i)
    sum += std::abs(static_cast<std::uint8_t>(pixels[i]) - image.rgb[i]);
  return sum / static_cast<double>(pixels.size());
}

}  // namespace

TEST_CASE("a PNG has the pixels of its image, whatever they are", "[output]") {
  std::uint32_t random = 7;
  for (const auto& [width, height] : {std::pair{1, 1}, {2, 1}, {1, 3}, {7, 5}, {64, 48}, {301, 3}})
    for (const bool smooth : {false, true}) {
      sim::Image image;
      image.width = width;
      image.height = height;
      for (int i = 0; i < 3 * width * height; ++i) {
        random = random * 1664525 + 1013904223;
        image.rgb.push_back(static_cast<std::uint8_t>(smooth ? i / 3 : random >> 24));
      }
      const Pixels read = read_png(sim::png(image));
      CHECK(read.width == width);
      CHECK(read.height == height);
      CHECK(read.rgb == image.rgb);
    }
}

TEST_CASE("pictures of a run are those of its moments", "[output]") {
  const WritingFolder folder;
  folder.run(run_of({"a.png", "n-%02d.png"}));
  const Pixels last = read_png(folder.text("a.png"));
  CHECK(last.width == 160);
  CHECK(last.height == 90);
  CHECK(last.rgb == read_png(folder.text("n-04.png")).rgb);
  CHECK(last.rgb != read_png(folder.text("n-00.png")).rgb);
  // The number belongs to the name, whatever the folder is called.
  for (const std::string sub : {"a folder", "50%"}) {
    std::filesystem::create_directory(folder.at(sub));
    folder.run(run_of({sub + "/n-%02d.png", folder.at(sub + "/whole-%d.png").string()}));
    for (const char* name : {"/n-04.png", "/whole-4.png"})
      CHECK(read_png(folder.text(sub + name)).rgb == last.rgb);
  }
}

TEST_CASE("films have the pictures of the run in their order", "[output]") {
  need_program("ffmpeg", "ffmpeg");
  const WritingFolder folder;
  // The strip falls farther from picture to picture than the codecs blur.
  std::vector<std::string> words = run_of({"n-%02d.png", "a.mp4", "a.webm", "a.gif"});
  words.insert(words.end(), {"-i", "rk4", "-d", "0.1", "-T", "0.4", "--springs", "all"});
  folder.run(words);
  for (const char* file : {"a.mp4", "a.webm", "a.gif"}) {
    INFO(file);
    const auto frames = film_frames(folder, file);
    REQUIRE(frames.size() == kStripFrames);
    for (std::size_t f = 0; f < kStripFrames; ++f) {
      const auto apart = [&](std::size_t k) {
        return mean_difference(frames[f],
                               read_png(folder.text("n-0" + std::to_string(k) + ".png")));
      };
      CHECK(apart(f) < 6);
      for (std::size_t k = 0; k < kStripFrames; ++k)
        if (k != f) CHECK(apart(f) < apart(k));
    }
  }
}

TEST_CASE("a page has the positions, springs, triangles and energies of its run", "[output]") {
  const WritingFolder folder;
  folder.run(run_of({"a.html"}));
  const std::string page = folder.text("a.html");
  const auto frames = strip_frames();
  const std::size_t text = page.find("text=\"") + 6;
  const std::string data = inflated(from_base64(page.substr(text, page.find('"', text) - text)));
  std::size_t at = 0;
  const auto integer = [&] {
    at += 4;
    return number_at<std::int32_t>(data, at - 4);
  };
  for (const auto& triangle : kStripTriangles)
    for (const int corner : triangle) CHECK(integer() == corner);
  for (const int family : {0, 1}) {
    for (const StripSpring& spring : kStripSprings)
      if (spring.family == family) {
        CHECK(integer() == spring.a);
        CHECK(integer() == spring.b);
      }
    for (const StripSpring& spring : kStripSprings)
      if (spring.family == family) {
        CHECK(number_at<float>(data, at) == static_cast<float>(spring.rest));
        at += 4;
      }
  }
  const auto times = numbers_behind(page, "\"t\":");
  const auto axes = numbers_behind(page, "\"axes\":"), low = numbers_behind(page, "\"low\":"),
             origin = numbers_behind(page, "\"origin\":");
  const double scale = number_behind(page, "\"scale\":"),
               quantum = number_behind(page, "\"quantum\":");
  constexpr std::size_t kRow = 3 * kStripParticles, kNumbers = kRow * kStripFrames;
  REQUIRE((times.size() == kStripFrames && axes.size() == 9 && data.size() == at + 2 * kNumbers));
  std::array<int, kRow> q{};
  for (std::size_t f = 0; f < kStripFrames; ++f) {
    CHECK(times[f] == Approx(frames[f].t).epsilon(1e-6));
    for (std::size_t i = 0; i < kRow; ++i) {
      const std::size_t k = at + f * kRow + i;
      q[i] += static_cast<std::uint8_t>(data[k]) | static_cast<std::uint8_t>(data[k + kNumbers])
                                                       << 8;
      q[i] = static_cast<std::int16_t>(q[i]);
    }
    for (std::size_t i = 0; i < kStripParticles; ++i)
      for (std::size_t c = 0; c < 3; ++c) {
        double x = origin[c];
        for (std::size_t k = 0; k < 3; ++k)
          x += (low[k] + (q[3 * i + k] + 32768) * quantum) * axes[3 * k + c] / scale;
        CHECK(x == Approx(frames[f].x[i][c]).margin(2 * quantum / scale + 1e-5));
      }
  }
  const std::size_t energy = page.find("\"energy\":");
  const auto kinetic = numbers_behind(page, "\"kinetic\":", energy),
             potential = numbers_behind(page, "\"potential\":", energy),
             total = numbers_behind(page, "\"total\":", energy);
  for (std::size_t f = 0; f < kStripFrames; ++f) {
    CHECK(kinetic.at(f) == Approx(frames[f].kinetic).epsilon(1e-4));
    CHECK(potential.at(f) == Approx(frames[f].potential).epsilon(1e-4));
    CHECK(total.at(f) == Approx(frames[f].total()).epsilon(1e-4));
  }
  CHECK(numbers_behind(page, "\"pinned\":") == std::vector<double>{0});
}

TEST_CASE("each ending that a writer offers is read back by a test", "[output]") {
  const std::string tables = "tests/output/tables_test.cpp",
                    data = "tests/output/data_files_test.cpp",
                    pictures = "tests/output/pictures_test.cpp",
                    h5md = "tests/cli/cli_h5md_test.cpp";
  const std::map<std::string, std::string> readers{
      {"csv", tables},   {"jsonl", tables},  {"npz", data},     {"vtp", data},
      {"pvd", data},     {"ply", data},      {"obj", data},     {"pc2", data},
      {"xyz", data},     {"png", pictures},  {"mp4", pictures}, {"webm", pictures},
      {"gif", pictures}, {"html", pictures}, {"h5", h5md},      {"h5md", h5md},
      {"hdf5", h5md}};
  const WritingFolder folder;
  const std::string list = folder.run({"list", "writers", "--json"}).out;
  const auto check = [&](const std::string& ending) {
    INFO("nobody reads back what is written as ." << ending);
    REQUIRE(readers.contains(ending));
    const std::string source = read_text(std::string(SIM_SOURCE_DIR) + "/" + readers.at(ending));
    CHECK(source.find("." + ending + "\"") != std::string::npos);
  };
  int found = 0;
  for (std::size_t at = list.find("\"name\":\""); at != std::string::npos;
       at = list.find("\"name\":\"", at + 1)) {
    const std::size_t end = list.find(']', at);
    std::string names = list.substr(at + 7, end - at - 7);
    names.replace(names.find("\"aliases\":["), 11, "");
    for (std::size_t open = names.find('"'); open != std::string::npos;) {
      const std::size_t close = names.find('"', open + 1);
      check(names.substr(open + 1, close - open - 1));
      ++found;
      open = names.find('"', close + 1);
    }
  }
  CHECK(found >= 14);
}

}  // namespace sim_test
