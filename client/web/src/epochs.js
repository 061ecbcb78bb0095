// Epochs of a map: what made them, what is another since, and bringing one back.
import { ageOf, button, el, node, say } from "./dom.js";
import { call, stream } from "./rpc.js";

const SHOWN = 8;
const CHANGED = "#d55e00";
const LIFT = 0.3; // [m]

// Squares of the tiles that are not as they were in the epoch.
async function drawDifference(view, stage, epoch) {
  const at = [];
  let same = 0;
  for await (const part of stream("Tiles/List", { map: view.name, area: { level: 0, epoch } }, view.stop.signal)) {
    for (const { key, version } of part.tiles ?? []) {
      if (Number(version ?? 0)) {
        ++same;
        continue;
      }
      const side = 256 * view.cell;
      const [x, y, z] = [(key?.x ?? 0) * side, (key?.y ?? 0) * side, view.low + LIFT];
      const corners = [[x, y, z], [x + side, y, z], [x + side, y + side, z], [x, y + side, z]];
      corners.forEach((corner, i) => at.push(...corner, ...corners[(i + 1) % 4]));
    }
  }
  stage.remove("difference");
  if (at.length) stage.segments("difference", at, CHANGED);
  say(`since epoch ${epoch} ${at.length / 24} tiles are others, ${same} are as they were`);
}

// Lists them, and returns the job that made the current one, "0" where none did.
export async function listEpochs(view, stage, jobs) {
  const { epochs } = await call("Maps/History", { name: view.name }, view.stop.signal);
  stage.remove("difference");
  el("epoch-list").replaceChildren(...(epochs ?? []).slice(0, SHOWN).map((one) => {
    const number = one.epoch ?? "0";
    const item = node("li", node("b", number), ` ${one.reason ?? ""}, ${ageOf(one.created)} `);
    if (one.current) item.append(node("em", "now"));
    else if (one.kept) {
      item.append(button("difference", `what has changed since epoch ${number}`, () => drawDifference(view, stage, number)), " ");
      item.append(button("revert", `bring back epoch ${number}`, async () => {
        if (confirm(`Bring back poses and constraints of epoch ${number}?`)) await jobs.startKind("revert", { epoch: number });
      }));
    }
    return item;
  }));
  return (epochs ?? []).find((one) => one.current)?.job ?? "0";
}
