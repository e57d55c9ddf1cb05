// Terrain for CesiumJS out of one PMTiles file on any static server, with no daemon: the server must
// only answer requests for ranges. Without dependencies: copy this file beside your page.
//
//   import {pmtilesTerrain} from "./pmtiles_terrain.js";
//   viewer.terrainProvider = await pmtilesTerrain(Cesium, "https://example.com/alps.pmtiles");
//
// Every range is of the version of the file that was opened (If-Match, where the server names one by an
// ETag; another origin must allow that header and expose ETag): when the file is replaced, requests fail
// until the page opens it anew, and tiles of two builds are never mixed.

const HEADER_BYTES = 127;
const FIRST_BYTES = 16384; // header and root lie in them
const LEAVES_KEPT = 64;
const DEEPEST_LEAF = 4;

/// One archive that can be read by ranges.
export class TerrainArchive {
  #url;
  #etag = null;
  #leaves = new Map();

  constructor(url) {
    this.#url = url;
  }

  /// Reads header, root directory and metadata. `layer`: what layer.json of the tile set says.
  async open() {
    const first = await this.#range(0, FIRST_BYTES, true);
    this.header = readHeader(first);
    const {root, metadata} = this.header;
    this.root = readDirectory(await gunzip(first.slice(root.at, root.at + root.size)));
    const text = await gunzip(await this.#range(metadata.at, metadata.size));
    const layer = JSON.parse(new TextDecoder().decode(text))["tind:layer"];
    if (!layer) throw new Error(`${this.#url} holds no terrain that tind packed`);
    this.layer = JSON.parse(layer);
    return this;
  }

  /// The tile of CesiumJS's own address (rows from the south), unpacked; null where there is none.
  async tile(level, x, y) {
    const number = tileNumber(level + 1, x, 2 ** level - 1 - y);
    let entries = this.root;
    for (let depth = 0; depth < DEEPEST_LEAF; ++depth) {
      const entry = entryFor(entries, number);
      if (!entry) return null;
      if (entry.run > 0) {
        if (number >= entry.number + entry.run) return null;
        return gunzip(await this.#range(this.header.tiles.at + entry.at, entry.size));
      }
      entries = await this.#leaf(entry);
    }
    return null;
  }

  /// Asked for once, however many tiles wait for it; a failure is not kept.
  #leaf(entry) {
    let leaf = this.#leaves.get(entry.at);
    if (!leaf) {
      leaf = this.#range(this.header.leaves.at + entry.at, entry.size).then(gunzip).then(readDirectory);
      leaf.catch(() => this.#leaves.delete(entry.at));
    }
    this.#leaves.delete(entry.at); // and to the end: the longest unused goes first
    this.#leaves.set(entry.at, leaf);
    if (this.#leaves.size > LEAVES_KEPT) this.#leaves.delete(this.#leaves.keys().next().value);
    return leaf;
  }

  /// Exactly these bytes, or a failure; of the first ones as many as there are.
  async #range(at, size, opening = false) {
    const headers = {Range: `bytes=${at}-${at + size - 1}`};
    if (this.#etag) headers["If-Match"] = this.#etag;
    const reply = await fetch(this.#url, {headers});
    if (reply.status === 412) throw new StatusError(412, `${this.#url} is another file by now: open it anew`);
    if (reply.status !== 206)
      throw new StatusError(reply.status, `${this.#url}: status ${reply.status} to a request for a range`);
    const bytes = await reply.arrayBuffer();
    if (opening ? bytes.byteLength > size : bytes.byteLength !== size)
      throw new StatusError(502, `${this.#url}: ${bytes.byteLength} bytes instead of ${size}`);
    const etag = reply.headers.get("etag");
    if (opening && etag && !etag.startsWith("W/")) this.#etag = etag;
    if (this.#etag && etag && etag !== this.#etag) throw new StatusError(412, `${this.#url} is another file by now`);
    return bytes;
  }
}

class StatusError extends Error {
  constructor(status, message) {
    super(message);
    this.status = status;
  }
}

async function gunzip(bytes) {
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Response(stream).arrayBuffer();
}

function readHeader(bytes) {
  const view = new DataView(bytes);
  const magic = bytes.byteLength >= HEADER_BYTES ? new TextDecoder().decode(bytes.slice(0, 7)) : "";
  if (magic !== "PMTiles" || view.getUint8(7) !== 3) throw new Error("no archive of PMTiles 3");
  if (view.getUint8(97) !== 2 || view.getUint8(98) !== 2) throw new Error("an archive that is not packed with gzip");
  const number = (at) => Number(view.getBigUint64(at, true));
  const section = (at) => ({at: number(at), size: number(at + 8)});
  return {root: section(8), metadata: section(24), leaves: section(40), tiles: section(56)};
}

/// Columns of LEB128 numbers: steps of tile numbers, runs, sizes, places (0: behind the one before).
function readDirectory(bytes) {
  const data = new Uint8Array(bytes);
  let at = 0;
  const next = () => {
    let value = 0, scale = 1;
    for (;;) {
      if (at >= data.length) throw new Error("a directory that is cut off");
      const byte = data[at++];
      value += (byte & 127) * scale;
      if (byte < 128) return value;
      scale *= 128;
    }
  };
  const entries = Array.from({length: Math.min(next(), data.length)}, () => ({}));
  let number = 0;
  for (const entry of entries) entry.number = number += next();
  for (const entry of entries) entry.run = next();
  for (const entry of entries) entry.size = next();
  entries.forEach((entry, k) => {
    const place = next();
    entry.at = place > 0 ? place - 1 : entries[k - 1].at + entries[k - 1].size;
  });
  return entries;
}

/// The last entry that does not begin behind the number.
function entryFor(entries, number) {
  let first = 0, end = entries.length;
  while (first < end) {
    const middle = (first + end) >> 1;
    if (entries[middle].number <= number) first = middle + 1;
    else end = middle;
  }
  return first > 0 ? entries[first - 1] : null;
}

/// Along the Hilbert curve of its zoom, behind all tiles of those above. Exact up to zoom 26.
function tileNumber(zoom, x, y) {
  let number = (4 ** zoom - 1) / 3;
  for (let side = 2 ** (zoom - 1); side >= 1; side /= 2) {
    const right = Math.floor(x / side) % 2, down = Math.floor(y / side) % 2;
    number += side * side * ((3 * right) ^ down);
    if (down) continue;
    if (right) {
      x = side - 1 - (x % side);
      y = side - 1 - (y % side);
    }
    [x, y] = [y % side, x % side];
  }
  return number;
}

/// A CesiumTerrainProvider whose layer.json and tiles come from the archive. `options`: those of
/// CesiumTerrainProvider.fromUrl().
export async function pmtilesTerrain(Cesium, url, options = {requestVertexNormals: true}) {
  const archive = await new TerrainArchive(new URL(url, globalThis.location?.href).href).open();
  const failed = (error) => {
    throw new Cesium.RequestErrorEvent(error.status ?? 500, error.message);
  };

  class ArchiveResource extends Cesium.Resource {
    clone(result) {
      return super.clone(result ?? new ArchiveResource({url: this.url}));
    }
    fetchJson() {
      return Promise.resolve(structuredClone(archive.layer));
    }
    fetchArrayBuffer() {
      const [, level, x, y] = /(\d+)\/(\d+)\/(\d+)\.terrain/.exec(this.url).map(Number);
      return archive.tile(level, x, y).then((bytes) => bytes ?? failed({status: 404, message: "no such tile"}), failed);
    }
  }
  return Cesium.CesiumTerrainProvider.fromUrl(new ArchiveResource({url: "https://archive.invalid/"}), options);
}
