// The viewer's parts that need no browser: what a link says, where a place is, how long and how wide,
// what is draped over a tile, and how far the mesh is from the source.
import assert from "node:assert/strict";
import {test} from "node:test";
import {inTurnOf, shared} from "../../server/viewer/globe/box.js";
import {along, geodesic, localFrame, pathMetres, polygonArea, sightLine} from "../../server/viewer/globe/geodesy.js";
import {acrossOf, axes, extentOf, eyeClearOf, eyeThatFits, homeOf} from "../../server/viewer/globe/home.js";
import {areaText, contourInterval, lengthText, roundLength, ticks} from "../../server/viewer/globe/legend.js";
import {linkOf, viewOf} from "../../server/viewer/globe/link.js";
import {factsOf, isShowable, oneSource, ownFacts} from "../../server/viewer/globe/cards.js";
import {DEPTHS, heightScale, heightStops, TINTS, tintTop, washed} from "../../server/viewer/globe/material.js";
import {objOf} from "../../server/viewer/globe/mesh_file.js";
import {rasterise} from "../../server/viewer/globe/mesh_raster.js";
import {matches, placeOf} from "../../server/viewer/globe/places.js";
import {LEFT, profileFigures, RIGHT, runs, sampleAt} from "../../server/viewer/globe/profile.js";
import {contourTile, errorByte, errorOfByte, errorScale, errorTile, GROUND, GROUND_HIGH, GROUND_LOW, heightByte, heightOfByte, reliefTile, SEA, SIDE, slopeByte, slopeOfByte, UNKNOWN_HEIGHT, VOID, WAVE_STEPS, WAVE_ZERO, waveByte} from "../../server/viewer/globe/relief_tile.js";
import {shiftLattice, shiftOf} from "../../server/viewer/globe/shift.js";
import {columnOf, heightsOfColours, latOf, lonOf, PIXELS, rowOf, SourceHeights} from "../../server/viewer/globe/source_heights.js";
import {labelsThatFit, latticeLines, tileSides} from "../../server/viewer/globe/tile_lines.js";
import {heightInTile} from "../../server/viewer/quantized_mesh.js";

const near = (a, b, by, what) => assert.ok(Math.abs(a - b) <= by, `${what ?? ""} ${a}, not ${b}`);

test("a link brings back the view that it was made of", () => {
  const view = {camera: {lon: -121.760833, lat: 46.8525, height: 5123.4, heading: 350.25, pitch: -31.5}, mode: "error",
    exaggeration: 2.5, wires: true, tiles: true, flat: true, sun: {azimuth: 120, altitude: 12}, beside: {dataset: "a b,c", level: 9, mode: "slope"}};
  assert.deepEqual(viewOf(`#${linkOf(view)}`), view);
  assert.equal(linkOf({mode: "relief", exaggeration: 1, sun: {azimuth: 315, altitude: 38}}), "");
});

test("the legend's tints are those of the ground: depths below the sea, land above it", () => {
  assert.equal(heightStops({low: -400, high: 100, seaLevel: 0}), TINTS); // land by the Dead Sea
  assert.equal(heightStops({low: -4000, high: 100}), TINTS);
  const coast = heightStops({low: -3000, high: 1000, seaLevel: 0});
  assert.deepEqual(coast.slice(0, 3), [[0, DEPTHS[0][1]], [0.6 * 0.75, DEPTHS[1][1]], [0.75, DEPTHS[2][1]]]);
  TINTS.forEach(([at, colour], i) => { // all of the land's, from the shore up
    near(coast[3 + i][0], 0.75 + 0.25 * at, 1e-12);
    assert.equal(coast[3 + i][1], colour);
  });
  const trench = heightStops({low: -4000, high: -3000, seaLevel: 0});
  assert.deepEqual([trench[0], trench.at(-1)], [[0, DEPTHS[0][1]], [1, "#4a7a9d"]]); // a quarter of the way up to the shore
  for (const stops of [coast, trench]) assert.ok(stops.every(([at], i) => i === 0 || at >= stops[i - 1][0]));
});

