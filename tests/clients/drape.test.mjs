// Colours of an image in the contents of 3D Tiles: valid for Khronos's validator, at each vertex what
// the image has there, the same on demand and in batch, and seen by CesiumJS.
import assert from "node:assert/strict";
import {createRequire} from "node:module";
import {execFileSync} from "node:child_process";
import {mkdtempSync, readFileSync, readdirSync, rmSync, writeFileSync} from "node:fs";
import {tmpdir} from "node:os";
import {join} from "node:path";
import {after, before, test} from "node:test";
import {Cartographic, Cartesian3} from "cesium";
import {openBrowser, openPage} from "./browser.mjs";
import {openCesiumPage} from "./cesium_page.mjs";
import {PROGRAM, ROOT, startDaemon} from "./daemon.mjs";
import {figure} from "./figure.mjs";
import {decodeGlb} from "./glb.mjs";

const {validateBytes} = createRequire(import.meta.url)("gltf-validator");

// The western two thirds of the DEM: red grows to the east, green to the north, blue is .25 (sRGB).
const WEST = -121.99, EAST = -121.66, SOUTH = 46.62, NORTH = 46.98;
const MAKE = `
import sys, numpy as np
from osgeo import gdal, osr
n = 512
x, y = np.meshgrid((np.arange(n) + .5) / n, (np.arange(n) + .5) / n)
image = gdal.GetDriverByName("GTiff").Create(sys.argv[1], n, n, 3, gdal.GDT_Byte)
for band, values in enumerate((x, 1 - y, 0 * x + .25)):
    image.GetRasterBand(band + 1).WriteArray(np.round(values * float(sys.argv[2])).astype(np.uint8))
image.SetGeoTransform((${WEST}, (${EAST} - ${WEST}) / n, 0, ${NORTH}, 0, (${SOUTH} - ${NORTH}) / n))
srs = osr.SpatialReference()
srs.ImportFromEPSG(4326)
image.SetProjection(srs.ExportToWkt())
`;
const linear = (c) => (c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4);
let folder, daemon, contents;

const image = (name, scale = 255) => execFileSync("/usr/bin/python3", ["-c", MAKE, join(folder, name), `${scale}`]);
const build = (...more) =>
  execFileSync(PROGRAM, ["build", "testdata/rainier.tif", "-o", join(folder, "built"), "--format", "3dtiles", "--progress", "none", "--from-datum", "egm96", ...more], {cwd: ROOT, encoding: "utf8", stdio: ["ignore", "pipe", "pipe"]});
const file = (name, of = "3dtiles") => new Uint8Array(readFileSync(join(folder, "built", of, name)));

before(async () => {
  folder = mkdtempSync(join(tmpdir(), "tind-"));
  image("colours.tif");
  build("--drape", join(folder, "colours.tif"));
  build("--drape", join(folder, "colours.tif"), "--compression", "meshopt");
  contents = readdirSync(join(folder, "built/3dtiles"), {recursive: true}).filter((name) => name.endsWith(".glb"));
  writeFileSync(join(folder, "config.toml"),
    `[[dataset]]\nname = "rainier"\nfiles = ["${ROOT}/testdata/rainier.tif"]\nfrom_datum = "egm96"\nto_datum = "ellipsoid"\ndrape = "colours.tif"\n` +
    `[[dataset]]\nname = "edges"\nfiles = ["${ROOT}/testdata/rainier.tif"]\nfrom_datum = "egm96"\nto_datum = "ellipsoid"\ndrape = "colours.tif"\nmethod = "attribute-qem"\n`);
  daemon = await startDaemon("--config", join(folder, "config.toml"));
});

after(async () => {
  if (daemon) assert.equal(await daemon.stop(), 0, daemon.said());
  rmSync(folder, {recursive: true, force: true});
});

