// Models and frames of systems, what is measured at particles, and where the eye stands.
#include "core/picture/model.h"

#include <catch2/catch.hpp>

#include "core/base/error.h"
#include "core/picture/scenery.h"
#include "tests/lua/scene_text.h"
#include "tests/support/scenes.h"

namespace {

using sim::Look;
using sim::Model;
using sim::Moment;

struct Seen {
  std::vector<Model> models;
  std::vector<Moment> moments;
};

Seen cloth(int n, int steps) {
  sim::Registry registry = sim_test::make_registry();
  const sim::SystemSpec spec = sim_test::make_cloth(n);
  sim::Simulation system(spec, registry);
  Seen seen{{sim::make_model(spec, system)}, {{sim::take_frame(system)}}};
  for (int i = 0; i < steps; ++i) {
    REQUIRE(system.step());
    seen.moments.push_back({sim::take_frame(system)});
  }
  return seen;
}

template <class Read>
std::string refused(Read read) {
  try {
    read();
  } catch (const sim::Error& error) {
    CHECK(error.kind() == sim::ErrorKind::kUsage);
    return error.what();
  }
  return "";
}

}  // namespace

TEST_CASE("a cloth is triangles of its grid and springs by family") {
  const Seen seen = cloth(8, 0);
  const Model& model = seen.models[0];
  CHECK(model.particles == 64);
  CHECK(model.triangles.size() == 2 * 7 * 7);
  CHECK(model.pinned == std::vector<int>{0, 7});
  REQUIRE(model.families.size() == 3);
  CHECK(model.families[0].name == "structural");
  CHECK(model.families[0].ends.size() == 112);
  CHECK(model.families[1].ends.size() == 98);
  CHECK(model.families[2].ends.size() == 96);
  CHECK(model.up.y() == 1);
  CHECK(model.gravity == sim::Vec3(0, -9.81, 0));
  CHECK(model.drag == Approx(2.0 / 64));
  CHECK(model.others.empty());
  const sim::Frame& frame = seen.moments[0][0];
  CHECK(frame.x.size() == 192);
  CHECK(frame.at(9).x() == 0.125);
  CHECK(sim::strain(model, frame, 0, 0) == Approx(0).margin(1e-15));
}

TEST_CASE("rods are bars, and a sheet of rods is a sheet") {
  sim::Registry registry = sim_test::make_registry();
  sim::SystemSpec spec = sim_test::make_cloth(4);
  std::erase_if(spec.forces, [](const sim::PartSpec& part) { return part.plugin == "spring"; });
  sim::PartSpec rods = sim_test::make_part("distance");
  rods.elements.arity = 2;
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 3; ++j)
      rods.elements.ids.insert(rods.elements.ids.end(), {4 * i + j + 1, 4 * i + j});
  spec.constraints = {rods};
  sim::Simulation system(spec, registry);
  const Model model = sim::make_model(spec, system);
  REQUIRE(model.families.size() == 1);
  CHECK(model.families[0].rods);
  CHECK(model.families[0].ends.size() == 12);
  CHECK(model.families[0].ends[0] == std::array<int, 2>{0, 1});
  CHECK(model.families[0].rest[0] == Approx(0.25));
  CHECK(model.triangles.size() == 18);
}

TEST_CASE("particles without springs are no surface") {
  sim::Registry registry = sim_test::make_registry();
  sim::SystemSpec spec = sim_test::make_cloth(4);
  std::erase_if(spec.forces, [](const sim::PartSpec& part) { return part.plugin == "spring"; });
  sim::Simulation system(spec, registry);
  const Model model = sim::make_model(spec, system);
  CHECK(model.triangles.empty());
  CHECK(model.families.empty());
}

TEST_CASE("a solid that is drawn is where the collider is") {
  sim::Registry registry = sim_test::make_registry();
  sim::SystemSpec spec = sim_test::make_cloth(4);
  spec.colliders.push_back(sim_test::make_part(
      "plane", {{"point", sim::Vec3(0, -2, 0)}, {"normal", sim::Vec3(0, 3, 0)}}));
  const auto solids = sim::Simulation(spec, registry).shapes();
  REQUIRE(solids.size() == 1);
  CHECK(solids[0].form == sim::RenderShape::Form::kPlane);
  CHECK(solids[0].center.y() == Approx(-2));
  CHECK(solids[0].axes[1].y() == Approx(1));
}

