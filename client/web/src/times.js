// When a surface was seen, as far as the pose graph tells: the time of the scan taken nearest to it.
import { dateOf, el } from "./dom.js";

const MOST_SCANS = 4096; // looked through; of more every second, third …
const BLOCK = 1; // in which the nearest scan is the same [m]
const CODES = 254; // from 1; 0: not known

// Number of the scan nearest to a place, the same for a block.
function nearestOf(scans) {
  const known = new Map();
  return (x, y, z) => {
    const [i, j, k] = [x, y, z].map((at) => Math.floor(at / BLOCK));
    const key = (i * 0x10000 + j) * 0x1000 + k;
    const found = known.get(key);
    if (found !== undefined) return found;
    let best = 0;
    let least = Infinity;
    scans.forEach((scan, index) => {
      const off = (scan.x - i * BLOCK) ** 2 + (scan.y - j * BLOCK) ** 2 + (scan.z - k * BLOCK) ** 2;
      if (off < least) [best, least] = [index, off];
    });
    known.set(key, best);
    return best;
  };
}

// Function of a place to its code, from the oldest scan's 1 to the youngest's 255, and says both in
// the legend. `scans`: {x, y, z, time}. Null where none has one with a date.
export function timesOf(scans) {
  const timed = scans.filter(({ time }) => dateOf(time)).map((scan) => ({ ...scan, ms: Date.parse(scan.time) }));
  const all = timed.map(({ ms }) => ms);
  const [first, last] = [all.reduce((a, b) => Math.min(a, b), Infinity), all.reduce((a, b) => Math.max(a, b), -Infinity)];
  el("time-first").textContent = timed.length ? `${dateOf(first)} UTC` : "no scan has a date";
  el("time-last").textContent = timed.length ? dateOf(last) : "";
  if (!timed.length) return null;
  const every = Math.ceil(timed.length / MOST_SCANS);
  const few = timed.filter((_, i) => i % every === 0);
  const nearest = nearestOf(few);
  return (x, y, z) => 1 + Math.round((CODES * (few[nearest(x, y, z)].ms - first)) / Math.max(last - first, 1));
}
