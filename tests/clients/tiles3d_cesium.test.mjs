// 3D Tiles in CesiumJS in Chromium, as they are and compressed by meshopt, as terrain (Cesium3DTilesTerrainProvider) and as a tileset
// (Cesium3DTileset): all that it asks for is there, heights are those of the same tiles as
// quantized-mesh, and the mountain is seen.
import assert from "node:assert/strict";
import {mkdirSync, mkdtempSync, rmSync, writeFileSync} from "node:fs";
import {tmpdir} from "node:os";
import {join} from "node:path";
import {after, before, test} from "node:test";
import {openBrowser, openPage} from "./browser.mjs";
import {openCesiumPage} from "./cesium_page.mjs";
import {ROOT, startDaemon} from "./daemon.mjs";
import {figure} from "./figure.mjs";

const LAKE = [[-121.86, 46.72], [-121.63, 46.72], [-121.63, 46.87], [-121.86, 46.87], [-121.86, 46.72]];
let folder, daemon, browser, page, complaints;

before(async () => {
  folder = mkdtempSync(join(tmpdir(), "tind-"));
  writeFileSync(join(folder, "lake.geojson"), JSON.stringify({type: "Polygon", coordinates: [LAKE]}));
  writeFileSync(join(folder, "config.toml"),
    `[[dataset]]\nname = "rainier"\nfiles = ["${ROOT}/testdata/rainier.tif"]\nfrom_datum = "egm96"\nto_datum = "ellipsoid"\nwater = ["lake.geojson"]\n`);
  daemon = await startDaemon("--config", join(folder, "config.toml"));
  browser = await openBrowser();
  ({page, complaints} = await openPage(browser, daemon.origin, {width: 640, height: 410}));
  await openCesiumPage(page, daemon.origin);
  await page.evaluate(() => {
    window.said = [];
    const log = console.log;
    console.log = (...words) => (window.said.push(words.join(" ")), log(...words));
    window.widget = new Cesium.CesiumWidget("globe", {baseLayer: false, contextOptions: {webgl: {preserveDrawingBuffer: true}}, requestRenderMode: false, msaaSamples: 1});
    widget.scene.skyBox = undefined;
    widget.scene.skyAtmosphere = undefined;
    widget.scene.globe.baseColor = Cesium.Color.fromCssColorString("#c9b99a");
    widget.scene.globe.enableLighting = true;
    widget.clock.currentTime = Cesium.JulianDate.fromIso8601("2026-06-21T16:30:00Z");
    widget.camera.setView({
      destination: Cesium.Cartesian3.fromDegrees(-121.76, 46.65, 9000),
      orientation: {heading: 0, pitch: Cesium.Math.toRadians(-18), roll: 0},
    });
  });
});

after(async () => {
  await browser?.close();
  if (daemon) assert.equal(await daemon.stop(), 0, daemon.said());
  rmSync(folder, {recursive: true, force: true});
});

/// Mean step of luminance between neighbours in the lower half of the picture: 0 for a flat colour.
const texture = () => page.evaluate(() => {
  widget.scene.render(widget.clock.currentTime);  // without a time it is lit as now, at night not at all
  const small = Object.assign(document.createElement("canvas"), {width: 160, height: 100});
  const pen = small.getContext("2d");
  pen.drawImage(widget.scene.canvas, 0, 0, 160, 100);
  const {data} = pen.getImageData(0, 50, 160, 50);
  const light = (i) => 0.3 * data[4 * i] + 0.6 * data[4 * i + 1] + 0.1 * data[4 * i + 2];
  let sum = 0;
  for (let i = 0; i < 160 * 50 - 1; ++i) sum += Math.abs(light(i + 1) - light(i));
  return sum / (160 * 50);
});

const shot = async (name) => {
  mkdirSync(`${ROOT}/build/shots`, {recursive: true});
  await page.screenshot({path: `${ROOT}/build/shots/${name}.png`});
};

/// Below /3dtiles/rainier/, and how far heights may be from those of the quantized mesh: on the
/// finest level, half a cell of the lattice on steep ground.
const SETS = {plain: {path: "", most: 0.5}, meshopt: {path: "meshopt/", most: 1}};

