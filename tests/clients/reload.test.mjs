// The program itself under reloads, by signal and by request, half of them of a broken catalog,
// while clients fetch tiles: nobody may notice but by the new content.
import assert from "node:assert/strict";
import {createHash} from "node:crypto";
import {mkdtempSync, renameSync, rmSync, writeFileSync} from "node:fs";
import {tmpdir} from "node:os";
import {join} from "node:path";
import {after, before, test} from "node:test";
import {freePort, startDaemon} from "./daemon.mjs";

const RELOADS = 200, CLIENTS = 4, POSTS = 40;
const WGS84 = 'GEOGCS["WGS 84",DATUM["WGS_1984",SPHEROID["WGS 84",6378137,298.257223563]],PRIMEM["Greenwich",0],UNIT["degree",0.0174532925199433]]';

let folder, daemon, admin;

/// Another terrain on the same grid for each `kind`.
function writeDem(name, kind) {
  const rows = ["ncols " + POSTS, "nrows " + POSTS, "xllcenter 7.1", "yllcenter 46.1", "cellsize 0.002", "NODATA_value -9999"];
  for (let r = 0; r < POSTS; ++r)
    rows.push(Array.from({length: POSTS}, (_, c) => 1000 + ((c * 37 + r * 91 * kind) % 101)).join(" "));
  writeFileSync(join(folder, `${name}.prj`), WGS84);
  writeFileSync(join(folder, `${name}.asc`), rows.join("\n") + "\n");
}

const table = (name, file) => `[[dataset]]\nname = "${name}"\nfiles = ["${file}.asc"]\n`;
const catalog = (now) => `max_error = 5\n${table("one", "one")}${table("two", "two")}${table("changing", now)}`;
const BROKEN = [
  () => catalog("missing"),
  () => catalog("torn"),
  () => catalog("one") + "[[dataset]\n",
  () => catalog("two") + "max_eror = 3\n",
  () => catalog("two") + table("one", "two"),
  () => "",
];

/// A rename, as an operator's editor does it: the daemon may look at any moment.
function writeCatalog(text) {
  writeFileSync(join(folder, "new.toml"), text);
  renameSync(join(folder, "new.toml"), join(folder, "tind.toml"));
}

before(async () => {
  folder = mkdtempSync(join(tmpdir(), "tind-reload-"));
  writeDem("one", 1);
  writeDem("two", 2);
  writeDem("replaced", 1);
  writeDem("later", 2);
  writeFileSync(join(folder, "torn.asc"), "ncols 40\nnrows 40\nxllcenter 7\n");
  writeCatalog(catalog("one"));
  admin = `127.0.0.1:${await freePort()}`;
  daemon = await startDaemon("--config", join(folder, "tind.toml"), "--admin-listen", admin);
});
after(async () => {
  assert.equal(await daemon?.stop(), 0);
  rmSync(folder, {recursive: true, force: true});
});

const digest = (bytes) => createHash("sha256").update(Buffer.from(bytes)).digest("hex");

async function tilesOf(name) {
  const layer = await (await fetch(`${daemon.origin}/terrain/${name}/layer.json`)).json();
  return layer.available.flatMap((ranges, z) => ranges.flatMap(({startX, startY, endX, endY}) => {
    const all = [];
    for (let x = startX; x <= endX; ++x) for (let y = startY; y <= endY; ++y) all.push(`${z}/${x}/${y}`);
    return all;
  }));
}

async function hashes(name, tiles) {
  const found = {};
  for (const tile of tiles) found[tile] = digest(await (await fetch(`${daemon.origin}/terrain/${name}/${tile}.terrain`)).arrayBuffer());
  return found;
}

/// The sum of a metric over its labels.
async function metric(name) {
  const lines = (await (await fetch(`${daemon.origin}/metrics`)).text()).split("\n");
  return lines.filter((line) => line.startsWith(name)).reduce((sum, line) => sum + Number(line.split(" ").at(-1)), 0);
}

const reloads = () => metric("tind_reloads_total{");

async function until(holds) {
  for (let tries = 0; !(await holds()); ++tries) {
    assert.ok(tries < 5000, `waited in vain for ${holds}`);
    await new Promise((resolve) => setTimeout(resolve, 2));
  }
}

