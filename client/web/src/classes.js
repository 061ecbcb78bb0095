// Classes of a map: their names and colours, as somebody gave them.
import { el, node } from "./dom.js";
import { classColour } from "./paint.js";
import { call } from "./rpc.js";

// Into `view.classes`, by id.
export async function findClasses(view) {
  const { classes } = await call("Maps/ListClasses", { name: view.name }, view.stop.signal);
  view.classes = new Map((classes ?? []).map(({ id, name, colour }) => [id, { name, colour: colour ?? 0 }]));
}

// A class that has no name is called by its number.
export const classNameOf = (view, id) => view.classes.get(id)?.name ?? String(id);

// In the legend those that are seen.
export function showClasses(view) {
  const ids = new Set(view.shown().flatMap(({ decoded }) => decoded.classes));
  el("class-legend").replaceChildren(...[...ids].sort((a, b) => a - b).map((id) => {
    const mark = node("i");
    mark.style.background = classColour(id, view.classes);
    return node("span", mark, ` ${id ? classNameOf(view, id) : "no class"} `);
  }));
}
