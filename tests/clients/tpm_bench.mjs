// The speed of the JavaScript reader of .tpm, and of /progressive on one connection. Medians.
//   TIND_BINARY=build/bench/tind node tests/clients/tpm_bench.mjs [DEM]
import {execFileSync} from "node:child_process";
import {mkdtempSync, readFileSync, rmSync} from "node:fs";
import {tmpdir} from "node:os";
import {Geomorph, ProgressiveMesh} from "../../server/viewer/progressive_mesh.js";
import {TpmStream} from "../../server/viewer/tpm.js";
import {PROGRAM, ROOT, startDaemon} from "./daemon.mjs";

const median = (list) => list.sort((a, b) => a - b)[Math.floor(list.length / 2)];
const repeat = (times, run) => median(Array.from({length: times}, () => {
  const begin = performance.now();
  run();
  return (performance.now() - begin) / 1000;
}));

function decoded(bytes) {
  const stream = new TpmStream();
  stream.feed(bytes);
  return stream;
}

function measure(name, bytes) {
  const stream = decoded(bytes);
  const mesh = new ProgressiveMesh(stream);
  const n = stream.splits;
  const decode = repeat(15, () => decoded(bytes));
  const portions = repeat(15, () => {
    const growing = new TpmStream();
    for (let at = 0; at < bytes.length; at += 512) growing.feed(bytes.subarray(at, at + 512));
  });
  const seek = repeat(15, () => {
    mesh.seek(0);
    mesh.seek(n);
  });
  const way = new Geomorph(mesh, 0, n);
  let t = 0;
  const frame = repeat(200, () => way.at((t = (t + 0.013) % 1)));
  const row = [n, bytes.length / n, n / decode / 1e6, n / portions / 1e6, (2 * n) / seek / 1e6, 1e3 * frame];
  console.log(name.padEnd(26), row.map((x) => x.toPrecision(3).padStart(9)).join(" "));
}

const folder = mkdtempSync(`${tmpdir()}/tind-tpm-`);
try {
  console.log("".padEnd(26), ["splits", "B/split", "M/s", "512 B M/s", "seek M/s", "frame ms"].map((x) => x.padStart(9)).join(" "));
  for (const method of ["bounded", "qem"]) {
    execFileSync(PROGRAM, ["progressive", process.argv[2] ?? "testdata/crater.tif", "--method", method, "--max-error", "1",
      "-o", `${folder}/a.tpm`, "--progress", "none"], {cwd: ROOT});
    measure(`${method}, 1 m`, new Uint8Array(readFileSync(`${folder}/a.tpm`)));
  }
  const daemon = await startDaemon("testdata/rainier.tif");
  const tiles = Array.from({length: 16}, (_, i) => `12/${1324 + (i % 4)}/${3111 + (i >> 2)}`);
  const get = async (path, headers) => new Uint8Array(await (await fetch(daemon.origin + path, {headers})).arrayBuffer());
  const each = async (path, headers) => {
    const times = [];
    for (const tile of tiles) {
      const begin = performance.now();
      await get(path(tile), headers);
      times.push(performance.now() - begin);
    }
    return median(times);
  };
  const stream = (tile) => `/progressive/rainier/${tile}`;
  const times = {
    "tile, first": await each((tile) => `/terrain/rainier/${tile}.terrain`),
    "stream, first": await each(stream),
    "stream, from the cache": await each(stream),
    "its first kilobyte": await each(stream, {Range: "bytes=0-1023"}),
    "?max_error=10": await each((tile) => `${stream(tile)}?max_error=10`),
  };
  measure("a tile of level 12", await get(stream(tiles[5])));
  for (const [what, ms] of Object.entries(times)) console.log(what.padEnd(26), `${ms.toFixed(2).padStart(9)} ms`);
  await daemon.stop();
} finally {
  rmSync(folder, {recursive: true});
}
