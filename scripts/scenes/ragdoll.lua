-- Dolls of jointed limbs tumble down stairs. Cords keep knees, elbows and necks from bending too far.
local sim = require "sim"
local n = sim.arg("n", 1, "dolls, side by side")
local layers = sim.arg("layers", 1, "of dolls, one above the other")
local speed = sim.arg("speed", 1.5, "m/s, with which their heads are pushed")
local tolerance = sim.arg("tolerance", 1e-6, "of contact, of the velocities at hand")

local steps, rise, tread, apart = 5, 0.18, 0.28, 0.9  -- m, but the first
local bodies, joints = {}, sim.constraint.joint {}
local cords = sim.force.spring { family = "cord", stiffness = 30000, damping = 60, tension_only = true }

local function doll(height, z)
  local function limb(shape, mass, y, side)
    local body = sim.rigid { shape = shape, mass = mass, friction = 0.6,
      position = { 0, height + y, z + side }, velocity = { speed * y / 1.55, 0, 0 },
      angular_velocity = { 0, 0, -speed / 1.55 } }
    bodies[#bodies + 1] = body
    return body
  end
  -- A hinge between two limbs, `knee` m below the upper and above the lower; two ball joints make it.
  local function hinged(upper, lower, knee, radius, back)
    for _, z in ipairs { -0.02, 0.02 } do joints:tie(upper:at {0, -knee, z}, lower:at {0, knee, z}) end
    local up = 0.5 * radius - knee
    cords:tie(upper:at {back * radius, up, 0}, lower:at {back * radius, -up, 0})
  end

  local torso = limb(sim.box { half = {0.1, 0.25, 0.16} }, 30, 1.15, 0)
  local head = limb(sim.sphere { radius = 0.11 }, 5, 1.55, 0)
  joints:tie(torso:at {0, 0.27, 0}, head:at {0, -0.13, 0})
  for _, way in ipairs { {1, 0}, {-1, 0}, {0, 1}, {0, -1} } do
    cords:tie(torso:at {0.1 * way[1], 0.2, 0.1 * way[2]}, head:at {0.1 * way[1], 0, 0.1 * way[2]}, { rest = 0.2, stiffness = 5000 })
  end
  for _, side in ipairs { -1, 1 } do
    local arm = sim.capsule { radius = 0.04, length = 0.22 }
    local upper, fore = limb(arm, 2.5, 1.2, 0.24 * side), limb(arm, 1.5, 0.88, 0.24 * side)
    joints:tie(torso:at {0, 0.21, 0.24 * side}, upper:at {0, 0.16, 0})
    hinged(upper, fore, 0.16, 0.04, 1)
    local leg = sim.capsule { radius = 0.06, length = 0.3 }
    local thigh, shin = limb(leg, 8, 0.66, 0.09 * side), limb(leg, 4, 0.22, 0.09 * side)
    joints:tie(torso:at {0, -0.27, 0.09 * side}, thigh:at {0, 0.22, 0})
    hinged(thigh, shin, 0.22, 0.06, -1)
  end
end
for layer = 0, layers - 1 do
  for i = 1, n do doll(steps * rise + 2 * layer, apart * (i - 0.5 * (n + 1)) + 0.2 * (layer % 2)) end
end

local stairs = { sim.collider.plane { normal = {0, 1, 0}, friction = 0.6 } }
for i = 1, steps do
  local height, landing = 0.5 * (steps - i + 1) * rise, i == 1 and 0.5 or 0
  stairs[#stairs + 1] = sim.collider.box { center = { tread * (i - 1) - landing, height, 0 },
    half = { 0.5 * tread + landing, height, 0.5 * apart * n + 0.5 }, friction = 0.6 }
end
return sim.scene { name = "ragdoll", bodies = bodies, constraints = { joints }, colliders = stairs,
  contact = sim.contact.bodies { tolerance = tolerance },
  forces = { sim.force.gravity {}, cords },
  observe = { head = function(s) return s:body(1).position[2] end },
  integrator = "verlet", dt = 0.002, duration = 2 }
