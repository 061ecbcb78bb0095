// What jobs made of the map: planes, objects, and what nobody saw of objects (hatched).
import * as THREE from "three";
import { classNameOf } from "./classes.js";
import { metres } from "./dom.js";
import { stream } from "./rpc.js";

const PLANE = { PLANE_KIND_WALL: "#0072b2", PLANE_KIND_LEVEL: "#009e73", PLANE_KIND_SLOPED: "#e69f00" };
const OBJECT = "#d55e00";
const INFERRED = "#cc79a7";
const INFERRED_M = 0.06; // width of a dot [m]

// Parts `field` of a stream; none where no job has made any.
async function partsOf(method, field, view) {
  const found = [];
  try {
    for await (const part of stream(method, { map: view.name }, view.stop.signal)) if (part[field]) found.push(part[field]);
  } catch (error) {
    if (error.code !== "not_found") throw error;
  }
  return found;
}

const pointsOf = (ring) => Array.from({ length: (ring?.xyz ?? []).length / 3 }, (_, i) => new THREE.Vector3().fromArray(ring.xyz, 3 * i));

// Triangles of a polygon with holes, in its plane, nine numbers each.
function trianglesOf({ outer, holes = [] }, normal) {
  const up = new THREE.Vector3(normal.x ?? 0, normal.y ?? 0, normal.z ?? 0);
  const across = new THREE.Vector3(Math.abs(up.x) < 0.9 ? 1 : 0, Math.abs(up.x) < 0.9 ? 0 : 1, 0).cross(up).normalize();
  const along = up.clone().cross(across);
  const flat = (points) => points.map((p) => new THREE.Vector2(p.dot(across), p.dot(along)));
  const rings = [pointsOf(outer), ...holes.map(({ ring }) => pointsOf(ring))];
  const corners = rings.flat();
  const faces = THREE.ShapeUtils.triangulateShape(flat(rings[0]), rings.slice(1).map(flat));
  return faces.flatMap((face) => face.flatMap((i) => corners[i].toArray()));
}

function outline({ outer, holes = [] }) {
  return [outer, ...holes.map(({ ring }) => ring)].flatMap((ring) => {
    const points = pointsOf(ring);
    return points.flatMap((p, i) => [...p.toArray(), ...points[(i + 1) % points.length].toArray()]);
  });
}

function drawPlanes(planes, stage) {
  for (const [kind, colour] of Object.entries(PLANE)) {
    const its = planes.filter((plane) => plane.kind === kind);
    const polygons = its.flatMap(({ plane, polygons: all = [] }) => all.map((polygon) => [polygon, plane?.normal ?? {}]));
    if (!polygons.length) continue;
    const triangles = polygons.flatMap(([polygon, normal]) => trianglesOf(polygon, normal));
    const geometry = new THREE.BufferGeometry().setAttribute("position", new THREE.Float32BufferAttribute(triangles, 3));
    const material = new THREE.MeshBasicMaterial({ color: colour, side: THREE.DoubleSide, transparent: true, opacity: 0.35, depthWrite: false });
    stage.put(`planes ${kind}`, new THREE.Mesh(geometry, material));
    stage.segments(`planes ${kind} edges`, polygons.flatMap(([polygon]) => outline(polygon)), colour);
  }
}

// Twelve edges of an upright box.
export function edgesOf({ centre = {}, size = {}, yaw_rad: yaw = 0 }) {
  const corner = (i) => {
    const x = ((i & 1) - 0.5) * (size.x ?? 0);
    const y = (((i >> 1) & 1) - 0.5) * (size.y ?? 0);
    const z = ((i >> 2) - 0.5) * (size.z ?? 0);
    return [(centre.x ?? 0) + x * Math.cos(yaw) - y * Math.sin(yaw), (centre.y ?? 0) + x * Math.sin(yaw) + y * Math.cos(yaw), (centre.z ?? 0) + z];
  };
  const edges = [];
  for (let i = 0; i < 8; ++i) for (const bit of [1, 2, 4]) if (!(i & bit)) edges.push(...corner(i), ...corner(i | bit));
  return edges;
}

function describe({ id, class_id, kind, box = {}, points }, view) {
  const { x, y, z } = box.size ?? {};
  return `object ${id}, class ${classNameOf(view, class_id)}${kind?.name ? `, ${kind.name}` : ""}: ${metres(x)} × ${metres(y)} × ${metres(z)} m, ${points} points`;
}

// Squares of the dots that every third diagonal line leaves out, so that nobody takes them for measured.
function hatched(places) {
  const geometry = new THREE.BufferGeometry().setAttribute("position", new THREE.Float32BufferAttribute(places, 3));
  const material = new THREE.ShaderMaterial({
    uniforms: { colour: { value: new THREE.Color(INFERRED) }, metre: { value: INFERRED_M } },
    vertexShader: `uniform float metre; void main() { gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.);
      gl_PointSize = clamp(metre * 800. / gl_Position.w, 3., 24.); }`,
    fragmentShader: `uniform vec3 colour; void main() { if (mod(gl_FragCoord.x + gl_FragCoord.y, 8.) < 4.) discard; gl_FragColor = vec4(colour, 1.); }`,
  });
  return new THREE.Points(geometry, material);
}

function placesOf({ middle = {}, points = [] }) {
  const add = [middle.x ?? 0, middle.y ?? 0, middle.z ?? 0];
  return points.map((value, i) => value + add[i % 3]);
}

// Draws what there is, and returns how many of each.
export async function drawModels(view, stage, switches, hover) {
  const planes = await partsOf("Models/GetPlaneModel", "plane", view);
  switches.offer("planes", planes.length, PLANE.PLANE_KIND_WALL, (on) => {
    stage.remove("planes");
    if (on) drawPlanes(planes, stage);
  });
  const entities = await partsOf("Objects/ListEntities", "entity", view);
  switches.offer("objects", entities.length, OBJECT, (on) => {
    stage.remove("objects");
    hover.set("objects", on ? entities.map((one) => ({ x: 0, y: 0, z: 0, ...one.box?.centre, text: describe(one, view) })) : []);
    if (on) stage.segments("objects", entities.flatMap(({ box = {} }) => edgesOf(box)), OBJECT);
  });
  const inferred = await partsOf("Objects/ListInferred", "inferred", view);
  switches.offer("inferred", inferred.length, INFERRED, (on) => {
    stage.remove("inferred");
    if (on) stage.put("inferred", hatched(inferred.flatMap(placesOf)));
  });
  return { planes: planes.length, objects: entities.length, inferred: inferred.length };
}
