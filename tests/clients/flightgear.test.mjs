// FlightGear's own readers of scenery: fgelev, which lets a ray fall on the ground as fgfs does for
// wheels (it needs no graphics and none of FlightGear's data), and SGBinObject, SimGear's class for
// BTG files. Beside them a reader in Python that was written from the format's description.
import assert from "node:assert/strict";
import {execFileSync, spawn, spawnSync} from "node:child_process";
import {existsSync, mkdtempSync, readFileSync, readdirSync, rmSync, writeFileSync} from "node:fs";
import {tmpdir} from "node:os";
import {join} from "node:path";
import {after, before, test} from "node:test";
import {once} from "node:events";
import {fileURLToPath} from "node:url";
import {PROGRAM, ROOT, filesNow, startDaemon} from "./daemon.mjs";
import {figure} from "./figure.mjs";

const FGELEV = [process.env.FGELEV, join(ROOT, "build/fgelev/usr/games/fgelev"), "/usr/games/fgelev", "/usr/bin/fgelev"].find((path) => path && existsSync(path));
const skip = FGELEV ? false : "fgelev is not there: scripts/setup takes it out of Debian's package flightgear; or FGELEV=path";
const SIMGEAR = existsSync("/usr/include/simgear/io/sg_binobj.hxx") ? false : "SimGear's headers are not installed (Debian: libsimgear-dev)";
const DECODERS = fileURLToPath(new URL("./decoders", import.meta.url));
const DEM = "testdata/rainier.tif";
const STEP = 1 / 1200, WEST = -121.98041666666667 + STEP / 2, NORTH = 47.000416666666666 - STEP / 2, COLS = 577, ROWS = 481;
const MAX_ERROR = 8;
let folder, scenery, daemon;

before(async () => {
  folder = mkdtempSync(join(tmpdir(), "tind-"));
  scenery = build(DEM, "scenery", "--max-error", `${MAX_ERROR}`);
  daemon = await startDaemon(DEM, "--max-error", `${MAX_ERROR}`);
});

after(async () => {
  if (daemon) assert.equal(await daemon.stop(), 0, daemon.said());
  rmSync(folder, {recursive: true, force: true});
});

function build(dem, name, ...options) {
  execFileSync(PROGRAM, ["build", dem, "-o", join(folder, name), "--format", "flightgear", "--progress", "none", ...options], {cwd: ROOT, stdio: "ignore"});
  return join(folder, name);
}

/// Of more posts than version 7 has numbers for, in one bucket.
function denseScenery() {
  const side = 300, cell = 1 / 2430;
  let state = 7;
  const noise = () => ((state = (state * 48271) % 2147483647) % 6000) / 100;
  const rows = Array.from({length: side}, () => Array.from({length: side}, () => noise().toFixed(2)).join(" "));
  writeFileSync(join(folder, "dense.asc"), `ncols ${side}\nnrows ${side}\nxllcorner 10.001\nyllcorner 45.001\ncellsize ${cell}\n${rows.join("\n")}\n`);
  return build(join(folder, "dense.asc"), "dense", "--crs", "EPSG:4326", "--from-datum", "egm96", "--to-datum", "same", "--max-error", "0.5");
}

const grounds = (scenery) => readdirSync(scenery, {recursive: true}).filter((name) => name.endsWith(".btg.gz")).sort().map((name) => join(scenery, name));

/// SimGear's reader, compiled once.
function simgear() {
  const program = join(folder, "sg_bin_object");
  if (!existsSync(program)) execFileSync("g++", ["-std=c++17", "-O1", join(DECODERS, "sg_bin_object.cpp"), "-lSimGearScene", "-lSimGearCore", "-lz", "-o", program]);
  return program;
}

/// What a reader says of files, as it prints it.
const read = (program, args) => execFileSync(program, args, {encoding: "utf8", maxBuffer: 1 << 29}).trimEnd().split("\n");