TEST_CASE("the eye sees all that moves, and stays where it is") {
  const Seen seen = cloth(6, 200);
  const sim::Scenery scenery(seen.models, seen.moments, {});
  const sim::Picture first = scenery.picture(0);
  for (std::size_t i = 0; i < seen.moments.size(); i += 20) {
    const sim::Picture picture = scenery.picture(i);
    CHECK(picture.eye.at.x == first.eye.at.x);
    CHECK(picture.eye.forward.z == first.eye.forward.z);
    for (const sim::V3& p : picture.points) {
      const sim::V3 d = p - picture.eye.at;
      const float z = dot(d, picture.eye.forward);
      CHECK(z > 0);
      CHECK(std::abs(dot(d, picture.eye.up)) * picture.eye.focal < z);
      CHECK(std::abs(dot(d, picture.eye.right)) * picture.eye.focal < z * 16 / 9);
    }
  }
}

TEST_CASE("the eye sees the floor of a room that has yet to be filled") {
  sim::Registry registry = sim_test::make_registry();
  const sim::SceneSpec scene = sim::test::load_text(
      "local p = sim.particles { mass = 1 }\np:add {-2, 0.1, 0}\n"
      "return sim.scene { particles = p, integrator = 'verlet', dt = 0.01, duration = 1,\n"
      "  forces = { sim.force.gravity { g = {0, -9.81, 0} } }, colliders = { sim.collider.box {\n"
      "    center = {0, 10, 0}, half = {3, 10, 1}, inside = true } } }\n");
  sim::Simulation system(scene.systems[0], registry);
  const std::vector<Model> models{sim::make_model(scene.systems[0], system)};
  const std::vector<sim::Moment> moments{{sim::take_frame(system)}};
  const sim::Viewpoint viewpoint = sim::make_viewpoint(models, moments, {});
  for (const double y : {0.0, 20.0})
    for (const double x : {-3.0, 3.0})
      for (const double z : {-1.0, 1.0}) {
        const sim::V3 d = viewpoint.point({x, y, z}) - viewpoint.eye.at;
        const float deep = dot(d, viewpoint.eye.forward),
                    up = std::abs(dot(d, viewpoint.eye.up)) * viewpoint.eye.focal,
                    right = std::abs(dot(d, viewpoint.eye.right)) * viewpoint.eye.focal;
        CHECK((up < deep && right < deep * 16 / 9) == (y == 0));  // the walls may be high
      }
}

// Each system stands to the right of the one before, and all are in the picture.
TEST_CASE("systems side by side do not overlap, and the eye sees them all") {
  Seen seen = cloth(6, 100);
  for (int copies = 2; copies <= 3; ++copies) {
    seen.models.push_back(seen.models[0]);
    for (Moment& moment : seen.moments) moment.push_back(moment[0]);
    const sim::Viewpoint view = sim::make_viewpoint(seen.models, seen.moments, {});
    REQUIRE(view.offsets.size() == static_cast<std::size_t>(copies));
    const sim::Vec3 step = view.offsets[1] - view.offsets[0];
    if (copies == 3) CHECK((view.offsets[2] - view.offsets[1] - step).norm() < 1e-9);
    const auto place = [&](const Moment& moment, std::size_t m, std::size_t i) {
      const std::vector<double>& x = moment[m].x;
      return sim::Vec3(x[i], x[i + 1], x[i + 2]) + view.offsets[m];
    };
    sim::Vec3 low(HUGE_VAL, HUGE_VAL, HUGE_VAL), high = -low;
    float widest = 0;
    double ends[3] = {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL}, begins[3] = {HUGE_VAL, HUGE_VAL, HUGE_VAL};
    for (const Moment& moment : seen.moments)
      for (std::size_t m = 0; m < view.offsets.size(); ++m)
        for (std::size_t i = 0; i < moment[m].x.size(); i += 3) {
          const sim::Vec3 p = place(moment, m, i);
          const double along = p.dot(step) / step.norm();
          ends[m] = std::max(ends[m], along), begins[m] = std::min(begins[m], along);
          low = low.cwiseMin(p), high = high.cwiseMax(p);
          const sim::V3 d = view.point(p) - view.eye.at;
          const float z = dot(d, view.eye.forward);
          REQUIRE(z > 0);
          CHECK(std::abs(dot(d, view.eye.up)) * view.eye.focal < z);
          const float right = std::abs(dot(d, view.eye.right)) * view.eye.focal / z;
          CHECK(right < 16.0F / 9);
          widest = std::max(widest, right);
        }
    for (std::size_t m = 1; m < view.offsets.size(); ++m) CHECK(begins[m] > ends[m - 1]);
    CHECK(widest > 0.5F);  // and no further away than that takes
    // They are drawn there.
    const sim::Scenery scenery(seen.models, seen.moments, {});
    for (const std::size_t at : {std::size_t{0}, seen.moments.size() - 1}) {
      const sim::Picture picture = scenery.picture(at);
      const auto count = static_cast<std::size_t>(seen.models[0].particles);
      REQUIRE(picture.points.size() == count * view.offsets.size());
      for (std::size_t m = 0; m < view.offsets.size(); ++m)
        for (std::size_t i = 0; i < count; ++i) {
          const sim::V3 off =
              picture.points[m * count + i] - view.point(place(seen.moments[at], m, 3 * i));
          CHECK(dot(off, off) < 1e-8F);
        }
    }
    CHECK((view.origin - 0.5 * (low + high)).norm() < 0.1 * (high - low).norm());
  }
}

