#include "plugins/view/gl_picture.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "core/base/error.h"

namespace {

using sim::V3;
using sim::raster::dot;

constexpr int kAround = 20, kDown = 12;  // of a ball
constexpr unsigned kSlots = 4;           // of attributes

constexpr char kHeader[] = R"(#version 330 core
uniform mat4 view; uniform vec3 eye, light, up, flat_at, flat_up, flat_way; uniform float flattened;
vec3 on_ground(vec3 p) {
  return flattened > 0. ? p - flat_way * (dot(p - flat_at, flat_up) / dot(flat_way, flat_up)) : p; }
)";

// Light from sky and earth, a key light, a cool fill light and one at the rim, as the rasteriser
// has.
constexpr char kLit[] = R"(
uniform vec4 shadow;
out vec4 pixel;
vec4 screen(vec3 c) {
  c = mix(c, .8 + .2 * (c - .8) / (c - .6), greaterThan(c, vec3(.8)));
  return vec4(mix(12.92 * c, 1.055 * pow(c, vec3(1. / 2.4)) - .055,
                  greaterThan(c, vec3(.0031308))), 1.); }
vec3 lit(vec3 albedo, vec3 n, vec3 v, float gloss, float thin) {
  float k = dot(n, light);
  vec3 around = mix(vec3(.27, .24, .20), vec3(.55, .64, .79), .5 + .5 * dot(n, up));
  vec3 fill = normalize(.35 * up - .8 * (light - dot(light, up) * up) + .6 * v);
  vec3 l = .54 * around + .16 * max(0., dot(n, fill)) * vec3(.48, .58, .74)
    + (k > 0. ? .78 * k : -thin * .3 * k) * vec3(1., .9, .76);
  float g = 1. - clamp(dot(n, v), 0., 1.);
  float s = k > 0. ? clamp(dot(n, normalize(light + v)), 0., 1.) : 0.;
  return albedo * l + .16 * g * g * g * g * around
    + .55 * gloss * pow(s, 24.) * vec3(1., .9, .76); }
)";

constexpr char kMeshVertex[] = R"(
layout(location = 0) in vec3 a; layout(location = 1) in vec3 b; layout(location = 2) in vec3 c;
out vec3 p, n, tint;
void main() { p = a; n = b; tint = c; gl_Position = view * vec4(on_ground(a), 1.); }
)";
constexpr char kMeshPixel[] = R"(
in vec3 p, n, tint;
uniform vec3 front, back; uniform float tinted, tinted_back, gloss;
void main() {
  if (shadow.a > 0.) { pixel = shadow; return; }
  vec3 v = normalize(eye - p), m = normalize(n);
  bool facing = gl_FrontFacing;
  if (!facing) m = -m;
  float away = -dot(m, v);
  if (away > -.02) m = normalize(m + (away + .02) * v);
  vec3 own = facing ? (tinted > 0. ? tint : front) : (tinted * tinted_back > 0. ? tint : back);
  pixel = screen(lit(own, m, v, gloss, gloss < .2 ? 1. : 0.));
}
)";
constexpr char kBallVertex[] = R"(
layout(location = 0) in vec3 a; layout(location = 1) in vec4 at; layout(location = 2) in vec3 c;
out vec3 p, n, tint;
void main() { n = a; p = at.xyz + at.w * a; tint = c; gl_Position = view * vec4(on_ground(p), 1.); }
)";
constexpr char kBallPixel[] = R"(
in vec3 p, n, tint;
void main() {
  pixel = shadow.a > 0. ? shadow : screen(lit(tint, normalize(n), normalize(eye - p), 1., 0.)); }
)";
// A line is a strip of its width, with ends beyond its points.
constexpr char kLineVertex[] = R"(
layout(location = 0) in vec3 a; layout(location = 1) in vec3 b;
layout(location = 2) in vec3 c; layout(location = 3) in vec2 how;
uniform vec2 size; uniform float depth; out vec3 tint;
void main() {
  vec4 s = view * vec4(a, 1.), e = view * vec4(b, 1.); float least = 1e-3;
  if (s.w < least) s = mix(e, s, (e.w - least) / (e.w - s.w));
  if (e.w < least) e = mix(s, e, (s.w - least) / (s.w - e.w));
  vec2 d = (e.xy / e.w - s.xy / s.w) * size;
  d = length(d) > 0. ? normalize(d) : vec2(1., 0.);
  vec2 n = vec2(-d.y, d.x) * (float(gl_VertexID & 1) * 2. - 1.);
  vec4 q = gl_VertexID < 2 ? s : e;
  q.xy += (n + d * (gl_VertexID < 2 ? -.4 : .4)) * how.x / size * q.w;
  q.z += depth * (how.y > 0. ? .02 : .004);
  gl_Position = q; tint = c;
}
)";
constexpr char kLinePixel[] = "in vec3 tint; void main() { pixel = screen(tint); }";
constexpr char kGroundVertex[] = R"(
layout(location = 0) in vec3 a; layout(location = 1) in vec2 b; out vec3 p; out vec2 q;
void main() { p = a; q = b; gl_Position = view * vec4(a, 1.); }
)";
constexpr char kGroundPixel[] = R"(
in vec3 p; in vec2 q; uniform float spacing, fade;
float lines(float k, float w) {
  vec2 g = q / (spacing * k), f = fwidth(g) * 1.2, d = abs(fract(g - .5) - .5);
  vec2 l = clamp((w + .5 * f - d) / f, 0., 1.) * min(vec2(1.), 2. * w / f);
  return max(l.x, l.y); }
