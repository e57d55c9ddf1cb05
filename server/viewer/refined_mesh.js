// What POST /refine answers (docs/formats.md, "Refined meshes"): decoded, and applied to a mesh.

/// {whole, view, lon, lat, removedTriangles, removedVertices, vertices: [id, e, n, u], triangles: [id, a, b, c]}
export function decodeRefinedMesh(buffer) {
  const bytes = new Uint8Array(buffer);
  const view = new DataView(buffer);
  if (new TextDecoder().decode(bytes.subarray(0, 4)) !== "TRF1") throw new Error("not a refined mesh");
  let at = 6 + bytes[5];
  const number = () => {
    let value = 0;
    for (let scale = 1; ; scale *= 128) {
      if (at >= bytes.length || scale > 2 ** 28) throw new Error("a refined mesh that is cut off");
      const byte = bytes[at++];
      value += (byte & 127) * scale;
      if (byte < 128) return value;
    }
  };
  const float32 = () => view.getFloat32((at += 4) - 4, true);
  const mesh = {
    whole: (bytes[4] & 1) === 1,
    view: new TextDecoder().decode(bytes.subarray(6, at)),
    lon: view.getFloat64(at, true),
    lat: view.getFloat64(at + 8, true),
    bytes: bytes.length,
  };
  at += 16;
  const counts = [number(), number(), number(), number()];
  const list = (count, read) => {
    let id = 0;
    return Array.from({length: count}, () => read((id += number())));
  };
  mesh.removedTriangles = list(counts[0], (id) => id);
  mesh.removedVertices = list(counts[1], (id) => id);
  mesh.vertices = list(counts[2], (id) => [id, float32(), float32(), float32()]);
  let corner = 0;
  const next = () => {
    const code = number();
    return (corner = (corner + (code % 2 ? -(code + 1) / 2 : code / 2)) >>> 0);
  };
  mesh.triangles = list(counts[3], (id) => [id, next(), next(), next()]);
  return mesh;
}

/// The mesh that a client holds: every answer leads to the next.
export class RefinedMesh {
  vertices = new Map();
  triangles = new Map();

  apply(delta) {
    if (delta.whole) {
      this.vertices.clear();
      this.triangles.clear();
    }
    for (const id of delta.removedTriangles) this.triangles.delete(id);
    for (const id of delta.removedVertices) this.vertices.delete(id);
    for (const [id, ...position] of delta.vertices) this.vertices.set(id, position);
    for (const [id, ...corners] of delta.triangles) this.triangles.set(id, corners);
  }

  /// Nine numbers a triangle.
  positions() {
    const out = new Float32Array(9 * this.triangles.size);
    let at = 0;
    for (const corners of this.triangles.values()) {
      for (const id of corners) {
        out.set(this.vertices.get(id), at);
        at += 3;
      }
    }
    return out;
  }
}
