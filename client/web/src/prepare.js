// What is drawn of a decoded tile: 16 bytes a surface, as a texture has them, level ones and walls.
//   x: cell | traversability << 16 | wall << 18 | class << 20;  y, z: height and depth [1/512 m]
//   w: confidence | sigma << 8 | floor << 16 | time << 24
export const ROW = 256; // texels

function rowsOf(tile, vertical, count) {
  const rows = new Int32Array(4 * ROW * Math.ceil(count / ROW));
  let at = 0;
  for (let i = 0; i < tile.size; ++i) {
    if ((tile.kind[i] & 1) !== vertical) continue;
    const what = (tile.kind[i] >> 1) | (vertical << 2) | (tile.classId[i] << 4);
    rows[at] = tile.cell[i] | (what << 16);
    rows[at + 1] = tile.height[i];
    rows[at + 2] = vertical ? tile.depth[i] : 0;
    rows[at + 3] = tile.confidence[i] | ((tile.sigma[i] & 255) << 8);
    at += 4;
  }
  return { rows, count };
}

// Of a decoded tile; low and high are those of its surfaces [m], classes all that they have.
export function prepare(tile) {
  const { level, x, y, size } = tile;
  let low = Infinity;
  let high = -Infinity;
  let walls = 0;
  for (let i = 0; i < size; ++i) {
    const wall = tile.kind[i] & 1;
    walls += wall;
    low = Math.min(low, tile.height[i] - (wall ? tile.depth[i] : 0));
    high = Math.max(high, tile.height[i]);
  }
  const classes = [...new Set(tile.classId.subarray(0, size))];
  return { level, x, y, size, classes, low: low / 512, high: high / 512, flat: rowsOf(tile, 0, size - walls), walls: rowsOf(tile, 1, walls) };
}
