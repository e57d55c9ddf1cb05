// The viewer in Chromium against the daemon: CesiumJS takes the tiles, heights agree with the
// source within what each tile states, the page says so, and mountains are seen.
import assert from "node:assert/strict";
import {mkdirSync} from "node:fs";
import {after, before, test} from "node:test";
import {openBrowser, openPage, settled} from "./browser.mjs";
import {ROOT, startDaemon} from "./daemon.mjs";
import {figure} from "./figure.mjs";

// testdata/rainier.tif: posts are at the pixels' centres.
const DEM = {file: "testdata/rainier.tif", west: -121.9804166666667, north: 47.0004166666667, step: 1 / 1200, cols: 577, rows: 481};
const POSTS = 1000;

let daemon, browser, page, complaints;
const asked = []; // tiles, by the viewer's own CesiumJS

before(async () => {
  daemon = await startDaemon(DEM.file, "--from-datum", "egm96", "--to-datum", "ellipsoid");
  browser = await openBrowser();
  ({page, complaints} = await openPage(browser, daemon.origin, {width: 960, height: 600}));
  page.on("request", (request) => request.url().includes(".terrain") && asked.push(request.url()));
  await page.goto(daemon.origin);
  await settled(page);
});

after(async () => {
  await browser?.close();
  if (daemon) assert.equal(await daemon.stop(), 0, daemon.said());
});

/// Luminances of the drawn globe, as a grid of numbers.
const look = (target) => target.evaluate(() => {
  const {scene} = window.tind.widget;
  scene.render();
  const small = Object.assign(document.createElement("canvas"), {width: 160, height: 100});
  const pen = small.getContext("2d");
  pen.drawImage(scene.canvas, 0, 0, 160, 100);
  const {data} = pen.getImageData(0, 0, 160, 100);
  return Array.from({length: 160 * 100}, (_, i) => 0.3 * data[4 * i] + 0.6 * data[4 * i + 1] + 0.1 * data[4 * i + 2]);
});

const meanDifference = (a, b) => a.reduce((sum, value, i) => sum + Math.abs(value - b[i]), 0) / a.length;

/// Mean step between neighbours in the lower half, where the ground is: 0 for a flat colour.
const texture = (picture) => {
  let sum = 0;
  for (let i = 160 * 50; i < 160 * 100 - 1; ++i) sum += Math.abs(picture[i + 1] - picture[i]);
  return sum / (160 * 50);
};

function randomPosts(count) {
  let state = 12345; // a fixed sequence
  const next = (below) => {
    state = (Math.imul(state, 1664525) + 1013904223) >>> 0;
    return Math.floor((state / 2 ** 32) * below);
  };
  return Array.from({length: count}, () => ({
    lon: DEM.west + (next(DEM.cols) + 0.5) * DEM.step,
    lat: DEM.north - (next(DEM.rows) + 0.5) * DEM.step,
  }));
}

async function elevation({lon, lat}) {
  const reply = await fetch(`${daemon.origin}/elevation/rainier?lon=${lon}&lat=${lat}&datum=ellipsoid`);
  assert.equal(reply.status, 200);
  return reply.json();
}

test("mountains are seen, and light makes the relief", async () => {
  const lit = await look(page);
  mkdirSync(`${ROOT}/build/shots`, {recursive: true});
  await page.mouse.move(560, 430);
  await page.locator("#tile-error").filter({hasText: / m /}).waitFor();
  await page.screenshot({path: `${ROOT}/build/shots/viewer.png`});
  await page.keyboard.press("l");
  const unlit = await look(page);
  await page.keyboard.press("l");
  assert.ok(texture(lit) > 2, `lit: ${texture(lit)}`);
  assert.ok(texture(lit) > 1.5 * texture(unlit), `lit ${texture(lit)}, unlit ${texture(unlit)}`);
});

