// What the globe page shows and can do, in Chromium, on an island made up for it: the sea, a peak, a hole
// in the data, known to the metre. Each state is one that the page's address or its controls lead to.
import assert from "node:assert/strict";
import {mkdtempSync, readFileSync, rmSync, writeFileSync} from "node:fs";
import {tmpdir} from "node:os";
import {after, before, test} from "node:test";
import {openBrowser, openPage, settled} from "./browser.mjs";
import {startDaemon} from "./daemon.mjs";

// A cone of 900 m in the sea, with ribs that a coarse mesh leaves out; in the north-east nothing is known, nor
// in a small hole on its flank.
const SIDE = 121, STEP = 0.001, WEST = 10, SOUTH = 45;
const PEAK = {lon: WEST + 60 * STEP, lat: SOUTH + 60 * STEP, height: 900};
const SEA = {lon: WEST + 6 * STEP, lat: SOUTH + 6 * STEP}, VOID = {lon: WEST + 110 * STEP, lat: SOUTH + 110 * STEP};
const HOLE = {lon: WEST + 76 * STEP, lat: SOUTH + 40 * STEP};

function island() {
  const rows = [];
  for (let row = SIDE - 1; row >= 0; --row) {
    rows.push(Array.from({length: SIDE}, (_, column) => {
      if ((column > 100 && row > 100) || (column >= 72 && column <= 80 && row >= 36 && row <= 44)) return -9999;
      const far = Math.hypot(column - 60, row - 60);
      const cone = 900 - 18 * far;
      return cone <= 0 ? 0 : Math.max(1, Math.round(cone + (far > 2 ? 40 * Math.sin(far * 0.9 + 4 * Math.atan2(row - 60, column - 60)) : 0)));
    }).join(" "));
  }
  return `ncols ${SIDE}\nnrows ${SIDE}\nxllcenter ${WEST}\nyllcenter ${SOUTH}\ncellsize ${STEP}\nNODATA_value -9999\n${rows.join("\n")}\n`;
}

let folder, daemon, browser, page, complaints;

before(async () => {
  folder = mkdtempSync(`${tmpdir()}/tind-globe-`);
  writeFileSync(`${folder}/island.asc`, island());
  writeFileSync(`${folder}/island.prj`, readFileSync(new URL("../../testdata/desert.prj", import.meta.url)));
  daemon = await startDaemon(`${folder}/island.asc`, "testdata/rainier.tif", "--from-datum", "egm96", "--to-datum", "ellipsoid");
  browser = await openBrowser();
  ({page, complaints} = await openPage(browser, daemon.origin, {width: 800, height: 520}));
  await page.goto(`${daemon.origin}/?dataset=island`);
  await settled(page);
});

after(async () => {
  await browser?.close();
  if (daemon) assert.equal(await daemon.stop(), 0, daemon.said());
  rmSync(folder, {recursive: true, force: true});
});

/// Mean colours [r, g, b] of 7 x 7 pixels around places, as drawn now but for what is written there.
const coloursAt = (places) => page.evaluate((places) => {
  const {Cesium, tind: {globe: {scene, summit}}} = window;
  summit.show = false;
  scene.render();
  summit.show = true;
  const whole = Object.assign(document.createElement("canvas"), {width: scene.canvas.width, height: scene.canvas.height});
  const pen = whole.getContext("2d", {willReadFrequently: true});
  pen.drawImage(scene.canvas, 0, 0);
  return places.map(({lon, lat}) => {
    const place = Cesium.Cartographic.fromDegrees(lon, lat);
    place.height = scene.globe.getHeight(place);
    const {x, y} = Cesium.SceneTransforms.worldToWindowCoordinates(scene, Cesium.Cartographic.toCartesian(place));
    const {data} = pen.getImageData(Math.round(x) - 3, Math.round(y) - 3, 7, 7);
    return [0, 1, 2].map((k) => data.reduce((sum, value, i) => sum + (i % 4 === k ? value : 0), 0) / 49);
  });
}, places);

const pointOf = ({lon, lat}) => page.evaluate(({lon, lat}) => {
  const {Cesium, tind: {globe: {scene}}} = window;
  const place = Cesium.Cartographic.fromDegrees(lon, lat);
  place.height = scene.globe.getHeight(place);
  const {x, y} = Cesium.SceneTransforms.worldToWindowCoordinates(scene, Cesium.Cartographic.toCartesian(place));
  return [x, y];
}, {lon, lat});

/// Straight down on the island.
const fromAbove = async (height = 30000, {lon, lat} = PEAK) => {
  await page.evaluate((camera) => (window.tind.globe.camera = {...camera, heading: 0, pitch: -90}), {lon, lat, height});
  await settled(page);
};