TEST_CASE("up is that of the first system of particles") {
  Seen seen = cloth(3, 0);
  seen.models.resize(3, seen.models[0]);
  for (Moment& moment : seen.moments) moment.resize(3, moment[0]);
  seen.models[0].up = {1, 0, 0};
  seen.models[1].up = {0, 0, 1};
  seen.models[2].up = {0, -1, 0};
  for (std::size_t first = 0; first < 3; ++first) {
    CHECK(sim::make_viewpoint(seen.models, seen.moments, {}).up == seen.models[first].up);
    seen.models[first].second_order = false;
  }
  CHECK(sim::make_viewpoint(seen.models, seen.moments, {}).up == sim::Vec3(0, 1, 0));
}

TEST_CASE("the ground is a plane that is there, or below everything") {
  const Seen seen = cloth(4, 50);
  const sim::Viewpoint own = sim::make_viewpoint(seen.models, seen.moments, {});
  REQUIRE(own.ground);
  for (const Moment& moment : seen.moments)
    for (int i = 0; i < 16; ++i) CHECK(own.point(moment[0].at(i)).y > own.ground->origin.y);
  Look look;
  look.ground = -7;
  const sim::Viewpoint given = sim::make_viewpoint(seen.models, seen.moments, look);
  CHECK(given.ground->origin.y == Approx(given.point({0, -7, 0}).y));
}

TEST_CASE("a camera that is given is kept") {
  const Seen seen = cloth(4, 0);
  Look look;
  sim::read_camera("eye=3,1,2 at=0,0,0 fov=90", look);
  const sim::Viewpoint view = sim::make_viewpoint(seen.models, seen.moments, look);
  const sim::V3 eye = view.point({3, 1, 2});
  CHECK(view.eye.at.x == Approx(eye.x));
  CHECK(view.eye.focal == Approx(1).epsilon(1e-6));
  CHECK(dot(view.eye.forward, sim::raster::unit(view.point({0, 0, 0}) - eye)) == Approx(1));
}