for (const [name, {path, most}] of Object.entries(SETS)) test(`${name}: as terrain it has the heights of the quantized mesh, and is seen`, async () => {
  const found = await page.evaluate(async (path) => {
    window.calm = 0;
    widget.scene.globe.show = true;
    const tiles3d = await Cesium.Cesium3DTilesTerrainProvider.fromUrl(`/3dtiles/rainier/${path}tileset.json`, {requestVertexNormals: true});
    const mesh = await Cesium.CesiumTerrainProvider.fromUrl("/terrain/rainier", {requestVertexNormals: true});
    const places = () => Array.from({length: 400}, (_, i) => Cesium.Cartographic.fromDegrees(-121.97 + 0.46 * ((i * 0.618034) % 1), 46.61 + 0.38 * (i / 400)));
    // Each sampled tile asks for its subtree, those above before those below.
    for (const level of [0, 3, 6, 9, 12]) await Cesium.sampleTerrain(tiles3d, level, places().slice(0, 1));
    const a = await Cesium.sampleTerrain(tiles3d, 12, places()), b = await Cesium.sampleTerrain(mesh, 12, places());
    widget.terrainProvider = tiles3d;
    const offs = a.map((place, i) => Math.abs(place.height - b[i].height));
    return {undefineds: a.filter(({height}) => height === undefined).length, most: Math.max(...offs), level: tiles3d.availability.computeMaximumLevelAtPosition(a[0])};
  }, path);
  figure("cesium", `Cesium3DTilesTerrainProvider (${name}): 400 heights, ${found.undefineds} missing, at most ${found.most.toFixed(3)} m from those of the quantized mesh`);
  assert.equal(found.undefineds, 0);
  assert.equal(found.level, 12);
  assert.ok(found.most < most, `${found.most} m`);
  await page.waitForFunction(() => widget.scene.globe.tilesLoaded && (window.calm = (window.calm ?? 0) + 1) > 10, undefined, {timeout: 240000, polling: 150});
  await shot(`3dtiles_terrain_${name}`);
  assert.ok((await texture()) > 2, `${await texture()}`);
  assert.deepEqual(complaints, []);
  assert.deepEqual((await page.evaluate(() => said)).filter((line) => /Could not/.test(line)), []);
});

for (const [name, {path}] of Object.entries(SETS)) test(`${name}: its water mask is that of the quantized mesh, cell by cell`, async () => {
  const found = await page.evaluate(async (path) => {
    const options = {requestWaterMask: true};
    const tiles3d = await Cesium.Cesium3DTilesTerrainProvider.fromUrl(`/3dtiles/rainier/${path}tileset.json`, options);
    const mesh = await Cesium.CesiumTerrainProvider.fromUrl("/terrain/rainier", options);
    const grey = (image) => {
      const pen = Object.assign(document.createElement("canvas"), {width: image.width, height: image.height}).getContext("2d");
      pen.drawImage(image, 0, 0);
      return pen.getImageData(0, 0, image.width, image.height).data.filter((_, i) => i % 4 === 0);
    };
    const counts = {tiles: 0, pixels: 0, wet: 0, off: 0};
    for (const [lon, lat] of [[-121.86, 46.87], [-121.7, 46.8], [-121.55, 46.95]]) {
      for (let level = 0; level <= 12; ++level) {
        const {x, y} = tiles3d.tilingScheme.positionToTileXY(Cesium.Cartographic.fromDegrees(lon, lat), level);
        const [a, b] = [await tiles3d.requestTileGeometry(x, y, level), await mesh.requestTileGeometry(x, y, level)];
        const pixels = grey(a.waterMask), wanted = b.waterMask;
        if (pixels.length !== wanted.length) throw new Error(`${level}/${x}/${y}: ${pixels.length} pixels, not ${wanted.length}`);
        ++counts.tiles;
        wanted.forEach((value, i) => (++counts.pixels, (counts.wet += value > 0), (counts.off += pixels[i] !== value)));
      }
    }
    return counts;
  }, path);
  figure("cesium", `Cesium3DTilesTerrainProvider (${name}): water masks of ${found.tiles} tiles, ${found.pixels} cells, ${found.wet} wet, ${found.off} other than the quantized mesh's`);
  assert.equal(found.tiles, 39);
  assert.equal(found.off, 0);
  assert.ok(found.wet > 1000 && found.wet < found.pixels);
});

for (const [name, {path}] of Object.entries(SETS)) test(`${name}: as a tileset it draws the finest tiles it wants, by their measured errors`, async () => {
  const found = await page.evaluate(async (path) => {
    widget.scene.globe.show = false;
    widget.scene.primitives.removeAll();
    widget.terrainProvider = new Cesium.EllipsoidTerrainProvider();
    const tileset = await Cesium.Cesium3DTileset.fromUrl(`/3dtiles/rainier/${path}tileset.json`, {maximumScreenSpaceError: 1});
    const failed = [], errors = new Map();
    let contents = 0;
    tileset.tileFailed.addEventListener(({url, message}) => failed.push(`${url}: ${message}`));
    tileset.tileLoad.addEventListener((tile) => (++contents, errors.set(tile._header.contents?.[0]?.uri ?? tile._contentResource?.url, tile.geometricError)));
    widget.scene.primitives.add(tileset);
    await new Promise((resolve) => tileset.allTilesLoaded.addEventListener(resolve));
    const drawn = tileset._selectedTiles.map((tile) => [tile._contentResource.url.match(/(\d+)\/\d+\/\d+\.glb/)[1], tile.geometricError]);
    return {failed, contents, drawn};
  }, path);
  const deepest = Math.max(...found.drawn.map(([level]) => Number(level)));
  figure("cesium", `Cesium3DTileset (${name}): ${found.contents} contents, ${found.drawn.length} drawn, down to level ${deepest}`);
  assert.deepEqual(found.failed, []);
  assert.equal(deepest, 12);
  // Not the level's nominal one, which halves from the root: what was measured.
  assert.ok(found.drawn.some(([level, error]) => error !== 77067.33965563798 / 2 ** level));
  await page.evaluate(() => new Promise((resolve) => setTimeout(resolve, 1500)));
  await shot(`3dtiles_tileset_${name}`);
  assert.ok((await texture()) > 2, `${await texture()}`);
  assert.deepEqual(complaints, []);
});
