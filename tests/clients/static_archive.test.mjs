// An archive without any of our programs: on a plain server that knows ranges, read by the npm package
// `pmtiles`, by CesiumJS in Chromium with the module that we ship for it, and a database by Python's
// own SQLite. All of it is what the folder holds.
import assert from "node:assert/strict";
import {execFileSync} from "node:child_process";
import {createHash} from "node:crypto";
import {once} from "node:events";
import {mkdtempSync, readFileSync, readdirSync, rmSync, statSync} from "node:fs";
import {createServer} from "node:http";
import {tmpdir} from "node:os";
import {join} from "node:path";
import {after, before, test} from "node:test";
import {PMTiles} from "pmtiles";
import {TerrainArchive} from "../../server/viewer/pmtiles_terrain.js";
import {openBrowser, openPage} from "./browser.mjs";
import {openCesiumPage} from "./cesium_page.mjs";
import {PROGRAM, ROOT} from "./daemon.mjs";

const TYPES = {js: "text/javascript", json: "application/json"};
const known = new Map();
let folder, tiles, server, origin, faults, requests;

const tind = (...args) => execFileSync(PROGRAM, [...args, "--progress", "none"], {cwd: ROOT, stdio: ["ignore", "pipe", "ignore"]});
const tile = ({z, x, y}) => readFileSync(join(folder, `tiles/${z}/${x}/${y}.terrain`));

/// What is in a file, read again when it is another.
function contents(file) {
  const {ino, mtimeMs} = statSync(file, {throwIfNoEntry: false}) ?? {};
  if (!ino) return {};
  const state = `${ino} ${mtimeMs}`;
  if (known.get(file)?.state !== state) {
    const bytes = readFileSync(file);
    known.set(file, {state, bytes, etag: `"${createHash("md5").update(bytes).digest("hex")}"`});
  }
  return known.get(file);
}

/// Files of a folder, by ranges where that is asked for; `faults` break the next requests for archives.
function serve(request, reply) {
  const path = decodeURIComponent(new URL(request.url, "http://here").pathname);
  const file = path === "/pmtiles_terrain.js" ? join(ROOT, "server/viewer/pmtiles_terrain.js") : join(folder, path);
  const {bytes, etag} = contents(file);
  if (!bytes) return reply.writeHead(404).end();
  const type = {"Content-Type": TYPES[file.split(".").pop()] ?? "application/octet-stream"};
  if (!path.endsWith(".pmtiles")) return reply.writeHead(200, type).end(bytes);
  ++requests;
  const fault = faults.shift();
  if (fault === "500") return reply.writeHead(500).end();
  if (fault === "whole") return reply.writeHead(200, {...type, ETag: etag}).end(bytes);
  if (request.headers["if-match"] && request.headers["if-match"] !== etag) return reply.writeHead(412).end();
  const [, from, to] = /^bytes=(\d+)-(\d+)$/.exec(request.headers.range).map(Number);
  const last = Math.min(to, bytes.length - 1);
  const part = bytes.subarray(from, fault === "short" ? (from + last) >> 1 : last + 1);
  reply.writeHead(206, {...type, ETag: etag, "Content-Range": `bytes ${from}-${last}/${bytes.length}`, "Content-Length": part.length});
  reply.end(part);
}

before(async () => {
  folder = mkdtempSync(join(tmpdir(), "tind-"));
  tind("build", "testdata/rainier.tif", "-o", join(folder, "tiles"), "--deepest", "14", "--max-error", "80");
  tind("copy", join(folder, "tiles"), join(folder, "x.pmtiles"));
  tiles = readdirSync(join(folder, "tiles"), {recursive: true})
    .map((name) => /^(\d+)\/(\d+)\/(\d+)\.terrain$/.exec(name))
    .filter(Boolean)
    .map(([, z, x, y]) => ({z: +z, x: +x, y: +y}));
  [faults, requests] = [[], 0];
  server = createServer(serve).listen(0, "127.0.0.1");
  await once(server, "listening");
  origin = `http://127.0.0.1:${server.address().port}`;
});

after(() => {
  server?.close();
  server?.closeAllConnections();
  rmSync(folder, {recursive: true, force: true});
});

test("npm's pmtiles reads every tile", async () => {
  assert.ok(tiles.length >= 1000, `${tiles.length} tiles`);
  const archive = new PMTiles(`${origin}/x.pmtiles`);
  const header = await archive.getHeader();
  assert.equal(header.numAddressedTiles, tiles.length);
  assert.equal((await archive.getMetadata()).format, "quantized-mesh-1.0");
  for (const {z, x, y} of tiles) {
    const found = await archive.getZxy(z + 1, x, 2 ** z - 1 - y);
    assert.equal(Buffer.compare(Buffer.from(found.data), tile({z, x, y})), 0, `${z}/${x}/${y}`);
  }
  assert.equal(await archive.getZxy(12, 0, 0), undefined);
});

