// Terrain in WebGL, for pages that draw a mesh of their own: lit, coloured by height, with its edges.
// Positions are metres east, north and up of an origin.

import {TINTS} from "./globe/material.js";
import {NO_WEBGL} from "./page.js";

export const DEGREE = Math.PI / 180;
export const FOV = 60; // across the picture

// ---- the earth and the camera

export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
export const sum = (...terms) => terms.reduce((v, [s, w]) => v.map((x, i) => x + s * w[i]), [0, 0, 0]);

/// Origin and axes (east, north, up) of a place, earth-centred (WGS84).
export function frameAt(lon, lat, height = 0) {
  const [sl, cl, sp, cp] = [Math.sin(lon * DEGREE), Math.cos(lon * DEGREE), Math.sin(lat * DEGREE), Math.cos(lat * DEGREE)];
  const e2 = 6.69437999014e-3;
  const n = 6378137 / Math.sqrt(1 - e2 * sp * sp);
  return {
    origin: [(n + height) * cp * cl, (n + height) * cp * sl, (n * (1 - e2) + height) * sp],
    east: [-sl, cl, 0], north: [-sp * cl, -sp * sl, cp], up: [cp * cl, cp * sl, sp],
  };
}

/// Eye and axes of a camera in a dataset's frame.
export function poseOf(camera, frame) {
  const here = frameAt(camera.lon, camera.lat, camera.height_m);
  const local = (v) => [dot(v, frame.east), dot(v, frame.north), dot(v, frame.up)];
  const [h, p] = [camera.heading_deg * DEGREE, camera.pitch_deg * DEGREE];
  const flat = sum([Math.cos(h), here.north], [Math.sin(h), here.east]);
  const ahead = local(sum([Math.cos(p), flat], [Math.sin(p), here.up]));
  const right = local(sum([Math.cos(h), here.east], [-Math.sin(h), here.north]));
  return {eye: local(sum([1, here.origin], [-1, frame.origin])), ahead, right, up: cross(right, ahead)};
}

// ---- drawing

const VERTEX = `#version 300 es
  in vec3 position;
  uniform vec3 eye, right, up, ahead;
  uniform vec2 lens, depths;
  uniform float middle;
  out vec3 ground, edge;
  void main() {
    vec3 v = position - eye;
    float z = dot(v, ahead);
    ground = position;
    edge = vec3(gl_VertexID % 3 == 0, gl_VertexID % 3 == 1, gl_VertexID % 3 == 2);
    gl_Position = vec4(dot(v, right) * lens.x + middle * z, dot(v, up) * lens.y, z * depths.x - depths.y, z);
  }`;
const rgb = (css) => [1, 3, 5].map((at) => (parseInt(css.slice(at, at + 2), 16) / 255).toFixed(4)).join(", ");
const TINTED = TINTS.slice(1).map(([at, css], i) =>
  `tint = mix(tint, vec3(${rgb(css)}), clamp((share - ${TINTS[i][0].toFixed(3)}) / ${(at - TINTS[i][0]).toFixed(3)}, 0.0, 1.0));`).join("\n    ");

// Tints, rock and light as on the globe.
const FRAGMENT = `#version 300 es
  precision highp float;
  in vec3 ground, edge;
  uniform vec3 eye;
  uniform float wires, low, top, haze;
  out vec4 colour;
  void main() {
    vec3 normal = normalize(cross(dFdx(ground), dFdy(ground)));
    normal *= sign(normal.z);
    float share = clamp((ground.z - low) / max(top - low, 1.0), 0.0, 1.0);
    vec3 tint = vec3(${rgb(TINTS[0][1])});
    ${TINTED}
    tint = mix(tint, vec3(0.553, 0.514, 0.475), smoothstep(0.6, 1.1, acos(normal.z)) * (1.0 - 0.4 * share));
    float facing = clamp(0.5 + 0.5 * dot(normal, vec3(-0.557, 0.557, 0.616)), 0.0, 1.0);
    vec3 lit = tint * mix(vec3(0.14, 0.20, 0.31), vec3(1.26, 1.21, 1.12), pow(facing, 1.9));
    vec3 width = fwidth(edge);
    vec3 inside = smoothstep(width * 0.3, width * 1.1, edge);
    float line = 1.0 - min(inside.x, min(inside.y, inside.z));
    float small = max(width.x, max(width.y, width.z));
    lit = mix(lit, vec3(0.10, 0.16, 0.24), wires * line * clamp(0.9 - 1.5 * small, 0.05, 0.5)); // where they crowd, the ground is seen
    colour = vec4(mix(lit, vec3(0.86, 0.91, 0.94), 1.0 - exp(-length(ground - eye) / haze)), 1.0);
  }`;

export class Picture {
  constructor(canvas) {
    this.canvas = canvas;
    const gl = (this.gl = canvas.getContext("webgl2", {antialias: true, preserveDrawingBuffer: true}));
    if (!gl) throw new Error(NO_WEBGL);
    const program = (this.program = gl.createProgram());
    for (const [kind, source] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, FRAGMENT]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, source);
      gl.compileShader(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
      gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    gl.useProgram(program);
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    const at = gl.getAttribLocation(program, "position");
    gl.enableVertexAttribArray(at);
    gl.vertexAttribPointer(at, 3, gl.FLOAT, false, 0, 0);
    gl.enable(gl.DEPTH_TEST);
    gl.clearColor(0.86, 0.91, 0.94, 1);
    this.vertices = 0;
  }

  load(positions) {
    this.gl.bufferData(this.gl.ARRAY_BUFFER, positions, this.gl.DYNAMIC_DRAW);
    this.vertices = positions.length / 3;
  }

  /// `wires`: how dark edges are, 0 to 1; `low`, `top`: the heights at which the tints begin and end; `haze`: metres at which it takes over;
  /// `middle`: where the camera looks, of the picture's width from -1 to 1.
  draw(pose, {wires, low, top, haze, middle = 0, near = 20, far = 400000}) {
    const {gl, canvas, program} = this;
    const set = (name, ...values) => gl[`uniform${values.length}f`](gl.getUniformLocation(program, name), ...values);
    const focal = 1 / Math.tan((FOV * DEGREE) / 2);
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    for (const axis of ["eye", "right", "up", "ahead"]) set(axis, ...pose[axis]);
    set("lens", focal, (focal * canvas.width) / canvas.height);
    set("depths", (far + near) / (far - near), (2 * far * near) / (far - near));
    set("wires", wires);
    set("low", low);
    set("top", top);
    set("haze", haze);
    set("middle", middle);
    gl.drawArrays(gl.TRIANGLES, 0, this.vertices);
  }
}

/// As many pixels as the window shows, whenever it changes.
export function fitToWindow(canvas) {
  const fit = () => {
    const scale = Math.min(window.devicePixelRatio || 1, 2);
    [canvas.width, canvas.height] = [window.innerWidth * scale, window.innerHeight * scale].map(Math.round);
  };
  fit();
  addEventListener("resize", fit);
}
