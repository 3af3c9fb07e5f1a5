// The rasteriser: golden hashes of pixels with the count of those covered, and pictures of
// nonsense.
#include "core/picture/raster/raster.h"

#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <limits>

#include "core/base/error.h"
#include "core/picture/raster/samples.h"
#include "core/picture/raster/text.h"
#include "core/picture/raster/tone.h"

namespace {

using sim::colour;
using sim::Picture;
using sim::V3;
using sim::raster::cross;
using sim::raster::unit;

// FNV-1a of the pixels: files change with zlib, these do not.
std::uint64_t hash(const sim::Image& image) {
  std::uint64_t sum = 1469598103934665603U;
  for (const std::uint8_t byte : image.rgb) sum = (sum ^ byte) * 1099511628211U;
  return sum;
}

void look_from(Picture& picture, const V3& eye, const V3& at) {
  picture.eye.at = eye;
  picture.eye.forward = unit(at - eye);
  picture.eye.right = unit(cross(picture.eye.forward, {0, 1, 0}));
  picture.eye.up = cross(picture.eye.right, picture.eye.forward);
}

Picture empty_scene() {
  Picture picture;
  look_from(picture, {1.2F, 0.8F, 2.8F}, {0, -0.1F, 0});
  picture.light = unit({0.6F, 1, 0.6F});
  picture.skins = {{colour(0xD9453C), colour(0xE2B56E), true, 0}};
  picture.ground = sim::Ground{{0, -0.7F, 0}};
  return picture;
}

// A sheet of n x n points, bent by parabolas.
Picture sheet(int n) {
  Picture picture = empty_scene();
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      const float u = static_cast<float>(i) / static_cast<float>(n - 1),
                  v = static_cast<float>(j) / static_cast<float>(n - 1);
      picture.points.push_back({v - 0.5F, 0.45F - 0.8F * u, 1.2F * u * (1 - u) * v - 0.6F * v * v});
    }
  for (int i = 0; i + 1 < n; ++i)
    for (int j = 0; j + 1 < n; ++j) {
      const int a = i * n + j;
      picture.triangles.push_back({{a, a + n, a + 1}, 0});
      picture.triangles.push_back({{a + n, a + n + 1, a + 1}, 0});
    }
  picture.normals.resize(picture.points.size());
  const auto at = [&](int i) -> V3& { return picture.points[static_cast<std::size_t>(i)]; };
  for (const auto& t : picture.triangles)
    for (const int i : t.points)
      picture.normals[static_cast<std::size_t>(i)] +=
          cross(at(t.points[1]) - at(t.points[0]), at(t.points[2]) - at(t.points[0]));
  for (V3& normal : picture.normals) normal = unit(normal);
  return picture;
}

struct Golden {
  const char* name;
  Picture picture;
  std::uint64_t hash;
  std::int64_t covered;
};

