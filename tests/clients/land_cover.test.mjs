// Land cover in the contents of 3D Tiles: valid for Khronos's validator, the same on demand and in
// batch; each triangle of the class that its corners or its middle have there, also between rows of
// the table. Read by loaders.gl, and picked by CesiumJS, which interpolates ids.
import assert from "node:assert/strict";
import {createRequire} from "node:module";
import {execFileSync} from "node:child_process";
import {mkdtempSync, readFileSync, readdirSync, rmSync, writeFileSync} from "node:fs";
import {tmpdir} from "node:os";
import {join} from "node:path";
import {after, before, test} from "node:test";
import {parse} from "@loaders.gl/core";
import {Tiles3DLoader} from "@loaders.gl/3d-tiles";
import {Cartographic, Cartesian3} from "cesium";
import {openBrowser, openPage} from "./browser.mjs";
import {openCesiumPage} from "./cesium_page.mjs";
import {PROGRAM, ROOT, startDaemon} from "./daemon.mjs";
import {figure} from "./figure.mjs";
import {decodeGlb} from "./glb.mjs";

const {validateBytes} = createRequire(import.meta.url)("gltf-validator");

// Six times six blocks of classes, in the last column none; over all but the DEM's southern end.
const WEST = -121.99, EAST = -121.53, SOUTH = 46.68, NORTH = 46.98, BLOCKS = 6;
const CLASSES = {10: ["Trees", [0, 100, 0]], 30: ["Grassland", [255, 255, 76]], 60: ["Bare ground", [180, 180, 180]], 70: ["Glaciär", [240, 240, 240]]};
const numbers = Object.keys(CLASSES).map(Number);
const classOf = (col, row) => (col === BLOCKS - 1 ? 0 : numbers[(col + 2 * row) % numbers.length]);
const MAKE = `
import sys, json, numpy as np
from osgeo import gdal, osr
classes, n = json.loads(sys.argv[2]), 100
blocks = np.array(json.loads(sys.argv[3]), np.uint8)
image = gdal.GetDriverByName("GTiff").Create(sys.argv[1], n * ${BLOCKS}, n * ${BLOCKS}, 1, gdal.GDT_Byte)
band = image.GetRasterBand(1)
band.WriteArray(np.kron(blocks, np.ones((n, n), np.uint8)))
band.SetNoDataValue(0)
table, names = gdal.ColorTable(), [""] * 256
for number, (name, colour) in classes.items():
    table.SetColorEntry(int(number), tuple(colour))
    names[int(number)] = name
band.SetColorTable(table)
band.SetCategoryNames(names)
image.SetGeoTransform((${WEST}, (${EAST} - ${WEST}) / n / ${BLOCKS}, 0, ${NORTH}, 0, (${SOUTH} - ${NORTH}) / n / ${BLOCKS}))
srs = osr.SpatialReference()
srs.ImportFromEPSG(4326)
image.SetProjection(srs.ExportToWkt())
`;
let folder, daemon, contents;

const build = (...more) =>
  execFileSync(PROGRAM, ["build", "testdata/rainier.tif", "-o", join(folder, "built"), "--format", "3dtiles", "--progress", "none", "--from-datum", "egm96", ...more], {cwd: ROOT, encoding: "utf8", stdio: ["ignore", "pipe", "pipe"]});
const file = (name, of = "3dtiles") => new Uint8Array(readFileSync(join(folder, "built", of, name)));

/// {number: undefined where there is no class, margin: of a block's side, negative beside the raster}
function expected(lon, lat) {
  const x = ((lon - WEST) / (EAST - WEST)) * BLOCKS, y = ((NORTH - lat) / (NORTH - SOUTH)) * BLOCKS;
  const off = Math.max(-x, -y, x - BLOCKS, y - BLOCKS);
  if (off > 0) return {number: undefined, margin: off};
  const col = Math.min(Math.floor(x), BLOCKS - 1), row = Math.min(Math.floor(y), BLOCKS - 1);
  return {number: classOf(col, row) || undefined, margin: Math.min(x - col, y - row, col + 1 - x, row + 1 - y)};
}

before(async () => {
  folder = mkdtempSync(join(tmpdir(), "tind-"));
  const blocks = Array.from({length: BLOCKS}, (_, row) => Array.from({length: BLOCKS}, (_, col) => classOf(col, row)));
  execFileSync("/usr/bin/python3", ["-c", MAKE, join(folder, "cover.tif"), JSON.stringify(CLASSES), JSON.stringify(blocks)]);
  build("--land-cover", join(folder, "cover.tif"));
  build("--land-cover", join(folder, "cover.tif"), "--compression", "meshopt");
  contents = readdirSync(join(folder, "built/3dtiles"), {recursive: true}).filter((name) => name.endsWith(".glb"));
  writeFileSync(join(folder, "config.toml"),
    `[[dataset]]\nname = "rainier"\nfiles = ["${ROOT}/testdata/rainier.tif"]\nfrom_datum = "egm96"\nto_datum = "ellipsoid"\nland_cover = "cover.tif"\n`);
  daemon = await startDaemon("--config", join(folder, "config.toml"));
});

