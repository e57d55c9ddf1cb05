// The triangles of a progressive mesh, and nothing but which vertex is where: a split and its
// inverse in a few writes to flat arrays (proto/stream/split_topology.h is the same in C++).
//
// Half-edge h = 3 f + k runs along face f, which lies on its left. Split i owns the face slots
// base + 2 i and base + 2 i + 1, used or not (on the border the second stays empty), so that the
// arrays after i splits depend on i alone, whichever way it was reached.

export const NONE = -1;

const next = (h) => (h % 3 === 2 ? h - 2 : h + 1);
const prev = (h) => (h % 3 === 0 ? h + 2 : h - 1);

/// The array, or a copy with room for `size` numbers.
export function withRoom(array, size) {
  if (size <= array.length) return array;
  const wider = new array.constructor(Math.max(size, array.length + (array.length >> 1), 64));
  wider.set(array);
  return wider;
}

export class SplitTopology {
  // What fan() found: neighbours counter-clockwise, all around or from border to border, and the
  // half-edges vertex -> ring[i] that have a face: on the border one fewer.
  ring = new Int32Array(64);
  edges = new Int32Array(64);
  ringCount = 0;
  edgeCount = 0;
  border = false;

  #origin;
  #twin;
  #out; // per vertex: a half-edge that leaves it
  #baseVertices;
  #baseFaces;
  #splits = 0;
  #faces;

  /// `faces`: three vertices of 0..vertices-1 each. Throws an Error when they are no manifold with
  /// border that uses every vertex.
  constructor(faces, vertices) {
    this.#baseVertices = vertices;
    this.#baseFaces = this.#faces = faces.length / 3;
    this.#origin = Int32Array.from(faces);
    this.#twin = new Int32Array(faces.length).fill(NONE);
    this.#out = new Int32Array(vertices).fill(NONE);
    this.#linkBase(vertices);
  }

  #linkBase(vertices) {
    const origin = this.#origin;
    const halfEdges = new Map();
    const facesAt = new Uint32Array(vertices);
    for (let h = 0; h < origin.length; ++h) {
      const a = origin[h];
      const b = origin[next(h)];
      if (a === b) throw new Error(`a triangle of the base names vertex ${a} twice`);
      if (this.#out[a] === NONE) this.#out[a] = h;
      ++facesAt[a];
      if (halfEdges.has(a * vertices + b)) throw new Error(`the base is no manifold at the edge ${a}-${b}`);
      halfEdges.set(a * vertices + b, h);
      const back = halfEdges.get(b * vertices + a);
      if (back !== undefined) this.#link(h, back);
    }
    for (let v = 0; v < vertices; ++v) {
      if (facesAt[v] === 0) throw new Error(`the triangles of the base at vertex ${v}: there are none`);
      this.fan(v);
      if (this.edgeCount !== facesAt[v]) throw new Error(`the triangles of the base at vertex ${v} form more than one fan`);
    }
  }

  get vertices() {
    return this.#baseVertices + this.#splits;
  }
  get splits() {
    return this.#splits;
  }
  get faces() {
    return this.#faces;
  }
  get faceSlots() {
    return this.#baseFaces + 2 * this.#splits;
  }

