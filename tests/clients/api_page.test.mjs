// The page /api in Chromium: it shows the daemon's document, asks no other host, and a request that
// is tried there is answered.
import assert from "node:assert/strict";
import {mkdirSync} from "node:fs";
import {after, before, test} from "node:test";
import {openBrowser, openPage} from "./browser.mjs";
import {ROOT, startDaemon} from "./daemon.mjs";

let daemon, browser, page, complaints;

before(async () => {
  daemon = await startDaemon("alps=testdata/rainier.tif");
  browser = await openBrowser();
  ({page, complaints} = await openPage(browser, daemon.origin, {width: 1100, height: 900}));
  mkdirSync(`${ROOT}/build/shots`, {recursive: true});
});
after(async () => {
  await browser?.close();
  await daemon?.stop();
});

test("every chapter of the document is on the page", async () => {
  await page.goto(`${daemon.origin}/api`);
  await page.waitForSelector(".opblock-tag");
  await page.screenshot({path: `${ROOT}/build/shots/api.png`});
  const {tags} = await (await fetch(`${daemon.origin}/openapi.json`)).json();
  const shown = await page.$$eval(".opblock-tag", (all) => all.map((one) => one.getAttribute("data-tag")));
  assert.deepEqual(shown.sort(), tags.map((tag) => tag.name).sort());
});

test("an example is tried and answered", async () => {
  await page.click("#operations-tag-Heights");
  await page.click("#operations-Heights-getElevation .opblock-summary-control");
  await page.click("#operations-Heights-getElevation .execute");
  await page.waitForSelector("#operations-Heights-getElevation .live-responses-table .response-col_status");
  const status = await page.textContent("#operations-Heights-getElevation .live-responses-table tbody .response-col_status");
  assert.match(status, /200/);
  await page.screenshot({path: `${ROOT}/build/shots/api_elevation.png`});
});

test("nothing went wrong, and no other host was asked", () => assert.deepEqual(complaints, []));
