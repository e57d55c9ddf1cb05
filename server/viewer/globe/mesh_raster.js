// Heights of a decoded tile at a lattice of places: each triangle fills the places inside it.

const MAX = 32767;

/// The first index whose value is at least `bound`.
function firstAtLeast(values, bound) {
  let low = 0, high = values.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (values[middle] < bound) low = middle + 1;
    else high = middle;
  }
  return low;
}

/// xs, ys: shares of the tile from west and south, ascending. Row by row from the south; NaN outside
/// of the mesh.
export function rasterise(mesh, xs, ys) {
  const {u, v, h, indices, minHeight, maxHeight} = mesh;
  const columns = xs.map((x) => x * MAX), rows = ys.map((y) => y * MAX);
  const heights = new Float64Array(xs.length * ys.length).fill(NaN);
  const step = (maxHeight - minHeight) / MAX;
  for (let i = 0; i < indices.length; i += 3) {
    const a = indices[i], b = indices[i + 1], c = indices[i + 2];
    const area = (u[b] - u[a]) * (v[c] - v[a]) - (u[c] - u[a]) * (v[b] - v[a]);
    if (area === 0) continue;
    const right = Math.max(u[a], u[b], u[c]), top = Math.max(v[a], v[b], v[c]);
    const left = firstAtLeast(columns, Math.min(u[a], u[b], u[c]));
    for (let row = firstAtLeast(rows, Math.min(v[a], v[b], v[c])); row < rows.length && rows[row] <= top; ++row) {
      for (let column = left; column < columns.length && columns[column] <= right; ++column) {
        const x = columns[column] - u[a], y = rows[row] - v[a];
        const wb = (x * (v[c] - v[a]) - (u[c] - u[a]) * y) / area;
        const wc = ((u[b] - u[a]) * y - x * (v[b] - v[a])) / area;
        if (wb < -1e-9 || wc < -1e-9 || wb + wc > 1 + 1e-9) continue;
        heights[row * xs.length + column] = minHeight + step * (h[a] + wb * (h[b] - h[a]) + wc * (h[c] - h[a]));
      }
    }
  }
  return heights;
}
