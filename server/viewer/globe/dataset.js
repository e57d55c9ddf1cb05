// One dataset as the globe needs it: what the daemon says of it, its terrain for CesiumJS, the heights
// of its source where it has one.

import {busyFor, fetchDatasets, fetchJson, NoAnswer, pause, say, unanswered, whenBack} from "../page.js";
import {oneSource} from "./cards.js";
import {acrossOf} from "./home.js";
import {NO_SHIFT, shiftLattice, shiftOf} from "./shift.js";
import {heightsOfColours, knownOfShades, PIXELS, SourceHeights} from "./source_heights.js";

const {Cesium} = window;
const SURVEY_POSTS = 33; // per side, to find relief and the highest point of tiles without their DEM

/// What the daemon says of a dataset, once it has read it.
async function whenRead(name) {
  for (;;) {
    const found = (await fetchDatasets()).find((one) => one.name === name);
    if (!found) throw new Error("the daemon does not serve it any more");
    if (found.state === "failed") throw new Error("its DEM could not be read; the daemon's log says why");
    if (found.state === "ready") return {...found, source: oneSource(found.source)};
    say(`Reading ${name}: ${Math.floor(100 * found.share_read)}\u00a0% …`);
    await pause(1000);
  }
}

/// Tiles that the daemon cannot send yet are asked for again; CesiumJS alone would leave them out.
function patientResource(url) {
  const retryCallback = async (resource, {statusCode, responseHeaders}) => {
    if (statusCode === undefined) await whenBack();
    else if (statusCode === 503) await busyFor(new Headers(responseHeaders));
    else return false;
    return true;
  };
  return new Cesium.Resource({url, retryAttempts: 1000, retryCallback});
}

/// The answer, however long the daemon is busy or gone; undefined for 404.
export async function patientFetch(url, init) {
  for (;;) {
    try {
      const reply = await fetch(url, init).catch(unanswered);
      if (reply.ok) return reply;
      if (reply.status === 404) return undefined;
      if (reply.status !== 503) throw new Error(`${url} answers ${reply.status}`);
      await busyFor(reply.headers);
    } catch (error) {
      if (!(error instanceof NoAnswer)) throw error;
      await whenBack();
    }
  }
}

// ---- relief

/// Relief, and where the summit is: as the daemon says, or heights on a coarse lattice, read from the
/// tiles themselves.
async function relief({highest, lowest}, provider, rectangle, deepest) {
  if (!highest || !lowest) return survey(provider, rectangle, deepest);
  const post = ({lon, lat, height_m}) => Cesium.Cartographic.fromDegrees(lon, lat, height_m);
  return {low: lowest.height_m, high: highest.height_m, summit: post(highest), bottom: post(lowest)};
}

async function survey(provider, rectangle, deepest) {
  const posts = [];
  for (let row = 0; row < SURVEY_POSTS; ++row) {
    for (let col = 0; col < SURVEY_POSTS; ++col) {
      posts.push(new Cesium.Cartographic(
        Cesium.Math.negativePiToPi(Cesium.Math.lerp(rectangle.west, rectangle.east, (col + 0.5) / SURVEY_POSTS)),
        Cesium.Math.lerp(rectangle.south, rectangle.north, (row + 0.5) / SURVEY_POSTS)));
    }
  }
  // The level whose tiles are about as large as the dataset: a handful of requests.
  const span = Math.max(rectangle.width, rectangle.height);
  const level = Math.max(0, Math.ceil(Math.log2(Math.PI / span)));
  await Cesium.sampleTerrain(provider, Math.min(level, deepest), posts);
  const known = posts.filter((post) => Number.isFinite(post.height));
  if (known.length === 0) throw new Error("no tile of the dataset could be read");
  known.sort((a, b) => a.height - b.height);
  return {low: known[0].height, high: known.at(-1).height, summit: known.at(-1), bottom: known[0]};
}

// ---- the source

async function pixelsOf(reply) {
  const picture = await createImageBitmap(await reply.blob(), {premultiplyAlpha: "none", colorSpaceConversion: "none"});
  const pen = new OffscreenCanvas(picture.width, picture.height).getContext("2d", {willReadFrequently: true});
  pen.drawImage(picture, 0, 0);
  picture.close();
  return pen.getImageData(0, 0, PIXELS, PIXELS).data;
}

/// Heights from /rgb, and which of them are known from the alpha of /shade: of two pictures of the same pixels.
async function sourceOf(name, box) {
  const list = await fetchJson(`rgb/${encodeURIComponent(name)}/tiles.json?encoding=terrarium`);
  const version = new URL(list.tiles[0]).searchParams.get("v");
  const pixels = async (kind, level, x, y, query) => {
    const reply = await patientFetch(`${kind}/${encodeURIComponent(name)}/${level}/${x}/${y}.png?${query}&v=${version}`);
    return reply && pixelsOf(reply);
  };
  const load = async (level, x, y) => {
    const [heights, shades] = await Promise.all([
      pixels("rgb", level, x, y, "encoding=terrarium"), pixels("shade", level, x, y, "style=slope")]);
    return heights && shades && {heights: heightsOfColours(heights), known: knownOfShades(shades)};
  };
  return new SourceHeights({bounds: list.bounds, box, deepest: list.maxzoom, load});
}

