// Heights as colours in deck.gl's TerrainLayer in Chromium, which makes meshes of them by loaders.gl:
// their vertices are as high as the DEM.
import assert from "node:assert/strict";
import {readFileSync} from "node:fs";
import {after, before, test} from "node:test";
import {fileURLToPath} from "node:url";
import {openBrowser, openPage} from "./browser.mjs";
import {startDaemon} from "./daemon.mjs";
import {figure} from "./figure.mjs";

const MODULES = fileURLToPath(new URL("node_modules", import.meta.url));
const SCRIPTS = ["core", "layers", "mesh-layers", "extensions", "geo-layers"].map((name) => `@deck.gl/${name}/dist.min.js`);
const PAGE = `<!doctype html><html><head>${SCRIPTS.map((path) => `<script src="/modules/${path}"></script>`).join("")}</head>
<body style="margin:0"><div id="deck" style="width:400px;height:300px;position:relative"></div></body></html>`;
const DECODERS = {
  mapbox: {rScaler: 6553.6, gScaler: 25.6, bScaler: .1, offset: -10000},
  terrarium: {rScaler: 256, gScaler: 1, bScaler: 1 / 256, offset: -32768},
};
const STEPS = {mapbox: .1, terrarium: 1 / 256};
let daemon, browser, page, complaints;

before(async () => {
  daemon = await startDaemon("testdata/rainier.tif");
  browser = await openBrowser();
  ({page, complaints} = await openPage(browser, daemon.origin, {width: 400, height: 300}));
  await page.route(`${daemon.origin}/page.html`, (route) => route.fulfill({contentType: "text/html", body: PAGE}));
  await page.route(`${daemon.origin}/modules/**`, (route) => {
    const path = new URL(route.request().url()).pathname.replace("/modules", "");
    route.fulfill({contentType: "text/javascript", body: readFileSync(MODULES + path)});
  });
  await page.goto(`${daemon.origin}/page.html`);
});

after(async () => {
  await browser?.close();
  if (daemon) assert.equal(await daemon.stop(), 0, daemon.said());
});

/// The vertices of all tiles that it draws: level and column of the tile, place in units of deck's
/// map (512 across, y from the south), height.
const load = (encoding) => page.evaluate(({origin, decoder, tiles, maxzoom, bounds}) => new Promise((resolve, reject) => {
  const layer = new deck.TerrainLayer({
    id: "terrain", elevationData: tiles, elevationDecoder: decoder, meshMaxError: 12, tileSize: 512, minZoom: 0, maxZoom: maxzoom, extent: bounds,
    loadOptions: {terrain: {workerUrl: `${origin}/modules/@loaders.gl/terrain/dist/terrain-worker.js`}},
    color: [200, 190, 170], material: {ambient: .3, diffuse: .9, shininess: 1}, onTileError: reject,
  });
  const verticesOf = ({content: [mesh], index}) => {
    const positions = mesh.attributes.POSITION.value, highest = new Map();
    // Skirts hang from the edges: of the vertices at one place the upper one is terrain.
    for (let i = 0; i < positions.length; i += 3) {
      const [x, y, height] = positions.subarray(i, i + 3), key = `${x},${y}`;
      if (!(highest.get(key)?.[4] > height)) highest.set(key, [index.z, index.x, x, y, height]);
    }
    return [...highest.values()];
  };
  window.shown?.finalize();
  window.shown = new deck.Deck({parent: document.getElementById("deck"), width: 400, height: 300, layers: [layer], onError: reject,
    initialViewState: {longitude: -121.76, latitude: 46.85, zoom: maxzoom, pitch: 0}, controller: false});
  const look = setInterval(() => {
    const drawn = shown.layerManager?.getLayers().find((one) => one.state?.tileset)?.state.tileset.selectedTiles;
    if (!drawn?.length || drawn.some((tile) => !tile.content?.[0])) return;
    clearInterval(look);
    resolve(drawn.flatMap(verticesOf));
  }, 200);
}), encoding);

test("vertices are as high as the DEM", async () => {
  for (const encoding of ["mapbox", "terrarium"]) {
    const {tiles: [tiles], maxzoom, bounds} = await (await fetch(`${daemon.origin}/rgb/rainier/tiles.json?encoding=${encoding}`)).json();
    const vertices = await load({origin: daemon.origin, decoder: DECODERS[encoding], tiles, maxzoom, bounds});
    assert.ok(vertices.length > 2000, `${vertices.length} vertices`);
    const away = [];
    for (let k = 0; k < 400; ++k) {
      const [z, , x, y, height] = vertices[Math.floor(k * vertices.length / 400)];
      assert.equal(z, maxzoom);
      const lon = x / 512 * 360 - 180, lat = Math.atan(Math.sinh(Math.PI * (y / 256 - 1))) * 180 / Math.PI;
      // A vertex has the height of the pixel that it is the north-western corner of.
      const half = 180 / 2 ** maxzoom / 512, south = half * Math.cos(lat * Math.PI / 180);
      const {height_m: wanted} = await (await fetch(`${daemon.origin}/elevation/rainier?lon=${lon + half}&lat=${lat - south}&datum=ellipsoid`)).json();
      if (wanted !== null) away.push(Math.abs(height - wanted));
    }
    away.sort((a, b) => a - b);
    figure("@deck.gl/geo-layers", `TerrainLayer, ${encoding} (steps of ${STEPS[encoding].toFixed(3)} m): ${vertices.length} vertices; ${away.length} of them, median ${away[away.length >> 1].toFixed(2)} m from the DEM, 90 % ${away[Math.floor(away.length * .9)].toFixed(2)} m, most ${away.at(-1).toFixed(2)} m`);
    assert.ok(away.length > 200);
    if (process.env.PICTURES) await page.screenshot({path: `${process.env.PICTURES}/deck_${encoding}.png`});
    // A tile's last row and column repeat the ones before.
    assert.ok(away[away.length >> 1] < STEPS[encoding] && away[Math.floor(away.length * .9)] < 1, "far from the DEM");
  }
  assert.deepEqual(complaints, []);
});
