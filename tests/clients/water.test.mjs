// The water mask, as clients read it: a decoder of somebody else's, and CesiumJS in a browser.
import assert from "node:assert/strict";
import {createRequire} from "node:module";
import {mkdtempSync, rmSync, writeFileSync} from "node:fs";
import {execFileSync} from "node:child_process";
import {tmpdir} from "node:os";
import {join} from "node:path";
import {after, before, test} from "node:test";
import {openBrowser, openPage, settled} from "./browser.mjs";
import {PROGRAM, ROOT, startDaemon} from "./daemon.mjs";

const decode = createRequire(import.meta.url)("@here/quantized-mesh-decoder").default;
const DEM = "testdata/rainier.tif";
const ACCEPT = {accept: "application/vnd.quantized-mesh;extensions=octvertexnormals-watermask-metadata,*/*;q=0.01"};
let folder, daemon, layer, lake;

const json = async (path) => (await fetch(daemon.origin + path)).json();
const tile = async (z, x, y, headers = ACCEPT) => {
  const reply = await fetch(`${daemon.origin}/terrain/lake/${z}/${x}/${y}.terrain`, {headers});
  assert.equal(reply.status, 200, `${z}/${x}/${y}`);
  return decode(await reply.arrayBuffer());
};

before(async () => {
  folder = mkdtempSync(join(tmpdir(), "tind-"));
  const [west, south, east, north] = JSON.parse(execFileSync(PROGRAM, ["info", DEM, "--json"], {cwd: ROOT})).bounds;
  const at = (x, y) => [west + x * (east - west), south + y * (north - south)];
  lake = [at(0.3, 0.3), at(0.7, 0.3), at(0.7, 0.7), at(0.3, 0.7), at(0.3, 0.3)];
  writeFileSync(join(folder, "lake.geojson"), JSON.stringify({type: "Polygon", coordinates: [lake]}));
  writeFileSync(join(folder, "config.toml"),
    `[[dataset]]\nname = "lake"\nfiles = ["${ROOT}/${DEM}"]\nflatten = ["lake.geojson"]\nwater = ["lake.geojson"]\n`);
  daemon = await startDaemon("--config", join(folder, "config.toml"));
  layer = await json("/terrain/lake/layer.json");
});

after(async () => {
  if (daemon) assert.equal(await daemon.stop(), 0, daemon.said());
  rmSync(folder, {recursive: true, force: true});
});

/// Longitude and latitude of a cell's middle.
const place = (z, x, y, row, col) => {
  const side = 180 / 2 ** z;
  return [-180 + (x + (col + 0.5) / 256) * side, -90 + (y + 1 - (row + 0.5) / 256) * side];
};

test("layer.json offers it, and a tile has it only when it is asked for", async () => {
  assert.deepEqual(layer.extensions, ["octvertexnormals", "watermask", "metadata"]);
  assert.equal((await tile(0, 0, 0, {})).extensions.waterMask, undefined);
  assert.ok((await tile(0, 0, 0)).extensions.waterMask);
});

test("every cell is what the polygon says, and the lake is level", async () => {
  const [west, south] = lake[0], [east, north] = lake[2];
  let wet = 0, dry = 0, level = 0;
  for (let z = 0; z <= layer.maxzoom; ++z) {
    for (const {startX, startY, endX, endY} of layer.available[z]) {
      for (let x = startX; x <= endX; ++x) for (let y = startY; y <= endY; ++y) {
        const decoded = await tile(z, x, y);
        const mask = new Uint8Array(decoded.extensions.waterMask.flat ? decoded.extensions.waterMask.flat() : decoded.extensions.waterMask);
        assert.ok(mask.length === 1 || mask.length === 65536);
        const cell = 180 / 2 ** z / 256;
        for (let row = 3; row < 256; row += 10) for (let col = 5; col < 256; col += 10) {
          const [lon, lat] = place(z, x, y, row, col);
          const far = Math.min(Math.abs(lon - west), Math.abs(lon - east), Math.abs(lat - south), Math.abs(lat - north));
          if (far < cell) continue;
          const inside = lon > west && lon < east && lat > south && lat < north;
          assert.equal(mask[mask.length === 1 ? 0 : row * 256 + col], inside ? 255 : 0, `${z}/${x}/${y} ${row} ${col}`);
          inside ? ++wet : ++dry;
        }
        // Vertices inside the lake all have one height.
        const {minHeight, maxHeight} = decoded.header, n = decoded.vertexData.length / 3;
        const heights = new Set();
        for (let i = 0; i < n; ++i) {
          const lon = -180 + (x + decoded.vertexData[i] / 32767) * 180 / 2 ** z;
          const lat = -90 + (y + decoded.vertexData[n + i] / 32767) * 180 / 2 ** z;
          if (lon > west + cell && lon < east - cell && lat > south + cell && lat < north - cell)
            heights.add(Math.round((minHeight + decoded.vertexData[2 * n + i] / 32767 * (maxHeight - minHeight)) * 100));
        }
        assert.ok(heights.size <= 1, `${z}/${x}/${y}: ${[...heights]}`);
        level += heights.size;
      }
    }
  }
  assert.ok(wet > 1000 && dry > 1000 && level > 0, `${wet} ${dry} ${level}`);
});

