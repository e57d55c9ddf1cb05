// 3D Tiles in clients that nobody here wrote, in Node: the Khronos validator over every content,
// 3d-tiles-renderer (three.js) with its ImplicitTilingPlugin, loaders.gl. CesiumJS: tiles3d_cesium.
import assert from "node:assert/strict";
import {createRequire} from "node:module";
import {execFileSync} from "node:child_process";
import {mkdtempSync, readFileSync, readdirSync, rmSync} from "node:fs";
import {tmpdir} from "node:os";
import {join} from "node:path";
import {after, before, test} from "node:test";
import {load} from "@loaders.gl/core";
import {Tiles3DLoader} from "@loaders.gl/3d-tiles";
import {TilesRenderer} from "3d-tiles-renderer";
import {ImplicitTilingPlugin} from "3d-tiles-renderer/plugins";
import {MathUtils, PerspectiveCamera} from "three";
import {PROGRAM, ROOT, startDaemon} from "./daemon.mjs";

const {validateBytes} = createRequire(import.meta.url)("gltf-validator");

// All that three.js asks of a browser.
globalThis.window = globalThis;
globalThis.self = globalThis;
globalThis.requestAnimationFrame = (call) => setTimeout(() => call(performance.now()), 4);
globalThis.cancelAnimationFrame = clearTimeout;

const DEM = "testdata/rainier.tif";
const SUMMIT = {lon: -121.7603, lat: 46.8529, height: 4392};
let folder, daemon, names;

before(async () => {
  folder = mkdtempSync(join(tmpdir(), "tind-"));
  execFileSync(PROGRAM, ["build", DEM, "-o", join(folder, "built"), "--format", "3dtiles", "--progress", "none"], {cwd: ROOT, stdio: "ignore"});
  names = readdirSync(join(folder, "built/3dtiles"), {recursive: true});
  daemon = await startDaemon(DEM, join(folder, "built"));
  globalThis.location = {href: `${daemon.origin}/`};
});

after(async () => {
  if (daemon) assert.equal(await daemon.stop(), 0, daemon.said());
  rmSync(folder, {recursive: true, force: true});
});

const bytesOf = async (path) => {
  const reply = await fetch(`${daemon.origin}/3dtiles/${path}`);
  assert.equal(reply.status, 200, path);
  return new Uint8Array(await reply.arrayBuffer());
};

test("the daemon gives the bytes of the batch, from the DEM and from the folder", async () => {
  const files = names.filter((name) => /\.(glb|subtree|json)$/.test(name) && !name.includes("tind-"));
  assert.ok(files.length > 190, `${files.length}`);
  for (const name of files) {
    const built = new Uint8Array(readFileSync(join(folder, "built/3dtiles", name)));
    assert.deepEqual(await bytesOf(`built/${name}`), built, name);
    assert.deepEqual(await bytesOf(`rainier/${name}`), built, name);
  }
});

test("every content is valid glTF", async () => {
  const contents = names.filter((name) => name.endsWith(".glb"));
  let triangles = 0;
  for (const name of contents) {
    const {issues, info} = await validateBytes(await bytesOf(`rainier/${name}`));
    assert.equal(issues.numErrors + issues.numWarnings, 0, `${name}: ${JSON.stringify(issues.messages.slice(0, 3))}`);
    triangles += info.totalTriangleCount;
  }
  console.log(`gltf-validator: ${contents.length} contents, ${triangles} triangles, 0 errors, 0 warnings`);
  assert.equal(contents.length, 174);
});

/// [{level, x, y}] of the contents that 3d-tiles-renderer draws from so high above the summit.
async function drawnFrom(metresAbove) {
  const tiles = new TilesRenderer(`${daemon.origin}/3dtiles/rainier/tileset.json`);
  tiles.registerPlugin(new ImplicitTilingPlugin());
  tiles.errorTarget = 2; // pixels, as globes have it
  const wrong = [];
  tiles.addEventListener("load-error", ({error, url}) => wrong.push(`${url}: ${error}`));
  const camera = new PerspectiveCamera(60, 1.6, 10, 3e7);
  const {lon, lat, height} = SUMMIT;
  tiles.ellipsoid.getCartographicToPosition(MathUtils.degToRad(lat), MathUtils.degToRad(lon), height + metresAbove, camera.position);
  camera.up.set(0, 0, 1);
  camera.lookAt(0, 0, 0);
  camera.updateMatrixWorld();
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
  assert.deepEqual(wrong, []);
  const drawn = [...tiles.activeTiles].map(({content, engineData: {scene}}) => {
    let meshes = 0;
    scene.traverse((node) => {
      if (!node.isMesh) return;
      ++meshes;
      assert.ok(node.geometry.index.count > 0 && node.geometry.attributes.position.array.every(Number.isFinite));
    });
    assert.equal(meshes, 2, "the surface and its walls");
    return Number(/(\d+)\/\d+\/\d+\.glb/.exec(content.uri)[1]);
  });
  tiles.dispose();
  return drawn;
}

test("3d-tiles-renderer refines as the camera comes nearer, down to the finest tiles", async () => {
  const views = [];
  for (const metres of [3e6, 4e5, 6e4, 8e3]) views.push(await drawnFrom(metres));
  const counts = views.map((view) => view.length), deepest = views.map((view) => Math.max(...view));
  console.log(`3d-tiles-renderer: ${counts} tiles, down to levels ${deepest}`);
  for (const i of [1, 2, 3]) assert.ok(counts[i] >= counts[i - 1] && deepest[i] > deepest[i - 1], `${counts}; ${deepest}`);
  const layer = await (await fetch(`${daemon.origin}/terrain/rainier/layer.json`)).json();
  assert.equal(deepest.at(-1), layer.maxzoom);
});

test("loaders.gl reads the tileset, its subtrees and contents", async () => {
  const tileset = await load(`${daemon.origin}/3dtiles/rainier/tileset.json`, Tiles3DLoader, {"3d-tiles": {loadGLTF: false}});
  let count = 0, deepest = 0;
  const visit = (tile, level) => {
    if (tile.contentUrl) ++count, (deepest = Math.max(deepest, Number(/(\d+)\/\d+\/\d+\.glb/.exec(tile.contentUrl)[1])));
    for (const child of tile.children ?? []) visit(child, level + 1);
  };
  visit(tileset.root, 0);
  console.log(`loaders.gl: ${count} tiles, down to level ${deepest}`);
  assert.equal(count, 174);
  assert.equal(deepest, 12);
});