after(async () => {
  if (daemon) assert.equal(await daemon.stop(), 0, daemon.said());
  rmSync(folder, {recursive: true, force: true});
});

test("every content is valid glTF, and on demand the same as in batch", async () => {
  let covered = 0;
  for (const [of, path] of [["3dtiles", ""], ["3dtiles-meshopt", "meshopt/"]])
    for (const name of [...contents, "tileset.json"]) {
      const reply = await fetch(`${daemon.origin}/3dtiles/rainier/${path}${name}`);
      assert.deepEqual(new Uint8Array(await reply.arrayBuffer()), file(name, of), `${of} ${name}`);
      if (!name.endsWith(".glb")) continue;
      const {issues} = await validateBytes(file(name, of));
      assert.equal(issues.numErrors + issues.numWarnings, 0, `${name}: ${JSON.stringify(issues.messages.slice(0, 3))}`);
      const {json} = await decodeGlb(file(name, of));
      const has = json.meshes[0].primitives.map((p) => "_FEATURE_ID_0" in p.attributes);
      assert.ok(has.every((h) => h === has[0]) && has[0] === "EXT_structural_metadata" in (json.extensions ?? {}), name);
      covered += has[0];
    }
  figure("gltf-validator", `land cover: ${covered} of ${2 * contents.length} contents have classes, 0 errors, 0 warnings`);
  assert.ok(covered > 160 && covered < 2 * contents.length);
});

test("loaders.gl reads the tables, and every triangle is of the class of its place", async () => {
  const found = {agree: 0, mixed: 0, none: 0, wrong: 0, added: 0};
  for (const of of ["3dtiles", "3dtiles-meshopt"])
    for (const name of contents) {
      const bytes = file(name, of);
      const {gltf} = await parse(bytes.slice().buffer, Tiles3DLoader, {"3d-tiles": {isTileset: false, loadGLTF: true}, worker: false});
      const tables = gltf.extensions?.EXT_structural_metadata?.propertyTables;
      const {primitives: [{positions, features, indices}], node} = await decodeGlb(bytes);
      assert.equal(features !== undefined, tables !== undefined, name);
      if (!tables) continue;
      const {properties, count} = tables[0];
      const rows = Array.from({length: count}, (_, i) =>
        ({number: properties.class.data[i], name: properties.name.data[i], colour: [...properties.color.data.slice(3 * i, 3 * i + 3)]}));
      for (const {number, name: said, colour} of rows) assert.deepEqual([said, colour], CLASSES[number], name);
      assert.deepEqual(rows.map((r) => r.number), rows.map((r) => r.number).sort((a, b) => a - b));
      assert.deepEqual([...gltf.meshes[0].primitives[0].extensions.EXT_mesh_features.featureIds[0].data], features, name);
      const places = positions.map((p) => {
        const at = Cartographic.fromCartesian(new Cartesian3(...p));
        return [(at.longitude * 180) / Math.PI, (at.latitude * 180) / Math.PI];
      });
      const near = node.extras.rounding_m / 1000 + 1e-4; // of a block's side, which is longer than a kilometre
      for (let t = 0; t < indices.length; t += 3) {
        const corners = indices.slice(t, t + 3), ids = corners.map((i) => features[i]);
        assert.ok(ids[0] === ids[1] && ids[1] === ids[2], `${name}: ${ids}`);
        const at = corners.map((i) => expected(...places[i]));
        if (at.some(({margin}) => margin < near)) continue;
        const agree = at.every(({number}) => number === at[0].number);
        const middle = expected(...[0, 1].map((k) => corners.reduce((sum, i) => sum + places[i][k] / 3, 0)));
        if (!agree && middle.margin < near) continue;
        const wanted = agree ? at[0].number : middle.number, got = ids[0] === 65535 ? undefined : rows[ids[0]].number;
        if (got !== wanted) ++found.wrong;
        ++found[wanted === undefined ? "none" : agree ? "agree" : "mixed"];
      }
      found.added += positions.length - new Set(positions.map(String)).size;
    }
  figure("@loaders.gl/3d-tiles", `land cover, plain and meshopt: ${found.agree} triangles whose corners agree, ${found.mixed} others, ${found.none} without a class, ${found.wrong} wrong`);
  console.log(`${found.added} vertices are there again for another class`);
  assert.ok(found.agree > 50000 && found.mixed > 1000 && found.none > 10000 && found.added > 1000, JSON.stringify(found));
  assert.equal(found.wrong, 0);
});

