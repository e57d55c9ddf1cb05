// The viewer: one dataset of this daemon as terrain in CesiumJS, shaded by its own heights and
// normals (no imagery, no request to any other host), and a readout of the tile under the pointer.

import {$, busyFor, chooseDataset, fetchDatasets, fetchJson, foldControls, NO_WEBGL, pause, say, sayFailed, whenBack} from "./page.js";
import {decodeQuantizedMesh, heightInTile} from "./quantized_mesh.js";

const {Cesium} = window;
const EXTENSIONS_ACCEPT =
  "application/vnd.quantized-mesh;extensions=octvertexnormals-metadata,application/octet-stream;q=0.9,*/*;q=0.01";
const SURVEY_POSTS = 33; // per side, to find relief and the highest point of tiles without their DEM
const SCREEN_ERROR = 1; // pixels: CesiumJS's own 2 leaves out the small forms by which one knows a mountain

const LEAST_SIGHT = 80000; // metres of clear air, however small the dataset
const PAPER = "#dcdfd6"; // where there is no data

// Height tints like those of printed maps, as shares of the dataset's relief; steep ground is rock.
const TINTS = [
  [0.0, "#7f9a76"],
  [0.25, "#a8b58a"],
  [0.5, "#cbbf9b"],
  [0.72, "#c3b6a8"],
  [0.86, "#e4e2de"],
  [1.0, "#fbfcfd"],
];

// ---- the globe

function createGlobe() {
  Cesium.Ion.defaultAccessToken = ""; // nothing here asks Cesium's own service
  Cesium.CreditDisplay.cesiumCredit = new Cesium.Credit('<a href="https://cesium.com/cesiumjs/">CesiumJS</a>', true);
  const widget = new Cesium.CesiumWidget("globe", {
    showRenderLoopErrors: false, // we say it ourselves
    baseLayer: false,
    skyBox: false,
    scene3DOnly: true,
    requestRenderMode: true,
    maximumRenderTimeChange: Infinity,
    contextOptions: {webgl: {antialias: true, preserveDrawingBuffer: true}},
  });
  const {scene} = widget;
  scene.backgroundColor = Cesium.Color.fromCssColorString("#e6edf0");
  scene.skyAtmosphere.saturationShift = -0.12;
  scene.globe.showGroundAtmosphere = false;
  scene.globe.baseColor = Cesium.Color.fromCssColorString(PAPER);
  scene.fog.renderable = false; // the material has its own haze
  scene.globe.tileCacheSize = 300;
  scene.globe.maximumScreenSpaceError = SCREEN_ERROR;
  scene.screenSpaceCameraController.minimumZoomDistance = 30;
  scene.renderError.addEventListener(() => 
    say("Drawing failed: this browser's WebGL gave up.", [["Start again", () => location.reload()]]));
  const canvas = scene.canvas;
  canvas.tabIndex = 0;
  canvas.setAttribute("aria-label", "Terrain: arrow keys move, plus and minus zoom");
  return widget;
}

/// Four half-spaces that a dataset's rectangle is: (x, y, z) . earth-centred place is how many metres
/// inside that side it is. Undefined where the rectangle goes around the globe.
function sidesOf({west, south, east, north, width}, height) {
  if (width > Math.PI) return undefined;
  const flat = 1 - 6.69437999014e-3 * (1 - height / 6378137); // of the ellipsoid, where the ground is so high
  const meridian = (lon, sign) => new Cesium.Cartesian3(-sign * Math.sin(lon), sign * Math.cos(lon), 0);
  const parallel = (lat, sign) => new Cesium.Cartesian3(-sign * flat * Math.sin(lat), sign * Math.cos(lat), 0);
  return {west: meridian(west, 1), east: meridian(east, -1), south: parallel(south, 1), north: parallel(north, -1)};
}