/// Sides of triangles that no other triangle has the other way round, by the ends' exact places.
function openSides(lines) {
  const sides = new Map();
  let places = [], corners = [];
  for (const line of lines) {
    if (line.startsWith("version")) places = [];
    else if (line.startsWith("v ")) places.push(line);
    else if (line.startsWith("part")) corners = [];
    else if (line.startsWith("c ")) {
      corners.push(places[Number(line.split(" ")[1])]);
      if (corners.length < 3) continue;
      for (let k = 0; k < 3; ++k) {
        const there = corners[k] + corners[(k + 1) % 3], back = corners[(k + 1) % 3] + corners[k];
        if (!sides.delete(back)) sides.set(there, [corners[k], corners[(k + 1) % 3]]);
      }
      corners = [];
    }
  }
  return [...sides.values()];
}

/// Longitude and latitude of a line "v x y z", degrees (heights of mountains do not matter here).
function placeOf(line) {
  const [x, y, z] = line.split(" ").slice(1).map(Number);
  return [Math.atan2(y, x) * 180 / Math.PI, Math.atan2(z, Math.hypot(x, y) * (1 - 6.69437999014e-3)) * 180 / Math.PI];
}

/// The ground below places [lon, lat], as fgelev prints it: whole centimetres; -1000 for a hole.
function fgelev(places, scenery) {
  const input = places.map(([lon, lat], i) => `${i} ${lon} ${lat}\n`).join("");
  const run = spawnSync(FGELEV, ["--expire", "1000000", "--fg-root", folder, "--fg-scenery", scenery],
                        {input, encoding: "utf8", maxBuffer: 1 << 26, env: {...process.env, HOME: folder, FG_HOME: join(folder, "home")}});
  const heights = new Array(places.length);
  for (const [, i, height] of run.stdout.matchAll(/^(\d+): (-?[\d.]+)/gm)) heights[i] = Number(height);
  assert.ok(heights.every((h) => h !== undefined), `fgelev answered ${heights.filter((h) => h !== undefined).length} of ${places.length}: ${run.stderr.slice(-500)}`);
  return heights;
}

/// What the daemon says of the DEM itself; null in its voids.
async function heightsAbove(places, datum) {
  const heights = [];
  for (const [lon, lat] of places) {
    const reply = await fetch(`${daemon.origin}/elevation/rainier?lon=${lon}&lat=${lat}&datum=${datum}`);
    assert.equal(reply.status, 200);
    heights.push((await reply.json()).height_m);
  }
  return heights;
}

const random = ((state) => () => (state = (state * 48271) % 2147483647) / 2147483647)(20);
/// The largest error that any bucket states.
function statedError() {
  const stgs = readdirSync(scenery, {recursive: true}).filter((name) => name.endsWith(".stg"));
  assert.equal(stgs.length, 8);
  return Math.max(...stgs.map((name) => Number(/error: ([\d.]+) m/.exec(readFileSync(join(scenery, name), "utf8"))[1])));
}

test("fgelev finds the ground at 1,000 posts, within the stated error", {skip}, async () => {
  const places = Array.from({length: 1000}, () => [WEST + Math.floor(1 + random() * (COLS - 2)) * STEP, NORTH - Math.floor(1 + random() * (ROWS - 2)) * STEP]);
  const stated = statedError();
  assert.ok(stated <= MAX_ERROR);
  const ground = fgelev(places, scenery), dem = await heightsAbove(places, "egm96");
  assert.equal(ground.filter((h) => h === -1000).length, 0, "holes");
  const known = dem.filter((h) => h !== null).length;
  assert.ok(known > 950, `${known}`);
  const worst = Math.max(...ground.map((h, i) => (dem[i] === null ? 0 : Math.abs(h - dem[i]))));
  figure("fgelev", `1,000 posts, 0 holes, ${1000 - known} of them void: at most ${worst.toFixed(2)} m from the DEM; stated ${stated} m`);
  assert.ok(worst <= stated + 0.02, `${worst} > ${stated}`);  // fgelev's float, and rounding of /elevation
});

