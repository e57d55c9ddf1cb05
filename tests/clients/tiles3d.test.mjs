// 3D Tiles in clients that nobody here wrote, in Node, as they are and compressed by meshopt: the
// Khronos validator and meshoptimizer's decoder over every content, 3d-tiles-renderer (three.js) with
// its ImplicitTilingPlugin, loaders.gl. CesiumJS: tiles3d_cesium.
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
import {GLTFExtensionsPlugin, ImplicitTilingPlugin} from "3d-tiles-renderer/plugins";
import {MeshoptDecoder} from "meshoptimizer";
import {MathUtils, PerspectiveCamera} from "three";
import {PROGRAM, ROOT, startDaemon} from "./daemon.mjs";
import {figure} from "./figure.mjs";
import {decodeGlb} from "./glb.mjs";

const {validateBytes} = createRequire(import.meta.url)("gltf-validator");

// All that three.js asks of a browser.
globalThis.window = globalThis;
globalThis.self = globalThis;
globalThis.requestAnimationFrame = (call) => setTimeout(() => call(performance.now()), 4);
globalThis.cancelAnimationFrame = clearTimeout;

const DEM = "testdata/rainier.tif";
/// What a tileset is called, below /3dtiles/{dataset}/, and the folder that the batch puts it in.
const SETS = {plain: {path: "", folder: "3dtiles"}, meshopt: {path: "meshopt/", folder: "3dtiles-meshopt"}};
const SUMMIT = {lon: -121.7603, lat: 46.8529, height: 4392};
let folder, daemon, names;