void main() {
  vec3 c = mix(vec3(.674, .681, .7), vec3(.445, .462, .497), lines(1., .012));
  c = mix(c, vec3(.29, .305, .34), lines(4., .006));
  float a = clamp(1. - length(p - eye) / (1.5 * fade), 0., 1.);
  pixel = screen(mix(vec3(.52, .58, .65), c, a * a * (3. - 2. * a)));
}
)";

unsigned shader(GLenum kind, const char* body, bool lit) {
  const unsigned made = glCreateShader(kind);
  const char* const parts[] = {kHeader, lit ? kLit : "", body};
  glShaderSource(made, 3, parts, nullptr);
  glCompileShader(made);
  return made;
}

unsigned program(const char* vertex, const char* pixel) {
  const unsigned made = glCreateProgram();
  const unsigned parts[] = {shader(GL_VERTEX_SHADER, vertex, false),
                            shader(GL_FRAGMENT_SHADER, pixel, true)};
  std::string said;
  char text[1024] = "";
  for (const unsigned part : parts) {
    glAttachShader(made, part);
    glGetShaderInfoLog(part, sizeof text, nullptr, text);
    said += text;
    glDeleteShader(part);
  }
  glLinkProgram(made);
  int linked = 0;
  glGetProgramiv(made, GL_LINK_STATUS, &linked);
  if (linked) return made;
  glGetProgramInfoLog(made, sizeof text, nullptr, text);
  throw sim::Error(sim::ErrorKind::kIo, {"no window", "OpenGL", said + text,
                                         "leave out --window: the page needs no OpenGL here"});
}

void push(std::vector<float>& to, const V3& v) { to.insert(to.end(), {v.x, v.y, v.z}); }

bool drawable(const V3& v) {
  constexpr float kFurthest = 1e6F;
  return std::abs(v.x) < kFurthest && std::abs(v.y) < kFurthest && std::abs(v.z) < kFurthest;
}

// The unit sphere as triangles.
std::vector<float> ball() {
  std::vector<float> list;
  const auto point = [](int i, int j) {
    const float t = std::numbers::pi_v<float> * static_cast<float>(j) / kDown,
                u = 2 * std::numbers::pi_v<float> * static_cast<float>(i) / kAround;
    return V3{std::sin(t) * std::cos(u), std::cos(t), std::sin(t) * std::sin(u)};
  };
  for (int i = 0; i < kAround; ++i)
    for (int j = 0; j < kDown; ++j)
      for (const auto& [a, b] : {std::pair{0, 0}, {1, 0}, {1, 1}, {0, 0}, {1, 1}, {0, 1}})
        push(list, point(i + a, j + b));
  return list;
}

}  // namespace

GlPicture::GlPicture()
    : mesh_(program(kMeshVertex, kMeshPixel)),
      ball_(program(kBallVertex, kBallPixel)),
      line_(program(kLineVertex, kLinePixel)),
      ground_(program(kGroundVertex, kGroundPixel)),
      sphere_(ball()) {
  glGenVertexArrays(1, &array_);
  glGenBuffers(static_cast<int>(buffers_.size()), buffers_.data());
}

GlPicture::~GlPicture() {
  glDeleteBuffers(static_cast<int>(buffers_.size()), buffers_.data());
  glDeleteVertexArrays(1, &array_);
  for (const unsigned each : {mesh_, ball_, line_, ground_}) glDeleteProgram(each);
}

void GlPicture::set(unsigned program, const char* name, const V3& value) {
  glUniform3f(glGetUniformLocation(program, name), value.x, value.y, value.z);
}

unsigned GlPicture::use(unsigned program, const sim::Picture& picture) const {
  glUseProgram(program);
  glUniformMatrix4fv(glGetUniformLocation(program, "view"), 1, GL_FALSE, view_.data());
  set(program, "eye", picture.eye.at);
  set(program, "light", picture.light);
  set(program, "up", picture.ground ? picture.ground->up : V3{0, 1, 0});
  flatten(program, picture, false);
  return program;
}