/// Printed-map looks: height tints mixed with rock where the ground is steep, soft light with cool
/// shades; paper where there is no data. The haze is the air between eye and ground: it thins with
/// height, so it lies over what is far and low and not over what is seen from above.
function terrainMaterial({low, high, extent, rectangle}) {
  const ramp = document.createElement("canvas");
  ramp.width = 256;
  ramp.height = 1;
  const pen = ramp.getContext("2d");
  const gradient = pen.createLinearGradient(0, 0, 256, 0);
  for (const [at, colour] of TINTS) gradient.addColorStop(at, colour);
  pen.fillStyle = gradient;
  pen.fillRect(0, 0, 256, 1);
  const everywhere = new Cesium.Cartesian3();
  const {west, east, south, north} = sidesOf(rectangle, (low + high) / 2) ??
    {west: everywhere, east: everywhere, south: everywhere, north: everywhere};
  return new Cesium.Material({
    translucent: false,
    fabric: {
      uniforms: {
        ramp: ramp.toDataURL(),
        low,
        high: Math.max(high, low + 1),
        sight: Math.max(2.5 * extent, LEAST_SIGHT),
        light: 1,
        ink: 0,
        exaggeration: 1,
        west, east, south, north,
        rock: Cesium.Color.fromCssColorString("#8d8379"),
        paper: Cesium.Color.fromCssColorString(PAPER),
        air: Cesium.Color.fromCssColorString("#dbe7ec"),
      },
      source: `
        // Metres inside the dataset's rectangle, negative outside.
        float inside(vec3 towardsEyeEC) {
          vec3 p = (czm_inverseView * vec4(-towardsEyeEC, 1.0)).xyz;
          vec2 q = vec2(length(p.xy), p.z);
          return min(min(dot(west.xy, p.xy), dot(east.xy, p.xy)), min(dot(south.xy, q), dot(north.xy, q)));
        }
        // How much of the ground the air hides. Its density falls to 1/e in 8 km; nobody sees farther
        // than "sight", nor beyond the horizon of a flat land with mountains like these.
        float haze(float metres, float height) {
          float above = clamp((czm_eyeHeight - height) / 8000.0, -1.0, 1e4);
          float through = metres * (abs(above) < 1e-3 ? 1.0 : (1.0 - exp(-above)) / above);
          float horizon = sqrt(1.27e7 * max(czm_eyeHeight - low, high - low));
          float far = through / min(sight, 0.6 * horizon + 2e4);
          return 1.0 - exp(-far * far);
        }
        czm_material czm_getMaterial(czm_materialInput materialInput) {
          czm_material material = czm_getDefaultMaterial(materialInput);
          float share = clamp((materialInput.height - low) / exaggeration / (high - low), 0.005, 0.995);
          float slope = atan(tan(min(materialInput.slope, 1.57)) / exaggeration);
          float steep = smoothstep(0.6, 1.1, slope) * (1.0 - 0.4 * share);
          vec3 ground = mix(texture(ramp, vec2(share, 0.5)).rgb, rock.rgb, steep);
          float within = inside(materialInput.positionToEyeEC);
          float pixel = max(fwidth(within), 1e-6);
          ground = mix(paper.rgb, ground, clamp(within / pixel + 0.5, 0.0, 1.0));
          float facing = clamp(0.5 + 0.5 * dot(materialInput.normalEC, czm_lightDirectionEC), 0.0, 1.0);
          vec3 shade = mix(vec3(0.14, 0.20, 0.31), vec3(1.26, 1.21, 1.12), pow(facing, 1.9));
          ground *= mix(vec3(1.0), shade, within < 0.0 ? 0.35 * light : light);
          ground *= 1.0 - 0.55 * ink;
          material.diffuse = mix(ground, air.rgb, haze(length(materialInput.positionToEyeEC), materialInput.height));
          return material;
        }`,
    },
  });
}

