// A decoder of quantized-mesh-1.0 for the readout: what the tile under the pointer is made of, and
// how high its surface lies. It reads what tind writes; CesiumJS has its own for drawing.

const HEADER_BYTES = 88;
const MAX = 32767;

/// {minHeight, maxHeight, u, v, h: Uint16Array, indices: Uint16Array|Uint32Array, metadata, bytes}
export function decodeQuantizedMesh(buffer) {
  const view = new DataView(buffer);
  const mesh = {bytes: buffer.byteLength, minHeight: view.getFloat32(24, true), maxHeight: view.getFloat32(28, true)};
  const vertices = view.getUint32(HEADER_BYTES, true);
  let at = HEADER_BYTES + 4;
  for (const axis of ["u", "v", "h"]) {
    mesh[axis] = zigZagDeltas(view, at, vertices);
    at += 2 * vertices;
  }
  const wide = vertices > 65536;
  if (wide) at = Math.ceil(at / 4) * 4;
  [mesh.indices, at] = highWaterMark(view, at, wide);
  const size = wide ? 4 : 2;
  for (let edge = 0; edge < 4; ++edge) at += 4 + size * view.getUint32(at, true);
  mesh.metadata = metadataExtension(view, at);
  return mesh;
}

function zigZagDeltas(view, at, count) {
  const values = new Uint16Array(count);
  for (let i = 0, value = 0; i < count; ++i) {
    const code = view.getUint16(at + 2 * i, true);
    value += (code >> 1) ^ -(code & 1);
    values[i] = value;
  }
  return values;
}

function highWaterMark(view, at, wide) {
  const count = 3 * view.getUint32(at, true);
  at += 4;
  const indices = wide ? new Uint32Array(count) : new Uint16Array(count);
  for (let i = 0, highest = 0; i < count; ++i) {
    const code = wide ? view.getUint32(at + 4 * i, true) : view.getUint16(at + 2 * i, true);
    indices[i] = highest - code;
    if (code === 0) ++highest;
  }
  return [indices, at + count * (wide ? 4 : 2)];
}

function metadataExtension(view, at) {
  while (at + 5 <= view.byteLength) {
    const id = view.getUint8(at);
    const length = view.getUint32(at + 1, true);
    if (id === 4) {
      const json = new Uint8Array(view.buffer, at + 9, view.getUint32(at + 5, true));
      return JSON.parse(new TextDecoder().decode(json));
    }
    at += 5 + length;
  }
  return {};
}

/// The surface's height at (x, y) in 0..1 of the tile, east and north; undefined outside.
export function heightInTile(mesh, x, y) {
  const {u, v, h, indices} = mesh;
  const px = x * MAX;
  const py = y * MAX;
  for (let i = 0; i < indices.length; i += 3) {
    const [a, b, c] = [indices[i], indices[i + 1], indices[i + 2]];
    const area = (u[b] - u[a]) * (v[c] - v[a]) - (u[c] - u[a]) * (v[b] - v[a]);
    if (area === 0) continue;
    const wb = ((px - u[a]) * (v[c] - v[a]) - (u[c] - u[a]) * (py - v[a])) / area;
    const wc = ((u[b] - u[a]) * (py - v[a]) - (px - u[a]) * (v[b] - v[a])) / area;
    if (wb < -1e-9 || wc < -1e-9 || wb + wc > 1 + 1e-9) continue;
    const q = h[a] + wb * (h[b] - h[a]) + wc * (h[c] - h[a]);
    return mesh.minHeight + (q / MAX) * (mesh.maxHeight - mesh.minHeight);
  }
  return undefined;
}
