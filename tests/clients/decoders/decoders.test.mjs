// Every tile of a pyramid, decoded by @here/quantized-mesh-decoder and @loaders.gl/terrain.
//   TIND_BINARY=build/release/tind node --test tests/clients/decoders/decoders.test.mjs
// TIND_TILES=DIR looks at that tile set instead of building one.
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { mkdtempSync, readFileSync, readdirSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { test } from 'node:test';
import { fileURLToPath } from 'node:url';

import { figure } from '../figure.mjs';
import { decodeWithBoth, tileBytes } from './decode.mjs';

const DEM = fileURLToPath(new URL('../../../testdata/rainier.tif', import.meta.url));

const tilesBelow = (folder) =>
  readdirSync(folder, { recursive: true })
    .filter((name) => name.endsWith('.terrain'))
    .sort()
    .map((name) => join(folder, name));

async function decodeAll(folder) {
  const tiles = tilesBelow(folder);
  let triangles = 0;
  for (const path of tiles) {
    try {
      triangles += (await decodeWithBoth(tileBytes(readFileSync(path)))).triangles;
    } catch (error) {
      error.message = `${path}: ${error.message}`;
      throw error;
    }
  }
  return { tiles: tiles.length, triangles };
}

function buildRainier(options) {
  const folder = mkdtempSync(join(tmpdir(), 'tind-decoders-'));
  execFileSync(process.env.TIND_BINARY, ['build', DEM, '-o', folder, ...options], {
    stdio: ['ignore', 'ignore', 'inherit'],
  });
  return folder;
}

for (const options of process.env.TIND_TILES ? [null] : [[], ['--gzip']]) {
  test(`both decoders read every tile ${options ?? process.env.TIND_TILES}`, async () => {
    const folder = options ? buildRainier(options) : process.env.TIND_TILES;
    try {
      const { tiles, triangles } = await decodeAll(folder);
      assert.ok(tiles > 10, `only ${tiles} tiles`);
      assert.ok(triangles > 2 * tiles, 'every tile is two triangles: no terrain');
      for (const client of ['@here/quantized-mesh-decoder', '@loaders.gl/terrain'])
        figure(client, `quantized-mesh${options?.includes('--gzip') ? ', gzip' : ''}: ${tiles} tiles, ${triangles} triangles, both decoders alike`);
    } finally {
      if (options) rmSync(folder, { recursive: true });
    }
  });
}
