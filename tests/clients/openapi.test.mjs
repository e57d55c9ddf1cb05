// The daemon against its own OpenAPI document: the document is linted, its examples are run, and
// requests made from it, right and wrong, get what it says and nothing else.
//
// REQUESTS: how many of these (2000); SEED: which.
import assert from "node:assert/strict";
import {after, before, test} from "node:test";
import {createConfig, lintFromString} from "@redocly/openapi-core";
import fc from "fast-check";
import {startDaemon} from "./daemon.mjs";

const REQUESTS = Number(process.env.REQUESTS ?? 2000), SEED = Number(process.env.SEED ?? 16);
const AT_A_TIME = 8, AT_ONCE = 2000;
// Examples that name tiles which the example's dataset has not: its parent, the other hemisphere.
const MAY_BE_MISSING = /^getTransition$|_east$|^get3dSubtree|^getJob|^dismissJob/;

let daemon, document, operations, tiles;

before(async () => {
  // As the examples call it. Jobs are short, and none is refused for want of room.
  daemon = await startDaemon("alps=testdata/rainier.tif", "--jobs-seconds", "20", "--jobs-waiting", "100000",
    "--jobs-per-client", "100000", "--max-error", "20");
  document = await (await fetch(`${daemon.origin}/openapi.json`)).json();
  operations = Object.entries(document.paths).flatMap(([path, methods]) =>
    Object.entries(methods).map(([method, operation]) => ({path, method: method.toUpperCase(), ...operation})));
  const layer = await (await fetch(`${daemon.origin}/terrain/alps/layer.json`)).json();
  tiles = layer.available.flatMap((rectangles, z) => rectangles.map((r) => [z, r.startX, r.startY]));
});
after(() => daemon?.stop());

const resolve = (schema) => (schema?.$ref ? schema.$ref.slice(2).split("/").reduce((at, key) => at[key], document) : schema);

// --- what is right -------------------------------------------------------------------------------

/// Values that a schema allows.
function values(given, depth = 0) {
  const schema = resolve(given) ?? {};
  if (schema.const !== undefined) return fc.constant(schema.const);
  if (schema.enum) return fc.constantFrom(...schema.enum);
  if (schema.anyOf && !schema.properties) return fc.oneof(...schema.anyOf.map((one) => values(one, depth)));
  if (schema.oneOf && !schema.properties) return fc.oneof(...schema.oneOf.map((one) => values(one, depth)));
  const type = Array.isArray(schema.type) ? fc.constantFrom(...schema.type) : fc.constant(schema.type);
  return type.chain((one) => ofType(one, schema, depth));
}

function ofType(type, schema, depth) {
  const low = schema.minimum ?? schema.exclusiveMinimum ?? -1e6, high = schema.maximum ?? 1e6;
  switch (type) {
    case "null": return fc.constant(null);
    case "boolean": return fc.boolean();
    case "integer": return fc.integer({min: Math.max(low, -(2 ** 31)), max: Math.min(high, 2 ** 31 - 1)});
    case "number": return fc.oneof(fc.double({min: low, max: high, noNaN: true}), fc.constantFrom(low, high));
    case "array": return fc.array(values(schema.items ?? {type: "number"}, depth + 1),
      {minLength: schema.minItems ?? 0, maxLength: Math.min(schema.maxItems ?? 5, (schema.minItems ?? 0) + 5)});
    case "string":
      if (schema.pattern) return fc.stringMatching(new RegExp(schema.pattern));
      return fc.string({maxLength: Math.min(schema.maxLength ?? 20, 20)});
    case "object": return objects(schema, depth);
    default: return fc.constant({});
  }
}

function objects(schema, depth) {
  const own = Object.entries(schema.properties ?? {}).map(([name, one]) => [name, values(one, depth + 1)]);
  const branches = [...(schema.oneOf ?? []), ...(schema.anyOf ?? [])].filter((one) => one.required);
  const required = branches.length > 0 ? fc.constantFrom(...branches).map((one) => one.required) : fc.constant([]);
  return required.chain((more) => fc.record(Object.fromEntries(own), {requiredKeys: [...(schema.required ?? []), ...more]
    .filter((key) => schema.properties?.[key])}));
}

/// Places of the dataset are worth more than those of the earth, names that there are than others.
function parameterValues(parameter) {
  const good = {dataset: "alps", collectionId: "alps", lon: -121.76, lat: 46.85, job: "0".repeat(32)}[parameter.name];
  const all = values(parameter.schema).map(String);
  const any = parameter.in === "path" ? all.filter((text) => text !== "" && !/[/%]/.test(text)) : all;
  return good === undefined ? any : fc.oneof({weight: 4, arbitrary: fc.constant(String(good))}, {weight: 1, arbitrary: any});
}

