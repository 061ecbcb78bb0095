// One map on the stage: the tiles that the view needs, kept as they are on the server.
import { Decoder } from "./decoder.js";
import { disposeOf, groupOf, paintGroup, setCodes, visitPlaces } from "./patches.js";
import { call, stream, tileBytes } from "./rpc.js";
import { TileTree, choose, cover, idOf } from "./tile_tree.js";

const MOST_PATCHES = 200_000; // in sight
const MOST_HELD = 1_000_000;
const AT_ONCE = 3; // of a browser's six connections; two are for watches
const LEVELS = 13;
const SHIFT = { floor: 16, time: 24 }; // of codes in a surface's last number
const SAMPLES = 512; // of a tile, for the box
const CHOOSE_EVERY_MS = 150;

const decoder = new Decoder();
const pause = (ms) => new Promise((done) => setTimeout(done, ms));

export class MapView {
  // `changed` is called when anything has, with {scans, epoch, inferred} of what else has; `told` with what a
  // person should know.
  constructor(name, stage, { changed, told, painter }) {
    Object.assign(this, { name, stage, changed, told, painter });
    this.held = new Map();
    this.failed = new Map();
    this.fetching = new Set();
    this.queue = [];
    this.cut = { leaves: new Map(), inner: new Map(), patches: 0 };
    this.stop = new AbortController();
    this.updates = 0;
    this.low = Infinity;
    this.high = -Infinity;
    this.codes = new Map();
    this.classes = new Map(); // {name, colour} by id
  }
  // Returns when the map is there coarsely; look() then makes it finer.
  async open() {
    const info = (await call("Maps/Get", { name: this.name }, this.stop.signal)).map;
    this.cell = info.parameters.mls.cell_size_m;
    this.created = info.created;
    this.tree = new TileTree(this.cell);
    await this.listAll();
    await Promise.all(this.tree.roots().map((root) => this.fetch(root)));
    this.stage.onView = () => this.lookSoon();
    this.follow();
  }
  close() {
    this.stop.abort();
    this.stage.onView = null;
    for (const id of [...this.held.keys()]) this.drop(id);
  }
  async list(level, area) {
    const tiles = [];
    const box = area && { x_min: area.x0, x_max: area.x1, y_min: area.y0, y_max: area.y1 };
    const request = { map: this.name, area: { level, ...box } };
    for await (const part of stream("Tiles/List", request, this.stop.signal)) tiles.push(...(part.tiles ?? []));
    this.tree.set(level, tiles, area);
  }
  async listAll() {
    await Promise.all(Array.from({ length: LEVELS }, (_, i) => this.list(LEVELS - 1 - i)));
    this.tree.setTop();
  }
  // Looks again at what there is around the tiles of level 0 that have changed.
  async sync(tiles) {
    const xs = tiles.map(({ key }) => key?.x ?? 0);
    const ys = tiles.map(({ key }) => key?.y ?? 0);
    const least = (all) => all.reduce((a, b) => Math.min(a, b), Infinity);
    const most = (all) => all.reduce((a, b) => Math.max(a, b), -Infinity);
    const box = [least(xs), most(xs), least(ys), most(ys)];
    this.failed.clear();
    await Promise.all(Array.from({ length: this.tree.top + 1 }, (_, level) => {
      const [x0, x1, y0, y1] = box.map((at) => Math.floor(at / 2 ** level));
      return this.list(level, { x0, x1: x1 + 1, y0, y1: y1 + 1 });
    }));
    this.listedAt = Date.now();
    if (this.tree.roots().length > 4) await this.listAll();
    for (const id of [...this.held.keys()]) if (!this.tree.find(id)) this.drop(id);
    this.look();
  }
  lookSoon() {
    this.due ??= setTimeout(() => this.look(), CHOOSE_EVERY_MS);
  }
  // Chooses tiles for the view, coarse ones first.
  look() {
    clearTimeout(this.due);
    this.due = null;
    if (this.stop.signal.aborted) return;
    this.cut = choose(this.tree, this.stage.eye(this.low, this.high), MOST_PATCHES);
    const wanted = [...this.cut.inner.values(), ...this.cut.leaves.values()];
    this.queue = wanted
      .filter(({ id, version }) => this.held.get(id)?.version !== version && this.failed.get(id) !== version)
      .sort((a, b) => b.level - a.level || b.pixels - a.pixels);
    this.evict();
    this.show();
    this.pump();
  }
  pump() {
    while (this.fetching.size < AT_ONCE && this.queue.length) {
      const node = this.queue.shift();
      if (this.fetching.has(node.id)) continue;
      this.fetch(node).then(() => {
        if (this.stop.signal.aborted) return;
        this.show();
        this.pump();
      });
    }
    this.settled = !this.fetching.size && !this.queue.length;
  }
  async fetch(node) {
    const { id, version } = node;
    this.fetching.add(id);
    try {
      const bytes = await tileBytes(this.name, this.created, node, version);
      if (!this.stop.signal.aborted) {
        const tile = await decoder.decode(bytes);
        if (!this.stop.signal.aborted) this.hold(node, tile);
      }
    } catch (error) {
      this.failed.set(id, version);
      if (error.code !== "not_found" && !this.stop.signal.aborted) this.told(`tile ${id}: ${error.message}`);
    }
    this.fetching.delete(id);
  }
  hold({ id, version, level }, decoded) {
    const shown = this.held.get(id)?.group.visible ?? level === this.tree.top;
    this.drop(id);
    const group = groupOf(decoded, this.cell);
    group.visible = shown;
    const tile = { version, group, decoded, painter: null, codes: {}, at: Date.now(), seenAt: null };
    this.held.set(id, tile);
    if (shown) this.paintTile(tile);
    this.stage.afterFrame.push(() => (tile.seenAt = Date.now()));
    this.low = Math.min(this.low, decoded.low);
    this.high = Math.max(this.high, decoded.high);
    this.stage.tiles.add(group);
    this.stage.redrawSoon();
    ++this.updates;
  }
  paintTile(tile) {
    const { layer } = this.painter;
    const codeOf = this.codes.get(layer);
    if (codeOf && tile.codes[layer] !== codeOf) setCodes(tile.group, SHIFT[layer], codeOf);
    else if (tile.painter === this.painter) return;
    tile.codes[layer] = codeOf;
    tile.painter = this.painter;
    paintGroup(tile.group, this.painter);
  }
  // Colours of all that is shown, now and later.
  paint(painter) {
    this.painter = painter;
    for (const tile of this.shown()) this.paintTile(tile);
    this.stage.redraw();
  }
  // Of all surfaces the code that `codeOf(x, y, z, wall)` tells, 0 to 255, asked for where it is seen; `name`: of floors or times.
  setCodes(name, codeOf) {
    this.codes.set(name, codeOf);
    this.paint(this.painter);
  }
  show() {
    const shown = new Set(cover(this.tree, this.cut, (id) => this.held.has(id)).map(({ id }) => id));
    for (const [id, tile] of this.held) {
      if (tile.group.visible === shown.has(id)) continue;
      tile.group.visible = shown.has(id);
      if (tile.group.visible) this.paintTile(tile);
      this.stage.redrawSoon();
    }
    this.changed({});
  }
  // Lets go of tiles that no view has needed for longest.
  evict() {
    for (const id of [...this.cut.inner.keys(), ...this.cut.leaves.keys()]) {
      const tile = this.held.get(id);
      if (!tile) continue;
      this.held.delete(id); // and to the end
      this.held.set(id, tile);
    }
    let size = [...this.held.values()].reduce((sum, { decoded }) => sum + decoded.size, 0);
    for (const [id, { decoded, group }] of [...this.held]) {
      if (size <= MOST_HELD) return;
      if (this.cut.inner.has(id) || this.cut.leaves.has(id) || group.visible) continue;
      size -= decoded.size;
      this.drop(id);
    }
  }
  drop(id) {
    const tile = this.held.get(id);
    if (!tile) return;
    this.stage.tiles.remove(tile.group);
    disposeOf(tile.group);
    this.held.delete(id);
    this.stage.redrawSoon();
  }
  // Those of level 0 that are others than those that are known.
  newOf(tiles) {
    return tiles.filter(({ key, version, gone }) => this.tree.find(idOf(key ?? {}))?.version !== (gone ? undefined : version));
  }
  // As long as the page is seen: a watch holds one of the browser's few connections.
  async follow() {
    let since = "0";
    while (!this.stop.signal.aborted) {
      const watch = new AbortController();
      const end = () => watch.abort();
      const hide = () => document.hidden && watch.abort();
      this.stop.signal.addEventListener("abort", end);
      document.addEventListener("visibilitychange", hide);
      try {
        const request = { name: this.name, since };
        for await (const news of stream("Maps/Watch", request, watch.signal)) {
          const epoch = this.epoch !== undefined && this.epoch !== news.epoch;
          since = news.commit_sequence ?? since;
          this.epoch = news.epoch;
          this.watching = true;
          const fresh = this.newOf(news.tiles ?? []);
          if (fresh.length) this.newsAt = Date.now();
          if (fresh.length) await this.sync(fresh);
          this.changed({ scans: news.scans?.length > 0, epoch, inferred: Boolean(news.inferred) });
        }
      } catch (error) {
        if (!watch.signal.aborted && error.code !== "unauthenticated") this.told(`${error.message}; trying again`);
      }
      this.watching = false;
      this.stop.signal.removeEventListener("abort", end);
      document.removeEventListener("visibilitychange", hide);
      await pause(1000);
      while (document.hidden && !this.stop.signal.aborted) await pause(500);
    }
  }
  shown() {
    return [...this.held.values()].filter(({ group }) => group.visible);
  }
  surfaces() {
    return this.shown().reduce((sum, tile) => sum + tile.decoded.size, 0);
  }
  // Box without the outermost hundredth on each side: outliers are far away.
  box() {
    const places = [[], [], []];
    for (const { decoded, group } of this.shown()) {
      visitPlaces(group, Math.max(1, Math.ceil(decoded.size / SAMPLES)), (...place) => place.forEach((at, i) => places[i].push(at)));
    }
    if (!places[0].length) return { low: [-10, -10, 0], high: [10, 10, 5] };
    for (const axis of places) axis.sort((a, b) => a - b);
    const at = (axis, share) => axis[Math.floor((axis.length - 1) * share)];
    return { low: places.map((axis) => at(axis, 0.01)), high: places.map((axis) => at(axis, 0.99)) };
  }
}
