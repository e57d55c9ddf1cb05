// A reader of .tpm, version 1 (docs/formats.md, "A progressive mesh"; proto/mesh_stream.h is the same
// in C++): bytes in as they come, vertex splits out. progressive_mesh.js makes meshes of them.
//
//   const stream = new TpmStream();
//   for await (const bytes of response.body) stream.feed(bytes);   // throws TpmError on damaged bytes
//   stream.splits of stream.header.totalSplits can be applied; stream.complete

import {NEEDS_MORE, NUMBER, RangeDecoder} from "./range_decoder.js";
import {NONE, SplitTopology, withRoom} from "./split_topology.js";

export class TpmError extends Error {
  name = "TpmError";
}

const HEADER = 120;
const MOST_XY = 2 ** 29;
const MOST_Z = 2 ** 30;
const TREE_VALENCE = 32;

// Where the models of each number begin.
const [COUNT, GAP, ADDED_XY, ADDED_Z, FINE_XY, FINE_Z] = [0, 1, 2, 34, 50, 66].map((i) => i * NUMBER);
const NEW_GENERATION = 98 * NUMBER;
const BOTH_SIDES = NEW_GENERATION + 1;
const MOVED = NEW_GENERATION + 2;
const LEFT = NEW_GENERATION + 3;
const SPAN = LEFT + 32 * (TREE_VALENCE + 1);
const MODELS = SPAN + 32 * (TREE_VALENCE + 1);

/// How many numbers a split takes in TpmStream.records, and where they are.
export const RECORD = 14;
export const VERTEX = 0; // the one that splits
export const LEFT_VERTEX = 1;
export const RIGHT_VERTEX = 2; // or NONE
export const EDGE = 3; // the arguments of SplitTopology.split
export const LONE = 4;
export const COARSE = 5; // X, Y, Z of the vertex before,
export const FINE = 8; // and after,
export const ADDED = 11; // and of the new one

const bitWidth = (v) => 32 - Math.clz32(v);
const width = (v) => Math.min(15, v < 2 ** 31 ? bitWidth(v) : 15);

/// Twice the area of the triangle in x and y: the exact sign.
export function orientation(ax, ay, bx, by, cx, cy) {
  const l = (bx - ax) * (cy - ay);
  const r = (by - ay) * (cx - ax);
  if (Math.abs(l) + Math.abs(r) < 2 ** 53) return l - r;
  return Math.sign(Number(BigInt(bx - ax) * BigInt(cy - ay) - BigInt(by - ay) * BigInt(cx - ax)));
}

export class TpmStream {
  /// {perPost, zStep, fineError, cols, rows, postToCrs, zUnit, datum, crs, baseVertices,
  /// baseTriangles, totalSplits}; undefined until the base is there.
  header;
  /// X, Y, Z of each vertex of the base, and three of them for each triangle.
  basePositions = new Int32Array(0);
  baseTriangles = new Uint32Array(0);
  /// What has come: the splits, and the blocks, {first, count, error}: `error` bounds the vertical
  /// error (m) of every state from split `first` on, until the next block.
  splits = 0;
  records = new Int32Array(0);
  blocks = [];
  bytes = 0;
  complete = false;

  #buffer = new Uint8Array(1 << 12);
  #bodyAt = 0;
  #coder;
  #topology;
  #position; // as they are after the last split
  #leftInBlock = 0;
  #firstOfBlock = true;
  #previous = 0; // the next vertex of this generation is at least this
  #over = 0; // faces that go over
  #place = 0; // of left in the ring
  #failed;