TEST_CASE("a picture says what it cannot show") {
  Seen seen = cloth(4, 0);
  const auto says = [&](const Look& look, const std::string& words) {
    const sim::Picture picture =
        sim::Scenery(seen.models, seen.moments, look).picture(seen.moments.size() - 1);
    return std::any_of(picture.texts.begin(), picture.texts.end(),
                       [&](const auto& text) { return text.text.find(words) != text.text.npos; });
  };
  Look within;
  sim::read_camera("eye=0.1,-0.3,0.2 at=0,0,0", within);
  CHECK_FALSE(says({}, "particles"));
  CHECK_FALSE(says(within, "camera"));

  sim::RenderShape ball{.form = sim::RenderShape::Form::kSphere, .center = {0, -0.3, 0}};
  ball.radius = 0.3;
  sim::RenderShape box{.form = sim::RenderShape::Form::kBox, .center = {0, -0.3, 0}};
  box.axes = {sim::Vec3{0.2, 0, 0}, sim::Vec3{0, 0.1, 0}, sim::Vec3{0, 0, 0.3}};
  sim::RenderShape capsule{.form = sim::RenderShape::Form::kCapsule, .center = {0, -0.3, 0}};
  capsule.axes[0] = {0, 0, 0.15}, capsule.radius = 0.12;
  for (const sim::RenderShape& solid : {ball, box, capsule}) {
    seen.moments[0][0].solids = {solid};
    CHECK(says(within, "the camera is inside of a solid"));
    CHECK_FALSE(says({}, "camera"));
  }
  seen.moments[0][0].solids[0].inside = true;  // a room
  CHECK_FALSE(says(within, "camera"));

  seen.moments.push_back(seen.moments[0]);
  std::vector<double>& x = seen.moments[1][0].x;
  x[9] = 1e6, x[13] = -1e9;
  x[16] = std::nan("");
  CHECK(says({}, "2 of 16 particles are too far away to be shown"));
  CHECK(says({}, "1 of 16 particles have positions that are not numbers"));
}

TEST_CASE("strain of a spring is shown where it is") {
  Seen seen = cloth(4, 0);
  sim::Frame& frame = seen.moments[0][0];
  frame.x[3 * 15 + 1] -= 0.3;  // the free corner
  const auto values = sim::quantity(seen.models[0], frame, "strain");
  REQUIRE(values.size() == 16);
  CHECK(values[15] > 0.3);
  CHECK(values[0] == Approx(0).margin(1e-15));
  CHECK(sim::quantity(seen.models[0], frame, "error").empty());
  Look look;
  look.colour = "strain";
  const auto scale = sim::colour_scale(look, seen.models, seen.moments);
  CHECK(scale.most >= *std::max_element(values.begin(), values.end()));
  look.most = 0.1;
  CHECK(sim::colour_scale(look, seen.models, seen.moments).most == 0.1);
}

TEST_CASE("energies of particles are those of the system") {
  Seen seen = cloth(4, 20);
  const sim::Frame& frame = seen.moments.back()[0];
  const auto values = sim::quantity(seen.models[0], frame, "energy");
  REQUIRE(values.size() == 16);
  double sum = 0, expected = 0;
  for (const double value : values) sum += value;
  // By its definition, spring by spring.
  for (std::size_t i = 0; i < 16; ++i)
    for (std::size_t c = 0; c < 3; ++c)
      expected += 0.5 * seen.models[0].mass[i] * frame.v[3 * i + c] * frame.v[3 * i + c];
  CHECK(expected > 0);
  for (const sim::ModelFamily& family : seen.models[0].families)
    for (std::size_t s = 0; s < family.ends.size(); ++s) {
      const double stretch =
          (frame.at(family.ends[s][0]) - frame.at(family.ends[s][1])).norm() - family.rest[s];
      expected += 0.5 * family.stiffness[s] * stretch * stretch;
    }
  CHECK(sum == Approx(expected).epsilon(1e-13));
}

namespace {

// A lattice with u = 100 i + 10 j + k and v = -u in cell (i, j, k), and its picture's model.
Seen lattice(const std::string& cells, int count, const std::string& look = "") {
  sim::Registry registry = sim_test::make_registry();
  const sim::SceneSpec scene = sim::test::load_text(
      "local n, state = " + cells +
      ", {}\n"
      "for i = 0, n[1] - 1 do for j = 0, (n[2] or 1) - 1 do for k = 0, (n[3] or 1) - 1 do\n"
      "  local u = 100 * i + 10 * j + k\n"
      "  state[#state + 1] = u; state[#state + 1] = -u\nend end end\n"
      "return sim.scene { state = state, integrator = 'rk4', dt = 0.1, duration = 1,\n" +
      look + "  field = sim.field.formula { '-u', '-v', names = {'u', 'v'}, cells = n } }\n");
  const sim::SystemSpec& spec = scene.systems[0];
  sim::Simulation system(spec, registry);
  Seen seen{{sim::make_model(spec, system)}, {{sim::take_frame(system)}}};
  CHECK(seen.moments[0][0].x.size() == 3 * static_cast<std::size_t>(seen.models[0].particles));
  CHECK(seen.models[0].particles == count);
  return seen;
}

}  // namespace

