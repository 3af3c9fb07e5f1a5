// The worker of a page: the kernel, stepped in real time, and the connection to the page that shows
// it. A study has a worker of its own, so that the scene goes on.
const FRAME = 1000 / 60, // ms between two frames
  STEPS = 0.75 * FRAME, // of it, for steps
  QUIET = 200, // ms between frames where nothing changes
  IN_FLIGHT = 2; // frames that were not drawn yet

let module, sim, page, port = null, number = 0, in_flight = 0, next = 0, quiet = 0, nonce = "",
  sought = ""; // the search that is wanted

// The bytes in base64; Uint8Array.from() would take a hundred times as long.
function bytes_of(text) {
  const chars = atob(text), bytes = new Uint8Array(chars.length);
  for (let i = 0; i < bytes.length; ++i) bytes[i] = chars.charCodeAt(i);
  return bytes;
}

// The module with files, in the folder where its scenes are; what it writes goes to `out`.
function make(files, out) {
  const line = (text) => out(text + "\n");
  return makeSim({
    thisProgram: "/sim/bin/sim",
    print: line,
    printErr: line,
    instantiateWasm(imports, done) {
      WebAssembly.instantiate(module, imports).then((instance) => done(instance, module));
      return {};
    },
    preRun: [({ FS }) => {
      FS.mkdirTree("/proc/self");
      FS.symlink("/sim/bin/sim", "/proc/self/exe");
      FS.mkdirTree("/run");
      FS.chdir("/run");
      for (const [name, text] of Object.entries(files)) put(FS, name, text);
    }],
  });
}
function put(FS, name, text) {
  const path = `/run/${name}`;
  FS.mkdirTree(path.slice(0, path.lastIndexOf("/")));
  FS.writeFile(path, text);
}

const call = (name, result, types = [], values = []) =>
  sim.ccall(`sim_${name}`, result, ["number", ...types], [page, ...values]);

function show() {
  number = call("number", "number");
  port = null;
  postMessage({ html: call("html", "string", ["string"], [nonce]),
    header: call("header", "string") });
}

// The search for a method and a step that keep an error is done by a worker of its own, which the
// page starts, and ends where another one, or none, is wanted.
function seek() {
  const wanted = call("wanted", "number"), key = wanted ? `${number} ${wanted}` : "";
  if (key === sought) return;
  sought = key;
  postMessage({ seek: { key, error: key && call("asked", "string") } });
}
function found({ key, commands, words }) {
  if (key === sought)
    call("choose", null, ["number", "string", "string"], [+key.split(" ")[1], commands, words]);
  seek();
}

function open({ scene, files, header }) {
  for (const [name, text] of Object.entries(files)) put(sim.FS, name, text);
  const error = call("open", "string", ["string", "string"], [scene, header]);
  postMessage({ opened: error });
  if (error) return;
  show();
  seek();
}

// Words of the page that shows the scene.
function heard(words) {
  if (words === "drawn") return void (in_flight = Math.max(0, in_flight - 1));
  if (words === "hello") return port.postMessage(call("past", "string"));
  const why = call("say", "string", ["string"], [words.slice(0, 4096)]);
  if (why) port.postMessage(JSON.stringify({ error: why }));
  if (call("number", "number") !== number) show();
  seek();
}

function tick() {
  next = Math.max(next + FRAME, performance.now());
  if (port) {
    const changed = call("run", "number", ["number"], [STEPS / 1000]), now = performance.now();
    if (in_flight < IN_FLIGHT && (changed || now > quiet)) {
      quiet = now + QUIET;
      const at = call("frame", "number"), size = call("size", "number");
      const frame = sim.HEAPU8.slice(at, at + size).buffer;
      ++in_flight;
      port.postMessage(frame, [frame]);
    }
  }
  setTimeout(tick, Math.max(0, next - performance.now()));
}

// One study with its plot, a search, or the names of the language, in a module of their own.
async function run({ study, error, scene, header, files }) {
  sim = await make(files, () => {});
  page = sim.ccall("sim_page", "number");
  const file = "/run/study.svg";
  const texts = (name, ...values) => call(name, "string", values.map(() => "string"), values);
  const text = error ? texts("search", scene, header, error)
    : study ? texts("study", study, scene, header, file) : texts("names");
  const svg = sim.FS.analyzePath(file).exists ? sim.FS.readFile(file, { encoding: "utf8" }) : "";
  postMessage({ ran: { text, svg } });
}

async function start(message) {
  const exact = !rounds_once(), unpack = await WebAssembly.compile(bytes_of(message.unpack));
  const bytes = unpacked_lzma(unpack, bytes_of(message.kernel), message.size);
  module = await WebAssembly.compile(exact ? bytes : fused(bytes, bytes_of(message.sites)));
  nonce = message.nonce;
  sim = await make({}, () => {});
  page = sim.ccall("sim_page", "number");
  postMessage({ ready: { exact, module } });
  open(message);
  tick();
}

onmessage = ({ data, ports }) => {
  const failed = (error) => postMessage({ failed: String(error && error.message || error) });
  try {
    if (data.start) start(data.start).catch(failed);
    else if (data.run) ({ module } = data.run), run(data.run).catch(failed);
    else if (data.open) open(data.open);
    else if (data.found) found(data.found);
    else if (data.recording) postMessage({ recording: call("recording", "string") });
    else if (data.port) {
      const own = (port = ports[0]);
      in_flight = 0;
      // Words of a frame that another has replaced come too late.
      own.onmessage = (event) => { if (port === own) heard(event.data); };
    }
  } catch (error) {
    failed(error);
  }
};
