// The page: list of maps, one map, and what is shown of it.
import { Clicks } from "./clicks.js";
import { Colours } from "./colours.js";
import { el, say } from "./dom.js";
import { listEpochs } from "./epochs.js";
import { drawGraph } from "./graph.js";
import { Hover } from "./hover.js";
import { Jobs } from "./jobs.js";
import { countMaps, listMaps } from "./map_list.js";
import { MapView } from "./map_view.js";
import { drawModels } from "./models.js";
import { LAYERS } from "./paint.js";
import { shared } from "./patches.js";
import { setToken } from "./rpc.js";
import { Stage } from "./stage.js";
import { Switches } from "./switches.js";

const NARROW = 600; // pixels; there the panel is closed at first

const stage = new Stage(el("stage"));
const hash = new URLSearchParams(location.hash.slice(1));
let view = null;
let layersDue = null;
let layersDrawn = Promise.resolve();
// What tests look at.
const state = (window.strata = { stage, plan: null, levels: null, measure: null, ready: false });
const clicks = new Clicks(stage, state);
const colours = new Colours(stage, state);
const hover = (state.hover = new Hover(stage));
const switches = new Switches(el("switches"));
const jobs = new Jobs(() => layersSoon());

function showState({ scans, epoch, inferred } = {}) {
  if (!view) return;
  if (scans || epoch || inferred) layersSoon();
  colours.showLegend();
  const levels = [...new Set(view.shown().map(({ decoded }) => decoded.level))].sort((a, b) => a - b);
  const detail = levels.length > 1 || levels[0] ? `, levels of detail ${levels.join(" ")}` : "";
  el("state").textContent = `${view.shown().length} tiles, ${view.surfaces().toLocaleString("en")} surfaces, epoch ${view.epoch ?? "0"}${detail}`;
}

// The camera of a link; null without one.
function cameraOf(link) {
  const camera = (link.get("cam") ?? "").split(",").map(Number);
  return camera.length === 6 && camera.every(Number.isFinite) ? camera : null;
}

// `link`: what it says of the view is shown; of a map chosen in the list nothing.
async function openMap(name, link = new URLSearchParams()) {
  view?.close();
  state.ready = false;
  clicks.clear();
  hover.clear();
  switches.clear();
  view = state.view = clicks.view = new MapView(name, stage, { changed: showState, told: say, painter: colours.painter() });
  colours.setView(view);
  say(`opening ${name} …`);
  el("name").textContent = name;
  await view.open();
  if (link.get("map") !== name) history.replaceState(null, "", `#${new URLSearchParams({ map: name })}`);
  if (link.has("show")) switches.on = new Set(link.get("show").split(","));
  const camera = cameraOf(link);
  const { low, high } = view.box();
  Object.assign(el("cut"), { min: low[2] - 0.5, max: high[2] + 1, value: high[2] + 1 });
  setCut(link.has("cut") && camera ? Number(link.get("cut")) : null);
  if (camera) stage.look(camera);
  else fit();
  view.look();
  el("of-map").hidden = false;
  clicks.prompt();
  state.ready = true;
  jobs.open(view);
  layersSoon(0);
  await colours.setHeights(low[2], high[2]);
  if (link.has("floor")) await colours.showFloor(link.get("floor"));
}

// What lies over the surfaces, once for several changes.
function layersSoon(ms = 1000) {
  if (!state.ready || layersDue) return;
  layersDue = setTimeout(() => {
    layersDue = null;
    // One after the other: an earlier answer that comes late would take away what a later one drew.
    layersDrawn = layersDrawn.then(() => drawLayers(view)).catch((error) => error.name !== "AbortError" && say(error.message));
  }, ms);
}

async function drawLayers(of) {
  jobs.setCurrent(await listEpochs(of, stage, jobs));
  await colours.findClasses();
  const graph = await drawGraph(of, stage, switches, hover);
  state.runs = graph.runs;
  colours.setScans(graph.scans);
  state.counts = { ...graph.counts, ...(await drawModels(of, stage, switches, hover)) };
}

function fit() {
  const { low, high } = view.box();
  const middle = low.map((value, i) => (value + high[i]) / 2);
  const reach = Math.max(high[0] - low[0], high[1] - low[1], 5);
  stage.look([middle[0], middle[1] - 0.7 * reach, middle[2] + 0.6 * reach, ...middle]);
}

// Where the slider cuts off; 1e9 at its last stop, nowhere.
function cutOf(slider) {
  return Number(slider.value) > Number(slider.max) - Number(slider.step) ? 1e9 : Number(slider.value);
}

// null: where the slider is.
function setCut(height) {
  const slider = el("cut");
  if (height !== null) slider.value = height;
  shared.cut.value = cutOf(slider);
  el("cut-value").textContent = shared.cut.value === 1e9 ? "nothing" : `${shared.cut.value.toFixed(2)} m`;
  stage.redraw();
}