/// Inputs of a process: of the dataset, of a small area.
function withPlace(body, where) {
  if (!body?.inputs || typeof body.inputs !== "object" || !where) return body;
  const inputs = {...body.inputs, dataset: "alps"};
  for (const name of ["polygon", "crs", "breaklines", "flatten", "layer"]) delete inputs[name];
  inputs.bbox = [-121.78, 46.84, -121.74, 46.87];
  return {...body, inputs};
}

const unknown = fc.record({name: fc.constantFrom("nonsense", "lonn", "Key", "\u00e9"), value: fc.string({maxLength: 9})});
const breakings = ["nothing", "nothing", "unknown", "twice", "value", "text", "body", "type", "empty", "member"];

function requests(operation) {
  const parameters = operation.parameters ?? [];
  const ofPath = parameters.filter((one) => one.in === "path"), ofQuery = parameters.filter((one) => one.in === "query");
  const record = (list, options) => fc.record(Object.fromEntries(list.map((one) => [one.name, parameterValues(one)])), options);
  const content = Object.entries(operation.requestBody?.content ?? {});
  return fc.record({
    operation: fc.constant(operation),
    path: record(ofPath),
    tile: fc.option(fc.constantFrom(...tiles), {freq: 3}),
    query: record(ofQuery, {requiredKeys: ofQuery.filter((one) => ["lon", "lat", "locations", "json", "coords", "bbox"].includes(one.name)).map((one) => one.name)}),
    body: content.length === 0 ? fc.constant(null) : fc.constantFrom(...content).chain(([type, one]) =>
      fc.oneof(values(one.schema), ...(one.example === undefined ? [] : [fc.constant(one.example)])).map((value) => ({type, value}))),
    here: fc.boolean(),
    prefer: fc.boolean(),
    breaking: fc.constantFrom(...breakings),
    unknown,
    junk: fc.oneof(fc.string({maxLength: 40}), fc.json({maxDepth: 3}), fc.constantFrom("NaN", "1e999", "-0", "[[[[", "{\"a\":", "\u0000")),
    where: fc.nat(20),
  });
}

// --- as it is sent -------------------------------------------------------------------------------

const encoded = (text) => encodeURIComponent(text);

function target(request) {
  const names = {...request.path};
  if (request.tile && "z" in names) [names.z, names.x, names.y] = request.tile;
  if (request.tile && "tileRow" in names) [names.tileMatrix, names.tileCol, names.tileRow] = request.tile;
  let path = request.operation.path.replace(/\{(\w+)\}/g, (_, name) => encoded(names[name]));
  const pairs = Object.entries(request.query);
  if (request.breaking === "unknown") pairs.push([request.unknown.name, request.unknown.value]);
  if (request.breaking === "twice" && pairs.length > 0) pairs.push(pairs[0]);
  if (request.breaking === "value" && pairs.length > 0) pairs[request.where % pairs.length] = [pairs[request.where % pairs.length][0], request.junk];
  const query = pairs.map(([name, value]) => `${encoded(name)}=${encoded(value)}`).join("&");
  if (request.breaking === "text") path += "%2";
  return path + (query ? `?${query}` : "");
}

function bodyOf(request) {
  if (!request.body) return {};
  let {type, value} = request.body;
  if (request.here) value = withPlace(value, true);
  if (request.breaking === "member" && value && typeof value === "object") value = {...value, nonsense: 1};
  let body = typeof value === "string" ? value : JSON.stringify(value);
  if (type === "application/x-www-form-urlencoded") body = new URLSearchParams(value).toString();
  if (request.breaking === "body") body = request.junk;
  if (request.breaking === "empty") body = "";
  if (request.breaking === "type") type = "text/nonsense";
  return {body, headers: {"Content-Type": type, ...(request.prefer ? {Prefer: "respond-async"} : {})}};
}

async function send(request) {
  const where = target(request);
  const {method} = request.operation;
  const reply = await fetch(daemon.origin + where, {method, ...bodyOf(request)});
  const bytes = Buffer.from(await reply.arrayBuffer());
  if (reply.status === 201) await fetch(daemon.origin + reply.headers.get("location"), {method: "DELETE"});
  return {where, method, status: reply.status, type: reply.headers.get("content-type") ?? "", again: reply.headers.get("retry-after"), bytes};
}

// --- what is to hold -----------------------------------------------------------------------------

const fits = (type, form) => form === "*/*" || type.split(";")[0].trim() === form.split(";")[0].trim();

