// The abstract tests of OGC API - Processes, Part 1 (18-062r2): core, ogc-process-description, json,
// job-list and dismiss, each named as the standard names it. Not here: that every parameter stands in
// the OpenAPI document as it is read, which openapi.test.mjs holds for all operations.
import assert from "node:assert/strict";
import {after, before, test} from "node:test";
import {ROOT, startDaemon} from "./daemon.mjs";

const REL = "http://www.opengis.net/def/rel/ogc/1.0";
const EXCEPTION = "http://www.opengis.net/def/exceptions/ogcapi-processes-1/1.0";
const BBOX = [-121.78, 46.84, -121.74, 46.87];
const INPUTS = {dataset: "rainier", max_error: 20, bbox: BBOX, format: "obj"};

let daemon;
before(async () => (daemon = await startDaemon(`${ROOT}/testdata/rainier.tif`)));
after(async () => assert.equal(await daemon?.stop(), 0));

const ask = (path, options) => fetch(new URL(path, daemon.origin), options);
async function json(path, status = 200) {
  const reply = await ask(path);
  assert.equal(reply.status, status, path);
  assert.match(reply.headers.get("content-type"), /^application\/(problem\+)?json/);
  return reply.json();
}
const execute = (body, prefer, id = "simplify") =>
  ask(`/processes/${id}/execution`, {
    method: "POST",
    headers: {"content-type": "application/json", ...(prefer && {prefer})},
    body: typeof body === "string" ? body : JSON.stringify(body),
  });
async function submitted(body, id) {
  const reply = await execute(body, "respond-async", id);
  assert.equal(reply.status, 201, await reply.clone().text());
  return reply;
}
/// The status of a job once it has ended.
async function ended(where) {
  for (;;) {
    const job = await json(where);
    if (!["accepted", "running"].includes(job.status)) return job;
    await new Promise((resolve) => setTimeout(resolve, 50));
  }
}
const is_status = (job) => {
  assert.match(job.jobID, /^[0-9a-f]{32}$/);
  assert.equal(job.type, "process");
  assert.ok(["accepted", "running", "successful", "failed", "dismissed"].includes(job.status));
  assert.ok(job.progress >= 0 && job.progress <= 100);
  for (const time of ["created", "updated"]) assert.ok(!Number.isNaN(Date.parse(job[time])), time);
};
const is_exception = (problem, type) => {
  assert.equal(typeof problem.title, "string");
  assert.equal(problem.type, `${EXCEPTION}/${type}`);
};

// ---- core
test("core /conf/core/landingpage-success: the landing page leads to processes and jobs", async () => {
  const {links} = await json("/");
  for (const [rel, path] of [["processes", "/processes"], ["job-list", "/jobs"], ["conformance", "/conformance"]]) {
    const [link] = links.filter((one) => one.rel === `${REL}/${rel}`);
    assert.equal(new URL(link?.href, daemon.origin).pathname, path, rel);
  }
});

test("core /conf/core/conformance-success", async () => {
  const {conformsTo} = await json("/conformance");
  for (const one of ["core", "ogc-process-description", "json", "job-list", "dismiss"])
    assert.ok(conformsTo.includes(`http://www.opengis.net/spec/ogcapi-processes-1/1.0/conf/${one}`), one);
});

test("core /conf/core/process-list-success, pl-limit-definition, pl-limit-response, pl-links", async () => {
  const {processes} = await json("/processes");
  assert.ok(processes.length > 5);
  for (const one of processes)
    for (const member of ["id", "version", "jobControlOptions", "outputTransmission", "links"]) assert.ok(member in one, member);
  const found = [];
  for (let path = "/processes?limit=3"; path; ) {
    const page = await json(path);
    assert.ok(page.processes.length <= 3);
    assert.equal(page.links.filter((link) => link.rel === "self").length, 1);
    found.push(...page.processes.map((one) => one.id));
    path = page.links.find((link) => link.rel === "next")?.href;
  }
  assert.deepEqual(found, processes.map((one) => one.id));
  for (const limit of ["0", "-1", "1001", "1.5", "many"]) assert.equal((await ask(`/processes?limit=${limit}`)).status, 400, limit);
});

test("core /conf/core/process-success, /conf/ogc-process-description: each process describes what it takes and makes", async () => {
  for (const {id, links} of (await json("/processes")).processes) {
    for (const {href} of links) assert.equal(new URL(href).origin, daemon.origin, href);
    const process = await json(links.find((link) => link.rel === "self").href);
    assert.equal(process.id, id);
    assert.ok(Object.keys(process.inputs).length > 0 && Object.keys(process.outputs).length > 0);
    for (const one of [...Object.values(process.inputs), ...Object.values(process.outputs)]) assert.equal(typeof one.schema, "object");
    assert.equal(process.links.filter((link) => link.rel === `${REL}/execute`).length, 1);
  }
});

test("core /conf/core/process-exception-no-such-process", async () => {
  is_exception(await json("/processes/none", 404), "no-such-process");
  const reply = await execute({inputs: {}}, undefined, "none");
  assert.equal(reply.status, 404);
  is_exception(await reply.json(), "no-such-process");
});

