// A reader of .tpm (docs/formats.md, "A progressive mesh"; proto/stream/mesh_stream.h is the same in C++):
// bytes in as they come, vertex splits out. progressive_mesh.js makes meshes of them.
//
//   const stream = new TpmStream();
//   for await (const bytes of response.body) stream.feed(bytes);   // throws TpmError on damaged bytes
//   stream.splits of stream.header.totalSplits can be applied; stream.complete

import {NEEDS_MORE, NUMBER, RangeDecoder} from "./range_decoder.js";
import {NONE, SplitTopology, withRoom} from "./split_topology.js";
import {largestCoordinate, orientation, readStart, TpmError} from "./tpm_start.js";

export {orientation, TpmError};

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

export class TpmStream {
  /// tpm_start.js says what it holds; undefined until the base is there.
  header;
  /// X, Y, Z of each vertex of the base, and three of them for each triangle.
  basePositions = new Int32Array(0);
  baseTriangles = new Uint32Array(0);
  /// What has come: the splits, and the blocks, {first, count, error}: `error` bounds the error of
  /// every state from split `first` on, until the next block.
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

  /// The bound on the error of the state after so many splits: vertical, metres; in space the distance
  /// from the finest mesh, in the mesh's own unit. Infinite where that is not known yet.
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

  #readStart() {
    const start = readStart(this.#buffer.subarray(0, this.bytes));
    if (!start) return false;
    try {
      this.#topology = new SplitTopology(start.triangles, start.header.baseVertices);
    } catch (error) {
      throw new TpmError(error.message);
    }
    this.basePositions = start.positions;
    this.baseTriangles = start.triangles;
    this.#position = start.positions.slice();
    this.#bodyAt = start.bytes;
    this.header = start.header;
    return true;
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
    const terrain = this.header.frame === "terrain";
    if (terrain) this.#readOnTerrain(record);
    else this.#readInSpace(record);
    if (terrain && !this.#staysValid(record)) throw this.#wrong("it would flip a triangle");
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

  #readOnTerrain(record) {
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
    this.#keepPositions(record, [cx, cy, cz], [fineX, fineY, fineZ], [addedX, addedY, addedZ]);
  }

  /// All three axes alike: the new vertex against the middle, the old one where it was or opposite.
  #readInSpace(record) {
    const coder = this.#coder;
    const position = this.#position;
    const {ring, ringCount: valence} = this.#topology;
    const at = 3 * record[VERTEX];
    const coarse = [position[at], position[at + 1], position[at + 2]];
    const count = this.#over + 1;
    const guess = coarse.map((c, k) => {
      let sum = c * count;
      for (let i = 0; i < count; ++i) sum += position[3 * ring[(this.#place + i) % valence] + k];
      return Math.floor(sum / (2 * count));
    });
    const moved = coder.bit(MOVED);
    const near = width(Math.max(...guess.map((g, k) => Math.abs(g - coarse[k]))));
    const added = guess.map((g) => g + coder.number(ADDED_XY + NUMBER * (16 * moved + near)));
    const fine = coarse.map((c, k) => (moved ? 2 * c - added[k] + coder.number(FINE_XY + NUMBER * near) : c));
    this.#keepPositions(record, coarse, fine, added);
  }

  #keepPositions(record, coarse, fine, added) {
    for (let k = 0; k < 3; ++k) {
      if (Math.max(Math.abs(added[k]), Math.abs(fine[k])) > largestCoordinate(this.header.frame, k))
        throw this.#wrong("it names what is not there");
      record[COARSE + k] = coarse[k];
      record[FINE + k] = fine[k];
      record[ADDED + k] = added[k];
    }
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
