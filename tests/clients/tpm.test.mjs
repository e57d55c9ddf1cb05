// The viewer's reader of .tpm against the program's: the same meshes to the last bit, from any
// prefix, in any portions; damage is said; and on its way between two states nothing turns over.
import assert from "node:assert/strict";
import {execFileSync} from "node:child_process";
import {mkdtempSync, readFileSync, rmSync, writeFileSync} from "node:fs";
import {tmpdir} from "node:os";
import {after, before, test} from "node:test";
import {Geomorph, ProgressiveMesh, toCrs} from "../../server/viewer/progressive_mesh.js";
import {RangeDecoder} from "../../server/viewer/range_decoder.js";
import {orientation, TpmError, TpmStream} from "../../server/viewer/tpm.js";
import {PROGRAM, ROOT} from "./daemon.mjs";

const STREAMS = {
  bounded: ["testdata/crater.tif", "--max-error", "4"],
  qem: ["testdata/rainier.tif", "--method", "qem", "--max-error", "30"], // vertices move in x and y
  small: ["testdata/crater.tif", "--max-error", "40", "--base", "8"],
};
let folder;
const bytes = {};

const tind = (...args) => execFileSync(PROGRAM, args, {cwd: ROOT, encoding: "utf8"});

before(() => {
  folder = mkdtempSync(`${tmpdir()}/tind-tpm-`);
  for (const [name, args] of Object.entries(STREAMS)) {
    tind("progressive", ...args, "-o", `${folder}/${name}.tpm`, "--progress", "none");
    bytes[name] = new Uint8Array(readFileSync(`${folder}/${name}.tpm`));
  }
  tind("extract", `${folder}/bounded.tpm`, "--triangles", "3000", "-o", `${folder}/surface.ply`);
  tind("progressive", `${folder}/surface.ply`, "--base", "50", "-o", `${folder}/space.tpm`, "--progress", "none");
  bytes.space = new Uint8Array(readFileSync(`${folder}/space.tpm`));
});
after(() => rmSync(folder, {recursive: true}));

function streamOf(...portions) {
  const stream = new TpmStream();
  for (const portion of portions) stream.feed(portion);
  return stream;
}
const meshOf = (stream) => new ProgressiveMesh(stream);

/// A generator of numbers in 0..1, the same every time.
function dice(seed) {
  return () => (seed = (Math.imul(seed, 1664525) + 1013904223) >>> 0) / 2 ** 32;
}

/// What `tind extract` writes: vertices as doubles, faces as a count and three ints.
function readPly(path) {
  const file = readFileSync(path);
  const text = file.toString("latin1");
  const [vertices, faces] = ["vertex", "face"].map((what) => Number(text.match(new RegExp(`element ${what} (\\d+)`))[1]));
  let at = text.indexOf("end_header\n") + 11;
  const positions = Float64Array.from({length: 3 * vertices}, () => file.readDoubleLE((at += 8) - 8));
  const triangles = new Uint32Array(3 * faces);
  for (let f = 0; f < faces; ++f) {
    assert.equal(file[at++], 3);
    for (let k = 0; k < 3; ++k) triangles[3 * f + k] = file.readInt32LE((at += 4) - 4);
  }
  return {positions, triangles};
}

function extract(name, ...level) {
  const report = JSON.parse(tind("extract", `${folder}/${name}.tpm`, ...level, "-o", `${folder}/out.ply`, "--json"));
  return {...report, ...readPly(`${folder}/out.ply`)};
}

/// Twice the area of all triangles; each must be above 0.
function area(mesh, position = mesh.lattice) {
  const corners = mesh.triangles();
  let sum = 0;
  for (let i = 0; i < corners.length; i += 3) {
    const [a, b, c] = [3 * corners[i], 3 * corners[i + 1], 3 * corners[i + 2]];
    const one = orientation(position[a], position[a + 1], position[b], position[b + 1], position[c], position[c + 1]);
    assert.ok(one > 0, `triangle ${i / 3}: ${one}`);
    sum += one;
  }
  return sum;
}

for (const name of ["bounded", "qem", "space"]) {
  test(`${name}: every level is what tind extract makes of it, bit by bit`, () => {
    const stream = streamOf(bytes[name]);
    assert.ok(stream.complete);
    const mesh = meshOf(stream);
    const coarsest = stream.baseTriangles.length / 3;
    for (const level of [["--triangles", `${coarsest}`], ["--triangles", `${coarsest + 1001}`], ["--max-error", "200"], ["--max-error", "35"], ["--triangles", "999999"]]) {
      const expected = extract(name, ...level);
      const splits = level[0] === "--triangles" ? mesh.splitsForTriangles(Number(level[1])) : mesh.splitsForError(Number(level[1]));
      assert.equal(splits, expected.splits, level.join(" "));
      mesh.seek(splits);
      assert.equal(mesh.triangleCount, expected.triangles.length / 3);
      assert.equal(mesh.errorM, expected.max_error_m ?? expected.max_error);
      assert.deepEqual(mesh.triangles(), expected.triangles);
      assert.deepEqual(toCrs(stream.header, mesh.lattice), expected.positions);
    }
  });

  test(`${name}: fed in any portions, and moved up and down, it is the same`, () => {
    const whole = streamOf(bytes[name]);
    const random = dice(7);
    const stream = new TpmStream();
    for (let at = 0; at < bytes[name].length; ) {
      const size = 1 + Math.floor(random() ** 4 * 5000);
      stream.feed(bytes[name].subarray(at, (at += size)));
    }
    assert.ok(stream.complete);
    const records = (s) => s.records.subarray(0, 14 * s.splits);
    assert.deepEqual(records(stream), records(whole));
    assert.deepEqual(stream.blocks, whole.blocks);
    const [moved, fresh] = [meshOf(stream), () => meshOf(whole)];
    for (let i = 0; i < 40; ++i) {
      const splits = Math.floor(random() * (stream.splits + 1));
      moved.seek(splits);
      const direct = fresh();
      direct.seek(splits);
      assert.deepEqual(moved.triangles(), direct.triangles());
      assert.deepEqual(moved.lattice, direct.lattice);
    }
  });
}

