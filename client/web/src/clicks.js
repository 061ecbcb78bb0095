// What clicks on the map do: a start and a goal, what is there on all levels; or two ends of a measure.
import { classNameOf } from "./classes.js";
import { el, metres, node, say } from "./dom.js";
import { call } from "./rpc.js";

const TRAVERSABILITY = { TRAVERSABILITY_TRAVERSABLE: "drivable", TRAVERSABILITY_NON_TRAVERSABLE: "not drivable", TRAVERSABILITY_UNDERSIDE: "underside" };
const MARKS = ["start", "goal", "path", "where", "measure"];

// A surface to drive on may be deep, too: a deck that was seen from below.
function whatOf({ traversability, depth_m }) {
  const kind = depth_m && traversability !== "TRAVERSABILITY_TRAVERSABLE" ? "wall" : TRAVERSABILITY[traversability] ?? "unknown";
  return depth_m ? `${kind}, ${depth_m.toFixed(2)} m deep` : kind;
}

const endpoint = ({ x, y, z }) => ({ x_m: x, y_m: y, z_m: z });
const ink = (name) => getComputedStyle(document.body).getPropertyValue(name);

export class Clicks {
  // `state`: what tests look at.
  constructor(stage, state) {
    Object.assign(this, { stage, state, view: null, start: null, measuring: false });
  }
  clear() {
    this.start = null;
    this.state.plan = this.state.levels = this.state.measure = null;
    for (const name of MARKS) this.stage.remove(name);
    el("levels").replaceChildren();
  }
  prompt() {
    say(this.measuring ? "measure: click one end, then the other" : "click a start, then a goal");
  }
  setMeasuring(on) {
    this.clear();
    this.measuring = on;
    el("measure").setAttribute("aria-pressed", on);
    this.prompt();
  }
  // A click at that pixel.
  async at(x, y) {
    const place = this.view && this.stage.pick(x, y);
    if (!place) return say(`nothing is there: click ${this.start ? (this.measuring ? "the other end" : "a goal") : "a place"} on a surface`);
    const first = this.start;
    if (!first) this.clear();
    this.start = first ? null : place;
    try {
      if (this.measuring) this.measure(first, place);
      else await this.plan(first, place);
    } catch (error) {
      say(error.message);
    }
  }
  measure(first, place) {
    this.stage.ball(first ? "measure end" : "measure start", place, "#e69f00");
    if (!first) return say("measure: click the other end");
    this.stage.line("measure line", [first, place], ink("--path"), 0.08, true);
    const level = Math.hypot(place.x - first.x, place.y - first.y);
    const rise = place.z - first.z;
    const length = Math.hypot(level, rise);
    this.state.measure = { from: first, to: place, length, rise };
    say(`${metres(length)} m; ${metres(Math.abs(rise))} m ${rise < 0 ? "lower" : "higher"}, ${metres(level)} m along the ground`);
  }
  async plan(first, place) {
    if (!first) {
      this.stage.ball("start", place, "#009e73");
      say(`start (${metres(place.x)}, ${metres(place.y)}, ${metres(place.z)}); click a goal`);
      return this.showLevels(place);
    }
    this.stage.ball("goal", place, "#cc79a7");
    await Promise.all([this.showLevels(place), this.showPath(first, place)]);
  }
  async showLevels({ x, y }) {
    const { columns } = await call("Planning/SampleSurfaces", { map: this.view.name, places: [{ x, y }] });
    const levels = (columns?.[0]?.surfaces ?? []).slice().reverse();
    this.state.levels = levels;
    el("levels").replaceChildren(...levels.map((surface) => {
      const label = surface.class_id ? `, class ${classNameOf(this.view, surface.class_id)} (${surface.confidence ?? 0} %)` : "";
      return node("li", `z ${metres(surface.z_m)} m ± ${(surface.sigma_m ?? 0).toFixed(3)}: ${whatOf(surface)}${label}`);
    }));
  }
  async showPath(from, to) {
    const path = await call("Planning/PlanPath", { map: this.view.name, from: endpoint(from), to: endpoint(to) });
    const found = path.waypoints?.length > 0;
    this.state.plan = { from, to, found, length: path.length_m ?? 0, message: path.message, waypoints: path.waypoints ?? [] };
    if (found) {
      this.stage.line("path", path.waypoints, ink("--path"), 0.15, true);
      return say(`${(path.length_m ?? 0).toFixed(1)} m in ${(path.elapsed_ms ?? 0).toFixed(0)} ms`);
    }
    const where = path.where ?? path.nearest;
    if (where) this.stage.ball("where", { x: 0, y: 0, z: 0, ...where }, "#d55e00");
    say(`no path: ${path.message}`);
  }
}