TEST_CASE("a lattice of two directions is a picture with a particle a cell") {
  const Seen seen = lattice("{3, 4}", 12);
  const Model& model = seen.models[0];
  CHECK(model.triangles.size() == 2 * 2 * 3);
  CHECK_FALSE(model.curves());
  const auto u = sim::quantity(model, seen.moments[0][0], "u"),
             v = sim::quantity(model, seen.moments[0][0], "v");
  REQUIRE((u.size() == 12 && v.size() == 12));
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 4; ++j) {
      const int cell = 4 * i + j;
      CHECK(seen.moments[0][0].at(cell) == sim::Vec3(i, j, 0));
      CHECK(u[static_cast<std::size_t>(cell)] == 100 * i + 10 * j);
      CHECK(v[static_cast<std::size_t>(cell)] == -(100 * i + 10 * j));
    }
  // Coloured by the first number unless another one is asked for; by both signs where it has them.
  Look look;
  CHECK(sim::colour_of(look, seen.models) == "u");
  const sim::ColourScale scale = sim::colour_scale(look, seen.models, seen.moments);
  CHECK((scale.name == "u" && !scale.both_signs));
  CHECK(scale.most == Approx(300));  // of 230
  look.colour = "v";
  CHECK(sim::colour_scale(look, seen.models, seen.moments).both_signs);
  const sim::Picture picture = sim::Scenery(seen.models, seen.moments, look).picture(0);
  CHECK((picture.colours.size() == 12 && picture.balls.empty() && !picture.ground));
  CHECK(sim::colour_of(Look{}, cloth(2, 0).models) == "none");
}

TEST_CASE("a lattice of one direction is a curve a name") {
  const Seen seen = lattice("{5}", 10);
  const Model& model = seen.models[0];
  const sim::Frame& frame = seen.moments[0][0];
  CHECK(model.curves());
  REQUIRE(model.families.size() == 2);
  CHECK((model.families[0].name == "u" && model.families[1].name == "v"));
  CHECK(model.families[1].ends == std::vector<std::array<int, 2>>{{5, 6}, {6, 7}, {7, 8}, {8, 9}});
  // Curves are 1 long, and half as high at the start: values reach from -400 to 400.
  for (int i = 0; i < 5; ++i) {
    CHECK((frame.at(i) - sim::Vec3(i / 4.0, 100.0 * i / 1600, 0)).norm() < 1e-15);
    CHECK((frame.at(5 + i) - sim::Vec3(i / 4.0, -100.0 * i / 1600, 0)).norm() < 1e-15);
  }
  const sim::Picture picture = sim::Scenery(seen.models, seen.moments, Look{}).picture(0);
  CHECK((picture.lines.size() == 8 && picture.balls.empty()));
  const auto drawn = [&](std::size_t line, std::size_t family) {
    return sim::raster::length(picture.lines[line].colour -
                               sim::colour(sim::family_colour(family))) == 0;
  };
  CHECK((drawn(3, 0) && drawn(4, 1)));
  const auto legend = [&](const std::string& text) {
    return std::ranges::count(picture.texts, text, &sim::PictureText::text) == 1;
  };
  CHECK((legend("u  0 to 400") && legend("v  -400 to 0")));
}

TEST_CASE("a lattice of three directions is its skin, and one cell is a point") {
  const Seen seen = lattice("{3, 4, 5}", 60);
  CHECK(seen.models[0].triangles.size() == 4 * (2 * 3 + 3 * 4 + 2 * 4));
  CHECK(seen.moments[0][0].at(59) == sim::Vec3(2, 3, 4));
  CHECK(sim::quantity(seen.models[0], seen.moments[0][0], "u")[59] == 234);
  CHECK(sim::Scenery(seen.models, seen.moments, Look{}).picture(0).ground);
  CHECK_FALSE(lattice("{1}", 1).models[0].lattice());
}

TEST_CASE("numbers of a lattice colour by their names") {
  CHECK_NOTHROW(lattice("{3, 4}", 12, "look = { color = 'v:2' },"));
  CHECK_THROWS_AS(lattice("{3, 4}", 12, "look = { color = 'w' },"), sim::Error);
}