before(async () => {
  folder = mkdtempSync(join(tmpdir(), "tind-"));
  for (const compression of ["none", "meshopt"])
    execFileSync(PROGRAM, ["build", DEM, "-o", join(folder, "built"), "--format", "3dtiles", "--compression", compression, "--progress", "none"], {cwd: ROOT, stdio: "ignore"});
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

for (const [name, set] of Object.entries(SETS)) {
  test(`${name}: the daemon gives the bytes of the batch, from the DEM and from the folder`, async () => {
    const files = names.filter((file) => /\.(glb|subtree|json)$/.test(file) && !file.includes("tind-"));
    assert.ok(files.length > 190, `${files.length}`);
    for (const file of files) {
      const built = new Uint8Array(readFileSync(join(folder, "built", set.folder, file)));
      assert.deepEqual(await bytesOf(`built/${set.path}${file}`), built, file);
      assert.deepEqual(await bytesOf(`rainier/${set.path}${file}`), built, file);
    }
  });

  test(`${name}: every content is valid glTF`, async () => {
    const contents = names.filter((file) => file.endsWith(".glb"));
    let triangles = 0, bytes = 0;
    for (const file of contents) {
      const content = await bytesOf(`rainier/${set.path}${file}`);
      const {issues, info} = await validateBytes(content);
      assert.equal(issues.numErrors + issues.numWarnings, 0, `${file}: ${JSON.stringify(issues.messages.slice(0, 3))}`);
      triangles += info.totalTriangleCount;
      bytes += content.length;
    }
    figure("gltf-validator", `3D Tiles: ${contents.length} contents (${name}), ${bytes} bytes, ${triangles} triangles, 0 errors, 0 warnings`);
    assert.equal(contents.length, 174);
  });

  test(`${name}: neighbours have the same bits on their common edges, as meshoptimizer decodes them`, async () => {
    const found = await sharedEdges(set);
    figure("meshoptimizer", `3D Tiles: ${found.contents} contents (${name}), ${found.edges} shared edges, ${found.vertices} vertices on them, ${found.different} differ`);
    assert.equal(found.contents, 174);
    assert.ok(found.edges > 200 && found.vertices > 4000, JSON.stringify(found));
    assert.equal(found.different, 0);
  });
}

test("compressed, a content is the same mesh on a coarser lattice", async () => {
  let plainBytes = 0, packedBytes = 0, triangles = 0;
  for (const file of names.filter((name) => name.endsWith(".glb"))) {
    const [a, b] = [await bytesOf(`rainier/${file}`), await bytesOf(`rainier/meshopt/${file}`)];
    const plain = await decodeGlb(a), packed = await decodeGlb(b);
    const level = Number(/\/(\d+)\//.exec(file)[1]);
    plainBytes += a.length;
    packedBytes += b.length;
    for (const k of [0, 1]) {
      const [p, q] = [plain.primitives[k], packed.primitives[k]];
      assert.equal(p.positions.length, q.positions.length);
      if (k === 0) // walls hang as deep as these contents need
        p.positions.forEach((place, i) => assert.ok(Math.hypot(...place.map((x, j) => x - q.positions[i][j])) <= 512 / 2 ** level, file));
      assert.deepEqual(cornersOf(p.indices), cornersOf(q.indices), file);
      triangles += p.indices.length / 3;
    }
    assert.deepEqual(plain.primitives[0].edges, packed.primitives[0].edges, file);
    assert.ok(packed.node.extras.max_error_m >= packed.node.extras.rounding_m, file);
  }
  console.log(`meshopt: ${triangles} triangles as they were, ${((100 * packedBytes) / plainBytes).toFixed(0)} % of the bytes`);
  assert.ok(packedBytes < 0.4 * plainBytes, `${packedBytes} of ${plainBytes}`);
});

/// Triangles with their least corner first: the codec may turn them.
function cornersOf(indices) {
  const turned = [];
  for (let i = 0; i < indices.length; i += 3) {
    const t = indices.slice(i, i + 3), first = t.indexOf(Math.min(...t));
    turned.push([t[first], t[(first + 1) % 3], t[(first + 2) % 3]]);
  }
  return turned;
}

/// Every tile beside the next one east and north, by the vertices that CESIUM_tile_edges names.
async function sharedEdges({path}) {
  const sides = new Map(), found = {contents: 0, edges: 0, vertices: 0, different: 0};
  for (const file of names.filter((name) => name.endsWith(".glb"))) {
    const [, hemisphere, level, x, y] = /(west|east)\/(\d+)\/(\d+)\/(\d+)/.exec(file);
    const {primitives: [{positions, edges}]} = await decodeGlb(await bytesOf(`rainier/${path}${file}`));
    const line = (side) => edges[side].map((i) => positions[i].join(" ")).sort();
    const column = Number(x) + (hemisphere === "east" ? 2 ** level : 0);
    sides.set(`${level}/${column}/${y}`, {west: line("left"), south: line("bottom"), east: line("right"), north: line("top")});
    ++found.contents;
  }
  const compare = (a, b) => {
    ++found.edges;
    found.vertices += a.length;
    found.different += a.filter((place) => !b.includes(place)).length + b.filter((place) => !a.includes(place)).length;
  };
  for (const [tile, {east, north}] of sides) {
    const [level, x, y] = tile.split("/").map(Number);
    const right = sides.get(`${level}/${x + 1}/${y}`), above = sides.get(`${level}/${x}/${y + 1}`);
    if (right) compare(east, right.west);
    if (above) compare(north, above.south);
  }
  return found;
}

/// [{level, x, y}] of the contents that 3d-tiles-renderer draws from so high above the summit.
async function drawnFrom(metresAbove, {path}) {
  const tiles = new TilesRenderer(`${daemon.origin}/3dtiles/rainier/${path}tileset.json`);
  tiles.registerPlugin(new GLTFExtensionsPlugin({meshoptDecoder: MeshoptDecoder}));
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

for (const [name, set] of Object.entries(SETS)) test(`${name}: 3d-tiles-renderer refines as the camera comes nearer, down to the finest tiles`, async () => {
  const views = [];
  for (const metres of [3e6, 4e5, 6e4, 8e3]) views.push(await drawnFrom(metres, set));
  const counts = views.map((view) => view.length), deepest = views.map((view) => Math.max(...view));
  figure("3d-tiles-renderer", `3D Tiles (${name}): ${counts.join(", ")} tiles from four heights, down to levels ${deepest.join(", ")}`);
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
  figure("@loaders.gl/3d-tiles", `3D Tiles: ${count} tiles, down to level ${deepest}`);
  assert.equal(count, 174);
  assert.equal(deepest, 12);
});
