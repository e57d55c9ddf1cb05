// Tiles as GLB: the Khronos validator over a whole pyramid.
import assert from "node:assert/strict";
import {createRequire} from "node:module";
import {execFileSync} from "node:child_process";
import {mkdtempSync, readdirSync, rmSync} from "node:fs";
import {tmpdir} from "node:os";
import {join} from "node:path";
import {after, before, test} from "node:test";
import {PROGRAM, ROOT, startDaemon} from "./daemon.mjs";
import {figure} from "./figure.mjs";

const {validateBytes} = createRequire(import.meta.url)("gltf-validator");
const DEM = "testdata/rainier.tif";
let folder, daemon, names;

before(async () => {
  folder = mkdtempSync(join(tmpdir(), "tind-"));
  execFileSync(PROGRAM, ["build", DEM, "-o", join(folder, "built"), "--progress", "none"], {cwd: ROOT, stdio: "ignore"});
  names = readdirSync(join(folder, "built"), {recursive: true}).filter((name) => name.endsWith(".terrain"));
  daemon = await startDaemon(DEM, join(folder, "built"));
});

after(async () => {
  if (daemon) assert.equal(await daemon.stop(), 0, daemon.said());
  rmSync(folder, {recursive: true, force: true});
});

const glb = async (dataset, name) => {
  const reply = await fetch(`${daemon.origin}/terrain/${dataset}/${name.replace(".terrain", ".glb")}`);
  assert.equal(reply.status, 200, name);
  return new Uint8Array(await reply.arrayBuffer());
};

test("every tile is valid glTF, and the same from the DEM as from the folder", async () => {
  assert.ok(names.length > 100);
  let triangles = 0;
  for (const name of names) {
    const bytes = await glb("rainier", name);
    assert.deepEqual(await glb("built", name), bytes, name);
    const {issues, info} = await validateBytes(bytes);
    assert.equal(issues.numErrors + issues.numWarnings, 0, `${name}: ${JSON.stringify(issues.messages.slice(0, 3))}`);
    assert.ok(info.totalTriangleCount > 0);
    triangles += info.totalTriangleCount;
  }
  figure("gltf-validator", `GLB: ${names.length} tiles, ${triangles} triangles, 0 errors, 0 warnings`);
});

test("the node says what error the mesh has, and which tile it is", async () => {
  for (const name of names.filter((_, i) => i % 20 === 0)) {
    const bytes = await glb("rainier", name);
    const size = new DataView(bytes.buffer).getUint32(12, true);
    const {extras} = JSON.parse(new TextDecoder().decode(bytes.subarray(20, 20 + size))).nodes[0];
    assert.equal(extras.tile, name.replace(".terrain", ""));
    assert.ok(extras.max_error_m >= extras.rounding_m && extras.rounding_m < 1, name);
  }
});