  /// More bytes, in any portions. True when there are more splits, or a base, than before. After
  /// it has thrown, what came before the damage stays readable.
  feed(more) {
    if (this.#failed) throw this.#failed;
    this.#buffer = withRoom(this.#buffer, this.bytes + more.length);
    this.#buffer.set(more, this.bytes);
    this.bytes += more.length;
    const before = this.header ? this.splits : -1;
    try {
      if (this.header || this.#readStart()) this.#readSplits();
    } catch (error) {
      throw (this.#failed = error);
    }
    return (this.header ? this.splits : -1) > before;
  }

  /// The bound of the state after so many splits, metres. Infinite where that is not known yet.
  errorAfter(splits) {
    if (this.header && splits === this.header.totalSplits) return this.header.fineError;
    let [low, high] = [0, this.blocks.length];
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.blocks[middle].first <= splits) low = middle + 1;
      else high = middle;
    }
    return low > 0 ? this.blocks[low - 1].error : Infinity;
  }

  // ---- header and base

  #readStart() {
    const bytes = this.#buffer.subarray(0, this.bytes);
    const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.length);
    for (let i = 0; i < Math.min(4, bytes.length); ++i)
      if (bytes[i] !== "TPM1".charCodeAt(i)) throw new TpmError("this is no .tpm stream");
    if (bytes.length < HEADER) return false;
    const [u16, u32, f64] = ["Uint16", "Uint32", "Float64"].map((type) => (at) => view[`get${type}`](at, true));
    const header = {
      perPost: u16(6), zStep: f64(8), fineError: f64(16), cols: u32(24), rows: u32(28),
      postToCrs: [0, 1, 2, 3, 4, 5].map((i) => f64(32 + 8 * i)),
      zUnit: f64(80), datum: u32(88) & 255, baseVertices: u32(92), baseTriangles: u32(96), totalSplits: u32(100),
    };
    if (u16(4) !== 1) throw new TpmError(`version ${u16(4)} of .tpm is not known here`);
    const {perPost, zStep, fineError, zUnit, datum, baseVertices, baseTriangles, totalSplits} = header;
    const [crsBytes, baseBytes] = [u32(104), u32(108)];
    if (perPost < 1 || perPost > 1024 || (perPost & (perPost - 1)) !== 0 || !(zStep > 0 && zStep < 1e6) || !(fineError >= 0) ||
        !(zUnit > 0) || datum > 2 || baseVertices < 3 || baseTriangles < 1 || baseVertices + totalSplits >= 2 ** 30)
      throw new TpmError("the header of the .tpm stream makes no sense");
    if (3 * baseVertices + 3 * baseTriangles > baseBytes) throw new TpmError("the base mesh has more numbers than bytes");
    this.#bodyAt = HEADER + crsBytes + baseBytes;
    if (bytes.length < this.#bodyAt) return false;
    header.crs = new TextDecoder().decode(bytes.subarray(HEADER, HEADER + crsBytes));
    this.#readBase(bytes.subarray(HEADER + crsBytes, this.#bodyAt), header);
    this.header = header;
    return true;
  }

