// The tiles that are drawn, as one OBJ: metres east, north and up of an origin that the file names.

import {localFrame} from "./geodesy.js";

/// tiles: [{name, rectangle: {west, south, east, north}, mesh}]; text of an OBJ, an object for each tile.
export function objOf(tiles, datum) {
  const west = Math.min(...tiles.map(({rectangle}) => rectangle.west)), east = Math.max(...tiles.map(({rectangle}) => rectangle.east));
  const south = Math.min(...tiles.map(({rectangle}) => rectangle.south)), north = Math.max(...tiles.map(({rectangle}) => rectangle.north));
  const [lon, lat] = [(west + east) / 2, (south + north) / 2];
  const local = localFrame(lon, lat, 0);
  const lines = [`# tind: metres east, north and up of longitude ${lon} latitude ${lat} height 0 (WGS84, heights: ${datum})`];
  let first = 1;
  for (const {name, rectangle: r, mesh: {u, v, h, indices, minHeight, maxHeight, metadata}} of tiles) {
    lines.push(`o ${name}`, `# max_error_m ${metadata.max_error_m ?? "not stated"}`);
    for (let i = 0; i < u.length; ++i) {
      const [east, north, up] = local(r.west + (u[i] / 32767) * (r.east - r.west), r.south + (v[i] / 32767) * (r.north - r.south), minHeight + (h[i] / 32767) * (maxHeight - minHeight));
      lines.push(`v ${east.toFixed(3)} ${north.toFixed(3)} ${up.toFixed(3)}`);
    }
    for (let i = 0; i < indices.length; i += 3) lines.push(`f ${indices[i] + first} ${indices[i + 1] + first} ${indices[i + 2] + first}`);
    first += u.length;
  }
  return lines.join("\n") + "\n";
}
