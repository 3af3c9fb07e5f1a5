// The scene that the address names: ?scene=cloth&set=n=16&integrator=euler&dt=0.05, words of the header
// of a recording. SIM_SCENES has the texts of the scenes that come with sim, by name.
function scene_of_address() {
  const asked = [...new URLSearchParams(location.search)];
  const name = asked.find(([word]) => word === "scene")?.[1] || "cloth", scene = `scenes/${name}.lua`;
  const header = asked.filter(([word]) => word !== "scene")
    .map((pair) => pair.join(" ").replaceAll("\n", " ") + "\n").join("");
  return { scene, header, files: Object.hasOwn(SIM_SCENES, name) ? { [scene]: SIM_SCENES[name] } : {} };
}