test("the readout tells of the tile under the pointer", async () => {
  // The summit, from near: any other spot may be one of the source's voids.
  await page.evaluate(() => {
    const {globe, state: {dataset: {summit}}} = window.tind;
    globe.goTo(summit.longitude, summit.latitude, summit.height, 6000);
  });
  await settled(page);
  const {x: right, y: down} = await page.evaluate(() => {
    const {Cesium, tind: {widget: {scene}, state: {dataset: {summit}}}} = window;
    const top = Cesium.Cartesian3.fromRadians(summit.longitude, summit.latitude, summit.height);
    const {x, y} = Cesium.SceneTransforms.worldToWindowCoordinates(scene, top);
    return {x, y};
  });
  await page.mouse.move(right, down + 5);
  await page.locator("#source-height").filter({hasText: /^[\d,]+\.\d m above the sea \(EGM96\), [\d,]+\.\d m above the ellipsoid$/}).waitFor();
  const said = async (id) => page.locator(`#${id}`).innerText();
  const [z, x, y] = (await said("tile")).split(" ")[0].split("/").map(Number);
  assert.equal((await fetch(`${daemon.origin}/terrain/rainier/${z}/${x}/${y}.terrain`)).status, 200);
  assert.match(await said("tile-size"), /^[\d,]+ triangles, [\d,]+ vertices, [\d,]+ bytes$/);
  const bound = Number((await said("tile-error")).match(/at most ([\d.]+) m/)[1]);
  assert.ok(bound > 0 && bound < 77067.34 / 2 ** z + 0.05, `${bound} m at level ${z}`);
  // The mesh's height counts from the sea as the source's first, or says that it does not.
  const number = (text) => Number(text.replaceAll(",", "").replace("−", "-"));
  const [, meshSaid, datum, off] = (await said("mesh-height")).match(/^([\d.,]+) m( above the ellipsoid)?, \+?([−\d.,]+) m from the source$/);
  const [, sea, ellipsoid] = (await said("source-height")).match(/^([\d.,]+) m above the sea \(EGM96\), ([\d.,]+) m above/);
  const mesh = number(meshSaid), above = number(datum ? ellipsoid : sea);
  assert.ok(mesh > 250 && mesh < 4500);
  assert.ok(Math.abs(above + number(off) - mesh) < 0.3, `${above} m and ${off} m are the mesh's ${mesh} m${datum ?? ""}`);
  await page.keyboard.press("h");
  await settled(page);
});

test("tiles are asked for by the version of their set", async () => {
  const {version} = await (await fetch(`${daemon.origin}/terrain/rainier/layer.json`)).json();
  assert.ok(asked.length > 10);
  for (const url of asked) assert.equal(new URL(url).searchParams.get("v"), version, url);
});

test("it knows the summit, and the tints reach from the lowest to the highest post", async () => {
  const {datasets: [{highest, lowest}]} = await (await fetch(`${daemon.origin}/datasets`)).json();
  const known = await page.evaluate(() => {
    const {summit, low, high} = window.tind.state.dataset;
    return {lon: window.Cesium.Math.toDegrees(summit.longitude), lat: window.Cesium.Math.toDegrees(summit.latitude), low, high};
  });
  assert.ok(Math.hypot(known.lon - highest.lon, known.lat - highest.lat) < 1e-9, JSON.stringify(known));
  assert.deepEqual([known.low, known.high], [lowest.height_m, highest.height_m]);
});

test("the readout follows when the camera moves, and arrow keys keep it upright", async () => {
  await page.mouse.move(640, 500);
  await page.locator("#tile-error").filter({hasText: / m /}).waitFor();
  const before = await page.locator("#position").innerText();
  for (let i = 0; i < 22; ++i) await page.keyboard.press("ArrowLeft");
  await page.waitForFunction((old) => document.getElementById("position").textContent !== old, before);
  const roll = await page.evaluate(() => window.Cesium.Math.toDegrees(window.Cesium.Math.negativePiToPi(window.tind.widget.scene.camera.roll)));
  assert.ok(Math.abs(roll) < 0.01, `rolled by ${roll} degrees`);
  await page.keyboard.press("h");
  await settled(page);
});

test("wireframe and exaggeration change the picture", async () => {
  const plain = await look(page);
  await page.keyboard.press("w");
  await settled(page);
  const wires = await look(page);
  assert.ok(meanDifference(plain, wires) > 2);
  await page.screenshot({path: `${ROOT}/build/shots/wireframe.png`});
  await page.keyboard.press("w");
  await page.locator("#exaggeration").fill("3");
  await settled(page);
  assert.ok(meanDifference(plain, await look(page)) > 3);
  await page.locator("#exaggeration").fill("1");
  await settled(page);
  assert.ok(meanDifference(plain, await look(page)) < 1, "and back again");
});