std::vector<Golden> golden_pictures() {
  std::vector<Golden> all;
  all.push_back({"ground", empty_scene(), 0, 0});
  all.push_back({"sheet", sheet(12), 0, 0});
  Picture balls = sheet(8);
  balls.balls.push_back({{0.6F, -0.4F, 0.3F}, 0.25F, colour(0x3F86C8)});
  balls.balls.push_back({{-0.5F, -0.6F, 0.6F}, 0.05F, colour(0x202020)});
  all.push_back({"balls", balls, 0, 0});
  Picture wires = sheet(9);
  for (auto& t : wires.triangles) {
    t.visible = false;
    const auto at = [&](std::size_t k) {
      return wires.points[static_cast<std::size_t>(t.points[k])];
    };
    wires.lines.push_back({at(0), at(1), 1.5F, colour(0x2F4F86)});
    wires.lines.push_back({at(0), at(2), 4, colour(0xE8860C), true});
  }
  all.push_back({"wires", wires, 0, 0});
  Picture values = sheet(10);
  for (std::size_t i = 0; i < values.points.size(); ++i)
    values.colours.push_back(
        sim::raster::mix(colour(0x1F4E9E), colour(0xF3DE6A), static_cast<float>(i % 10) / 9));
  values.patches.push_back({900, 600, 300, 40, {0x1F4E9E, 0xF3DE6A}, 0.8F});
  values.texts.push_back({"strain 12.5 %  (max) = 1e-05", 30, 60, 24, 0x202020, 0, true});
  values.texts.push_back({"right", 1250, 700, 18, 0x902020, 2, false});
  all.push_back({"words", values, 0, 0});
  Picture inside = sheet(12);  // corners behind the eye and in its plane
  look_from(inside, {0, 0.1F, -0.25F}, {0.3F, 0, -0.3F});
  all.push_back({"near plane", inside, 0, 0});

  const std::uint64_t hashes[] = {0x1913ec8b0c978b3c, 0xa5f66f6dd500317e, 0x88837513723dab1d,
                                  0x2b43746a01af86a9, 0x5ad7544192417ad8, 0x50d045770a09bbee};
  const std::int64_t covered[] = {0, 17373, 23589, 7076, 17376, 67617};
  for (std::size_t i = 0; i < all.size(); ++i) {
    all[i].hash = hashes[i];
    all[i].covered = covered[i];
  }
  return all;
}

}  // namespace

TEST_CASE("golden pictures have their pixels") {
  sim::Raster raster(480, 270);
  for (const Golden& golden : golden_pictures()) {
    INFO(golden.name);
    CHECK(hash(raster.draw(golden.picture)) == golden.hash);
    CHECK(raster.covered() == golden.covered);
  }
}

TEST_CASE("a picture does not depend on those before it") {
  sim::Raster old(320, 180);
  for (const Golden& golden : golden_pictures()) old.draw(golden.picture);
  for (const Golden& golden : golden_pictures()) {
    sim::Raster fresh(320, 180);
    INFO(golden.name);
    CHECK(hash(old.draw(golden.picture)) == hash(fresh.draw(golden.picture)));
  }
}

// Half of a picture is behind a triangle, to the pixel.
TEST_CASE("a triangle covers the pixels on its side of an edge") {
  Picture picture;
  picture.skins = {{colour(0xFFFFFF), colour(0xFFFFFF)}};
  picture.points = {{0, -9, -3.5F}, {9, 0, -3.5F}, {0, 9, -3.5F}};
  picture.normals.assign(3, {0, 0, 1});
  picture.triangles = {{{0, 1, 2}, 0}};
  sim::Raster raster(100, 100);
  raster.draw(picture);
  CHECK(raster.covered() == 50 * 100);
}

// A square of triangles, with corners on samples: each sample in it, but none on the lower and the
// right edge, is in one of them. Corners lie on a grid of 1/256 pixel.
TEST_CASE("triangles that share their edges share no sample and leave none out") {
  using sim::raster::Samples;
  constexpr int kPixels = 16;
  sim::Eye eye;
  eye.focal = 2.0F / kPixels;  // a pixel is a unit at distance 1
  const sim::raster::Projection projection(eye, kPixels, kPixels);
  const auto [x0, y0] = Samples::kPlaces[0];
  const auto corner = [&](int i, int j, int size) {
    return V3{static_cast<float>(512 + x0 + i * size) / 256 - kPixels / 2,
              kPixels / 2 - static_cast<float>(512 + y0 + j * size) / 256, 1};
  };
  Samples samples(kPixels, kPixels);
  const auto count = [&] {
    int covered = 0;
    for (int y = 0; y < kPixels; ++y)
      for (int x = 0; x < kPixels; ++x)
        covered += static_cast<int>(std::count_if(samples.ids(x, y), samples.ids(x, y) + 4,
                                                  [](std::uint32_t id) { return id > 0; }));
    return covered;
  };
  for (const auto& [size, cells, wanted] :
       {std::array{1, 4, 1}, {32, 8, 4}, {256, 8, 256}, {512, 3, 144}})
    for (const bool falling : {true, false}) {
      CAPTURE(size, falling);
      int sum = 0;
      for (int i = 0; i < cells; ++i)
        for (int j = 0; j < cells; ++j) {
          const V3 a = corner(i, j, size), b = corner(i + 1, j, size), c = corner(i, j + 1, size),
                   d = corner(i + 1, j + 1, size);
          for (const auto& [p, q, r] :
               {std::array{a, b, falling ? d : c}, {falling ? a : b, d, c}}) {
            samples.clear(projection);
            samples.triangle(1, p, q, r);
            sum += count();
          }
        }
      CHECK(sum == wanted);
    }
}

