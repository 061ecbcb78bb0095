// Colours of surfaces, by what is known of them (prepare.js). Traversability in colours of Okabe and
// Ito, which colour-blind people tell apart and which differ in lightness; heights and others from
// dark blue to yellow (cividis, likewise).
import { metres } from "./dom.js";

export const LAYERS = ["traversability", "height", "class", "confidence", "sigma", "floor", "time"];
export const FLOORS = ["#e69f00", "#56b4e9", "#009e73", "#f0e442", "#0072b2", "#d55e00", "#cc79a7"];

const pack = (r, g, b) => Math.round(r * 255) | (Math.round(g * 255) << 8) | (Math.round(b * 255) << 16);
const parse = (text) => pack(...[1, 3, 5].map((at) => parseInt(text.slice(at, at + 2), 16) / 255));

const NONE = pack(0.6, 0.6, 0.6);
const WALL = pack(0.45, 0.43, 0.42);
const TRAVERSABILITY = [pack(0.7, 0.7, 0.7), parse("#56b4e9"), parse("#d55e00"), parse("#cc79a7")];

function rampOf(dark) {
  const low = dark ? [0.16, 0.38, 0.66] : [0, 0.13, 0.3];
  const middle = [0.49, 0.48, 0.47];
  const high = [1, 0.92, 0.27];
  const mix = (a, b, t) => a.map((value, i) => value + (b[i] - value) * t);
  return Int32Array.from({ length: 256 }, (_, i) => {
    const t = i / 127.5;
    return pack(...(t < 1 ? mix(low, middle, t) : mix(middle, high, t - 1)));
  });
}

// Neighbouring numbers get colours far apart.
function wheel(id) {
  const hue = (id * 0.618034) % 1;
  const channel = (turn) => Math.min(0.9, Math.max(0.15, Math.abs(((hue + turn) % 1) * 6 - 3) - 1));
  return pack(channel(0), channel(0.667), channel(0.333));
}
const CLASSES = Int32Array.from({ length: 256 }, (_, id) => (id ? wheel(id) : NONE));
const swap = (rgb) => (rgb >> 16) | (rgb & 0xff00) | ((rgb & 255) << 16); // red lowest, or highest
const packedOf = (id, classes) => (classes.has(id) ? swap(classes.get(id).colour) : CLASSES[id]);
const STOREYS = Int32Array.from({ length: 256 }, (_, id) => (id ? parse(FLOORS[(id - 1) % FLOORS.length]) : NONE));

const SIGMA_LOW = 105; // code of 1 mm, on a scale of logarithms
const SIGMA_HIGH = 180; // of 1 m

// As CSS has it, of a class by its number; `classes`: those that somebody gave a colour, by id.
export const classColour = (id, classes) => `#${swap(packedOf(id, classes)).toString(16).padStart(6, "0")}`;

// What the ends of a layer's scale stand for; none where it has no scale.
export function scaleOf(layer, { low, high }) {
  return { height: [`${metres(low)} m`, `${metres(high)} m`], confidence: ["0 %", "100 %"], sigma: ["1 mm", "1 m"] }[layer] ?? ["", ""];
}

// Function of the four numbers of a surface to its colour, of a layer by name, which it has as `layer`, too. `low`, `high` [m]: of the map;
// `classes`: its.
export function painterOf(layer, { low, high, dark, classes }) {
  const ramp = rampOf(dark);
  const scale = 255 / (high - low);
  const ofClass = CLASSES.map((_, id) => packedOf(id, classes));
  const painters = {
    height: (x, y) => ramp[Math.min(255, Math.max(0, Math.round((y / 512 - low) * scale)))],
    class: (x) => ofClass[(x >> 20) & 255],
    confidence: (x, y, z, w) => ramp[Math.min(255, Math.round((w & 255) * 2.55))],
    sigma: (x, y, z, w) => ramp[Math.min(255, Math.max(0, Math.round((((w >> 8) & 255) - SIGMA_LOW) * (255 / (SIGMA_HIGH - SIGMA_LOW)))))],
    floor: (x, y, z, w) => STOREYS[(w >> 16) & 255],
    time: (x, y, z, w) => ((w >>> 24) ? ramp[w >>> 24] : NONE),
    traversability: (x) => {
      const kind = (x >> 16) & 3;
      return x & (1 << 18) && kind !== 1 ? WALL : TRAVERSABILITY[kind];
    },
  };
  return Object.assign(painters[layer], { layer });
}