test("our module reads every tile, each with one request", async () => {
  const archive = await new TerrainArchive(`${origin}/x.pmtiles`).open();
  assert.deepEqual(archive.layer, JSON.parse(readFileSync(join(folder, "tiles/layer.json"))));
  requests = 0;
  for (const one of tiles)
    assert.equal(Buffer.compare(Buffer.from(await archive.tile(one.z, one.x, one.y)), tile(one)), 0, JSON.stringify(one));
  assert.ok(requests <= tiles.length + 4, `${requests} requests`); // and the leaves
  assert.equal(await archive.tile(11, 0, 0), null);
});

test("a server that breaks gives failures, and then the tile", async () => {
  const archive = await new TerrainArchive(`${origin}/x.pmtiles`).open();
  const one = tiles.at(-1);
  await archive.tile(one.z, one.x, one.y);
  for (const fault of ["500", "short", "whole"]) {
    faults = [fault];
    await assert.rejects(archive.tile(one.z, one.x, one.y), undefined, fault);
    assert.equal(Buffer.compare(Buffer.from(await archive.tile(one.z, one.x, one.y)), tile(one)), 0, fault);
  }
});

test("Python's SQLite reads every tile of the database", () => {
  tind("copy", join(folder, "x.pmtiles"), join(folder, "x.mbtiles"));
  const script = `
import gzip, pathlib, sqlite3, sys
folder = pathlib.Path(sys.argv[1])
db = sqlite3.connect(f"file:{folder}/x.mbtiles?mode=ro", uri=True)
said = dict(db.execute("SELECT name, value FROM metadata"))
assert said["format"] == "terrain" and said["scheme"] == "tms", said
same = sum(gzip.decompress(data) == (folder / f"tiles/{z}/{x}/{y}.terrain").read_bytes()
           for z, x, y, data in db.execute("SELECT zoom_level, tile_column, tile_row, tile_data FROM tiles"))
print(same)`;
  assert.equal(Number(execFileSync("python3", ["-c", script, folder])), tiles.length);
});

test("CesiumJS gets the same heights as of the folder, and never those of another build", {timeout: 600000}, async () => {
  const browser = await openBrowser();
  try {
    const {page, complaints} = await openPage(browser, origin, {width: 400, height: 300});
    await openCesiumPage(page, origin);
    const heights = await page.evaluate(async () => {
      const {pmtilesTerrain} = await import("/pmtiles_terrain.js");
      const {Cesium} = window;
      const places = [];
      for (let i = 0; i < 20; ++i) places.push([-121.85 + 0.008 * i, 46.79 + 0.006 * i]);
      const sample = async (provider) => {
        const asked = places.map(([lon, lat]) => Cesium.Cartographic.fromDegrees(lon, lat));
        await Cesium.sampleTerrainMostDetailed(provider, asked, true);
        return asked.map(({height}) => height);
      };
      window.archived = await pmtilesTerrain(Cesium, "/x.pmtiles");
      return {
        archive: await sample(window.archived),
        folder: await sample(await Cesium.CesiumTerrainProvider.fromUrl("/tiles", {requestVertexNormals: true})),
        normals: window.archived.hasVertexNormals,
        deepest: window.archived.availability.computeMaximumLevelAtPosition(Cesium.Cartographic.fromDegrees(...places[10])),
      };
    });
    assert.deepEqual(heights.archive, heights.folder);
    assert.ok(heights.archive.every((height) => height > 500 && height < 4500), `${heights.archive}`);
    assert.equal(heights.normals, true);
    assert.equal(heights.deepest, 14);
    assert.deepEqual(complaints, []);
    // Another file takes the name: what was opened fails, and what is opened now has the new tiles.
    tind("build", "testdata/rainier.tif", "-o", join(folder, "other"), "--deepest", "6");
    tind("copy", join(folder, "other"), join(folder, "x.pmtiles"), "--force");
    const changed = await page.evaluate(async () => {
      const {pmtilesTerrain, TerrainArchive} = await import("/pmtiles_terrain.js");
      const {Cesium} = window;
      const failed = await window.archived.requestTileGeometry(0, 0, 0, new Cesium.Request({throttle: false})).then(() => "a tile", () => "failed");
      const again = await pmtilesTerrain(Cesium, "/x.pmtiles");
      await again.requestTileGeometry(0, 0, 0, new Cesium.Request({throttle: false}));
      const {layer} = await new TerrainArchive(new URL("/x.pmtiles", window.location).href).open();
      return {failed, levels: layer.available.length};
    });
    assert.deepEqual(changed, {failed: "failed", levels: 7});
  } finally {
    await browser.close();
  }
});
