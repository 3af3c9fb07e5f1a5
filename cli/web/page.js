// The page around the scene: it starts the worker, hands it the scene, and has an editor and
// studies. The scene is shown by the page of `sim view`, in a frame.
const $ = (id) => document.getElementById(id);
const files = { ...SCENE.files };
let worker, ready = null, url, header = SCENE.header;

const say_kernel = (text) => { $("kernel").textContent = text; };
const fail = (text) => say_kernel(`this page cannot run: ${text}`);

// --- The kernel ------------------------------------------------------------------------------

const unpack = async (text) =>
  new Response(new Blob([Uint8Array.from(atob(text), (c) => c.charCodeAt(0))]).stream().pipeThrough(
    new DecompressionStream("gzip"))).blob();

async function start() {
  url = URL.createObjectURL(new Blob([await unpack(WORKER)], { type: "text/javascript" }));
  worker = new Worker(url);
  worker.onerror = (event) => fail(event.message);
  worker.onmessage = ({ data }) => {
    if (data.failed) fail(data.failed);
    if (data.ready) {
      ready = data.ready;
      say_kernel(ready.exact ? "multiply-add in software: slower, same bits"
        : "multiply-add of this processor");
      document.body.dataset.exact = ready.exact;
    }
    if (data.opened !== undefined) told(data.opened);
    if (data.html) ({ header } = data), ($("scene").srcdoc = data.html);
    if (data.seek) seek(data.seek);
    if (data.recording !== undefined)
      save(SCENE.scene.replace(/(.*\/)?(.*?)(\.lua)?$/, "$2.rec"), data.recording);
  };
  worker.postMessage({ start: { ...KERNEL, nonce: NONCE, scene: SCENE.scene, files, header } });
}

// The frame asks for its connection when it is ready for frames.
onmessage = (event) => {
  if (event.source !== $("scene").contentWindow || event.data !== "sim") return;
  const { port1, port2 } = new MessageChannel();
  $("scene").contentWindow.postMessage("sim", "*", [port1]);
  worker.postMessage({ port: true }, [port2]);
  document.body.dataset.shown = performance.now();
};

function save(name, text) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([text], { type: "text/plain" }));
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}

// A study, a search, or the names of the language, in a worker of its own: { text, svg }.
function run(what, ended) {
  return new Promise((resolve, reject) => {
    const own = new Worker(url);
    ended?.addEventListener("abort", () => own.terminate());
    const end = (act, value) => { own.terminate(); act(value); };
    own.onmessage = ({ data }) =>
      data.ran ? end(resolve, data.ran) : data.failed && end(reject, Error(data.failed));
    own.onerror = (event) => end(reject, Error(event.message));
    own.postMessage({ run: { module: ready.module, scene: SCENE.scene, header, files, ...what } });
  });
}

// A method and a step that keep an error, for the scene as its file makes it.
let searching = null;
async function seek({ key, error }) {
  searching?.abort();
  searching = error ? new AbortController() : null;
  if (!error) return;
  let answer;
  try {
    answer = JSON.parse((await run({ error }, searching.signal)).text);
  } catch (problem) {
    answer = { commands: "", words: problem.message };
  }
  worker.postMessage({ found: { key, ...answer } });
}

// --- The editor ------------------------------------------------------------------------------

const text = $("text");
let wrong = 0; // the line of an error

function number_lines() {
  const count = text.value.split("\n").length, list = [];
  for (let i = 1; i <= count; ++i) list.push(i === wrong ? `<span class="bad">${i}</span>` : i);
  $("lines").innerHTML = list.join("\n");
  $("lines").scrollTop = text.scrollTop;
}

function told(error) {
  const at = error.match(/\.lua:(\d+)/);
  wrong = at ? +at[1] : 0;
  $("error").textContent = error.trim();
  number_lines();
  if (error) show("editor");
  document.body.dataset.error = error;
}

function open_scene() {
  files[SCENE.scene] = text.value;
  header = "";
  worker.postMessage({ open: { scene: SCENE.scene, files, header } });
}

// Names of the language: of `sim list --luacats`, asked for once. A field knows its plugin.
let names = null;
async function names_of_language() {
  if (names) return names;
  names = [];
  const { text: list } = await run({});
  let owner = "";
  for (const line of list.split("\n")) {
    const [, kind, name, words] =
      line.match(/^(---@class|---@field|function) ([.:\w]+)\??(.*)$/) || [];
    if (kind === "---@class") owner = name;
    if (kind === "---@field") names.push({ name, words, owner });
    if (kind === "function")
      names.push({ name: name.startsWith("sim.") ? name : name.replace(/^\w+/, ""),
        words: words.replace(/ end$/, "") });
  }
  return names;
}

