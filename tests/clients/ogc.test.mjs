// The abstract tests of OGC API - Common (19-072, 20-024), Tiles (20-057) and Environmental Data
// Retrieval (19-086r6), as far as they can be run against a server, each named as the standard
// names it. What cannot be fetched (drawn pictures, OpenAPI of each parameter) is elsewhere.
import assert from "node:assert/strict";
import {after, before, test} from "node:test";
import {ROOT, startDaemon} from "./daemon.mjs";

const REL = "http://www.opengis.net/def/rel/ogc/1.0";
const SPEC = "http://www.opengis.net/spec";
const CRS84 = "http://www.opengis.net/def/crs/OGC/1.3/CRS84";

let daemon;
before(async () => (daemon = await startDaemon(`${ROOT}/testdata/rainier.tif`, `${ROOT}/testdata/bigtujunga_crop.tif`)));
after(async () => assert.equal(await daemon?.stop(), 0));

const ask = (path, accept = "application/json") => fetch(new URL(path, daemon.origin), {headers: {accept}});

async function json(path) {
  const reply = await ask(path);
  assert.equal(reply.status, 200, path);
  assert.match(reply.headers.get("content-type"), /^application\/(geo\+|prs\.coverage\+)?json/);
  return reply.json();
}

async function page(path) {
  const reply = await ask(path, "text/html");
  assert.equal(reply.status, 200, path);
  assert.match(reply.headers.get("content-type"), /^text\/html/);
  return reply.text();
}

const status = async (path) => (await ask(path)).status;
const linksOf = (document, rel) => document.links.filter((link) => link.rel === rel);
const DOCUMENTS = ["/?f=json", "/conformance", "/collections", "/collections/rainier", "/tileMatrixSets",
  "/tileMatrixSets/WorldCRS84Quad", "/collections/rainier/tiles", "/collections/rainier/tiles/WebMercatorQuad"];

// ---- Common, Part 1
test("common-1 /conf/landing-page/root-op, root-success", async () => {
  const landing = await json("/");
  assert.equal(typeof landing.title, "string");
  assert.ok(linksOf(landing, "service-desc").length + linksOf(landing, "service-doc").length > 0);
  assert.equal(linksOf(landing, `${REL}/conformance`).length, 1);
});

test("common-1 /conf/landing-page/conformance-op, conformance-success", async () => {
  const [link] = linksOf(await json("/"), `${REL}/conformance`);
  for (const path of [link.href, "/conformance"]) {
    const {conformsTo} = await json(path);
    for (const one of ["ogcapi-common-1/1.0/conf/core", "ogcapi-common-1/1.0/conf/landing-page", "ogcapi-common-2/1.0/conf/collections",
      "ogcapi-tiles-1/1.0/conf/core", "ogcapi-edr-1/1.1/conf/core", "ogcapi-edr-1/1.1/conf/queries", "ogcapi-processes-1/1.0/conf/core"])
      assert.ok(conformsTo.includes(`${SPEC}/${one}`), one);
    assert.equal(new Set(conformsTo).size, conformsTo.length);
  }
});

test("common-1 /conf/core/query-param-name-unknown, -value-invalid, -capitalization", async () => {
  for (const path of DOCUMENTS) {
    const with_ = (query) => path.split("?")[0] + query;
    assert.equal(await status(with_("?unknown=1")), 400);
    assert.equal(await status(with_("?f=nonsense")), 400);
    assert.equal(await status(with_("?f=json")), 200);
    assert.equal(await status(with_("?F=json")), 400);
  }
});

