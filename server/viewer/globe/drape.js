// The relief of the source, or the error of the mesh, as a layer of imagery for CesiumJS. Its bytes are
// numbers (relief_tile.js); material.js makes colours of them.

import {contourInterval} from "./legend.js";
import {heightScale} from "./material.js";
import {rasterise} from "./mesh_raster.js";
import {contourTile, errorTile, reliefTile, SIDE} from "./relief_tile.js";
import {rectangleOf} from "./tiles.js";

const {Cesium} = window;

/// What CesiumJS asks of an imagery provider; `make(tile)` promises RGBA bytes of `pixels` a side. It always hears
/// of SIDE, by which it chooses the level.
function providerOf({rectangle, deepest, pixels = SIDE, make}) {
  const errorEvent = new Cesium.Event();
  return {
    rectangle, errorEvent, tileWidth: SIDE, tileHeight: SIDE, minimumLevel: 0, maximumLevel: deepest,
    tilingScheme: new Cesium.GeographicTilingScheme(), hasAlphaChannel: true,
    tileDiscardPolicy: undefined, credit: undefined, proxy: undefined,
    defaultAlpha: undefined, defaultNightAlpha: undefined, defaultDayAlpha: undefined, defaultBrightness: undefined,
    defaultContrast: undefined, defaultHue: undefined, defaultSaturation: undefined, defaultGamma: undefined,
    defaultMinificationFilter: undefined, defaultMagnificationFilter: undefined,
    getTileCredits: () => undefined,
    pickFeatures: () => undefined,
    requestImage: async (x, row, z) => ({
      width: pixels, height: pixels, arrayBufferView: await make({z, x, y: 2 ** z - 1 - row}),
    }),
  };
}

const layerOf = (options) => new Cesium.ImageryLayer(providerOf(options));

/// `finer`: by how many levels the relief is finer than the mesh that it lies on.
export const reliefLayer = (dataset, finer) => sourceLayer(dataset, finer, reliefTile);

/// The relief, with contours in place of exact heights.
export const contourLayer = (dataset, finer) => sourceLayer(dataset, finer, contourTile);

function sourceLayer(dataset, finer, tileOf) {
  const {source, drapeable: rectangle, seaLevel, shift, low, high} = dataset;
  const pixels = SIDE * 2 ** finer, heights = {seaLevel, shift, scale: heightScale(dataset), interval: contourInterval(low, high)};
  return layerOf({rectangle, deepest: Math.max(source.deepest - finer, 0), pixels,
    make: (tile) => tileOf(source, rectangleOf(tile), tile.z + finer, heights, pixels)});
}

/// The error of the very mesh that is drawn: CesiumJS asks for a picture of the same address, or, where it
/// cuts a piece from a larger mesh, of that piece.
export function errorLayer({source, drapeable: rectangle, layer}, reader, found) {
  const make = async (tile) => {
    const there = reader.existing(tile);
    const mesh = await reader.read(there);
    const scale = 2 ** (tile.z - there.z);
    const [dx, dy] = [tile.x / scale - there.x, tile.y / scale - there.y];
    const meshHeights = (xs, ys) => rasterise(mesh, xs.map((x) => dx + x / scale), ys.map((y) => dy + y / scale));
    const errors = await errorTile(source, rectangleOf(tile), tile.z, meshHeights);
    found(tile, errors);
    return errors.bytes;
  };
  return layerOf({rectangle, deepest: layer.maxzoom, make});
}