/// What of an answer the document does not say; empty: nothing.
function undocumented(operation, reply) {
  if (reply.status >= 500 && !(reply.status === 503 && reply.again)) return `status ${reply.status}`;
  const known = resolve(operation.responses[reply.status]);
  if (!known) return `status ${reply.status} is not documented`;
  if (reply.bytes.length === 0) return "";
  const content = Object.entries(known.content ?? {});
  const form = content.find(([one]) => fits(reply.type, one));
  if (!form) return `type ${reply.type} of ${reply.status} is not documented`;
  if (!/json/.test(reply.type) || form[0] === "*/*") return "";
  let json;
  try {
    json = JSON.parse(reply.bytes);
  } catch {
    return `${reply.type} that is no JSON`;
  }
  const schema = resolve(form[1].schema) ?? {};
  if (schema.type === "array") return Array.isArray(json) ? "" : "no array";
  if (schema.type !== "object" || !schema.properties) return "";
  for (const name of schema.required ?? []) if (!(name in json)) return `member ${name} is missing`;
  for (const name of Object.keys(json)) if (!(name in schema.properties)) return `member ${name} is not documented`;
  return "";
}

/// The first of all that says something, or nothing; several at a time.
async function each(list, check) {
  const waiting = [...list], wrong = [];
  await Promise.all(Array.from({length: AT_A_TIME}, async () => {
    while (waiting.length > 0) {
      const said = await check(waiting.pop());
      if (said) wrong.push(said);
    }
  }));
  return wrong;
}

const tell = (request, reply, what) =>
  `${reply.method} ${reply.where}: ${what}\n  sent ${JSON.stringify(bodyOf(request).body ?? "").slice(0, 600)}\n  got ${reply.status} ${reply.bytes.subarray(0, 300)}`;

test("the document is one that Redocly finds no error in", async () => {
  const config = await createConfig({extends: ["recommended"]});
  for (const name of ["openapi.json", "openapi.yaml"]) {
    const source = await (await fetch(`${daemon.origin}/${name}`)).text();
    const problems = await lintFromString({source, absoluteRef: name, config});
    const errors = problems.filter((one) => one.severity === "error");
    assert.deepEqual(errors.map((one) => `${one.ruleId} ${one.location?.[0]?.pointer}: ${one.message}`), []);
  }
});

test("every example is answered", async () => {
  const wrong = await each(operations, async (operation) => {
    const examples = (where) => Object.fromEntries((operation.parameters ?? []).filter((one) => one.in === where && one.example !== undefined)
      .map((one) => [one.name, String(one.example)]));
    const path = {...examples("path"), job: "0".repeat(32)};
    const bodies = Object.entries(operation.requestBody?.content ?? {}).filter(([, one]) => one.example !== undefined);
    if (operation.requestBody && bodies.length === 0) return "";
    for (const body of bodies.length > 0 ? bodies.map(([type, one]) => ({type, value: one.example})) : [null]) {
      const request = {operation, path, query: examples("query"), body, breaking: "nothing"};
      const reply = await send(request);
      const missing = reply.status === 404 && MAY_BE_MISSING.test(operation.operationId);
      const said = undocumented(operation, reply) || (reply.status >= 400 && !missing ? "its example is refused" : "");
      if (said) return tell(request, reply, said);
    }
    return "";
  });
  assert.deepEqual(wrong, []);
});

test(`${REQUESTS} requests, right and wrong, get what the document says`, {timeout: 1.5e6 * Math.max(1, REQUESTS / 2000)}, async () => {
  const statuses = {}, wrong = [];
  const check = async (request) => {
    const reply = await send(request);
    statuses[reply.status] = (statuses[reply.status] ?? 0) + 1;
    const strict = request.breaking === "unknown" && request.operation["x-tind-ignores-other-parameters"] === false;
    const said = undocumented(request.operation, reply) ||
      (strict && reply.status < 400 ? "an unknown parameter is taken" : "");
    return said ? tell(request, reply, said) : "";
  };
  // While they are thought up nothing is sent, and the daemon closes idle connections: those that it
  // has closed must be heard of before they are used again.
  for (let made = 0, part = 0; made < REQUESTS; made += AT_ONCE, ++part) {
    const some = {numRuns: Math.min(AT_ONCE, REQUESTS - made), seed: SEED + part};
    const list = fc.sample(fc.oneof(...operations.map(requests)), some);
    await new Promise((resolve) => setTimeout(resolve, 200));
    wrong.push(...(await each(list, check)));
  }
  console.log(`${REQUESTS} requests of ${operations.length} operations by status: ${JSON.stringify(statuses)}`);
  assert.equal(wrong.length, 0, `${wrong.length} of ${REQUESTS}:\n${wrong.slice(0, 12).join("\n")}`);
  assert.ok(statuses[200] > REQUESTS / 5, "many are right");
});
