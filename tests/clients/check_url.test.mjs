// `tind check` and `tind explain` of tiles that are somewhere else: behind our own daemon, and behind
// a server that does everything wrong.
import assert from "node:assert/strict";
import {execFile, execFileSync} from "node:child_process";
import {createHash} from "node:crypto";
import {once} from "node:events";
import {existsSync, mkdtempSync, readFileSync, rmSync, writeFileSync} from "node:fs";
import {createServer} from "node:http";
import {tmpdir} from "node:os";
import {join} from "node:path";
import {after, before, test} from "node:test";
import {promisify} from "node:util";
import {gzipSync} from "node:zlib";
import {PROGRAM, ROOT, startDaemon} from "./daemon.mjs";

const DEM = "testdata/rainier.tif";
let folder, built, daemon;

const tind = (...args) =>
  promisify(execFile)(PROGRAM, args, {cwd: ROOT}).then(
    ({stdout}) => ({code: 0, stdout}),
    ({code, stdout, stderr}) => ({code, stdout, stderr}));
const check = async (...args) => {
  const {stdout, stderr} = await tind("check", ...args, "--json", "--progress", "none");
  return JSON.parse(stdout || stderr);
};
const violations = (report) =>
  Object.fromEntries(report.findings.filter(({severity}) => severity !== "warning").map(({rule, count}) => [rule, count]));

before(async () => {
  folder = mkdtempSync(join(tmpdir(), "tind-"));
  built = join(folder, "built");
  execFileSync(PROGRAM, ["build", DEM, "-o", built, "--max-error", "20", "--progress", "none"], {cwd: ROOT, stdio: "ignore"});
  daemon = await startDaemon(DEM, built, "--max-error", "20");
});

after(async () => {
  if (daemon) assert.equal(await daemon.stop(), 0, daemon.said());
  rmSync(folder, {recursive: true, force: true});
});

test("a server's tiles are what the folder's are, and keep what they promise", async () => {
  const here = await check(built, "--source", DEM);
  assert.equal(here.violations, 0, JSON.stringify(here.findings));
  for (const url of ["/terrain/built", "/terrain/built/", "/terrain/built/layer.json", "/terrain/rainier/layer.json?v=1"]) {
    const there = await check(daemon.origin + url, "--source", DEM);
    assert.deepEqual(there, here, url);
  }
});

test("a daemon that takes keys is asked with the one in the environment, which goes no further", async () => {
  const key = "tind_of_a_test";
  const config = join(folder, "keys.toml");
  writeFileSync(config, `[[key]]\nname = "checks"\nsha256 = "${createHash("sha256").update(key).digest("hex")}"\nscopes = ["tiles", "read"]\n`);
  const closed = await startDaemon(built, "--config", config);
  const elsewhere = [];
  const other = createServer((request, response) => {
    elsewhere.push(request.headers.authorization);
    response.writeHead(302, {Location: `${closed.origin}${request.url}`}).end();
  }).listen(0, "127.0.0.1");
  await once(other, "listening");
  try {
    const ask = (where, TIND_KEY) => promisify(execFile)(PROGRAM, ["check", where, "--json", "--progress", "none"], {cwd: ROOT, env: {...process.env, TIND_KEY}})
      .then(({stdout}) => stdout, ({stdout, stderr}) => stdout + stderr);
    const there = `${closed.origin}/terrain/built`;
    assert.equal(JSON.parse(await ask(there, key)).violations, 0);
    assert.match(await ask(there, ""), /401; a key is taken from TIND_KEY/);
    assert.match(await ask(there, "tind_wrong"), /401; the key in TIND_KEY does not open it/);
    assert.match(await ask(there, "two words"), /TIND_KEY: a key is printable/);
    // Who sends us on to another host gets the key, being asked with it; the host does not.
    assert.match(await ask(`http://127.0.0.1:${other.address().port}/terrain/built`.replace("127.0.0.1", "localhost"), key), /401/);
    assert.ok(elsewhere.length > 0);
  } finally {
    other.close();
    assert.equal(await closed.stop(), 0, closed.said());
  }
});

test("some levels only", async () => {
  const report = await check(`${daemon.origin}/terrain/built`, "--levels", "3-5");
  assert.equal(report.violations, 0, JSON.stringify(report.findings));
  assert.deepEqual(report.levels.map(({level}) => level), [3, 4, 5]);
});

test("a tile behind a URL is explained as the one in the folder", async () => {
  const explain = async (where) => (await tind("explain", where, "10/330/778", "--source", DEM, "--json")).stdout;
  const there = JSON.parse(await explain(`${daemon.origin}/terrain/built`));
  // The method stands in the folder's build record, which no server gives away.
  const {method, ...here} = JSON.parse(await explain(built));
  assert.equal(method, "bounded");
  assert.deepEqual(there, here);
});

test("faults on the way are found: missing, broken gzip, unreadable; templates are followed", async () => {
  const layer = JSON.parse(readFileSync(join(built, "layer.json")));
  layer.tiles = ["/elsewhere/{x}-{y}@{z}?v={version}"];
  const asked = new Set();
  const server = createServer((request, response) => {
    asked.add(request.headers.accept);
    if (request.url === "/set/layer.json") return response.end(JSON.stringify(layer));
    const [, x, y, z, v] = /^\/elsewhere\/(\d+)-(\d+)@(\d+)\?v=(.+)$/.exec(request.url) ?? [];
    if (v !== layer.version) return response.writeHead(404).end();
    const file = join(built, z ?? "", x ?? "", `${y}.terrain`);
    const tile = `${z}/${x}/${y}`;
    if (!existsSync(file) || tile === "12/1322/3113") return response.writeHead(404).end();
    const bytes = readFileSync(file);
    if (tile === "12/1323/3113") return response.writeHead(500).end();
    if (tile === "12/1324/3113") return response.end(gzipSync(bytes).subarray(0, 100));
    if (tile === "12/1325/3113") return response.end(bytes.subarray(0, 100));
    response.setHeader("Content-Encoding", "gzip");
    response.end(gzipSync(bytes));
  }).listen(0, "127.0.0.1");
  await once(server, "listening");
  const report = await check(`http://127.0.0.1:${server.address().port}/set`);
  server.close();
  server.closeAllConnections();
  assert.deepEqual(violations(report), {"available.missing": 1, "tile.unread": 1, "tile.gzip": 1, "tile.truncated": 1});
  assert.ok([...asked][0].includes("extensions=octvertexnormals-watermask-metadata"));
});

test("no server, no set, no tile: one line, and an exit code", async () => {
  const gone = await tind("check", "http://127.0.0.1:1/terrain/alps");
  assert.equal(gone.code, 74);
  const none = await tind("check", `${daemon.origin}/terrain/nowhere`);
  assert.equal(none.code, 69);
  assert.match(none.stderr, /^tind: .*404\n$/);
  assert.equal((await tind("explain", `${daemon.origin}/terrain/built`, "12/0/0")).code, 69);
});
