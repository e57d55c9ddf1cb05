// The tiles that are drawn: which they are, and what is in them.

import {decodeQuantizedMesh} from "../quantized_mesh.js";
import {shared} from "./box.js";
import {patientFetch} from "./dataset.js";

const {Cesium} = window;
// What CesiumJS itself asks with, so that the browser's cache has the answer.
const ACCEPT = (extensions) => `application/vnd.quantized-mesh;extensions=${extensions},application/octet-stream;q=0.9,*/*;q=0.01`;
const MOST_MESHES = 300;

/// The degrees of a tile; rows count from the south.
export function rectangleOf({z, x, y}) {
  const side = 180 / 2 ** z;
  return {west: -180 + x * side, south: -90 + y * side, east: -180 + (x + 1) * side, north: -90 + (y + 1) * side};
}

/// Fetches and decodes tiles; the browser's cache mostly has them already.
export class TileReader {
  #meshes = new Map();

  constructor(dataset, deepest = dataset.layer.maxzoom) {
    this.dataset = dataset;
    this.deepest = Math.min(deepest, dataset.layer.maxzoom);
    const {extensions = []} = dataset.layer;
    const wanted = [["octvertexnormals", extensions.includes("octvertexnormals")],
      ["watermask", extensions.includes("watermask")], ["metadata", extensions.includes("metadata")]];
    this.accept = ACCEPT(wanted.filter(([, has]) => has).map(([name]) => name).join("-"));
  }

  has({z, x, y}) {
    const ranges = this.dataset.layer.available?.[z];
    if (z > this.deepest || (this.dataset.layer.available && !ranges)) return false;
    return !ranges || ranges.some(({startX, startY, endX, endY}) => x >= startX && x <= endX && y >= startY && y <= endY);
  }

  /// The tile itself, or the nearest above it that there is.
  existing(tile) {
    while (tile.z > 0 && !this.has(tile)) tile = {z: tile.z - 1, x: tile.x >> 1, y: tile.y >> 1};
    return tile;
  }

  read(tile) {
    const url = this.url(tile);
    if (!this.#meshes.has(url)) {
      if (this.#meshes.size >= MOST_MESHES) this.#meshes.delete(this.#meshes.keys().next().value);
      const mesh = this.#fetch(url);
      mesh.catch(() => this.#meshes.delete(url)); // may be there next time
      this.#meshes.set(url, mesh);
    }
    return this.#meshes.get(url);
  }

  url({z, x, y}) {
    const {layer, url} = this.dataset;
    return `${url}/${layer.tiles[0].replace("{version}", layer.version).replace("{z}", z).replace("{x}", x).replace("{y}", y)}`;
  }

  async #fetch(url) {
    const reply = await patientFetch(url, {headers: {Accept: this.accept}});
    if (!reply) throw new Error(`${url} is not there`);
    return decodeQuantizedMesh(await reply.arrayBuffer());
  }
}

const addressOf = ({level: z, x, y}) => ({z, x, y: 2 ** z - 1 - y});

const within = (box) => ({rectangle}) => shared(box, rectangle, 2 * Math.PI) !== undefined;

/// The addresses (TMS) of the pieces that are drawn of a dataset's rectangle, also where CesiumJS cuts them from a
/// larger mesh.
export const drawnPieces = (scene, rectangle) => scene.globe._surface._tilesToRender.filter(within(rectangle)).map(addressOf); // no public way to ask

/// The addresses (TMS) of the meshes that are drawn, each with the largest `piece` of it, a rectangle; CesiumJS
/// draws a missing child from its ancestor's.
export function drawnTiles(scene, wanted = () => true) {
  const found = new Map();
  for (let tile of scene.globe._surface._tilesToRender.filter(wanted)) {
    const piece = tile.rectangle;
    while (tile.parent && (!tile.data?.terrainData || tile.data.terrainData.wasCreatedByUpsampling())) tile = tile.parent;
    const address = addressOf(tile);
    const key = `${address.z}/${address.x}/${address.y}`;
    if (!(found.get(key)?.piece.width >= piece.width)) found.set(key, {...address, piece});
  }
  return found;
}

/// The drawn meshes of a dataset's rectangle, not of the globe around it.
export const drawnOf = (scene, rectangle) => drawnTiles(scene, within(rectangle));

/// The drawn tile at a place.
export function drawnTile(scene, place) {
  const drawn = scene.globe._surface._tilesToRender;
  let tile = drawn.find((candidate) => Cesium.Rectangle.contains(candidate.rectangle, place));
  while (tile?.parent && (!tile.data?.terrainData || tile.data.terrainData.wasCreatedByUpsampling())) tile = tile.parent;
  return tile && {...addressOf(tile), rectangle: tile.rectangle};
}