/// Light from the north-west, as on every shaded map, 38 degrees high where the dataset lies.
function lightFromNorthWest(center) {
  const frame = Cesium.Transforms.eastNorthUpToFixedFrame(Cesium.Cartesian3.fromRadians(center.longitude, center.latitude));
  const [azimuth, altitude] = [Cesium.Math.toRadians(315), Cesium.Math.toRadians(38)];
  const toLight = new Cesium.Cartesian3(
    Math.cos(altitude) * Math.sin(azimuth), Math.cos(altitude) * Math.cos(azimuth), Math.sin(altitude));
  const direction = Cesium.Matrix4.multiplyByPointAsVector(frame, toLight, new Cesium.Cartesian3());
  return new Cesium.DirectionalLight({direction: Cesium.Cartesian3.negate(direction, direction), intensity: 1});
}

// ---- a dataset

/// Relief, and where the summit is: as the daemon says, or heights on a coarse lattice, read from the
/// tiles themselves.
async function relief({highest, lowest}, provider, rectangle, deepest) {
  if (!highest || !lowest) return survey(provider, rectangle, deepest);
  const summit = Cesium.Cartographic.fromDegrees(highest.lon, highest.lat, highest.height_m);
  return {low: lowest.height_m, high: highest.height_m, summit};
}

