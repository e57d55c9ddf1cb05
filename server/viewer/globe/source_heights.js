// Heights of the DEM itself, from the daemon's images for web maps (WebMercatorQuad, 512 pixels a
// tile). What is drawn is a mesh; this is what it is compared with and shaded by. Pixels are counted
// over the whole map: column 0 begins at 180 degrees west, row 0 in the north.

import {shared} from "./box.js";

export const PIXELS = 512;
const MOST_TILES = 48; // kept; 1.3 MB each
const LEAST_ACROSS = 96; // pixels: below that, its relief is hardly seen, and all posts would have to be read for it

// ---- where a pixel lies

const across = (level) => PIXELS * 2 ** level;

export const columnOf = (lon, level) => ((lon + 180) / 360) * across(level);
export const lonOf = (column, level) => (column / across(level)) * 360 - 180;

export function rowOf(lat, level) {
  const y = Math.asinh(Math.tan((lat * Math.PI) / 180));
  return (0.5 - y / (2 * Math.PI)) * across(level);
}

export function latOf(row, level) {
  const y = (0.5 - row / across(level)) * 2 * Math.PI;
  return (Math.atan(Math.sinh(y)) * 180) / Math.PI;
}

// ---- pixels

/// Metres of terrarium's colours (RGBA bytes).
export function heightsOfColours(rgba) {
  const heights = new Float32Array(rgba.length / 4);
  for (let i = 0; i < heights.length; ++i)
    heights[i] = rgba[4 * i] * 256 + rgba[4 * i + 1] + rgba[4 * i + 2] / 256 - 32768;
  return heights;
}

/// 1 where a pixel is opaque: the source has heights there.
export function knownOfShades(rgba) {
  const known = new Uint8Array(rgba.length / 4);
  for (let i = 0; i < known.length; ++i) known[i] = rgba[4 * i + 3] >= 128 ? 1 : 0;
  return known;
}

/// `load(level, x, y)` promises {heights, known} of one tile, or undefined where there is none.
export class SourceHeights {
  #load;
  #tiles = new Map(); // the least recently used first

  constructor({bounds, box, deepest, load}) {
    this.bounds = bounds; // [west, south, east, north], degrees; -180 to 180 across the antimeridian,
    this.box = box; // which {west, south, east, north} leaves on at 181
    this.deepest = deepest; // level; `coarsest` is the first worth asking for
    this.#load = load;
    this.coarsest = Math.min(deepest, Math.max(0, Math.ceil(Math.log2((LEAST_ACROSS * 360) / (box.east - box.west) / PIXELS))));
  }

  /// Heights and whether they are known, of a rectangle of pixels; NaN where there is no tile.
  async window(level, column, row, columns, rows) {
    const heights = new Float32Array(columns * rows).fill(NaN);
    const known = new Uint8Array(columns * rows);
    const pieces = [];
    for (let y = Math.floor(row / PIXELS); y * PIXELS < row + rows; ++y)
      for (let x = Math.floor(column / PIXELS); x * PIXELS < column + columns; ++x)
        pieces.push(this.#tile(level, x, y).then((tile) => tile && copy(tile, x, y)));
    await Promise.all(pieces);
    return {heights, known};

    function copy(tile, x, y) {
      const from = Math.max(column, x * PIXELS), to = Math.min(column + columns, (x + 1) * PIXELS);
      for (let r = Math.max(row, y * PIXELS); r < Math.min(row + rows, (y + 1) * PIXELS); ++r) {
        const source = (r - y * PIXELS) * PIXELS + from - x * PIXELS, target = (r - row) * columns + from - column;
        heights.set(tile.heights.subarray(source, source + to - from), target);
        known.set(tile.known.subarray(source, source + to - from), target);
      }
    }
  }

  #tile(level, x, y) {
    const tiles = 2 ** level;
    const there = x >= 0 && y >= 0 && x < tiles && y < tiles && shared(this.box, {
      west: lonOf(x * PIXELS, level), east: lonOf((x + 1) * PIXELS, level), south: latOf((y + 1) * PIXELS, level), north: latOf(y * PIXELS, level)});
    if (!there) return Promise.resolve(undefined);
    const key = `${level}/${x}/${y}`;
    const tile = this.#tiles.get(key) ?? this.#load(level, x, y);
    this.#tiles.delete(key);
    this.#tiles.set(key, tile);
    tile.catch(() => this.#tiles.delete(key)); // may be there next time
    if (this.#tiles.size > MOST_TILES) this.#tiles.delete(this.#tiles.keys().next().value);
    return tile;
  }
}