TEST_CASE("what is nearer hides what is further, in any order") {
  for (const bool first : {true, false}) {
    Picture picture;
    const sim::PictureBall red{{0, 0, -3}, 0.3F, colour(0xFF0000)},
        blue{{0, 0, -5}, 0.4F, colour(0x0000FF)};
    picture.balls = first ? std::vector{red, blue} : std::vector{blue, red};
    sim::Raster raster(64, 64);
    const std::uint8_t* pixel = raster.draw(picture).pixel(32, 32);
    CHECK(pixel[0] > 2 * pixel[2]);
  }
}

TEST_CASE("numbers that are none, and far too large ones, leave a picture") {
  const float nan = std::numeric_limits<float>::quiet_NaN(),
              inf = std::numeric_limits<float>::infinity();
  sim::Raster raster(160, 90);
  const std::int64_t whole = [&] {
    raster.draw(sheet(6));
    return raster.covered();
  }();
  REQUIRE(whole > 500);
  for (const float bad : {nan, inf, -inf, 1e30F, -3e8F, 3e38F, 999999.0F}) {
    INFO(bad);
    Picture picture = sheet(6);
    picture.points[7].x = bad;
    picture.points[20] = {bad, bad, bad};
    picture.normals[3] = {bad, bad, bad};
    picture.balls.push_back({{bad, 0, 0}, 0.1F, {}});
    picture.balls.push_back({{0, 0, 0}, bad, {}});
    picture.lines.push_back({{bad, 0, 0}, {0, 0, 0}, 2, {}});
    picture.lines.push_back({{0, 0, 0}, {1, 1, 0}, bad, {}});
    raster.draw(picture);
    CHECK(raster.covered() > whole / 4);
    picture.ground->origin.y = bad;
    picture.light = {bad, 0, 0};
    raster.draw(picture);
    picture.eye.at.x = bad;
    raster.draw(picture);
    picture.eye = {{0, 0, 3}, {bad, 0, 0}, {0, bad, 0}, {0, 0, bad}, bad};
    raster.draw(picture);
  }
}

TEST_CASE("an eye inside of a ball does not see it") {
  Picture picture = empty_scene();
  picture.balls.push_back({picture.eye.at, 0.5F, {}});
  sim::Raster raster(64, 64);
  raster.draw(picture);
  CHECK(raster.covered() == 0);
}

TEST_CASE("pictures have sizes") {
  CHECK_THROWS_AS(sim::Raster(0, 10), sim::Error);
  CHECK_THROWS_AS(sim::Raster(1000000, 1000000), sim::Error);
  sim::Raster raster(1, 1);
  CHECK(raster.draw(sheet(4)).rgb.size() == 3);
}

// IEC 61966-2-1: 1.055 0.5^(1/2.4) - 0.055.
TEST_CASE("light becomes sRGB and back") {
  using sim::raster::Tone;
  CHECK(Tone::encode(0.5) == Approx(0.735356983052449).epsilon(1e-12));
  CHECK(Tone::encode(0.001) == Approx(0.01292));
  CHECK(Tone::encode(1) == Approx(1));
  for (int i = 0; i <= 255; ++i) CHECK(Tone::encode(Tone::decode(i / 255.0)) == Approx(i / 255.0));
}

