// The table of maps.
import { ageOf, button, el, say } from "./dom.js";
import { call } from "./rpc.js";

export async function listMaps(choose) {
  const maps = (await call("Maps/List", {})).maps ?? [];
  const rows = await Promise.all(maps.map(async (map) => {
    const { stats } = await call("Maps/Stats", { name: map.name });
    return [map.name, stats.scans ?? "0", ((stats.tile_bytes ?? 0) / 1e6).toFixed(1), ageOf(map.created)];
  }));
  el("maps").tBodies[0].replaceChildren(...rows.map((cells) => {
    const row = document.createElement("tr");
    cells.forEach((text, i) => {
      const cell = row.insertCell();
      if (i) cell.textContent = text;
      else cell.append(button(text, `open map ${text}`, () => choose(text)));
    });
    return row;
  }));
  if (!maps.length) say("no map yet: strata map create NAME");
  return maps;
}