test("exaggeration lifts the camera with the ground, and back", async () => {
  const above = () => page.evaluate(() => {
    const {scene} = window.tind.widget;
    const {height} = scene.camera.positionCartographic;
    return {height, ground: height - scene.globe.getHeight(scene.camera.positionCartographic)};
  });
  await page.evaluate(() => { // 200 m above a flank of the mountain
    const {widget: {scene}, state: {dataset: {summit}}} = window.tind;
    const place = new window.Cesium.Cartographic(summit.longitude, summit.latitude - 0.0005);
    const height = scene.globe.getHeight(place) + 200;
    scene.camera.setView({destination: window.Cesium.Cartesian3.fromRadians(place.longitude, place.latitude, height), orientation: {heading: 0, pitch: -0.4, roll: 0}});
  });
  await settled(page);
  const before = await above();
  await page.locator("#exaggeration").fill("3");
  await settled(page);
  const high = await above();
  assert.ok(high.height > before.height + 4000 && high.ground > 100, JSON.stringify(high));
  await page.locator("#exaggeration").fill("1");
  await settled(page);
  const back = await above();
  assert.ok(Math.abs(back.height - before.height) < 1, JSON.stringify([before, back]));
  // CesiumJS may not take the ellipsoid's normals out of tiles from which others are just being cut (EXAGGERATED).
  const kept = await page.evaluate(() => {
    const tiles = window.tind.widget.scene.globe._surface._tilesToRender;
    return tiles.map(({data: {renderedMesh}}) => renderedMesh.encoding.hasGeodeticSurfaceNormals);
  });
  assert.ok(kept.length > 0 && kept.every(Boolean), `${kept.filter(Boolean).length} of ${kept.length} tiles kept theirs`);
});

test("from far above, the air hides nothing", async () => {
  await page.evaluate(() => {
    const {widget: {scene}, state: {dataset: {summit}}} = window.tind;
    scene.camera.setView({destination: window.Cesium.Cartesian3.fromRadians(summit.longitude, summit.latitude, 300000)});
  });
  await settled(page);
  const picture = await look(page);
  const middle = picture.filter((_, i) => Math.abs((i % 160) - 80) < 6 && Math.abs(Math.floor(i / 160) - 50) < 6);
  const range = Math.max(...middle) - Math.min(...middle);
  assert.ok(range > 40, `luminances within ${range}`);
});

test("close to the ground, the deepest tiles are drawn", async () => {
  const deepest = await page.evaluate(() => {
    const {widget: {scene}, state: {dataset: {summit, layer}}} = window.tind;
    scene.camera.setView({destination: window.Cesium.Cartesian3.fromRadians(summit.longitude, summit.latitude, summit.height + 1500)});
    return layer.maxzoom;
  });
  await settled(page);
  await page.mouse.move(640, 400);
  await page.locator("#tile a").filter({hasText: new RegExp(`^${deepest}/`)}).waitFor();
});

test(`CesiumJS samples ${POSTS} posts within what their tiles state`, async () => {
  const posts = randomPosts(POSTS);
  const sampled = await page.evaluate(async (places) => {
    const {Cesium, tind: {state: {dataset}}} = window;
    // As any client makes it, with the defaults.
    const provider = await Cesium.CesiumTerrainProvider.fromUrl(dataset.url);
    const {decodeQuantizedMesh} = await import("./viewer/quantized_mesh.js");
    const level = dataset.layer.maxzoom;
    const bounds = new Map();
    const found = places.map(({lon, lat}) => Cesium.Cartographic.fromDegrees(lon, lat));
    await Cesium.sampleTerrain(provider, level, found);
    for (const place of found) {
      const {x, y} = provider.tilingScheme.positionToTileXY(place, level);
      place.tile = `${level}/${x}/${2 ** level - 1 - y}`;
      if (bounds.has(place.tile)) continue;
      const reply = await fetch(`${dataset.url}/${place.tile}.terrain?extensions=metadata`);
      bounds.set(place.tile, decodeQuantizedMesh(await reply.arrayBuffer()).metadata.max_error_m);
    }
    return found.map(({height, tile}) => ({height, tile, bound: bounds.get(tile)}));
  }, posts);

  let compared = 0;
  let worst = 0;
  for (const [i, post] of posts.entries()) {
    const source = await elevation(post);
    if (source.coverage !== "value") continue; // a void has nothing to compare with
    assert.equal(source.datum, "ellipsoid");
    const {height, tile, bound} = sampled[i];
    const off = Math.abs(height - source.height_m);
    assert.ok(off <= bound + 0.001, `post ${post.lon} ${post.lat}: ${height} in tile ${tile}, ${source.height_m} in the source, stated ${bound}`);
    worst = Math.max(worst, off / bound);
    ++compared;
  }
  assert.ok(compared > 0.95 * POSTS, `${compared} posts have a height`);
  figure("cesium", `CesiumTerrainProvider: ${compared} posts within what their tiles state, the worst at ${worst.toFixed(3)} of what its tile states`);
});

