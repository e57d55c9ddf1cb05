// A reader of the way from a tile to its parent's part (docs/formats.md, "A transition"), and the
// mesh at any parameter of it.

const NONE = 0xffffffff;
const HEADER_BYTES = 64;

/// {level, x, y, coarseError, fineError, baseVertices, borderSplits, fineVertices, u, v, coarse,
/// fine: Float64Array, triangles, splits: Uint32Array}; throws on damaged bytes.
export function decodeTransition(buffer) {
  const view = new DataView(buffer);
  const wrong = (what) => new Error(`transition: ${what}`);
  if (buffer.byteLength < HEADER_BYTES || view.getUint32(0, true) !== 0x52544e54) throw wrong("not one");
  if (view.getUint32(4, true) !== 1) throw wrong("an unknown version");
  const word = (at) => view.getUint32(at, true);
  const [vertices, triangles, splits] = [word(20), word(24), word(28)];
  if (splits > vertices || word(32) > splits || word(36) > vertices) throw wrong("a count is wrong");
  if (buffer.byteLength !== HEADER_BYTES + 32 * vertices + 12 * (triangles + splits)) throw wrong("its length is wrong");
  let at = HEADER_BYTES;
  const take = (count, bytes, read) => {
    const out = Array.from({length: count}, (_, i) => read.call(view, at + bytes * i, true));
    at += bytes * count;
    return out;
  };
  const numbers = () => Float64Array.from(take(vertices, 8, view.getFloat64));
  const words = (count) => Uint32Array.from(take(count, 4, view.getUint32));
  const way = {
    level: word(8), x: word(12), y: word(16),
    coarseError: view.getFloat64(48, true), fineError: view.getFloat64(56, true),
    baseVertices: vertices - splits, borderSplits: word(32), fineVertices: word(36),
    u: numbers(), v: numbers(), coarse: numbers(), fine: numbers(),
    triangles: words(3 * triangles), splits: words(3 * splits),
  };
  if (way.triangles.some((v) => v >= way.baseVertices)) throw wrong("a triangle names what is not there");
  for (let i = 0; i < splits; ++i) {
    const [vertex, left, right] = way.splits.subarray(3 * i, 3 * i + 3);
    const there = way.baseVertices + i;
    if (vertex >= there || left >= there || (right >= there && right !== NONE)) throw wrong("a split names what is not there");
  }
  return way;
}

/// Triangles by vertex, so that a split finds its fan.
class Fans {
  constructor(way) {
    this.corners = Array.from(way.triangles);
    this.around = Array.from({length: way.u.length}, () => []);
    for (let i = 0; i < this.corners.length; ++i) this.around[this.corners[i]].push(Math.floor(i / 3));
  }

  /// The corner of triangle t that comes after v.
  after(t, v) {
    const c = this.corners;
    return c[3 * t] === v ? c[3 * t + 1] : c[3 * t + 1] === v ? c[3 * t + 2] : c[3 * t];
  }

  split(vertex, left, right, added) {
    for (let p = left; p !== right; ) {
      const fan = this.around[vertex];
      const k = fan.findIndex((t) => this.after(t, vertex) === p);
      if (k < 0) {
        if (right === NONE) break;
        throw new Error("transition: no fan leads from left to right");
      }
      const [t] = fan.splice(k, 1);
      this.around[added].push(t);
      p = this.after(t, p);
      for (let c = 3 * t; c < 3 * t + 3; ++c) if (this.corners[c] === vertex) this.corners[c] = added;
    }
    this.add(added, vertex, left);
    if (right !== NONE) this.add(vertex, added, right);
  }

  add(...triangle) {
    const t = this.corners.length / 3;
    for (const v of triangle) this.around[v].push(t);
    this.corners.push(...triangle);
  }
}

/// The mesh at s, clamped to 0..1: {u, v, height: Float64Array, triangles: Uint32Array}, the
/// triangles counter-clockwise; one that is just appearing may have no area yet.
export function meshAt(way, s) {
  s = Math.min(1, Math.max(0, s));
  const inner = way.splits.length / 3 - way.borderSplits;
  const reached = s * inner;
  const begun = s === 0 ? 0 : way.borderSplits + Math.min(inner, Math.ceil(reached));
  const count = way.baseVertices + begun;
  const mesh = {u: way.u.slice(0, count), v: way.v.slice(0, count), height: new Float64Array(count)};
  for (let i = 0; i < count; ++i) mesh.height[i] = (1 - s) * way.coarse[i] + s * way.fine[i];
  if (begun > way.borderSplits) {  // the last one is on its way
    const share = Math.min(1, reached - (begun - way.borderSplits - 1));
    const from = way.splits[3 * (begun - 1)];
    if (share < 1)
      for (const line of [mesh.u, mesh.v, mesh.height]) line[count - 1] = line[from] * (1 - share) + line[count - 1] * share;
  }
  const fans = new Fans(way);
  for (let i = 0; i < begun; ++i) fans.split(...way.splits.subarray(3 * i, 3 * i + 3), way.baseVertices + i);
  mesh.triangles = Uint32Array.from(fans.corners);
  return mesh;
}