for (const name of ["bounded", "qem"]) {
  test(`${name}: no triangle turns over between coarse and fine, and both ends are exact`, () => {
    const stream = streamOf(bytes[name]);
    const mesh = meshOf(stream);
    const all = area(mesh);
    const [from, to] = [Math.floor(stream.splits / 20), Math.floor(stream.splits / 3)];
    for (const [a, b] of [[from, to], [0, stream.splits], [to, to + 1], [to, to]]) {
      const geomorph = new Geomorph(mesh, a, b);
      // Vertices that float in x and y get in each other's way now and then.
      const most = name === "bounded" ? 0.05 : 0.01;
      assert.ok(geomorph.jumps <= (b - a) * most, `${geomorph.jumps} of ${b - a} splits are not animated`);
      for (const [t, splits] of [[0, a], [1, b]]) {
        const position = geomorph.at(t);
        assert.equal(mesh.splits, splits);
        assert.deepEqual(position, Float64Array.from(mesh.lattice));
      }
      for (const t of [1e-6, 0.1, 0.25, 0.37, 0.5, 0.618, 0.75, 0.9, 0.999]) {
        const sum = area(mesh, geomorph.at(t));
        assert.ok(Math.abs(sum - all) < 1e-9 * all, "what is covered stays covered");
      }
    }
  });
}

test("a surface in space moves between two states, exact at both ends", () => {
  const stream = streamOf(bytes.space);
  assert.equal(stream.header.frame, "space");
  const mesh = meshOf(stream);
  const geomorph = new Geomorph(mesh, 10, stream.splits);
  assert.equal(geomorph.jumps, 0);
  for (const [t, splits] of [[0, 10], [1, stream.splits]]) {
    assert.deepEqual(geomorph.at(t), Float64Array.from(mesh.lattice));
    assert.equal(mesh.splits, splits);
  }
  const before = geomorph.at(0.4);
  const after = geomorph.at(0.4001);
  assert.ok(before.some((x, i) => x !== after[i]) && before.some((x) => x % 1 !== 0));
});

test("on the way the surface moves little by little", () => {
  const stream = streamOf(bytes.small);
  const mesh = meshOf(stream);
  let splits = stream.splits;
  while (splits > 0 && new Geomorph(mesh, 0, splits).jumps > 0) splits = Math.floor(0.9 * splits);
  assert.ok(splits > 50, `only the first ${splits} of ${stream.splits} splits are all animated`);
  const geomorph = new Geomorph(mesh, 0, splits);
  const steps = 20 * splits;
  let last = geomorph.at(0);
  let most = 0;
  for (let i = 1; i <= steps; ++i) {
    const now = geomorph.at(i / steps);
    for (let k = 2; k < last.length; k += 3) most = Math.max(most, Math.abs(now[k] - last[k]));
    last = now;
  }
  const jump = Math.max(...Array.from({length: splits}, (_, i) => Math.abs(stream.records[14 * i + 13] - stream.records[14 * i + 7])));
  assert.ok(most < jump / 5, `a vertex moves by ${most} steps of height at once; the largest split by ${jump}`);
});

test("a file cut at every byte is a valid mesh, with as many splits as the program finds", () => {
  const whole = streamOf(bytes.small);
  const growing = new TpmStream();
  for (let cut = 0; cut <= bytes.small.length; ++cut) {
    const stream = streamOf(bytes.small.subarray(0, cut));
    if (cut > 0) growing.feed(bytes.small.subarray(cut - 1, cut));
    assert.equal(growing.splits, stream.splits);
    if (!stream.header) continue;
    assert.equal(stream.complete, cut === bytes.small.length);
    assert.deepEqual(stream.records.subarray(0, 14 * stream.splits), whole.records.subarray(0, 14 * stream.splits));
    const mesh = meshOf(stream);
    mesh.seek(Infinity);
    assert.equal(mesh.splits, stream.splits);
    area(mesh);
    if (cut % 97 !== 0) continue;
    writeFileSync(`${folder}/cut.tpm`, bytes.small.subarray(0, cut));
    const said = tind("extract", `${folder}/cut.tpm`, "--triangles", "99999", "-o", `${folder}/out.ply`);
    assert.equal(stream.splits, Number(said.match(/(\d+) of \d+ splits are there/)[1]));
  }
});