test("core /conf/core/process-execute-default-execution-mode, -sync-raw-value-one: the mesh itself", async () => {
  const reply = await execute({inputs: INPUTS});
  assert.equal(reply.status, 200);
  assert.match(await reply.text(), /^v /m);
});

test("core /conf/core/process-execute-sync-document, -sync-raw-ref", async () => {
  const reply = await execute({inputs: INPUTS, outputs: {mesh: {}, report: {}}, response: "document"});
  assert.equal(reply.status, 200);
  assert.match(reply.headers.get("content-type"), /^application\/json/);
  const document = await reply.json();
  assert.ok(document.report.value.triangles > 0);
  assert.match(await (await ask(document.mesh.href)).text(), /^v /m);
});

test("core /conf/core/process-execute-input-inline-bbox, -inline-object, -input-array, -mixed-type", async () => {
  const outputs = {report: {}};
  const rim = [[BBOX[0], BBOX[1]], [BBOX[2], BBOX[1]], [BBOX[2], BBOX[3]], [BBOX[0], BBOX[3]], [BBOX[0], BBOX[1]]];
  for (const inputs of [
    {...INPUTS, bbox: {bbox: BBOX, crs: "http://www.opengis.net/def/crs/OGC/1.3/CRS84"}},
    {...INPUTS, bbox: undefined, polygon: {type: "Polygon", coordinates: [rim]}},
    {...INPUTS, method: "edge-cost", alpha: 0.5, max_error: undefined, ratio: 0.2},
    {...INPUTS, method: "qem", max_error: undefined, triangles: 500},
  ]) {
    const reply = await execute({inputs, outputs});
    assert.equal(reply.status, 200, JSON.stringify(inputs) + (await reply.clone().text()));
    assert.ok((await reply.json()).triangles > 0);
  }
  const levels = await execute({inputs: {dataset: "rainier", bbox: BBOX, levels: [2000, 2100.5], format: "geojson"}}, undefined, "contours");
  assert.equal(levels.status, 200);
});

test("core /conf/core/process-execute-input-inline-binary: a mesh in base64, and as the text that it is", async () => {
  const obj = "v 0 0 0\nv 100 0 1\nv 0 100 2\nv 100 100 4\nf 1 2 4\nf 1 4 3\n";
  const found = [];
  for (const mesh of [
    Buffer.from(obj).toString("base64"),
    {value: Buffer.from(obj).toString("base64"), mediaType: "model/obj", encoding: "base64"},
    {value: obj, mediaType: "model/obj", encoding: "utf-8"},
  ]) {
    const inputs = {mesh, triangles: 2, format: "obj", ...(typeof mesh === "string" && {mesh_format: "obj"})};
    const reply = await execute({inputs, outputs: {report: {}}});
    assert.equal(reply.status, 200, await reply.clone().text());
    found.push((await reply.json()).triangles);
  }
  assert.deepEqual(found, [2, 2, 2]);
});

test("core: no input is fetched from where a request says", async () => {
  for (const href of ["http://127.0.0.1/mesh.obj", "file:///etc/passwd"]) {
    const reply = await execute({inputs: {mesh: {href, type: "model/obj"}, triangles: 2}});
    assert.equal(reply.status, 400, href);
  }
});

test("core /conf/core/process-execute-input-validation: what is wrong is named", async () => {
  for (const [body, name] of [
    [{inputs: {...INPUTS, dataset: "none"}}, "inputs.dataset"],
    [{inputs: {...INPUTS, bbox: [1, 2, 3]}}, "inputs.bbox"],
    [{inputs: {...INPUTS, max_error: "two"}}, "inputs.max_error"],
    [{inputs: {...INPUTS, unknown: 1}}, "inputs.unknown"],
    [{inputs: {...INPUTS, max_error: undefined}}, undefined],
    [{inputs: [1]}, "inputs"],
    [{}, "inputs"],
    [{inputs: INPUTS, outputs: {none: {}}}, undefined],
    ["no JSON", "body"],
  ]) {
    const reply = await execute(body);
    assert.equal(reply.status, 400, JSON.stringify(body));
    const problem = await reply.json();
    if (name) assert.ok(problem.errors.some((one) => one.parameter === name), `${name}: ${JSON.stringify(problem.errors)}`);
    else assert.ok(problem.detail.length > 0);
  }
});

test("core /conf/core/process-execute-auto-execution-mode, job-creation-success, job-success, job-results", async () => {
  const reply = await submitted({inputs: INPUTS, outputs: {mesh: {}, report: {}}});
  assert.match(reply.headers.get("preference-applied"), /respond-async/);
  const made = await reply.json(), where = reply.headers.get("location");
  is_status(made);
  assert.equal(new URL(where, daemon.origin).pathname, `/jobs/${made.jobID}`);
  const job = await ended(where);
  is_status(job);
  assert.deepEqual([job.status, job.progress, job.processID], ["successful", 100, "simplify"]);
  const [results] = job.links.filter((link) => link.rel === `${REL}/results`);
  const document = await json(results.href);
  assert.ok(document.report.value.triangles > 0 && document.mesh.href);
});