async function survey(provider, rectangle, deepest) {
  const posts = [];
  for (let row = 0; row < SURVEY_POSTS; ++row) {
    for (let col = 0; col < SURVEY_POSTS; ++col) {
      posts.push(new Cesium.Cartographic(
        Cesium.Math.lerp(rectangle.west, rectangle.east, (col + 0.5) / SURVEY_POSTS),
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
  return {low: known[0].height, high: known[known.length - 1].height, summit: known[known.length - 1]};
}

/// What the daemon says of a dataset, once it has read it.
async function whenRead(name) {
  for (;;) {
    const found = (await fetchDatasets()).find((one) => one.name === name);
    if (!found) throw new Error("the daemon does not serve it any more");
    if (found.state === "failed") throw new Error("its DEM could not be read; the daemon's log says why");
    if (found.state === "ready") return found;
    say(`Reading ${name}: ${Math.floor(100 * found.share_read)} % …`);
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

async function openDataset(name) {
  const dataset = await whenRead(name);
  const url = new URL(`terrain/${encodeURIComponent(name)}`, document.baseURI).href; // CesiumJS needs it whole
  const layer = await fetchJson(`${url}/layer.json`);
  const provider = await Cesium.CesiumTerrainProvider.fromUrl(patientResource(url), {requestVertexNormals: true, requestWaterMask: true, requestMetadata: true});
  const rectangle = Cesium.Rectangle.fromDegrees(...layer.bounds);
  const {latitude} = Cesium.Rectangle.center(rectangle);
  const extent = 6371000 * Math.min(rectangle.width * Math.cos(latitude), rectangle.height, 2);
  return {name, kind: dataset.kind, datum: dataset.datum, url, layer, provider, rectangle, extent, ...(await relief(dataset, provider, rectangle, layer.maxzoom))};
}

/// From the south-west, low enough for a skyline, aimed below the summit. Where that is near the end of
/// the data, or the dataset steep for its size: from farther and higher, at the middle, to see it whole.
function fly(scene, {summit, low, extent, rectangle}) {
  const {clamp, lerp, toRadians} = Cesium.Math;
  const relief = summit.height - low;
  const middle = Cesium.Rectangle.center(rectangle);
  const offCentre = Math.max(
    Math.abs(summit.longitude - middle.longitude) / rectangle.width, Math.abs(summit.latitude - middle.latitude) / rectangle.height);
  const back = clamp(Math.max((4 * relief / extent - 0.5) / 0.6, (offCentre - 0.2) / 0.25), 0, 1);
  const target = Cesium.Cartesian3.fromRadians(
    lerp(summit.longitude, middle.longitude, back), lerp(summit.latitude, middle.latitude, back), low + 0.55 * relief);
  const pitch = extent > 2e6 ? toRadians(60) : Math.max(toRadians(16 + 12 * back), 1.6 * Math.atan(relief / extent));
  scene.camera.lookAt(target, new Cesium.HeadingPitchRange(toRadians(35), -pitch, (0.5 + 0.6 * back) * extent));
  scene.camera.lookAtTransform(Cesium.Matrix4.IDENTITY); // free again
}

function show(scene, dataset) {
  const {globe} = scene;
  globe.terrainProvider = dataset.provider;
  globe.material = terrainMaterial(dataset);
  applyLooks(scene);
  scene.light = lightFromNorthWest(Cesium.Rectangle.center(dataset.rectangle));
  scene.verticalExaggerationRelativeHeight = dataset.low;
  fly(scene, dataset);
  document.title = `${dataset.name} · tind`;
  scene.requestRender();
}

// ---- the tile under the pointer

/// The drawn tile at a place, by the addresses of the tile set (TMS: y counts from the south).
/// CesiumJS draws a missing child from its parent's mesh; the answer is then the real ancestor.
function drawnTile(scene, place) {
  const drawn = scene.globe._surface._tilesToRender; // no public way to ask
  let tile = drawn.find((candidate) => Cesium.Rectangle.contains(candidate.rectangle, place));
  while (tile?.parent && (!tile.data?.terrainData || tile.data.terrainData.wasCreatedByUpsampling())) tile = tile.parent;
  return tile && {z: tile.level, x: tile.x, y: 2 ** tile.level - 1 - tile.y, rectangle: tile.rectangle};
}

/// Fetches and decodes tiles for the readout; the browser's cache mostly has them already.
class TileReader {
  #meshes = new Map();

  read(dataset, {z, x, y}) {
    const url = this.url(dataset, {z, x, y});
    if (!this.#meshes.has(url)) {
      if (this.#meshes.size >= 64) this.#meshes.delete(this.#meshes.keys().next().value);
      const mesh = this.#fetch(url);
      mesh.catch(() => this.#meshes.delete(url)); // may be there next time
      this.#meshes.set(url, mesh);
    }
    return this.#meshes.get(url);
  }

  url(dataset, {z, x, y}) {
    const template = dataset.layer.tiles[0].replace("{version}", dataset.layer.version);
    return `${dataset.url}/${template.replace("{z}", z).replace("{x}", x).replace("{y}", y)}`;
  }

  async #fetch(url) {
    const response = await fetch(url, {headers: {Accept: EXTENSIONS_ACCEPT}});
    if (!response.ok) throw new Error(`${url} answers ${response.status}`);
    return decodeQuantizedMesh(await response.arrayBuffer());
  }
}

const metres = (value, digits = 1) => `${value.toFixed(digits).replace(/^-(0\.0+)$/, "$1").replace("-", "−")} m`;
const angle = (radians, positive, negative) =>
  `${Math.abs(Cesium.Math.toDegrees(radians)).toFixed(5)}° ${radians < 0 ? negative : positive}`;

/// What the source says of a place, in words; `metres` where it says a height.
async function sourceHeight(dataset, place) {
  if (dataset.kind !== "dem") return {text: "not here: a set of tiles without its DEM"};
  const [lon, lat] = [place.longitude, place.latitude].map((value) => Cesium.Math.toDegrees(value).toFixed(8));
  // In the datum of the tiles, which it is compared with.
  const above = dataset.datum === "ellipsoid" ? "&datum=ellipsoid" : "";
  const reply = await fetch(`elevation/${encodeURIComponent(dataset.name)}?lon=${lon}&lat=${lat}${above}`);
  if (!reply.ok) throw new Error(`/elevation answers ${reply.status}`);
  const {coverage, height_m, datum} = await reply.json();
  if (coverage !== "value") return {text: coverage};
  return {text: `${metres(height_m)}, ${datum}`, metres: height_m};
}

class Readout {
  #reader = new TileReader();
  #latest = 0;

  /// What it says is of another place until it is updated.
  fade() {
    $("readout").classList.add("stale");
  }

  async update(scene, dataset, place) {
    const turn = ++this.#latest; // a later pointer wins over a slower answer
    const tile = place && drawnTile(scene, place);
    if (!tile) return ($("readout").hidden = true);
    $("position").textContent = `${angle(place.latitude, "N", "S")}, ${angle(place.longitude, "E", "W")}`;
    const [source, mesh] = await Promise.allSettled([sourceHeight(dataset, place), this.#reader.read(dataset, tile)]);
    if (turn !== this.#latest) return;
    $("source-height").textContent = source.value?.text ?? "no answer";
    if (mesh.value) this.#showTile(dataset, tile, mesh.value, place, source.value?.metres);
    else for (const id of ["mesh-height", "tile", "tile-size", "tile-error"]) $(id).textContent = "no answer";
    $("readout").classList.remove("stale");
    $("readout").hidden = false;
  }

  #showTile(dataset, tile, mesh, place, sourceMetres) {
    const {west, south, width, height} = tile.rectangle;
    const surface = heightInTile(mesh, (place.longitude - west) / width, (place.latitude - south) / height);
    const off = sourceMetres === undefined || surface === undefined ? "" : `, ${surface < sourceMetres ? "" : "+"}${metres(surface - sourceMetres)}`;
    $("mesh-height").textContent = surface === undefined ? "not known" : metres(surface) + off;
    const link = Object.assign(document.createElement("a"), {
      href: this.#reader.url(dataset, tile), textContent: `${tile.z}/${tile.x}/${tile.y}`, download: `${tile.z}-${tile.x}-${tile.y}.terrain`});
    $("tile").replaceChildren(link);
    $("tile-size").textContent = `${(mesh.indices.length / 3).toLocaleString("en")} triangles, ` +
      `${mesh.u.length.toLocaleString("en")} vertices, ${mesh.bytes.toLocaleString("en")} bytes`;
    const bound = mesh.metadata.max_error_m;
    $("tile-error").textContent = bound === undefined ? "not stated" : `at most ${metres(bound, bound < 10 ? 2 : 1)} at every post (between posts it can be more)`;
  }
}

// ---- controls

/// Wires are drawn darker and on plain paper: through them one would see the sky below the ground.
function applyLooks(scene) {
  const wires = $("wireframe").checked;
  const {uniforms} = scene.globe.material ?? {uniforms: {}}; // none before a dataset is open
  uniforms.light = $("lighting").checked ? 1 : 0;
  uniforms.ink = wires ? 1 : 0;
  uniforms.exaggeration = scene.verticalExaggeration; // colours are of the true heights
  scene.skyAtmosphere.show = !wires;
  scene.globe._surface.tileProvider._debug.wireframe = wires; // as CesiumJS's own inspector does
}

function pointerPlace(scene, position) {
  const hit = scene.globe.pick(scene.camera.getPickRay(position), scene);
  return hit && Cesium.Cartographic.fromCartesian(hit);
}

/// The readout follows the pointer, and what comes to lie under it when the camera moves or finer
/// tiles arrive.
function connectPointer(scene, state) {
  const readout = new Readout();
  let at, pending;
  const refresh = () => {
    clearTimeout(pending);
    pending = setTimeout(() => at && state.dataset && readout.update(scene, state.dataset, pointerPlace(scene, at)), 60);
  };
  const look = ({endPosition, position}) => {
    at = Cesium.Cartesian2.clone(endPosition ?? position);
    refresh();
  };
  const handler = new Cesium.ScreenSpaceEventHandler(scene.canvas);
  handler.setInputAction(look, Cesium.ScreenSpaceEventType.MOUSE_MOVE);
  handler.setInputAction(look, Cesium.ScreenSpaceEventType.LEFT_CLICK); // a tap
  scene.camera.moveStart.addEventListener(() => readout.fade());
  scene.camera.moveEnd.addEventListener(refresh);
  scene.globe.tileLoadProgressEvent.addEventListener((waiting) => waiting === 0 && refresh());
}

/// Keeps the camera where it is above the exaggerated ground. All is reckoned from where it was before
/// the slider was touched, so the way back ends there.
class ExaggeratedCamera {
  #from; // {place, factor, heights}: of the camera, at which exaggeration, over and towards which ground
  #set; // where it was put last

  apply(scene, low, factor) {
    const {camera} = scene;
    if (!this.#set || !Cesium.Cartesian3.equals(camera.position, this.#set)) this.#from = this.#look(scene, low);
    scene.verticalExaggeration = factor;
    const {place, factor: before, heights} = this.#from;
    const lifts = heights.map((height) => (height - low) * (factor - before));
    const height = place.height + (lifts.length > 0 ? Math.max(...lifts) : 0);
    camera.position = Cesium.Cartesian3.fromRadians(place.longitude, place.latitude, height);
    this.#set = Cesium.Cartesian3.clone(camera.position);
  }

  #look(scene, low) {
    const {camera, canvas, globe, verticalExaggeration: factor} = scene;
    const middle = pointerPlace(scene, new Cesium.Cartesian2(canvas.clientWidth / 2, canvas.clientHeight / 2));
    const drawn = [globe.getHeight(camera.positionCartographic), middle?.height].filter((height) => height !== undefined);
    return {
      place: Cesium.Cartographic.clone(camera.positionCartographic), factor,
      heights: drawn.map((height) => low + (height - low) / factor),
    };
  }
}

function connectControls(scene, state) {
  const change = (id, apply) => $(id).addEventListener("input", () => {
    apply($(id));
    scene.requestRender();
  });
  const camera = new ExaggeratedCamera();
  change("exaggeration", ({value}) => {
    camera.apply(scene, scene.verticalExaggerationRelativeHeight, Number(value));
    applyLooks(scene);
    $("exaggeration-value").textContent = `${Number(value)}×`;
  });
  change("wireframe", () => applyLooks(scene));
  change("lighting", () => applyLooks(scene));
  $("home").addEventListener("click", () => state.dataset && fly(scene, state.dataset));
}

function connectKeys(scene) {
  const {camera} = scene;
  const step = () => 0.06 * Math.max(camera.positionCartographic.height, 100);
  const turn = Cesium.Math.toRadians(4);
  const look = (angle) => camera.look(Cesium.Ellipsoid.WGS84.geodeticSurfaceNormal(camera.position), angle); // stays upright
  const moves = {
    ArrowUp: () => camera.moveForward(step()), ArrowDown: () => camera.moveBackward(step()),
    ArrowLeft: () => look(-turn), ArrowRight: () => look(turn),
    "+": () => camera.zoomIn(step()), "=": () => camera.zoomIn(step()), "-": () => camera.zoomOut(step()),
    w: () => $("wireframe").click(), l: () => $("lighting").click(), h: () => $("home").click(),
  };
  document.addEventListener("keydown", (event) => {
    const inControl = event.target.matches("input, select");
    const move = moves[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (!move || event.ctrlKey || event.metaKey || event.altKey || (inControl && event.key.startsWith("Arrow"))) return;
    event.preventDefault();
    move();
    scene.requestRender();
  });
}

async function main() {
  if (!Cesium) return say("CesiumJS is not here: run scripts/setup, build again and reload.");
  foldControls();
  const names = (await fetchDatasets()).map(({name}) => name);
  if (names.length === 0) return say("No dataset is served. Start again with a DEM: tind serve dem.tif");
  let widget;
  try {
    widget = createGlobe();
  } catch {
    throw new Error(NO_WEBGL);
  }
  const {scene} = widget;
  const state = {
    dataset: undefined,
    async open(name) {
      const turn = (this.turn = (this.turn ?? 0) + 1); // a later choice wins over a slower answer
      say(`Opening ${name} …`);
      try {
        const dataset = await openDataset(name);
        if (turn !== this.turn) return;
        this.dataset = dataset;
        show(scene, dataset);
        say("");
      } catch (error) {
        if (turn === this.turn) say(`${name} cannot be shown: ${error.message ?? error}.`, [["Try again", () => this.open(name)]]);
      }
    },
  };
  window.tind = {widget, state}; // for tests and the browser's console
  connectControls(scene, state);
  connectPointer(scene, state);
  connectKeys(scene);
  await chooseDataset(names, (name) => state.open(name));
}

main().catch(sayFailed);