// Projects drawn shapes down along the light, as a shadow that darkens each pixel once.
void GlPicture::flatten(unsigned program, const sim::Picture& picture, bool on) const {
  glUniform1f(glGetUniformLocation(program, "flattened"), on ? 1 : 0);
  glUniform4f(glGetUniformLocation(program, "shadow"), .2F, .24F, .32F, on ? .3F : 0);
  if (!on) return;
  set(program, "flat_at", picture.ground->origin);
  set(program, "flat_up", picture.ground->up);
  set(program, "flat_way", picture.light);
}

void GlPicture::describe(unsigned buffer, const std::vector<float>& data,
                         const std::vector<Attribute>& attributes, int first) {
  glBindBuffer(GL_ARRAY_BUFFER, buffer);
  glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(data.size() * sizeof(float)), data.data(),
               GL_STREAM_DRAW);
  for (unsigned slot = 0; first == 0 && slot < kSlots; ++slot) glDisableVertexAttribArray(slot);
  int stride = 0, at = 0;
  for (const Attribute& each : attributes) stride += each.count;
  for (std::size_t i = 0; i < attributes.size(); ++i) {
    const auto slot = static_cast<unsigned>(first) + static_cast<unsigned>(i);
    glEnableVertexAttribArray(slot);
    glVertexAttribPointer(
        slot, attributes[i].count, GL_FLOAT, GL_FALSE, stride * static_cast<int>(sizeof(float)),
        reinterpret_cast<const void*>(static_cast<std::size_t>(at) * sizeof(float)));
    glVertexAttribDivisor(slot, attributes[i].instance ? 1 : 0);
    at += attributes[i].count;
  }
}

void GlPicture::draw(const sim::Picture& picture, int x, int y, int width, int height) {
  const sim::Eye& eye = picture.eye;
  const float wide = eye.focal * static_cast<float>(height) / static_cast<float>(width),
              away = std::max(0.05F, sim::raster::length(eye.at)), near = 0.02F * away,
              far = 60 * away + 60, a = (far + near) / (near - far),
              b = 2 * far * near / (near - far);
  const V3 &r = eye.right, &u = eye.up, &f = eye.forward;
  view_ = {wide * r.x,
           eye.focal * u.x,
           -a * f.x,
           f.x,
           wide * r.y,
           eye.focal * u.y,
           -a * f.y,
           f.y,
           wide * r.z,
           eye.focal * u.z,
           -a * f.z,
           f.z,
           -wide * dot(r, eye.at),
           -eye.focal * dot(u, eye.at),
           a * dot(f, eye.at) + b,
           -dot(f, eye.at)};
  depth_ = b;
  glViewport(x, y, width, height);
  glScissor(x, y, width, height);
  glEnable(GL_SCISSOR_TEST);
  glClearColor(.75F, .785F, .83F, 1);
  glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT | GL_STENCIL_BUFFER_BIT);
  glEnable(GL_DEPTH_TEST);
  glBindVertexArray(array_);
  ground(picture);
  upload_surfaces(picture);
  if (picture.ground) {
    glEnable(GL_STENCIL_TEST);
    glStencilFunc(GL_EQUAL, 0, 255);
    glStencilOp(GL_KEEP, GL_KEEP, GL_INCR);
    glEnable(GL_BLEND);
    glBlendFunc(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA);
    glEnable(GL_POLYGON_OFFSET_FILL);
    glPolygonOffset(-2, -8);
    glDepthMask(GL_FALSE);
    surfaces(picture, true);
    balls(picture, true);
    glDepthMask(GL_TRUE);
    glDisable(GL_POLYGON_OFFSET_FILL);
    glDisable(GL_BLEND);
    glDisable(GL_STENCIL_TEST);
  }
  surfaces(picture, false);
  balls(picture, false);
  lines(picture, width, height);
  glDisable(GL_SCISSOR_TEST);
}

void GlPicture::ground(const sim::Picture& picture) {
  constexpr float kReach = 30;
  if (!picture.ground) return;
  const sim::Ground& ground = *picture.ground;
  const V3 eye = picture.eye.at - ground.origin;
  const float u = dot(eye, ground.u), w = dot(eye, ground.w);
  std::vector<float> corners;
  for (const float i : {-kReach, kReach})
    for (const float j : {-kReach, kReach}) {
      push(corners, ground.origin + (u + i) * ground.u + (w + j) * ground.w);
      corners.insert(corners.end(), {u + i, w + j});
    }
  const unsigned program = use(ground_, picture);
  glUniform1f(glGetUniformLocation(program, "spacing"), ground.spacing);
  glUniform1f(glGetUniformLocation(program, "fade"), ground.fade);
  describe(buffers_[0], corners, {{3, false}, {2, false}});
  glDepthMask(GL_FALSE);
  glDrawArrays(GL_TRIANGLE_STRIP, 0, 4);
  glDepthMask(GL_TRUE);
}

