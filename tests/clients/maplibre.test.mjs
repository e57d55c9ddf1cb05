// Heights as colours and hillshades in MapLibre GL in Chromium: terrain, its own hillshade of our
// heights, our hillshade as a picture, and heights that it answers beside those of the DEM.
import assert from "node:assert/strict";
import {readFileSync} from "node:fs";
import {after, before, test} from "node:test";
import {fileURLToPath} from "node:url";
import {openBrowser, openPage} from "./browser.mjs";
import {startDaemon} from "./daemon.mjs";
import {figure} from "./figure.mjs";

const MAPLIBRE = fileURLToPath(new URL("node_modules/maplibre-gl/dist", import.meta.url));
const PAGE = `<!doctype html><html><head><link rel="stylesheet" href="/maplibre/maplibre-gl.css"><script src="/maplibre/maplibre-gl.js"></script></head>
<body style="margin:0"><div id="map" style="width:400px;height:300px"></div></body></html>`;
const PLACES = 100;
let daemon, browser, page, complaints, asked;

before(async () => {
  daemon = await startDaemon("testdata/rainier.tif");
  browser = await openBrowser();
  ({page, complaints} = await openPage(browser, daemon.origin, {width: 400, height: 300}));
  asked = [];
  page.on("request", (request) => asked.push(new URL(request.url()).pathname));
  await page.route(`${daemon.origin}/page.html`, (route) => route.fulfill({contentType: "text/html", body: PAGE}));
  await page.route(`${daemon.origin}/maplibre/**`, (route) => {
    const path = new URL(route.request().url()).pathname.replace("/maplibre", "");
    route.fulfill({contentType: path.endsWith(".css") ? "text/css" : "text/javascript", body: readFileSync(MAPLIBRE + path)});
  });
  await page.goto(`${daemon.origin}/page.html`);
});

after(async () => {
  await browser?.close();
  if (daemon) assert.equal(await daemon.stop(), 0, daemon.said());
});

/// A map of these sources and layers, once it has drawn all of it.
const draw = (style, camera) => page.evaluate(({style, camera}) => new Promise((resolve, reject) => {
  window.view?.remove();
  const map = window.view = new maplibregl.Map({container: "map", style: {version: 8, ...style}, attributionControl: false, fadeDuration: 0,
    canvasContextAttributes: {preserveDrawingBuffer: true}, maxPitch: 80, ...camera});
  map.on("error", (event) => reject(event.error));
  map.once("idle", () => resolve());
}), {style, camera});

/// Mean difference between neighbours in the picture, 0..255: 0 for a flat colour.
const texture = () => page.evaluate(() => {
  const small = Object.assign(document.createElement("canvas"), {width: 140, height: 100});
  const context = small.getContext("2d");
  context.drawImage(view.getCanvas(), 0, 0, 140, 100);
  const {data} = context.getImageData(0, 0, 140, 100);
  let sum = 0;
  for (let i = 4; i < data.length; i += 4) sum += Math.abs(data[i] - data[i - 4]);
  return sum / (data.length / 4);
});

const heights = (encoding, format = "png") => ({type: "raster-dem", url: `${daemon.origin}/rgb/rainier/tiles.json?encoding=${encoding}&format=${format}`, tileSize: 512});
const PAPER = {id: "paper", type: "background", paint: {"background-color": "#e8e0d0"}};

test("terrain is as high as the DEM", async () => {
  const {bounds: [west, bottom, east, top], maxzoom} = await (await fetch(`${daemon.origin}/rgb/rainier/tiles.json`)).json();
  const before = {};
  for (const [encoding, format] of [["mapbox", "png"], ["terrarium", "png"], ["mapbox", "webp"], ["terrarium", "webp"]]) {
    asked.length = 0;
    await draw({sources: {dem: heights(encoding, format)}, layers: [PAPER, {id: "shade", type: "hillshade", source: "dem"}],
      terrain: {source: "dem", exaggeration: 1}}, {center: [(west + east) / 2, (bottom + top) / 2], zoom: maxzoom + 2, pitch: 0});
    const seen = await page.evaluate(() => view.getBounds().toArray().flat());
    const places = Array.from({length: PLACES}, (_, k) => [
      seen[0] + (seen[2] - seen[0]) * (.05 + .9 * ((k * 37) % PLACES) / PLACES), seen[1] + (seen[3] - seen[1]) * (.05 + .9 * k / PLACES)]);
    const got = await page.evaluate((asked) => asked.map((place) => view.queryTerrainElevation(place)), places);
    const tiles = asked.filter((path) => /^\/rgb\/rainier\/\d/.test(path));
    assert.ok(tiles.length > 0 && tiles.every((path) => path.endsWith(`.${format}`)), `${tiles}`);
    before[encoding] ??= got;
    assert.deepEqual(got, before[encoding], "WebP has other heights");
    const away = [];
    for (const [k, [lon, lat]] of places.entries()) {
      // MapLibre takes a pixel's height for that of its north-western corner.
      const half = 180 / 2 ** maxzoom / 512, south = half * Math.cos(lat * Math.PI / 180);
      const {height_m: wanted} = await (await fetch(`${daemon.origin}/elevation/rainier?lon=${lon + half}&lat=${lat - south}&datum=ellipsoid`)).json();
      assert.equal(typeof got[k], "number", `${lon} ${lat}`);
      if (wanted !== null) away.push(Math.abs(got[k] - wanted));
    }
    away.sort((a, b) => a - b);
    figure("maplibre-gl", `${encoding} ${format}: ${away.length} heights, median ${away[away.length >> 1].toFixed(2)} m from the DEM, 90 % ${away[Math.floor(away.length * .9)].toFixed(2)} m, most ${away.at(-1).toFixed(2)} m`);
    assert.ok(away.length >= PLACES * .9, `${away.length} places`);
    // Between pixels it interpolates what was interpolated between posts: on ridges that cuts off.
    assert.ok(away[away.length >> 1] < 1 && away[Math.floor(away.length * .9)] < 6, `${away}`);
    assert.ok(await texture() > 1, "no relief is seen");
  }
  assert.deepEqual(complaints, []);
});

test("mountains stand in a tilted view, and coarse tiles are drawn", async () => {
  await draw({sources: {dem: heights("mapbox")}, layers: [PAPER, {id: "shade", type: "hillshade", source: "dem"}],
    terrain: {source: "dem", exaggeration: 1.5}}, {center: [-121.76, 46.82], zoom: 9.5, pitch: 60});
  assert.ok(await texture() > 1, "no relief is seen");
  if (process.env.PICTURES) await page.screenshot({path: `${process.env.PICTURES}/maplibre.png`});
  assert.deepEqual(complaints, []);
});

test("our hillshade, slope and aspect are pictures without a hole", async () => {
  for (const style of ["hillshade", "slope", "aspect"]) {
    asked.length = 0;
    await draw({sources: {shade: {type: "raster", url: `${daemon.origin}/shade/rainier/tiles.json?style=${style}`, tileSize: 512}},
      layers: [PAPER, {id: "shade", type: "raster", source: "shade"}]}, {center: [-121.76, 46.85], zoom: 10});
    assert.ok(await texture() > 1, `${style}: nothing is seen`);
    assert.ok(asked.filter((path) => path.startsWith("/shade/rainier/")).length > 1, style);
    if (process.env.PICTURES) await page.screenshot({path: `${process.env.PICTURES}/${style}.png`});
  }
  assert.deepEqual(complaints, []);
});
