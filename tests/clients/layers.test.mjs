// A dataset of layers over HTTP, as a table names them and as a command line does: which layer
// answers, what happens when a layer's file goes, comes back or is replaced, and which of the things
// that can be said of layers make other tiles.
import assert from "node:assert/strict";
import {mkdtempSync, renameSync, rmSync, writeFileSync} from "node:fs";
import {tmpdir} from "node:os";
import {join} from "node:path";
import {after, before, test} from "node:test";
import {openBrowser, openPage, settled} from "./browser.mjs";
import {startDaemon} from "./daemon.mjs";

const WGS84 = 'GEOGCS["WGS 84",DATUM["WGS_1984",SPHEROID["WGS 84",6378137,298.257223563]],PRIMEM["Greenwich",0],UNIT["degree",0.0174532925199433]]';
// Town's posts are more than a cache of 1 MB holds.
const BASE = {west: 7, south: 46, step: 0.002, posts: 200}, TOWN = {west: 7.1, south: 46.1, step: 0.0002, posts: 800};
const IN_TOWN = {lon: 7.18, lat: 46.18}, NORTH_WEST = {lon: 7.12, lat: 46.24}, FAR = {lon: 7.36, lat: 46.04};

let folder;
const file = (name) => join(folder, name);
const wait = (ms) => new Promise((resolve) => setTimeout(resolve, ms));

/// Whole metres: hills of 40 m, and `lift` more of them on one post in the middle.
function writeDem(name, {west, south, step, posts}, height, lift = 0) {
  const rows = [`ncols ${posts}`, `nrows ${posts}`, `xllcenter ${west}`, `yllcenter ${south}`, `cellsize ${step}`, "NODATA_value -9999"];
  const middle = posts >> 1;
  for (let r = 0; r < posts; ++r)
    rows.push(Array.from({length: posts}, (_, c) => height + ((c * 7 + r * 13) % 41) + (c === middle && r === middle ? lift : 0)).join(" "));
  writeFileSync(file(`${name}.prj`), WGS84);
  writeFileSync(file(`${name}.new`), rows.join("\n") + "\n");
  renameSync(file(`${name}.new`), file(`${name}.asc`));
}

const layer = (name, dem, more = "") => `[[dataset.layer]]\nname = "${name}"\nfiles = ["${dem}.asc"]\n${more}`;
const dataset = (name, layers, more = "") => `[[dataset]]\nname = "${name}"\nlevels = "0-13"\nmax_error = 5\n${more}${layers.join("")}`;
function writeConfig(text) {
  writeFileSync(file("new.toml"), text);
  renameSync(file("new.toml"), file("tind.toml"));
}

before(() => {
  folder = mkdtempSync(join(tmpdir(), "tind-layers-"));
  writeDem("base", BASE, 100);
  writeDem("town", TOWN, 300);
});
after(() => rmSync(folder, {recursive: true, force: true}));

const json = async (url) => {
  const reply = await fetch(url);
  assert.equal(reply.status, 200, url);
  return reply.json();
};
const tileAt = (z, {lon, lat}) => `${z}/${Math.floor((lon + 180) / (180 / 2 ** z))}/${Math.floor((lat + 90) / (180 / 2 ** z))}`;
const elevation = (origin, name, {lon, lat}) => json(`${origin}/elevation/${name}?lon=${lon}&lat=${lat}`);
const tile = (origin, name, address, headers = {}) => fetch(`${origin}/terrain/${name}/${address}.terrain`, {headers});

async function until(what, holds) {
  for (let tries = 0; tries < 200; ++tries) {
    if (await holds()) return;
    await wait(100);
  }
  assert.fail(`never: ${what}`);
}

const lines = (daemon, ...words) => daemon.said().split("\n").filter((line) => words.every((word) => line.includes(word)));

for (const way of ["a table", "a command line"])
  test(`layers of ${way}: which one answers, and what becomes of tiles when its file goes`, async () => {
    writeConfig(dataset("land", [layer("base", "base", 'accuracy = "le90=9"\n'), layer("town", "town", 'accuracy = "rmse=0.3"\n')]));
    const daemon = await (way === "a table" ?
      startDaemon("--config", file("tind.toml"), "--source-cache-mb", "1") :
      startDaemon("--layer", `land=${file("base.asc")}`, "--layer", `town=${file("town.asc")}`, "--max-error", "5", "--accuracy", "2", "--source-cache-mb", "1"));
    try {
      const stated = way === "a table" ? {base: {kind: "le90", m: 9}, town: {kind: "rmse", m: 0.3}} :
        {base: {kind: "unspecified", m: 2}, town: {kind: "unspecified", m: 2}};
      const {origin} = daemon;
      const low = await elevation(origin, "land", FAR), high = await elevation(origin, "land", IN_TOWN);
      assert.equal(low.layer, way === "a table" ? "base" : "land");
      assert.equal(high.layer, "town");
      assert.ok(low.height_m < 150 && high.height_m > 290);
      assert.ok(low.spacing_m[1] > 9 * high.spacing_m[1]);
      assert.deepEqual([low.accuracy, high.accuracy], [stated.base, stated.town]);
      const repeated = [{layer: low.layer, ...stated.base}, {layer: "town", ...stated.town}];
      assert.deepEqual((await json(`${origin}/terrain/land/layer.json`)).accuracy, repeated);
      assert.deepEqual((await json(`${origin}/rgb/land/tiles.json`)).accuracy, repeated);
      const listed = (await json(`${origin}/datasets`)).datasets[0];
      assert.deepEqual(listed.accuracy, repeated);
      assert.deepEqual(listed.source.layers.map((one) => one.accuracy), [stated.base, stated.town]);
      assert.deepEqual((await json(`${origin}/3dtiles/land/tileset.json`)).asset.extras.accuracy, repeated);

      const before = await tile(origin, "land", tileAt(13, IN_TOWN));
      assert.equal(before.status, 200);
      renameSync(file("town.asc"), file("elsewhere"));
      const gone = await tile(origin, "land", tileAt(13, NORTH_WEST));
      assert.equal(gone.status, 503);
      assert.ok(gone.headers.has("retry-after"));
      assert.equal((await tile(origin, "land", tileAt(11, FAR))).status, 200, "the other layer's tiles go on");
      await until("the log says it", () => lines(daemon, "town.asc", "no longer there", "answers 503").length > 0);
      for (let i = 0; i < 4; ++i) assert.equal((await tile(origin, "land", tileAt(13, NORTH_WEST))).status, 503);
      await wait(2500);  // two more looks
      assert.equal(lines(daemon, "town.asc", "no longer there", "answers 503").length, 1);
      renameSync(file("elsewhere"), file("town.asc"));
      await until("it is served again", async () => (await tile(origin, "land", tileAt(13, NORTH_WEST))).status === 200);
      const again = await tile(origin, "land", tileAt(13, IN_TOWN));
      assert.equal(again.headers.get("etag"), before.headers.get("etag"));
      assert.equal((await elevation(origin, "land", NORTH_WEST)).layer, "town");
    } finally {
      assert.equal(await daemon.stop(), 0);
    }
  });

