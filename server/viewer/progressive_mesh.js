// A progressive mesh held at any state, moved to any other by splits and their inverses, and shown
// on its way from one to another.

import {SplitTopology, withRoom} from "./split_topology.js";
import {ADDED, COARSE, EDGE, FINE, LEFT_VERTEX, LONE, orientation, RECORD, RIGHT_VERTEX, VERTEX} from "./tpm.js";

/// The mesh of a TpmStream, from whose splits it takes as many as there are.
export class ProgressiveMesh {
  #stream;
  #topology;
  #lattice; // X, Y, Z of every vertex as it is now

  /// At the base. REQUIRES: stream.header.
  constructor(stream) {
    this.#stream = stream;
    this.#topology = new SplitTopology(stream.baseTriangles, stream.header.baseVertices);
    this.#lattice = stream.basePositions.slice();
  }

  get stream() {
    return this.#stream;
  }
  get topology() {
    return this.#topology;
  }
  /// How many splits are in force.
  get splits() {
    return this.#topology.splits;
  }
  get vertexCount() {
    return this.#topology.vertices;
  }
  get triangleCount() {
    return this.#topology.faces;
  }
  /// The bound on the error of the mesh as it is now (TpmStream.errorAfter).
  get errorM() {
    return this.#stream.errorAfter(this.splits);
  }
  /// X, Y, Z of every vertex, on the stream's lattice.
  get lattice() {
    return this.#lattice.subarray(0, 3 * this.vertexCount);
  }
  /// Three vertices of every triangle, counter-clockwise.
  triangles() {
    return this.#topology.triangles();
  }

  /// The state after `splits` splits, or after all that there are. Exactly the same whichever way
  /// it is reached. Takes time for the difference only.
  seek(splits) {
    const goal = Math.max(0, Math.min(splits, this.#stream.splits));
    while (this.splits < goal) this.#up();
    while (this.splits > goal) this.#down();
  }

  /// The first state that is known to be within `error`; the last that is there if none is.
  splitsForError(error) {
    const {blocks, splits, header} = this.#stream;
    const block = blocks.find((b) => b.error <= error);
    if (block) return Math.min(block.first, splits);
    return Math.min(splits, header.totalSplits);
  }
  /// The last state, of those that are there, with at most `triangles` triangles.
  splitsForTriangles(triangles) {
    let [low, high] = [0, this.#stream.splits + 1]; // the answer lies in [low, high)
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (this.#trianglesAfter(middle) <= triangles) low = middle;
      else high = middle;
    }
    return low;
  }

  #counts = new Uint32Array(0); // triangles after each split
  #counted = 0;
  #trianglesAfter(splits) {
    const {records, header} = this.#stream;
    if (splits === 0) return header.baseTriangles;
    this.#counts = withRoom(this.#counts, this.#stream.splits);
    for (; this.#counted < splits; ++this.#counted) {
      const before = this.#counted > 0 ? this.#counts[this.#counted - 1] : header.baseTriangles;
      this.#counts[this.#counted] = before + (records[RECORD * this.#counted + RIGHT_VERTEX] < 0 ? 1 : 2);
    }
    return this.#counts[splits - 1];
  }

  #up() {
    const {records} = this.#stream;
    const at = RECORD * this.splits;
    const added = 3 * this.vertexCount;
    this.#lattice = withRoom(this.#lattice, added + 3);
    const vertex = 3 * records[at + VERTEX];
    for (let k = 0; k < 3; ++k) {
      this.#lattice[vertex + k] = records[at + FINE + k];
      this.#lattice[added + k] = records[at + ADDED + k];
    }
    this.#topology.split(records[at + EDGE], records[at + LONE] === 1, records[at + RIGHT_VERTEX]);
  }
  #down() {
    this.#topology.unsplit();
    const {records} = this.#stream;
    const at = RECORD * this.splits;
    const vertex = 3 * records[at + VERTEX];
    for (let k = 0; k < 3; ++k) this.#lattice[vertex + k] = records[at + COARSE + k];
  }
}

/// The way from one state of a mesh to a finer one, exactly the one at t = 0 and the other at
/// t = 1. Splits go one wave after the other; those of a wave share no triangle, and their two
/// vertices move together, on straight lines, from where the one was. All splits at once would be
/// simpler, and would turn triangles over that two vertices move at the same time. A triangle whose
/// one corner moves stays counter-clockwise, and so do the two that open, but where a split takes
/// its vertex aside past a neighbour: such a split is done at once when its wave begins. (A surface
/// in space has no side to turn to; there all splits are animated.)
export class Geomorph {
  /// Splits that are not animated.
  jumps = 0;
  /// The state that the mesh was on its way from, after at(): its error is the one to state.
  begin = 0;