test("common-1 /conf/json/content, /conf/html/content: every document in both, each leading to the other", async () => {
  for (const path of DOCUMENTS) {
    const document = await json(path);
    const [self] = linksOf(document, "self"), [other] = linksOf(document, "alternate");
    assert.equal(self.type, "application/json");
    assert.deepEqual((await json(self.href)).links, document.links);
    assert.equal(other.type, "text/html");
    const html = await page(other.href);
    assert.doesNotMatch(html, /<script|<link[^>]*href="http/);
    // All that it leads to is on the page, too.
    for (const link of document.links.filter((l) => !l.templated && l.rel !== "alternate"))
      if (link.href !== self.href) assert.ok(html.includes(new URL(link.href).pathname), link.href);
  }
});

test("common-1: links lead somewhere", async () => {
  const seen = new Set();
  const follow = async (path) => {
    if (seen.has(path)) return;
    seen.add(path);
    const reply = await ask(path, "*/*");
    assert.equal(reply.status, 200, path);
    if (!reply.headers.get("content-type").startsWith("application/json")) return void (await reply.arrayBuffer());
    const {links = [], collections = [], tilesets = []} = await reply.json();
    for (const link of [...links, ...[...collections, ...tilesets].flatMap((one) => one.links)]) {
      const url = new URL(link.href, daemon.origin);
      assert.ok(link.rel && link.type, path);
      const elsewhere = url.pathname === "/openapi.json" || url.pathname.startsWith("/processes") || url.pathname.startsWith("/terrain");
      if (!link.templated && !elsewhere) await follow(url.href);
    }
  };
  await follow(`${daemon.origin}/?f=json`);
  assert.ok(seen.size > 20);
});

// ---- Common, Part 2
test("common-2 /conf/collections: list and descriptions", async () => {
  const list = await json("/collections");
  assert.deepEqual(list.collections.map(({id}) => id).sort(), ["bigtujunga_crop", "rainier"]);
  const {datasets} = await json("/datasets");
  for (const entry of list.collections) {
    const [self] = linksOf(entry, "self");
    const one = await json(self.href);
    for (const name of ["id", "title", "extent", "crs", "data_queries", "parameter_names"]) assert.deepEqual(entry[name], one[name], name);
    assert.equal(one.extent.spatial.crs, CRS84);
    const [west, south, east, north] = one.extent.spatial.bbox[0];
    assert.ok(south < north && west >= -180 && east <= 180);
    assert.deepEqual([west, south, east, north], datasets.find(({name}) => name === one.id).bounds);
  }
  assert.equal(await status("/collections/none"), 404);
});

// ---- Tiles
test("tiles-1 /conf/core/tc-op, tc-success, tc-error, /conf/tileset, /conf/geodata-tilesets", async () => {
  const collection = await json("/collections/rainier");
  const lists = [...linksOf(collection, `${REL}/tilesets-map`), ...linksOf(collection, `${REL}/tilesets-coverage`)];
  assert.equal(lists.length, 2);
  for (const {href} of lists) assert.ok(href.endsWith("/collections/rainier/tiles"));
  const {tilesets} = await json(lists[0].href);
  assert.equal(tilesets.length, 2);
  for (const item of tilesets) {
    const tileset = await json(linksOf(item, "self")[0].href);
    const scheme = await json(linksOf(tileset, `${REL}/tiling-scheme`)[0].href);
    assert.equal(scheme.uri, item.tileMatrixSetURI);
    assert.equal(tileset.crs, scheme.crs);
    for (const template of linksOf(tileset, "item")) {
      assert.ok(template.templated);
      const tile = (matrix, row, col) =>
        ask(template.href.replace("{tileMatrix}", matrix).replace("{tileRow}", row).replace("{tileCol}", col), "*/*");
      for (const limits of tileset.tileMatrixSetLimits.slice(0, 9)) {
        const matrix = scheme.tileMatrices.find(({id}) => id === limits.tileMatrix);
        assert.ok(limits.maxTileRow < matrix.matrixHeight && limits.maxTileCol < matrix.matrixWidth);
        const reply = await tile(limits.tileMatrix, limits.minTileRow, limits.minTileCol);
        assert.ok([200, 204].includes(reply.status), template.href);
        if (reply.status === 200) assert.equal(reply.headers.get("content-type").split(";")[0], template.type);
        assert.equal((await tile(limits.tileMatrix, matrix.matrixHeight, 0)).status, 404);
        assert.equal((await tile(limits.tileMatrix, 0, matrix.matrixWidth)).status, 404);
        if (limits.maxTileCol + 1 < matrix.matrixWidth)
          assert.equal((await tile(limits.tileMatrix, limits.minTileRow, limits.maxTileCol + 1)).status, 404);
      }
      assert.equal((await tile("none", 0, 0)).status, 404);
    }
  }
});

test("tiles-1 /conf/core/tc-success: a tile has what lies in it", async () => {
  // The summit lies in one tile of a level, and only there is the DEM's height in the mesh.
  const [lon, lat, level] = [-121.76, 46.85, 10];
  const side = 180 / 2 ** level, col = Math.floor((lon + 180) / side), row = Math.floor((90 - lat) / side);
  const reply = await ask(`/collections/rainier/tiles/WorldCRS84Quad/${level}/${row}/${col}`, "*/*");
  assert.equal(reply.status, 200);
  const bytes = new DataView(await reply.arrayBuffer());
  assert.ok(bytes.getFloat32(28, true) > 4300, "the header's greatest height");
});

// ---- EDR
test("edr-1 /conf/edr/rc-collection-info, rc-data-queries, rc-common-variables, rc-parameters", async () => {
  for (const collection of (await json("/collections")).collections) {
    for (const [type, {link}] of Object.entries(collection.data_queries)) {
      assert.ok(link.href.includes(`/collections/${collection.id}/${type}?`));
      assert.equal(link.rel, "data");
      assert.equal(link.variables.query_type, type);
      assert.ok(link.variables.output_formats.includes(link.variables.default_output_format));
      if (type === "corridor") assert.ok(link.variables.width_units.length > 0 && link.variables.height_units.length > 0);
    }
    for (const parameter of Object.values(collection.parameter_names)) {
      assert.equal(parameter.type, "Parameter");
      assert.ok(parameter.observedProperty.id && parameter.observedProperty.label);
      assert.ok(parameter.unit.symbol.value);
    }
    for (const crs of collection.crs) assert.match(crs, /^http:\/\/www\.opengis\.net\/def\/crs\//);
  }
});

const QUERIES = {
  position: "coords=POINT(-121.76 46.85)",
  trajectory: "coords=LINESTRING(-121.8 46.8,-121.7 46.9)",
  area: "coords=POLYGON((-121.8 46.8,-121.7 46.8,-121.7 46.9,-121.8 46.8))",
  cube: "bbox=-121.8,46.8,-121.79,46.81",
  corridor: "coords=LINESTRING(-121.8 46.8,-121.79 46.81)&corridor-width=200&width-units=m&corridor-height=10&height-units=m",
};
const query = (type, text) => `/collections/rainier/${type}?${text.replaceAll(" ", "%20")}`;

for (const [type, good] of Object.entries(QUERIES)) {
  test(`edr-1 /conf/${type}: no-query-params, no-coords-param, coords-param-invalid, valid-query-params`, async () => {
    assert.equal(await status(`/collections/rainier/${type}`), 400);
    const place = type === "cube" ? "bbox" : "coords";
    const without = good.split("&").filter((part) => !part.startsWith(place)).join("&");
    assert.equal(await status(query(type, without)), 400);
    for (const bad of ["NONSENSE", "POINT(1)", "1,2,3", type === "position" ? "LINESTRING(1 2,3 4)" : "POINT(1 2)"])
      assert.equal(await status(query(type, `${without}&${place}=${bad}`)), 400, bad);
    for (const more of ["", "&parameter-name=height", "&crs=CRS84", `&crs=${encodeURIComponent(CRS84)}`, "&f=CoverageJSON",
      "&z=100", "&datetime=2020-01-01T00:00:00Z"]) {
      const coverage = await json(query(type, good + more));
      assert.equal(coverage.type, "Coverage");
      assert.deepEqual(Object.keys(coverage.ranges), ["height"]);
      const {shape = [1], values} = coverage.ranges.height;
      assert.equal(values.length, shape.reduce((a, b) => a * b, 1));
      assert.ok(values.some((height) => height > 500));
    }
    for (const bad of ["&parameter-name=wind", "&crs=EPSG:1", "&crs=file.prj", "&f=nonsense"])
      assert.equal(await status(query(type, good + bad)), 400, bad);
  });

  test(`edr-1 /conf/geojson, /conf/covjson: ${type}`, async () => {
    const reply = await ask(query(type, `${good}&f=GeoJSON`));
    assert.equal(reply.headers.get("content-type"), "application/geo+json");
    const {type: kind, features} = await reply.json();
    assert.equal(kind, "FeatureCollection");
    assert.ok(features.length > 0 && features.every(({geometry}) => ["Point", "LineString"].includes(geometry.type)));
    const coverage = await json(query(type, good));
    assert.equal(coverage.domain.referencing[0].system.id, CRS84);
    assert.equal((await ask(query(type, good))).headers.get("content-type"), "application/prs.coverage+json");
  });
}

test("edr-1 /conf/trajectory, /conf/corridor: a separate z beside LINESTRINGZ", async () => {
  for (const type of ["trajectory", "corridor"])
    for (const [name, numbers] of [["LINESTRINGZ", "9"], ["LINESTRINGZM", "9 8"]]) {
      const line = QUERIES[type].replace("LINESTRING", name).replace(/(\d+\.\d+)([,)])/g, `$1 ${numbers}$2`);
      assert.equal(await status(query(type, line)), 200, line);
      assert.equal(await status(query(type, `${line}&z=5`)), 400, line);
    }
});

test("edr-1 /conf/corridor: each of its parameters is demanded, its units are checked", async () => {
  const parts = QUERIES.corridor.split("&");
  for (const part of parts) assert.equal(await status(query("corridor", parts.filter((p) => p !== part).join("&"))), 400, part);
  for (const units of ["width-units", "height-units"])
    assert.equal(await status(query("corridor", QUERIES.corridor.replace(`${units}=m`, `${units}=parsec`))), 400);
});

test("edr-1 /req/edr/resolution-x: positions from one end to the other", async () => {
  const {domain: {axes}} = await json(query("cube", `${QUERIES.cube}&resolution-x=5&resolution-y=3`));
  assert.deepEqual(axes, {x: {start: -121.8, stop: -121.79, num: 5}, y: {start: 46.81, stop: 46.8, num: 3}});
  assert.equal(await status(query("cube", `${QUERIES.cube}&resolution-x=-1`)), 400);
});
