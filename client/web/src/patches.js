// Surfaces on the graphics card, out of a texture (vertex pulling: on a machine without a card 16
// times as fast as instances).
import * as THREE from "three";
import { ROW } from "./prepare.js";
import { FRAGMENT, VERTEX } from "./shaders.js";

const FAR_PIXELS = 5; // of a cell; narrower walls have one face

// Uniforms of all tiles; the eye's are set before each frame.
export const shared = {
  cut: { value: 1e9 },
  bottom: { value: -1e9 },
  greySides: { value: 0 },
  toScreen: { value: new THREE.Matrix4() },
  eye: { value: new THREE.Vector3() },
};

function materialOf(uniforms, defines) {
  return new THREE.ShaderMaterial({
    glslVersion: THREE.GLSL3, vertexShader: VERTEX, fragmentShader: FRAGMENT, uniforms, defines, side: THREE.DoubleSide,
  });
}

function materialsOf(uniforms, walls) {
  const near = walls ? { WALLS: 1 } : {};
  const far = walls ? { WALLS: 1, FAR: 1 } : {};
  const draw = materialOf(uniforms, near);
  return { draw, far: walls ? materialOf(uniforms, far) : draw, pick: materialOf(uniforms, { ...near, PICK: 1 }) };
}

function meshOf({ rows, count }, walls, box, own) {
  const texture = new THREE.DataTexture(rows.slice(), ROW, rows.length / 4 / ROW, THREE.RGBAIntegerFormat, THREE.IntType);
  texture.internalFormat = "RGBA32I";
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(3), 3));
  geometry.attributes.position.count = count * (walls ? 9 : 3);
  geometry.boundingSphere = box.getBoundingSphere(new THREE.Sphere()); // near ones are drawn first
  const materials = materialsOf({ ...shared, ...own, data: { value: texture } }, walls);
  const mesh = new THREE.Mesh(geometry, materials.draw);
  mesh.userData = { ...materials, rows, count, texture, walls };
  mesh.frustumCulled = false; // aim() does, by a box
  return mesh;
}

// What is drawn of a prepared tile, once it is painted; `cell` is the map's cell size [m].
export function groupOf(tile, cell) {
  const size = cell * 2 ** tile.level;
  const side = 256 * size;
  const origin = new THREE.Vector2(tile.x * side, tile.y * side);
  const box = new THREE.Box3(new THREE.Vector3(origin.x, origin.y, tile.low), new THREE.Vector3(origin.x + side, origin.y + side, tile.high));
  const group = new THREE.Group();
  group.userData = { origin, size, box };
  const own = { origin: { value: origin }, size: { value: size } };
  for (const walls of [false, true]) {
    const part = walls ? tile.walls : tile.flat;
    if (part.count) group.add(meshOf(part, walls, box, own));
  }
  return group;
}

// Before a frame: leaves out what no pixel can show, and gives walls the faces they need. `pixels`:
// a radian; `picking`: what is drawn is where, not how.
export function aim(group, frustum, pixels, picking) {
  const { box, size } = group.userData;
  const seen = frustum.intersectsBox(box);
  const far = !picking && (size * pixels) / Math.max(box.distanceToPoint(shared.eye.value), 1) < FAR_PIXELS;
  for (const mesh of group.children) {
    const { draw, far: single, pick, count, walls } = mesh.userData;
    mesh.visible = seen;
    mesh.material = picking ? pick : far ? single : draw;
    mesh.geometry.setDrawRange(0, count * (walls && !far ? 9 : 3));
  }
}

// Paints all surfaces anew; `painter` as of painterOf().
export function paintGroup(group, painter) {
  for (const { userData: { rows, count, texture } } of group.children) {
    const painted = texture.image.data;
    for (let at = 0; at < 4 * count; at += 4) painted[at + 3] = painter(rows[at], rows[at + 1], rows[at + 2], rows[at + 3]);
    texture.needsUpdate = true;
  }
}

// Calls `visit(x, y, z)` with the middle of every `step`th surface.
export function visitPlaces(group, step, visit) {
  const { origin, size } = group.userData;
  for (const { userData: { rows, count } } of group.children) {
    for (let at = 0; at < 4 * count; at += 4 * step) {
      visit(origin.x + ((rows[at] & 255) + 0.5) * size, origin.y + (((rows[at] >> 8) & 255) + 0.5) * size, rows[at + 1] / 512);
    }
  }
}

// Writes the byte that `codeOf(x, y, z, wall)` tells into bits `shift` to `shift` + 7 of each surface's last number.
export function setCodes(group, shift, codeOf) {
  const { origin, size } = group.userData;
  for (const { userData: { rows, count, walls } } of group.children) {
    for (let at = 0; at < 4 * count; at += 4) {
      const code = codeOf(origin.x + ((rows[at] & 255) + 0.5) * size, origin.y + (((rows[at] >> 8) & 255) + 0.5) * size, rows[at + 1] / 512, walls);
      rows[at + 3] = (rows[at + 3] & ~(255 << shift)) | (code << shift);
    }
  }
}

export function disposeOf(group) {
  for (const mesh of group.children) {
    const { texture, draw, far, pick } = mesh.userData;
    for (const held of new Set([texture, draw, far, pick, mesh.geometry])) held.dispose();
  }
}
