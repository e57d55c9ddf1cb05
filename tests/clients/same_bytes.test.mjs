// A tile is a function of source, options and address. So one SHA-256 over all tiles stands for a
// pyramid, however it came to be: with any number of threads, killed again and again on the way, made
// by the daemon on demand in any order, or read by it from the built folder.
import assert from "node:assert/strict";
import {execFile, spawn} from "node:child_process";
import {createHash} from "node:crypto";
import {existsSync, mkdtempSync, readFileSync, rmSync} from "node:fs";
import {once} from "node:events";
import {tmpdir} from "node:os";
import {join} from "node:path";
import {after, before, test} from "node:test";
import {promisify} from "node:util";
import {PROGRAM, ROOT, filesNow, startDaemon} from "./daemon.mjs";

const DEM = "testdata/rainier.tif";
let folder, built, names, wanted, daemon;

const tilesIn = (where) => filesNow(where).filter((name) => name.endsWith(".terrain")).sort();
/// Of names and bytes, in the order of the names.
function digest(tiles) {
  const hash = createHash("sha256");
  for (const [name, bytes] of tiles) hash.update(`${name} ${bytes.length}\n`).update(bytes);
  return hash.digest("hex");
}
const digestOf = (where) => digest(tilesIn(where).map((name) => [name, readFileSync(join(where, name))]));
const command = (where, threads) => ["build", DEM, "-o", where, "--threads", `${threads}`, "--progress", "none"];
const build = (where, threads) => promisify(execFile)(PROGRAM, command(where, threads), {cwd: ROOT});

/// The same numbers in every run.
function seeded(seed) {
  let state = seed;
  return () => (state = (Math.imul(state, 1664525) + 1013904223) >>> 0) / 2 ** 32;
}
function shuffled(list, random) {
  const out = [...list];
  for (let i = out.length - 1; i > 0; --i) {
    const j = Math.floor(random() * (i + 1));
    [out[i], out[j]] = [out[j], out[i]];
  }
  return out;
}

before(async () => {
  folder = mkdtempSync(join(tmpdir(), "tind-"));
  built = join(folder, "built");
  await build(built, 1);
  names = tilesIn(built);
  assert.ok(names.length > 100);
  wanted = digestOf(built);
  daemon = await startDaemon(DEM, built);
});

after(async () => {
  if (daemon) assert.equal(await daemon.stop(), 0, daemon.said());
  rmSync(folder, {recursive: true, force: true});
});

for (const threads of [2, 4, 16])
  test(`${threads} threads`, async () => {
    const where = join(folder, `threads${threads}`);
    await build(where, threads);
    assert.equal(digestOf(where), wanted);
  });

test("killed at random moments, and run again until it is done", async () => {
  const random = seeded(7), where = join(folder, "killed");
  let kills = 0;
  // Moments by what is there, not by the clock: so a slow machine gets on, too.
  for (let goal = 0; goal < names.length; goal += 1 + Math.floor(random() * 60)) {
    const program = spawn(PROGRAM, command(where, 2), {cwd: ROOT, stdio: "ignore"});
    const ended = once(program, "exit");
    while (program.exitCode === null && tilesIn(where).length <= goal) await new Promise((r) => setTimeout(r, 2 + 20 * random()));
    program.kill("SIGKILL");
    await ended;
    kills += program.signalCode === "SIGKILL";
    assert.ok(!existsSync(join(where, "layer.json")) || program.exitCode === 0);
  }
  assert.ok(kills >= 3, `${kills} kills`);
  await build(where, 2);
  assert.equal(digestOf(where), wanted);
  assert.deepEqual(readFileSync(join(where, "layer.json")), readFileSync(join(built, "layer.json")));
});

for (const dataset of ["rainier", "built"])
  test(`asked of the daemon in any order, eight at a time: ${dataset}`, async () => {
    const random = seeded(11), tiles = new Map(), etags = new Map();
    const queue = shuffled(names, random);
    const client = async () => {
      for (let name; (name = queue.pop()); ) {
        const reply = await fetch(`${daemon.origin}/terrain/${dataset}/${name}?extensions=octvertexnormals-metadata`);
        assert.equal(reply.status, 200, name);
        tiles.set(name, Buffer.from(await reply.arrayBuffer()));
        etags.set(name, reply.headers.get("etag"));
      }
    };
    await Promise.all(Array.from({length: 8}, client));
    assert.equal(digest(names.map((name) => [name, tiles.get(name)])), wanted);
    assert.equal(new Set(etags.values()).size, new Set([...tiles.values()].map((bytes) => bytes.toString("latin1"))).size);
  });

test("both layer.json list the same tiles", async () => {
  const layer = async (dataset) => (await fetch(`${daemon.origin}/terrain/${dataset}/layer.json`)).json();
  const [demand, stored] = [await layer("rainier"), await layer("built")];
  for (const key of ["available", "bounds", "minzoom", "maxzoom", "extensions", "metadataAvailability"])
    assert.deepEqual(demand[key], stored[key], key);
});
