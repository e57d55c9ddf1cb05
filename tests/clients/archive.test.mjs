// 3D Tiles in one file, a .3tz, in readers that nobody here wrote: 3d-tiles-tools by the index,
// loaders.gl by its hash table, Python's zipfile as any zip. Each gives the bytes of the folder.
import assert from "node:assert/strict";
import {execFileSync} from "node:child_process";
import {mkdtempSync, readFileSync, readdirSync, rmSync, statSync} from "node:fs";
import {tmpdir} from "node:os";
import {join} from "node:path";
import {after, before, test} from "node:test";
import {Tiles3DArchiveFileLoader} from "@loaders.gl/3d-tiles";
import tools from "3d-tiles-tools";
import {PROGRAM, ROOT} from "./daemon.mjs";
import {figure} from "./figure.mjs";

const DEM = "testdata/rainier.tif";
let folder, names, archive;

const build = (...more) =>
  execFileSync(PROGRAM, ["build", DEM, "-o", join(folder, "built"), "--format", "3dtiles", "--progress", "none", ...more], {cwd: ROOT, encoding: "utf8"});
const inFolder = (name) => readFileSync(join(folder, "built/3dtiles", name));

before(() => {
  folder = mkdtempSync(join(tmpdir(), "tind-"));
  archive = join(folder, "rainier.3tz");
  build("--archive", archive);
  names = readdirSync(join(folder, "built/3dtiles"), {recursive: true})
    .filter((name) => /\.(glb|subtree|json)$/.test(name) && !name.includes("tind-"));
  assert.ok(names.length > 190, `${names.length}`);
});

after(() => rmSync(folder, {recursive: true, force: true}));

test("3d-tiles-tools finds every file by the index, and no other", async () => {
  const source = await tools.TilesetSources.createAndOpen(archive);
  assert.ok(source instanceof tools.TilesetSource3tz);
  const keys = [];
  for await (const key of await source.getKeys()) keys.push(key);
  assert.deepEqual(keys.sort(), [...names].sort());
  for (const name of names) assert.deepEqual(await source.getValue(name), inFolder(name), name);
  await source.close();
  figure("3d-tiles-tools", `3tz: ${names.length} files found by the index, byte by byte`);
});

test("loaders.gl reads every file by the hashes", async () => {
  const bytes = new Uint8Array(readFileSync(archive)).buffer;
  for (const name of names) {
    const file = await Tiles3DArchiveFileLoader.parse(bytes, {"3d-tiles-archive": {path: name}});
    assert.deepEqual(Buffer.from(file), inFolder(name), name);
  }
  figure("@loaders.gl/3d-tiles", `3tz: ${names.length} files found by their hashes, byte by byte`);
});

test("any reader of zips finds nothing wrong", () => {
  const said = execFileSync("/usr/bin/python3", ["-c", `
import sys, zipfile
archive = zipfile.ZipFile(sys.argv[1])
assert archive.testzip() is None
names = archive.namelist()
assert names[0] == "tileset.json" and names[-1] == "@3dtilesIndex1@"
assert all(i.date_time == (1980, 1, 1, 0, 0, 0) and i.compress_type in (0, 8) for i in archive.infolist())
print(len(names))`, archive], {encoding: "utf8"});
  assert.equal(Number(said), names.length + 1);
  figure("Python's zipfile", `3tz: ${names.length + 1} entries, every checksum right`);
});

test("made again, it is the same, and smaller than the folder", () => {
  const first = readFileSync(archive);
  build("--archive", archive, "--threads", "3");
  assert.ok(readFileSync(archive).equals(first));
  const sum = names.reduce((bytes, name) => bytes + statSync(join(folder, "built/3dtiles", name)).size, 0);
  console.log(`${names.length} files, ${sum} bytes; the archive ${first.length}`);
  assert.ok(first.length < .8 * sum);
});
