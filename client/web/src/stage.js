// Camera, drawing on demand, and what is under the pointer.
import * as THREE from "three";
import { MapControls } from "three/examples/jsm/controls/MapControls.js";
import { aim, shared } from "./patches.js";

const LOOK = 25; // pixels around the pointer, across: what is sparse has gaps
const PREFER = 5.7; // pixels from it in which a surface to drive on comes before all others

export class Stage {
  constructor(parent) {
    this.renderer = new THREE.WebGLRenderer();
    this.canvas = this.renderer.domElement;
    this.canvas.tabIndex = 0;
    this.canvas.setAttribute("role", "application");
    this.canvas.setAttribute("aria-label", "the map: arrows move, Enter clicks in the middle");
    parent.append(this.canvas);
    this.scene = new THREE.Scene();
    this.camera = new THREE.PerspectiveCamera(50, 1, 0.3, 6000);
    this.camera.up.set(0, 0, 1);
    this.controls = new MapControls(this.camera, this.canvas);
    this.controls.listenToKeyEvents(this.canvas);
    this.controls.addEventListener("change", () => {
      this.redraw();
      this.onView?.();
    });
    this.tiles = new THREE.Group();
    this.overlay = new THREE.Group();
    this.scene.add(this.tiles, this.overlay);
    this.renderer.getContext().getExtension("EXT_color_buffer_float");
    this.target = new THREE.WebGLRenderTarget(LOOK, LOOK, { type: THREE.FloatType });
    this.frameMs = [];
    this.afterFrame = []; // called once the next frame is drawn
    this.onView = null; // called when the camera has moved
    addEventListener("resize", () => this.fit());
    this.fit();
    requestAnimationFrame(() => this.loop());
  }
  redraw() {
    this.dirty = true;
  }
  // For what comes by itself: leaves twice the time between frames that one takes.
  redrawSoon() {
    this.due ??= setTimeout(() => {
      this.due = null;
      this.redraw();
    }, 2 * (this.frameMs.at(-1) ?? 0));
  }
  fit() {
    this.renderer.setSize(innerWidth, innerHeight);
    this.camera.aspect = innerWidth / innerHeight;
    this.camera.updateProjectionMatrix();
    this.redraw();
    this.onView?.();
  }
  loop() {
    requestAnimationFrame(() => this.loop());
    if (this.dirty) this.draw();
  }
  draw() {
    this.dirty = false;
    const begun = performance.now();
    this.aim(false);
    this.renderer.render(this.scene, this.camera);
    const gl = this.renderer.getContext();
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4)); // until it is drawn
    this.frameMs.push(performance.now() - begun);
    for (const drawn of this.afterFrame.splice(0)) drawn();
    if (this.frameMs.length > 20) this.frameMs.shift();
  }
  frustum() {
    this.camera.updateMatrixWorld();
    const matrix = new THREE.Matrix4().multiplyMatrices(this.camera.projectionMatrix, this.camera.matrixWorldInverse);
    return new THREE.Frustum().setFromProjectionMatrix(matrix);
  }
  // Pixels a radian.
  pixels() {
    return innerHeight / 2 / Math.tan((this.camera.fov * Math.PI) / 360);
  }
  aim(picking) {
    const frustum = this.frustum();
    shared.toScreen.value.multiplyMatrices(this.camera.projectionMatrix, this.camera.matrixWorldInverse);
    shared.eye.value.copy(this.camera.position);
    for (const group of this.tiles.children) aim(group, frustum, this.pixels(), picking);
  }
  background(colour) {
    this.scene.background = new THREE.Color(colour);
    this.redraw();
  }
  look(view) {
    this.camera.position.set(view[0], view[1], view[2]);
    this.controls.target.set(view[3], view[4], view[5]);
    this.controls.update();
    this.redraw();
    this.onView?.();
  }
  // Nearer to what is looked at, or farther.
  zoom(factor) {
    const { position } = this.camera;
    const { target } = this.controls;
    this.look([...position.clone().sub(target).multiplyScalar(factor).add(target).toArray(), ...target.toArray()]);
  }
  // What tile_tree.js chooses by.
  eye(low, high) {
    const frustum = this.frustum();
    const box = new THREE.Box3();
    const sees = (x, y, side) => {
      box.min.set(x, y, low);
      box.max.set(x + side, y + side, high);
      return frustum.intersectsBox(box);
    };
    const { x, y, z } = this.camera.position;
    return { x, y, z, low, high, pixels: this.pixels(), sees };
  }
  view() {
    return [...this.camera.position.toArray(), ...this.controls.target.toArray()];
  }
  // {x, y, z} of the surface near the pixel, one to drive on before others; null: none.
  pick(x, y) {
    const background = this.scene.background;
    this.camera.setViewOffset(innerWidth, innerHeight, x - (LOOK >> 1), y - (LOOK >> 1), LOOK, LOOK);
    this.scene.background = null;
    this.overlay.visible = false;
    this.aim(true);
    this.renderer.setRenderTarget(this.target);
    this.renderer.setClearColor(0, 0);
    this.renderer.clear();
    this.renderer.render(this.scene, this.camera);
    const pixels = new Float32Array(4 * LOOK * LOOK);
    this.renderer.readRenderTargetPixels(this.target, 0, 0, LOOK, LOOK, pixels);
    this.renderer.setRenderTarget(null);
    this.overlay.visible = true;
    this.scene.background = background;
    this.camera.clearViewOffset();
    return nearestOf(pixels);
  }
  // Pixel of a place, and its depth (below 1 before the eye), for tests and labels.
  pixelOf({ x, y, z }) {
    const p = new THREE.Vector3(x, y, z).project(this.camera);
    return [((p.x + 1) / 2) * innerWidth, ((1 - p.y) / 2) * innerHeight, p.z];
  }
  ball(name, { x, y, z }, colour) {
    const material = new THREE.MeshBasicMaterial({ color: colour, depthTest: false });
    const mesh = new THREE.Mesh(new THREE.SphereGeometry(0.4), material);
    mesh.position.set(x, y, z);
    this.put(name, mesh);
  }
  // `through`: seen through what is before it.
  line(name, points, colour, radius, through) {
    const curve = new THREE.CurvePath();
    const corners = points.map((p) => new THREE.Vector3(p.x ?? 0, p.y ?? 0, (p.z ?? 0) + 0.25));
    for (let i = 1; i < corners.length; ++i) curve.add(new THREE.LineCurve3(corners[i - 1], corners[i]));
    if (!curve.curves.length) return;
    const geometry = new THREE.TubeGeometry(curve, Math.min(4000, 2 * corners.length + 62), radius, 5);
    this.put(name, new THREE.Mesh(geometry, new THREE.MeshBasicMaterial({ color: colour, depthTest: !through })));
  }
  // Pairs of places, six numbers each.
  segments(name, places, colour) {
    const geometry = new THREE.BufferGeometry().setAttribute("position", new THREE.Float32BufferAttribute(places, 3));
    this.put(name, new THREE.LineSegments(geometry, new THREE.LineBasicMaterial({ color: colour, depthTest: false })));
  }
  dots(name, places, colour, pixels) {
    const geometry = new THREE.BufferGeometry().setAttribute("position", new THREE.Float32BufferAttribute(places, 3));
    this.put(name, new THREE.Points(geometry, new THREE.PointsMaterial({ color: colour, size: pixels, sizeAttenuation: false })));
  }
  put(name, mesh) {
    this.remove(name, true);
    mesh.name = name;
    mesh.renderOrder = 2;
    this.overlay.add(mesh);
    this.redraw();
  }
  // All whose names begin so, or only that one.
  remove(prefix, exact) {
    for (const mesh of [...this.overlay.children]) {
      if (exact ? mesh.name !== prefix : !mesh.name.startsWith(prefix)) continue;
      this.overlay.remove(mesh);
      mesh.geometry.dispose();
      mesh.material.dispose();
    }
    this.redraw();
  }
}

function nearestOf(pixels) {
  let best = null;
  let least = Infinity;
  for (let i = 0; i < LOOK * LOOK; ++i) {
    const kind = pixels[4 * i + 3];
    if (kind < 0.5) continue;
    const middle = LOOK >> 1;
    const off = Math.hypot((i % LOOK) - middle, Math.floor(i / LOOK) - middle);
    const cost = off + (Math.round(kind) === 2 && off <= PREFER ? 0 : LOOK); // 2: traversable
    if (cost >= least) continue;
    least = cost;
    best = { x: pixels[4 * i], y: pixels[4 * i + 1], z: pixels[4 * i + 2] };
  }
  return best;
}