/// In the page: looks straight down on the lake, the ground plain, with and without what CesiumJS does to
/// water; by place how far the colour of its pixel (all three channels) is from the one without.
const drawnOn = async (places) => {
  const {Cesium} = window, {scene} = window.tind.widget, {globe, camera, canvas} = scene;
  globe.material = undefined; // the viewer's own covers the water
  globe.baseColor = Cesium.Color.fromCssColorString("#5b6b4a"); // water is brighter: there must be room above
  scene.skyAtmosphere.show = false;
  const [west, south, east, north] = [0, 1, 0, 1].map((k, i) => (i < 2 ? Math.min : Math.max)(...places.map((p) => p[k])));
  camera.setView({destination: Cesium.Rectangle.fromDegrees(west, south, east, north)});
  const frame = async (water) => {
    globe.showWaterEffect = water;
    for (let calm = 0; calm < 4; calm = globe.tilesLoaded ? calm + 1 : 0) {
      scene.requestRender();
      await new Promise((resolve) => requestAnimationFrame(() => requestAnimationFrame(resolve)));
    }
    scene.requestRender();
    scene.render(); // pixels are there until the task ends
    const gl = scene.context._gl, pixels = new Uint8Array(4 * gl.drawingBufferWidth * gl.drawingBufferHeight);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.readPixels(0, 0, gl.drawingBufferWidth, gl.drawingBufferHeight, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
    return {pixels, width: gl.drawingBufferWidth, height: gl.drawingBufferHeight};
  };
  const plain = await frame(false), wet = await frame(true);
  return places.map(([lon, lat]) => {
    const place = Cesium.Cartographic.fromDegrees(lon, lat);
    const at = Cesium.SceneTransforms.worldToWindowCoordinates(scene,
      Cesium.Cartesian3.fromRadians(place.longitude, place.latitude, globe.getHeight(place) ?? 0));
    const x = Math.floor(at.x / canvas.clientWidth * wet.width), y = Math.floor((1 - at.y / canvas.clientHeight) * wet.height);
    if (x < 0 || y < 0 || x >= wet.width || y >= wet.height) return null;
    return [0, 1, 2].reduce((sum, c) => sum + Math.abs(wet.pixels[4 * (y * wet.width + x) + c] - plain.pixels[4 * (y * wet.width + x) + c]), 0);
  });
};

test("CesiumJS draws water where the mask says so, and nowhere else", async () => {
  const browser = await openBrowser();
  try {
    const {page, complaints} = await openPage(browser, daemon.origin, {width: 800, height: 600});
    await page.goto(`${daemon.origin}/`);
    await settled(page);
    assert.ok(await page.evaluate(() => window.tind.widget.scene.globe.terrainProvider.hasWaterMask));
    const [west, south] = lake[0], [east, north] = lake[2], rim = 0.06;
    const places = [], inside = [];
    for (let row = 0; row < 16; ++row) for (let col = 0; col < 16; ++col) {
      const x = -0.3 + 1.6 * col / 15, y = -0.3 + 1.6 * row / 15; // shares of the lake's sides
      if ([x, y].some((t) => Math.min(Math.abs(t), Math.abs(t - 1)) < rim)) continue; // at the shore
      places.push([west + x * (east - west), south + y * (north - south)]);
      inside.push(x > 0 && x < 1 && y > 0 && y < 1);
    }
    const changed = await page.evaluate(drawnOn, places);
    const seen = places.map((_, k) => k).filter((k) => changed[k] !== null);
    const wet = seen.filter((k) => inside[k]), dry = seen.filter((k) => !inside[k]);
    assert.ok(wet.length > 50 && dry.length > 50, `${wet.length} ${dry.length}`);
    for (const k of dry) assert.equal(changed[k], 0, `${places[k]}`);
    // Waves move: a place that is as bright with them as without is no place without them.
    assert.ok(wet.filter((k) => changed[k] > 0).length > 0.8 * wet.length, `${wet.map((k) => changed[k])}`);
    if (process.env.PICTURE) await page.screenshot({path: process.env.PICTURE});
    assert.deepEqual(complaints, []);
  } finally {
    await browser.close();
  }
});
