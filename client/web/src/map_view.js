// One map on the stage: its tiles of one level of detail, kept as they are on the server.
import { decodeTile } from "./tile.js";
import { disposeOf, groupOf } from "./patches.js";
import { call, stream, tileBytes } from "./rpc.js";

const MOST_PATCHES = 300_000; // of the finest level that is drawn
const LEVELS = 12;
const AT_ONCE = 4; // of a browser's six connections

const keyOf = ({ level = 0, x = 0, y = 0 }) => `${level}/${x}/${y}`;
const pause = (ms) => new Promise((done) => setTimeout(done, ms));

export class MapView {
  // `changed` is called when anything has, with whether scans have; `told` with what a person should know.
  constructor(name, stage, { changed, told }) {
    Object.assign(this, { name, stage, changed, told });
    this.held = new Map();
    this.stop = new AbortController();
    this.updates = 0;
  }
  async open() {
    const info = (await call("Maps/Get", { name: this.name }, this.stop.signal)).map;
    this.cell = info.parameters.mls.cell_size_m;
    this.created = info.created;
    this.level = await this.finestLevel();
    await this.sync();
    this.follow();
  }
  close() {
    this.stop.abort();
    for (const key of [...this.held.keys()]) this.drop(key);
  }
  async list(level) {
    const tiles = [];
    const request = { map: this.name, area: { level } };
    for await (const part of stream("Tiles/List", request, this.stop.signal)) tiles.push(...(part.tiles ?? []));
    return tiles;
  }
  async finestLevel() {
    for (let level = 0; level < LEVELS; ++level) {
      const patches = (await this.list(level)).reduce((sum, tile) => sum + Number(tile.patches ?? 0), 0);
      if (patches <= MOST_PATCHES) return level;
    }
    return LEVELS;
  }
  // Gets what is new or changed, and drops what is gone.
  async sync() {
    const now = new Map((await this.list(this.level)).map((tile) => [keyOf(tile.key), tile]));
    for (const key of [...this.held.keys()]) if (!now.has(key)) this.drop(key);
    const wanted = [...now].filter(([key, tile]) => this.held.get(key)?.version !== tile.version);
    const fetcher = async () => {
      for (let next = wanted.pop(); next; next = wanted.pop()) await this.fetch(...next);
    };
    await Promise.all(Array.from({ length: AT_ONCE }, fetcher));
    this.changed(false);
  }
  async fetch(key, { key: tile, version }) {
    try {
      const bytes = await tileBytes(this.name, this.created, tile, version);
      if (this.stop.signal.aborted) return;
      const decoded = decodeTile(bytes);
      this.drop(key);
      const group = groupOf(decoded, this.cell);
      this.held.set(key, { version, group, decoded });
      this.stage.tiles.add(group);
      this.stage.redraw();
      ++this.updates;
    } catch (error) {
      if (error.code !== "not_found") this.told(`tile ${key}: ${error.message}`);
    }
  }
  drop(key) {
    const tile = this.held.get(key);
    if (!tile) return;
    this.stage.tiles.remove(tile.group);
    disposeOf(tile.group);
    this.held.delete(key);
    this.stage.redraw();
  }
  // Whether these tiles of level 0 are others than those that are drawn, or may be.
  isStale(tiles) {
    if (this.level) return tiles.length > 0;
    return tiles.some(({ key, version, gone }) => this.held.get(keyOf(key ?? {}))?.version !== (gone ? undefined : version));
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
          since = news.commit_sequence ?? since;
          this.epoch = news.epoch;
          this.watching = true;
          if (this.isStale(news.tiles ?? [])) await this.sync();
          this.changed(news.scans?.length > 0);
        }
      } catch (error) {
        if (!watch.signal.aborted) this.told(`${error.message}; trying again`);
      }
      this.watching = false;
      this.stop.signal.removeEventListener("abort", end);
      document.removeEventListener("visibilitychange", hide);
      await pause(1000);
      while (document.hidden && !this.stop.signal.aborted) await pause(500);
    }
  }
  surfaces() {
    return [...this.held.values()].reduce((sum, tile) => sum + tile.decoded.size, 0);
  }
  // Box without the outermost hundredth on each side: outliers are far away.
  box() {
    const places = [[], [], []];
    for (const { decoded } of this.held.values()) {
      const size = this.cell * 2 ** decoded.level;
      const step = Math.max(1, decoded.size >> 9);
      for (let i = 0; i < decoded.size; i += step) {
        places[0].push((decoded.x * 256 + (decoded.cell[i] & 255)) * size);
        places[1].push((decoded.y * 256 + (decoded.cell[i] >> 8)) * size);
        places[2].push(decoded.height[i] / 512);
      }
    }
    if (!places[0].length) return { low: [-10, -10, 0], high: [10, 10, 5] };
    for (const axis of places) axis.sort((a, b) => a - b);
    const at = (axis, share) => axis[Math.floor((axis.length - 1) * share)];
    return { low: places.map((axis) => at(axis, 0.01)), high: places.map((axis) => at(axis, 0.99)) };
  }
}
