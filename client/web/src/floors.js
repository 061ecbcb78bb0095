// Floors, as the server finds them when asked: to colour by, and to see one alone.
import { el, metres, node, say } from "./dom.js";
import { FLOORS } from "./paint.js";
import { shared } from "./patches.js";
import { call } from "./rpc.js";

const BELOW = 0.3; // of a floor's lowest cell that is shown with it [m]
const ABOVE = 1.8; // and of its highest: walls, but no ceiling [m]
const NEAR = 0.5; // of a surface to the heights of its floor [m]

// Function of x, y, z to the number of the floor there, from 1, or 0.
function lookup(floors, cell) {
  const blocks = new Map();
  floors.forEach(({ blocks: its, low, high }, i) => {
    for (const { x = 0, y = 0, free } of its ?? []) {
      const key = `${x},${y}`;
      if (!blocks.has(key)) blocks.set(key, []);
      const bits = BigInt(free ?? 0);
      const halves = [Number(bits & 0xffffffffn), Number(bits >> 32n)];
      blocks.get(key).push({ number: i + 1, halves, low: (low?.z ?? 0) - NEAR, high: (high?.z ?? 0) + NEAR });
    }
  });
  return (x, y, z) => {
    const column = Math.floor(x / cell);
    const row = Math.floor(y / cell);
    const bit = (row & 7) * 8 + (column & 7);
    for (const one of blocks.get(`${column >> 3},${row >> 3}`) ?? []) {
      if (z >= one.low && z <= one.high && (one.halves[bit >> 5] >> (bit & 31)) & 1) return one.number;
    }
    return 0;
  };
}

function showFloor(floor, stage) {
  shared.bottom.value = floor ? (floor.low?.z ?? 0) - BELOW : -1e9;
  el("cut").dispatchEvent(new Event("input")); // what the slider says
  if (floor) {
    shared.cut.value = (floor.high?.z ?? 0) + ABOVE;
    el("cut-value").textContent = `${metres(shared.cut.value)} m, of the floor`;
  }
  stage.redraw();
}

// Fills the choice of floors; returns how many there are.
export async function findFloors(view, stage) {
  const { floors = [], cell_size_m } = await call("Planning/ListFloors", { map: view.name, cells: true }, view.stop.signal);
  const names = floors.map(({ mean_z_m, area_m2 }, i) => `${i + 1}: at ${metres(mean_z_m)} m, ${(area_m2 ?? 0).toFixed(0)} m²`);
  const choice = el("floor");
  choice.replaceChildren(new Option("all", ""), ...names.map((name, i) => new Option(name, i)));
  choice.onchange = () => showFloor(floors[choice.value === "" ? -1 : Number(choice.value)], stage);
  el("floor-legend").replaceChildren(...names.map((name, i) => {
    const mark = node("i");
    mark.style.background = FLOORS[i % FLOORS.length];
    return node("span", mark, ` ${name} `);
  }));
  el("floor-choice").hidden = !floors.length;
  const floorOf = lookup(floors, cell_size_m);
  if (floors.length) view.setCodes("floor", (x, y, z, wall) => (wall ? 0 : Math.min(floorOf(x, y, z), 255)));
  say(floors.length ? `${floors.length} floors` : "no floor: the robot can stand nowhere");
  return floors.length;
}

// One of the floors that were found alone, by its place among them.
export function chooseFloor(index) {
  const choice = el("floor");
  choice.value = index;
  choice.dispatchEvent(new Event("change"));
}

export function forgetFloors(stage) {
  el("floor-choice").hidden = true;
  el("floor-legend").replaceChildren();
  showFloor(null, stage);
}
