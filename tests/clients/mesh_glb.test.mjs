// Meshes as GLB: the Khronos validator.
import assert from "node:assert/strict";
import {createRequire} from "node:module";
import {execFileSync} from "node:child_process";
import {mkdtempSync, readFileSync, rmSync} from "node:fs";
import {tmpdir} from "node:os";
import {join} from "node:path";
import {test} from "node:test";
import {PROGRAM, ROOT} from "./daemon.mjs";
import {figure} from "./figure.mjs";

const {validateBytes} = createRequire(import.meta.url)("gltf-validator");

test("a mesh of every frame and with colours is valid glTF, and its node says where it is", async () => {
  const folder = mkdtempSync(join(tmpdir(), "tind-"));
  const out = join(folder, "a.glb");
  const drape = ["--method", "attribute-qem", "--attributes", "colour+normal", "--drape", "testdata/rainier.tif"];
  for (const [dem, crs, ...options] of [
    ["testdata/bigtujunga_crop.tif", "EPSG:32611", "--max-error", "20"],
    ["testdata/bigtujunga_crop.tif", undefined, "--max-error", "20", "--frame", "metric"],
    ["testdata/rainier.tif", "EPSG:4326", "--ratio", "0.02", ...drape],
  ]) {
    execFileSync(PROGRAM, ["simplify", dem, "-o", out, "--progress", "none", ...options], {cwd: ROOT, stdio: "ignore"});
    const bytes = new Uint8Array(readFileSync(out));
    const {issues, info} = await validateBytes(bytes);
    assert.equal(issues.numErrors + issues.numWarnings, 0, JSON.stringify(issues.messages.slice(0, 3)));
    assert.ok(info.totalTriangleCount > 100);
    const size = new DataView(bytes.buffer).getUint32(12, true);
    const gltf = JSON.parse(new TextDecoder().decode(bytes.subarray(20, 20 + size)));
    assert.equal(gltf.nodes[0].extras.crs, crs);
    if (!crs) assert.equal(gltf.nodes[0].extras.origin.split(" ").length, 2);
    assert.equal("COLOR_0" in gltf.meshes[0].primitives[0].attributes, options.includes("--drape"));
  }
  figure("gltf-validator", "GLB of meshes: 3 files (projected, metric, with colours), 0 errors, 0 warnings");
  rmSync(folder, {recursive: true, force: true});
});
