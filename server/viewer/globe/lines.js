// The edges of the triangles that are drawn, and the sides of their tiles, as lines on the ground: what
// lies behind a mountain is hidden, as on an engraving. And a label for each tile: level and error.

import {shared} from "./box.js";
import {sidesOf} from "./material.js";
import {drawnOf, rectangleOf} from "./tiles.js";
import {labelsThatFit, latticeLines, tileSides} from "./tile_lines.js";

const {Cesium} = window;
const EDGES = [0.10, 0.16, 0.24, 0.5];
const SIDES = [0.72, 0.16, 0.10, 0.95];

const glsl = (values) => values.map((x) => x.toExponential(9)).join(", ");

/// Lines that a hair's breadth towards the eye lie before the ground; none where the dataset has ended, as
/// the ground is paper there.
function appearance(colour, {west, east, south, north}) {
  return new Cesium.Appearance({
    translucent: true, closed: false,
    renderState: {depthTest: {enabled: true}, depthMask: false, blending: Cesium.BlendingState.ALPHA_BLEND},
    vertexShaderSource: `
      in vec3 position3DHigh; in vec3 position3DLow; in float batchId;
      out float within;
      void main() {
        vec3 p = position3DHigh + position3DLow;
        vec2 q = vec2(length(p.xy), p.z);
        within = min(min(dot(vec3(${glsl(west)}), p), dot(vec3(${glsl(east)}), p)), min(dot(vec2(${glsl(south)}), q), dot(vec2(${glsl(north)}), q)));
        vec4 eye = czm_modelViewRelativeToEye * czm_computePosition();
        eye.xyz *= 0.998;
        gl_Position = czm_projection * eye;
      }`,
    fragmentShaderSource: `
      in float within;
      void main() {
        if (within < -1.0) discard;
        out_FragColor = vec4(${glsl(colour)});
      }`,
  });
}

function linesOf(positions, indices, look) {
  const geometry = new Cesium.Geometry({
    attributes: {position: new Cesium.GeometryAttribute({componentDatatype: Cesium.ComponentDatatype.DOUBLE, componentsPerAttribute: 3, values: positions})},
    indices, primitiveType: Cesium.PrimitiveType.LINES, boundingSphere: Cesium.BoundingSphere.fromVertices(positions),
  });
  return new Cesium.Primitive({
    geometryInstances: new Cesium.GeometryInstance({geometry}), appearance: look,
    asynchronous: false, compressVertices: false, allowPicking: false,
  });
}

export class TileLines {
  #shown = new Map(); // of a drawn tile's key: {mesh, edges, sides}
  #turn = 0;
  #stale = true; // the labels

