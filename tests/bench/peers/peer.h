// The code shared by the peers: the scene as sim_bench wrote it, and the conversation with it.
#pragma once

#include <array>
#include <charconv>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <iterator>
#include <string>
#include <vector>

namespace peer {

struct Spring {
  int a, b;
  double k, rest;  // N/m, m
};

struct Scene {
  int n = 0;
  double g[3] = {}, drag = 0, h = 0;  // m/s^2, kg/s, s
  std::vector<double> x, v, mass;     // x0 y0 z0 x1 ... in m, m/s; kg
  std::vector<int> pinned;            // ids
  std::vector<Spring> springs;        // by their lower end
  // Lennard-Jones between all, its energy shifted to 0 at the cutoff; all 0: none. J, m, m, m.
  double epsilon = 0, sigma = 0, cutoff = 0, skin = 0;
  // A sphere at rest, radius 0: none; particles are the centers of cubes on the plane y = 0, half
  // an edge 0: points. Their friction.
  double center[3] = {}, radius = 0, half = 0, friction = 0;  // m
  // The triangles that may not pass through each other, or none; their thickness, and the height of
  // the ground under them.
  std::vector<std::array<int, 3>> triangles;  // ids
  double thickness = 0, ground = 0;           // m
};

// Reads "n springs pins triangles", "gx gy gz drag h", "epsilon sigma cutoff skin", "cx cy cz
// radius half friction thickness ground" of what is hit, n rows "x y z vx vy vz mass", a row a
// spring "a b k rest", the ids of the pins, and a row a triangle "a b c". Ends the program when the
// file is not like that.
inline Scene read_scene(const char* path) {
  std::ifstream in(path, std::ios::binary);
  const std::string text((std::istreambuf_iterator<char>(in)), {});
  const char *p = text.data(), *const end = p + text.size();
  const auto number = [&]() -> double {
    while (p < end && (*p == ' ' || *p == '\n')) ++p;
    double value = 0;
    const auto result = std::from_chars(p, end, value);
    if (result.ec != std::errc()) {
      std::fprintf(stderr, "not a scene: %s\n", path);
      std::exit(3);
    }
    p = result.ptr;
    return value;
  };
  Scene s;
  s.n = static_cast<int>(number());
  s.springs.resize(static_cast<std::size_t>(number()));
  s.pinned.resize(static_cast<std::size_t>(number()));
  s.triangles.resize(static_cast<std::size_t>(number()));
  for (double& g : s.g) g = number();
  s.drag = number();
  s.h = number();
  for (double* pair : {&s.epsilon, &s.sigma, &s.cutoff, &s.skin}) *pair = number();
  for (double& c : s.center) c = number();
  for (double* solid : {&s.radius, &s.half, &s.friction, &s.thickness, &s.ground})
    *solid = number();
  for (int i = 0; i < s.n; ++i) {
    for (int c = 0; c < 3; ++c) s.x.push_back(number());
    for (int c = 0; c < 3; ++c) s.v.push_back(number());
    s.mass.push_back(number());
  }
  for (Spring& spring : s.springs) {
    spring.a = static_cast<int>(number());
    spring.b = static_cast<int>(number());
    spring.k = number();
    spring.rest = number();
  }
  for (int& id : s.pinned) id = static_cast<int>(number());
  for (auto& triangle : s.triangles)
    for (int& id : triangle) id = static_cast<int>(number());
  return s;
}

inline double seconds_now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

// Answers commands, one a line, until the input ends. A peer has
//   double run(long steps)            seconds that many steps took
//   void reset()                      back to the initial state
//   std::vector<double> positions()   x0 y0 z0 x1 ...
//   std::string about()               version and variant, one line
template <class Peer>
int serve(int argc, char** argv) {
  if (argc != 2) return 2;
  Peer self(read_scene(argv[1]));
  std::cout << self.about() << std::endl;
  for (std::string command; std::cin >> command;) {
    if (command == "run") {
      long steps = 0;
      std::cin >> steps;
      std::cout.precision(17);
      std::cout << self.run(steps) << std::endl;
    } else if (command == "reset") {
      self.reset();
      std::cout << "ok" << std::endl;
    } else if (command == "positions") {
      std::string path;
      std::cin >> path;
      std::ofstream out(path, std::ios::binary);
      const std::vector<double> x = self.positions();
      out.write(reinterpret_cast<const char*>(x.data()),
                static_cast<std::streamsize>(x.size() * sizeof(double)));
      out.close();
      std::cout << (out ? "ok" : "failed") << std::endl;
    } else {
      return 2;
    }
  }
  return 0;
}

}  // namespace peer