test("a layer that is replaced: new ETags, and nothing of the old under them", async () => {
  writeDem("town", TOWN, 300);
  writeConfig(dataset("land", [layer("base", "base"), layer("town", "town")]));
  const daemon = await startDaemon("--config", file("tind.toml"));
  try {
    const {origin} = daemon, inside = tileAt(13, IN_TOWN), far = tileAt(11, FAR);
    const old = {}, now = {};
    for (const address of [inside, far]) old[address] = await tile(origin, "land", address);
    const version = (await json(`${origin}/terrain/land/layer.json`)).version;
    writeDem("town", TOWN, 340);
    daemon.signal("SIGHUP");
    await until("it is reloaded", () => lines(daemon, "reloaded", "opened anew: land").length > 0);
    assert.notEqual((await json(`${origin}/terrain/land/layer.json`)).version, version);
    for (const address of [inside, far]) now[address] = await tile(origin, "land", address, {"if-none-match": old[address].headers.get("etag")});
    assert.equal(now[inside].status, 200);
    assert.notEqual(now[inside].headers.get("etag"), old[inside].headers.get("etag"));
    assert.ok((await elevation(origin, "land", IN_TOWN)).height_m > 335);
    assert.equal(now[far].status, 304, "what the layer does not reach has the same bytes");
  } finally {
    assert.equal(await daemon.stop(), 0);
    writeDem("town", TOWN, 300);
  }
});

test("what is said of layers: which of it makes other tiles", async () => {
  writeDem("town", TOWN, 300);
  writeDem("town2", TOWN, 300, 60);
  const base = layer("base", "base"), town = layer("town", "town");
  const said = {
    plain: dataset("plain", [base, town]),
    same: dataset("same", [base, town]),
    accuracy: dataset("accuracy", [layer("base", "base", 'accuracy = "le95=3"\n'), town]),
    attribution: dataset("attribution", [base, town], 'attribution = "somebody"\n'),
    order: dataset("order", [town, base]),
    blend: dataset("blend", [base, layer("town", "town", "blend = 1500\n")]),
    content: dataset("content", [base, layer("town", "town2")]),
    datum: dataset("datum", [base, town], 'from_datum = "egm96"\n'),
  };
  writeConfig(Object.values(said).join(""));
  const daemon = await startDaemon("--config", file("tind.toml"));
  try {
    const seen = {};
    for (const name of Object.keys(said)) {
      const head = await json(`${daemon.origin}/terrain/${name}/layer.json`);
      const etags = [];
      for (const where of [IN_TOWN, FAR, {lon: TOWN.west - 0.004, lat: IN_TOWN.lat}])
        for (const z of [0, 8, 10]) etags.push((await tile(daemon.origin, name, tileAt(z, where))).headers.get("etag"));
      seen[name] = {version: head.version, etags};
    }
    for (const name of ["same", "accuracy", "attribution"]) assert.deepEqual(seen[name], seen.plain, name);
    const others = ["order", "blend", "content", "datum"];
    for (const name of others) assert.notDeepEqual(seen[name].etags, seen.plain.etags, name);
    assert.equal(new Set(["plain", ...others].map((name) => seen[name].version)).size, others.length + 1);
  } finally {
    assert.equal(await daemon.stop(), 0);
  }
});

test("the globe shows layers, and the dialog of datasets opens with them", async () => {
  writeDem("base", BASE, 100);
  writeDem("town", TOWN, 300);
  const daemon = await startDaemon(`both=${file("base.asc")},${file("town.asc")}`, file("base.asc"));
  const browser = await openBrowser();
  try {
    const {page, complaints} = await openPage(browser, daemon.origin, {width: 960, height: 600});
    await page.goto(`${daemon.origin}/?dataset=both`);
    await settled(page);
    assert.ok((await page.textContent("#facts")).includes("2 layers, 680,000 posts"), await page.textContent("#facts"));
    assert.equal(await page.evaluate(() => document.body.classList.contains("waiting")), false);
    await page.click("#choose");
    await page.waitForSelector("#cards[open] .card");
    assert.equal(await page.locator("#cards .card").count(), 2);
    assert.deepEqual(complaints, []);
  } finally {
    await browser.close();
    assert.equal(await daemon.stop(), 0, daemon.said());
  }
});