  /// `taken()`: where else something is written, in pixels.
  constructor(scene, overlay, taken) {
    this.scene = scene;
    this.taken = taken;
    this.overlay = overlay;
    this.what = {wires: false, tiles: false};
    scene.postRender.addEventListener(() => this.#update());
    scene.camera.moveStart.addEventListener(() => overlay.classList.add("moving"));
    scene.camera.moveEnd.addEventListener(() => this.#relabel());
    scene.globe.tileLoadProgressEvent.addEventListener((waiting) => waiting === 0 && this.#relabel());
  }

  /// Other terrain, or other looks: begins anew.
  reset(reader, what, {low, high, rectangle}, exaggeration) {
    ++this.#turn;
    const {west, east, south, north} = sidesOf(Cesium, rectangle, (low + high) / 2);
    const sides = {west: [west.x, west.y, west.z], east: [east.x, east.y, east.z], south: [south.x, south.y], north: [north.x, north.y]};
    this.looks = {edges: appearance(EDGES, sides), sides: appearance(SIDES, sides)};
    for (const lines of this.#shown.values()) this.#remove(lines);
    this.#shown.clear();
    this.overlay.replaceChildren();
    Object.assign(this, {reader, what, low, exaggeration});
    this.scene.requestRender();
  }

  /// How many tiles have lines now, for tests.
  get count() {
    return [...this.#shown.values()].filter(({edges, sides}) => edges || sides).length;
  }

  #relabel() {
    this.#stale = true;
    this.scene.requestRender();
  }

  #remove({edges, sides}) {
    for (const primitive of [edges, sides]) if (primitive) this.scene.primitives.remove(primitive);
  }

  #update() {
    if (!this.reader || (!this.what.wires && !this.what.tiles)) return;
    const drawn = drawnOf(this.scene, this.reader.dataset.rectangle);
    for (const [key, lines] of this.#shown) {
      if (drawn.has(key)) continue;
      this.#remove(lines);
      this.#shown.delete(key);
    }
    for (const [key, tile] of drawn) {
      if (!this.#shown.has(key)) this.#add(key, tile);
      this.#shown.get(key).piece = tile.piece;
    }
    if (!this.what.tiles || !this.#stale) return;
    this.#stale = false;
    this.#label();
    this.overlay.classList.remove("moving");
  }

  async #add(key, tile) {
    const lines = {tile};
    this.#shown.set(key, lines);
    const turn = this.#turn;
    const mesh = await this.reader.read(tile).catch(() => undefined);
    if (!mesh || turn !== this.#turn || this.#shown.get(key) !== lines) return;
    lines.mesh = mesh;
    const positions = this.#positions(tile, mesh);
    const add = (indices, look) => indices.length > 0 && this.scene.primitives.add(linesOf(positions, indices, look));
    if (this.what.wires) lines.edges = add(latticeLines(mesh.indices), this.looks.edges);
    if (this.what.tiles) lines.sides = add(tileSides(mesh), this.looks.sides);
    this.#relabel();
  }

  #height = (height) => this.low + (height - this.low) * this.exaggeration;

  #positions(tile, {u, v, h, minHeight, maxHeight}) {
    const {west, south, east, north} = rectangleOf(tile);
    const positions = new Float64Array(3 * u.length), at = new Cesium.Cartesian3();
    for (let i = 0; i < u.length; ++i) {
      const height = this.#height(minHeight + (h[i] / 32767) * (maxHeight - minHeight));
      Cesium.Cartesian3.fromDegrees(west + (u[i] / 32767) * (east - west), south + (v[i] / 32767) * (north - south), height, Cesium.Ellipsoid.WGS84, at);
      positions.set([at.x, at.y, at.z], 3 * i);
    }
    return positions;
  }

  #label() {
    const {scene} = this;
    const wanted = [];
    for (const [key, {tile, mesh, piece}] of this.#shown) {
      if (!mesh) continue;
      const ofData = shared(this.reader.dataset.rectangle, piece, 2 * Math.PI);
      if (!ofData) continue;
      const place = new Cesium.Cartographic(Cesium.Math.negativePiToPi((ofData.west + ofData.east) / 2), (ofData.south + ofData.north) / 2);
      const height = scene.globe.getHeight(place) ?? this.#height((mesh.minHeight + mesh.maxHeight) / 2);
      const at = Cesium.Cartesian3.fromRadians(place.longitude, place.latitude, height);
      const window = Cesium.SceneTransforms.worldToWindowCoordinates(scene, at);
      if (!window || this.#hidden(at, window)) continue;
      const bound = mesh.metadata.max_error_m;
      const text = `${tile.z}${bound === undefined ? "" : ` · ±${bound < 10 ? bound.toFixed(2) : bound.toFixed(0)} m`}`;
      wanted.push({key, text, x: window.x, y: window.y, depth: Cesium.Cartesian3.distance(at, scene.camera.position)});
    }
    const {clientWidth, clientHeight} = scene.canvas;
    this.overlay.replaceChildren(...labelsThatFit(wanted, clientWidth, clientHeight, this.taken()).map(({text, x, y}) => {
      const label = Object.assign(document.createElement("span"), {textContent: text});
      label.style.left = `${x}px`;
      label.style.top = `${y}px`;
      return label;
    }));
  }

  /// Behind a mountain, or the earth.
  #hidden(at, window) {
    const {camera, globe} = this.scene;
    const hit = globe.pick(camera.getPickRay(window), this.scene);
    return !hit || Cesium.Cartesian3.distance(hit, camera.position) < 0.97 * Cesium.Cartesian3.distance(at, camera.position);
  }
}
