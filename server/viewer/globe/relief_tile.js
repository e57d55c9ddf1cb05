// What is draped over the mesh of a tile, as numbers in the bytes of a picture: not colours, so that
// sun, shading and scale can change without another request. Pure: heights in, bytes out.
//
// Relief: R, G: slope towards east and north (metres a metre), B: what is there, A: height.
// Contours: R, G as in the relief, B: what is there, and its height, A: where between two contours it is.
// Error:  R: mesh minus source, G: light from the north-west, B: what is there.
//
// Heights are level where the DEM's own are (shift.js), so that a sea that is level is seen as level. They are the
// source's: the mesh's would show its error, which differs from tile to tile, as if it were relief.

import {NO_SHIFT} from "./shift.js";
import {columnOf, latOf, lonOf, rowOf} from "./source_heights.js";

export const SIDE = 256; // pixels of a tile: CesiumJS then asks for the level of the mesh that it drapes
export const VOID = 0, GROUND = 128, SEA = 255; // between two of them there is a blend of them

const METRES_PER_DEGREE = 111319.49;
const MOST_DEGREES = 85; // of latitude: the images end there, and nothing is measured beyond

// ---- numbers as bytes; material.js has the way back

const SQUEEZED = 127;

/// Finer where it is flat: a step is 0.00006 there, and 0.04 at 45 degrees.
export function slopeByte(slope) {
  const steep = Math.min(Math.abs(slope) / (1 + Math.abs(slope)), 0.99);
  return 128 + Math.round(SQUEEZED * Math.sign(slope) * Math.sqrt(steep));
}

export function slopeOfByte(byte) {
  const t = (byte - 128) / SQUEEZED;
  return (Math.sign(t) * t * t) / (1 - Math.min(t * t, 0.99));
}

export const UNKNOWN_HEIGHT = 1; // a byte; 0 would hide the other three from the shader, which reads a picture's alpha
export const HEIGHT_STEPS = 253;

/// Of a scale {low, knee, top}, metres: half of the bytes lie below the knee.
export function heightByte(height, {low, knee, top}) {
  const share = height <= knee ? (0.5 * (height - low)) / Math.max(knee - low, 1e-9) : 0.5 + (0.5 * (height - knee)) / Math.max(top - knee, 1e-9);
  return UNKNOWN_HEIGHT + 1 + Math.round(HEIGHT_STEPS * Math.min(Math.max(share, 0), 1));
}

export function heightOfByte(byte, {low, knee, top}) {
  const t = (2 * (byte - UNKNOWN_HEIGHT - 1)) / HEIGHT_STEPS;
  return t < 1 ? low + t * (knee - low) : knee + (t - 1) * (top - knee);
}

// Of contours: 0 is a void, SEA the sea, and ground counts down from the lowest, so that no shore looks like a summit.
export const GROUND_LOW = 235, GROUND_HIGH = 130;

export function groundByte(height, scale) {
  return GROUND_LOW - Math.round(((GROUND_LOW - GROUND_HIGH) * (heightByte(height, scale) - UNKNOWN_HEIGHT - 1)) / HEIGHT_STEPS);
}

// Intervals above the nearest contour, the other way round at every other one. So heights between two pixels are
// exactly blends of their bytes, where a contour is, too; bytes that jump from one contour to the next would not be.
// Zero is between two bytes: level ground that is as high as a contour is not all line.
export const WAVE_STEPS = 252, WAVE_ZERO = 127.5;

export function waveByte(height, interval) {
  const lines = height / interval, nearest = Math.round(lines);
  return Math.round(WAVE_ZERO + WAVE_STEPS * (nearest % 2 === 0 ? lines - nearest : nearest - lines));
}

export const ERROR_STEP_M = 0.01;
export const ERROR_REACH = Math.log1p(1e6); // to 10 km

/// Steps of 11 %, from a centimetre to ten kilometres.
export function errorByte(metres) {
  const share = Math.min(Math.log1p(Math.abs(metres) / ERROR_STEP_M) / ERROR_REACH, 1);
  return 128 + Math.round(SQUEEZED * Math.sign(metres) * share);
}

export function errorOfByte(byte) {
  const t = (byte - 128) / SQUEEZED;
  return Math.sign(t) * ERROR_STEP_M * Math.expm1(Math.abs(t) * ERROR_REACH);
}

// ---- a lattice over the tile

const LED_BY = 2; // pixels of the source by which a void's height is told (leadOn)