test("every content is valid glTF, and on demand the same as in batch", async () => {
  let coloured = 0;
  for (const name of [...contents, "tileset.json"]) {
    const reply = await fetch(`${daemon.origin}/3dtiles/rainier/${name}`);
    assert.equal(reply.status, 200, name);
    assert.deepEqual(new Uint8Array(await reply.arrayBuffer()), file(name), name);
    if (!name.endsWith(".glb")) continue;
    const {issues} = await validateBytes(file(name));
    assert.equal(issues.numErrors + issues.numWarnings, 0, `${name}: ${JSON.stringify(issues.messages.slice(0, 3))}`);
    const {json} = await decodeGlb(file(name));
    const has = json.meshes[0].primitives.map((p) => "COLOR_0" in p.attributes);
    assert.ok(has.every((h) => h === has[0]), name);
    coloured += has[0];
  }
  figure("gltf-validator", `COLOR_0: ${coloured} of ${contents.length} contents have colours, 0 errors, 0 warnings`);
  assert.ok(coloured > 80 && coloured < contents.length);
});

test("meshes that are made for the image's sake are the same on demand, and within their errors", async () => {
  const built = join(folder, "edges");
  execFileSync(PROGRAM, ["build", "testdata/rainier.tif", "-o", built, "--format", "3dtiles", "--progress", "none", "--from-datum", "egm96",
    "--method", "attribute-qem", "--drape", join(folder, "colours.tif")], {cwd: ROOT, stdio: ["ignore", "pipe", "pipe"]});
  let other = 0;
  for (const name of [...contents, "tileset.json"]) {
    const bytes = new Uint8Array(readFileSync(join(built, "3dtiles", name)));
    const reply = await fetch(`${daemon.origin}/3dtiles/edges/${name}`);
    assert.deepEqual(new Uint8Array(await reply.arrayBuffer()), bytes, name);
    other += Buffer.compare(bytes, file(name)) !== 0;
  }
  assert.ok(other > 80, `${other}`);
  const layer = readFileSync(join(built, "layer.json"), "utf8");
  assert.equal(JSON.parse(await (await fetch(`${daemon.origin}/terrain/edges/layer.json`)).text()).version, JSON.parse(layer).version);
  const said = execFileSync(PROGRAM, ["check", built, "--source", "testdata/rainier.tif", "--from-datum", "egm96", "--json"], {cwd: ROOT, encoding: "utf8"});
  assert.equal(JSON.parse(said).violations, 0);
});

