// Keys against the whole daemon, its processes and its disk: a key that is asked with everywhere, in
// every way, is found nowhere afterwards.
import assert from "node:assert/strict";
import {createHash} from "node:crypto";
import {mkdtempSync, readdirSync, readFileSync, rmSync, statSync, writeFileSync} from "node:fs";
import {tmpdir} from "node:os";
import {join} from "node:path";
import {after, before, test} from "node:test";
import {startDaemon} from "./daemon.mjs";

/// Of one key each; what they have in common is what is looked for.
const CANARY = "canary-5b1f0e7a93";
const SECRETS = {right: `${CANARY}-right`, narrow: `${CANARY}-narrow`, elsewhere: `${CANARY}-elsewhere`, expired: `${CANARY}-expired`};
const WRONG = `${CANARY}-wrong`;
const EVERYTHING = ["tiles", "read", "jobs", "admin"];

/// A path that names the dataset.
const OF_ALPS = /\/alps(\/|\?|$|\.)/;

const table = (name, scopes, more = "") =>
  `[[key]]\nname = "${name}"\nsha256 = "${createHash("sha256").update(SECRETS[name]).digest("hex")}"\nscopes = ${JSON.stringify(scopes)}\n${more}\n`;

let daemon, folder, operations;
let heard = "";

before(async () => {
  folder = mkdtempSync(join(tmpdir(), "tind-keys-"));
  const config = join(folder, "tind.toml");
  writeFileSync(config, table("right", EVERYTHING) + table("narrow", ["tiles"]) +
    table("elsewhere", EVERYTHING, 'datasets = ["nowhere"]') + table("expired", EVERYTHING, 'expires = "2020-01-01T00:00:00Z"'));
  daemon = await startDaemon("alps=testdata/rainier.tif", "--config", config, "--log-level", "debug", "--access-log",
    "--jobs-dir", join(folder, "jobs"), "--max-error", "20", "--jobs-seconds", "20");
  const document = await (await fetch(`${daemon.origin}/openapi.json`)).json();
  operations = Object.entries(document.paths).flatMap(([path, methods]) =>
    Object.entries(methods).map(([method, operation]) => ({path, method: method.toUpperCase(), ...operation})));
});
after(async () => {
  await daemon?.stop();
  rmSync(folder, {recursive: true, force: true});
});

/// {target, init} of an operation's example.
function example(operation) {
  const of = (where) => (operation.parameters ?? []).filter((one) => one.in === where);
  let path = operation.path;
  for (const one of of("path")) path = path.replace(`{${one.name}}`, encodeURIComponent(one.example ?? "0".repeat(32)));
  const query = of("query").filter((one) => one.example !== undefined).map((one) => `${one.name}=${encodeURIComponent(one.example)}`);
  const [form] = Object.entries(operation.requestBody?.content ?? {}).filter(([, one]) => one.example !== undefined);
  const body = form && (typeof form[1].example === "string" ? form[1].example : JSON.stringify(form[1].example));
  return {target: path + (query.length > 0 ? `?${query.join("&")}` : ""),
    init: {method: operation.method, ...(form ? {body, headers: {"Content-Type": form[0]}} : {})}};
}

async function ask(target, init, headers = {}) {
  const reply = await fetch(daemon.origin + target, {...init, headers: {...init.headers, ...headers}});
  const bytes = Buffer.from(await reply.arrayBuffer());
  heard += `${reply.status} ${[...reply.headers].join("\n")}\n${bytes.toString("latin1")}\n`;
  return {status: reply.status, text: bytes.toString("latin1"), headers: reply.headers};
}

const WAYS = {
  "X-API-Key": (secret, target, init) => ask(target, init, {"X-API-Key": secret}),
  "Authorization": (secret, target, init) => ask(target, init, {Authorization: `Bearer ${secret}`}),
  "the query": (secret, target, init) => ask(`${target}${target.includes("?") ? "&" : "?"}key=${secret}`, init),
};