// Light above 0.8 is pressed to 0.8 + 0.2 (l - 0.8) / (l - 0.6), which rises from 0.8 to 1 with the
// slope 1 at first; the mean of 4 x 4 pixels is what lies between two values of eight bits.
TEST_CASE("bright light is pressed together below white, and rises") {
  const sim::raster::Tone tone;
  const auto mean = [&](float light) {
    double sum = 0;
    for (int y = 0; y < 4; ++y)
      for (int x = 0; x < 4; ++x) {
        std::uint8_t rgb[3] = {};
        tone.put({light, 0.5F * light, 0}, x, y, rgb);
        CHECK(rgb[2] == 0);
        sum += rgb[0];
      }
    return sum / 16;
  };
  using sim::raster::Tone;
  for (const float light : {0.02F, 0.2F, 0.5F, 0.79F})
    CHECK(mean(light) == Approx(255 * Tone::encode(light)).margin(0.3));
  for (const float light : {0.85F, 1.0F, 1.5F, 3.0F, 50.0F}) {
    const double pressed = 0.8 + 0.2 * (light - 0.8) / (light - 0.6);
    CHECK(mean(light) == Approx(255 * Tone::encode(pressed)).margin(0.3));
  }
  CHECK(mean(1e30F) == 255);
  CHECK(mean(-1) == 0);
  CHECK(mean(std::numeric_limits<float>::quiet_NaN()) == 0);
}

TEST_CASE("every character has a width") {
  using sim::raster::text_width;
  for (char c = ' '; c <= '~'; ++c) CHECK(text_width({c}) > 0);
  CHECK(text_width("mm") > text_width("ii"));
  CHECK(text_width("") == 0);
  CHECK(text_width("\xC3\xB6") == text_width("??"));
}

// Rows and columns from the rounded edges of a rectangle in 1/720 of the height, its colours side
// by side in equal parts; a low picture counts as 420 pixels.
TEST_CASE("a patch has its colours, and nothing beside it changes") {
  struct Case {
    int width, height;
    sim::PicturePatch patch;
    int left, right, top, bottom;
  };
  const std::vector<unsigned> three{0xFF0000, 0x00FF00, 0x0000FF};
  const Case cases[] = {{1280, 720, {100, 50, 90, 7, three}, 100, 190, 50, 57},
                        {640, 720, {630, 700, 99, 99, three}, 630, 640, 700, 720},
                        {240, 210, {12, 24, 36, 12, three}, 7, 28, 14, 21},
                        {64, 720, {-20, 3, 30, 2, {0x102030}}, 0, 10, 3, 5},
                        {64, 720, {20, 3, 30, 2, {}}, 0, 0, 0, 0},
                        {64, 720, {-50, 3, 30, 2, {0x102030}}, 0, 0, 3, 5},
                        {64, 720, {90, 3, 30, 2, {0x102030}}, 64, 64, 3, 5},
                        {64, 720, {20, -9, 30, 2, {0x102030}}, 20, 50, 0, 0},
                        {64, 720, {20, 730, 30, 2, {0x102030}}, 20, 50, 720, 720}};
  for (const Case& each : cases) {
    CAPTURE(each.width, each.left, each.patch.rgb.size());
    sim::Raster raster(each.width, each.height);
    Picture picture;
    const sim::Image before = raster.draw(picture);
    picture.patches = {each.patch};
    const sim::Image& after = raster.draw(picture);
    int wrong = 0;
    for (int y = 0; y < each.height; ++y)
      for (int x = 0; x < each.width; ++x) {
        const bool inside = x >= each.left && x < each.right && y >= each.top && y < each.bottom;
        for (int c = 0; c < 3; ++c) {
          int wanted = before.pixel(x, y)[c];
          if (inside) {
            const auto count = static_cast<int>(each.patch.rgb.size());
            const int part = (x - each.left) * count / (each.right - each.left);
            wanted = static_cast<int>(
                each.patch.rgb[static_cast<std::size_t>(part)] >> (16 - 8 * c) & 0xFFU);
          }
          wrong += std::abs(after.pixel(x, y)[c] - wanted) > 1;
        }
      }
    CHECK(wrong == 0);
  }
}