/// Heights at (pixels + 2)² places: the pixels' middles and one beyond each side. A place beyond the
/// source's bounds is moved onto them.
async function lattice(source, {west, south, east, north}, level, pixels) {
  const at = Math.min(level, source.deepest);
  const [w, s, e, n] = source.bounds;
  const half = 180 / 2 ** at / 512; // of a pixel: nothing is known beyond the middle of the last
  const within = (value, low, high) => Math.min(Math.max(value, Math.min(low, (low + high) / 2)), Math.max(high, (low + high) / 2));
  const lons = [], lats = [];
  for (let i = -1; i <= pixels; ++i) {
    lons.push(within(west + ((i + 0.5) / pixels) * (east - west), w + half, e - half));
    lats.push(within(north - ((i + 0.5) / pixels) * (north - south), Math.max(s, -MOST_DEGREES) + half, Math.min(n, MOST_DEGREES) - half));
  }
  const columns = lons.map((lon) => columnOf(lon, at) - 0.5), rows = lats.map((lat) => rowOf(lat, at) - 0.5);
  const left = Math.floor(columns[0]) - LED_BY, top = Math.floor(rows[0]) - LED_BY;
  const wide = Math.floor(columns[pixels + 1]) - left + 2 + LED_BY, high = Math.floor(rows[pixels + 1]) - top + 2 + LED_BY;
  const {heights, known} = await source.window(at, left, top, wide, high);
  leadOn(heights, known, wide, high);
  return {lons, lats, columns: columns.map((c) => c - left), rows: rows.map((r) => r - top), wide, heights, known};
}

/// In a void, the pixels beside the ground get its height as it goes on: what fills them is as high as the nearest post,
/// and halves the slope of what is interpolated with it.
function leadOn(heights, known, wide, high) {
  const around = [-wide - 1, -wide, -wide + 1, -1, 1, wide - 1, wide, wide + 1];
  for (let row = LED_BY; row < high - LED_BY; ++row)
    for (let column = LED_BY; column < wide - LED_BY; ++column) {
      const at = row * wide + column;
      if (known[at]) continue;
      let sum = 0, count = 0;
      for (const by of around) {
        if (!known[at + by] || !known[at + 2 * by]) continue;
        sum += 2 * heights[at + by] - heights[at + 2 * by];
        ++count;
      }
      if (count > 0) heights[at] = sum / count;
    }
}

/// Bilinear between the pixels' middles; NaN beside a pixel that is not there.
function blend({wide, heights}, column, row) {
  const c = Math.floor(column), r = Math.floor(row), i = r * wide + c;
  const x = column - c, y = row - r;
  const top = x === 0 ? heights[i] : heights[i] * (1 - x) + heights[i + 1] * x;
  if (y === 0) return top;
  const low = x === 0 ? heights[i + wide] : heights[i + wide] * (1 - x) + heights[i + wide + 1] * x;
  return top * (1 - y) + low * y;
}

/// f(pixel, slope to the east, to the north, height, known, lon, lat) of each pixel that the images reach to, rows from the north. What fills a void is no
/// ground: beside one, slopes are those of the known side, and go on into it for a pixel, as the shader blends
/// neighbours. Else its rim would be lit as if it were level.
async function eachPixel(source, rectangle, level, pixels, f) {
  const grid = await lattice(source, rectangle, level, pixels);
  const {lons, lats, columns, rows, wide, known} = grid;
  const side = pixels + 2;
  const z = new Float64Array(side * side), there = new Uint8Array(side * side);
  for (let j = 0; j < side; ++j) for (let i = 0; i < side; ++i) {
    const at = j * side + i;
    z[at] = blend(grid, columns[i], rows[j]);
    there[at] = known[Math.round(rows[j]) * wide + Math.round(columns[i])] === 1 && Number.isFinite(z[at]) ? 1 : 0;
  }
  const rise = (before, at, after, metresBefore, metresAfter) => {
    const from = there[before] ? before : at, to = there[after] ? after : at;
    const metres = (there[before] ? metresBefore : 0) + (there[after] ? metresAfter : 0);
    return metres > 0 ? (z[to] - z[from]) / metres : 0;
  };
  const easts = new Float64Array(side * side), norths = new Float64Array(side * side);
  for (let j = 1; j <= pixels; ++j) {
    const metres = METRES_PER_DEGREE * Math.cos((lats[j] * Math.PI) / 180);
    for (let i = 1; i <= pixels; ++i) {
      const at = j * side + i;
      if (!there[at]) continue;
      easts[at] = rise(at - 1, at, at + 1, metres * (lons[i] - lons[i - 1]), metres * (lons[i + 1] - lons[i]));
      norths[at] = rise(at + side, at, at - side, METRES_PER_DEGREE * (lats[j] - lats[j + 1]), METRES_PER_DEGREE * (lats[j - 1] - lats[j]));
    }
  }
  const around = [-side - 1, -side, -side + 1, -1, 1, side - 1, side, side + 1];
  const measured = (at) => there[at] && at % side > 0 && at % side <= pixels && at > side && at < side * (pixels + 1);
  for (let j = 1; j <= pixels; ++j) {
    if (Math.abs(rectangle.north - ((j - 0.5) / pixels) * (rectangle.north - rectangle.south)) > MOST_DEGREES) continue;
    for (let i = 1; i <= pixels; ++i) {
      const at = j * side + i;
      if (!there[at]) {
        const ground = around.map((by) => at + by).filter(measured);
        for (const all of [easts, norths]) all[at] = ground.reduce((sum, other) => sum + all[other], 0) / Math.max(ground.length, 1);
      }
      f((j - 1) * pixels + i - 1, easts[at], norths[at], z[at], there[at] === 1, lons[i], lats[j]);
    }
  }
}