test("a vertex of a deep tile has the image's colour, and white where the image is not", async () => {
  let on = 0, off = 0, most = 0;
  for (const name of contents.filter((n) => Number(/\/(\d+)\//.exec(n)[1]) >= 12)) {
    const {primitives} = await decodeGlb(file(name));
    for (const {positions, colours} of primitives.slice(0, 1))
      positions.forEach((p, i) => {
        if (!colours) return;
        const at = Cartographic.fromCartesian(new Cartesian3(...p));
        const lon = (at.longitude * 180) / Math.PI, lat = (at.latitude * 180) / Math.PI;
        const x = (lon - WEST) / (EAST - WEST), y = (lat - SOUTH) / (NORTH - SOUTH);
        const inside = Math.min(x, y, 1 - x, 1 - y);
        if (inside < -0.001) {
          assert.deepEqual(colours[i], [1, 1, 1], `${name} ${lon} ${lat}`);
          ++off;
        } else if (inside > 0.02) {
          [x, y, 0.25].forEach((c, k) => (most = Math.max(most, Math.abs(colours[i][k] - linear(c)))));
          ++on;
        }
      });
  }
  console.log(`${on} vertices on the image at most ${most.toFixed(4)} off its light, ${off} beside it white`);
  assert.ok(on > 10000 && off > 1000 && most < 0.012, `${on} ${off} ${most}`);
});

test("compressed contents have the same colours, as 16 bits", async () => {
  let coloured = 0, vertices = 0, most = 0, bytes = 0, bytesPlain = 0;
  for (const name of contents) {
    const packed = file(name, "3dtiles-meshopt");
    const reply = await fetch(`${daemon.origin}/3dtiles/rainier/meshopt/${name}`);
    assert.deepEqual(new Uint8Array(await reply.arrayBuffer()), packed, name);
    const {issues} = await validateBytes(packed);
    assert.equal(issues.numErrors + issues.numWarnings, 0, `${name}: ${JSON.stringify(issues.messages.slice(0, 3))}`);
    const plain = (await decodeGlb(file(name))).primitives;
    (await decodeGlb(packed)).primitives.forEach(({colours, positions}, i) => {
      assert.equal(colours?.length, plain[i].colours?.length, name);
      if (!colours) return;
      assert.equal(colours.length, positions.length, name);
      colours.forEach((colour, k) => colour.forEach((c, n) => (most = Math.max(most, Math.abs(c - plain[i].colours[k][n])))));
      vertices += colours.length;
      coloured += i === 0;
    });
    bytes += packed.length;
    bytesPlain += file(name).length;
  }
  console.log(`${coloured} compressed contents with colours, ${(bytes / bytesPlain).toFixed(2)} of the plain bytes; ${vertices} vertices at most ${(most * 65535).toFixed(3)} / 65535 off`);
  assert.ok(coloured > 80 && most <= 0.51 / 65535, `${coloured} ${most}`);
});

test("another image, or none, makes other tiles; the same one makes nothing anew", () => {
  const version = () => JSON.parse(new TextDecoder().decode(file("tileset.json"))).asset.tilesetVersion;
  const first = version(), name = contents.find((n) => file(n).length > 20000), bytes = file(name);
  assert.match(build("--drape", join(folder, "colours.tif")), /3D Tiles: kept/);
  image("dark.tif", 100);
  build("--drape", join(folder, "dark.tif"));
  assert.notEqual(version(), first);
  build();
  assert.ok(first.startsWith(version()), `${first} ${version()}`);
  build("--drape", join(folder, "colours.tif"));
  assert.equal(version(), first);
  assert.deepEqual(file(name), bytes);
});

test("CesiumJS draws the colours", async () => {
  const browser = await openBrowser();
  try {
    const {page} = await openPage(browser, daemon.origin, {width: 1000, height: 640});
    await openCesiumPage(page, daemon.origin);
    await page.evaluate(async () => {
      window.widget = new Cesium.CesiumWidget("globe", {baseLayer: false, globe: false, contextOptions: {webgl: {preserveDrawingBuffer: true}}, msaaSamples: 1});
      widget.scene.skyBox = undefined;
      widget.clock.currentTime = Cesium.JulianDate.fromIso8601("2026-06-21T19:30:00Z");
      const tileset = await Cesium.Cesium3DTileset.fromUrl("/3dtiles/rainier/tileset.json");
      widget.scene.primitives.add(tileset);
      widget.camera.setView({destination: Cesium.Cartesian3.fromDegrees(-121.76, 46.8, 42000)});
      await new Promise((resolve) => tileset.initialTilesLoaded.addEventListener(resolve));
    });
    await new Promise((resolve) => setTimeout(resolve, 4000));
    // Seen from above, north is up: red grows to the right, green upwards.
    const at = await page.evaluate(() => {
      widget.scene.render(widget.clock.currentTime);
      const small = Object.assign(document.createElement("canvas"), {width: 100, height: 64});
      small.getContext("2d").drawImage(widget.canvas, 0, 0, 100, 64);
      const {data} = small.getContext("2d").getImageData(0, 0, 100, 64);
      const mean = (x, y) => [0, 1, 2].map((k) => { let s = 0; for (let j = 0; j < 6; ++j) for (let i = 0; i < 6; ++i) s += data[4 * ((y + j) * 100 + x + i) + k]; return s / 36; });
      return {west: mean(34, 30), middle: mean(48, 30), north: mean(42, 18), south: mean(42, 44)};
    });
    if (process.env.DRAPE_PICTURE) writeFileSync(process.env.DRAPE_PICTURE, await page.screenshot());
    console.log(JSON.stringify(at));
    const share = ([r, g, b], k) => [r, g, b][k] / (r + g + b);
    assert.ok(share(at.middle, 0) > share(at.west, 0) + 0.05, JSON.stringify(at));
    assert.ok(share(at.north, 1) > share(at.south, 1) + 0.05, JSON.stringify(at));
  } finally {
    await browser.close();
  }
});