test("fgelev finds the ground at 1,000 places between posts, within the error and the DEM's own steps", {skip}, async () => {
  const places = Array.from({length: 1000}, () => [WEST + (1 + random() * (COLS - 3)) * STEP, NORTH - (1 + random() * (ROWS - 3)) * STEP]);
  const ground = fgelev(places, scenery);
  assert.equal(ground.filter((h) => h === -1000).length, 0, "holes");
  // Between posts the DEM says nothing; the mesh lies between the heights of the cell, or within the error of them.
  const corners = places.flatMap(([lon, lat]) => {
    const col = Math.floor((lon - WEST) / STEP), row = Math.floor((NORTH - lat) / STEP);
    return [[0, 0], [1, 0], [0, 1], [1, 1]].map(([i, j]) => [WEST + (col + i) * STEP, NORTH - (row + j) * STEP]);
  });
  const dem = await heightsAbove(corners, "egm96");
  const stated = statedError();
  let worst = 0, known = 0;
  ground.forEach((h, i) => {
    const cell = dem.slice(4 * i, 4 * i + 4);
    if (cell.includes(null)) return;
    ++known;
    const relief = Math.max(...cell) - Math.min(...cell);
    const beyond = Math.max(Math.min(...cell) - h, h - Math.max(...cell), 0);
    worst = Math.max(worst, beyond);
    assert.ok(beyond <= stated + relief, `${places[i]}: ${h} of ${cell}`);
  });
  assert.ok(known > 900, `${known}`);
  figure("fgelev", `${known} of 1,000 places between four heights: at most ${worst.toFixed(2)} m beyond the four posts around`);
});

test("across 20 borders of buckets there is no step", {skip}, () => {
  // 2 cm on either side of places on lines of 0.25 and 0.125 degrees.
  const places = [];
  for (let k = 0; k < 20; ++k) {
    const upright = k % 2 === 0, hair = 2e-7;
    const lon = upright ? -121.75 : -121.9 + 0.4 * random(), lat = upright ? 46.65 + 0.3 * random() : 46.625 + 0.125 * (k % 3);
    places.push(upright ? [lon - hair, lat] : [lon, lat - hair], upright ? [lon + hair, lat] : [lon, lat + hair]);
  }
  const ground = fgelev(places.map((p) => p.map((x) => x.toFixed(9))), scenery);
  let worst = 0;
  for (let k = 0; k < 20; ++k) {
    assert.ok(ground[2 * k] > 0 && ground[2 * k + 1] > 0, `a hole beside ${places[2 * k]}`);
    worst = Math.max(worst, Math.abs(ground[2 * k] - ground[2 * k + 1]));
  }
  figure("fgelev", `20 borders of buckets: at most ${worst.toFixed(3)} m from one side to the other`);
  assert.ok(worst <= 0.1, `${worst}`);  // 4 cm of steep ground
});

test("the daemon has the same bytes as the batch, and its index leads to them", async () => {
  const names = readdirSync(scenery, {recursive: true}).filter((name) => /\d+n\d+\/(\.dirindex|\d+\.(stg|btg\.gz))$/.test(name) && name.split("/").length === 4);
  assert.equal(names.length, 2 * 8 + 1);
  for (const name of names) {
    const reply = await fetch(`${daemon.origin}/terrasync/rainier/${name}`);
    assert.equal(reply.status, 200, name);
    if (name.endsWith(".btg.gz")) assert.equal(reply.headers.get("content-encoding"), null);  // gzip is the file's own
    assert.deepEqual(new Uint8Array(await reply.arrayBuffer()), new Uint8Array(readFileSync(join(scenery, name))), name);
  }
});

