// A page with CesiumJS from npm and nothing else: `Cesium`, and a <div id="globe"> for its widget.
import {readFileSync} from "node:fs";
import {fileURLToPath} from "node:url";

const CESIUM = fileURLToPath(new URL("node_modules/cesium/Build/Cesium", import.meta.url));
const TYPES = {js: "text/javascript", json: "application/json", css: "text/css", wasm: "application/wasm"};
const PAGE = `<!doctype html><html><head><link rel="stylesheet" href="/cesium/Widgets/CesiumWidget/CesiumWidget.css"></head><body style="margin:0"><div id="globe" style="width:1000px;height:640px"></div>
<script>window.CESIUM_BASE_URL = "/cesium/";</script><script src="/cesium/Cesium.js"></script></body></html>`;

/// At an address of the daemon, so that its tiles are of the same origin.
export async function openCesiumPage(page, origin) {
  await page.route(`${origin}/page.html`, (route) => route.fulfill({contentType: "text/html", body: PAGE}));
  await page.route(`${origin}/cesium/**`, (route) => {
    const path = new URL(route.request().url()).pathname.replace("/cesium", "");
    route.fulfill({contentType: TYPES[path.split(".").pop()] ?? "application/octet-stream", body: readFileSync(CESIUM + path)});
  });
  await page.goto(`${origin}/page.html`);
}