  #mesh;
  #waves; // the first split of each, and the end
  #jumping = new Set();

  /// REQUIRES: from <= to <= mesh.stream.splits. Moves the mesh.
  constructor(mesh, from, to) {
    this.#mesh = mesh;
    this.#waves = [from];
    mesh.seek(from);
    const {records} = mesh.stream;
    const {topology} = mesh;
    const changed = new Map(); // face: the last split that made or moved it
    for (let i = from; i < to; ++i) {
      topology.fan(records[RECORD * i + VERTEX]);
      for (let k = 0; k < topology.edgeCount; ++k) {
        const face = Math.floor(topology.edges[k] / 3);
        if ((changed.get(face) ?? -1) >= this.#waves.at(-1)) this.#waves.push(i);
      }
      mesh.seek(i + 1);
      for (const v of [records[RECORD * i + VERTEX], mesh.vertexCount - 1]) {
        topology.fan(v);
        for (let k = 0; k < topology.edgeCount; ++k) changed.set(Math.floor(topology.edges[k] / 3), i);
      }
      if (mesh.stream.header.frame === "terrain" && !this.#opens(i)) this.#jumping.add(i);
    }
    this.jumps = this.#jumping.size;
    if (to > from) this.#waves.push(to);
  }

  get waves() {
    return this.#waves.length - 1;
  }

  /// Takes the mesh to t in 0..1, evenly in triangles. Returns X, Y, Z of its vertices, which are
  /// no whole numbers now; its triangles are mesh.triangles().
  at(t) {
    const mesh = this.#mesh;
    const [from, to] = [this.#waves[0], this.#waves.at(-1)];
    const split = from + Math.min(Math.max(t, 0), 1) * (to - from);
    let [low, high] = [0, this.#waves.length - 1];
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (this.#waves[middle] <= split) low = middle;
      else high = middle;
    }
    this.begin = split === to ? to : this.#waves[low];
    if (split === this.#waves[low] || high === 0) {
      mesh.seek(split);
      return Float64Array.from(mesh.lattice);
    }
    const [begin, end] = [this.#waves[low], this.#waves[high]];
    mesh.seek(end);
    const position = Float64Array.from(mesh.lattice);
    const share = (split - begin) / (end - begin);
    if (share >= 1) return position;
    const {records, header} = mesh.stream;
    for (let i = begin; i < end; ++i) {
      if (this.#jumping.has(i)) continue;
      const at = RECORD * i;
      for (let k = 0; k < 3; ++k) {
        const coarse = records[at + COARSE + k];
        position[3 * records[at + VERTEX] + k] = coarse + share * (records[at + FINE + k] - coarse);
        position[3 * (header.baseVertices + i) + k] = coarse + share * (records[at + ADDED + k] - coarse);
      }
    }
    return position;
  }

  /// The two new triangles are counter-clockwise from the very beginning, where their new edge has
  /// no length yet but a direction: its neighbours are on their sides of it, seen from the vertex.
  #opens(i) {
    const {records} = this.#mesh.stream;
    const at = RECORD * i;
    if (records[at + FINE] === records[at + COARSE] && records[at + FINE + 1] === records[at + COARSE + 1]) return true;
    const now = this.#mesh.lattice;
    const [cx, cy] = [records[at + COARSE], records[at + COARSE + 1]];
    const ahead = [cx + records[at + FINE] - records[at + ADDED], cy + records[at + FINE + 1] - records[at + ADDED + 1]];
    const side = (v) => orientation(cx, cy, ...ahead, now[3 * v], now[3 * v + 1]);
    const right = records[at + RIGHT_VERTEX];
    return side(records[at + LEFT_VERTEX]) >= 0 && (right < 0 || side(right) <= 0);
  }
}

/// Positions on a stream's lattice (whole numbers or not) as x and y in its CRS and metres up; of a
/// surface in space in the mesh's own unit.
export function toCrs(header, lattice) {
  const out = new Float64Array(lattice.length);
  if (header.frame === "space") return out.map((_, i) => (header.origin[i % 3] + lattice[i]) / header.perUnit);
  const {perPost, zStep, postToCrs: [a0, a1, a2, a3, a4, a5]} = header;
  for (let i = 0; i < lattice.length; i += 3) {
    const col = lattice[i] / perPost;
    const row = -(lattice[i + 1] / perPost);
    out[i] = a0 + col * a1 + row * a2;
    out[i + 1] = a3 + col * a4 + row * a5;
    out[i + 2] = lattice[i + 2] * zStep;
  }
  return out;
}