/// `seaLevel`: of the dataset's heights, metres; undefined where that is not known.
function kindOf(known, east, north, height, seaLevel) {
  if (!known) return VOID;
  const level = Math.abs(east) < 2e-4 && Math.abs(north) < 2e-4;
  return level && seaLevel !== undefined && Math.abs(height - seaLevel) < 4 ? SEA : GROUND;
}

/// No slope, nor a height: material.js then takes the mesh's own.
function unmeasured(bytes, kind) {
  for (let i = 0; i < bytes.length; i += 4) bytes[i] = bytes[i + 1] = 0, bytes[i + 2] = kind, bytes[i + 3] = UNKNOWN_HEIGHT;
  return bytes;
}

/// RGBA bytes of the relief in a rectangle of degrees, at a level of the source: that of a tile for SIDE pixels
/// a side, one deeper for twice as many. `scale`: of heights, as heightByte has it; `shift` of the
/// dataset.
export async function reliefTile(source, rectangle, level, {seaLevel, shift = NO_SHIFT, scale}, pixels = SIDE) {
  const bytes = unmeasured(new Uint8Array(4 * pixels * pixels), GROUND);
  if (level < source.coarsest) return bytes;
  await eachPixel(source, rectangle, level, pixels, (pixel, east, north, metres, known, lon, lat) => {
    const height = metres - shift.at(lon, lat) + shift.middle;
    bytes[4 * pixel] = slopeByte(east);
    bytes[4 * pixel + 1] = slopeByte(north);
    bytes[4 * pixel + 2] = kindOf(known, east, north, height, seaLevel);
    bytes[4 * pixel + 3] = Number.isFinite(height) ? heightByte(height, scale) : UNKNOWN_HEIGHT;
  });
  return bytes;
}

/// As reliefTile, of contours every `interval` metres of the DEM's own heights.
export async function contourTile(source, rectangle, level, {seaLevel, shift = NO_SHIFT, scale, interval}, pixels = SIDE) {
  const bytes = unmeasured(new Uint8Array(4 * pixels * pixels), GROUND);
  if (level < source.coarsest) return bytes;
  await eachPixel(source, rectangle, level, pixels, (pixel, east, north, metres, known, lon, lat) => {
    const height = metres - shift.at(lon, lat) + shift.middle;
    const kind = kindOf(known, east, north, height, seaLevel);
    bytes[4 * pixel] = slopeByte(east);
    bytes[4 * pixel + 1] = slopeByte(north);
    bytes[4 * pixel + 2] = kind === GROUND ? groundByte(height, scale) : kind;
    bytes[4 * pixel + 3] = Number.isFinite(height) ? waveByte(height - shift.middle, interval) : UNKNOWN_HEIGHT;
  });
  return bytes;
}

// ---- the error

const LIGHT = [-0.557, 0.557, 0.616]; // from the north-west, 38 degrees high

function shade(east, north) {
  return Math.max(0, (-east * LIGHT[0] - north * LIGHT[1] + LIGHT[2]) / Math.hypot(east, north, 1));
}

/// Mesh minus source at each pixel of the source's image in the rectangle: exactly there, so that no
/// interpolation counts as an error. `meshHeights(xs, ys)` are heights at a lattice of places, shares
/// of the rectangle from west and from south, both ascending; NaN where there is no mesh.
async function differences(source, {west, south, east, north}, level, meshHeights) {
  const at = Math.min(level + 1, source.deepest);
  const beside = 1; // for pixels of the tile that lie outside of the middles
  const left = Math.floor(columnOf(west, at) - 0.5) - beside, right = Math.ceil(columnOf(east, at) - 0.5) + beside;
  const top = Math.floor(rowOf(Math.min(north, MOST_DEGREES), at) - 0.5) - beside, bottom = Math.ceil(rowOf(Math.max(south, -MOST_DEGREES), at) - 0.5) + beside;
  const wide = right - left + 1, high = bottom - top + 1;
  const {heights, known} = await source.window(at, left, top, wide, high);
  const xs = Array.from({length: wide}, (_, i) => (lonOf(left + i + 0.5, at) - west) / (east - west));
  const ys = Array.from({length: high}, (_, i) => (latOf(bottom - i + 0.5, at) - south) / (north - south));
  const mesh = meshHeights(xs, ys);
  const off = new Float64Array(wide * high);
  for (let row = 0; row < high; ++row)
    for (let i = 0; i < wide; ++i)
      off[row * wide + i] = known[row * wide + i] ? mesh[(high - 1 - row) * wide + i] - heights[row * wide + i] : NaN;
  return {off, wide, high, left, top, at};
}

