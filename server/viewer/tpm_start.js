// What a .tpm begins with: its header and its base mesh (proto/stream/mesh_stream_start.h is the same in C++).

export class TpmError extends Error {
  name = "TpmError";
}

const HEADER = 120;

/// Of X and Y (axes 0 and 1) and Z, either way.
export function largestCoordinate(frame, axis) {
  return frame === "space" ? 2 ** 28 : axis < 2 ? 2 ** 29 : 2 ** 30;
}

/// Twice the area of the triangle in x and y: the exact sign.
export function orientation(ax, ay, bx, by, cx, cy) {
  const l = (bx - ax) * (cy - ay);
  const r = (by - ay) * (cx - ax);
  if (Math.abs(l) + Math.abs(r) < 2 ** 53) return l - r;
  return Math.sign(Number(BigInt(bx - ax) * BigInt(cy - ay) - BigInt(by - ay) * BigInt(cx - ax)));
}

/// {header, positions, triangles, bytes: how many they took}; undefined when that much has not come.
/// The header is {frame, fineError, crs, baseVertices, baseTriangles, totalSplits}, and for "terrain"
/// {perPost, zStep, cols, rows, postToCrs, zUnit, datum}, for "space" {perUnit, origin}.
export function readStart(bytes) {
  for (let i = 0; i < Math.min(4, bytes.length); ++i)
    if (bytes[i] !== "TPM1".charCodeAt(i)) throw new TpmError("this is no .tpm stream");
  if (bytes.length < HEADER) return undefined;
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.length);
  const [u16, u32, f64] = ["Uint16", "Uint32", "Float64"].map((type) => (at) => view[`get${type}`](at, true));
  const version = u16(4);
  if (version !== 1 && version !== 2) throw new TpmError(`version ${version} of .tpm is not known here`);
  const header = version === 1 ? terrainHeader(u16, u32, f64) : spaceHeader(f64);
  Object.assign(header, {fineError: f64(16), baseVertices: u32(92), baseTriangles: u32(96), totalSplits: u32(100)});
  const {fits, baseVertices, baseTriangles, totalSplits} = header;
  delete header.fits;
  const [crsBytes, baseBytes] = [u32(104), u32(108)];
  if (!fits || !(header.fineError >= 0) || baseVertices < 3 || baseTriangles < 1 || baseVertices + totalSplits >= 2 ** 30)
    throw new TpmError("the header of the .tpm stream makes no sense");
  if (3 * baseVertices + 3 * baseTriangles > baseBytes) throw new TpmError("the base mesh has more numbers than bytes");
  const end = HEADER + crsBytes + baseBytes;
  if (bytes.length < end) return undefined;
  header.crs = new TextDecoder().decode(bytes.subarray(HEADER, HEADER + crsBytes));
  return {header, ...readBase(bytes.subarray(HEADER + crsBytes, end), header), bytes: end};
}

function terrainHeader(u16, u32, f64) {
  const header = {
    frame: "terrain", perPost: u16(6), zStep: f64(8), cols: u32(24), rows: u32(28),
    postToCrs: [0, 1, 2, 3, 4, 5].map((i) => f64(32 + 8 * i)), zUnit: f64(80), datum: u32(88) & 255,
  };
  const {perPost, zStep, zUnit, datum} = header;
  const powerOfTwo = perPost >= 1 && perPost <= 1024 && (perPost & (perPost - 1)) === 0;
  return {...header, fits: powerOfTwo && zStep > 0 && zStep < 1e6 && zUnit > 0 && datum <= 2};
}

function spaceHeader(f64) {
  const header = {frame: "space", perUnit: f64(8), origin: [f64(32), f64(40), f64(48)]};
  const whole = header.origin.every((o) => Math.abs(o) < 2 ** 52 && o === Math.floor(o));
  return {...header, fits: header.perUnit > 0 && header.perUnit <= 1e300 && whole};
}

function readBase(bytes, {frame, baseVertices, baseTriangles}) {
  let at = 0;
  const signed = (wrong) => {
    let value = 0;
    for (let scale = 1; ; scale *= 128) {
      if (at >= bytes.length) throw new TpmError("the base mesh is not as long as the header says");
      if (scale > 2 ** 35) throw new TpmError(wrong());
      const byte = bytes[at++];
      value += (byte & 127) * scale;
      if (byte < 128) return value % 2 === 0 ? value / 2 : -(value + 1) / 2;
    }
  };
  const positions = new Int32Array(3 * baseVertices);
  const last = [0, 0, 0];
  for (let i = 0; i < positions.length; ++i) {
    const axis = i % 3;
    const wrong = () => `vertex ${(i - axis) / 3} of the base is out of range`;
    last[axis] += signed(wrong);
    if (Math.abs(last[axis]) > largestCoordinate(frame, axis)) throw new TpmError(wrong());
    positions[i] = last[axis];
  }
  const triangles = new Uint32Array(3 * baseTriangles);
  let index = 0;
  for (let i = 0; i < triangles.length; ++i) {
    const wrong = () => `triangle ${(i - (i % 3)) / 3} of the base names a vertex that is not there`;
    index += signed(wrong);
    if (index < 0 || index >= baseVertices) throw new TpmError(wrong());
    triangles[i] = index;
    if (i % 3 < 2 || frame === "space") continue;
    const [a, b, c] = [3 * triangles[i - 2], 3 * triangles[i - 1], 3 * index];
    if (!(orientation(positions[a], positions[a + 1], positions[b], positions[b + 1], positions[c], positions[c + 1]) > 0))
      throw new TpmError(`triangle ${(i - 2) / 3} of the base is not counter-clockwise`);
  }
  if (at !== bytes.length) throw new TpmError("the base mesh is not as long as the header says");
  return {positions, triangles};
}