TEST_CASE("a scale that is set colours as one that is asked for") {
  const Seen seen = cloth(5, 40);
  const auto colours = [](const sim::Scenery& scenery) {
    std::vector<float> list;
    for (const sim::V3& each : scenery.picture(40).colours)
      list.insert(list.end(), {each.x, each.y, each.z});
    return list;
  };
  Look narrow, wide;
  sim::read_colour("speed:0.5", narrow);
  sim::read_colour("speed:20", wide);
  sim::Scenery scenery(seen.models, seen.moments, narrow);
  const sim::Scenery wanted(seen.models, seen.moments, wide);
  REQUIRE(colours(wanted).size() == 75);
  CHECK(colours(scenery) != colours(wanted));
  scenery.set_scale(sim::colour_scale(wide, seen.models, seen.moments));
  CHECK(colours(scenery) == colours(wanted));
  CHECK(scenery.scale().most == 20);
}

TEST_CASE("scales end at 1, 2, 3 or 5 times a power of ten") {
  CHECK(sim::round_up(0.0123) == Approx(0.02));
  CHECK(sim::round_up(1) == 1);
  CHECK(sim::round_up(4e-7) == Approx(5e-7));
  CHECK(sim::round_up(60) == Approx(100));
  CHECK(sim::round_up(0) == 1);
  CHECK(sim::round_up(std::nan("")) == 1);
}

TEST_CASE("wrong looks are refused with a reason") {
  Look look;
  CHECK(refused([&] { sim::read_camera("eye=1,2", look); }).find("point") != std::string::npos);
  CHECK(refused([&] { sim::read_camera("eye=1,2,x", look); }).find("point") != std::string::npos);
  CHECK(refused([&] { sim::read_camera("ey=1,2,3", look); }).find("eye") != std::string::npos);
  CHECK(refused([&] { sim::read_camera("fov=200", look); }).find("150") != std::string::npos);
  CHECK(refused([&] { sim::read_camera("eye=1,1,1 at=1,1,1", look); }).find("one point") !=
        std::string::npos);
  CHECK(refused([&] { sim::read_camera("up=0,0,0", look); }).find("no length") !=
        std::string::npos);
  CHECK(refused([&] { sim::read_camera(" ", look); }).find("it says nothing") != std::string::npos);
  for (const char* const fov : {"fov=0.9", "fov=151", "fov=x"})
    CHECK(refused([&] { sim::read_camera(fov, look); }).find("1 to 150") != std::string::npos);
  for (const char* const right : {"fov=1", "fov=150", "up=0,-2,0", "eye=1,1,1 at=1,1,2 up=1,0,0"})
    CHECK(refused([&, fresh = Look()]() mutable { sim::read_camera(right, fresh); }).empty());
  Look fresh;
  sim::read_camera("eye=1,1,1 at=1,1,2 up=1,0,0 fov=150", fresh);
  CHECK((fresh.fov == 150 && *fresh.up == sim::Vec3(1, 0, 0) && *fresh.at == sim::Vec3(1, 1, 2)));
  CHECK(refused([&] { sim::read_colour("stran", look); }).find("strain") != std::string::npos);
  CHECK(refused([&] { sim::read_colour("strain:-1", look); }).find("> 0") != std::string::npos);
  CHECK_FALSE(refused([&] { sim::read_size("1000000x1000000", look); }).empty());
  CHECK_FALSE(refused([&] { sim::read_size("12", look); }).empty());
  CHECK_FALSE(refused([&] { sim::read_springs("-3", look); }).empty());

  const Seen seen = cloth(4, 0);
  const auto show = [&](const Look& wish) {
    return refused([&] { sim::Scenery(seen.models, seen.moments, wish); });
  };
  Look picked, family, colour;
  picked.picked = {16};
  family.families = {"sheer"};
  colour.colour = "error";
  CHECK(show(picked).find("0 to 15") != std::string::npos);
  CHECK(show(family).find("shear") != std::string::npos);
  CHECK_FALSE(show(colour).empty());
}

TEST_CASE("a picked particle shows its springs, by family") {
  const Seen seen = cloth(8, 0);
  Look look;
  look.picked = {12};
  const sim::Picture picture = sim::Scenery(seen.models, seen.moments, look).picture(0);
  // 4 structural and 4 shear ones as lines, 3 flex ones as arcs of 12 pieces.
  CHECK(picture.lines.size() == 4 + 4 + 3 * 12);
  const bool said = std::any_of(picture.texts.begin(), picture.texts.end(), [](const auto& text) {
    return text.text == "structural 4 11 13 20";
  });
  CHECK(said);
}

