// From a parent's part to a tile as a client plays it: both ends are what the tiles say, nothing
// turns over on the way, and neighbours agree along their side.
import assert from "node:assert/strict";
import {after, before, test} from "node:test";
import {decodeQuantizedMesh} from "../../server/viewer/quantized_mesh.js";
import {decodeTransition, meshAt} from "../../server/viewer/transition.js";
import {startDaemon} from "./daemon.mjs";

let daemon;
before(async () => (daemon = await startDaemon("testdata/rainier.tif")));
after(async () => assert.equal(await daemon.stop(), 0, daemon.said()));

const bytes = async (path) => {
  const reply = await fetch(daemon.origin + path);
  assert.equal(reply.status, 200, path);
  return reply.arrayBuffer();
};

/// A tile of the deepest level whose neighbour to the east is there, too.
async function somewhere() {
  const layer = JSON.parse(new TextDecoder().decode(await bytes("/terrain/rainier/layer.json")));
  const level = layer.available.length - 1;
  const range = layer.available[level].find(({startX, endX}) => endX > startX);
  return {level, x: range.startX, y: range.startY};
}

const address = ({level, x, y}) => `${level}/${x}/${y}`;

/// [u, v, metres] of each vertex, as the decoder of tiles has them.
async function tileVertices(id) {
  const tile = decodeQuantizedMesh(await bytes(`/terrain/rainier/${address(id)}.terrain`));
  const range = tile.maxHeight - tile.minHeight;
  return Array.from(tile.u, (u, i) => [u, tile.v[i], tile.minHeight + (tile.h[i] * range) / 32767]);
}

const twiceArea = ({u, v, triangles: t}, i) =>
  (u[t[i + 1]] - u[t[i]]) * (v[t[i + 2]] - v[t[i]]) - (v[t[i + 1]] - v[t[i]]) * (u[t[i + 2]] - u[t[i]]);

function side(mesh, at) {
  const line = [];
  for (let i = 0; i < mesh.u.length; ++i) if (mesh.u[i] === at) line.push([mesh.v[i], mesh.height[i]]);
  return line.sort((a, b) => a[0] - b[0]);
}

/// Height of the surface at (u, v).
function heightAt(mesh, u, v) {
  const {triangles: t} = mesh;
  for (let i = 0; i < t.length; i += 3) {
    const corners = [t[i], t[i + 1], t[i + 2]];
    const weights = [0, 1, 2].map((k) => {
      const [a, b] = [corners[(k + 1) % 3], corners[(k + 2) % 3]];
      return (mesh.u[a] - u) * (mesh.v[b] - v) - (mesh.v[a] - v) * (mesh.u[b] - u);
    });
    const sum = weights[0] + weights[1] + weights[2];
    if (sum > 0 && weights.every((w) => w >= -1e-9 * sum))
      return corners.reduce((z, c, k) => z + (weights[k] / sum) * mesh.height[c], 0);
  }
  return NaN;
}

test("a transition is exact at both ends and turns nothing over", async () => {
  const id = await somewhere();
  const way = decodeTransition(await bytes(`/transition/rainier/${address(id)}`));
  assert.deepEqual([way.level, way.x, way.y], [id.level, id.x, id.y]);

  // s = 1: every vertex of the tile, at its place to the last bit.
  const end = meshAt(way, 1);
  const there = new Set(Array.from(end.u, (u, i) => `${u} ${end.v[i]} ${end.height[i]}`));
  const fine = await tileVertices(id);
  assert.equal(way.fineVertices, fine.length);
  for (const vertex of fine) assert.ok(there.has(vertex.join(" ")), vertex.join(" "));

  // s = 0: every vertex of the parent that lies on this quarter is on the surface.
  const start = meshAt(way, 0);
  const parent = {level: id.level - 1, x: id.x >> 1, y: id.y >> 1};
  let inside = 0;
  for (const [u, v, height] of await tileVertices(parent)) {
    const [a, b] = [2 * u - 32767 * (id.x & 1), 2 * v - 32767 * (id.y & 1)];
    if (a < 0 || b < 0 || a > 32767 || b > 32767) continue;
    ++inside;
    assert.ok(Math.abs(heightAt(start, a, b) - height) < 1e-6, `${a} ${b}`);
  }
  assert.ok(inside > 3);
  assert.equal(start.triangles.length, way.triangles.length);

  const whole = 2 * 32767 ** 2;
  for (let s = 0; s <= 1; s += 1 / 64) {
    const mesh = meshAt(way, s);
    let sum = 0;
    for (let i = 0; i < mesh.triangles.length; i += 3) {
      const area = twiceArea(mesh, i);
      assert.ok(area > -1e-6, `s = ${s}`);
      sum += area;
    }
    assert.ok(Math.abs(sum - whole) < 1e-6 * whole, `s = ${s} covers the square once`);
  }
});

test("neighbours agree along their side at every s", async () => {
  const id = await somewhere();
  const west = decodeTransition(await bytes(`/transition/rainier/${address(id)}`));
  const east = decodeTransition(await bytes(`/transition/rainier/${address({...id, x: id.x + 1})}`));
  for (const s of [0, 0.001, 0.3, 0.77, 1]) assert.deepEqual(side(meshAt(west, s), 32767), side(meshAt(east, s), 0), `s = ${s}`);
});

test("sent once, then 304; damaged bytes are refused", async () => {
  const path = `${daemon.origin}/transition/rainier/${address(await somewhere())}`;
  const first = await fetch(path);
  const again = await fetch(path, {headers: {"If-None-Match": first.headers.get("etag")}});
  assert.equal(again.status, 304);
  const buffer = await first.arrayBuffer();
  for (const cut of [0, 63, 64, buffer.byteLength - 1]) assert.throws(() => decodeTransition(buffer.slice(0, cut)));
  for (let i = 0; i < 300; ++i) {
    const damaged = buffer.slice(0);
    new DataView(damaged).setUint32(4 * Math.floor((i * buffer.byteLength) / 1200), 0xfffffff0 + (i % 16), true);
    try {
      meshAt(decodeTransition(damaged), 0.5);
    } catch (error) {
      assert.match(error.message, /^transition: /);
    }
  }
});