/// Indices of the first and the last value from 0 to 1, given in ascending order by `at`.
function inside(count, at) {
  let first = 0, last = count - 1;
  while (first < last && at(first) < 0) ++first;
  while (last > first && at(last) > 1) --last;
  return [first, last];
}

/// The largest by magnitude of those places that lie in a pixel of the tile, so that coarse levels hide
/// none; between places, a blend of them.
function pooled({off, wide, high, left, top, at}, {west, south, east, north}) {
  const pool = new Float64Array(SIDE * SIDE).fill(NaN);
  for (let row = 0; row < high; ++row) {
    const y = Math.floor(((north - latOf(top + row + 0.5, at)) / (north - south)) * SIDE);
    if (y < 0 || y >= SIDE) continue;
    for (let i = 0; i < wide; ++i) {
      const x = Math.floor(((lonOf(left + i + 0.5, at) - west) / (east - west)) * SIDE);
      if (x < 0 || x >= SIDE || Number.isNaN(off[row * wide + i])) continue;
      const old = pool[y * SIDE + x];
      if (!(Math.abs(old) >= Math.abs(off[row * wide + i]))) pool[y * SIDE + x] = off[row * wide + i];
    }
  }
  // Beside the tile there is no mesh to compare with: up to its side, the last place inside holds.
  const [w, e] = inside(wide, (i) => (lonOf(left + i + 0.5, at) - west) / (east - west));
  const [n, s] = inside(high, (j) => (north - latOf(top + j + 0.5, at)) / (north - south));
  const clamp = (value, low, most) => Math.min(Math.max(value, low), most);
  const grid = {wide, heights: off};
  for (let y = 0; y < SIDE; ++y) {
    const row = clamp(rowOf(north - ((y + 0.5) / SIDE) * (north - south), at) - 0.5 - top, n, s);
    for (let x = 0; x < SIDE; ++x) {
      if (!Number.isNaN(pool[y * SIDE + x])) continue;
      const column = clamp(columnOf(west + ((x + 0.5) / SIDE) * (east - west), at) - 0.5 - left, w, e);
      pool[y * SIDE + x] = blend(grid, column, row);
    }
  }
  return pool;
}

/// RGBA bytes of the error, the largest there is in them, metres, and how many pixels have an error of each
/// magnitude (of errorByte - 128), so that a scale can leave out the few that stick out.
export async function errorTile(source, rectangle, level, meshHeights) {
  if (level < source.coarsest) return {bytes: unmeasured(new Uint8Array(4 * SIDE * SIDE), VOID), largest: 0, counts: new Uint32Array(SQUEEZED + 1)};
  const errors = pooled(await differences(source, rectangle, level, meshHeights), rectangle);
  const bytes = unmeasured(new Uint8Array(4 * SIDE * SIDE), VOID);
  const counts = new Uint32Array(SQUEEZED + 1);
  let largest = 0;
  await eachPixel(source, rectangle, level, SIDE, (pixel, east, north) => {
    const off = errors[pixel];
    const there = Number.isFinite(off);
    bytes[4 * pixel] = there ? errorByte(off) : 128;
    bytes[4 * pixel + 1] = Math.round(255 * shade(east, north));
    bytes[4 * pixel + 2] = there ? GROUND : VOID;
    bytes[4 * pixel + 3] = 255;
    if (!there) return;
    largest = Math.max(largest, Math.abs(off));
    ++counts[Math.abs(bytes[4 * pixel] - 128)];
  });
  return {bytes, largest, counts};
}

/// {reach, largest} of several tiles, metres: `share` of all pixels have no larger error than `reach`; undefined while
/// no pixel has been measured.
export function errorScale(tiles, share = 0.98) {
  const sum = new Float64Array(SQUEEZED + 1);
  for (const {counts} of tiles) counts.forEach((count, i) => (sum[i] += count));
  const all = sum.reduce((total, count) => total + count, 0), wanted = share * all;
  if (all === 0) return undefined;
  let below = 0, at = 0;
  while (at < SQUEEZED && (below += sum[at]) < wanted) ++at;
  return {reach: Math.max(errorOfByte(128 + at), ERROR_STEP_M), largest: Math.max(0, ...tiles.map(({largest}) => largest))};
}