test("land cover: each triangle has the material of its class, the same bytes on demand, and no crack", async (t) => {
  // Stripes of a twentieth of a degree from west to east; their names are FlightGear's.
  const materials = ["EvergreenForest", "Lake", "BarrenCover", "Glacier"], classes = [0, 1, 2, 0, 3], width = 0.05, west = -121.9;
  writeFileSync(join(folder, "cover.asc"), `ncols ${classes.length}\nnrows 8\nxllcorner ${west}\nyllcorner 46.55\ncellsize ${width}\n${Array(8).fill(classes.join(" ")).join("\n")}\n`);
  writeFileSync(join(folder, "cover.prj"), 'GEOGCS["WGS 84",DATUM["WGS_1984",SPHEROID["WGS 84",6378137,298.257223563]],PRIMEM["Greenwich",0],UNIT["degree",0.0174532925199433]]');
  writeFileSync(join(folder, "cover.asc.aux.xml"), `<PAMDataset><PAMRasterBand band="1"><CategoryNames>${materials.map((name) => `<Category>${name}</Category>`).join("")}</CategoryNames></PAMRasterBand></PAMDataset>`);
  const covered = build(DEM, "covered", "--max-error", "60", "--land-cover", join(folder, "cover.asc"));
  const names = readdirSync(covered, {recursive: true}).filter((name) => /\d+\.(stg|btg\.gz)$/.test(name));
  assert.equal(names.length, 2 * 8);
  writeFileSync(join(folder, "covered.toml"), `[[dataset]]\nname = "rainier"\nfiles = ["${join(ROOT, DEM)}"]\nmax_error = 60\nland_cover = "cover.asc"\n`);
  const server = await startDaemon("--config", join(folder, "covered.toml"));
  try {
    for (const name of names)
      assert.deepEqual(new Uint8Array(await (await fetch(`${server.origin}/terrasync/rainier/${name}`)).arrayBuffer()), new Uint8Array(readFileSync(join(covered, name))), name);
  } finally {
    assert.equal(await server.stop(), 0, server.said());
  }
  const lines = read("/usr/bin/python3", [join(DECODERS, "btg.py"), ...grounds(covered)]);
  let places = [], material, corners = [], right = 0, wrong = 0;
  for (const line of lines) {
    if (line.startsWith("version")) places = [];
    else if (line.startsWith("v ")) places.push(placeOf(line));
    else if (line.startsWith("part")) material = line.split(" ")[1];
    else if (line.startsWith("c ") && corners.push(places[Number(line.split(" ")[1])]) === 3) {
      const lon = (corners[0][0] + corners[1][0] + corners[2][0]) / 3, lat = (corners[0][1] + corners[1][1] + corners[2][1]) / 3;
      corners = [];
      const stripe = (lon - west) / width, k = Math.floor(stripe);
      const off = Math.min(stripe - k, k + 1 - stripe, Math.abs(lat - 46.55) / width, Math.abs(lat - 46.95) / width) * width * 76000;
      if (off < 240) continue; // metres from where classes meet: as ragged as the triangles of the border
      const expected = lat > 46.55 && lat < 46.95 ? materials[classes[k]] ?? "Default" : "Default";
      if (material === expected) ++right;
      else ++wrong;
    }
  }
  assert.ok(right > 5000 && wrong === 0, `${right} right, ${wrong} wrong`);
  const outline = openSides(lines).filter((ends) => ends.some((end) => { const [lon, lat] = placeOf(end); return lon > -121.999 && lon < -121.501 && lat > 46.501 && lat < 46.999; }));
  assert.equal(outline.length, 0, "cracks");
  figure("a reader from BTG's description", `land cover: ${right} triangles of the material of their class, ${wrong} of another, 0 cracks`);
  await t.test("SGBinObject", {skip: SIMGEAR}, () => {
    const theirs = read(simgear(), grounds(covered)).filter((line) => line.startsWith("part"));
    assert.deepEqual(theirs, lines.filter((line) => line.startsWith("part")));
  });
});

