// The page: list of maps, one map, what is at a place, and paths by two clicks.
import { MapView } from "./map_view.js";
import { shared } from "./patches.js";
import { call, setToken, stream } from "./rpc.js";
import { Stage } from "./stage.js";

const LAYERS = ["traversability", "height", "class", "confidence", "sigma"];
const TRAVERSABILITY = { TRAVERSABILITY_TRAVERSABLE: "drivable", TRAVERSABILITY_NON_TRAVERSABLE: "not drivable", TRAVERSABILITY_UNDERSIDE: "underside" };
const RUNS = ["#0b3c75", "#e69f00", "#00664a", "#b0447f", "#d55e00", "#7a6a00"];

const el = (id) => document.getElementById(id);
const stage = new Stage(el("stage"));
const hash = new URLSearchParams(location.hash.slice(1));
let view = null;
let start = null;
let runsDue = null;
// What tests look at.
const state = (window.strata = { stage, plan: null, levels: null, ready: false });

// JSON leaves out what is 0, and nobody wants to read -0.00.
const metres = (value) => ((Math.round((value ?? 0) * 100) || 0) / 100).toFixed(2);

function say(text) {
  el("message").textContent = text;
}

function ageOf(created) {
  const days = (Date.now() - Date.parse(created)) / 86_400_000;
  return days < 1 / 24 ? `${Math.max(1, Math.round(days * 1440))} min` : days < 1 ? `${Math.round(days * 24)} h` : `${Math.round(days)} d`;
}

async function listMaps() {
  const maps = (await call("Maps/List", {})).maps ?? [];
  const rows = await Promise.all(maps.map(async (map) => {
    const { stats } = await call("Maps/Stats", { name: map.name });
    return [map.name, stats.scans ?? "0", ((stats.tile_bytes ?? 0) / 1e6).toFixed(1), ageOf(map.created)];
  }));
  el("maps").tBodies[0].replaceChildren(...rows.map((cells) => {
    const row = document.createElement("tr");
    cells.forEach((text, i) => {
      const cell = row.insertCell();
      if (i) return void (cell.textContent = text);
      const button = document.createElement("button");
      button.textContent = text;
      button.onclick = () => openMap(text);
      cell.append(button);
    });
    return row;
  }));
  if (!maps.length) say("no map yet: strata map create NAME");
  return maps;
}

function showState(scansToo) {
  if (!view) return;
  if (scansToo && state.ready && !runsDue) {
    runsDue = setTimeout(() => {
      runsDue = null;
      drawRuns(view.name).catch((error) => say(error.message));
    }, 1000);
  }
  const detail = view.level ? `, level of detail ${view.level}` : "";
  el("state").textContent = `${view.held.size} tiles, ${view.surfaces().toLocaleString("en")} surfaces, epoch ${view.epoch ?? "0"}${detail}`;
}

async function openMap(name, camera) {
  view?.close();
  state.ready = false;
  clearPlan();
  stage.remove("run");
  view = state.view = new MapView(name, stage, { changed: showState, told: say });
  say(`opening ${name} …`);
  el("name").textContent = name;
  await view.open();
  const { low, high } = view.box();
  shared.low.value = low[2];
  shared.high.value = Math.max(high[2], low[2] + 0.1);
  Object.assign(el("cut"), { min: low[2] - 0.5, max: high[2] + 1, value: high[2] + 1 });
  setCut(hash.has("cut") && camera ? Number(hash.get("cut")) : null);
  if (camera) stage.look(camera);
  else fit();
  say("click a start, then a goal");
  state.ready = true;
  drawRuns(name).catch((error) => say(error.message));
}

async function drawRuns(name) {
  const runs = new Map();
  for await (const part of stream("PoseGraph/Get", { map: name }, view.stop.signal)) {
    for (const node of part.nodes ?? []) {
      const run = node.id?.trajectory ?? "";
      if (!runs.has(run)) runs.set(run, []);
      runs.get(run).push((node.current ?? node.uploaded)?.translation ?? {});
    }
  }
  stage.remove("run");
  [...runs].forEach(([run, places], i) => stage.line(`run ${run}`, places, RUNS[i % RUNS.length], 0.1, false));
  state.runs = runs.size;
}

function fit() {
  const { low, high } = view.box();
  const middle = low.map((value, i) => (value + high[i]) / 2);
  const reach = Math.max(high[0] - low[0], high[1] - low[1], 5);
  stage.look([middle[0], middle[1] - 0.7 * reach, middle[2] + 0.6 * reach, ...middle]);
}

// null: nothing is cut off.
function setCut(height) {
  const slider = el("cut");
  if (height !== null) slider.value = height;
  const all = Number(slider.value) > Number(slider.max) - Number(slider.step); // its last stop
  shared.cut.value = all ? 1e9 : Number(slider.value);
  el("cut-value").textContent = all ? "nothing" : `${Number(slider.value).toFixed(2)} m`;
  stage.redraw();
}

function setLayer(index) {
  shared.layer.value = index;
  el("layer").value = String(index);
  document.body.dataset.layer = LAYERS[index];
  stage.redraw();
}

function clearPlan() {
  start = null;
  state.plan = state.levels = null;
  for (const name of ["start", "goal", "path", "where"]) stage.remove(name);
  el("levels").replaceChildren();
}