  /// Three vertices of every face, in the order of their slots.
  triangles() {
    const out = new Uint32Array(3 * this.#faces);
    const end = 3 * this.faceSlots;
    for (let h = 0, at = 0; h < end; h += 3) {
      if (this.#origin[h] === NONE) continue;
      out[at++] = this.#origin[h];
      out[at++] = this.#origin[h + 1];
      out[at++] = this.#origin[h + 2];
    }
    return out;
  }

  /// The neighbours of v into ring, edges, ringCount, edgeCount and border.
  fan(v) {
    const start = this.#firstOut(v);
    this.ringCount = this.edgeCount = 0;
    this.border = false;
    for (let h = start; ; ) {
      this.#addToRing(this.#origin[next(h)]);
      this.edges[this.edgeCount++] = h;
      const back = prev(h);
      const g = this.#twin[back];
      if (g === NONE) {
        this.border = true;
        this.#addToRing(this.#origin[back]);
        return;
      }
      if (g === start) return;
      h = g;
    }
  }

  /// Splits the vertex that half-edge `edge` leaves: its face is the first to go over to the new
  /// vertex, up to the one that ends at `right` (NONE: at the border). With `lone` no face goes
  /// over, and the half-edge, which lies on the border, leads to the vertex from its left.
  split(edge, lone, right) {
    const a = 3 * this.faceSlots;
    const b = a + 3;
    const n = this.vertices;
    this.#makeRoom();
    const origin = this.#origin;
    const twin = this.#twin;
    const s = lone ? origin[next(edge)] : origin[edge];
    const l = lone ? origin[edge] : origin[next(edge)];
    origin[a] = n;
    origin[a + 1] = s;
    origin[a + 2] = l;
    origin[b] = origin[b + 1] = origin[b + 2] = NONE;
    twin[a] = twin[a + 1] = twin[a + 2] = twin[b] = twin[b + 1] = twin[b + 2] = NONE;
    let first = NONE;
    let last = NONE;
    if (!lone) {
      first = edge;
      for (let h = first; ; ) {
        origin[h] = n;
        last = prev(h);
        const g = twin[last];
        if (origin[last] === right || g === NONE) break;
        h = g;
      }
    }
    this.#link(a + 1, lone ? edge : twin[first]); // s -> l
    this.#link(a + 2, first); // l -> n
    const out = this.#out;
    if (out[s] !== NONE && origin[out[s]] !== s) out[s] = a + 1;
    out[n] = a;
    ++this.#faces;
    if (right !== NONE) {
      origin[b] = s;
      origin[b + 1] = n;
      origin[b + 2] = right;
      this.#link(b + 2, twin[last]); // r -> s
      this.#link(b + 1, last); // n -> r
      this.#link(a, b);
      ++this.#faces;
    }
    ++this.#splits;
  }

  /// Undoes the last split.
  unsplit() {
    --this.#splits;
    const a = 3 * this.faceSlots;
    const b = a + 3;
    const origin = this.#origin;
    const twin = this.#twin;
    const out = this.#out;
    const s = origin[a + 1];
    const first = twin[a + 2];
    if (first !== NONE) {
      for (let h = first; ; ) {
        origin[h] = s;
        const g = twin[prev(h)];
        if (g === NONE || g >= a) break;
        h = g;
      }
    }
    if (out[s] >= a) out[s] = first;
    const l = origin[a + 2];
    const beyond = twin[a + 1];
    if (out[l] >= a) out[l] = beyond;
    if (first !== NONE) this.#link(first, beyond);
    else if (beyond !== NONE) twin[beyond] = NONE;
    --this.#faces;
    if (origin[b] !== NONE) {
      const r = origin[b + 2];
      const last = twin[b + 1];
      const outside = twin[b + 2];
      if (out[r] >= a) out[r] = last;
      if (last !== NONE) twin[last] = outside;
      if (outside !== NONE) twin[outside] = last;
      --this.#faces;
    }
  }

  #firstOut(v) {
    const start = this.#out[v];
    let h = start;
    while (this.#twin[h] !== NONE) {
      h = next(this.#twin[h]);
      if (h === start) return start;
    }
    return h;
  }
  #addToRing(v) {
    if (this.ringCount === this.ring.length) {
      this.ring = withRoom(this.ring, this.ringCount + 1);
      this.edges = withRoom(this.edges, this.ring.length);
    }
    this.ring[this.ringCount++] = v;
  }
  #link(h, g) {
    if (h !== NONE) this.#twin[h] = g;
    if (g !== NONE) this.#twin[g] = h;
  }
  #makeRoom() {
    const halfEdges = 3 * this.faceSlots + 6;
    this.#origin = withRoom(this.#origin, halfEdges);
    this.#twin = withRoom(this.#twin, halfEdges);
    this.#out = withRoom(this.#out, this.vertices + 1);
  }
}
