// One globe on the page: CesiumJS with the ground of a dataset, its drape, its lines. No imagery and no
// request to any other host. Two of them side by side make a comparison.

import {say} from "../page.js";
import {contourLayer, errorLayer, reliefLayer} from "./drape.js";
import {homeOf} from "./home.js";
import {contourInterval} from "./legend.js";
import {TileLines} from "./lines.js";
import {groundMaterial, PAPER, setLooks} from "./material.js";
import {errorScale} from "./relief_tile.js";
import {Summit} from "./summit.js";
import {drawnPieces, TileReader} from "./tiles.js";

const {Cesium} = window;
const SCREEN_ERROR = 1; // pixels: CesiumJS's own 2 leaves out the small forms by which one knows a mountain
const SOFTWARE_SCREEN_ERROR = 2; // four times fewer tiles; the relief on them is as fine
// Never quite 1: at 1, CesiumJS takes the normals of the ellipsoid out of its vertices, and puts them in again for all
// else. A tile that is just then cut out of its parent is read with the wrong stride; the worker fails, and from then on
// at every tile, which are asked for again and again. A few micrometres of height are the price.
const EXAGGERATED = 1 + 1e-9;
const FLAT = 0.05; // height by width: tints are by the mesh, and would be those of its error on flatter land
const SOFTWARE = /swiftshader|llvmpipe|software/i; // who draws where there is no graphics hardware

function isSoftware({context: {_gl: gl}}) {
  const names = gl.getExtension("WEBGL_debug_renderer_info");
  return SOFTWARE.test(gl.getParameter(names ? names.UNMASKED_RENDERER_WEBGL : gl.RENDERER));
}

function createWidget(container) {
  Cesium.Ion.defaultAccessToken = ""; // nothing here asks Cesium's own service
  Cesium.CreditDisplay.cesiumCredit = new Cesium.Credit('<a href="https://cesium.com/cesiumjs/">CesiumJS</a>', true);
  const widget = new Cesium.CesiumWidget(container, {
    showRenderLoopErrors: false, // we say it ourselves
    baseLayer: false,
    skyBox: false,
    scene3DOnly: true,
    requestRenderMode: true,
    maximumRenderTimeChange: Infinity,
    orderIndependentTranslucency: false, // lines need no order
    contextOptions: {webgl: {antialias: true, preserveDrawingBuffer: true}},
  });
  const {scene} = widget;
  scene.backgroundColor = Cesium.Color.fromCssColorString("#e6edf0");
  scene.skyAtmosphere.saturationShift = -0.12;
  scene.globe.showGroundAtmosphere = false;
  scene.globe.showWaterEffect = false; // the material draws water flat, as maps do
  scene.globe.depthTestAgainstTerrain = true;
  scene.globe.baseColor = new Cesium.Color(0, 0, 0, 0); // where nothing is draped: no slope that a tile could have. Clear, so that alpha is the picture's
  scene.globe.undergroundColor = Cesium.Color.fromCssColorString(PAPER);
  scene.fog.renderable = false; // the material has its own haze
  scene.globe.tileCacheSize = 300;
  scene.screenSpaceCameraController.minimumZoomDistance = 30;
  if (isSoftware(scene)) {
    scene.msaaSamples = 1; // four samples a pixel would take four times as long
    scene.skyAtmosphere.show = false; // a third of a frame
  }
  scene.renderError.addEventListener((_, error) => {
    console.error(`Drawing failed${scene.context._gl.isContextLost() ? ", the context is lost" : ""}: ${error}`);
    say("Drawing failed: this browser's WebGL gave up.", [["Start again", () => location.reload()]]);
  });
  const canvas = scene.canvas;
  canvas.tabIndex = 0;
  canvas.setAttribute("aria-label", "Terrain: arrow keys move, plus and minus zoom");
  return widget;
}

/// The provider, as one that ends at a level.
function cutAt(provider, deepest) {
  return new Proxy(provider, {
    get(target, key) {
      if (key === "getTileDataAvailable")
        return (x, y, level) => (level > deepest ? false : target.getTileDataAvailable(x, y, level));
      const value = target[key];
      return typeof value === "function" ? value.bind(target) : value;
    },
  });
}

export class Globe {
  #errors = new Map(); // of the tiles of imagery: {largest, counts}
  #layers = {};

  constructor(container, overlay) {
    this.widget = createWidget(container);
    this.scene = this.widget.scene;
    this.summit = new Summit(this.scene);
    this.lines = new TileLines(this.scene, overlay, () => this.summit.places);
    this.errorsChanged = () => {};
    this.scene.globe.tileLoadProgressEvent.addEventListener((waiting) => waiting === 0 && this.looks?.mode === "error" && this.rescale());
  }

  /// The ground of a dataset, its tiles no deeper than `deepest`.
  show(dataset, looks, deepest = dataset.layer.maxzoom) {
    const {globe} = this.scene;
    Object.assign(this, {dataset, deepest: Math.min(deepest, dataset.layer.maxzoom)});
    this.reader = new TileReader(dataset, this.deepest);
    globe.terrainProvider = this.deepest < dataset.layer.maxzoom ? cutAt(dataset.provider, this.deepest) : dataset.provider;
    const steep = dataset.high - dataset.low > FLAT * dataset.extent;
    globe.maximumScreenSpaceError = steep && isSoftware(this.scene) ? SOFTWARE_SCREEN_ERROR : SCREEN_ERROR;
    globe.material = groundMaterial(Cesium, dataset, dataset.source !== undefined);
    this.scene.imageryLayers.removeAll();
    this.#layers = {};
    this.#errors.clear();
    this.scene.verticalExaggerationRelativeHeight = dataset.low;
    this.apply(looks);
  }