/// The height of a post in a datum; undefined where the daemon cannot say.
export async function elevation(name, lon, lat, datum) {
  const asked = datum ? `&datum=${datum}` : "";
  const reply = await fetch(`elevation/${encodeURIComponent(name)}?lon=${lon.toFixed(9)}&lat=${lat.toFixed(9)}${asked}`);
  if (!reply.ok) throw new Error(`/elevation answers ${reply.status}`);
  return reply.json();
}

/// Heights of many places ({lon, lat}) in the dataset's own datum: of its DEM, or of the mesh that is drawn
/// at a level, with the bound of each place's tile. Lists as /elevation answers them.
export async function elevations({name, datum}, places, level) {
  const query = new URLSearchParams();
  if (datum && datum !== "unknown") query.set("datum", datum); // tile sets of others do not say it
  if (level !== undefined) query.set("surface", `level=${level}`);
  const reply = await patientFetch(`elevation/${encodeURIComponent(name)}?${query}`, {
    method: "POST", headers: {"Content-Type": "application/json"},
    body: JSON.stringify({locations: places.map(({lon, lat}) => [lon, lat])})});
  if (!reply) throw new Error(`${name} is not served any more`);
  return reply.json();
}

/// Whether people are told of other heights than the tiles': not of layers that count from different things.
const countsFromElsewhere = ({datum, source}) => source?.datum !== undefined && source.datum !== datum;

/// A post's height above what the DEM itself counts from, as on a map.
async function ownHeightOf({name, datum, source}, post) {
  if (!post || !countsFromElsewhere({datum, source})) return undefined;
  return (await elevation(name, post.lon, post.lat)).height_m ?? undefined;
}

/// How far the dataset's heights are above the DEM's own; undefined where the daemon cannot say.
async function shiftFromOwn({name, datum, source}, box) {
  if (!countsFromElsewhere({datum, source})) return NO_SHIFT;
  const lattice = shiftLattice(box);
  const [heights, own] = await Promise.all([elevations({name, datum}, lattice.places), elevations({name, datum: "source"}, lattice.places)]);
  const known = (i) => heights.coverage[i] === "value" && own.coverage[i] === "value";
  return shiftOf(box, lattice, lattice.places.map((_, i) => (known(i) ? heights.height_m[i] - own.height_m[i] : undefined)));
}

/// Its heights are in `datum`, and `shift` above those in `ownDatum`, in which people are told of them. `seaLevel` is
/// among heights as they are draped (relief_tile.js). Its `box` (degrees) and `rectangle` (the same in radians) go on
/// beyond the antimeridian, `drapeable` does not.
export async function openDataset(name) {
  const facts = await whenRead(name);
  const url = new URL(`terrain/${encodeURIComponent(name)}`, document.baseURI).href; // CesiumJS needs it whole
  const layer = await fetchJson(`${url}/layer.json`);
  const provider = await Cesium.CesiumTerrainProvider.fromUrl(patientResource(url), {requestVertexNormals: true, requestWaterMask: true, requestMetadata: true});
  const [west, south, east, north] = facts.box;
  const box = {west, south, east, north}, rectangle = Cesium.Rectangle.fromDegrees(...facts.box);
  const drapeable = Cesium.Rectangle.fromDegrees(...layer.bounds); // CesiumJS drapes nothing across the antimeridian
  const [heights, source, shift, summitHeight, bottomHeight] = await Promise.all([
    relief(facts, provider, rectangle, layer.maxzoom),
    facts.source && facts.links.shades ? sourceOf(name, box) : undefined, // beyond 85 degrees there are no images
    ...[shiftFromOwn(facts, box), ownHeightOf(facts, facts.highest), ownHeightOf(facts, facts.lowest)].map((one) => one.catch(() => undefined))]);
  const isOwn = facts.source?.datum !== undefined && shift; // else only heights in the tiles' datum are known
  const seaLevel = isOwn && facts.lowest && facts.source.datum !== "ellipsoid" ? shift.middle : undefined; // the DEM's own heights are mostly above the sea
  return {name, facts, kind: facts.kind, datum: facts.datum, ownDatum: isOwn ? facts.source.datum : facts.datum, shift: shift ?? NO_SHIFT, url, layer, provider,
    box, rectangle, drapeable, extent: acrossOf(box), source, seaLevel, summitHeight, bottomHeight, ...heights};
}
