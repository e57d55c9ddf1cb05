// Debian's Chromium without a window, on a software GL, with nothing of its own to say to the net.
import {chromium} from "playwright-core";

const FLAGS = [
  "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist",
  "--disable-quic", "--no-first-run", "--disable-background-networking", "--disable-component-update", "--disable-sync",
];

export function openBrowser() {
  return chromium.launch({executablePath: process.env.TIND_CHROMIUM ?? "/usr/bin/chromium", headless: true, args: FLAGS});
}

/// A page that keeps what went wrong: console errors, exceptions, failed requests, and every
/// request to another origin than `origin` (data: and blob: stay inside the browser).
export async function openPage(browser, origin, viewport) {
  const page = await browser.newPage({viewport});
  page.setDefaultTimeout(240000);  // what never comes fails a test; how long it takes on a busy machine does not
  const complaints = [];
  page.on("console", (message) => message.type() === "error" && complaints.push(`console: ${message.text()}`));
  page.on("pageerror", (error) => complaints.push(`exception: ${error.message}`));
  page.on("requestfailed", (request) => {
    if (request.failure()?.errorText !== "net::ERR_ABORTED") complaints.push(`failed: ${request.url()} ${request.failure()?.errorText}`);
  });
  page.on("response", (response) => response.status() >= 400 && complaints.push(`${response.status()}: ${response.url()}`));
  page.on("request", (request) => {
    const url = new URL(request.url());
    if (url.origin !== origin && !["data:", "blob:"].includes(url.protocol)) complaints.push(`another host: ${request.url()}`);
  });
  return {page, complaints};
}

/// Until the globe has drawn every tile it wants, for some frames in a row. Frames are counted, not looks at it: on
/// a busy machine there are several looks before the first frame that knows where the camera is now.
export async function settled(page, timeout = 240000) {
  await page.evaluate(() => Object.assign(window, {calm: 0, frames: 0, seen: 0}));
  await page.waitForFunction(() => {
    const {widget, state} = window.tind ?? {};
    if (!state?.dataset) return false;
    if (!widget.useDefaultRenderLoop) throw new Error("nothing is drawn any more: CesiumJS gave up");
    widget.counted ??= widget.scene.postRender.addEventListener(() => ++window.frames);
    widget.scene.requestRender();
    if (window.frames === window.seen) return false;
    window.seen = window.frames;
    window.calm = widget.scene.globe.tilesLoaded ? window.calm + 1 : 0;
    return window.calm > 2;
  }, undefined, {timeout, polling: 150});
}
