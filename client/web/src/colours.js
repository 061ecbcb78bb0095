// By what surfaces are coloured: chosen by key or in the panel, in the map that is open.
import { findClasses, showClasses } from "./classes.js";
import { el, say } from "./dom.js";
import { chooseFloor, findFloors, forgetFloors } from "./floors.js";
import { LAYERS, painterOf, scaleOf } from "./paint.js";
import { shared } from "./patches.js";
import { timesOf } from "./times.js";

export class Colours {
  // `state`: what tests look at.
  constructor(stage, state) {
    Object.assign(this, { stage, state, view: null, scans: [], index: 0, low: 0, high: 10, dark: false });
    LAYERS.forEach((layer, i) => el("layer").add(new Option(layer, i)));
    el("layer").onchange = () => this.set(Number(el("layer").value));
    el("floors").onclick = () => this.view && this.set(LAYERS.indexOf("floor"));
  }
  painter() {
    return painterOf(LAYERS[this.index], { ...this, classes: this.view?.classes ?? new Map() });
  }
  // Of a map that is being opened; before heights are known, too.
  setView(view) {
    Object.assign(this, { view, scans: [] });
    forgetFloors(this.stage);
  }
  // What lies between is told apart; of the map [m].
  setHeights(low, high) {
    Object.assign(this, { low, high: Math.max(high, low + 0.1) });
    return this.set(this.index);
  }
  // {x, y, z, time} of each; asked for when somebody wants to see it.
  setScans(scans) {
    this.scans = scans;
    if (LAYERS[this.index] === "time") this.findTimes();
  }
  // Of the tiles that are shown now.
  showLegend() {
    const layer = LAYERS[this.index];
    [el("scale-low").textContent, el("scale-high").textContent] = scaleOf(layer, this);
    if (layer === "class" && this.view) showClasses(this.view);
  }
  // As they are named now: somebody may be naming them.
  async findClasses() {
    try {
      await findClasses(this.view);
    } catch (error) {
      if (error.name !== "AbortError") say(error.message);
      return;
    }
    if (LAYERS[this.index] === "class") this.repaint();
    this.showLegend();
  }
  setDark(dark) {
    this.dark = dark;
    this.repaint();
  }
  // `index` of LAYERS; what is no such number is the first.
  async set(index) {
    this.index = LAYERS[index] ? index : 0;
    el("layer").value = String(this.index);
    document.body.dataset.layer = LAYERS[this.index];
    shared.greySides.value = Number(this.index === 0);
    this.repaint();
    this.showLegend();
    if (!this.view) return;
    if (LAYERS[this.index] === "class") await this.findClasses();
    if (LAYERS[this.index] === "time") this.findTimes();
    if (LAYERS[this.index] === "floor" && !this.view.codes.has("floor")) await this.findFloors();
  }
  repaint() {
    this.view?.paint(this.painter());
  }
  findTimes() {
    const timeOf = timesOf(this.scans);
    if (timeOf) this.view.setCodes("time", timeOf);
  }
  // One floor alone, by its place among them.
  async showFloor(index) {
    if (!this.view.codes.has("floor")) await this.findFloors();
    chooseFloor(index);
  }
  async findFloors() {
    say("looking for floors …");
    try {
      this.state.floors = await findFloors(this.view, this.stage);
    } catch (error) {
      say(error.message);
    }
  }
}