// Triangles by skin; shadows are cast by those that say so, seen or not.
void GlPicture::upload_surfaces(const sim::Picture& picture) {
  corners_.clear();
  indices_.clear();
  parts_.clear();
  for (std::size_t i = 0; i < picture.points.size(); ++i) {
    push(corners_, picture.points[i]);
    push(corners_, picture.normals[i]);
    push(corners_, i < picture.colours.size() ? picture.colours[i] : V3{});
  }
  for (int skin = 0; skin < static_cast<int>(picture.skins.size()); ++skin)
    for (const bool visible : {true, false}) {
      const std::size_t first = indices_.size();
      for (const sim::PictureTriangle& t : picture.triangles) {
        if (t.skin != skin || t.visible != visible) continue;
        if (!std::ranges::all_of(t.points, [&](int i) {
              return drawable(picture.points[static_cast<std::size_t>(i)]);
            }))
          continue;
        for (const int i : t.points) indices_.push_back(static_cast<unsigned>(i));
      }
      if (indices_.size() > first)
        parts_.push_back({skin, visible, first, indices_.size() - first});
    }
}

void GlPicture::surfaces(const sim::Picture& picture, bool shadow) {
  if (indices_.empty()) return;
  const unsigned program = use(mesh_, picture);
  if (shadow) flatten(program, picture, true);
  describe(buffers_[0], corners_, {{3, false}, {3, false}, {3, false}});
  glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, buffers_[1]);
  glBufferData(GL_ELEMENT_ARRAY_BUFFER, static_cast<GLsizeiptr>(indices_.size() * sizeof(unsigned)),
               indices_.data(), GL_STREAM_DRAW);
  const auto number = [&](const char* name, float value) {
    glUniform1f(glGetUniformLocation(program, name), value);
  };
  for (const Part& part : parts_) {
    if (!part.visible && !shadow) continue;
    const sim::Skin& skin = picture.skins[static_cast<std::size_t>(part.skin)];
    set(program, "front", skin.front);
    set(program, "back", skin.back);
    number("gloss", skin.gloss);
    number("tinted", picture.colours.empty() || part.skin != 0 ? 0 : 1);
    number("tinted_back", skin.two_sided_colour ? 1 : 0);
    glDrawElements(GL_TRIANGLES, static_cast<int>(part.count), GL_UNSIGNED_INT,
                   reinterpret_cast<const void*>(part.first * sizeof(unsigned)));
  }
}

void GlPicture::balls(const sim::Picture& picture, bool shadow) {
  instances_.clear();
  int count = 0;
  for (const sim::PictureBall& each : picture.balls) {
    if ((shadow && !each.casts) || !drawable(each.centre)) continue;
    push(instances_, each.centre);
    instances_.push_back(each.radius);
    push(instances_, each.colour);
    ++count;
  }
  if (count == 0) return;
  const unsigned program = use(ball_, picture);
  if (shadow) flatten(program, picture, true);
  describe(buffers_[2], sphere_, {{3, false}});
  describe(buffers_[3], instances_, {{4, true}, {3, true}}, 1);
  glDrawArraysInstanced(GL_TRIANGLES, 0, static_cast<int>(sphere_.size() / 3), count);
}

void GlPicture::lines(const sim::Picture& picture, int width, int height) {
  constexpr float kHeight = 720;  // that widths are meant of
  instances_.clear();
  int count = 0;
  for (const sim::PictureLine& each : picture.lines) {
    if (!drawable(each.a) || !drawable(each.b)) continue;
    push(instances_, each.a);
    push(instances_, each.b);
    push(instances_, each.colour);
    const float wide = std::max(1.0F, each.width * static_cast<float>(height) / kHeight);
    instances_.insert(instances_.end(), {wide, each.in_front ? 1.0F : 0.0F});
    ++count;
  }
  if (count == 0) return;
  const unsigned program = use(line_, picture);
  glUniform2f(glGetUniformLocation(program, "size"), static_cast<float>(width),
              static_cast<float>(height));
  glUniform1f(glGetUniformLocation(program, "depth"), depth_);
  describe(buffers_[3], instances_, {{3, true}, {3, true}, {3, true}, {2, true}});
  glDrawArraysInstanced(GL_TRIANGLE_STRIP, 0, 4, count);
}
