// One tile through two decoders that we did not write; throws at the first thing that is wrong.
import * as here from '@here/quantized-mesh-decoder';
import { parse } from '@loaders.gl/core';
import { QuantizedMeshLoader } from '@loaders.gl/terrain';
import assert from 'node:assert/strict';
import { gunzipSync } from 'node:zlib';

const decodeHere = here.default.default ?? here.default;
const MAX = 32767;

const arrayBuffer = (bytes) =>
  bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.byteLength);

/** The file's bytes, unpacked when they are gzip. */
export const tileBytes = (file) => (file[0] === 0x1f && file[1] === 0x8b ? gunzipSync(file) : file);

/** {vertices, triangles, maxError} of a tile that both decoders read alike. */
export async function decodeWithBoth(bytes) {
  const tile = decodeHere(arrayBuffer(bytes));
  checkMesh(tile);
  const twin = await parse(arrayBuffer(bytes), QuantizedMeshLoader, {
    worker: false,
    'quantized-mesh': { bounds: [0, 0, MAX, MAX] },
  });
  checkSame(tile, twin);
  const metadata = checkExtensions(tile);
  return {
    vertices: tile.vertexData.length / 3,
    triangles: tile.triangleIndices.length / 3,
    maxError: metadata?.max_error_m,
  };
}

function checkMesh(tile) {
  const n = tile.vertexData.length / 3;
  const [u, v, h] = [0, 1, 2].map((k) => tile.vertexData.subarray(k * n, (k + 1) * n));
  for (const values of [u, v, h])
    for (const value of values) assert.ok(value >= 0 && value <= MAX, `${value} is outside 0..32767`);
  let doubleArea = 0;
  const indices = tile.triangleIndices;
  for (let i = 0; i < indices.length; i += 3) {
    const [a, b, c] = indices.subarray(i, i + 3);
    assert.ok(a < n && b < n && c < n, `triangle ${i / 3} names a vertex that is not there`);
    const area = (u[b] - u[a]) * (v[c] - v[a]) - (v[b] - v[a]) * (u[c] - u[a]);
    assert.ok(area > 0, `triangle ${i / 3} is not counter-clockwise`);
    doubleArea += area;
  }
  assert.equal(doubleArea, 2 * MAX * MAX, 'the triangles do not cover the tile exactly once');
  checkEdge(tile.westIndices, u, 0, v);
  checkEdge(tile.southIndices, v, 0, u);
  checkEdge(tile.eastIndices, u, MAX, v);
  checkEdge(tile.northIndices, v, MAX, u);
}

/** All vertices of the side, both corners among them. */
function checkEdge(edge, across, side, along) {
  for (const i of edge) assert.equal(across[i], side, 'an edge list names a vertex off the edge');
  const places = new Set([...edge].map((i) => along[i]));
  assert.ok(places.has(0) && places.has(MAX), 'an edge list lacks a corner');
  const expected = across.reduce((count, value) => count + (value === side), 0);
  assert.equal(edge.length, expected, 'an edge list lacks vertices');
}

function checkSame(tile, twin) {
  const n = tile.vertexData.length / 3;
  const { minHeight, maxHeight } = tile.header;
  const positions = twin.attributes.POSITION.value;
  assert.equal(positions.length, 3 * n, 'the decoders disagree about the number of vertices');
  assert.deepEqual([...twin.indices.value], [...tile.triangleIndices]);
  const tolerance = 1e-6 * Math.max(1, Math.abs(minHeight), Math.abs(maxHeight));
  for (let i = 0; i < n; ++i) {
    assert.ok(Math.abs(positions[3 * i] - tile.vertexData[i]) < 0.01);
    assert.ok(Math.abs(positions[3 * i + 1] - tile.vertexData[n + i]) < 0.01);
    const height = minHeight + (tile.vertexData[2 * n + i] / MAX) * (maxHeight - minHeight);
    assert.ok(Math.abs(positions[3 * i + 2] - height) <= tolerance);
  }
}

function checkExtensions(tile) {
  const n = tile.vertexData.length / 3;
  const { vertexNormals, metadata } = tile.extensions ?? {};
  if (vertexNormals) assert.equal(vertexNormals.length, 2 * n, 'two bytes of normal per vertex');
  if (metadata) assert.ok(Number.isFinite(metadata.max_error_m), 'max_error_m is not a number');
  return metadata;
}
