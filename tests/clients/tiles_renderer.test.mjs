// 3d-tiles-renderer (three.js) with its QuantizedMeshPlugin, in Node: it comes from the roots down to
// the finest tiles, takes more of them the nearer the camera is, and reads each one.
//
// That client takes a tile's `geometricerror` in place of what it assumes of the level. Once tind
// stated the measured error there, which does not halve from level to level: nothing but the two
// roots was ever drawn.
import assert from "node:assert/strict";
import {after, before, test} from "node:test";
import {TilesRenderer} from "3d-tiles-renderer";
import {QuantizedMeshPlugin} from "3d-tiles-renderer/plugins";
import {MathUtils, PerspectiveCamera} from "three";
import {startDaemon} from "./daemon.mjs";
import {figure} from "./figure.mjs";

// All that the client asks of a browser.
globalThis.window = globalThis;
globalThis.requestAnimationFrame = (call) => setTimeout(() => call(performance.now()), 4);
globalThis.cancelAnimationFrame = clearTimeout;

const RAINIER = {lon: -121.7603, lat: 46.8529, height: 4392};
let daemon;
before(async () => {
  daemon = await startDaemon("testdata/rainier.tif");
  globalThis.location = {href: `${daemon.origin}/`};
});
after(async () => daemon && assert.equal(await daemon.stop(), 0, daemon.said()));

function cameraAbove({lon, lat, height}, metres, ellipsoid) {
  const camera = new PerspectiveCamera(60, 1.6, 10, 3e7);
  ellipsoid.getCartographicToPosition(MathUtils.degToRad(lat), MathUtils.degToRad(lon), height + metres, camera.position);
  camera.up.set(0, 0, 1);
  camera.lookAt(0, 0, 0);
  camera.updateMatrixWorld();
  return camera;
}

/// What the client draws for a camera so high above the summit, once it has all that it wants:
/// [{level}] by tile, undefined for a quarter that it cuts out of a parent.
async function drawnFrom(metresAbove) {
  const tiles = new TilesRenderer(`${daemon.origin}/terrain/rainier/`);
  tiles.registerPlugin(new QuantizedMeshPlugin());
  const errors = [];
  tiles.addEventListener("load-error", ({error, url}) => errors.push(`${url}: ${error}`));
  const camera = cameraAbove(RAINIER, metresAbove, tiles.ellipsoid);
  tiles.setCamera(camera);
  tiles.setResolution(camera, 1280, 800);
  const deadline = Date.now() + 120000;
  for (let calm = 0; calm < 8; ) {
    assert.ok(Date.now() < deadline, `not settled: ${JSON.stringify(tiles.stats)}`);
    tiles.update();
    const {queued, downloading, parsing} = tiles.stats;
    calm = tiles.rootTileset && queued + downloading + parsing === 0 ? calm + 1 : 0;
    await new Promise((resolve) => setTimeout(resolve, 5));
  }
  assert.deepEqual(errors, []);
  const drawn = [...tiles.activeTiles].map(({content, engineData: {scene}}) => {
    const {position} = scene.geometry.attributes;
    assert.ok(scene.geometry.index.count > 0 && position.array.every(Number.isFinite), content.uri);
    return /(\d+)\/\d+\/\d+\.terrain/.exec(content.uri)?.[1];
  });
  tiles.dispose();
  return drawn.map((level) => level && Number(level));
}

test("it refines as the camera comes nearer, down to the finest tiles", async () => {
  const views = [];
  for (const metres of [3e6, 4e5, 6e4, 8e3]) views.push(await drawnFrom(metres));
  const counts = views.map((view) => view.length);
  const deepest = views.map((view) => Math.max(...view.filter((level) => level !== undefined)));
  figure("3d-tiles-renderer", `quantized-mesh: ${counts.join(", ")} tiles from four heights, down to levels ${deepest.join(", ")}`);
  for (const i of [1, 2, 3]) assert.ok(counts[i] > counts[i - 1] && deepest[i] > deepest[i - 1], `${counts}; ${deepest}`);
  assert.ok(deepest[0] >= 3, `${deepest}`);
  const layer = await (await fetch(`${daemon.origin}/terrain/rainier/layer.json`)).json();
  assert.equal(deepest.at(-1), layer.maxzoom);
});