// The picked ones are balls in systems that have them and springs.
TEST_CASE("what is picked is drawn where it is there and has springs") {
  Seen seen = cloth(3, 0);
  const Seen large = cloth(4, 0);
  for (const bool loose : {false, true}) {
    seen.models.push_back(large.models[0]);
    seen.moments[0].push_back(large.moments[0][0]);
    if (loose) seen.models.back().families.clear();
  }
  sim::Scenery scenery(seen.models, seen.moments, {});
  const auto balls = [&] {
    const sim::Picture picture = scenery.picture(0);
    return std::ranges::count(picture.balls, 0.016F, &sim::PictureBall::radius);
  };
  CHECK(balls() == 0);
  for (const auto& [picked, wanted] :
       {std::pair{std::vector{2}, 2}, {{8}, 2}, {{9}, 1}, {{15}, 1}, {{16}, 0}, {{0, 12, 8}, 5}}) {
    scenery.set_picked(picked);
    CHECK(balls() == wanted);
  }
}

TEST_CASE("edges of a solid are sharp, and a sheet is smooth") {
  const auto picture_of = [](const Seen& seen) {
    return sim::Scenery(seen.models, seen.moments, Look{}).picture(0);
  };
  const Seen sheet = cloth(6, 0);
  CHECK(picture_of(sheet).points.size() == 36);

  sim::Registry registry = sim_test::make_registry();
  const sim::SceneSpec scene = sim::test::load_text(
      "local p = sim.grid { 3, 3, 3, du = {1,0,0}, dv = {0,1,0}, dw = {0,0,1}, mass = 1 }\n"
      "return sim.scene { particles = p, integrator = 'verlet', dt = 0.01, duration = 1,\n"
      "  forces = { sim.force.spring { stiffness = 1, grid = p,\n"
      "    offsets = { {0,0,1}, {0,1,0}, {1,0,0} } } } }\n");
  sim::Simulation system(scene.systems[0], registry);
  const Seen cube{{sim::make_model(scene.systems[0], system)}, {{sim::take_frame(system)}}};
  const sim::Picture picture = picture_of(cube);
  REQUIRE(picture.triangles.size() == 6 * 2 * 4);
  CHECK(picture.normals.size() == picture.points.size());
  // A corner in the middle of a side has the normal of that side, one on an edge does not lie
  // between those of two sides.
  int own = 0;
  for (const sim::PictureTriangle& triangle : picture.triangles) {
    const auto point = [&](std::size_t k) {
      return picture.points[static_cast<std::size_t>(triangle.points[k])];
    };
    const sim::V3 face =
        sim::raster::unit(sim::raster::cross(point(1) - point(0), point(2) - point(0)));
    for (const int i : triangle.points) {
      const float turned = sim::raster::dot(face, picture.normals[static_cast<std::size_t>(i)]);
      CHECK(turned > std::cos(41 * 3.14159265F / 180));
      own += turned > 0.9999F;
    }
  }
  // Each of the six sides has 24 corners of triangles; the eight corners of the cube may stay
  // smooth.
  CHECK(own >= 6 * 24 - 8 * 3);
}

TEST_CASE("particles that rigid bodies are made of are drawn as their bodies alone") {
  sim::Registry registry = sim_test::make_registry();
  const sim::SceneSpec scene = sim::test::load_text(
      "local p = sim.particles { mass = 1 }\np:add {0, 3, 0}\n"
      "local box = sim.rigid { shape = sim.box { half = {0.5, 0.2, 0.1} }, mass = 2 }\n"
      "return sim.scene { particles = p, bodies = { box }, integrator = 'verlet', dt = 0.01,\n"
      "  forces = { sim.force.gravity { g = {0, -9.81, 0} } }, duration = 1 }\n");
  sim::Simulation system(scene.systems[0], registry);
  const Model model = sim::make_model(scene.systems[0], system);
  CHECK(model.in_bodies == std::vector<int>{1, 2, 3, 4});
  CHECK(model.in_triangles() == std::vector<bool>{false, true, true, true, true});
  CHECK(model.families.empty());
}
