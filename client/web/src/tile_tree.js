// The pyramid of served tiles, and which of them a view needs: fine ones near, coarse ones far away
// or out of sight. A tile of level l + 1 covers its four children of level l, so tiles none of which
// covers another show a place once.
const LEVELS = 13;
const MOST_ROOTS = 4; // of the coarsest level that is looked at
const LEAST_PIXELS = 1.5; // of a cell's width; finer would not be seen
const MOST_PIXELS = 1e5;
const ROUNDS = 16; // of bisection, over five powers of ten

export const idOf = ({ level = 0, x = 0, y = 0 }) => `${level}/${x}/${y}`;

export class TileTree {
  constructor(cell) {
    this.cell = cell;
    this.levels = Array.from({ length: LEVELS }, () => new Map());
    this.top = LEVELS - 1;
  }
  // What the server lists of a level; `area` {x0, x1, y0, y1} (without x1, y1), or all of it.
  set(level, tiles, area) {
    const nodes = this.levels[level];
    if (area) {
      for (const [id, { x, y }] of nodes) {
        if (x >= area.x0 && x < area.x1 && y >= area.y0 && y < area.y1) nodes.delete(id);
      }
    } else nodes.clear();
    for (const { key, version, patches } of tiles) {
      const node = { level, x: key.x ?? 0, y: key.y ?? 0, version, patches: Number(patches ?? 0) };
      nodes.set((node.id = idOf(node)), node);
    }
  }
  // The finest level of few tiles, of those from `least` up.
  setTop(least = 0) {
    this.top = LEVELS - 1;
    while (this.top > least && this.levels[this.top - 1].size <= MOST_ROOTS) --this.top;
  }
  find(id) {
    return this.levels[Number(id.split("/", 1)[0])].get(id);
  }
  roots() {
    return [...this.levels[this.top].values()];
  }
  childrenOf({ level, x, y }) {
    const found = [];
    for (let i = 0; level > 0 && i < 4; ++i) {
      const child = this.levels[level - 1].get(`${level - 1}/${2 * x + (i & 1)}/${2 * y + (i >> 1)}`);
      if (child) found.push(child);
    }
    return found;
  }
  // [x, y] of the lower corner, and the width [m].
  squareOf({ level, x, y }) {
    const side = 256 * this.cell * 2 ** level;
    return [x * side, y * side, side];
  }
}

// Pixels that a cell of the tile is wide where it is nearest to the eye.
function pixelsOf(tree, node, eye) {
  const [x, y, side] = tree.squareOf(node);
  const dx = Math.max(x - eye.x, 0, eye.x - x - side);
  const dy = Math.max(y - eye.y, 0, eye.y - y - side);
  const dz = Math.max(eye.low - eye.z, 0, eye.z - eye.high);
  return ((side / 256) * eye.pixels) / Math.max(Math.hypot(dx, dy, dz), 1);
}

// With cells of at most so many pixels: the leaves, all tiles on the way to them, and the surfaces
// of leaves in sight. Stops early beyond `most`.
function cutAt(tree, eye, pixels, most) {
  const cut = { leaves: new Map(), inner: new Map(), patches: 0 };
  const stack = tree.roots();
  while (stack.length && cut.patches <= most) {
    const node = stack.pop();
    const seen = eye.sees(...tree.squareOf(node));
    node.pixels = pixelsOf(tree, node, eye);
    const children = seen && node.pixels > pixels ? tree.childrenOf(node) : [];
    if (children.length) {
      cut.inner.set(node.id, node);
      stack.push(...children);
    } else {
      cut.leaves.set(node.id, node);
      if (seen) cut.patches += node.patches;
    }
  }
  return cut;
}

// The finest cut of at most `most` surfaces in sight. `eye`: x, y, z of the camera, `low` and `high`
// of the map [m], `pixels` a radian, `sees(x, y, side)` whether a square is in sight.
export function choose(tree, eye, most) {
  let fine = Math.log(LEAST_PIXELS);
  let best = cutAt(tree, eye, LEAST_PIXELS, most);
  if (best.patches <= most) return best;
  let coarse = Math.log(MOST_PIXELS);
  best = cutAt(tree, eye, MOST_PIXELS, Infinity);
  for (let i = 0; i < ROUNDS; ++i) {
    const middle = (fine + coarse) / 2;
    const cut = cutAt(tree, eye, Math.exp(middle), most);
    if (cut.patches > most) fine = middle;
    else [coarse, best] = [middle, cut];
  }
  return best;
}

// Tiles to show of those that are held (`has(id)`), so that no place is shown twice and, as soon as
// the roots are there, none is left out: a leaf that is not there yet by its finer tiles if all of
// them are held, or else by a coarser one.
export function cover(tree, cut, has) {
  const whole = (parts) => (parts.length && parts.every(Boolean) ? parts.flat() : null);
  const finer = (node) => (has(node.id) ? [node] : whole(tree.childrenOf(node).map(finer)));
  const visit = (node) => {
    if (!cut.inner.has(node.id)) return finer(node);
    const parts = tree.childrenOf(node).map(visit);
    return whole(parts) ?? (has(node.id) ? [node] : null);
  };
  return tree.roots().flatMap((root) => visit(root) ?? []);
}