/// Mean difference of neighbours in the middle of the picture: 0 where nothing is shaded.
const texture = () => page.evaluate(() => {
  const {scene} = window.tind.globe;
  scene.render();
  const small = Object.assign(document.createElement("canvas"), {width: 200, height: 130});
  const pen = small.getContext("2d");
  pen.drawImage(scene.canvas, 0, 0, 200, 130);
  const {data} = pen.getImageData(80, 45, 40, 40);
  let sum = 0;
  for (let i = 4; i < data.length; i += 4) sum += Math.abs(data[i] - data[i - 4]);
  return sum / (data.length / 4);
});

const select = async (mode) => {
  await page.locator("#mode").selectOption(mode);
  await settled(page);
};

const hash = () => page.waitForTimeout(500).then(() => page.evaluate(() => decodeURIComponent(location.hash)));

// ---- what is seen

test("the whole dataset fills the frame beside the panel", async () => {
  const corners = [[0, 0], [120, 0], [0, 120], [120, 120]].map(([x, y]) => ({lon: WEST + x * STEP, lat: SOUTH + y * STEP}));
  const points = await Promise.all([...corners, PEAK].map(pointOf));
  const [xs, ys] = [0, 1].map((k) => points.map((point) => point[k]));
  const panel = await page.locator("#controls").boundingBox();
  assert.ok(Math.min(...xs) > panel.x + panel.width && Math.max(...xs) < 800 && Math.min(...ys) > 46 && Math.max(...ys) < 520, JSON.stringify(points));
  const [wide, high] = [(Math.max(...xs) - Math.min(...xs)) / (800 - panel.x - panel.width), (Math.max(...ys) - Math.min(...ys)) / (520 - 46)];
  assert.ok(Math.max(wide, high) > 0.7, `${wide} of the width, ${high} of the height: the legend is a third of both in so small a window`);
});

/// How many places of the data's box, from its lowest to its highest post, are seen under a panel; undefined where that is hidden.
const hiddenBy = async (target, panel) => {
  const box = await target.locator(panel).boundingBox();
  const points = await target.evaluate(() => {
    const {Cesium, tind: {globe: {scene, dataset: {box: {west, south, east, north}, low, high}}}} = window;
    const found = [];
    for (let i = 0; i <= 20; ++i) for (let j = 0; j <= 20; ++j) for (const height of [low, high]) {
      const {x, y} = Cesium.SceneTransforms.worldToWindowCoordinates(scene, Cesium.Cartesian3.fromDegrees(west + (i / 20) * (east - west), south + (j / 20) * (north - south), height));
      found.push([x, y]);
    }
    return found;
  });
  return box && points.filter(([x, y]) => x > box.x && x < box.x + box.width && y > box.y && y < box.y + box.height).length;
};

test("no panel lies over the data in the home view, on a desk or a phone, nor a profile on a phone", async () => {
  const {page: other, complaints: wrong} = await openPage(browser, daemon.origin, {width: 1400, height: 900});
  for (const size of [{width: 1400, height: 900}, {width: 390, height: 844}, {width: 844, height: 390}]) {
    await other.setViewportSize(size);
    for (const name of ["rainier", "island"]) {
      await other.goto("about:blank"); // what opens differs by size
      await other.goto(`${daemon.origin}/?dataset=${name}`);
      await other.waitForFunction((name) => window.tind?.state.dataset?.name === name && !document.getElementById("legend").hidden, name);
      for (const panel of ["#shell", "#controls", "#tools", "#legend"]) assert.equal(await hiddenBy(other, panel), 0, `${name}, ${size.width} x ${size.height}: ${panel}`);
    }
    if (size.width > 640) continue;
    await settled(other);
    await other.locator("#drawn").filter({hasText: "triangles"}).waitFor();
    assert.equal(await hiddenBy(other, "#legend"), 0, "also when it says what is drawn");
    await other.locator("[data-tool=profile]").click();
    for (const share of [0.3, 0.7]) {
      const [x, y] = await other.evaluate((share) => {
        const {Cesium, tind: {globe: {scene, dataset: {box: {west, south, east, north}}}}} = window;
        const place = Cesium.Cartographic.fromDegrees(west + share * (east - west), south + 0.5 * (north - south));
        place.height = scene.globe.getHeight(place);
        const {x, y} = Cesium.SceneTransforms.worldToWindowCoordinates(scene, Cesium.Cartographic.toCartesian(place));
        return [x, y];
      }, share);
      await other.mouse.click(x, y);
      await other.waitForTimeout(400); // two clicks, not one that is double
    }
    await other.locator("#result .profile").waitFor();
    await other.locator("#result-at").waitFor();
    assert.equal(await hiddenBy(other, "#result"), 0, "the profile");
    const {y, height} = await other.locator("#result").boundingBox();
    assert.ok(y > 0 && y + height <= (await other.locator("#controls").boundingBox()).y, "it stands on the controls");
  }
  await other.close();
  assert.deepEqual(wrong, []);
});