test("damage is said in one line, and never makes a mesh that is not valid", () => {
  const random = dice(3);
  const good = bytes.small;
  const outcomes = {said: 0, valid: 0};
  for (let round = 0; round < 1500; ++round) {
    const bad = good.slice();
    for (let k = 0; k < 1 + round % 3; ++k) bad[Math.floor(random() ** (round % 2 ? 4 : 1) * bad.length)] ^= 1 << Math.floor(8 * random());
    const stream = new TpmStream();
    try {
      stream.feed(bad.subarray(0, 300));
      stream.feed(bad.subarray(300));
    } catch (error) {
      assert.ok(error instanceof TpmError, error.stack);
      assert.match(error.message, /^[^\n]{8,120}$/);
      assert.throws(() => stream.feed(good), TpmError);
      ++outcomes.said;
    }
    if (!stream.header) continue;
    const mesh = meshOf(stream); // of what came before the damage, or what the damage happens to mean
    mesh.seek(Infinity);
    area(mesh);
    ++outcomes.valid;
  }
  assert.ok(outcomes.said > 500 && outcomes.valid > 500, JSON.stringify(outcomes));

  const patched = (at, ...values) => patchedOf(good, at, ...values);
  const patchedOf = (whole, at, ...values) => {
    const bad = whole.slice();
    bad.set(values, at);
    return bad;
  };
  for (const [bad, expected] of [
    [new TextEncoder().encode("PK"), /no \.tpm stream/],
    [patched(4, 3), /version 3/],
    [patched(6, 3), /header/],
    [patchedOf(bytes.space, 32, 1), /header/], // an origin that is no whole number
    [patched(92, 0, 0, 0, 16), /more numbers than bytes/],
    [Uint8Array.of(...good, 0), /after the end/],
  ])
    assert.throws(() => streamOf(bad), {name: "TpmError", message: expected});
});

/// What the reader asks of its coder while `read` runs: b for bits, t for trees, n for numbers.
function askedOfCoder(read) {
  const said = [];
  let depth = 0; // a number is made of trees and bits
  const real = {};
  for (const [name, letter] of [["bit", "b"], ["plain", ""], ["tree", "t"], ["number", "n"]]) {
    real[name] = RangeDecoder.prototype[name];
    RangeDecoder.prototype[name] = function (...args) {
      ++depth;
      const value = real[name].apply(this, args);
      if (--depth === 0 && letter) said.push(letter + value);
      return value;
    };
  }
  read();
  Object.assign(RangeDecoder.prototype, real);
  return said.join(" ");
}

test("the example of docs/formats.md is what the program writes, and what it says of it is so", () => {
  const text = readFileSync(`${ROOT}/docs/formats.md`, "utf8").split("**An example.**")[1].split("**Version 2")[0];
  const rows = text.split("\n").filter((line) => /^\| \d/.test(line)).map((line) => line.split("|").slice(1, -1).map((cell) => cell.trim()));
  const written = rows.filter(([, cell]) => /^`[0-9a-f ]+`$/.test(cell));
  const stated = Buffer.from(written.map(([, cell]) => cell.replace(/[` ]/g, "")).join(""), "hex");
  writeFileSync(`${folder}/posts.asc`, text.match(/```\n(ncols[^`]*)```/)[1]);
  const command = text.match(/`tind (progressive [^`]*)`/)[1].replaceAll("posts.", `${folder}/posts.`);
  tind(...command.split(" "), "--progress", "none");
  assert.equal(readFileSync(`${folder}/posts.tpm`).toString("hex"), stated.toString("hex"));
  let at = 0;
  for (const [offset, cell] of written) {
    assert.equal(Number(offset), at);
    at += cell.replace(/[` ]/g, "").length / 2;
  }

  let stream;
  const read = askedOfCoder(() => (stream = streamOf(stated)));
  const splits = rows.filter((row) => row.length === 7);
  assert.equal(read, ["n3", ...splits.map(([, cell]) => cell.slice(1, -1))].join(" "));
  assert.deepEqual(stream.blocks, [{first: 0, count: 3, error: 2}]);
  const point = (...p) => `(${p.join(", ")})`;
  for (const [i, [, , ...said]] of splits.entries()) {
    const [vertex, left, right, , , , , , ...to] = stream.records.subarray(14 * i, 14 * i + 14);
    const added = `${stream.header.baseVertices + i}: ${point(...to.slice(3))}`;
    assert.deepEqual(said, [`${vertex}`, `${left}`, right < 0 ? "-" : `${right}`, point(...to.slice(0, 3)), added]);
  }
  const list = (numbers) => Array.from({length: numbers.length / 3}, (_, i) => point(...numbers.slice(3 * i, 3 * i + 3))).join(", ");
  assert.ok(text.includes(list([...stream.basePositions])) && text.includes(list([...stream.baseTriangles])));
});