test("a reader that was written from the format's description finds every side of the pyramid's triangles twice, but for the outline", () => {
  const lines = read("/usr/bin/python3", [join(DECODERS, "btg.py"), ...grounds(scenery)]);
  assert.equal(lines.filter((line) => line.startsWith("version 7 ")).length, 8);
  // Eight buckets of a quarter by an eighth of a degree.
  const on = (x, lines) => lines.some((line) => Math.abs(x - line) < 2e-4);
  const open = openSides(lines), inside = open.filter((ends) => {
    const [[lon, lat], [toLon, toLat]] = ends.map(placeOf);
    return !(on(lon, [-122, -121.5]) && on(toLon, [-122, -121.5])) && !(on(lat, [46.5, 47]) && on(toLat, [46.5, 47]));
  });
  console.log(`${lines.filter((line) => line.startsWith("c ")).length / 3} triangles: ${open.length} sides on the outline, ${inside.length} cracks`);
  assert.equal(inside.length, 0);
  assert.ok(open.length > 40);
});

test("version 10: the same reader, SGBinObject and fgelev", async (t) => {
  const dense = denseScenery(), files = grounds(dense);
  assert.equal(files.length, 1);
  const lines = read("/usr/bin/python3", [join(DECODERS, "btg.py"), ...files]);
  const vertices = lines.filter((line) => line.startsWith("v ")).length;
  assert.ok(lines[0].startsWith("version 10 ") && vertices > 65535, `${lines[0]}: ${vertices} vertices`);
  assert.ok(openSides(lines).length < 2000);
  await t.test("fgelev", {skip}, () => {
    const places = Array.from({length: 1000}, () => [10.0012 + 0.123 * random(), 45.0012 + 0.123 * random()]);
    const ground = fgelev(places, dense);
    assert.ok(ground.every((h) => h > -1 && h < 61), `${Math.min(...ground)}`);  // noise from 0 to 60 m
    figure("fgelev", `BTG version 10, ${vertices} vertices: no hole at 1,000 places`);
  });
});

test("SGBinObject reads from every file what the other reader does", {skip: SIMGEAR}, () => {
  const files = [...grounds(scenery), ...grounds(existsSync(join(folder, "dense")) ? join(folder, "dense") : denseScenery())];
  const theirs = read(simgear(), files), other = read("/usr/bin/python3", [join(DECODERS, "btg.py"), ...files]);
  assert.equal(theirs.length, other.length);
  let numbers = 0;
  theirs.forEach((line, i) => {
    if (!line.startsWith("n ")) return void (line === other[i] || assert.fail(`${line}, but ${other[i]}`));
    const a = line.split(" ").slice(1).map(Number), b = other[i].split(" ").slice(1).map(Number);
    a.forEach((x, k) => assert.ok(Math.abs(x - b[k]) < 1e-6, `${line}, but ${other[i]}`));  // floats there
    ++numbers;
  });
  figure("SimGear's SGBinObject", `BTG: ${files.length} files, versions 7 and 10: ${theirs.length} lines equal, ${numbers} of them normals`);
});

test("killed while it builds and run again, it has the same files", async () => {
  const args = ["build", DEM, "-o", join(folder, "killed"), "--format", "flightgear", "--max-error", `${MAX_ERROR}`, "--progress", "none", "--threads", "1"];
  const run = spawn(PROGRAM, args, {cwd: ROOT, stdio: "ignore"}), ended = once(run, "exit");
  while (run.exitCode === null && !filesNow(join(folder, "killed")).some((name) => name.endsWith(".stg")))
    await new Promise((resolve) => setTimeout(resolve, 5));
  run.kill("SIGKILL");
  await ended;
  assert.equal(existsSync(join(folder, "killed", ".dirindex")), false);
  const report = JSON.parse(execFileSync(PROGRAM, [...args, "--json"], {cwd: ROOT, encoding: "utf8"}));
  assert.ok(report.kept >= 1 && report.kept < report.buckets, `${report.kept} of ${report.buckets}`);
  const all = (of) => readdirSync(of, {recursive: true, withFileTypes: true}).filter((entry) => entry.isFile()).map((entry) => join(entry.parentPath ?? entry.path, entry.name).slice(of.length)).sort();
  assert.deepEqual(all(join(folder, "killed")), all(scenery));
  for (const name of all(scenery)) assert.ok(readFileSync(join(folder, "killed") + name).equals(readFileSync(scenery + name)), name);
});