test("it fits a small screen, and a finger", async () => {
  const {page: small, complaints: wrong} = await openPage(browser, daemon.origin, {width: 390, height: 700});
  await small.goto(daemon.origin);
  await settled(small);
  await small.mouse.click(200, 350);
  await small.locator("#tile-error").filter({hasText: / m /}).waitFor();
  const fits = async (id) => {
    const box = await small.locator(`#${id}`).boundingBox();
    assert.ok(box.x >= 0 && box.y >= 0 && box.x + box.width <= 390 && box.y + box.height <= 700, `${id}: ${JSON.stringify(box)}`);
  };
  await fits("controls");
  await fits("readout");
  await small.screenshot({path: `${ROOT}/build/shots/small.png`});
  assert.ok(await small.locator("#legend").isHidden());
  await small.locator("#readout-close").click();
  assert.ok(await small.locator("#readout").isHidden());
  await fits("legend");
  await small.locator("#controls summary").click();
  await fits("controls");
  const targets = await small.locator("#controls").locator("summary:visible, .row:has(select, input):visible, input[type=range]:visible, button:visible, a:visible").all();
  assert.ok(targets.length >= 8);
  for (const target of targets) {
    const {height} = await target.boundingBox();
    assert.ok(height >= 44, `${await target.innerText()}: ${height} px`);
  }
  await small.screenshot({path: `${ROOT}/build/shots/small-open.png`});
  await small.goto(`${daemon.origin}/viewer/refine.html`);
  await small.locator("#figures").waitFor();
  await fits("figures");
  await small.close();
  assert.deepEqual(wrong, []);
});

test("no dead ends: an unknown dataset, a busy daemon, none at all", async () => {
  const {page: lost} = await openPage(browser, daemon.origin, {width: 480, height: 320});
  const faults = [(route) => route.fulfill({status: 503, headers: {"Retry-After": "1"}}), (route) => route.abort("connectionrefused")];
  await lost.route("**/layer.json", (route) => (faults.shift() ?? ((other) => other.continue()))(route));
  await lost.goto(`${daemon.origin}/?dataset=nowhere`);
  const message = lost.locator("#message");
  await message.filter({hasText: "There is no dataset named nowhere here."}).waitFor();
  for (const empty of ["#globe", "#tools"]) assert.ok(await lost.locator(empty).isHidden(), `nothing to look at in ${empty}`);
  await message.locator("button", {hasText: "Show rainier"}).click();
  await lost.waitForFunction(() => window.tind.state.dataset?.name === "rainier");
  assert.equal(faults.length, 0);
  assert.ok(await message.isHidden());
  assert.ok(await lost.locator("#globe").isVisible());
  assert.equal(new URL(lost.url()).searchParams.get("dataset"), "rainier");
  await lost.close();
});

test("without WebGL it says so, and what to do", async () => {
  const {page: plain} = await openPage(browser, daemon.origin, {width: 480, height: 320});
  await plain.addInitScript(() => {
    const real = HTMLCanvasElement.prototype.getContext;
    HTMLCanvasElement.prototype.getContext = function (kind, ...rest) {
      return kind.startsWith("webgl") ? null : real.call(this, kind, ...rest);
    };
  });
  for (const path of ["/", "/viewer/refine.html"]) {
    await plain.goto(daemon.origin + path);
    await plain.locator("#message").filter({hasText: "no WebGL 2"}).locator("button", {hasText: "Start again"}).waitFor();
  }
  await plain.close();
});

test("nothing went wrong, and no other host was asked", () => assert.deepEqual(complaints, []));
