#include "core/picture/scenery.h"

#include <algorithm>
#include <array>
#include <map>
#include <set>

#include "core/base/error.h"
#include "core/base/text.h"
#include "core/particles/elements/torn_faces.h"
#include "core/picture/liquid_surface.h"
#include "core/picture/raster/text.h"
#include "core/picture/trail.h"

namespace sim {
namespace {

constexpr unsigned kFamilies[] = {0x2458C8, 0xE8860C, 0x2E9E54, 0x9A3FB0, 0xC23A4A, 0x1F8F9C};
constexpr unsigned kPinned = 0x3A3F46, kParticle = 0x3F86C8, kBar = 0x6B7078, kWire = 0x2F4F86,
                   kBody = 0xC98A4B, kWarning = 0xB3261E;

V3 sum_normal(const V3& a, const V3& b, const V3& c) { return raster::cross(b - a, c - a); }

// Edges of solids stay sharp: a corner of a face that is turned by more than 40 degrees from the
// corner's normal, the mean of its faces, becomes a point of its own.
void split_sharp_edges(Picture& picture, std::size_t first_triangle) {
  constexpr float kSharp = 0.766F;  // cosine
  for (std::size_t t = first_triangle; t < picture.triangles.size(); ++t) {
    std::array<int, 3>& ids = picture.triangles[t].points;
    const auto point = [&](std::size_t k) {
      return picture.points[static_cast<std::size_t>(ids[k])];
    };
    const V3 own = raster::unit(sum_normal(point(0), point(1), point(2)));
    for (int& id : ids) {
      const auto i = static_cast<std::size_t>(id);
      if (raster::dot(picture.normals[i], own) >= kSharp) continue;
      id = static_cast<int>(picture.points.size());
      picture.points.push_back(V3(picture.points[i]));
      picture.normals.push_back(own);
      if (!picture.colours.empty()) picture.colours.push_back(V3(picture.colours[i]));
    }
  }
}

[[noreturn]] void nothing_of(const std::string& what, const std::string& why,
                             const std::string& remedy) {
  throw Error(ErrorKind::kUsage, {"nothing to show", what, why, remedy});
}

// True if x is inside a sphere, a box or a capsule.
bool encloses(const RenderShape& solid, const Vec3& x) {
  using Form = RenderShape::Form;
  const Vec3 d = x - solid.center;
  if (solid.form == Form::kSphere) return d.norm() < solid.radius;
  if (solid.form == Form::kCapsule) {
    const Vec3& half = solid.axes[0];
    const double along = std::clamp(d.dot(half) / half.squaredNorm(), -1.0, 1.0);
    return (d - along * half).norm() < solid.radius;
  }
  return solid.form == Form::kBox && std::ranges::all_of(solid.axes, [&](const Vec3& half) {
           return std::abs(d.dot(half)) < half.squaredNorm();
         });
}

// The lines of a sheet are those of its grid, without the diagonals; else all edges.
std::vector<std::array<int, 2>> edges_of(const Model& model) {
  std::set<std::array<int, 2>> edges;
  const auto& n = model.grid;
  const auto place = [&](int id) {
    return std::array<int, 3>{id / (n[1] * n[2]), id / n[2] % n[1], id % n[2]};
  };
  const int in_grid = n[0] * n[1] * n[2];
  for (const auto& t : model.triangles)
    for (std::size_t k = 0; k < 3; ++k) {
      const int a = std::min(t[k], t[(k + 1) % 3]), b = std::max(t[k], t[(k + 1) % 3]);
      if (b < in_grid) {
        const auto p = place(a), q = place(b);
        if ((p[0] != q[0]) + (p[1] != q[1]) + (p[2] != q[2]) > 1) continue;
      }
      edges.insert({a, b});
    }
  return {edges.begin(), edges.end()};
}

// The least and the largest value of one name over all cells.
std::array<double, 2> range_of(const Frame& frame, std::size_t name, std::size_t names) {
  double low = HUGE_VAL, high = -HUGE_VAL;
  for (std::size_t i = name; i < frame.components.size(); i += names) {
    low = std::min(low, frame.components[i]);
    high = std::max(high, frame.components[i]);
  }
  return {low, high};
}

// A light plate behind words that may lie on the scene.
void add_plate(Picture& picture, float x, float y, float width, float height) {
  picture.patches.push_back({x, y, width, height, {0xFFFFFF}, 0.8F});
}

}  // namespace

unsigned family_colour(std::size_t i) { return kFamilies[i % std::size(kFamilies)]; }

Scenery::Scenery(std::span<const Model> models, const Moments& moments, const Look& look)
    : models_(models),
      moments_(moments),
      look_(look),
      viewpoint_(make_viewpoint(models, moments, look)),
      scale_(colour_scale(look, models, moments)) {
  for (std::size_t m = 0; m < models.size(); ++m) turned_.push_back(shows_back(m));
  for (std::size_t m = 0; look.wireframe && m < models.size(); ++m)
    wires_.push_back(edges_of(models[m]));
  if (look.surface) find_liquids();
  check_trails(models, look);
  for (std::size_t m = 0; m < models.size(); ++m) follow(m);
  look_.colour = colour_of(look, models);
  std::vector<std::string> names;
  int most = 0;
  Moment room;
  const Moment& first = moments.at(0, room);
  bool colours = look_.colour == "none";
  for (std::size_t m = 0; m < models.size(); ++m) {
    for (const ModelFamily& family : models[m].families) names.push_back(family.name);
    if (!models[m].families.empty()) most = std::max(most, models[m].particles);
    colours = colours || !quantity(models[m], first[m], look_.colour).empty();
  }
  for (const std::string& family : look.families)
    if (std::ranges::find(names, family) == names.end())
      nothing_of("--springs " + family, "the scene has no springs of that name",
                 names.empty() ? "it has no springs" : suggestion(family, names));
  for (const int i : look.picked)
    if (i >= most)
      nothing_of(
          "--springs " + std::to_string(i), "no particle of that number has springs",
          most == 0 ? "the scene has no springs" : "ids are 0 to " + std::to_string(most - 1));
  if (look.all_springs && names.empty())
    nothing_of("--springs all", "the scene has no springs", "leave it out");
  if (!colours)
    nothing_of("--color " + look_.colour, "the scene has none",
               look_.colour == "strain" ? "strain needs springs" : "leave it out");
}

// The front of an open sheet is not given by the scene: it is the side that is seen more.
bool Scenery::shows_back(std::size_t m) const {
  std::map<std::array<int, 2>, int> sides;
  for (const auto& t : models_[m].triangles)
    for (std::size_t k = 0; k < 3; ++k)
      ++sides[{std::min(t[k], t[(k + 1) % 3]), std::max(t[k], t[(k + 1) % 3])}];
  if (std::ranges::all_of(sides, [](const auto& side) { return side.second == 2; })) return false;
  double front = 0;
  Moment room;
  for (const std::size_t at : {std::size_t{0}, moments_.size() / 2, moments_.size() - 1}) {
    const Frame& frame = moments_.at(at, room)[m];
    for (const auto& t : models_[m].triangles) {
      const auto corner = [&](std::size_t k) { return place(m, frame.at(t[k])); };
      const V3 a = corner(0);
      const double seen = raster::dot(sum_normal(a, corner(1), corner(2)), viewpoint_.eye.at - a);
      if (std::isfinite(seen)) front += seen;
    }
  }
  return front < 0;
}

bool Scenery::picked(int particle) const {
  return std::ranges::find(look_.picked, particle) != look_.picked.end();
}

Picture Scenery::picture(std::size_t at) const {
  Moment room;
  const Moment& moment = moments_.at(at, room);
  Picture picture;
  picture.eye = viewpoint_.eye;
  picture.light = viewpoint_.light;
  picture.ground = viewpoint_.ground;
  picture.skins = {{colour(0xD9453C), colour(0xE2B56E), true, 0.0F},
                   {colour(0x7F8FA6), colour(0x7F8FA6), false, 0.5F},
                   {colour(0xB9BDC4), colour(0x9A9EA6), false, 0.0F},
                   {colour(kBody), colour(kBody), false, 0.3F},
                   {colour(kParticle), colour(kParticle), true, 0.6F}};
  for (std::size_t m = 0; m < models_.size(); ++m) {
    const Frame& frame = moment[m];
    surfaces(picture, m, frame);
    if (look_.surface) liquid(picture, m, frame);
    loose(picture, m, frame);
    trails(picture, m, at);
    springs(picture, m, frame);
    if (look_.wireframe) wires(picture, m, frame);
  }
  for (std::size_t m = 0; m < models_.size(); ++m) solids(picture, m, moment[m]);
  words(picture, moment);
  return picture;
}

void Scenery::surfaces(Picture& picture, std::size_t m, const Frame& frame) const {
  const Model& model = models_[m];
  if (model.triangles.empty()) return;
  const auto first = static_cast<int>(picture.points.size());
  const std::size_t first_triangle = picture.triangles.size();
  const auto n = static_cast<std::size_t>(model.particles);
  for (int i = 0; i < model.particles; ++i) picture.points.push_back(place(m, frame.at(i)));
  picture.normals.resize(picture.points.size());
  for (const auto& t : model.triangles) {
    std::array<int, 3> ids{t[0] + first, t[1] + first, t[2] + first};
    if (torn_face(frame.torn, t)) {
      // The threads that are left of it.
      for (std::size_t k = 0; k < 3; ++k)
        if (const std::size_t next = (k + 1) % 3; !torn_edge(frame.torn, t[k], t[next]))
          picture.lines.push_back({place(m, frame.at(t[k])), place(m, frame.at(t[next])), 1,
                                   picture.skins[0].front, false});
      continue;
    }
    if (turned_[m]) std::swap(ids[1], ids[2]);
    picture.triangles.push_back({ids, 0, !look_.wireframe});
    const auto corner = [&](std::size_t k) {
      return picture.points[static_cast<std::size_t>(ids[k])];
    };
    const V3 normal = sum_normal(corner(0), corner(1), corner(2));
    for (const int i : ids) picture.normals[static_cast<std::size_t>(i)] += normal;
  }
  for (std::size_t i = picture.normals.size() - n; i < picture.normals.size(); ++i)
    picture.normals[i] = raster::unit(picture.normals[i]);
  if (look_.colour != "none") {
    const std::vector<double> values = quantity(model, frame, look_.colour);
    picture.colours.resize(picture.points.size(), picture.skins[0].front);
    for (std::size_t i = 0; i < values.size(); ++i)
      picture.colours[picture.points.size() - n + i] = scale_.colour(values[i]);
  }
  split_sharp_edges(picture, first_triangle);
}

void Scenery::find_liquids() {
  bool any = false;
  Moment room;
  const Moment& first = moments_.at(0, room);
  for (std::size_t m = 0; m < models_.size(); ++m) {
    Liquid liquid{liquid_of(models_[m]), 0};
    if (!liquid.ids.empty()) liquid.spacing = liquid_spacing(first[m], liquid.ids);
    if (!(liquid.spacing > 0 && std::isfinite(liquid.spacing))) liquid.ids.clear();
    any = any || !liquid.ids.empty();
    liquids_.push_back(std::move(liquid));
  }
  if (!any)
    nothing_of("--surface", "the scene has no water, nor other loose particles", "leave it out");
}

// Particles that have flown off, or have no position, stay out of it.
void Scenery::liquid(Picture& picture, std::size_t m, const Frame& frame) const {
  const auto& [ids, spacing] = liquids_[m];
  const std::vector<double> all = quantity(models_[m], frame, look_.colour);
  std::vector<Vec3> particles;
  std::vector<double> values;
  for (const int i : ids) {
    if (!viewpoint_.reaches[m].holds(frame.at(i))) continue;
    particles.push_back(frame.at(i));
    if (!all.empty()) values.push_back(all[static_cast<std::size_t>(i)]);
  }
  const LiquidSurface surface = liquid_surface(particles, spacing, values);
  constexpr int kSkin = 4;
  const V3 front = picture.skins[kSkin].front;
  const std::size_t first = picture.points.size();
  if (look_.colour != "none") picture.colours.resize(first, picture.skins[0].front);
  for (std::size_t i = 0; i < surface.points.size(); ++i) {
    picture.points.push_back(place(m, surface.points[i]));
    if (look_.colour != "none")
      picture.colours.push_back(values.empty() ? front : scale_.colour(surface.values[i]));
  }
  picture.normals.resize(picture.points.size());
  for (const auto& t : surface.triangles) {
    PictureTriangle triangle{{}, kSkin};
    for (std::size_t k = 0; k < 3; ++k) triangle.points[k] = t[k] + static_cast<int>(first);
    const auto corner = [&](std::size_t k) {
      return picture.points[static_cast<std::size_t>(triangle.points[k])];
    };
    const V3 normal = sum_normal(corner(0), corner(1), corner(2));
    for (const int i : triangle.points) picture.normals[static_cast<std::size_t>(i)] += normal;
    picture.triangles.push_back(triangle);
  }
  for (std::size_t i = first; i < picture.normals.size(); ++i)
    picture.normals[i] = raster::unit(picture.normals[i]);
}

// Particles that are in no triangle are balls, and springs between them bars. Pinned corners of a
// surface get small balls. Liquids that are drawn as surfaces have none.
void Scenery::loose(Picture& picture, std::size_t m, const Frame& frame) const {
  const Model& model = models_[m];
  std::vector<bool> covered = model.in_triangles();
  if (look_.surface)
    for (const int i : liquids_[m].ids) covered[static_cast<std::size_t>(i)] = true;
  const auto bare = [&](int i) { return !covered[static_cast<std::size_t>(i)]; };
  int count = 0;
  for (int i = 0; i < model.particles; ++i) count += bare(i);
  // Three tenths of the mean distance in a cloud, a fifth of a spring, 0.04 of the picture at most.
  double radius = 0.04 / viewpoint_.scale;
  if (count > 8) {
    double parts = 1;
    while (parts * parts * parts < count) ++parts;
    radius = std::min(radius, 0.28 / viewpoint_.scale / parts);
  }
  for (const ModelFamily& family : model.families)
    for (std::size_t s = 0; s < family.ends.size(); ++s)
      if (bare(family.ends[s][0]) && family.rest[s] > 0)
        radius = std::min(radius, std::max(0.2 * family.rest[s], 0.006 / viewpoint_.scale));
  const auto size = static_cast<float>(radius * viewpoint_.scale);
  const std::vector<double> values = quantity(model, frame, look_.colour);
  for (int i = 0; i < model.particles; ++i) {
    const bool pinned = std::ranges::binary_search(model.pinned, i);
    if (!bare(i) && !pinned) continue;
    V3 tint = colour(pinned ? kPinned : kParticle);
    if (!values.empty() && !pinned) tint = scale_.colour(values[static_cast<std::size_t>(i)]);
    const float share = bare(i) ? (pinned ? 0.7F * size : size) : 0.011F;
    picture.balls.push_back({place(m, frame.at(i)), share, tint, bare(i)});
  }
  if (model.curves()) {
    for (std::size_t f = 0; f < model.families.size(); ++f)
      for (const auto& [a, b] : model.families[f].ends)
        picture.lines.push_back(
            {place(m, frame.at(a)), place(m, frame.at(b)), 3, colour(family_colour(f)), false});
    return;
  }
  if (look_.all_springs) return;
  for (const ModelFamily& family : model.families)
    for (const auto& [a, b] : family.ends)
      if ((bare(a) || bare(b)) && !torn_edge(frame.torn, a, b))
        picture.lines.push_back(
            {place(m, frame.at(a)), place(m, frame.at(b)), 3, colour(kBar), false});
  const auto seen = [&](const ModelPoint& end) { return end.count > 1 || bare(end.ids[0]); };
  for (const auto& [a, b] : model.ties)
    if ((seen(a) || seen(b)) && !torn_edge(frame.torn, a.ids[0], b.ids[0]))
      picture.lines.push_back(
          {place(m, frame.at(a)), place(m, frame.at(b)), 3, colour(kBar), false});
}

// Paths that nobody followed between the moments go straight from one to the next.
void Scenery::follow(std::size_t m) {
  const std::vector<Trail> chosen = trails_of(models_[m], look_);
  std::vector<Path>& paths = trails_.emplace_back();
  const int own = own_trail(models_[m], look_);
  if (own >= 0) paths.push_back({0x5E98D6, 0xB4C6DC, {}, {}});
  for (const Trail& trail : chosen) paths.push_back({trail.colour, 0xD9DCE0, {}, {}});
  if (paths.empty()) return;
  Moment room;
  for (std::size_t at = 0; at < moments_.size(); ++at) {
    const Frame& frame = moments_.at(at, room)[m];
    for (std::size_t k = 0; k < paths.size(); ++k) {
      std::vector<Vec3>& points = paths[k].points;
      if (own >= 0)
        points.push_back(frame.at(own));
      else if (k < frame.paths.size() && !frame.paths[k].empty())
        points.insert(points.end(), frame.paths[k].begin(), frame.paths[k].end());
      else if (const Vec3 x = frame.at(chosen[k].point); points.empty() || points.back() != x)
        points.push_back(x);
      paths[k].ends.push_back(points.size());
    }
  }
}

void Scenery::trails(Picture& picture, std::size_t m, std::size_t at) const {
  for (const Path& path : trails_[m]) {
    const std::size_t end = at < path.ends.size() ? path.ends[at] : path.points.size();
    for (std::size_t k = 1; k < end; ++k) {
      const float age = static_cast<float>(end - 1 - k) / static_cast<float>(end);
      picture.lines.push_back({place(m, path.points[k - 1]), place(m, path.points[k]),
                               2.2F - 1.4F * age,
                               raster::mix(colour(path.fresh), colour(path.faded), age), false});
    }
  }
}

// Chosen springs in the colours of their families. At a picked particle a spring that runs along
// a shorter one is an arc over it.
void Scenery::springs(Picture& picture, std::size_t m, const Frame& frame) const {
  const Model& model = models_[m];
  for (std::size_t f = 0; f < model.families.size(); ++f) {
    const ModelFamily& family = model.families[f];
    const V3 tint = colour(family_colour(f));
    const bool named =
        look_.all_springs || std::ranges::find(look_.families, family.name) != look_.families.end();
    for (const auto& ends : family.ends) {
      if (torn_edge(frame.torn, ends[0], ends[1])) continue;
      const bool at_a = picked(ends[0]), at_b = picked(ends[1]);
      const V3 a = place(m, frame.at(ends[0])), b = place(m, frame.at(ends[1]));
      if (named) picture.lines.push_back({a, b, 1.2F, tint, false});
      if (!at_a && !at_b) continue;
      const V3 from = at_a ? a : b, to = at_a ? b : a, way = to - from;
      picture.balls.push_back({to, 0.012F, tint, false});
      bool over = false;
      for (const ModelFamily& other : model.families)
        for (const auto& o : other.ends) {
          const int own = at_a ? ends[0] : ends[1];
          if (o[0] != own && o[1] != own) continue;
          const V3 short_way = place(m, frame.at(o[0] == own ? o[1] : o[0])) - from;
          const float l = raster::length(way), s = raster::length(short_way);
          over = over || (s < 0.8F * l && raster::dot(way, short_way) > 0.95F * l * s);
        }
      if (!over) {
        picture.lines.push_back({from, to, 4, tint, true});
        continue;
      }
      const V3 aside = raster::unit(raster::cross(way, viewpoint_.eye.forward));
      const V3 lift = raster::unit(aside - 0.6F * viewpoint_.eye.forward);
      V3 before = from;
      for (int k = 1; k <= 12; ++k) {
        const float s = static_cast<float>(k) / 12;
        const V3 next = from + s * way + (s * (1 - s) * 1.1F * raster::length(way)) * lift;
        picture.lines.push_back({before, next, 4, tint, true});
        before = next;
      }
    }
  }
  for (const int i : look_.picked)
    if (i < model.particles && !model.families.empty())
      picture.balls.push_back({place(m, frame.at(i)), 0.016F, colour(0xFFF2B0), false});
}

void Scenery::wires(Picture& picture, std::size_t m, const Frame& frame) const {
  const std::vector<double> values = quantity(models_[m], frame, look_.colour);
  for (const auto& [a, b] : wires_[m]) {
    if (torn(frame, a, b)) continue;
    V3 tint = colour(kWire);
    if (!values.empty())
      tint = scale_.colour(
          0.5 * (values[static_cast<std::size_t>(a)] + values[static_cast<std::size_t>(b)]));
    picture.lines.push_back({place(m, frame.at(a)), place(m, frame.at(b)), 1.5F, tint, false});
  }
}

void Scenery::solids(Picture& picture, std::size_t m, const Frame& frame) const {
  for (const RenderShape& solid : frame.solids)
    add_solid(picture, solid, viewpoint_, viewpoint_.offsets[m],
              solid.body                                ? 3
              : solid.form == RenderShape::Form::kPlane ? 2
                                                        : 1);
}

// Problems of the picture: particles outside of it, an eye inside a solid.
std::vector<std::string> Scenery::warnings(const Moment& moment) const {
  std::vector<std::string> lines;
  int all = 0, lost = 0, no_numbers = 0;
  bool within = false;
  const V3& eye = viewpoint_.eye.at;
  const Vec3 own = Vec3(eye.x, eye.y, eye.z) / viewpoint_.scale + viewpoint_.origin;
  for (std::size_t m = 0; m < models_.size(); ++m) {
    all += models_[m].particles;
    for (int i = 0; i < models_[m].particles; ++i) {
      const Vec3 x = moment[m].at(i);
      lost += !viewpoint_.reaches[m].holds(x);
      no_numbers += !x.allFinite();
    }
    for (const RenderShape& solid : moment[m].solids)
      within = within || (!solid.inside && encloses(solid, own - viewpoint_.offsets[m]));
  }
  const auto add = [&](int count, const char* what) {
    if (count <= 0) return;
    std::string line = std::to_string(count);
    line.append(" of ").append(std::to_string(all)).append(" particles ").append(what);
    lines.push_back(std::move(line));
  };
  add(lost - no_numbers, "are too far away to be shown");
  add(no_numbers, "have positions that are not numbers");
  if (within) lines.emplace_back("the camera is inside of a solid");
  return lines;
}

// Above on the left what is seen, below on the right the scale of the colours.
void Scenery::words(Picture& picture, const Moment& moment) const {
  std::vector<std::string> lines = caption_;
  if (lines.empty()) {
    std::vector<std::string> names;
    for (const Model& model : models_) names.push_back(model.name);
    lines = {join(names, ", "), "t = " + brief(moment.front().t, 4) + " s"};
    const Model& first = models_.front();
    const bool same = std::ranges::all_of(models_, [&](const Model& model) {
      return model.method == first.method && model.h == first.h;
    });
    if (same) lines[1] += "   " + first.method + ", h = " + brief(first.h, 3) + " s";
  }
  if (models_.size() == 1 && !moment.front().note.empty()) lines.push_back(moment.front().note);
  if (!caption_.empty()) {
    float widest = 0;
    for (const std::string& line : lines)
      widest = std::max(widest, raster::text_width(line) * (&line == lines.data() ? 15.0F : 12.0F));
    add_plate(picture, 12, 10, widest + 22, 25 * static_cast<float>(lines.size()) + 8);
  }
  float y = 34;
  for (std::size_t i = 0; i < lines.size(); ++i, y += 25)
    picture.texts.push_back({lines[i], 22, y, i == 0 ? 15.0F : 12.0F, 0x2B323A, 0, i == 0});
  for (const std::string& line : warnings(moment)) {
    picture.texts.push_back({line, 22, y, 12, kWarning, 0, true});
    y += 25;
  }
  for (std::size_t m = 0; m < models_.size(); ++m) {
    if (!models_[m].curves()) continue;
    y += 6;
    for (std::size_t f = 0; f < models_[m].names.size(); ++f, y += 22) {
      const auto [low, high] = range_of(moment[m], f, models_[m].names.size());
      picture.patches.push_back({22, y - 9, 16, 5, {family_colour(f)}, 1});
      picture.texts.push_back({models_[m].names[f] + "  " + brief(low, 3) + " to " + brief(high, 3),
                               46, y, 12, 0x2B323A, 0, false});
    }
  }
  if (!look_.picked.empty()) {
    y += 6;
    std::set<std::string> named;
    for (std::size_t m = 0; m < models_.size(); ++m)
      for (std::size_t f = 0; f < models_[m].families.size(); ++f) {
        const Model& model = models_[m];
        std::vector<int> to;
        for (const auto& [a, b] : model.families[f].ends) {
          if (torn(moment[m], a, b)) continue;
          if (picked(a)) to.push_back(b);
          if (picked(b)) to.push_back(a);
        }
        if (to.empty() || !named.insert(model.families[f].name).second) continue;
        std::ranges::sort(to);
        std::string line = model.families[f].name;
        for (std::size_t k = 0; k < to.size() && k < 24; ++k) line += " " + std::to_string(to[k]);
        picture.patches.push_back({22, y - 9, 16, 5, {family_colour(f)}, 1});
        picture.texts.push_back({line, 46, y, 12, 0x2B323A, 0, false});
        y += 22;
      }
  }
  if (look_.colour == "none") return;
  const float scale = raster::text_scale(look_.height),
              width = static_cast<float>(look_.width) / scale;
  std::vector<unsigned> ramp;
  for (int i = 0; i < 64; ++i) ramp.push_back(scale_.screen(i / 63.0));
  const float left = width - 262, top = static_cast<float>(look_.height) / scale - 48;
  add_plate(picture, left - 12, top - 32, 262, 76);
  picture.patches.push_back({left, top, 240, 14, ramp, 1});
  const std::string unit = scale_.unit.empty() ? "" : " " + scale_.unit;
  const auto number = [&](double s) { return brief(s * scale_.factor * scale_.most, 3); };
  picture.texts.push_back({scale_.name, left, top - 9, 12, 0x2B323A, 0, false});
  picture.texts.push_back(
      {scale_.both_signs ? number(-1) : "0", left, top + 34, 11, 0x2B323A, 0, false});
  if (scale_.both_signs)
    picture.texts.push_back({"0", left + 120, top + 34, 11, 0x2B323A, 1, false});
  picture.texts.push_back({number(1) + unit, left + 240, top + 34, 11, 0x2B323A, 2, false});
}

}  // namespace sim