test("another raster, or none, makes other tiles; the same one makes nothing anew", () => {
  const version = () => JSON.parse(new TextDecoder().decode(file("tileset.json"))).asset.tilesetVersion;
  const first = version();
  assert.match(build("--land-cover", join(folder, "cover.tif")), /3D Tiles: kept/);
  build();
  assert.ok(first.startsWith(version()) && first !== version(), `${first} ${version()}`);
  assert.throws(() => build("--land-cover", "testdata/rainier.tif"), /classes/);
});

test("CesiumJS picks classes with their names and colours, and its terrain has the heights of the quantized mesh", async () => {
  const browser = await openBrowser();
  try {
    const {page} = await openPage(browser, daemon.origin, {width: 1000, height: 640});
    await openCesiumPage(page, daemon.origin);
    const picked = await page.evaluate(async () => {
      const widget = new Cesium.CesiumWidget("globe", {baseLayer: false, globe: false, contextOptions: {webgl: {preserveDrawingBuffer: true}}, msaaSamples: 1});
      widget.scene.skyBox = undefined;
      widget.clock.currentTime = Cesium.JulianDate.fromIso8601("2026-06-21T19:30:00Z");
      const tileset = await Cesium.Cesium3DTileset.fromUrl("/3dtiles/rainier/tileset.json", {maximumScreenSpaceError: 0.2}); // the finest tiles
      tileset.style = new Cesium.Cesium3DTileStyle({color: "rgb(${color}[0], ${color}[1], ${color}[2])"});
      widget.scene.primitives.add(tileset);
      widget.camera.setView({destination: Cesium.Cartesian3.fromDegrees(-121.76, 46.82, 42000)});
      await new Promise((resolve) => tileset.initialTilesLoaded.addEventListener(resolve));
      for (let drawn = 0; drawn < 10; drawn = tileset.tilesLoaded ? drawn + 1 : 0)
        await new Promise((resolve) => requestAnimationFrame(resolve));
      const found = [];
      for (let y = 20; y < 640; y += 40)
        for (let x = 20; x < 1000; x += 40) {
          const at = new Cesium.Cartesian2(x, y);
          const feature = widget.scene.pick(at), place = widget.scene.pickPosition(at);
          if (!place) continue;
          const {longitude, latitude} = Cesium.Cartographic.fromCartesian(place);
          const color = feature?.getProperty?.("color");
          found.push({
            lon: Cesium.Math.toDegrees(longitude), lat: Cesium.Math.toDegrees(latitude),
            number: feature?.getProperty?.("class"), name: feature?.getProperty?.("name"),
            colour: color && [color.x, color.y, color.z],
          });
        }
      return found;
    });
    const apart = await page.evaluate(async () => {
      const tiles3d = await Cesium.Cesium3DTilesTerrainProvider.fromUrl("/3dtiles/rainier/tileset.json");
      const mesh = await Cesium.CesiumTerrainProvider.fromUrl("/terrain/rainier");
      const places = () => Array.from({length: 100}, (_, i) => Cesium.Cartographic.fromDegrees(-121.97 + 0.46 * ((i * 0.618034) % 1), 46.61 + 0.38 * (i / 100)));
      for (const level of [0, 3, 6, 9, 12]) await Cesium.sampleTerrain(tiles3d, level, places().slice(0, 1));
      const a = await Cesium.sampleTerrain(tiles3d, 12, places()), b = await Cesium.sampleTerrain(mesh, 12, places());
      return Math.max(...a.map(({height}, i) => Math.abs(height - b[i].height)));
    });
    assert.ok(apart < 0.5, `${apart} m`);
    if (process.env.COVER_PICTURE) writeFileSync(process.env.COVER_PICTURE, await page.screenshot());
    let inside = 0, right = 0;
    const wrong = [];
    for (const {lon, lat, number, name, colour} of picked) {
      const here = expected(lon, lat);
      if (here.number === undefined || here.margin < 0.15) continue; // triangles reach over borders
      ++inside;
      if (number === here.number && name === CLASSES[number][0] && `${colour}` === `${CLASSES[number][1]}`) ++right;
      else wrong.push({lon, lat, number, name, colour, want: here.number});
    }
    figure("cesium", `Cesium3DTileset, land cover: ${picked.length} places picked, ${inside} well inside a class, ${inside - right} wrong`);
    assert.ok(inside > 50 && right === inside, JSON.stringify(wrong.slice(0, 5)));
  } finally {
    await browser.close();
  }
});
