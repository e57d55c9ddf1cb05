// A daemon whose DEMs are decoded by locked-down processes: the same bytes of tiles, and what kills
// such a process costs the daemon nothing.
import assert from "node:assert/strict";
import {readFileSync, readdirSync} from "node:fs";
import {after, test} from "node:test";
import {startDaemon} from "./daemon.mjs";

const daemons = [];
after(() => Promise.all(daemons.map((daemon) => daemon.stop())));

async function serve(...args) {
  const daemon = await startDaemon("rainier=testdata/rainier.tif", ...args);
  daemons.push(daemon);
  return daemon;
}

function statusOf(pid) {
  try {
    return readFileSync(`/proc/${pid}/status`, "utf8");
  } catch {
    return "";  // it has ended meanwhile
  }
}

const field = (status, name) => status.match(new RegExp(`^${name}:\\s*(\\S+)`, "m"))?.[1];

/// Processes that this one began, which have not ended.
const begunBy = (pid) => readdirSync("/proc").filter((name) => /^\d+$/.test(name)).filter((name) => {
  const status = statusOf(name);
  return field(status, "PPid") === String(pid) && field(status, "State") !== "Z";
});

async function until(condition) {
  while (!condition()) await new Promise((resolve) => setTimeout(resolve, 20));
}

const TILES = ["9/165/389", "10/331/778", "11/662/1557", "11/662/1556", "12/1325/3114", "12/1324/3114"];

async function bytesOf(daemon, tile) {
  const reply = await fetch(`${daemon.origin}/terrain/rainier/${tile}.terrain`);
  return {status: reply.status, bytes: Buffer.from(await reply.arrayBuffer()), etag: reply.headers.get("etag")};
}

/// Those that decode: not the one that they are copies of, which reads nothing.
const childrenOf = (pid) => begunBy(pid).filter((child) => field(statusOf(child), "Name") !== "tind-nursery");

test("tiles are the same bytes with and without", async () => {
  const [apart, alone] = [await serve("--sandbox", "auto"), await serve("--sandbox", "off")];
  assert.ok(childrenOf(apart.pid).length > 0);
  assert.equal(begunBy(alone.pid).length, 0);
  for (const tile of TILES) assert.deepEqual(await bytesOf(apart, tile), await bytesOf(alone, tile));
});

test("its processes are locked down, and replaced when they are killed", async (t) => {
  // Not one height is kept, so that each tile has to be read.
  const daemon = await serve("--sandbox", "auto", "--source-cache-mb", "1");
  const children = childrenOf(daemon.pid);
  assert.ok(children.length > 0);
  for (const child of children) {
    assert.equal(field(statusOf(child), "NoNewPrivs"), "1");
    if (daemon.said().includes("seccomp")) t.diagnostic("this system has no seccomp filters");
    else assert.equal(field(statusOf(child), "Seccomp"), "2");
  }
  for (const child of begunBy(daemon.pid)) process.kill(Number(child), "SIGKILL");
  await until(() => children.every((child) => !childrenOf(daemon.pid).includes(child)));
  for (const tile of TILES) assert.equal((await bytesOf(daemon, tile)).status, (await bytesOf(daemons[1], tile)).status);
  assert.equal((await fetch(`${daemon.origin}/livez`)).status, 200);
});

test("none outlives a daemon that is killed", async () => {
  const daemon = await startDaemon("rainier=testdata/rainier.tif", "--sandbox", "auto");
  const children = begunBy(daemon.pid);
  assert.ok(children.length > 1);
  daemon.signal("SIGKILL");
  await until(() => children.every((child) => ["", "Z"].includes(field(statusOf(child), "State") ?? "")));
});