test("the legend's tints are as pale as the ground that other things are drawn on", () => {
  assert.deepEqual(washed(TINTS, "relief"), TINTS);
  for (const mode of ["multi", "contours"]) washed(TINTS, mode).forEach(([at, colour], i) => {
    assert.equal(at, TINTS[i][0]);
    assert.match(colour, /^#[cdef][0-9a-f][cdef][0-9a-f][bcdef][0-9a-f]$/);
  });
});

test("the tints of flat land do not paint the error of its mesh, those of mountains reach their summit", () => {
  assert.equal(tintTop({low: 294, high: 4352, extent: 36000}), 4352);
  assert.ok(tintTop({low: 171, high: 171.5, extent: 14000}) >= 171 + 10 * 2.4, "2.4 m that the mesh is off are a tenth of the scale");
  assert.equal(tintTop({low: 5, high: 5, extent: 70}), 6);
  assert.equal(tintTop({low: -10340, high: 7803, extent: 1.27e7}), 7803);
  assert.equal(tintTop({low: 30, high: 90, extent: 68000, source: {}}), 90, "a source's own heights use all of the scale");
  assert.equal(tintTop({low: 171, high: 171.5, extent: 14000, source: {}}), 181);
});

test("a dataset's heights come with their datum, one height is said once", () => {
  const facts = (low, high) => factsOf({datum: "ellipsoid", max_level: 9, state: "ready", lowest: low && {height_m: low}, highest: high && {height_m: high}});
  assert.ok(facts(-33.6, 4352.2).includes("−34 to 4,352 m above the ellipsoid"));
  assert.ok(facts(171.1, 171.4).includes("171 m above the ellipsoid"));
  assert.ok(facts().includes("heights above the ellipsoid"));
  assert.ok(factsOf({datum: null, max_level: 9, state: "ready"}).includes("heights of unknown datum"));
});

test("of a dataset that failed, or has no tiles, nothing is said that is not so", () => {
  const box = [10, 45, 11, 46], source = {columns: 2, rows: 2, spacing_m: [5, 5]};
  assert.deepEqual(factsOf({box, datum: "egm96", state: "failed"}), ["could not be read; the daemon's log says why"]);
  const bare = factsOf({box, source, datum: "egm96", state: "ready"});
  assert.ok(bare.includes("no tiles, heights only") && !bare.join().includes("undefined"), bare.join());
  assert.ok(factsOf({box, source: {...source, columns: 1, rows: 1}, datum: "egm96", state: "ready"}).includes("a single post"));
  assert.deepEqual([{state: "ready", max_level: 9}, {state: "reading", max_level: 0}, {state: "failed", max_level: 9}, {state: "ready"}].map(isShowable), [true, true, false, false]);
});

test("of layers the facts are those of all together", () => {
  const layer = (columns, metres, datum) => ({columns, rows: 10, spacing_m: [metres, metres], datum, accuracy: {m: 4, kind: "LE90"}});
  const layers = [layer(60, 350, "egm96"), layer(200, 420, "egm96")];
  const facts = factsOf({box: [10, 45, 11, 46], source: {layers}, datum: "ellipsoid", max_level: 9, state: "ready"});
  assert.ok(facts.includes("2 layers, 2,600 posts, the finest 350 m apart"), facts.join());
  assert.ok(facts.includes("accuracy 4 m (LE90)"), facts.join());
  assert.equal(oneSource({layers}).datum, "egm96");
  assert.deepEqual(oneSource(oneSource({layers})), oneSource({layers}));
  const mixed = oneSource({layers: [layer(60, 350, "egm96"), layer(60, 420, "ellipsoid")]});
  assert.equal(mixed.datum, undefined, "layers that count from different things have no datum of their own");
  assert.equal(oneSource(null), undefined);
});

test("a link that is cut or made up still opens", () => {
  for (const hash of ["", "#", "#view=1,2", "#view=1,95,3,4,5", "#view=NaN,0,0,0,0", "#mode=x&high=99&sun=1", "#beside=%E0%A4%A,x,y", "#=&&=="]) {
    const {camera, mode, exaggeration, sun} = viewOf(hash);
    assert.deepEqual([camera, mode, exaggeration, sun], [undefined, "relief", 1, {azimuth: 315, altitude: 38}], hash);
  }
});

test("places are understood as people write them, and nonsense is not", () => {
  for (const text of ["46.85, -121.76", "46.85 -121.76", "46.85N 121.76W", "N46.85, W121.76", "121.76 W, 46.85 N", "46°51'0\"N 121°45'36\"W", "46.85,−121.76"]) {
    const place = placeOf(text);
    near(place.lat, 46.85, 1e-9, text);
    near(place.lon, -121.76, 1e-9, text);
  }
  for (const text of ["", "rainier", "46.85", "95, 10", "10, 181", "10N 20N", "10E 20E", "1 2 3"]) assert.equal(placeOf(text), undefined, text);
  const names = [{name: "mount_sum"}, {name: "summer"}];
  assert.deepEqual(matches("sum", names).map(({kind, name}) => name ?? kind), ["highest", "summer", "mount_sum"]);
  assert.deepEqual(matches("nowhere", names), []);
});

test("lengths and azimuths are Vincenty's, areas those of the ellipsoid", () => {
  // Flinders Peak to Buninyong, Geoscience Australia's worked example (GRS80, which differs by 0.1 mm).
  const dms = (d, m, s) => Math.sign(d) * (Math.abs(d) + m / 60 + s / 3600);
  const {metres, azimuth} = geodesic([dms(144, 25, 29.52440), dms(-37, 57, 3.72030)], [dms(143, 55, 35.38390), dms(-37, 39, 10.15610)]);
  near(metres, 54972.271, 0.001);
  near(azimuth, dms(306, 52, 5.37), 1e-5);
  assert.equal(geodesic([7, 8], [7, 8]).metres, 0);
  near(geodesic([0, 0], [180, 0]).metres, 20015000, 30000, "antipodes");
  // An octant is an eighth of the ellipsoid's 510,065,621.7 square kilometres.
  near(polygonArea([[0, 0], [90, 0], [90, 90], [0, 90]]) / 1e6, 510065621.724 / 8, 1);
  near(polygonArea([[179, 0], [-179, 0], [-179, 1], [179, 1]]), polygonArea([[0, 0], [2, 0], [2, 1], [0, 1]]), 1, "over the date line");
  // A ring around a pole holds what lies within: with the belt up to it, half of the ellipsoid.
  const ring = (lat) => [0, 90, 180, -90].map((lon) => [lon, lat]), belt = polygonArea([[0, 0], [90, 0], [90, 89], [0, 89]]) * 4;
  for (const lat of [89, -89]) near((polygonArea(ring(lat)) + belt) / 1e6, 510065621.724 / 2, 1, `around the pole at ${lat}`);
  near(polygonArea(ring(89).reverse()), polygonArea(ring(89)), 1, "the other way round");
  const steps = along([[0, 0], [0, 1], [1, 1]], 31);
  near(steps.at(-1).metres, pathMetres([[0, 0], [0, 1], [1, 1]]), 1e-6);
  near(steps.at(-1).lon, 1, 1e-12);
  near(geodesic([steps[3].lon, steps[3].lat], [steps[4].lon, steps[4].lat]).metres, steps[4].metres - steps[3].metres, 1e-3);
  // Places lie on the geodesic: their lengths from both ends add up to its own, also over a pole and at 60 degrees.
  for (const [from, to] of [[[10, 60], [28, 60]], [[0, 89.9], [180, 89.9]], [[179, -45], [-170, 20]], [[5, 40], [5, 50]], [[3, 0], [9, 0]]]) {
    const all = geodesic(from, to).metres;
    for (const {lon, lat, metres} of along([from, to], 7)) {
      near(geodesic(from, [lon, lat]).metres, metres, 1e-3, `${from} to ${to}`);
      near(geodesic([lon, lat], to).metres, all - metres, 1e-3, `${from} to ${to}`);
    }
  }
  assert.ok(along([[0, 0], [180, 0]], 5).every(({lon, lat}) => Number.isFinite(lon + lat)), "antipodes");
});

test("a line of sight ends behind a hill, and at the horizon", () => {
  const line = (heights, step) => heights.map((height, i) => ({metres: i * step, height}));
  assert.deepEqual(sightLine(line([0, 0, 50, 0, 60, 200], 100)), [true, true, true, false, false, true]);
  assert.deepEqual(sightLine(line([0, undefined, 50], 100)), [true, undefined, true]);
  // From 1.7 m over a plain the eye reaches sqrt(2 R h / 0.87): 4.99 km.
  const plain = sightLine(line(new Array(1001).fill(0), 10));
  near(plain.lastIndexOf(true) * 10, Math.sqrt((2 * 6371000 * 1.7) / 0.87), 20);
});

test("home fills the frame with the data, whatever the frame", () => {
  const box = [];
  for (const x of [-20000, 20000]) for (const y of [-5000, 5000]) for (const z of [-100, 3000]) box.push([x, y, z]);
  const frame = {left: -0.5, right: 0.95, bottom: -0.9, top: 0.85};
  for (const aspect of [1400 / 900, 390 / 844, 3]) {
    for (const pitch of [-0.4, -1.2]) {
      const camera = axes(0.35, pitch), tanY = Math.tan(0.5), tanX = tanY * aspect;
      const {left, right, bottom, top} = extentOf(box, eyeThatFits(box, camera, tanX, tanY, frame), camera, tanX, tanY);
      assert.ok(left > -0.52 && right < 0.97 && bottom > -0.92 && top < 0.87, JSON.stringify({left, right, bottom, top}));
      assert.ok(right - left > 1.4 || top - bottom > 1.7, "it fills one direction");
    }
  }
});

test("home leaves the corners free where panels lie", () => {
  const steep = [];
  for (let i = 0; i <= 24; ++i) for (let j = 0; j <= 24; ++j) for (const z of [0, 2000, 4000]) steep.push([i * 400 - 4800, j * 400 - 4800, z]);
  const frame = {left: -0.6, right: 0.98, bottom: -0.95, top: 0.88};
  const corners = [{left: 0.56, right: 1, bottom: -0.95, top: -0.55}, {left: 0.6, right: 1, bottom: 0.76, top: 0.88}, {left: -0.6, right: -0.4, bottom: 0.7, top: 0.88}];
  let covered = 0;
  for (const aspect of [1400 / 900, 390 / 844]) for (const pitch of [-0.3, -0.6, -1]) {
    const camera = axes(0.35, pitch), tanY = Math.tan(0.4), tanX = tanY * aspect;
    const fit = (room) => eyeThatFits(steep, camera, tanX, tanY, room);
    const behind = (eye) => corners.filter(({left, right, bottom, top}) => steep.some((point) => {
      const {left: x, bottom: y} = extentOf([point], eye, camera, tanX, tanY);
      return x > left && x < right && y > bottom && y < top;
    })).length;
    const full = fit(frame), eye = eyeClearOf(corners, steep, fit, camera, tanX, tanY, frame);
    covered += behind(full);
    assert.equal(behind(eye), 0);
    const seen = extentOf(steep, eye, camera, tanX, tanY), all = extentOf(steep, full, camera, tanX, tanY);
    assert.ok(seen.left > frame.left - 0.01 && seen.right < frame.right + 0.01 && seen.bottom > frame.bottom - 0.01 && seen.top < frame.top + 0.01);
    assert.ok(seen.right - seen.left > 0.55 * (all.right - all.left), "it stays large");
    assert.deepEqual(eyeClearOf([], steep, fit, camera, tanX, tanY, frame), full);
  }
  assert.ok(covered > 0, "without care, a panel lies over it");
});

const FIJI = {west: 179, south: -20, east: 181, north: -18}; // as /datasets has it

test("a box across the antimeridian is compared with what stays within a turn", () => {
  assert.deepEqual(shared(FIJI, {west: -180, south: -90, east: 0, north: 90}), {west: 180, south: -20, east: 181, north: -18});
  assert.deepEqual(shared(FIJI, {west: 90, south: -19, east: 180, north: 0}), {west: 179, south: -19, east: 180, north: -18});
  for (const beside of [{west: -179, south: -20, east: -178, north: -19}, {west: 0, south: -20, east: 179, north: -19}, {west: -180, south: -18, east: 180, north: 0}])
    assert.equal(shared(FIJI, beside), undefined);
  assert.deepEqual(inTurnOf(FIJI, {west: -180, south: -22.5, east: -157.5, north: 0}), {west: 180, south: -22.5, east: 202.5, north: 0});
  assert.deepEqual(inTurnOf(FIJI, {west: 0, south: 0, east: 1, north: 1}), {west: 0, south: 0, east: 1, north: 1});
});

const FRAMES = [{name: "desk", aspect: 1400 / 900, free: {left: -0.5, right: 0.95, bottom: -0.9, top: 0.85}}, {name: "phone", aspect: 390 / 844, free: {left: -0.95, right: 0.95, bottom: -0.87, top: 0.82}}];
const homeIn = (box, {aspect, free}, heights = {low: 0, high: 1300, top: 1300}) => {
  const [tanX, tanY] = aspect > 1 ? [Math.tan(Math.PI / 6), Math.tan(Math.PI / 6) / aspect] : [Math.tan(Math.PI / 6) * aspect, Math.tan(Math.PI / 6)]; // as CesiumJS has it
  const home = homeOf(box, heights, {upright: aspect < 1, tanX, tanY, free});
  const local = localFrame(home.middle.lon, home.middle.lat, home.middle.height);
  return {...home, seen: (places) => extentOf(places.map((place) => local(...place)), home.eye, home.look, tanX, tanY)};
};

test("home is over the data, also across the antimeridian", () => {
  for (const {name, ...frame} of FRAMES) {
    const {middle, seen} = homeIn(FIJI, frame);
    near(middle.lon, 180, 1e-9, name);
    const {left, right, bottom, top} = seen([179, 180, -179].flatMap((lon) => [-20, -19, -18].map((lat) => [lon, lat, 0])));
    assert.ok(left > frame.free.left - 0.01 && right < frame.free.right + 0.01 && bottom > frame.free.bottom - 0.01 && top < frame.free.top + 0.01, name);
    assert.ok(right - left > 0.8 * (frame.free.right - frame.free.left) || top - bottom > 0.8 * (frame.free.top - frame.free.bottom), "it fills one direction");
  }
  near(acrossOf(FIJI), 210000, 15000);
});

test("home shows a DEM of the world as a globe that fits, and a continent from above", () => {
  for (const {name, ...frame} of FRAMES) {
    const {eye, look, middle, seen} = homeIn({west: -180, south: -90, east: 180, north: 90}, frame, {low: -10000, high: 8000, top: 8000});
    assert.deepEqual(look.ahead.map(Math.round), [0, 0, -1], name);
    assert.deepEqual(eye.slice(0, 2), [0, 0], `${name}: from beside its middle, north would not be up`);
    near(middle.lon, 0, 1e-9);
    const globe = seen([-90, 90].flatMap((lon) => [-60, -30, 0, 30, 60].map((lat) => [lon, lat, 0])).concat([[0, 90, 0], [0, -90, 0]]));
    for (const side of ["left", "bottom"]) assert.ok(globe[side] > frame.free[side] - 0.03, `${name} ${side} ${globe[side]}`);
    for (const side of ["right", "top"]) assert.ok(globe[side] < frame.free[side] + 0.03, `${name} ${side} ${globe[side]}`);
    assert.ok(Math.max(globe.right - globe.left, globe.top - globe.bottom) > 1.2, `${name}: large enough to be seen`);
    assert.ok(eye[2] > 6e6);
    const america = homeIn({west: -125, south: 25, east: -65, north: 50}, frame).seen([[-125, 25, 0], [-65, 25, 0], [-65, 50, 0], [-125, 50, 0], [-95, 50, 0]]);
    assert.ok(america.left > frame.free.left - 0.01 && america.right < frame.free.right + 0.01, name);
  }
});

test("scales have round numbers", () => {
  assert.deepEqual(ticks(294, 4352, 5), [1000, 2000, 3000, 4000]);
  assert.deepEqual(ticks(-0.3, 0.3, 4), [-0.2, 0, 0.2]);
  assert.deepEqual(ticks(5, 5, 4), [5]);
  assert.deepEqual([roundLength(99), roundLength(20), roundLength(0.7)], [50, 20, 0.5]);
  assert.equal(contourInterval(300, 4300), 200);
  assert.deepEqual([lengthText(0.25), lengthText(12.5), lengthText(12345)], ["25 cm", "12.5 m", "12.35 km"]);
  assert.deepEqual([lengthText(999.94), lengthText(999.97), areaText(999970)], ["999.9 m", "1 km", "1 km²"]);
  assert.deepEqual([areaText(950), areaText(25000), areaText(3.2e6)], ["950 m²", "2.5 ha", "3.2 km²"]);
});

// ---- heights as the DEM counts them

test("how far heights are above the DEM's own is known everywhere, also beyond the antimeridian and beside voids", () => {
  const geoid = (lon, lat) => -20 + 3 * (lon - 10) - 2 * (lat - 45);
  const box = {west: 10, south: 45, east: 11, north: 47}, lattice = shiftLattice(box);
  assert.ok(lattice.places.every(({lon, lat}) => lon > 10 && lon < 11 && lat > 45 && lat < 47), "no place on a side of the box");
  const values = lattice.places.map(({lon, lat}) => geoid(lon, lat)), shift = shiftOf(box, lattice, values);
  for (const [lon, lat] of [[10, 45], [10.03, 46.9], [10.5, 46], [11, 47]]) near(shift.at(lon, lat), geoid(lon, lat), 1e-9);
  near(shift.middle, geoid(10.5, 46), 1e-9);
  near(shiftOf(box, lattice, values.map((value, i) => (i === 7 ? undefined : value))).at(lattice.places[7].lon, lattice.places[7].lat), values[7], 2, "a void");
  assert.equal(shiftOf(box, lattice, values.map(() => undefined)), undefined);
  const across = {west: 179, south: -1, east: 181, north: 1}, there = shiftLattice(across);
  assert.ok(there.places.every(({lon}) => Math.abs(lon) <= 180));
  const both = shiftOf(across, there, there.places.map(({lon}) => (lon < 0 ? lon + 360 : lon)));
  for (const lon of [179.2, 180, -179.2]) near(both.at(lon, 0), lon < 0 ? lon + 360 : lon, 1e-9);
  assert.ok(shiftLattice({west: -180, south: -90, east: 180, north: 90}).places.length < 2000, "as many as may be asked for");
});

test("what a dataset's panel says are heights as its DEM counts them, where those are known", () => {
  const facts = {datum: "ellipsoid", max_level: 9, state: "ready", lowest: {height_m: 294}, highest: {height_m: 4352}};
  assert.ok(factsOf(ownFacts({facts, ownDatum: "egm96", summitHeight: 4371, bottomHeight: 313})).includes("313 to 4,371 m above the sea (EGM96)"));
  assert.equal(ownFacts({facts, ownDatum: "ellipsoid"}), facts);
});

// ---- what is draped

test("slopes and errors survive their byte", () => {
  for (const slope of [-3, -1, -0.2, -0.001, 0, 0.001, 0.2, 1, 3])
    near(slopeOfByte(slopeByte(slope)), slope, 0.0002 + 0.05 * Math.abs(slope) * (1 + Math.abs(slope)), "slope");
  for (const error of [-5000, -12, -0.3, 0, 0.02, 1.5, 80]) near(errorOfByte(errorByte(error)), error, 0.01 + 0.08 * Math.abs(error), "error");
  assert.ok(slopeByte(1e9) <= 255 && slopeByte(-1e9) >= 1 && errorByte(1e9) <= 255 && errorByte(-1e9) >= 1);
});

test("heights survive their byte, and no land becomes a depth", () => {
  const land = heightScale({low: 294, high: 4352, extent: 36000, source: {}, seaLevel: 0}), world = heightScale({low: -10376, high: 7833, extent: 1e7, source: {}, seaLevel: 30});
  for (const [scale, step] of [[land, 8.1], [world, 41.2]])
    for (let share = 0; share <= 1; share += 0.01) {
      const height = scale.low + share * (scale.top - scale.low), byte = heightByte(height, scale);
      assert.ok(byte > UNKNOWN_HEIGHT && byte <= 255);
      near(heightOfByte(byte, scale), height, step);
    }
  for (const [height, below] of [[0, true], [30, false], [31, false]]) assert.equal(heightOfByte(heightByte(height, world), world) < 30, below, `${height} m`);
  for (const beyond of [-11000, 9000]) near(heightOfByte(heightByte(beyond, world), world), Math.min(Math.max(beyond, -10376), 7833), 1e-9);
  const flat = heightScale({low: 5, high: 5, extent: 70, source: {}});
  near(heightOfByte(heightByte(5, flat), flat), 5, 1e-9);
});

test("pixels of a web map lie where they should", () => {
  near(lonOf(columnOf(-121.76, 10), 10), -121.76, 1e-9);
  near(latOf(rowOf(46.85, 10), 10), 46.85, 1e-9);
  assert.deepEqual([columnOf(-180, 3), rowOf(0, 3)], [0, 4 * PIXELS]);
  assert.deepEqual([...heightsOfColours([128, 0, 0, 255, 127, 255, 128, 255, 143, 12, 64, 255])], [0, -0.5, 3852.25]);
});

const BOUNDS = [10, 45, 11, 46];

/// A source whose heights are a function of place; `known(lon, lat)` says where.
function sourceWith(height, known = () => true, deepest = 7) {
  const load = async (level, x, y) => {
    const tile = {heights: new Float32Array(PIXELS * PIXELS), known: new Uint8Array(PIXELS * PIXELS)};
    for (let r = 0; r < PIXELS; ++r) for (let c = 0; c < PIXELS; ++c) {
      const [lon, lat] = [lonOf(x * PIXELS + c + 0.5, level), latOf(y * PIXELS + r + 0.5, level)];
      tile.heights[r * PIXELS + c] = height(lon, lat);
      tile.known[r * PIXELS + c] = known(lon, lat) ? 1 : 0;
    }
    return tile;
  };
  const [west, south, east, north] = BOUNDS;
  return new SourceHeights({bounds: BOUNDS, box: {west, south, east, north}, deepest, load});
}
const RECTANGLE = {west: 10.2, south: 45.2, east: 10.6, north: 45.6};
const SCALE = {low: 0, knee: 2000, top: 4000};
const pixel = (bytes, i, j) => [...bytes.subarray(4 * (j * SIDE + i), 4 * (j * SIDE + i) + 3)];
const perDegree = 111319.49, eastward = (lat) => perDegree * Math.cos((lat * Math.PI) / 180);

test("the relief has the source's own slope at every pixel, without a seam between its tiles", async () => {
  const bytes = await reliefTile(sourceWith((lon, lat) => 0.3 * eastward(45.4) * (lon - 10) - 0.1 * perDegree * (lat - 45)), RECTANGLE, 7, {scale: SCALE});
  for (let j = 0; j < SIDE; j += 5) for (let i = 0; i < SIDE; i += 5) {
    const [east, north, kind] = pixel(bytes, i, j);
    near(slopeOfByte(east), 0.3, 0.03, `east at ${i} ${j}`);
    near(slopeOfByte(north), -0.1, 0.02, `north at ${i} ${j}`);
    assert.equal(kind, GROUND);
  }
});

test("the relief has the source's own heights, at every level of it", async () => {
  const height = (lon, lat) => 500 + 1000 * (lon - 10) + 300 * (lat - 45);
  for (const level of [7, 8, 9]) {
    const bytes = await reliefTile(sourceWith(height, () => true, 9), RECTANGLE, level, {scale: SCALE});
    for (let j = 2; j < SIDE; j += 25) for (let i = 2; i < SIDE; i += 25) {
      const lon = 10.2 + (0.4 * (i + 0.5)) / SIDE, lat = 45.6 - (0.4 * (j + 0.5)) / SIDE;
      near(heightOfByte(bytes[4 * (j * SIDE + i) + 3], SCALE), height(lon, lat), 9, `level ${level}`);
    }
  }
  const unread = await reliefTile(sourceWith(height), RECTANGLE, 0, {scale: SCALE});
  assert.deepEqual([unread[2], unread[3]], [GROUND, UNKNOWN_HEIGHT], "coarser than is worth asking for: the mesh's");
});

// As the shader has it (linesAt in material.js): contours below a height, by its byte and by what is known `about` it: less than half an interval off, which
// tells the contours from each other.
function linesOfWave(byte, about) {
  const nearest = Math.round(about), wave = ((nearest % 2 === 0 ? 1 : -1) * (byte - WAVE_ZERO)) / WAVE_STEPS;
  const beside = about > nearest ? nearest + 1 : nearest - 1;
  return Math.abs(nearest + wave - about) < Math.abs(beside - wave - about) ? nearest + wave : beside - wave;
}

test("contours are where the source has their height, also between its pixels", async () => {
  const interval = 200; // of a relief of 4000 m
  for (let height = -2050; height < 2050; height += 7)
    for (const off of [-0.35, 0, 0.35]) { // by which the height is known beside the wave; half-way between two contours, which of them does not matter
      const lines = height / interval;
      if (off === 0 || Math.abs(lines - Math.round(lines)) < 0.1) near(linesOfWave(waveByte(height, interval), lines + off), lines, 1 / 252, `${height} m`);
    }
  const height = (lon, lat) => 600 + 7000 * (lon - 10.2) + 400 * Math.sin(30 * lat);
  const bytes = await contourTile(sourceWith(height, () => true, 9), RECTANGLE, 7, {scale: SCALE, interval});
  let crossed = 0;
  for (let j = 2; j < SIDE - 2; j += 9) for (let i = 2; i < SIDE - 2; ++i) {
    const at = 4 * (j * SIDE + i), lat = 45.6 - (0.4 * (j + 0.5)) / SIDE;
    const [here, next] = [0, 1].map((k) => height(10.2 + (0.4 * (i + k + 0.5)) / SIDE, lat) / interval);
    const ground = (SCALE.top * (GROUND_LOW - bytes[at + 2])) / (GROUND_LOW - GROUND_HIGH);
    near(ground / interval, here, 0.3, "which contour");
    if (Math.floor(here) === Math.floor(next)) continue;
    ++crossed;
    const [a, b] = [bytes[at + 3] - 127.5, bytes[at + 7] - 127.5]; // as the shader has them: a blend of both
    near(a / (a - b), (Math.ceil(here) - here) / (next - here), 0.1, `contour at ${i} ${j}`);
  }
  assert.ok(crossed > 200, `${crossed} contours`);
  const shift = {at: (lon) => 30 + 5 * (lon - 10), middle: 32.5}; // of heights that are counted from elsewhere
  const shifted = await contourTile(sourceWith((lon, lat) => height(lon, lat) + shift.at(lon), () => true, 9), RECTANGLE, 7, {scale: SCALE, interval, shift});
  for (let at = 3; at < bytes.length; at += 4 * 7) near(shifted[at], bytes[at], 1, "the same contours");
  const kinds = await contourTile(sourceWith((lon) => (lon < 10.3 ? 21 : 21 + 4000 * (lon - 10.3)), (lon, lat) => lat < 45.5), RECTANGLE, 7, {seaLevel: 20, scale: SCALE, interval});
  assert.deepEqual([pixel(kinds, 20, 200)[2], pixel(kinds, 20, 20)[2]], [SEA, VOID]);
  const land = pixel(kinds, 200, 200)[2];
  assert.ok(land >= GROUND_HIGH && land <= GROUND_LOW);
});

test("voids and the sea are told from the ground", async () => {
  const source = sourceWith((lon) => (lon < 10.3 ? 21 : 21 + 4000 * (lon - 10.3)), (lon, lat) => lat < 45.5);
  const bytes = await reliefTile(source, RECTANGLE, 7, {seaLevel: 20, scale: SCALE});
  assert.equal(pixel(bytes, 20, 200)[2], SEA);
  assert.equal(pixel(bytes, 200, 200)[2], GROUND);
  assert.equal(pixel(bytes, 20, 20)[2], VOID);
  assert.equal(pixel(await reliefTile(source, RECTANGLE, 7, {scale: SCALE}), 20, 200)[2], GROUND, "without a sea level there is no sea");
  const geoid = {at: (lon) => 100 + 12 * (lon - 10), middle: 112};
  const bent = await reliefTile(sourceWith((lon) => 1 + geoid.at(lon)), RECTANGLE, 7, {seaLevel: geoid.middle, shift: geoid, scale: SCALE});
  for (const i of [5, 128, 250]) assert.equal(pixel(bent, i, 100)[2], SEA, "a sea that is level above the geoid");
});

test("beyond the images' last latitude nothing is said to be missing: the mesh's own is taken", async () => {
  const bounds = [10, 84, 11, 85.0511], none = new SourceHeights({bounds, box: {west: 10, south: 84, east: 11, north: 90}, deepest: 7, load: async () => undefined});
  const rectangle = {west: 10, south: 84, east: 11, north: 88};
  for (const bytes of [await reliefTile(none, rectangle, 7, {scale: SCALE}), await contourTile(none, rectangle, 7, {scale: SCALE, interval: 200})]) {
    assert.equal(bytes[2], GROUND, "at 88 degrees");
    assert.equal(bytes.at(-2), VOID, "at 84 degrees, where there is an image without heights");
  }
});

test("beside a void the slope is that of the ground, whatever the void is filled with", async () => {
  const slope = 0.4 * eastward(45.4), hole = (lon, lat) => lon > 10.3 && lon < 10.5 && lat > 45.3 && lat < 45.5;
  const source = sourceWith((lon, lat) => (hole(lon, lat) ? 3900 : slope * (lon - 10)), (lon, lat) => !hole(lon, lat));
  for (const [tileOf, isVoid] of [[reliefTile, (byte) => byte === VOID], [contourTile, (byte) => byte === VOID]]) {
    const bytes = await tileOf(source, RECTANGLE, 7, {scale: {low: 0, knee: 10000, top: 20000}, interval: 1000});
    let rim = 0;
    for (let j = 1; j < SIDE - 1; ++j) for (let i = 1; i < SIDE - 1; ++i) {
      const voids = [[0, 0], [1, 0], [-1, 0], [0, 1], [0, -1]].map(([x, y]) => isVoid(pixel(bytes, i + x, j + y)[2]));
      if (voids.every((one) => one)) continue; // nothing of it is seen
      rim += voids.includes(true) ? 1 : 0;
      const [east, north] = pixel(bytes, i, j).map(slopeOfByte);
      near(east, 0.4, 0.04, `east at ${i} ${j}`);
      near(north, 0, 0.01, `north at ${i} ${j}`);
    }
    assert.ok(rim > 200, `${rim} pixels beside the void`);
  }
});

/// A tile of two triangles, whose corners have the heights sw, se, ne, nw of 0 to 32767.
const tileOf = (sw, se, ne, nw, minHeight = 0, maxHeight = 32767) => ({
  u: Uint16Array.of(0, 32767, 32767, 0), v: Uint16Array.of(0, 0, 32767, 32767), h: Uint16Array.of(sw, se, ne, nw),
  indices: Uint16Array.of(0, 1, 2, 0, 2, 3), minHeight, maxHeight, metadata: {max_error_m: 2}});

test("a tile's heights at a lattice are those of its triangles", () => {
  const mesh = tileOf(0, 1000, 3000, 500);
  const xs = [-0.1, 0, 0.13, 0.5, 0.91, 1, 1.1], ys = [-0.2, 0, 0.37, 0.5, 1, 1.2];
  const heights = rasterise(mesh, xs, ys);
  ys.forEach((y, row) => xs.forEach((x, column) => {
    const found = heights[row * xs.length + column], one = heightInTile(mesh, x, y);
    if (one === undefined) assert.ok(Number.isNaN(found));
    else near(found, one, 1e-6, `${x} ${y}`);
  }));
});

test("a triangle without area hides none of those beside it", () => {
  const mesh = {u: [0, 0, 0, 32767, 0], v: [0, 0, 0, 0, 32767], h: [0, 0, 0, 32767, 0], indices: [0, 1, 2, 0, 3, 4], minHeight: 0, maxHeight: 100};
  near(heightInTile(mesh, 0.25, 0.25), 25, 0.01);
});

test("the error is mesh minus source, with its sign, nothing hidden and no gap", async () => {
  const level = (metres) => (xs, ys) => new Float64Array(xs.length * ys.length).fill(metres);
  const flat = sourceWith(() => 100);
  for (const off of [3, -3]) {
    const {bytes, largest} = await errorTile(flat, RECTANGLE, 12, level(100 + off));
    near(largest, 3, 1e-3);
    for (const [i, j] of [[0, 0], [255, 0], [128, 77], [0, 255], [255, 255]]) {
      near(errorOfByte(pixel(bytes, i, j)[0]), off, 0.4, `at ${i} ${j}`);
      assert.equal(pixel(bytes, i, j)[2], GROUND);
    }
  }
  // One pixel of the source sticks out: a coarse tile must show it.
  const spike = lonOf(Math.floor(columnOf(10.4, 7)) + 0.5, 7), there = latOf(Math.floor(rowOf(45.4, 7)) + 0.5, 7);
  const one = sourceWith((lon, lat) => (Math.hypot(lon - spike, lat - there) < 1e-6 ? 150 : 100));
  near((await errorTile(one, {west: 10, south: 45, east: 11, north: 46}, 7, level(100))).largest, 50, 1e-3);
  const holes = await errorTile(sourceWith(() => 100, () => false), RECTANGLE, 7, level(100));
  assert.equal(pixel(holes.bytes, 100, 100)[2], VOID);
});

test("a scale of errors needs a pixel that was measured", () => {
  const counts = new Uint32Array(128);
  assert.equal(errorScale([]), undefined);
  assert.equal(errorScale([{largest: 0, counts}]), undefined);
  counts[60] = 99, counts[100] = 1;
  const {reach, largest} = errorScale([{largest: 70, counts}]);
  near(reach, errorOfByte(128 + 60), 1e-9);
  assert.equal(largest, 70);
});

test("heights are asked for where the data is, on both sides of the antimeridian", async () => {
  const asked = new Set();
  const load = async (level, x, y) => void asked.add(`${level}/${x}/${y}`);
  const source = new SourceHeights({bounds: [-180, -20, 180, -18], box: FIJI, deepest: 9, load});
  assert.equal(source.coarsest, 6, "of two degrees, not of the whole turn");
  await source.window(3, 0, 0, 8 * PIXELS, 8 * PIXELS);
  assert.deepEqual([...asked].sort(), ["3/0/4", "3/7/4"]);
});

// ---- lines, labels, profiles, files

test("each edge is drawn once, and the sides are the tile's", () => {
  const mesh = tileOf(0, 0, 0, 0);
  assert.equal(latticeLines(mesh.indices).length / 2, 5);
  assert.equal(tileSides(mesh).length / 2, 4);
});

test("labels leave room for each other, the nearest first", () => {
  const labels = [{x: 100, y: 100, depth: 9}, {x: 120, y: 105, depth: 3}, {x: 300, y: 100, depth: 5}, {x: 2, y: 100, depth: 1}];
  assert.deepEqual(labelsThatFit(labels, 400, 200).map(({depth}) => depth), [3, 5]);
  const [moved, ...rest] = labelsThatFit(labels, 400, 200, [{x: 110, y: 90}, {x: 110, y: 106}]);
  assert.ok(moved.depth === 3 && moved.x === 120 && moved.y >= 126, `not over what is taken: ${JSON.stringify(moved)}`);
  assert.deepEqual(rest, [labels[2]]);
});

test("a line across the antimeridian goes the short way, in either direction", () => {
  const lons = (...path) => along(path.map((lon) => [lon, -17]), 5).map(({lon}) => Number(((Number(lon.toFixed(3)) + 360) % 360).toFixed(3))); // 180 is -180
  assert.deepEqual(lons(179.8, -179.8), [179.8, 179.9, 180, 180.1, 180.2]);
  assert.deepEqual(lons(-179.8, 179.8), [180.2, 180.1, 180, 179.9, 179.8]);
  assert.deepEqual(lons(-1, 1), [359, 359.5, 0, 0.5, 1]);
});

test("a profile counts climb, fall, what is beyond the bound, and leaves gaps open", () => {
  const samples = [{metres: 0, source: 10, mesh: 10, bound: 1}, {metres: 3, source: 14, mesh: 14.5, bound: 1}, {metres: 6, source: 11, mesh: 13, bound: 1}];
  const {climb, fall, worst, outside} = profileFigures(samples);
  assert.deepEqual([climb, fall, worst, outside], [4, 3, 2, 1]);
  near(profileFigures(samples).ground, Math.hypot(3, 4.5) + Math.hypot(3, 1.5), 1e-9);
  assert.equal(profileFigures([{metres: 0, mesh: 1}, {metres: 1}]).ground, undefined);
  assert.deepEqual(runs([{a: 1}, {}, {a: 2}, {a: 3}], "a").map((run) => run.length), [1, 2]);
});

test("a place on the profile's picture is the sample that is drawn there", () => {
  const samples = Array.from({length: 401}, (_, metres) => ({metres}));
  for (const wide of [340, 420]) {
    assert.equal(sampleAt(samples, LEFT, wide).metres, 0);
    assert.equal(sampleAt(samples, wide - RIGHT, wide).metres, 400);
    assert.equal(sampleAt(samples, (LEFT + wide - RIGHT) / 2, wide).metres, 200);
    for (const [x, metres] of [[-5, 0], [wide + 9, 400]]) assert.equal(sampleAt(samples, x, wide).metres, metres);
  }
});

test("the mesh that is saved has every tile, where it is", () => {
  const rectangle = {west: 10, south: 45, east: 10.01, north: 45.01};
  const text = objOf([{name: "a", rectangle, mesh: tileOf(0, 0, 0, 0, 100, 100)}, {name: "b", rectangle: {...rectangle, west: 10.01, east: 10.02}, mesh: tileOf(0, 0, 0, 0, 100, 100)}], "ellipsoid");
  const vertices = text.match(/^v .*$/gm).map((line) => line.split(" ").slice(1).map(Number));
  assert.equal(vertices.length, 8);
  assert.deepEqual(text.match(/^f .*$/gm).slice(-1), ["f 5 7 8"]);
  near(Math.hypot(...vertices[0].map((value, k) => value - vertices[1][k])), geodesic([10, 45], [10.01, 45]).metres * (1 + 100 / 6388000), 0.01);
  near(Math.hypot(...vertices[1].map((value, k) => value - vertices[4][k])), 0, 1e-9, "neighbours meet");
});
