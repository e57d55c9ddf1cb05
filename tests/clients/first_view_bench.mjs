// What somebody sees who opens a dataset in CesiumJS and flies over it: CesiumJS in Chromium does so once, and what it
// asks for is written down; then that is asked for again, six at a time as browsers do, of a daemon that has nothing
// ready (cold) and again of the same (warm). Drawing in software takes longer than any tile, so times are those of the
// second asking. Prints for the first view the seconds to its last tile, and of view and flight the times of a tile.
//
//   node tests/clients/first_view_bench.mjs [--minutes 5] [--speed 250] [--save FILE] [--replay FILE] [DEM] [OPTIONS OF serve]
import {mkdtempSync, readFileSync, rmSync, writeFileSync} from "node:fs";
import {Agent, get} from "node:http";
import {tmpdir} from "node:os";
import {openBrowser, openPage} from "./browser.mjs";
import {openCesiumPage} from "./cesium_page.mjs";
import {startDaemon} from "./daemon.mjs";

const own = {"--minutes": 5, "--speed": 250, "--save": "", "--replay": ""};
const words = process.argv.slice(2);
while (words[0] in own) own[words.shift()] = words.shift();
const [dem = "testdata/rainier.tif", ...options] = words;
const CONNECTIONS = 6;

/// The camera's way: from the west over the middle of the dataset, 2 km above its highest place, and back.
async function record() {
  const folder = mkdtempSync(`${tmpdir()}/tind-view-`);
  const daemon = await startDaemon(`it=${dem}`, "--index-dir", folder, ...options);
  const browser = await openBrowser();
  const asked = [];
  let second = -1;  // of the flight; before it the first view
  try {
    const look = async () => (await (await fetch(`${daemon.origin}/datasets`)).json()).datasets[0];
    let it;
    while ((it = await look()).state === "reading") await new Promise((resolve) => setTimeout(resolve, 500));
    const {page} = await openPage(browser, daemon.origin, {width: 1000, height: 640});
    await openCesiumPage(page, daemon.origin);
    page.on("request", (request) => {
      const path = new URL(request.url()).pathname + new URL(request.url()).search;
      if (path.startsWith("/terrain/")) asked.push({second, path, accept: request.headers().accept});
    });
    await page.evaluate(async ({box, highest}) => {
      const {Cesium} = window;
      const terrainProvider = await Cesium.CesiumTerrainProvider.fromUrl("/terrain/it", {requestVertexNormals: true});
      const widget = new Cesium.CesiumWidget("globe", {terrainProvider, baseLayer: false, useDefaultRenderLoop: false});
      const [west, south, east, north] = box;
      window.look = (metres) => {
        const width = (east - west) * 111320 * Math.cos((south + north) / 360 * Math.PI);
        const along = metres % (2 * width), there = along > width ? 2 * width - along : along;
        widget.camera.setView({
          destination: Cesium.Cartesian3.fromDegrees(west + (east - west) * there / width, (south + north) / 2, highest + 2000),
          orientation: {heading: Cesium.Math.toRadians(along > width ? 270 : 90), pitch: Cesium.Math.toRadians(-15), roll: 0},
        });
      };
      // Frames until all tiles are there, at most so many: in a flight one does not wait for them.
      window.draw = async (most) => {
        for (let frames = 0, calm = 0; frames < most && calm < 4; ++frames) {
          widget.resize();
          widget.render();
          calm = widget.scene.globe.tilesLoaded ? calm + 1 : 0;
          await new Promise((resolve) => setTimeout(resolve, 20));
        }
      };
      window.look(0);
      await window.draw(1000);
    }, {box: it.box, highest: it.highest.height_m});
    for (second = 0; second < own["--minutes"] * 60; ++second)
      await page.evaluate((metres) => (window.look(metres), window.draw(8)), second * own["--speed"]);
  } finally {
    await browser.close();
    await daemon.stop();
    rmSync(folder, {recursive: true, force: true});
  }
  return asked;
}

const agent = new Agent({keepAlive: true, maxSockets: CONNECTIONS});

/// Milliseconds, and the status, of one request.
const ask = (origin, {path, accept}) => new Promise((resolve, reject) => {
  const begin = performance.now();
  get(origin + path, {agent, headers: {Accept: accept ?? "*/*", "Accept-Encoding": "gzip"}}, (reply) => {
    reply.on("data", () => {});
    reply.on("end", () => resolve({ms: performance.now() - begin, status: reply.statusCode}));
  }).on("error", reject);
});

/// In their order, as many at a time as there are connections. Seconds in all, and the time of each.
async function play(origin, requests) {
  const begin = performance.now(), times = [];
  let next = 0, refused = 0;
  await Promise.all(Array.from({length: CONNECTIONS}, async () => {
    while (next < requests.length) {
      const {ms, status} = await ask(origin, requests[next++]);
      times.push(ms);
      refused += status === 503;
    }
  }));
  times.sort((a, b) => a - b);
  const at = (share) => times[Math.min(times.length - 1, Math.floor(times.length * share))] ?? 0;
  return {seconds: (performance.now() - begin) / 1000, median: at(0.5), p99: at(0.99), worst: at(1), refused};
}

const asked = own["--replay"] ? JSON.parse(readFileSync(own["--replay"], "utf8")) : await record();
if (own["--save"]) writeFileSync(own["--save"], JSON.stringify(asked));
const view = asked.filter(({second}) => second < 0), flight = asked.filter(({second}) => second >= 0);
console.log(`${dem}: ${view.length} requests of the first view, ${flight.length} of ${own["--minutes"]} minutes at ${own["--speed"]} m/s`);
console.log("                        last after   median      p99    worst   refused");
const folder = mkdtempSync(`${tmpdir()}/tind-view-`);
const daemon = await startDaemon(`it=${dem}`, "--index-dir", folder, ...options);
for (const state of ["cold", "warm"])
  for (const [name, requests] of [["first view", view], ["flight", flight]]) {
    const {seconds, median, p99, worst, refused} = await play(daemon.origin, requests);
    console.log(`${`${name}, ${state}`.padEnd(22)} ${seconds.toFixed(2).padStart(9)} s ${[median, p99, worst].map((ms) => `${ms.toFixed(1)} ms`.padStart(8)).join(" ")} ${String(refused).padStart(8)}`);
  }
await daemon.stop();
rmSync(folder, {recursive: true, force: true});
