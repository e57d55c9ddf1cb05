// A tile is a function of source, options and address: what `tind build` writes is what
// `tind serve` sends, whether it makes the tile from the DEM or reads it from the built folder.
import assert from "node:assert/strict";
import {execFileSync} from "node:child_process";
import {mkdtempSync, readdirSync, readFileSync, rmSync} from "node:fs";
import {tmpdir} from "node:os";
import {join} from "node:path";
import {after, before, test} from "node:test";
import {PROGRAM, ROOT, startDaemon} from "./daemon.mjs";

const DEM = "testdata/rainier.tif";
let folder, built, daemon;

before(async () => {
  folder = mkdtempSync(join(tmpdir(), "tind-"));
  built = join(folder, "built");
  execFileSync(PROGRAM, ["build", DEM, "-o", built, "--threads", "1", "--progress", "none"], {cwd: ROOT, stdio: "ignore"});
  daemon = await startDaemon(DEM, built);
});

after(async () => {
  if (daemon) assert.equal(await daemon.stop(), 0, daemon.said());
  rmSync(folder, {recursive: true, force: true});
});

const tileFiles = () => readdirSync(built, {recursive: true}).filter((name) => name.endsWith(".terrain"));

test("every tile: built, on demand and from the folder", async () => {
  const files = tileFiles();
  assert.ok(files.length > 100);
  for (const file of files) {
    const wanted = readFileSync(join(built, file));
    const etags = [];
    for (const dataset of ["rainier", "built"]) {
      const reply = await fetch(`${daemon.origin}/terrain/${dataset}/${file}?extensions=octvertexnormals-metadata`);
      assert.equal(reply.status, 200, file);
      assert.ok(wanted.equals(Buffer.from(await reply.arrayBuffer())), `${file} of ${dataset}`);
      etags.push(reply.headers.get("etag"));
    }
    assert.equal(etags[0], etags[1], file);
  }
});

test("both layer.json list the same tiles", async () => {
  const layer = async (dataset) => (await fetch(`${daemon.origin}/terrain/${dataset}/layer.json`)).json();
  const [demand, stored] = [await layer("rainier"), await layer("built")];
  for (const key of ["available", "bounds", "minzoom", "maxzoom", "extensions", "metadataAvailability"])
    assert.deepEqual(demand[key], stored[key], key);
});