test("every operation, with every key, in every way", {timeout: 600_000}, async () => {
  const wrong = [];
  for (const operation of operations) {
    const {target, init} = example(operation);
    const open = operation["x-tind-scope"] === undefined;
    const of_alps = OF_ALPS.test(target);
    const check = (what, said, fine) => {
      if (!fine) wrong.push(`${init.method} ${target} with ${what}: ${said.status} ${said.text.slice(0, 100)}`);
    };
    const closed = {none: await ask(target, init)};
    for (const [way, asked] of Object.entries(WAYS)) {
      closed[`a wrong key in ${way}`] = await asked(WRONG, target, init);
      closed[`one that has expired in ${way}`] = await asked(SECRETS.expired, target, init);
    }
    for (const [what, said] of Object.entries(closed)) check(what, said, open ? said.status !== 401 && said.status !== 403 : said.status === 401);
    if (open) continue;
    for (const [way, asked] of Object.entries(WAYS)) {
      const scope = await asked(SECRETS.narrow, target, init);
      check(`another scope in ${way}`, scope, operation["x-tind-scope"] === "tiles" ? scope.status !== 401 && scope.status !== 403 : scope.status === 403);
      const dataset = await asked(SECRETS.elsewhere, target, init);
      check(`another dataset in ${way}`, dataset, of_alps ? dataset.status === 403 : dataset.status !== 401 && !dataset.text.includes("rainier"));
    }
    // Once: some of these are work.
    const right = await WAYS["X-API-Key"](SECRETS.right, target, init);
    check("the right key", right, right.status !== 401 && right.status !== 403);
  }
  assert.deepEqual(wrong, []);
  assert.ok(operations.length > 60, `${operations.length} operations`);
});

test("no dataset that a key is not for is in any list", async () => {
  let lists = 0;
  for (const operation of operations) {
    const {target, init} = example(operation);
    if (operation.method !== "GET" || operation["x-tind-scope"] === undefined || OF_ALPS.test(target)) continue;
    const said = await WAYS["X-API-Key"](SECRETS.elsewhere, target, init);
    if (said.status !== 200) continue;
    ++lists;
    assert.ok(!/"alps"|\/alps\b|rainier/.test(said.text), `${target}: ${said.text.slice(0, 300)}`);
  }
  assert.ok(lists > 5, `${lists} answers`);
});

test("a job that a key asked for, and mistakes about keys", async () => {
  const order = {method: "POST", headers: {"Content-Type": "application/json", Prefer: "respond-async"},
    body: JSON.stringify({inputs: {dataset: "alps", max_error: 30, bbox: [-121.78, 46.84, -121.74, 46.87]}, outputs: {mesh: {}, report: {}}})};
  const key = {"X-API-Key": SECRETS.right};
  const job = (await ask("/processes/simplify/execution", order, key)).headers.get("location");
  assert.ok(job);
  for (let i = 0; i < 400; ++i) {
    if (!/"(accepted|running)"/.test((await ask(job, {}, key)).text)) break;
    await new Promise((resolve) => setTimeout(resolve, 50));
  }
  assert.equal((await ask(`${job}/results`, {}, key)).status, 200);
  // Another key has not asked for it, and does not learn that there is one.
  const other = {"X-API-Key": SECRETS.elsewhere};
  for (const path of ["", "/results", "/results/mesh"]) assert.equal((await ask(job + path, {}, other)).status, 404, path);
  assert.equal((await ask(job, {method: "DELETE"}, other)).status, 404);
  assert.equal((await ask(`${job}/results/mesh`, {}, key)).status, 200);
  await ask(`/elevation/alps?lon=900&lat=x&key=${SECRETS.right}`, {});
  for (const query of [`key=${WRONG}%zz`, `key=${WRONG}&key=${SECRETS.right}`, `a=b&k%65y=${WRONG}`, `key=${encodeURIComponent(`${WRONG}\n"`)}`])
    await ask(`/datasets?${query}`, {});
  await ask("/datasets", {}, {Authorization: `Basic ${Buffer.from(`ann:${WRONG}`).toString("base64")}`});
  await ask("/datasets", {}, {"X-API-Key": `${WRONG} ${SECRETS.right}`});
  assert.equal((await ask("/metrics", {}, key)).status, 200);
});

test("the canary is nowhere", async () => {
  const places = new Map([["the log", daemon.said()], ["answers", heard]]);
  const walk = (at) => {
    for (const name of readdirSync(at)) {
      const path = join(at, name);
      if (statSync(path).isDirectory()) walk(path);
      else places.set(path, readFileSync(path).toString("latin1"));
    }
  };
  walk(join(folder, "jobs"));
  assert.ok(places.size > 3, "there are jobs' files");
  assert.match(places.get("the log"), /\/elevation\/alps\?lon=900&lat=x/, "there is an access log");
  for (const [place, text] of places) {
    const at = text.indexOf(CANARY);
    assert.equal(at, -1, `${place}: ...${text.slice(Math.max(0, at - 120), at + 60)}`);
  }
});