test("core /conf/core/job-results-async-raw-value-one: one output is itself, however it was asked for", async () => {
  const order = {inputs: INPUTS, outputs: {mesh: {}}};
  const at_once = await (await execute(order)).text();
  const where = (await submitted(order)).headers.get("location");
  assert.equal((await ended(where)).status, "successful");
  const results = await ask(`${where}/results`);
  assert.equal(results.status, 200);
  assert.equal(await results.text(), at_once);
});

test("core /conf/core/job-exception-no-such-job, job-results-exception/no-such-job", async () => {
  for (const path of ["", "/results", "/results/mesh"]) is_exception(await json(`/jobs/${"0".repeat(32)}${path}`, 404), "no-such-job");
});

test("core /conf/core/job-results-exception/results-not-ready, /conf/dismiss/job-dismiss-success", async () => {
  // Two at once: one runs at a time, so the second has not begun.
  const long = {inputs: {dataset: "rainier", ratio: 0.01, method: "vertex-removal"}};
  const all = await Promise.all([submitted(long), submitted(long)]);
  const [, waiting] = all.map((reply) => reply.headers.get("location"));
  const not_ready = await ask(`${waiting}/results`);
  if (not_ready.status !== 200) {
    assert.equal(not_ready.status, 404);
    is_exception(await not_ready.json(), "result-not-ready");
  }
  for (const reply of all) {
    const where = reply.headers.get("location");
    const gone = await ask(where, {method: "DELETE"});
    assert.equal(gone.status, 200);
    const job = await gone.json();
    is_status(job);
    assert.ok(["dismissed", "successful"].includes(job.status), job.status);
    const after_ = await ask(where);
    assert.ok(after_.status === 404 || (await after_.json()).status === job.status);
    assert.equal((await ask(`${where}/results`)).status, 404);
  }
  is_exception(await (await ask(`/jobs/${"0".repeat(32)}`, {method: "DELETE"})).json(), "no-such-job");
});

test("core /conf/core/job-results-failed: a failed job says why where its results would be", async () => {
  // No mesh of so few triangles has this line as edges.
  const reply = await submitted({inputs: {dataset: "rainier", bbox: [7, 46, 8, 47], ratio: 0.5}}).catch((error) => error);
  if (reply instanceof Error) return assert.match(reply.message, /400/);  // refused before it is a job
  const where = reply.headers.get("location"), job = await ended(where);
  assert.equal(job.status, "failed");
  assert.ok(job.message.length > 0);
  const results = await ask(`${where}/results`);
  assert.ok(results.status >= 400 && results.status < 600);
  assert.match(results.headers.get("content-type"), /problem\+json/);
});

// ---- job-list
test("job-list /conf/job-list/job-list-success, limit, type, processID, status, datetime, duration", async () => {
  const before_ = new Date(Date.now() - 1000).toISOString();
  const own = [];
  for (const [id, inputs] of [["simplify", INPUTS], ["slope", {dataset: "rainier", bbox: BBOX}], ["slope", {dataset: "rainier", bbox: BBOX}]]) {
    const where = (await submitted({inputs}, id)).headers.get("location");
    own.push((await ended(where)).jobID);
  }
  const ids = async (query) => (await json(`/jobs?${query}`)).jobs.map((job) => job.jobID);
  const all = await ids("");
  for (const id of own) assert.ok(all.includes(id));
  for (const job of (await json("/jobs")).jobs) is_status(job);

  const paged = [];
  for (let path = "/jobs?limit=2&type=process"; path; ) {
    const page = await json(path);
    assert.ok(page.jobs.length <= 2);
    paged.push(...page.jobs.map((job) => job.jobID));
    path = page.links.find((link) => link.rel === "next")?.href;
  }
  assert.deepEqual(paged, all);

  assert.deepEqual(new Set(await ids("processID=slope")), new Set(own.slice(1)));
  assert.deepEqual(new Set(await ids("processID=slope,simplify")), new Set(await ids("processID=simplify,slope")));
  for (const job of (await json("/jobs?processID=slope")).jobs) assert.equal(job.processID, "slope");
  for (const job of (await json("/jobs?status=successful")).jobs) assert.equal(job.status, "successful");
  assert.ok((await ids("status=successful,failed")).includes(own[0]));
  assert.deepEqual(await ids("status=accepted"), []);
  assert.deepEqual(await ids("type=other"), []);
  assert.ok((await ids(`datetime=${before_}/..`)).includes(own[0]));
  assert.ok(!(await ids(`datetime=../${before_}`)).includes(own[0]));
  assert.deepEqual(await ids("datetime=1999-12-31"), []);
  assert.ok((await ids("minDuration=0&maxDuration=600")).includes(own[0]));
  assert.deepEqual(await ids("minDuration=100000"), []);
  for (const wrong of ["limit=0", "status=done", "datetime=yesterday", "datetime=2026-02-01/2026-01-01", "datetime=../..", "minDuration=-1", "processID="])
    assert.equal((await ask(`/jobs?${wrong}`)).status, wrong === "processID=" ? 200 : 400, wrong);
});
