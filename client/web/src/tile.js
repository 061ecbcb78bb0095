// Surface tiles as served (core/codec/FORMAT.md, SST1, versions 1 to 4), decoded in one pass. Their
// checksum is not computed here: the server has, and colours are left out.
import { decompress } from "fzstd";

const SIDE = 256;
const CELLS = SIDE * SIDE;
const MOST_SURFACES = 1 << 22;
const COLUMNS = { 1: 17, 2: 18, 3: 18, 4: 22 };
const NONE = 255; // kind of what is not there

class Reader {
  constructor(bytes) {
    this.bytes = bytes;
    this.view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
    this.at = 0;
  }
  take(count) {
    if (this.at + count > this.bytes.length) throw new Error("the tile ends too early");
    const piece = this.bytes.subarray(this.at, this.at + count);
    this.at += count;
    return piece;
  }
  byte() {
    return this.take(1)[0];
  }
  int32() {
    const value = this.view.getInt32(this.at, true);
    this.at += 4;
    return value;
  }
  varint() {
    let value = 0;
    for (let scale = 1; scale <= 2 ** 49; scale *= 128) {
      const byte = this.byte();
      value += (byte & 127) * scale;
      if (byte < 128) return value;
    }
    throw new Error("a number of the tile has no end");
  }
  column() {
    const packing = this.byte();
    const size = this.varint();
    if (size > MOST_SURFACES * 2) throw new Error(`a column of the tile has ${size} bytes`);
    if (packing === 0) return this.take(size);
    if (packing === 1) return new Uint8Array(size).fill(this.byte());
    if (packing !== 2) throw new Error(`a column of the tile is packed by ${packing}`);
    const plain = decompress(this.take(this.varint()), new Uint8Array(size));
    if (plain.length !== size) throw new Error("a column of the tile has another size");
    return plain;
  }
}

// Numbers of columns whose lower bits all columns share.
class Numbers {
  constructor(columns, bits) {
    this.columns = columns;
    this.next = new Uint32Array(columns.length);
    this.bits = bits;
    this.bit = 0;
  }
  byte(column) {
    return this.columns[column][this.next[column]++];
  }
  // A bit column's.
  flag(column) {
    const at = this.next[column]++;
    return (this.columns[column][at >> 3] >> (at & 7)) & 1;
  }
  signed(column) {
    const head = this.byte(column);
    let value = head;
    if (head >= 128) {
      const lower = 6 + ((head - 128) >> 1);
      value = (2 | (head & 1)) * 2 ** lower;
      for (let i = 0; i < lower; ++i, ++this.bit) {
        if ((this.bits[this.bit >> 3] >> (this.bit & 7)) & 1) value += 2 ** i;
      }
    }
    return value % 2 ? -(value + 1) / 2 : value / 2;
  }
}

// Surfaces of each cell.
function readCounts(reader) {
  const blocks = reader.column();
  const counts = new Uint32Array(CELLS);
  for (let block = 0; block < CELLS / 4; ++block) {
    const cell = (block >> 7) * 2 * SIDE + (block & 127) * 2;
    counts[cell] = blocks[block] & 3;
    counts[cell + 1] = (blocks[block] >> 2) & 3;
    counts[cell + SIDE] = (blocks[block] >> 4) & 3;
    counts[cell + SIDE + 1] = blocks[block] >> 6;
  }
  const more = new Reader(reader.column());
  for (let cell = 0; cell < CELLS; ++cell) if (counts[cell] === 3) counts[cell] += more.varint();
  return counts;
}

// Rounded half up.
const mean = (sum, count) => Math.floor((sum + (count >> 1)) / count);

