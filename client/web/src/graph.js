// The pose graph: trajectories, scans, and what holds them in their places, by who says so.
import { dateOf } from "./dom.js";
import { stream } from "./rpc.js";

const RUNS = ["#0b3c75", "#e69f00", "#00664a", "#b0447f", "#d55e00", "#7a6a00"];
const SCANS = "#cc79a7";
const ORIGINS = {
  CONSTRAINT_ORIGIN_INGEST: ["registrations", "#999999"],
  CONSTRAINT_ORIGIN_PERSON: ["people's constraints", "#e69f00"],
  CONSTRAINT_ORIGIN_OPTIMIZE: ["closures", "#009e73"],
};
const OFF = ["constraints switched off", "#d55e00"];
const LIFT = 0.25; // over the ground that scans stand on [m]

const keyOf = (id) => `${id?.trajectory ?? ""}/${id?.sequence ?? 0}`;
const placeOf = ({ x = 0, y = 0, z = 0 } = {}) => [x, y, z + LIFT];

async function getGraph(view) {
  const graph = { nodes: [], constraints: [] };
  for await (const part of stream("PoseGraph/Get", { map: view.name }, view.stop.signal)) {
    graph.nodes.push(...(part.nodes ?? []));
    graph.constraints.push(...(part.constraints ?? []));
  }
  return graph;
}

// Line segments by the name of their switch: from scan to scan, or, of a prior, to where it says.
function segmentsOf(constraints, places) {
  const found = new Map(Object.values(ORIGINS).map(([name, colour]) => [name, { colour, at: [] }]));
  found.set(OFF[0], { colour: OFF[1], at: [] });
  for (const { i, j, pose, origin, enabled } of constraints) {
    const [name] = enabled === false ? OFF : ORIGINS[origin] ?? OFF;
    const from = i ? places.get(keyOf(i)) : placeOf(pose?.translation);
    const to = places.get(keyOf(j));
    if (from && to) found.get(name).at.push(...from, ...to);
  }
  return found;
}

function drawRuns(nodes, stage, switches) {
  const runs = new Map();
  for (const { id, current, uploaded } of nodes) {
    const run = id?.trajectory ?? "";
    if (!runs.has(run)) runs.set(run, []);
    runs.get(run).push((current ?? uploaded)?.translation ?? {});
  }
  switches.offer("trajectories", runs.size, RUNS[0], (on) => {
    stage.remove("run ");
    if (on) [...runs].forEach(([run, places], i) => stage.line(`run ${run}`, places, RUNS[i % RUNS.length], 0.1, false));
  });
  return runs.size;
}

// Draws it; returns how many runs there are, the scans {x, y, z, time}, and counts of all that is drawn.
export async function drawGraph(view, stage, switches, hover) {
  const { nodes, constraints } = await getGraph(view);
  const places = new Map(nodes.map(({ id, current, uploaded }) => [keyOf(id), placeOf((current ?? uploaded)?.translation)]));
  const runs = drawRuns(nodes, stage, switches);
  const counts = { scans: nodes.length };
  hover.set("scans", nodes.map(({ id, time, state }) => {
    const [x, y, z] = places.get(keyOf(id));
    const when = dateOf(time) ? `, ${dateOf(time)} UTC` : "";
    const how = (state ?? "").replace("SCAN_STATE_", "").toLowerCase();
    return { x, y, z, text: `scan ${keyOf(id)}${when}${how && how !== "integrated" ? `, ${how}` : ""}` };
  }));
  switches.offer("scans", nodes.length, SCANS, (on) => {
    stage.remove("scans");
    if (on) stage.dots("scans", [...places.values()].flat(), SCANS, 6);
  });
  for (const [name, { colour, at }] of segmentsOf(constraints, places)) {
    counts[name] = at.length / 6;
    switches.offer(name, at.length / 6, colour, (on) => {
      stage.remove(name);
      if (on) stage.segments(name, at, colour);
    });
  }
  const scans = nodes.map(({ id, time }) => {
    const [x, y, z] = places.get(keyOf(id));
    return { x, y, z, time };
  });
  return { runs, scans, counts };
}
