-- n^3 particles with the potential of Lennard-Jones, let go from a lattice with thermal velocities.
-- In units of the potential (m, kg, J): a hot drop that evaporates into empty space.
local sim = require "sim"
local n = sim.arg("n", 6, "particles a side")
local spacing = sim.arg("spacing", 1.2, "of the lattice, m")
local temperature = sim.arg("temperature", 1, "kinetic energy a degree of freedom times two, J")
local smooth = sim.arg("smooth", "force", "at the cutoff: off, energy or force")
local seed = sim.arg("seed", 1, "of the velocities")

-- A number in [0, 1) from a counter alone: SplitMix64, Steele, Lea & Flood (2014).
local function uniform(counter)
  local z = (counter + (seed << 40)) * 0x9e3779b97f4a7c15
  z = (z ~ (z >> 30)) * 0xbf58476d1ce4e5b9
  z = (z ~ (z >> 27)) * 0x94d049bb133111eb
  return ((z ~ (z >> 31)) >> 11) * 2.0^-53
end
-- Close to normal with variance 1: the sum of twelve, less its mean.
local function normal(counter)
  local sum = -6
  for k = 1, 12 do sum = sum + uniform(12 * counter + k) end
  return sum
end

local velocities, mean = {}, {0, 0, 0}
for i = 1, n^3 do
  velocities[i] = {}
  for axis = 1, 3 do
    velocities[i][axis] = temperature^0.5 * normal(3 * i + axis)
    mean[axis] = mean[axis] + velocities[i][axis] / n^3
  end
end
local gas = sim.particles { mass = 1 }
for i = 1, n^3 do
  local a, b, c = (i - 1) // n^2, (i - 1) // n % n, (i - 1) % n
  for axis = 1, 3 do velocities[i][axis] = velocities[i][axis] - mean[axis] end
  gas:add({ spacing * a, spacing * b, spacing * c }, { velocity = velocities[i] })
end
return sim.scene { name = "gas", particles = gas,
  forces = { sim.force.pair { "lennard_jones", epsilon = 1, sigma = 1, smooth = smooth } },
  integrator = "verlet", dt = 0.005, duration = 2 }
