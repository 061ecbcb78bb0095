// The table of maps.
import { ageOf, button, el, say, sizeOf } from "./dom.js";
import { call } from "./rpc.js";

const COUNTED = 200; // a server opens each map to count what is in it
const AT_ONCE = 2; // of a browser's six connections
const UNKNOWN = "–"; // damaged, not to be read by who asks, or one more than the server has open

let counting = new AbortController();

function rowOf(map, choose) {
  const row = document.createElement("tr");
  row.insertCell().append(button(map.name, `open map ${map.name}`, () => choose(map.name)));
  for (const text of [UNKNOWN, UNKNOWN, ageOf(map.created)]) row.insertCell().textContent = text;
  return row;
}

async function count(name, row, signal) {
  try {
    const { stats } = await call("Maps/Stats", { name }, signal);
    row.cells[1].textContent = stats.scans ?? "0";
    row.cells[2].textContent = sizeOf(Number(stats.point_bytes ?? 0) + Number(stats.tile_bytes ?? 0));
  } catch (error) {
    row.title = error.message;
  }
}

export async function listMaps(choose) {
  const maps = (await call("Maps/List", {})).maps ?? [];
  el("maps").tBodies[0].replaceChildren(...maps.map((map) => rowOf(map, choose)));
  if (!maps.length) say("no map yet: strata map create NAME");
  return maps;
}

// Of the maps that are listed.
export function countMaps(maps) {
  counting.abort();
  counting = new AbortController();
  const { signal } = counting;
  const rows = el("maps").tBodies[0].rows;
  const waiting = maps.slice(0, COUNTED).map(({ name }, i) => [name, rows[i]]);
  const countOn = async () => {
    while (waiting.length && !signal.aborted) await count(...waiting.shift(), signal);
  };
  for (let i = 0; i < AT_ONCE; ++i) countOn();
}