test("sea, land, void and what lies outside have colours of their own", async () => {
  await fromAbove();
  const outside = {lon: WEST - 0.02, lat: SOUTH + 0.06}, land = {lon: PEAK.lon - 0.02, lat: PEAK.lat - 0.02};
  const [sea, ground, nothing, paper] = await coloursAt([SEA, land, VOID, outside]);
  const said = JSON.stringify([sea, ground, nothing, paper]);
  assert.ok(sea[2] > sea[0] + 20, `the sea is blue: ${said}`);
  assert.ok(ground[1] > ground[2] + 15, `the land is green or brown: ${said}`);
  for (const grey of [nothing, paper]) assert.ok(Math.max(...grey) - Math.min(...grey) < 16, `no data is grey: ${said}`);
  assert.ok(paper[0] > nothing[0] + 4, `hatched inside, plain outside: ${said}`);
});

test("a small hole on a flank is hatched over the ground that leads across it", async () => {
  await fromAbove();
  const [hole, beside] = await coloursAt([HOLE, {lon: HOLE.lon - 0.012, lat: HOLE.lat - 0.012}]);
  const said = JSON.stringify([hole, beside]);
  assert.ok(hole[1] > hole[2] + 6, `it has the colour of the ground: ${said}`);
  assert.ok(hole[1] - hole[2] < 0.85 * (beside[1] - beside[2]), `but paler: ${said}`);
  await select("slope");
  const [steep] = await coloursAt([HOLE]);
  assert.ok(Math.max(...steep) - Math.min(...steep) < 14, `where slopes are shown, none that nobody measured: ${steep}`);
  await select("relief");
});

test("the summit bears its height above the sea, the legend what the picture is made of", async () => {
  const at = await page.evaluate(() => {
    const {Cesium, tind: {globe: {summit: {labels}}}} = window;
    const place = Cesium.Cartographic.fromCartesian(labels.get(0).position);
    return {text: labels.get(0).text, lon: Cesium.Math.toDegrees(place.longitude), lat: Cesium.Math.toDegrees(place.latitude)};
  });
  assert.equal(at.text, "900 m"); // and some 47 m more above the ellipsoid
  assert.ok(Math.hypot(at.lon - PEAK.lon, at.lat - PEAK.lat) < STEP / 2, JSON.stringify(at));
  await fromAbove();
  await page.waitForTimeout(500);
  const [, triangles, tiles, bound] = (await page.locator("#drawn").innerText()).match(/^([\d,]+) triangles in (\d+) tiles?, no post farther off than ([\d.]+) m$/);
  const drawn = await page.evaluate(async () => {
    const {drawnTile} = await import("./viewer/globe/tiles.js");
    const {Cesium, tind: {globe: {scene, reader, dataset: {rectangle: {west, south, width, height}}}}} = window;
    const found = new Map(); // of places on a lattice: who is drawn there
    for (let i = 0; i < 1600; ++i) {
      const tile = drawnTile(scene, new Cesium.Cartographic(west + width * (i % 40 + 0.5) / 40, south + height * (Math.floor(i / 40) + 0.5) / 40));
      if (tile) found.set(reader.url(tile), tile);
    }
    const meshes = await Promise.all([...found.values()].map((tile) => reader.read(tile)));
    return {tiles: found.size, triangles: meshes.reduce((sum, {indices}) => sum + indices.length / 3, 0), bound: Math.max(...meshes.map(({metadata}) => metadata.max_error_m))};
  });
  assert.deepEqual([Number(tiles), Number(triangles.replaceAll(",", ""))], [drawn.tiles, drawn.triangles]);
  assert.ok(Math.abs(Number(bound) - drawn.bound) <= 0.5, `${bound} m, of the tiles ${drawn.bound}`);
});