  apply(looks) {
    this.looks = looks;
    const {dataset, scene} = this;
    const wanted = !dataset.source ? undefined : ["error", "contours"].includes(looks.mode) ? looks.mode : "relief";
    if (wanted && !this.#layers[wanted]) scene.imageryLayers.add(this.#layers[wanted] = this.#layerOf(wanted));
    for (const [name, layer] of Object.entries(this.#layers)) layer.show = name === wanted;
    scene.verticalExaggeration = Math.max(looks.exaggeration, EXAGGERATED);
    this.summit.at(dataset, looks.exaggeration);
    this.#shade();
    const {wires, tiles, exaggeration} = looks;
    const key = JSON.stringify([wires, tiles, exaggeration, dataset.name, this.deepest]);
    if (key !== this.lineKey) this.lines.reset(this.reader, {wires, tiles}, dataset, exaggeration);
    this.lineKey = key;
    scene.requestRender();
  }

  #layerOf(kind) {
    if (kind === "error") return errorLayer(this.dataset, this.reader, (tile, errors) => this.#found(tile, errors));
    return (kind === "contours" ? contourLayer : reliefLayer)(this.dataset, Math.log2(this.scene.globe.maximumScreenSpaceError));
  }

  /// The bounds of the errors that are seen change with the tiles that are drawn.
  #shade() {
    const {low, high} = this.dataset;
    setLooks(this.scene.globe.material.uniforms, this.looks, {reach: this.errors?.reach ?? 1, interval: contourInterval(low, high)});
    this.scene.requestRender();
  }

  /// {reach, largest} of the tiles that are drawn: where the scale of errors ends, and the largest of all; undefined
  /// while none is known.
  get errors() {
    const known = new Set();
    for (let {z, x, y} of drawnPieces(this.scene, this.dataset.rectangle)) {
      while (z > 0 && !this.#errors.has(`${z}/${x}/${y}`)) --z, x >>= 1, y >>= 1; // its parent is drawn as long as it comes
      known.add(this.#errors.get(`${z}/${x}/${y}`));
    }
    known.delete(undefined);
    return errorScale([...known]);
  }

  #found({z, x, y}, {largest, counts}) {
    this.#errors.set(`${z}/${x}/${y}`, {largest, counts});
    clearTimeout(this.rescaling);
    this.rescaling = setTimeout(() => this.rescale(), 150);
  }

  rescale() {
    this.#shade();
    this.errorsChanged();
  }

  // ---- the camera

  /// The dataset fills the frame (homeOf): `free` of what lies over the picture, from -1 to 1, but for its `corners`.
  home({free, corners}) {
    const {scene: {camera, canvas, verticalExaggeration}, dataset: {box, low, high}} = this;
    const tanY = Math.tan(camera.frustum.fovy / 2), tanX = tanY * camera.frustum.aspectRatio;
    const upright = canvas.clientHeight > canvas.clientWidth;
    const {middle, eye, look} = homeOf(box, {low, high, top: low + (high - low) * verticalExaggeration}, {upright, tanX, tanY, free, corners});
    const frame = Cesium.Transforms.eastNorthUpToFixedFrame(Cesium.Cartesian3.fromDegrees(middle.lon, middle.lat, middle.height));
    const vector = (v) => Cesium.Matrix4.multiplyByPointAsVector(frame, new Cesium.Cartesian3(...v), new Cesium.Cartesian3());
    camera.setView({
      destination: Cesium.Matrix4.multiplyByPoint(frame, new Cesium.Cartesian3(...eye), new Cesium.Cartesian3()),
      orientation: {direction: vector(look.ahead), up: vector(look.up)},
    });
    this.camera = this.camera; // upright where the eye is, not where the middle is
  }

  /// To a place, from the south and above, so far that `metres` of ground are seen.
  goTo(lon, lat, height, metres) {
    const target = Cesium.Cartesian3.fromRadians(lon, lat, height);
    this.scene.camera.lookAt(target, new Cesium.HeadingPitchRange(0.3, -0.5, metres));
    this.scene.camera.lookAtTransform(Cesium.Matrix4.IDENTITY); // free again
    this.scene.requestRender();
  }

  get camera() {
    const {positionCartographic: {longitude, latitude, height}, heading, pitch} = this.scene.camera;
    const {toDegrees} = Cesium.Math;
    return {lon: toDegrees(longitude), lat: toDegrees(latitude), height, heading: toDegrees(heading), pitch: toDegrees(pitch)};
  }

  set camera({lon, lat, height, heading, pitch}) {
    const {toRadians} = Cesium.Math;
    this.scene.camera.setView({
      destination: Cesium.Cartesian3.fromDegrees(lon, lat, height),
      orientation: {heading: toRadians(heading), pitch: toRadians(pitch), roll: 0},
    });
    this.scene.requestRender();
  }

  /// The place on the ground at a point of the canvas; undefined in the sky.
  pick(point) {
    const hit = this.scene.globe.pick(this.scene.camera.getPickRay(point), this.scene);
    return hit && Cesium.Cartographic.fromCartesian(hit);
  }

  destroy() {
    this.widget.destroy();
  }
}
