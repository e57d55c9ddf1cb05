// Which lines there are in a tile, and which labels find room. Pure.

/// Each edge of the triangles once, as pairs of vertices.
export function latticeLines(indices) {
  const edges = new Map();
  for (let i = 0; i < indices.length; i += 3) {
    for (let k = 0; k < 3; ++k) {
      const a = indices[i + k], b = indices[i + ((k + 1) % 3)];
      edges.set(a < b ? a * 4294967296 + b : b * 4294967296 + a, [a, b]);
    }
  }
  return new Uint32Array([...edges.values()].flat());
}

/// Edges that only one triangle has and that lie on a side of the tile.
export function tileSides({u, v, indices}) {
  const lines = [];
  for (let i = 0; i < indices.length; i += 3) {
    for (let k = 0; k < 3; ++k) {
      const a = indices[i + k], b = indices[i + ((k + 1) % 3)];
      const along = (axis) => axis[a] === axis[b] && (axis[a] === 0 || axis[a] === 32767);
      if (along(u) || along(v)) lines.push(a, b);
    }
  }
  return new Uint32Array(lines);
}

const WIDE = 76, HIGH = 20, AWAY = 36;

/// The nearest first; none over another, none cut off. What lies over a place that is `taken` stands below it.
export function labelsThatFit(labels, width, height, taken = []) {
  const kept = [];
  const over = (a) => (b) => Math.abs(a.x - b.x) < WIDE && Math.abs(a.y - b.y) < HIGH;
  for (const wanted of [...labels].sort((a, b) => a.depth - b.depth)) {
    const label = taken.some(over(wanted)) ? {...wanted, y: wanted.y + AWAY} : wanted;
    const {x, y} = label;
    if (x < WIDE / 2 || y < HIGH / 2 || x > width - WIDE / 2 || y > height - HIGH / 2) continue;
    if (![...taken, ...kept].some(over(label))) kept.push(label);
  }
  return kept;
}