class Surfaces {
  constructor(counts, numbers, hasConfidence) {
    this.counts = counts;
    this.first = new Uint32Array(CELLS);
    let size = 0;
    for (let cell = 0; cell < CELLS; ++cell) {
      this.first[cell] = size;
      size += counts[cell];
    }
    if (size > MOST_SURFACES) throw new Error(`the tile has ${size} surfaces`);
    this.size = size;
    this.numbers = numbers;
    this.hasConfidence = hasConfidence;
    this.cell = new Uint16Array(size);
    this.kind = new Uint8Array(size + 1);
    this.kind[size] = NONE;
    this.height = new Int32Array(size + 1);
    this.depth = new Int32Array(size + 1);
    this.sigma = new Int32Array(size + 1);
    this.cost = new Int32Array(size + 1);
    this.classId = numbers.columns[5];
    this.confidence = new Uint8Array(size);
    this.beside = new Uint32Array(4);
  }
  // The surface of that layer in another cell, or one that is not there.
  at(cell, x, y, layer) {
    if (x < 0 || x >= SIDE || y < 0) return this.size;
    const count = this.counts[cell];
    return count ? this.first[cell] + Math.min(layer, count - 1) : this.size;
  }
  decode() {
    for (let cell = 0, i = 0; cell < CELLS; ++cell) {
      const x = cell & (SIDE - 1);
      const y = cell >> 8;
      for (let layer = 0; layer < this.counts[cell]; ++layer, ++i) {
        this.beside[0] = this.at(cell - 1, x - 1, y, layer);
        this.beside[1] = this.at(cell - SIDE, x, y - 1, layer);
        this.beside[2] = this.at(cell - SIDE + 1, x + 1, y - 1, layer);
        this.beside[3] = this.at(cell - SIDE - 1, x - 1, y - 1, layer);
        this.cell[i] = cell;
        this.decodeOne(i);
      }
    }
    return this;
  }
  decodeKind() {
    const { kind, beside } = this;
    const left = kind[beside[0]];
    const up = kind[beside[1]];
    const expected = left !== NONE ? left : up;
    if (expected === NONE) return this.numbers.flag(0) ? 0 : this.numbers.byte(4);
    const share = (up === expected) + (kind[beside[3]] === expected) + (kind[beside[2]] === expected);
    return this.numbers.flag(share) ? expected : this.numbers.byte(4);
  }
  decodeOne(i) {
    const kind = this.decodeKind();
    const vertical = kind & 1;
    let alike = 0, height = 0, depth = 0, sigma = 0, costs = 0, cost = 0;
    for (let k = 0; k < 4; ++k) {
      const other = this.beside[k];
      const its = this.kind[other];
      if (its === NONE) continue;
      if ((its & 1) === vertical) {
        ++alike;
        height += this.height[other];
        depth += this.depth[other];
        sigma += this.sigma[other];
      }
      if (its >> 1 === kind >> 1) {
        ++costs;
        cost += this.cost[other];
      }
    }
    if (!alike) {
      const first = this.beside[0] !== this.size ? this.beside[0] : this.beside[1];
      height = this.height[first];
      sigma = this.sigma[first];
    }
    const count = alike || 1;
    const numbers = this.numbers;
    const rise = numbers.signed(!alike ? 6 : vertical ? 7 : alike === 1 ? 8 : 9);
    this.kind[i] = kind;
    this.height[i] = mean(height, count) + rise;
    if (vertical) {
      this.depth[i] = (alike ? mean(depth, count) + rise : 0) + numbers.signed(alike ? 11 : 10);
    }
    this.sigma[i] = mean(sigma, count) + numbers.signed(12 + vertical);
    if (kind >> 1 < 3) {
      this.cost[i] = (costs ? mean(cost, costs) : 0) + numbers.signed(14 + (kind >> 1));
    }
    if (this.hasConfidence && this.classId[i]) this.confidence[i] = numbers.byte(17);
  }
}

// `bytes`: a Uint8Array. Of n surfaces: cell (y · 256 + x), kind (traversability · 2 + vertical),
// height and depth in 1/512 m, sigma (its code), classId, confidence [%]. Throws an Error for what
// is no such tile.
export function decodeTile(bytes) {
  if (String.fromCharCode(...bytes.subarray(0, 4)) !== "SST1") throw new Error("no surface tile");
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const columnCount = COLUMNS[view.getUint16(6, true)];
  if (!columnCount) throw new Error("the tile is of a later version than this viewer");
  const reader = new Reader(new Reader(bytes.subarray(12)).take(view.getUint32(8, true)));
  const level = reader.byte();
  const x = reader.int32();
  const y = reader.int32();
  reader.take(8); // version
  const counts = readCounts(reader);
  const columns = [];
  while (columns.length < columnCount) columns.push(reader.column());
  const bits = reader.take(reader.varint());
  const surfaces = new Surfaces(counts, new Numbers(columns, bits), columnCount > 17).decode();
  const { size, cell, kind, height, depth, sigma, classId, confidence } = surfaces;
  return { level, x, y, size, cell, kind, height, depth, sigma, classId, confidence };
}
