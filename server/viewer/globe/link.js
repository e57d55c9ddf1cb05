// What a link says of a view, after the #: the camera and the looks. What is missing or nonsense is left
// out, so that an old or cut link still opens.

export const MODES = ["relief", "multi", "slope", "aspect", "contours", "error"];

const number = (text, low, high) => {
  const value = text?.trim() ? Number(text) : NaN;
  return value >= low && value <= high ? value : undefined;
};

/// {camera: {lon, lat, height, heading, pitch}, mode, exaggeration, wires, tiles, flat, sun: {azimuth, altitude},
/// beside: {dataset, level, mode}} as text; defaults are left out.
export function linkOf({camera, mode, exaggeration, wires, tiles, flat, sun, beside}) {
  const parts = [];
  if (camera) {
    const {lon, lat, height, heading, pitch} = camera;
    parts.push(`view=${lon.toFixed(6)},${lat.toFixed(6)},${height.toFixed(1)},${heading.toFixed(2)},${pitch.toFixed(2)}`);
  }
  if (mode && mode !== MODES[0]) parts.push(`mode=${mode}`);
  if (exaggeration && exaggeration !== 1) parts.push(`high=${exaggeration}`);
  if (wires) parts.push("wires");
  if (tiles) parts.push("tiles");
  if (flat) parts.push("unlit");
  if (sun && (sun.azimuth !== 315 || sun.altitude !== 38)) parts.push(`sun=${sun.azimuth},${sun.altitude}`);
  if (beside) parts.push(`beside=${encodeURIComponent(beside.dataset)},${beside.level ?? ""},${beside.mode ?? ""}`);
  return parts.join("&");
}

export function viewOf(hash) {
  const parts = new Map(hash.replace(/^#/, "").split("&").map((part) => {
    const at = part.indexOf("=");
    return at < 0 ? [part, ""] : [part.slice(0, at), part.slice(at + 1)];
  }));
  const list = (name) => (parts.get(name) ?? "").split(",");
  const [lon, lat, height, heading, pitch] = list("view");
  const camera = {lon: number(lon, -180, 180), lat: number(lat, -90, 90), height: number(height, -12000, 1e8),
    heading: number(heading, -360, 360), pitch: number(pitch, -90, 90)};
  const [azimuth, altitude] = list("sun");
  const sun = {azimuth: number(azimuth, 0, 360), altitude: number(altitude, 5, 90)};
  const [dataset, level, other] = list("beside");
  return {
    camera: Object.values(camera).includes(undefined) ? undefined : camera,
    mode: MODES.includes(parts.get("mode")) ? parts.get("mode") : MODES[0],
    exaggeration: number(parts.get("high"), 1, 5) ?? 1,
    wires: parts.has("wires"), tiles: parts.has("tiles"), flat: parts.has("unlit"),
    sun: Object.values(sun).includes(undefined) ? {azimuth: 315, altitude: 38} : sun,
    beside: dataset ? {dataset: decoded(dataset), level: number(level, 0, 30), mode: MODES.includes(other) ? other : undefined} : undefined,
  };
}

function decoded(text) {
  try {
    return decodeURIComponent(text);
  } catch {
    return text;
  }
}
