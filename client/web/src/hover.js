// What is under the pointer, of things that have a name: scans, objects.
import { el } from "./dom.js";

const NEAR = 10; // pixels

export class Hover {
  constructor(stage) {
    this.stage = stage;
    this.layers = new Map();
    stage.canvas.addEventListener("pointermove", (event) => this.move(event));
    stage.canvas.addEventListener("pointerleave", () => this.tell(null));
  }
  // `things`: {x, y, z, text}.
  set(layer, things) {
    this.layers.set(layer, things);
  }
  clear() {
    this.layers.clear();
    this.tell(null);
  }
  move(event) {
    if (event.buttons) return this.tell(null);
    this.at = [event.clientX, event.clientY];
    this.due ??= requestAnimationFrame(() => {
      this.due = null;
      this.tell(this.nearest(...this.at));
    });
  }
  nearest(x, y) {
    let best = null;
    let least = NEAR;
    for (const thing of [...this.layers.values()].flat()) {
      const at = this.stage.pixelOf(thing);
      const off = Math.hypot(at[0] - x, at[1] - y);
      if (off < least && at[2] < 1) [best, least] = [thing, off];
    }
    return best;
  }
  tell(thing) {
    const label = el("hover");
    label.hidden = !thing;
    if (!thing) return;
    label.textContent = thing.text;
    label.style.left = `${Math.min(this.at[0] + 12, innerWidth - label.offsetWidth - 8)}px`;
    label.style.top = `${Math.min(this.at[1] + 12, innerHeight - label.offsetHeight - 8)}px`;
  }
}