  #readBase(bytes, {baseVertices, baseTriangles}) {
    let at = 0;
    const signed = (what) => {
      let value = 0;
      for (let scale = 1; ; scale *= 128) {
        if (at >= bytes.length) throw new TpmError("the base mesh is not as long as the header says");
        if (scale > 2 ** 35) throw new TpmError(what());
        const byte = bytes[at++];
        value += (byte & 127) * scale;
        if (byte < 128) return value % 2 === 0 ? value / 2 : -(value + 1) / 2;
      }
    };
    const positions = new Int32Array(3 * baseVertices);
    const last = [0, 0, 0];
    for (let i = 0; i < positions.length; ++i) {
      const wrong = () => `vertex ${(i - (i % 3)) / 3} of the base is out of range`;
      last[i % 3] += signed(wrong);
      if (Math.abs(last[i % 3]) > (i % 3 < 2 ? MOST_XY : MOST_Z)) throw new TpmError(wrong());
      positions[i] = last[i % 3];
    }
    const triangles = new Uint32Array(3 * baseTriangles);
    let index = 0;
    for (let i = 0; i < triangles.length; ++i) {
      const wrong = () => `triangle ${(i - (i % 3)) / 3} of the base names a vertex that is not there`;
      index += signed(wrong);
      if (index < 0 || index >= baseVertices) throw new TpmError(wrong());
      triangles[i] = index;
      if (i % 3 < 2) continue;
      const [a, b, c] = [3 * triangles[i - 2], 3 * triangles[i - 1], 3 * index];
      if (!(orientation(positions[a], positions[a + 1], positions[b], positions[b + 1], positions[c], positions[c + 1]) > 0))
        throw new TpmError(`triangle ${(i - 2) / 3} of the base is not counter-clockwise`);
    }
    if (at !== bytes.length) throw new TpmError("the base mesh is not as long as the header says");
    try {
      this.#topology = new SplitTopology(triangles, baseVertices);
    } catch (error) {
      throw new TpmError(error.message);
    }
    this.basePositions = positions;
    this.baseTriangles = triangles;
    this.#position = positions.slice();
  }

  // ---- splits

  #readSplits() {
    const {totalSplits} = this.header;
    const body = this.#buffer.subarray(this.#bodyAt, this.bytes);
    if (totalSplits > 0 && !this.#coder) {
      if (body.length < 4) return;
      this.#coder = new RangeDecoder(MODELS);
      this.#coder.bytes = body;
      this.#coder.start();
    }
    const coder = this.#coder;
    if (coder) coder.bytes = body;
    try {
      while (this.splits < totalSplits) {
        coder.checkpoint();
        if (this.#leftInBlock === 0) this.#readBlock();
        else this.#readSplit();
      }
    } catch (stop) {
      if (stop !== NEEDS_MORE) throw stop;
      coder.rollback();
      return;
    }
    if (body.length !== (coder?.asked ?? 0)) throw new TpmError("there are bytes after the end of the .tpm stream");
    this.complete = true;
  }

  #wrong(what) {
    return new TpmError(`split ${this.splits}: ${what}`);
  }

  #readBlock() {
    const count = this.#coder.number(COUNT, false);
    const bits = ((this.#coder.plain(16) << 16) | this.#coder.plain(16)) >>> 0;
    const error = new Float32Array(Uint32Array.of(bits).buffer)[0];
    if (count === 0 || count > this.header.totalSplits - this.splits || !(error >= 0) || error > (this.blocks.at(-1)?.error ?? Infinity))
      throw this.#wrong("its block makes no sense");
    this.blocks.push({first: this.splits, count, error});
    this.#leftInBlock = count;
    this.#firstOfBlock = true;
  }

  #readSplit() {
    const previous = this.#firstOfBlock || this.#coder.bit(NEW_GENERATION) ? 0 : this.#previous;
    this.records = withRoom(this.records, RECORD * (this.splits + 1));
    const record = this.records.subarray(RECORD * this.splits, RECORD * (this.splits + 1));
    this.#readTopology(record, previous);
    this.#readPositions(record);
    if (!this.#staysValid(record)) throw this.#wrong("it would flip a triangle");
    this.#apply(record);
    this.#previous = record[VERTEX] + 1;
    this.#firstOfBlock = false;
    --this.#leftInBlock;
    ++this.splits;
  }

  /// Which vertex, and which of its faces go over.
  #readTopology(record, previous) {
    const coder = this.#coder;
    const topology = this.#topology;
    const vertex = previous + coder.number(GAP, false);
    if (vertex >= topology.vertices) throw this.#wrong("it names what is not there");
    topology.fan(vertex);
    const {ring, ringCount: valence, edges, edgeCount, border} = topology;
    const both = !border || coder.bit(BOTH_SIDES) === 1;
    const place = this.#readPlace(LEFT, valence);
    if (place >= valence) throw this.#wrong("it names what is not there");
    const after = valence - 1 - place;
    let over = after;
    if (both) {
      over = 1 + this.#readPlace(SPAN, valence);
      if (over > (border ? after : valence - 1)) throw this.#wrong("it names what is not there");
    }
    record[VERTEX] = vertex;
    record[LEFT_VERTEX] = ring[place];
    record[RIGHT_VERTEX] = both ? ring[(place + over) % valence] : NONE;
    record[LONE] = over === 0 ? 1 : 0;
    const last = edges[edgeCount - 1];
    record[EDGE] = over > 0 ? edges[place] : last % 3 === 0 ? last + 2 : last - 1;
    this.#place = place;
    this.#over = over;
  }

  #readPlace(models, valence) {
    const depth = bitWidth(valence - 1);
    return valence <= TREE_VALENCE ? this.#coder.tree(models + 32 * valence, depth) : this.#coder.plain(depth);
  }

  #readPositions(record) {
    const coder = this.#coder;
    const position = this.#position;
    const {ring, ringCount: valence} = this.#topology;
    const c = 3 * record[VERTEX];
    const [cx, cy, cz] = [position[c], position[c + 1], position[c + 2]];
    let [middleX, middleY, low, high] = [0, 0, cz, cz];
    for (let i = 0; i <= this.#over; ++i) {
      const p = 3 * ring[(this.#place + i) % valence];
      middleX += position[p];
      middleY += position[p + 1];
      low = Math.min(low, position[p + 2]);
      high = Math.max(high, position[p + 2]);
    }
    const count = this.#over + 1;
    const guessX = Math.floor((cx * count + middleX) / (2 * count));
    const guessY = Math.floor((cy * count + middleY) / (2 * count));
    const moved = coder.bit(MOVED);
    const near = width(Math.max(Math.abs(guessX - cx), Math.abs(guessY - cy)));
    const rough = width(high - low);

    const addedXy = ADDED_XY + NUMBER * (16 * moved + near);
    const addedX = guessX + coder.number(addedXy);
    const addedY = guessY + coder.number(addedXy);
    const addedZ = this.#starHeight(cx, cy, cz, addedX, addedY) + coder.number(ADDED_Z + NUMBER * rough);
    let [fineX, fineY, level] = [cx, cy, cz];
    if (moved) {
      fineX = 2 * cx - addedX + coder.number(FINE_XY + NUMBER * near);
      fineY = 2 * cy - addedY + coder.number(FINE_XY + NUMBER * near);
      level = this.#starHeight(cx, cy, cz, fineX, fineY);
    }
    const fineZ = level + coder.number(FINE_Z + NUMBER * (16 * moved + rough));
    if (Math.max(Math.abs(addedX), Math.abs(addedY), Math.abs(fineX), Math.abs(fineY)) > MOST_XY ||
        Math.max(Math.abs(addedZ), Math.abs(fineZ)) > MOST_Z)
      throw this.#wrong("it names what is not there");
    record.set([cx, cy, cz, fineX, fineY, fineZ, addedX, addedY, addedZ], COARSE);
  }

  /// The height of the star of c at (x, y): of the face that holds the place, or comes nearest to it.
  #starHeight(cx, cy, cz, x, y) {
    const position = this.#position;
    const {ring, ringCount, edgeCount} = this.#topology;
    let best = -1e300;
    let height = cz;
    for (let i = 0; i < edgeCount; ++i) {
      const p = 3 * ring[i];
      const q = 3 * ring[i + 1 < ringCount ? i + 1 : 0];
      const px = position[p] - cx;
      const py = position[p + 1] - cy;
      const qx = position[q] - cx;
      const qy = position[q + 1] - cy;
      const dx = x - cx;
      const dy = y - cy;
      const area = px * qy - py * qx;
      const wp = (dx * qy - dy * qx) / area;
      const wq = (px * dy - py * dx) / area;
      const inside = Math.min(1 - wp - wq, wp, wq);
      if (inside > best) {
        best = inside;
        height = cz + (wp * (position[p + 2] - cz) + wq * (position[q + 2] - cz));
      }
    }
    return Math.min(Math.max(Math.floor(height + 0.5), -1e9), 1e9);
  }

  /// All faces of the two new stars are counter-clockwise.
  #staysValid(record) {
    const position = this.#position;
    const {ring, ringCount: valence, edgeCount} = this.#topology;
    const counterClockwise = (ax, ay, bx, by, v) => orientation(ax, ay, bx, by, position[3 * v], position[3 * v + 1]) > 0;
    const [fineX, fineY, addedX, addedY] = [record[FINE], record[FINE + 1], record[ADDED], record[ADDED + 1]];
    for (let i = 0; i < edgeCount; ++i) {
      const goesOver = (i + valence - this.#place) % valence < this.#over;
      const p = 3 * ring[i];
      const q = ring[i + 1 < valence ? i + 1 : 0];
      if (!counterClockwise(goesOver ? addedX : fineX, goesOver ? addedY : fineY, position[p], position[p + 1], q)) return false;
    }
    if (!counterClockwise(addedX, addedY, fineX, fineY, record[LEFT_VERTEX])) return false;
    return record[RIGHT_VERTEX] === NONE || counterClockwise(fineX, fineY, addedX, addedY, record[RIGHT_VERTEX]);
  }

  #apply(record) {
    const added = 3 * this.#topology.vertices;
    this.#topology.split(record[EDGE], record[LONE] === 1, record[RIGHT_VERTEX]);
    this.#position = withRoom(this.#position, added + 3);
    const vertex = 3 * record[VERTEX];
    for (let k = 0; k < 3; ++k) {
      this.#position[vertex + k] = record[FINE + k];
      this.#position[added + k] = record[ADDED + k];
    }
  }
}