test("the summit's height is not cut by the picture's edge, nor seen through the earth", async () => {
  const label = () => page.evaluate(() => {
    const {globe: {scene, summit: {labels}}} = window.tind;
    scene.render();
    const {show, horizontalOrigin} = labels.get(0);
    return {show, side: ["left", "middle", "right"][[window.Cesium.HorizontalOrigin.LEFT, window.Cesium.HorizontalOrigin.CENTER, window.Cesium.HorizontalOrigin.RIGHT].indexOf(horizontalOrigin)]};
  });
  const look = (lon, lat, height) => page.evaluate((camera) => (window.tind.globe.camera = camera), {lon, lat, height, heading: 0, pitch: -90});
  await look(PEAK.lon, PEAK.lat, 30000);
  assert.deepEqual(await label(), {show: true, side: "middle"});
  const wide = await page.evaluate(() => {
    const {scene} = window.tind.globe;
    return 29100 * Math.tan(scene.camera.frustum.fovy / 2) * scene.camera.frustum.aspectRatio / (111320 * Math.cos(Math.PI / 4));
  });
  for (const [away, side] of [[wide, "left"], [-wide, "right"]]) {
    await look(PEAK.lon + 0.97 * away, PEAK.lat, 30000);
    assert.deepEqual(await label(), {show: true, side});
  }
  for (const [away, seen] of [[90, false], [62, false], [40, true]]) { // beyond the horizon, before it where the earth covers half of it, well on this side
    await look(PEAK.lon + away, 0, 2e7);
    assert.equal((await label()).show, seen, `${away} degrees away`);
  }
  await page.keyboard.press("h");
});

test("the relief is the source's, however coarse the mesh", async () => {
  const levels = await page.evaluate(() => window.tind.state.dataset.layer.maxzoom);
  await fromAbove(20000);
  const places = [[-0.03, 0.012], [-0.012, -0.02], [0.006, 0.024], [0.02, 0.006], [0.03, -0.004]].map(([x, y]) => ({lon: PEAK.lon + x, lat: PEAK.lat + y}));
  const fine = await texture(), tints = (await coloursAt(places)).flat();
  const coarse = async (draped) => {
    await page.evaluate(([level, draped]) => {
      const {globe, looks} = window.tind;
      globe.show(draped ? globe.dataset : {...globe.dataset, source: undefined}, looks, level);
    }, [levels - 4, draped]);
    await settled(page);
    return texture();
  };
  const with_ = await coarse(true), same = (await coloursAt(places)).flat(), without = await coarse(false);
  assert.ok(Math.max(...tints.map((value, k) => Math.abs(value - same[k]))) < 12, `tints on the finest and on a coarse mesh: ${tints} and ${same}`);
  assert.ok(with_ > 0.7 * fine, `draped on a coarse mesh ${with_}, on the finest ${fine}`);
  assert.ok(with_ > 1.4 * without, `draped ${with_}, by the mesh's normals ${without}`);
  await page.evaluate(() => window.tind.state.open("island"));
  await settled(page);
});

test("contours are where the source has their height above the sea, however coarse the mesh", async () => {
  await page.locator("#mode").selectOption("contours");
  await fromAbove(6000, {lon: PEAK.lon + 0.018, lat: PEAK.lat + 0.01});
  const picture = () => page.evaluate(() => {
    const {scene} = window.tind.globe;
    scene.render();
    const middle = Object.assign(document.createElement("canvas"), {width: 240, height: 240});
    const pen = middle.getContext("2d");
    pen.drawImage(scene.canvas, 280, 140, 240, 240, 0, 0, 240, 240);
    return Array.from(pen.getImageData(0, 0, 240, 240).data.filter((_, i) => i % 4 === 0));
  });
  const shown = async (draped) => {
    await page.evaluate((draped) => {
      const {globe, looks} = window.tind;
      globe.show(draped ? globe.dataset : {...globe.dataset, source: undefined}, {...looks, mode: "contours"}, globe.dataset.layer.maxzoom - 3);
    }, draped);
    await settled(page);
    return picture();
  };
  const off = (a, b) => a.reduce((sum, value, i) => sum + Math.abs(value - b[i]), 0) / a.length;
  const fine = await picture(), coarse = await shown(true), without = await shown(false);
  assert.ok(off(fine, coarse) < 0.5 * off(fine, without), `on a coarse mesh off by ${off(fine, coarse)}, by its own heights by ${off(fine, without)}`);
  await page.evaluate(() => window.tind.state.open("island"));
  await select("relief");
});

test("shadings differ, and the legend says what they mean", async () => {
  await fromAbove();
  const seen = new Map(), words = {relief: /^Metres above the sea \(EGM96\)$/, multi: /^Metres/, slope: /^Slope, degrees$/, aspect: /looks towards/, contours: /sea \(EGM96\); lines every 20\sm/};
  for (const [mode, word] of Object.entries(words)) {
    await select(mode);
    seen.set(mode, (await coloursAt([{lon: PEAK.lon - 0.015, lat: PEAK.lat + 0.013}, {lon: PEAK.lon + 0.02, lat: PEAK.lat - 0.02}])).flat());
    assert.match(await page.locator("#legend-title").innerText(), word);
    assert.ok(await page.locator("#legend-ticks span").count() >= 3, mode);
    const ticks = await page.locator("#legend-ticks span").evaluateAll((all) => all.map((tick) => tick.getBoundingClientRect()).map(({left, right}) => ({left, right})));
    for (const [i, {left}] of ticks.entries()) assert.ok(i === 0 || left > ticks[i - 1].right, `${mode}: ${JSON.stringify(ticks)}`);
    if (mode !== "relief") assert.match(await hash(), new RegExp(`mode=${mode}`));
  }
  const modes = [...seen.keys()];
  for (const [i, a] of modes.entries())
    for (const b of modes.slice(i + 1))
      assert.ok(seen.get(a).some((value, k) => Math.abs(value - seen.get(b)[k]) > 6), `${a} looks like ${b}`);
  await select("relief");
});