async function showLevels({ x, y }) {
  const { columns } = await call("Planning/SampleSurfaces", { map: view.name, places: [{ x, y }] });
  const levels = (columns?.[0]?.surfaces ?? []).slice().reverse();
  state.levels = levels;
  el("levels").replaceChildren(...levels.map((surface) => {
    const item = document.createElement("li");
    const what = surface.depth_m ? `wall, ${surface.depth_m.toFixed(2)} m deep` : TRAVERSABILITY[surface.traversability] ?? "unknown";
    const label = surface.class_id ? `, class ${surface.class_id} (${surface.confidence ?? 0} %)` : "";
    item.textContent = `z ${metres(surface.z_m)} m ± ${(surface.sigma_m ?? 0).toFixed(3)}: ${what}${label}`;
    return item;
  }));
}

const endpoint = ({ x, y, z }) => ({ x_m: x, y_m: y, z_m: z });

async function plan(from, to) {
  const path = await call("Planning/PlanPath", { map: view.name, from: endpoint(from), to: endpoint(to) });
  const found = path.waypoints?.length > 0;
  state.plan = { from, to, found, length: path.length_m ?? 0, message: path.message, waypoints: path.waypoints ?? [] };
  if (found) {
    stage.line("path", path.waypoints, getComputedStyle(document.body).getPropertyValue("--path"), 0.15, true);
    say(`${path.length_m.toFixed(1)} m in ${(path.elapsed_ms ?? 0).toFixed(0)} ms`);
  } else {
    const where = path.where ?? path.nearest;
    if (where) stage.ball("where", { x: 0, y: 0, z: 0, ...where }, "#d55e00");
    say(`no path: ${path.message}`);
  }
}

async function clickAt(x, y) {
  const place = view && stage.pick(x, y);
  if (!place) return say("nothing is there");
  try {
    if (!start) {
      clearPlan();
      start = place;
      stage.ball("start", place, "#009e73");
      say(`start (${place.x.toFixed(2)}, ${place.y.toFixed(2)}, ${place.z.toFixed(2)}); click a goal`);
      return await showLevels(place);
    }
    const from = start;
    start = null;
    stage.ball("goal", place, "#cc79a7");
    await Promise.all([showLevels(place), plan(from, place)]);
  } catch (error) {
    say(error.message);
  }
}

function linkToView() {
  const link = new URLSearchParams({ map: view.name, cam: stage.view().map((v) => v.toFixed(2)).join(","), layer: el("layer").value });
  if (shared.cut.value < 1e9) link.set("cut", shared.cut.value.toFixed(2));
  history.replaceState(null, "", `#${link}`);
  navigator.clipboard?.writeText(location.href).catch(() => {});
  say("the address shows this view now, and is copied");
}

function savePicture() {
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
  shared.dark.value = Number(dark);
  stage.background(dark ? "#14171a" : "#fbfbf7");
}

const KEYS = {
  "[": () => setCut(Number(el("cut").value) - 0.25),
  "]": () => setCut(Number(el("cut").value) + 0.25),
  f: () => view && fit(),
  l: () => view && linkToView(),
  p: savePicture,
  d: () => setDark(!document.body.classList.contains("dark")),
  Escape: () => (clearPlan(), say("click a start, then a goal")),
};

function wire() {
  LAYERS.forEach((layer, i) => {
    el("layer").add(new Option(layer, i));
    KEYS[i + 1] = () => setLayer(i);
  });
  el("layer").onchange = () => setLayer(Number(el("layer").value));
  el("cut").oninput = () => setCut(null);
  el("link").onclick = () => view && linkToView();
  el("picture").onclick = savePicture;
  el("dark").onclick = KEYS.d;
  addEventListener("keydown", (event) => {
    if (event.target instanceof HTMLInputElement || event.ctrlKey || event.metaKey) return;
    KEYS[event.key]?.();
  });
  let down = null;
  stage.canvas.addEventListener("pointerdown", (event) => (down = [event.clientX, event.clientY]));
  stage.canvas.addEventListener("pointerup", (event) => {
    if (!down || Math.hypot(event.clientX - down[0], event.clientY - down[1]) > 4) return;
    stage.canvas.focus();
    clickAt(event.clientX, event.clientY);
  });
  el("token-form").onsubmit = (event) => {
    event.preventDefault();
    setToken(el("token").value.trim());
    begin();
  };
}

async function begin() {
  try {
    const maps = await listMaps();
    el("token-form").hidden = true;
    const name = hash.get("map") ?? (maps.length === 1 ? maps[0].name : null);
    const camera = hash.get("cam")?.split(",").map(Number);
    if (name) await openMap(name, camera?.length === 6 && camera.every(Number.isFinite) ? camera : null);
    else if (maps.length) say("choose a map");
  } catch (error) {
    if (error.code === "unauthenticated") el("token-form").hidden = false;
    say(error.message);
  }
  state.begun = true;
}

if (hash.has("token")) {
  setToken(hash.get("token"));
  hash.delete("token");
  history.replaceState(null, "", `#${hash}`);
}
wire();
setDark(matchMedia("(prefers-color-scheme: dark)").matches);
setLayer(Math.min(Math.max(Number(hash.get("layer") ?? 0) || 0, 0), LAYERS.length - 1));
begin();
