// /progressive in Node and its page in Chromium: a tile refines while it arrives, the slider goes
// from coarse to fine, and tiles at different states leave no gap.
import assert from "node:assert/strict";
import {mkdirSync} from "node:fs";
import {after, before, test} from "node:test";
import decoder from "@here/quantized-mesh-decoder";
import {ProgressiveMesh} from "../../server/viewer/progressive_mesh.js";
import {TpmStream} from "../../server/viewer/tpm.js";
import {openBrowser, openPage} from "./browser.mjs";
import {ROOT, startDaemon} from "./daemon.mjs";

let daemon, browser, page, complaints;

before(async () => {
  daemon = await startDaemon("testdata/rainier.tif", "--from-datum", "egm96", "--to-datum", "ellipsoid");
  browser = await openBrowser();
  ({page, complaints} = await openPage(browser, daemon.origin, {width: 1100, height: 700}));
  await page.goto(`${daemon.origin}/viewer/progressive.html?link=64e3`);
  mkdirSync(`${ROOT}/build/shots`, {recursive: true});
});

after(async () => {
  await browser?.close();
  if (daemon) assert.equal(await daemon.stop(), 0, daemon.said());
});

const TILE = "/progressive/rainier/12/1325/3112";

async function streamed(path) {
  const reply = await fetch(daemon.origin + path);
  assert.equal(reply.status, 200);
  const stream = new TpmStream();
  for await (const bytes of reply.body) stream.feed(bytes);
  return stream;
}

/// Corners of all triangles as text, whatever their order.
const cornersOf = (triangles, corner) =>
  Array.from({length: triangles.length / 3}, (_, i) => {
    const all = [0, 1, 2].map((k) => corner(triangles[3 * i + k]).join());
    const first = all.indexOf([...all].sort()[0]);
    return [all[first], all[(first + 1) % 3], all[(first + 2) % 3]].join(" ");
  }).sort();

test("the stream ends in the tile that globe clients get, triangle by triangle", async () => {
  const tile = decoder.default(await (await fetch(`${daemon.origin}/terrain/rainier/12/1325/3112.terrain?extensions=metadata`)).arrayBuffer());
  const stream = await streamed(TILE);
  assert.ok(stream.complete);
  const mesh = new ProgressiveMesh(stream);
  mesh.seek(stream.splits);
  const n = tile.vertexData.length / 3;
  const {minHeight, maxHeight} = tile.header;
  const inTile = (v) => [tile.vertexData[v], tile.vertexData[n + v], minHeight + (tile.vertexData[2 * n + v] * (maxHeight - minHeight)) / 32767];
  const lattice = mesh.lattice;
  const inStream = (v) => [lattice[3 * v], lattice[3 * v + 1] + 32767, lattice[3 * v + 2] * stream.header.zStep];
  assert.deepEqual(cornersOf(mesh.triangles(), inStream), cornersOf(tile.triangleIndices, inTile));
});

test("neighbours agree along their edge, whatever their states", async () => {
  const [west, east] = await Promise.all([streamed(TILE), streamed("/progressive/rainier/12/1326/3112")]);
  const side = (stream, share, x) => {
    const mesh = new ProgressiveMesh(stream);
    mesh.seek(Math.floor(share * stream.splits));
    const {lattice} = mesh;
    return Array.from({length: mesh.vertexCount}, (_, v) => lattice.subarray(3 * v, 3 * v + 3))
      .filter((p) => p[0] === x).map((p) => `${p[1]} ${p[2] * stream.header.zStep}`).sort();
  };
  const whole = side(west, 1, 32767);
  assert.ok(whole.length > 5);
  for (const [a, b] of [[0, 0], [0, 1], [0.3, 0.7], [1, 0.5]]) {
    assert.deepEqual(side(west, a, 32767), whole);
    assert.deepEqual(side(east, b, 0), whole);
  }
});

test("a limit sends a beginning, and a range the rest", async () => {
  const whole = await streamed(TILE);
  const part = await fetch(`${daemon.origin}${TILE}?max_error=40`);
  const first = new Uint8Array(await part.arrayBuffer());
  const stream = new TpmStream();
  stream.feed(first);
  const mesh = new ProgressiveMesh(stream);
  mesh.seek(mesh.splitsForError(40));
  assert.ok(mesh.errorM <= 40, `${mesh.errorM}`);
  assert.ok(first.length < whole.bytes / 2, `${first.length} of ${whole.bytes} bytes`);
  const rest = await fetch(daemon.origin + TILE, {headers: {Range: `bytes=${first.length}-`}});
  assert.equal(rest.status, 206);
  assert.equal(rest.headers.get("content-range"), `bytes ${first.length}-${whole.bytes - 1}/${whole.bytes}`);
  stream.feed(new Uint8Array(await rest.arrayBuffer()));
  assert.ok(stream.complete);
  assert.deepEqual(stream.records.subarray(0, 14 * stream.splits), whole.records.subarray(0, 14 * whole.splits));
});

// ---- the page

const figures = () => page.evaluate(() => window.tind.view.figures);
const until = (condition) => page.waitForFunction(condition, undefined, {polling: 50});

/// Share of the picture that is terrain and not background.
const covered = () => page.evaluate(() => {
  const small = Object.assign(document.createElement("canvas"), {width: 160, height: 100});
  const pen = small.getContext("2d");
  pen.drawImage(document.getElementById("picture"), 0, 0, 160, 100);
  const {data} = pen.getImageData(0, 0, 160, 100);
  let count = 0;
  for (let i = 0; i < data.length; i += 4) count += Math.abs(data[i] - 219) + Math.abs(data[i + 1] - 232) + Math.abs(data[i + 2] - 240) > 24;
  return count / (data.length / 4);
});

