// What can be shown besides the surfaces: a switch each, only of what the map has. A switch that is
// on stays so when its layer is drawn anew.
import { node } from "./dom.js";

export class Switches {
  constructor(parent) {
    this.parent = parent;
    this.on = new Set(["trajectories"]);
    this.draws = new Map();
  }
  // `draw(on)` shows or hides; `colour` is that of its lines.
  offer(name, count, colour, draw) {
    if (!count) return this.withdraw(name);
    this.withdraw(name);
    const box = node("input");
    box.type = "checkbox";
    box.checked = this.on.has(name);
    box.dataset.layer = name;
    box.onchange = () => {
      this.on[box.checked ? "add" : "delete"](name);
      draw(box.checked);
    };
    const mark = node("i");
    mark.style.background = colour;
    const label = node("label", box, " ", mark, ` ${name} (${count.toLocaleString("en")})`);
    label.dataset.name = name;
    const after = [...this.parent.children].find((other) => (other.dataset.name ?? "") > name);
    this.parent.insertBefore(label, after ?? null);
    this.draws.set(name, draw);
    draw(box.checked);
    this.parent.parentElement.hidden = false;
  }
  withdraw(name) {
    this.draws.get(name)?.(false);
    this.draws.delete(name);
    [...this.parent.children].find((label) => label.dataset.name === name)?.remove();
    this.parent.parentElement.hidden = !this.draws.size;
  }
  clear() {
    for (const name of [...this.draws.keys()]) this.withdraw(name);
  }
}