// Completions of the word before the cursor: fields of the table that it stands in, then functions, then
// fields of others, each name once.
function fitting(all, before) {
  const around = before.match(/(sim[.\w]*)\s*\{[^{}]*$/)?.[1];
  const rank = (each) => (each.owner === around ? 0 : each.owner ? 2 : 1);
  const found = new Map();
  for (const each of all.filter((one) => one.name.startsWith(word) && one.name !== word)
    .sort((a, b) => rank(a) - rank(b)))
    if (!found.has(each.name)) found.set(each.name, each);
  return [...found.values()].slice(0, 40);
}

let offered = [], chosen = 0, word = "";
function offer() {
  const list = $("names");
  list.hidden = !offered.length;
  list.replaceChildren(...offered.map((each, i) => {
    const row = document.createElement("li"), more = document.createElement("small");
    row.textContent = each.name;
    more.textContent = each.words.slice(0, 60);
    row.append(more);
    row.className = i === chosen ? "on" : "";
    row.onpointerdown = (event) => { event.preventDefault(); chosen = i; complete(); };
    return row;
  }));
  if (!offered.length) return;
  const before = text.value.slice(0, text.selectionStart).split("\n"),
    style = getComputedStyle(text), line = parseFloat(style.lineHeight),
    wide = parseFloat(style.fontSize) * 0.6;
  list.style.top = `${8 + before.length * line - text.scrollTop}px`;
  list.style.left = `${Math.max(0, Math.min($("paper").clientWidth - 240,
    $("lines").offsetWidth + 8 + (before.at(-1).length - word.length) * wide))}px`;
  list.children[chosen].scrollIntoView({ block: "nearest" });
}

async function suggest(asked) {
  const before = text.value.slice(0, text.selectionStart);
  word = before.match(/(sim\.[\w.]*|:\w*|\w+)$/)?.[0] || "";
  const all = await names_of_language();
  offered = word.length >= (asked ? 0 : 2) ? fitting(all, before) : [];
  chosen = 0;
  offer();
}

function complete() {
  const each = offered[chosen];
  text.setRangeText(each.name, text.selectionStart - word.length, text.selectionStart, "end");
  offered = [];
  offer();
  number_lines();
}

text.oninput = () => { number_lines(); suggest(false); };
text.onscroll = number_lines;
text.onblur = () => { offered = []; offer(); };
text.onkeydown = (event) => {
  const { key } = event, listed = offered.length > 0;
  if (key === "Enter" && (event.ctrlKey || event.metaKey)) open_scene();
  else if (key === " " && event.ctrlKey) suggest(true);
  else if (listed && (key === "ArrowDown" || key === "ArrowUp")) {
    chosen = (chosen + (key === "ArrowDown" ? 1 : offered.length - 1)) % offered.length;
    offer();
  } else if (listed && (key === "Enter" || key === "Tab")) complete();
  else if (listed && key === "Escape") { offered = []; offer(); }
  else if (key === "Tab" && !event.shiftKey) text.setRangeText("  ", text.selectionStart,
    text.selectionEnd, "end");
  else return;
  event.preventDefault();
  event.stopPropagation();
};

// --- Studies ---------------------------------------------------------------------------------

async function study(name, title) {
  show("study");
  $("study").querySelector("h2").textContent = title;
  $("plot").replaceChildren();
  $("said").textContent = "computing";
  $(name).disabled = true;
  try {
    const { text, svg } = await run({ study: name });
    $("said").textContent = text;
    if (svg) {
      const image = new Image();
      image.src = `data:image/svg+xml,${encodeURIComponent(svg)}`;
      image.alt = title;
      $("plot").append(image);
    }
    document.body.dataset.studied = name;
  } catch (error) {
    $("said").textContent = error.message;
  }
  $(name).disabled = false;
}

$("stability").onclick = () => study("stability", "Largest stable steps");
$("tradeoff").onclick = () => study("tradeoff", "Error against cost");

// --- Panels ----------------------------------------------------------------------------------

function show(id) {
  for (const each of ["editor", "study"]) $(each).hidden = each !== id;
  $("edit").className = id === "editor" ? "on" : "";
  if (id === "editor") number_lines();
}
for (const button of document.querySelectorAll(".close")) button.onclick = () => show("");
$("edit").onclick = () => show($("editor").hidden ? "editor" : "");
$("run").onclick = open_scene;
$("save").onclick = () => save(SCENE.scene.replace(/.*\//, ""), text.value);
$("record").onclick = () => worker.postMessage({ recording: true });
onkeydown = (event) => { if (event.key === "Escape") show(""); };

$("name").textContent = SCENE.scene;
text.value = files[SCENE.scene] ?? "";
start().catch((error) => fail(error.message));
