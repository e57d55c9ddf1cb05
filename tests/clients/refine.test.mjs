// The page of view-dependent refinement in Chromium: terrain is seen, the mesh follows the flight by
// small changes, and a coarser tolerance takes fewer triangles.
import assert from "node:assert/strict";
import {mkdirSync, mkdtempSync, readFileSync, rmSync, writeFileSync} from "node:fs";
import {tmpdir} from "node:os";
import {after, before, test} from "node:test";
import {openBrowser, openPage} from "./browser.mjs";
import {ROOT, startDaemon} from "./daemon.mjs";

let folder, daemon, browser, page, complaints;

before(async () => {
  folder = mkdtempSync(`${tmpdir()}/tind-refine-`); // a plateau of 800 m by 1.1 km, higher than it is wide
  const rows = Array.from({length: 11}, (_, row) => Array.from({length: 11}, (_, column) => 3000 + ((row * 7 + column * 5) % 9)).join(" "));
  writeFileSync(`${folder}/plateau.asc`, `ncols 11\nnrows 11\nxllcenter 10\nyllcenter 45\ncellsize 0.001\n${rows.join("\n")}\n`);
  writeFileSync(`${folder}/plateau.prj`, readFileSync(new URL("../../testdata/desert.prj", import.meta.url)));
  daemon = await startDaemon("testdata/rainier.tif", `${folder}/plateau.asc`, "--from-datum", "egm96", "--to-datum", "ellipsoid");
  browser = await openBrowser();
  ({page, complaints} = await openPage(browser, daemon.origin, {width: 1100, height: 700}));
  await page.goto(`${daemon.origin}/viewer/refine.html`);
  await updates(3);
  mkdirSync(`${ROOT}/build/shots`, {recursive: true});
});

after(async () => {
  await browser?.close();
  if (daemon) assert.equal(await daemon.stop(), 0, daemon.said());
  rmSync(folder, {recursive: true, force: true});
});

/// Until so many more views have been answered.
async function updates(count) {
  const from = await page.evaluate(() => window.tind?.flight.updates ?? 0);
  await page.waitForFunction((goal) => window.tind?.flight.updates >= goal, from + count);
}

const triangles = () => page.evaluate(() => window.tind.flight.mesh.triangles.size);

/// Mean step of luminance between neighbours in the lower half: 0 for a flat colour.
const texture = () => page.evaluate(() => {
  const small = Object.assign(document.createElement("canvas"), {width: 160, height: 100});
  const pen = small.getContext("2d");
  pen.drawImage(document.getElementById("picture"), 0, 0, 160, 100);
  const {data} = pen.getImageData(0, 50, 160, 50);
  let sum = 0;
  for (let i = 4; i < data.length; i += 4) sum += Math.abs(data[i] - data[i - 4]);
  return sum / (data.length / 4);
});

test("terrain is seen, with the figures", async () => {
  assert.ok((await texture()) > 2, `texture ${await texture()}`);
  assert.match(await page.locator("#triangles").innerText(), /^[\d,]+ triangles$/);
  assert.match(await page.locator("#error").innerText(), /^at most 2\.0 px/);
  await page.screenshot({path: `${ROOT}/build/shots/refine.png`});
});

test("while it flies, little changes from view to view", async () => {
  const whole = await page.evaluate(() => window.tind.flight.received / window.tind.flight.updates);
  await updates(10);
  const [added, all] = await page.evaluate(() => [document.getElementById("change").textContent, window.tind.flight.mesh.triangles.size]);
  assert.ok(Number(added.match(/^\+([\d,]+)/)[1].replaceAll(",", "")) < all / 5, `${added} of ${all}`);
  assert.ok(whole > 0);
});

test("a coarser tolerance takes fewer triangles, and from above one sees where", async () => {
  const fine = await triangles();
  await page.locator("#tolerance").fill("4");
  await updates(3);
  assert.ok((await triangles()) < 0.7 * fine, `${await triangles()} of ${fine}`);
  await page.locator("#tolerance").fill("1");
  await updates(3);
  await page.locator("#above").check();
  await updates(1);
  await page.screenshot({path: `${ROOT}/build/shots/refine-above.png`});
  assert.ok((await texture()) > 2);
});

test("keys switch, and change the tolerance", async () => {
  await page.evaluate(() => document.activeElement.blur());
  for (const [key, id] of [["w", "wires"], ["f", "fly"], ["a", "above"]]) {
    const before = await page.locator(`#${id}`).isChecked();
    await page.keyboard.press(key);
    assert.equal(await page.locator(`#${id}`).isChecked(), !before, id);
  }
  const said = await page.locator("#tolerance-value").innerText();
  await page.keyboard.press("-");
  assert.ok(parseFloat(await page.locator("#tolerance-value").innerText()) > parseFloat(said));
});

test("over a small plateau it flies above the ground, and slowly", async () => {
  await page.goto(`${daemon.origin}/viewer/refine.html?dataset=plateau`);
  await updates(2);
  const {height, low, top, seen} = await page.evaluate(() => {
    const {camera, low, top, picture: {gl, canvas}} = window.tind.flight;
    window.tind.flight.draw();
    const pixel = new Uint8Array(4);
    gl.readPixels(canvas.width / 2, canvas.height / 4, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
    return {height: camera.height_m, low, top, seen: [...pixel]};
  });
  assert.ok(low > 3000 && height > top && height < top + 200, JSON.stringify({height, low, top}));
  assert.ok(seen[2] < 225, `ground, not the sky: ${seen}`);
  const speed = parseFloat(await page.locator("#speed").innerText());
  assert.ok(speed > 2 && speed < 50, `${speed} m/s`);
});

test("nothing went wrong, and no other host was asked", () => assert.deepEqual(complaints, []));
