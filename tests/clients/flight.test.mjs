// A simulator's way: plan a flight, fetch what it needs in frames, the same bytes as one by one.
import assert from "node:assert/strict";
import {after, before, test} from "node:test";
import {decodeTileFrames} from "../../server/viewer/tile_frames.js";
import {startDaemon} from "./daemon.mjs";

let daemon;
before(async () => (daemon = await startDaemon("testdata/rainier.tif")));
after(async () => assert.equal(await daemon.stop(), 0, daemon.said()));

const post = (path, body) => fetch(daemon.origin + path, {method: "POST", headers: {"Content-Type": "application/json"}, body: JSON.stringify(body)});

test("plan, then tiles in frames", async () => {
  const reply = await post("/plan/rainier", {
    position: {lon: -121.8, lat: 46.8, height_m: 5000}, velocity: {east: 250}, horizon_s: 60, tolerance_px: 64,
  });
  assert.equal(reply.status, 200);
  const plan = await reply.json();
  assert.ok(plan.tiles.length > 2);
  const tiles = plan.tiles.slice(0, 8).map(({tile}) => tile);
  const missing = "20/0/0";
  const framed = await post("/tiles/rainier", {tiles: [...tiles, missing]});
  assert.equal(framed.status, 200);
  const buffer = await framed.arrayBuffer();
  const frames = decodeTileFrames(buffer);
  assert.equal(frames.length, tiles.length + 1);
  assert.equal(frames.at(-1).status, 404);
  for (const [i, tile] of tiles.entries()) {
    const alone = await fetch(`${daemon.origin}/terrain/rainier/${tile}.terrain`);
    assert.equal(`${frames[i].level}/${frames[i].x}/${frames[i].y}`, tile);
    assert.ok(Buffer.from(await alone.arrayBuffer()).equals(Buffer.from(frames[i].bytes)), tile);
  }
  for (const cut of [0, 11, 20, buffer.byteLength - 1])
    assert.throws(() => decodeTileFrames(buffer.slice(0, cut)));
});
