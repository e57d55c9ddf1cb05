// The pictures of docs/images, for scripts/pictures.
import {statSync} from "node:fs";
import {openBrowser, openPage, settled} from "./browser.mjs";
import {ROOT, startDaemon} from "./daemon.mjs";

const SIZE = {width: 1200, height: 740}, SMALL = {width: 960, height: 600};
const MOST_BYTES = 300_000;

/// Of the page: what its address says after the #, and what is done there.
const PICTURES = {
  viewer: {async then(page) {
    await page.mouse.move(760, 430);
    await page.locator("#tile-error").filter({hasText: / m /}).waitFor();
  }},
  wires: {looks: "wires&tiles", size: SMALL, async then(page) {
    await page.evaluate(() => (document.getElementById("controls").open = false));
    await page.keyboard.press("h");
    await page.waitForTimeout(2000); // until it has begun to ask for tiles
    await settled(page);
    await page.locator("#labels span").first().waitFor();
  }},
  error: {looks: "mode=error", async then(page) {
    await page.locator("[data-tool=profile]").click();
    for (const [x, y] of [[420, 330], [700, 520]]) {
      await page.mouse.click(x, y);
      await page.waitForTimeout(500);
    }
    await page.locator("#result .profile").waitFor();
    await page.mouse.move(600, 700);
    await page.locator("#readout").evaluate((readout) => (readout.style.display = "none")); // of where the mouse happens to be
  }},
};

const daemon = await startDaemon("testdata/rainier.tif", "--from-datum", "egm96", "--to-datum", "ellipsoid");
const browser = await openBrowser();
try {
  for (const name of process.argv.length > 2 ? process.argv.slice(2) : Object.keys(PICTURES)) {
    if (!PICTURES[name]) throw new Error(`there is no picture ${name}, but ${Object.keys(PICTURES).join(", ")}`);
    const {page, complaints} = await openPage(browser, daemon.origin, PICTURES[name].size ?? SIZE);
    await page.goto(`${daemon.origin}/#${PICTURES[name].looks ?? ""}`);
    await settled(page);
    await PICTURES[name].then(page);
    await page.waitForTimeout(1000);
    const path = `${ROOT}docs/images/${name}.jpg`;
    await page.screenshot({path, type: "jpeg", quality: 82});
    await page.close();
    const {size} = statSync(path);
    console.log(`docs/images/${name}.jpg: ${size} bytes`);
    if (size > MOST_BYTES) throw new Error(`${path} is larger than ${MOST_BYTES} bytes`);
    if (complaints.length > 0) throw new Error(complaints.join("\n"));
  }
} finally {
  await browser.close();
  await daemon.stop();
}