async function reload(bySignal) {
  if (!bySignal) return (await fetch(`http://${admin}/admin/reload`, {method: "POST"})).ok;
  const before = await reloads();
  daemon.signal("SIGHUP");
  await until(async () => (await reloads()) !== before);
  return !/^\[-\] reload/m.test(await (await fetch(`${daemon.origin}/readyz?verbose`)).text());
}

test(`${RELOADS} reloads under load, half of them broken: no request fails, no ETag has two contents`, async () => {
  const tiles = await tilesOf("one");
  assert.ok(tiles.length > 10);
  const known = {one: await hashes("one", tiles), two: await hashes("two", tiles)};
  assert.notDeepEqual(known.one, known.two);

  let done = false, asked = 0;
  const contents = new Map();  // by name, tile and ETag
  const seen = new Set();
  const wrong = [];
  const client = async (k) => {
    for (let i = k; !done; i += 1) {
      const tile = tiles[(i * 7919) % tiles.length];
      const name = ["changing", "one", "changing", "two"][i % 4];
      const reply = await fetch(`${daemon.origin}/terrain/${name}/${tile}.terrain`);
      const hash = digest(await reply.arrayBuffer());
      asked += 1;
      if (reply.status !== 200) wrong.push(`${name} ${tile}: ${reply.status}`);
      const key = `${name} ${tile} ${reply.headers.get("etag")}`;
      if ((contents.get(key) ?? hash) !== hash) wrong.push(`two contents under ${key}`);
      contents.set(key, hash);
      const is = Object.keys(known).filter((which) => known[which][tile] === hash);
      if (is.length === 0) wrong.push(`${key}: neither terrain's tile`);
      if (name !== "changing" && !is.includes(name)) wrong.push(`${key}: another dataset's tile`);
      if (name === "changing" && is.length === 1) seen.add(is[0]);
    }
  };
  const clients = Array.from({length: CLIENTS}, (_, k) => client(k));
  let good = 0;
  for (let i = 0; i < RELOADS; ++i) {
    const broken = i % 2 === 1;
    const now = i % 4 === 0 ? "two" : "one";
    writeCatalog(broken ? BROKEN[(i >> 1) % BROKEN.length]() : catalog(now));
    const ok = await reload(i % 3 === 0);
    assert.equal(ok, !broken, `reload ${i}`);
    if (!broken) {
      good += 1;
      const tile = tiles.at(-1);
      const reply = await fetch(`${daemon.origin}/terrain/changing/${tile}.terrain`);
      assert.equal(digest(await reply.arrayBuffer()), known[now][tile], `reload ${i}`);
    }
  }
  done = true;
  await Promise.all(clients);
  assert.deepEqual(wrong.slice(0, 5), []);
  assert.equal(good, RELOADS / 2);
  assert.deepEqual([...seen].sort(), ["one", "two"]);
  // Those that did not change kept what they had: one ETag a tile.
  for (const name of ["one", "two"])
    assert.equal([...contents.keys()].filter((key) => key.startsWith(name + " ")).length,
      new Set([...contents.keys()].filter((key) => key.startsWith(name + " ")).map((key) => key.split(" ")[1])).size);
  assert.ok(asked > RELOADS, `${asked} requests`);
});

test("a file that is replaced while its tiles are asked for: what it was, 503, or after a reload what it is", async () => {
  writeCatalog(catalog("replaced"));
  assert.ok(await reload(false));
  const tiles = await tilesOf("changing");
  const [old, now] = [await hashes("one", tiles), await hashes("two", tiles)];
  let reloaded = false;
  for (let i = 0; i < 400; ++i) {
    if (i === 100) renameSync(join(folder, "later.asc"), join(folder, "replaced.asc"));
    if (i === 300) {
      await until(async () => (await metric("tind_datasets_changed")) === 1);
      assert.ok(await reload(true));
      reloaded = true;
    }
    // Half of them are asked for, and cached, before the file is another.
    const tile = tiles[(i * 7919) % (i < 100 ? tiles.length >> 1 : tiles.length)];
    const reply = await fetch(`${daemon.origin}/terrain/changing/${tile}.terrain`);
    const hash = digest(await reply.arrayBuffer());
    if (reloaded) assert.deepEqual([reply.status, hash], [200, now[tile]], `after the reload ${tile}`);
    else if (reply.status !== 503) assert.deepEqual([reply.status, hash], [200, old[tile]], `before the reload ${tile}`);
  }
  assert.equal(await metric("tind_datasets_changed"), 0);
});
