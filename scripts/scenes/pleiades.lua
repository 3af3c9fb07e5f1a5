-- The Pleiades: seven stars in a plane, which pass each other closely (Hairer, Norsett & Wanner,
-- Solving ODEs I (1993), section II.10).
local sim = require "sim"
local x = { 3, 3, -1, -3, 2, -2, 2 }
local y = { 3, -3, 2, 0, 0, -4, 4 }
local u = { 0, 0, 0, 0, 0, 1.75, -1.5 }
local v = { 0, 0, 0, -1.25, 1, 0, 0 }

local n = #x
local state, formulas, names = {}, {}, {}
for block, values in ipairs { x, y, u, v } do
  for i = 1, n do
    state[#state + 1] = values[i]
    names[#names + 1] = ("xyuv"):sub(block, block) .. i
  end
end
for i = 1, n do
  formulas[i], formulas[n + i] = "u" .. i, "v" .. i
  -- Numbers that both stars of a pair read are written in one way, so that they are computed once.
  local ax, ay, weights = {}, {}, ""
  for j = 1, n do
    if j ~= i then
      local a, b = math.min(i, j), math.max(i, j)
      ax[#ax + 1] = ("%d*((x%d - x%d)*w%d)"):format(j == b and j or -j, b, a, j)
      ay[#ay + 1] = ("%d*((y%d - y%d)*w%d)"):format(j == b and j or -j, b, a, j)
      weights = weights .. ("; w%d = ((x%d - x%d)^2 + (y%d - y%d)^2)^-1.5"):format(j, b, a, b, a)
    end
  end
  formulas[2 * n + i] = table.concat(ax, " + ") .. weights
  formulas[3 * n + i] = table.concat(ay, " + ") .. weights
end
formulas.names = names

return sim.scene { name = "pleiades", state = state, field = sim.field.formula(formulas),
  integrator = sim.integrator.dop853 { tol = 1e-9 }, dt = 0.01, duration = 3 }