test("the sun moves the light", async () => {
  await fromAbove();
  const flanks = [{lon: PEAK.lon - 0.025, lat: PEAK.lat}, {lon: PEAK.lon + 0.025, lat: PEAK.lat}];
  const lightFrom = async (azimuth) => {
    await page.locator("#azimuth").fill(String(azimuth));
    await settled(page);
    const [west, east] = await coloursAt(flanks);
    return west[1] - east[1];
  };
  const [fromWest, fromEast] = [await lightFrom(270), await lightFrom(90)];
  assert.ok(fromWest > 15 && fromEast < -15, `west less east: ${fromWest} and ${fromEast}`);
  assert.match(await hash(), /sun=90,38/);
  await page.locator("#azimuth").fill("315");
});

test("the error is seen: more of it on coarser meshes, never beyond what the tiles state by much", async () => {
  await fromAbove();
  const errorAt = async (level) => {
    await page.evaluate((level) => {
      const {globe, looks} = window.tind;
      globe.show(globe.dataset, {...looks, mode: "error"}, level);
    }, level);
    await settled(page);
    await page.waitForTimeout(400);
    return page.evaluate(() => window.tind.globe.errors);
  };
  const deepest = await page.evaluate(() => window.tind.state.dataset.layer.maxzoom);
  const [fine, coarse] = [await errorAt(deepest), await errorAt(deepest - 4)];
  assert.ok(coarse.reach > 2 * fine.reach && coarse.reach > 1, JSON.stringify([fine, coarse]));
  assert.ok(fine.largest >= fine.reach * 0.9 && coarse.largest < 77067 / 2 ** (deepest - 4) * 1.5, JSON.stringify([fine, coarse]));
  const colours = await coloursAt([...Array(90)].map((_, i) => ({lon: PEAK.lon + (i % 30 - 15) * 0.002, lat: PEAK.lat + 0.01 * Math.floor(i / 30) - 0.007})));
  assert.ok(colours.some(([r, , b]) => r > b + 15) && colours.some(([r, , b]) => b > r + 15), `above red, below blue: ${JSON.stringify(colours)}`);
  await page.evaluate(() => window.tind.state.open("island"));
  await settled(page);
  await page.keyboard.press("e");
  await page.locator("#legend-title").filter({hasText: /^Mesh below and above the source, metres; at most [\d.]+ in view, also between posts$/}).waitFor();
  await page.keyboard.press("e");
});

test("tiles have outlines with level and error, edges hide behind the ground", async () => {
  await fromAbove();
  await page.keyboard.press("t");
  const label = page.locator("#labels span").filter({hasText: /^\d+ · ±[\d.]+ m$/});
  await label.first().waitFor();
  const z = Number((await label.first().innerText()).split(" ")[0]);
  const stated = await page.locator("#labels span").allInnerTexts(), most = Number((await page.locator("#drawn").innerText()).match(/than ([\d.]+) m$/)[1]);
  for (const text of stated) assert.ok(Number(text.match(/±([\d.]+) m/)[1]) <= most, `${text}, all of the picture ${most} m`);
  assert.ok(z > 5 && z <= await page.evaluate(() => window.tind.state.dataset.layer.maxzoom));
  assert.match(await hash(), /tiles/);
  await page.keyboard.press("t");
  await page.locator("#labels span").first().waitFor({state: "detached"});
  const plain = await texture();
  await page.keyboard.press("w");
  await page.waitForFunction(() => window.tind.globe.lines.count > 0);
  await settled(page);
  assert.ok(await texture() > plain + 1, "wires are seen");
  await page.keyboard.press("w");
  assert.equal(await page.evaluate(() => window.tind.globe.lines.count), 0);
});

// ---- finding and keeping a view

