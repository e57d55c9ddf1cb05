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

test("CesiumJS draws it", async () => {
  const browser = await openBrowser();
  try {
    const {page, complaints} = await openPage(browser, daemon.origin, {width: 800, height: 600});
    await page.goto(`${daemon.origin}/`);
    await settled(page);
    const masks = await page.evaluate(() => {
      const {scene} = window.tind.widget;
      let drawn = 0;
      scene.globe._surface._tilesToRender.forEach((t) => t.data.waterMaskTexture && ++drawn);
      return {drawn, offered: scene.globe.terrainProvider.hasWaterMask};
    });
    assert.ok(masks.offered);
    assert.ok(masks.drawn > 0);
    if (process.env.PICTURE) await page.screenshot({path: process.env.PICTURE});
    assert.deepEqual(complaints, []);
  } finally {
    await browser.close();
  }
});