test("it refines while it arrives", async () => {
  await until(() => window.tind?.view.figures.tiles === 9 && Number.isFinite(window.tind.view.figures.errorM));
  const early = await figures();
  assert.ok(!early.done && early.bytes < early.size / 2, JSON.stringify(early));
  await page.screenshot({path: `${ROOT}/build/shots/progressive-early.png`});
  assert.ok((await covered()) > 0.1);
  await page.locator("#link").selectOption("0");
  await until(() => window.tind.view.figures.done && window.tind.view.tiles.every((t) => t.shown === t.stream.splits));
  const late = await figures();
  assert.equal(late.bytes, late.size);
  assert.equal(late.triangles, late.finest);
  assert.ok(late.triangles > 3 * early.triangles && late.errorM < early.errorM / 5, JSON.stringify({early, late}));
  await until(() => document.getElementById("bytes").textContent.endsWith("all of it"));
  assert.match(await page.locator("#triangles").innerText(), /^([\d,]+) of \1 triangles$/);
  assert.match(await page.locator("#error").innerText(), /^at most \d+\.\d+ m at every post$/);
  await page.screenshot({path: `${ROOT}/build/shots/progressive.png`});
});

test("the slider goes from coarse to fine and back, and stops between two states", async () => {
  const detail = async (value) => {
    await page.locator("#detail").fill(String(value));
    await until(() => window.tind.view.tiles.every((t) => Math.abs(t.shown - Number(document.getElementById("detail").value) ** 2 * t.stream.splits) < 1e-6));
    return figures();
  };
  const coarse = await detail(0);
  await page.screenshot({path: `${ROOT}/build/shots/progressive-coarse.png`});
  const middle = await detail(0.5);
  const fine = await detail(1);
  assert.ok(coarse.triangles < middle.triangles && middle.triangles < fine.triangles);
  assert.ok(coarse.errorM > middle.errorM && middle.errorM > fine.errorM);
  const between = await page.evaluate(() => window.tind.view.tiles.some((t) => t.shown % 1 !== 0));
  await detail(0.734);
  assert.ok(between || (await page.evaluate(() => window.tind.view.tiles.some((t) => t.shown % 1 !== 0))));
});

test("by distance, what is far is coarser; a camera that trembles changes nothing", async () => {
  await page.locator("#turn").uncheck();
  await page.locator("#by-distance").check();
  await page.locator("#tolerance").fill("3");
  await page.evaluate(() => Object.assign(window.tind.orbit, {zoom: 0.4, pitch: -0.3, heading: 0}));
  const calm = async () => {
    await page.evaluate(() => (window.tind.view.still = 0));
    await until(() => window.tind.view.still > 3);
  };
  await calm();
  const states = () => page.evaluate(() => window.tind.view.tiles.map((t) => t.errorM));
  const errors = await states(); // rows from the south: the camera is there
  const mean = (list) => list.reduce((sum, x) => sum + x, 0) / list.length;
  assert.ok(mean(errors.slice(6)) > 1.2 * mean(errors.slice(0, 3)), errors.join());
  await page.screenshot({path: `${ROOT}/build/shots/progressive-distance.png`});
  for (const zoom of [0.404, 0.396, 0.404, 0.4]) {
    await page.evaluate((z) => (window.tind.orbit.zoom = z), zoom);
    await calm();
  }
  const settled = await states();
  await page.evaluate(() => (window.tind.orbit.zoom = 0.404));
  await calm();
  await page.evaluate(() => (window.tind.orbit.zoom = 0.396));
  await calm();
  assert.deepEqual(await states(), settled);
});

test("keys turn it, bring it nearer and switch; not while a control has them", async () => {
  const orbit = () => page.evaluate(() => ({heading: window.tind.orbit.heading, pitch: window.tind.orbit.pitch, zoom: window.tind.orbit.zoom}));
  await page.evaluate(() => document.activeElement.blur());
  const before = await orbit();
  for (const key of ["ArrowRight", "ArrowDown", "+"]) await page.keyboard.press(key);
  const after = await orbit();
  assert.ok(after.heading > before.heading && after.pitch > before.pitch && after.zoom < before.zoom, JSON.stringify([before, after]));
  const wires = await page.locator("#wires").isChecked();
  await page.keyboard.press("w");
  assert.equal(await page.locator("#wires").isChecked(), !wires);
  await page.locator("#level").focus();
  await page.keyboard.press("ArrowRight");
  assert.equal((await orbit()).heading, after.heading);
});

test("one finger turns, two bring it nearer", async () => {
  await page.locator("#turn").uncheck();
  const look = () => page.evaluate(() => ({heading: window.tind.orbit.heading, zoom: window.tind.orbit.zoom}));
  const client = await page.context().newCDPSession(page);
  const touch = (type, ...at) => client.send("Input.dispatchTouchEvent", {type, touchPoints: at.map(([x, y], id) => ({x, y, id}))});
  const before = await look();
  await touch("touchStart", [600, 400]);
  await touch("touchMove", [700, 400]);
  await touch("touchEnd");
  const turned = await look();
  assert.ok(turned.heading > before.heading + 0.3 && turned.zoom === before.zoom, JSON.stringify([before, turned]));
  await touch("touchStart", [600, 400], [700, 400]);
  await touch("touchMove", [550, 400], [750, 400]);
  await touch("touchEnd");
  const nearer = await look();
  assert.ok(Math.abs(nearer.zoom - turned.zoom / 2) < 0.02 * turned.zoom && nearer.heading === turned.heading, JSON.stringify([turned, nearer]));
});

test("nothing went wrong, and no other host was asked", () => assert.deepEqual(complaints, []));