test("a link brings the view back: camera, shading, exaggeration", async () => {
  const view = "view=10.060000,44.900000,9000.0,10.00,-25.00&mode=slope&high=2&tiles";
  const {page: other, complaints: wrong} = await openPage(browser, daemon.origin, {width: 500, height: 400});
  await other.goto(`${daemon.origin}/?dataset=island#${view}`);
  await settled(other);
  const {lat, height, pitch} = await other.evaluate(() => window.tind.globe.camera);
  assert.ok(Math.abs(lat - 44.9) < 1e-5 && Math.abs(height - 9000) < 1 && Math.abs(pitch + 25) < 0.01, JSON.stringify({lat, height, pitch}));
  assert.deepEqual(await other.evaluate(() => [document.getElementById("mode").value, window.tind.globe.scene.verticalExaggeration]), ["slope", 2]);
  await other.waitForTimeout(500);
  assert.equal(new URL(other.url()).hash, `#${view}`);
  assert.equal(new URL(await other.locator("#shell nav a").nth(1).getAttribute("href"), other.url()).searchParams.get("dataset"), "island");
  await other.close();
  assert.deepEqual(wrong, []);
});

test("search finds coordinates, the summit and datasets; of nonsense it says what it takes", async () => {
  const find = async (text) => {
    await page.keyboard.press("/");
    await page.locator("#search-text").fill(text);
    await page.keyboard.press("Enter");
    await page.waitForTimeout(300);
    return page.evaluate(() => {
      const {Cesium, tind: {globe}} = window;
      const at = globe.pick(new Cesium.Cartesian2(globe.scene.canvas.clientWidth / 2, globe.scene.canvas.clientHeight / 2));
      return at && [Cesium.Math.toDegrees(at.longitude), Cesium.Math.toDegrees(at.latitude)];
    });
  };
  const [lon, lat] = await find("45.03N 10.04E");
  assert.ok(Math.hypot(lon - 10.04, lat - 45.03) < 0.005, `${lon} ${lat}`);
  const summit = await find("summit");
  assert.ok(Math.hypot(summit[0] - PEAK.lon, summit[1] - PEAK.lat) < 0.01, `${summit}`);
  await page.locator("#search-text").fill("xyzzy");
  assert.match(await page.locator("#search-found").innerText(), /Write latitude, longitude; summit; or a dataset's name/);
  await page.keyboard.press("Escape");
  await find("rain");
  await page.waitForFunction(() => window.tind.state.dataset.name === "rainier");
});

test("cards tell of each dataset, and open it", async () => {
  await page.locator("#choose").click();
  const card = page.locator(".card").filter({hasText: "island"});
  await card.waitFor();
  const words = await card.innerText();
  for (const part of [/121 × 121 posts/, /9\.\d+ km × 13\.\d+ km/, /above the ellipsoid/, /levels 0 to \d+/]) assert.match(words, part);
  await card.click();
  await page.waitForFunction(() => window.tind.state.dataset.name === "island");
  await settled(page);
  assert.equal(new URL(page.url()).searchParams.get("dataset"), "island");
});

test("north goes up, and the scale bar is as long as it says", async () => {
  await fromAbove();
  const {text, pixels, metres} = await page.evaluate(([lon, lat]) => {
    const {Cesium, tind: {globe: {scene}}} = window;
    const at = (x) => Cesium.SceneTransforms.worldToWindowCoordinates(scene, Cesium.Cartesian3.fromDegrees(x, lat, 900)).x;
    return {text: document.getElementById("scale-text").textContent, pixels: document.getElementById("scale-bar").getBoundingClientRect().width,
      metres: 0.01 * 111320 * Math.cos(lat * Math.PI / 180) / (at(lon + 0.01) - at(lon))};
  }, [PEAK.lon, PEAK.lat]);
  const said = Number(text.split(" ")[0]) * (text.endsWith("km") ? 1000 : 1);
  assert.ok(Math.abs(pixels * metres / said - 1) < 0.08, `${text}: ${pixels} px of ${metres} m`);
  await page.keyboard.press("h");
  await page.locator("#north").click();
  assert.ok(Math.abs(await page.evaluate(() => Math.sin(window.tind.globe.scene.camera.heading))) < 1e-3);
});

// ---- measuring

/// Neither panel lies over the island.
const fromBeside = async () => {
  if (await page.locator("#controls[open]").count() > 0) await page.locator("#controls summary").click();
  await fromAbove(30000, {lon: PEAK.lon + 0.12, lat: PEAK.lat});
};

const clickAt = async (place) => page.mouse.click(...await pointOf(place));

test("a profile has source, mesh and bound, by two requests", async () => {
  await fromBeside();
  const posts = [];
  page.on("request", (request) => request.method() === "POST" && posts.push(request.url()));
  await page.locator("[data-tool=profile]").click();
  await clickAt({lon: WEST + 0.03, lat: PEAK.lat});
  await clickAt({lon: WEST + 0.075, lat: PEAK.lat});
  await page.locator("#result .profile").waitFor();
  assert.equal(await page.locator("#result-title").innerText(), "Profile, above the sea (EGM96)");
  const words = await page.locator("#result-body").innerText();
  assert.match(words, /3\.5\d+ km, up \d+ m, down \d+ m/);
  const [, level, worst] = words.match(/mesh of level (\d+) and the source differ by ([\d.]+) m/);
  assert.ok(Number(worst) > 0 && Number(worst) < 77067 / 2 ** level * 2, words);
  for (const part of [".source", ".mesh", ".bound"]) assert.ok(await page.locator(`#result ${part}`).count() > 0, part);
  assert.equal(posts.length, 2, posts.join());
  assert.ok(posts.some((url) => url.includes(`surface=level%3D${level}`)));
  const box = await page.locator("#result .profile").boundingBox();
  await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
  await page.locator("#result-at").filter({hasText: /km: source [\d.]+ m, mesh [\d.]+ m/}).waitFor();
});

test("distance, area and line of sight are right", async () => {
  await fromBeside();
  const said = (text) => page.locator("#result-body").filter({hasText: text}).waitFor();
  await page.locator("[data-tool=distance]").click();
  for (const x of [0.03, 0.05, 0.07]) await clickAt({lon: WEST + x, lat: PEAK.lat});
  await said(/3\.1\d+ km along the ellipsoid/); // 0.04 degrees at 45.06 north are 3152 m
  await said(/over the ground/);
  await page.locator("[data-tool=area]").click();
  for (const [x, y] of [[0.03, 0.065], [0.06, 0.065], [0.06, 0.085], [0.03, 0.085]]) await clickAt({lon: WEST + x, lat: SOUTH + y});
  await said(/5\.2\d* km²/); // 2364 m x 2222 m
  await page.locator("[data-tool=sight]").click();
  await clickAt({lon: WEST + 0.012, lat: PEAK.lat});
  await clickAt({lon: WEST + 0.108, lat: PEAK.lat});
  await said(/The end is hidden/);
  for (const x of [0.006, 0.02]) await clickAt({lon: WEST + x, lat: SOUTH + 0.114}); // over the sea
  await said(/The end is seen/);
  await page.keyboard.press("Escape");
  assert.ok(await page.locator("#result").isHidden());
});

test("without a mouse: the arrows move what lies in the middle, and Enter measures there", async () => {
  await fromAbove(20000);
  await page.locator("[data-tool=distance]").focus();
  await page.keyboard.press("Enter");
  await page.locator("#result-body").filter({hasText: "Move with the arrow keys and press Enter along a line."}).waitFor();
  const middle = () => page.evaluate(() => {
    const {Cesium, tind: {globe}} = window;
    const at = globe.pick(new Cesium.Cartesian2(globe.scene.canvas.clientWidth / 2, globe.scene.canvas.clientHeight / 2));
    return Cesium.Math.toDegrees(at.latitude);
  });
  const before = await middle();
  await page.keyboard.press("Enter");
  for (let i = 0; i < 3; ++i) await page.keyboard.press("ArrowUp");
  await settled(page);
  const metres = 111200 * ((await middle()) - before);
  assert.ok(metres > 1500, `northwards by ${metres} m`);
  await page.keyboard.press("Enter");
  const body = page.locator("#result-body").filter({hasText: /km along the ellipsoid/});
  await body.waitFor();
  const said = 1000 * Number((await body.innerText()).match(/^([\d.]+) km/)[1]);
  assert.ok(Math.abs(said - metres) < 0.02 * metres, `${said} m, the middle moved by ${metres} m`);
  await page.keyboard.press("Escape");
});

test("a tool that gets no answer says so", async () => {
  await fromBeside();
  await page.route("**/elevation/island?*surface*", (route) => route.fulfill({status: 400, body: "{}"}));
  complaintsAllowed = 1;
  await page.locator("[data-tool=profile]").click();
  await clickAt({lon: WEST + 0.03, lat: PEAK.lat});
  await clickAt({lon: WEST + 0.075, lat: PEAK.lat});
  await page.locator("#result-body").filter({hasText: /No answer: .*400/}).waitFor();
  await page.unroute("**/elevation/island?*surface*");
  await page.locator("#result-close").click();
});
let complaintsAllowed = 0;

test("the readout has heights above sea and ellipsoid, and copies the place", async () => {
  await fromAbove();
  await page.mouse.move(...await pointOf(PEAK));
  await page.locator("#source-height").filter({hasText: /^[89]\d\d\.\d m above the sea \(EGM96\), 9\d\d\.\d m above the ellipsoid$/}).waitFor();
  assert.ok(await page.locator("#tile a").count() === 2);
  await page.evaluate(() => Object.defineProperty(navigator, "clipboard", {value: {writeText: async (text) => (window.copied = text)}, configurable: true}));
  await page.locator("#copy-position").click();
  assert.match(await page.evaluate(() => window.copied), /^45\.0\d+° N, 10\.0\d+° E$/);
});

// ---- beside, and away

test("another level beside it follows the camera", async () => {
  await page.locator("#controls summary").click();
  await page.locator("#other").selectOption("island");
  await page.locator("#other-level").fill("8");
  await page.locator("#other-level").dispatchEvent("change");
  await page.waitForFunction(() => window.tind.compare.other?.scene.globe.tilesLoaded);
  await page.evaluate(({lon, lat}) => (window.tind.globe.camera = {lon, lat, height: 15000, heading: 0, pitch: -90}), PEAK);
  await settled(page);
  await page.waitForFunction(() => {
    const {compare: {other}} = window.tind;
    other.scene.requestRender();
    return other.scene.globe.tilesLoaded && other.camera.height < 15010;
  }, undefined, {polling: 200});
  const [levels, height] = await page.evaluate(async () => {
    const {drawnTiles} = await import("./viewer/globe/tiles.js");
    const {compare: {other}} = window.tind;
    return [[...drawnTiles(other.scene).values()].map(({z}) => z), other.camera.height];
  });
  assert.ok(Math.max(...levels) <= 8, `levels ${levels}`);
  assert.ok(Math.abs(height - 15000) < 1);
  assert.match(await hash(), /beside=island,8,/);
  const [fine, coarse] = await Promise.all(["main", "other"].map(async (side) => {
    const caption = page.locator(`#side-${side}`).filter({hasText: "triangles"});
    const [, level, triangles] = /^island, up to level (\d+)\n([\d,]+) triangles, ±[\d.]+ m$/.exec(await caption.textContent());
    return {level: Number(level), triangles: Number(triangles.replace(",", ""))};
  }));
  assert.ok(fine.level > 9 && coarse.level === 8 && fine.triangles > 4 * coarse.triangles, JSON.stringify([fine, coarse]));
  await page.locator("#other").selectOption("");
  assert.equal(await page.evaluate(() => window.tind.compare.other), undefined);
});

test("what is seen can be saved, as a mesh and as a picture", async () => {
  await fromAbove(10000);
  const saved = async (id) => {
    const [download] = await Promise.all([page.waitForEvent("download"), page.locator(id).click()]);
    return [download.suggestedFilename(), readFileSync(await download.path())];
  };
  const [name, mesh] = await saved("#save-mesh");
  assert.equal(name, "island.obj");
  const heights = String(mesh).match(/^v .*$/gm).map((line) => Number(line.split(" ")[3]));
  assert.ok(heights.length > 100 && Math.max(...heights) > 900 && Math.max(...heights) < 1000, `${Math.max(...heights)}`);
  const [picture, bytes] = await saved("#save-picture");
  assert.equal(picture, "island.png");
  assert.deepEqual([...bytes.subarray(0, 4)], [0x89, 0x50, 0x4e, 0x47]);
});

test("the page runs no script but its own, and asks nobody else", async () => {
  const {page: guarded} = await openPage(browser, daemon.origin, {width: 300, height: 300});
  for (const path of ["/", "/viewer/refine.html", "/viewer/progressive.html"]) {
    await guarded.goto(daemon.origin + path);
    const broken = await guarded.evaluate(() => new Promise((resolve) => {
      const said = [];
      document.addEventListener("securitypolicyviolation", ({effectiveDirective}) => {
        said.push(effectiveDirective);
        if (said.length === 2) resolve(said.sort());
      });
      document.body.append(Object.assign(document.createElement("script"), {textContent: "window.injected = 1"}));
      fetch("http://127.0.0.1:9/").catch(() => {});
    }));
    assert.deepEqual(broken, ["connect-src", "script-src-elem"], path);
    assert.equal(await guarded.evaluate(() => window.injected), undefined);
  }
  await guarded.close();
});

test("nothing moves by itself for who does not want it", async () => {
  const {page: calm} = await openPage(browser, daemon.origin, {width: 300, height: 300});
  await calm.emulateMedia({reducedMotion: "reduce"});
  await calm.goto(`${daemon.origin}/viewer/progressive.html`);
  assert.equal(await calm.locator("#turn").isChecked(), false);
  await calm.goto(`${daemon.origin}/viewer/refine.html`);
  assert.equal(await calm.locator("#fly").isChecked(), false);
  await calm.close();
});

test("nothing went wrong, and no other host was asked", () => assert.equal(complaints.filter((text) => !/400/.test(text)).length + Math.max(0, complaints.length - 2 * complaintsAllowed), 0, complaints.join("\n")));
