// Surfaces on the graphics card: 16 bytes each in a texture, of which the vertices make squares and
// boxes (vertex pulling: on a machine without a card 16 times as fast as instances).
import * as THREE from "three";

const ROW = 256;

// Uniforms of all tiles.
export const shared = {
  low: { value: 0 },
  high: { value: 10 },
  cut: { value: 1e9 },
  bottom: { value: -1e9 },
  layer: { value: 0 },
  picking: { value: 0 },
  dark: { value: 0 },
};

// Traversability in colours of Okabe and Ito, which colour-blind people tell apart and which differ
// in lightness; heights and others from dark blue to yellow (cividis, likewise).
const VERTEX = `
uniform highp isampler2D data; uniform int faces, layer; uniform vec2 origin;
uniform float size, low, high, cut, bottom, dark; flat out vec3 colour; flat out float kind; out vec3 world;
vec3 ramp(float t) {
  t = clamp(t, 0., 1.);
  vec3 a = mix(vec3(0., .13, .3), vec3(.16, .38, .66), dark), b = vec3(.49, .48, .47), c = vec3(1., .92, .27);
  return t < .5 ? mix(a, b, 2. * t) : mix(b, c, 2. * t - 1.);
}
vec3 wheel(int id) {
  float h = fract(float(id) * .618034);
  return clamp(abs(fract(h + vec3(0., .667, .333)) * 6. - 3.) - 1., .15, .9);
}
vec3 floorColour(int id) {
  if (id == 0) return vec3(.6);
  id = (id - 1) % 7;
  return id == 0 ? vec3(.9, .62, 0.) : id == 1 ? vec3(.34, .71, .91) : id == 2 ? vec3(0., .62, .45) : id == 3 ? vec3(.94, .89, .26)
    : id == 4 ? vec3(0., .45, .7) : id == 5 ? vec3(.84, .37, 0.) : vec3(.8, .47, .65);
}
vec3 paint(ivec4 d, int trav, bool side, bool wall, float z) {
  if (layer == 1) return ramp((z - low) / (high - low));
  if (layer == 2) { int id = d.x >> 20; return id == 0 ? vec3(.6) : wheel(id); }
  if (layer == 3) return ramp(float(d.w & 255) / 100.);
  if (layer == 4) return ramp(float((d.w >> 8) & 255) / 180.);
  if (layer == 5) return floorColour((d.w >> 16) & 255);
  if (trav == 1 && !side) return vec3(.34, .71, .91);
  if (wall) return vec3(.45, .43, .42);
  return trav == 2 ? vec3(.84, .37, 0.) : trav == 3 ? vec3(.8, .47, .65) : vec3(.7);
}
void main() {
  int per = 6 * faces, i = gl_VertexID / per, k = gl_VertexID - i * per, face = k / 6, v = k % 6;
  ivec4 d = texelFetch(data, ivec2(i & 255, i >> 8), 0);
  vec2 cell = vec2(d.x & 255, (d.x >> 8) & 255);
  int trav = (d.x >> 16) & 3; bool wall = ((d.x >> 18) & 1) == 1;
  float z = float(d.y) / 512., depth = float(d.z) / 512.;
  vec2 q = vec2(v == 1 || v == 2 || v == 4, v == 2 || v == 4 || v == 5);
  vec3 p = vec3(q, 0.); float shade = 1.;
  if (face > 0) {
    shade = face < 3 ? .66 : .82;
    float down = -q.y * depth;
    p = face == 1 ? vec3(q.x, 0., down) : face == 2 ? vec3(q.x, 1., down)
      : face == 3 ? vec3(0., q.x, down) : vec3(1., q.x, down);
  }
  colour = paint(d, trav, face > 0, wall, z) * shade;
  kind = float(trav); world = vec3(origin + (cell + p.xy) * size, z + p.z);
  gl_Position = z > cut || z < bottom ? vec4(2., 2., 2., 1.) : projectionMatrix * modelViewMatrix * vec4(world, 1.);
}`;
const FRAGMENT = `
uniform int picking; flat in vec3 colour; flat in float kind; in vec3 world; out vec4 result;
void main() { result = picking == 1 ? vec4(world, kind + 1.) : vec4(colour, 1.); }`;

// `floorOf(x, y, z)`: number of the floor there, counted from 1, or 0; null: floors are not known.
function rowsOf(tile, vertical, origin, size, floorOf) {
  const floorAt = (i) => floorOf(origin.x + ((tile.cell[i] & 255) + 0.5) * size, origin.y + ((tile.cell[i] >> 8) + 0.5) * size, tile.height[i] / 512);
  const chosen = [];
  for (let i = 0; i < tile.size; ++i) if ((tile.kind[i] & 1) === vertical) chosen.push(i);
  const rows = new Int32Array(4 * ROW * Math.ceil(chosen.length / ROW));
  chosen.forEach((i, k) => {
    const what = (tile.kind[i] >> 1) | (vertical << 2) | (tile.classId[i] << 4);
    const storey = floorOf && !vertical ? Math.min(floorAt(i), 255) : 0;
    rows.set([tile.cell[i] | (what << 16), tile.height[i], vertical ? tile.depth[i] : 0,
      tile.confidence[i] | ((tile.sigma[i] & 255) << 8) | (storey << 16)], 4 * k);
  });
  return [rows, chosen.length];
}

function meshOf(rows, count, faces, origin, size) {
  const texture = new THREE.DataTexture(rows, ROW, rows.length / 4 / ROW, THREE.RGBAIntegerFormat, THREE.IntType);
  texture.internalFormat = "RGBA32I";
  texture.needsUpdate = true;
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(3), 3));
  geometry.attributes.position.count = count * faces * 6;
  geometry.setDrawRange(0, count * faces * 6);
  const side = 256 * size;
  const centre = new THREE.Vector3(origin.x + side / 2, origin.y + side / 2, 0);
  geometry.boundingSphere = new THREE.Sphere(centre, side + 1000);
  const uniforms = { ...shared, data: { value: texture }, faces: { value: faces }, origin: { value: origin }, size: { value: size } };
  const material = new THREE.ShaderMaterial({
    glslVersion: THREE.GLSL3, vertexShader: VERTEX, fragmentShader: FRAGMENT, uniforms, side: THREE.DoubleSide,
  });
  return new THREE.Mesh(geometry, material);
}

// What is drawn of a decoded tile; `cell` is the map's cell size [m].
export function groupOf(tile, cell, floorOf) {
  const size = cell * 2 ** tile.level;
  const origin = new THREE.Vector2(tile.x * 256 * size, tile.y * 256 * size);
  const group = new THREE.Group();
  for (const vertical of [0, 1]) {
    const [rows, count] = rowsOf(tile, vertical, origin, size, floorOf);
    if (count) group.add(meshOf(rows, count, vertical ? 5 : 1, origin, size));
  }
  return group;
}

export function disposeOf(group) {
  for (const mesh of group.children) {
    mesh.material.uniforms.data.value.dispose();
    mesh.material.dispose();
    mesh.geometry.dispose();
  }
}