function linkToView() {
  const link = new URLSearchParams({ map: view.name, cam: stage.view().map((v) => v.toFixed(2)).join(","), layer: el("layer").value, show: [...switches.on].join() });
  const cut = cutOf(el("cut"));
  if (cut < 1e9) link.set("cut", cut.toFixed(2));
  if (!el("floor-choice").hidden && el("floor").value) link.set("floor", el("floor").value);
  history.replaceState(null, "", `#${link}`);
  navigator.clipboard?.writeText(location.href).catch(() => {});
  say("the address shows this view now, and is copied");
}

function savePicture() {
  stage.draw(); // what is drawn is kept until the next task only
  stage.canvas.toBlob((blob) => {
    const link = document.createElement("a");
    link.href = URL.createObjectURL(blob);
    link.download = `${view?.name ?? "strata"}.png`;
    link.click();
    URL.revokeObjectURL(link.href);
  });
}

function setDark(dark) {
  document.body.classList.toggle("dark", dark);
  colours.setDark(dark);
  stage.background(dark ? "#14171a" : "#fbfbf7");
}

const KEYS = {
  "[": () => setCut(Number(el("cut").value) - 0.25),
  "]": () => setCut(Number(el("cut").value) + 0.25),
  "+": () => stage.zoom(0.8),
  "-": () => stage.zoom(1.25),
  f: () => view && fit(),
  l: () => view && linkToView(),
  m: () => view && clicks.setMeasuring(!clicks.measuring),
  p: savePicture,
  d: () => setDark(!document.body.classList.contains("dark")),
  Escape: () => clicks.setMeasuring(false),
};

// Keys that a control takes for itself.
const takes = (target) => target instanceof HTMLSelectElement || (target instanceof HTMLInputElement && ["password", "text"].includes(target.type));

function wireKeys() {
  LAYERS.forEach((_, i) => (KEYS[i + 1] = () => colours.set(i)));
  addEventListener("keydown", (event) => {
    if (takes(event.target) || event.ctrlKey || event.metaKey || event.altKey) return;
    if (event.key === "Enter" && event.target === stage.canvas) clicks.at(innerWidth / 2, innerHeight / 2);
    else KEYS[event.key]?.();
  });
}

// A click or tap: one pointer that stays where it came down.
function wirePointer() {
  let downs = 0;
  let at = null;
  stage.canvas.addEventListener("pointerdown", (event) => {
    at = ++downs === 1 && event.button === 0 ? [event.clientX, event.clientY] : null;
  });
  const up = (event) => {
    downs = Math.max(0, downs - 1);
    const tapped = at && event.type === "pointerup" && Math.hypot(event.clientX - at[0], event.clientY - at[1]) <= 6;
    at = null;
    if (!tapped) return;
    stage.canvas.focus({ preventScroll: true });
    clicks.at(event.clientX, event.clientY);
  };
  stage.canvas.addEventListener("pointerup", up);
  stage.canvas.addEventListener("pointercancel", up);
}

function wirePanel() {
  el("cut").oninput = () => setCut(null);
  el("link").onclick = () => KEYS.l();
  el("measure").onclick = () => KEYS.m();
  el("picture").onclick = savePicture;
  el("dark").onclick = KEYS.d;
  el("panel").open = innerWidth > NARROW;
  el("token-form").onsubmit = (event) => {
    event.preventDefault();
    setToken(el("token").value.trim());
    el("token").value = "";
    begin();
  };
  addEventListener("unauthenticated", () => {
    if (!el("token-form").hidden) return;
    el("token-form").hidden = false;
    el("panel").open = true;
    el("token").focus();
    say(view ? "the token holds no longer: enter another" : "this server asks for a token");
  });
}

// Also after a new token: a map that is open stays, and follows again by itself.
async function begin() {
  let maps = [];
  try {
    maps = await listMaps(openMap);
    el("token-form").hidden = true;
    const name = hash.get("map") ?? (maps.length === 1 ? maps[0].name : null);
    if (view && state.ready) clicks.prompt();
    else if (name) await openMap(name, hash);
    else if (maps.length) say("choose a map");
  } catch (error) {
    say(error.message);
  }
  countMaps(maps); // after the map asked for: it may be the only one that the server opens
  state.begun = true;
}

if (hash.has("token")) {
  setToken(hash.get("token"));
  hash.delete("token");
  history.replaceState(null, "", `#${hash}`);
}
wireKeys();
wirePointer();
wirePanel();
setDark(matchMedia("(prefers-color-scheme: dark)").matches);
colours.set(Number(hash.get("layer") ?? 0));
begin();
