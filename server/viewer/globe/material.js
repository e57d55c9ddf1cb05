// How the ground is coloured: height tints and rock as on printed maps, light from the slope of the
// source, and the modes beside. Colours here are the ones that the legend shows.

import {ERROR_REACH, ERROR_STEP_M, GROUND_HIGH, GROUND_LOW, HEIGHT_STEPS, UNKNOWN_HEIGHT, WAVE_STEPS, WAVE_ZERO} from "./relief_tile.js";
import {MODES} from "./link.js";

export const PAPER = "#e3e4de"; // where there is no data
export const SEA_COLOUR = "#a9c4d3";

// Tints as shares of the dataset's relief; steep ground is rock.
export const TINTS = [
  [0.0, "#7f9a76"],
  [0.25, "#a8b58a"],
  [0.5, "#cbbf9b"],
  [0.72, "#c3b6a8"],
  [0.86, "#e4e2de"],
  [1.0, "#fbfcfd"],
];
export const SLOPES = [[0, "#f7f5ee"], [0.22, "#f2d99a"], [0.39, "#e79a53"], [0.55, "#bf4a3c"], [0.78, "#6a2450"], [1, "#2b1233"]]; // 0 to 90 degrees
export const ERRORS = [[0, "#2c4f9e"], [0.25, "#7fa3d6"], [0.5, "#f6f4ee"], [0.75, "#e58a68"], [1, "#a3262a"]]; // mesh below .. above
export const DEPTHS = [[0, "#2f5f86"], [0.6, "#6f9fbd"], [1, "#b5d0dc"]]; // deepest .. shore

// What tints are mixed with, and how much of it, where something else is to be seen: light, or lines.
const WASHES = {multi: ["#ede9e3", 0.75], contours: ["#f7f5ed", 0.6]};

export const FACINGS = [[0, "#5f8fc4"], [0.25, "#e6c65c"], [0.5, "#cf6b4a"], [0.75, "#6aa884"], [1, "#5f8fc4"]]; // north, east, south, west

const FLAT_TINTS = 0.002, FLAT_TINTS_M = 100; // height by width, at most
const LEAST_TINTS_M = 10; // of a source's heights: what differs by less is told apart by no colour

export const gradientOf = (stops) => `linear-gradient(to right, ${stops.map(([at, colour]) => `${colour} ${100 * at}%`).join(", ")})`;

/// Whether heights below the sea are depths of it: no land is so low.
export const hasDepths = ({low, seaLevel}) => low < -500 && seaLevel !== undefined;

/// The height at which the tints end. Without a source they are by the mesh and would show its error as if it were
/// relief: on flat land they end far above all of it.
export const tintTop = ({low, high, extent, source}) =>
  Math.max(high, low + (source ? LEAST_TINTS_M : Math.max(Math.min(FLAT_TINTS * extent, FLAT_TINTS_M), 1)));

/// {low, knee, top} of the heights that are draped (heightByte): the shore is between two bytes where depths are shown.
export function heightScale(dataset) {
  const {low, seaLevel} = dataset, top = tintTop(dataset);
  return {low, knee: hasDepths(dataset) ? Math.min(Math.max(seaLevel, low), top) : (low + top) / 2, top};
}

const partOf = (colour, k) => parseInt(colour.slice(1 + 2 * k, 3 + 2 * k), 16);
const mixed = (one, other, share) => `#${[0, 1, 2].map((k) => Math.round(partOf(one, k) + share * (partOf(other, k) - partOf(one, k))).toString(16).padStart(2, "0")).join("")}`;

/// The colour of stops at a share, between two of them.
function colourAt(stops, share) {
  const after = stops.findIndex(([at]) => at >= share);
  if (after <= 0) return stops[after < 0 ? stops.length - 1 : 0][1];
  const [[from, one], [to, other]] = [stops[after - 1], stops[after]];
  return mixed(one, other, (share - from) / (to - from));
}

/// Stops as they are seen in a shading.
export function washed(stops, mode) {
  const [wash, share] = WASHES[mode] ?? ["#000000", 0];
  return stops.map(([at, colour]) => [at, mixed(colour, wash, share)]);
}

/// The tints of heights from the lowest to the highest, as the shader has them: depths up to the sea, and all of the
/// land's tints from there.
export function heightStops({low, high, seaLevel}) {
  if (!hasDepths({low, seaLevel})) return TINTS;
  const shore = (seaLevel - low) / (high - low);
  const depths = DEPTHS.map(([at, colour]) => [at * shore, colour]);
  if (shore >= 1) return [...depths.filter(([at]) => at < 1), [1, colourAt(depths, 1)]];
  return [...depths, ...TINTS.map(([at, colour]) => [shore + at * (1 - shore), colour])];
}

/// All scales in one picture, a row each.
function scales() {
  const rows = [TINTS, SLOPES, ERRORS, DEPTHS, FACINGS];
  const canvas = Object.assign(document.createElement("canvas"), {width: 256, height: rows.length});
  const pen = canvas.getContext("2d");
  rows.forEach((stops, y) => {
    const gradient = pen.createLinearGradient(0, 0, 256, 0);
    for (const [at, colour] of stops) gradient.addColorStop(at, colour);
    pen.fillStyle = gradient;
    pen.fillRect(0, y, 256, 1);
  });
  return canvas.toDataURL();
}

/// Four half-spaces that a dataset's rectangle is: (x, y, z) . earth-centred place is how many metres
/// inside that side it is. Nothing where the rectangle goes around the globe.
export function sidesOf(Cesium, {west, south, east, north, width}, height) {
  const everywhere = new Cesium.Cartesian3();
  if (width > Math.PI) return {west: everywhere, east: everywhere, south: everywhere, north: everywhere};
  const flat = 1 - 6.69437999014e-3 * (1 - height / 6378137); // of the ellipsoid, where the ground is so high
  const meridian = (lon, sign) => new Cesium.Cartesian3(-sign * Math.sin(lon), sign * Math.cos(lon), 0);
  const parallel = (lat, sign) => new Cesium.Cartesian3(-sign * flat * Math.sin(lat), sign * Math.cos(lat), 0);
  return {west: meridian(west, 1), east: meridian(east, -1), south: parallel(south, 1), north: parallel(north, -1)};
}

const glslOf = ([wash, share]) => `vec3(${[0, 1, 2].map((k) => (partOf(wash, k) / 255).toFixed(4)).join(", ")}), ${share}`;

const LEAST_SIGHT = 80000; // metres of clear air, however small the dataset

// What is draped (relief_tile.js) reaches the material as the colour below it, which CesiumJS's shader has
// in `color` where it calls czm_getMaterial: the last line hands it over.
const SOURCE = `
  // Metres inside the dataset's rectangle, negative outside.
  float inside(vec3 p) {
    vec2 q = vec2(length(p.xy), p.z);
    return min(min(dot(west.xy, p.xy), dot(east.xy, p.xy)), min(dot(south.xy, q), dot(north.xy, q)));
  }
  // How much of the ground the air hides: it thins with height, so it lies over what is far and low
  // and not over what is seen from above. Its density falls to 1/e in 8 km; nobody sees farther than
  // "sight", nor beyond the horizon of a flat land with mountains like these.
  float haze(float metres, float height) {
    float above = clamp((czm_eyeHeight - height) / 8000.0, -1.0, 1e4);
    float through = metres * (abs(above) < 1e-3 ? 1.0 : (1.0 - exp(-above)) / above);
    float horizon = sqrt(1.27e7 * max(czm_eyeHeight - low, high - low));
    float far = through / min(sight, 0.6 * horizon + 2e4);
    return 1.0 - exp(-far * far);
  }
  vec3 scale(float row, float at) { return texture(scales, vec2(clamp(at, 0.002, 0.998), 1.0 - (row + 0.5) / 5.0)).rgb; } // pictures stand on their last row
  vec2 unsqueezed(vec2 bytes) {
    vec2 t = (bytes * 255.0 - 128.0) / 127.0;
    vec2 s = t * t;
    return sign(t) * s / (1.0 - min(s, 0.99));
  }
  float lightOn(vec3 normal, vec2 sunAt) { // azimuth, altitude
    return dot(normal, vec3(sin(sunAt.x) * cos(sunAt.y), cos(sunAt.x) * cos(sunAt.y), sin(sunAt.y)));
  }
  bool contours() { return mode > 3.5 && mode < 4.5; }
  bool fromAllSides() { return mode > 0.5 && mode < 1.5; }
  bool byHeight() { return mode < 1.5 || contours(); }
  float shadeOf(vec3 normal) {
    float one = lightOn(normal, sun.xy);
    if (!fromAllSides()) return one;
    // From four sides, each as much as it grazes the slope (Mark 1992).
    float sum = 0.0, weights = 0.0;
    for (int i = 0; i < 4; ++i) {
      float azimuth = sun.x + (float(i) - 1.5) * 0.785;
      vec2 away = vec2(sin(azimuth), cos(azimuth));
      float weight = 0.15 + pow(length(normal.xy) < 1e-4 ? 0.7 : abs(dot(vec2(-away.y, away.x), normalize(normal.xy))), 2.0);
      sum += weight * lightOn(normal, vec2(azimuth, sun.y));
      weights += weight;
    }
    return sum / weights;
  }
  vec3 facingColour(vec2 slope) { return scale(4.0, fract(atan(-slope.x, -slope.y) / 6.2831853)); }
  // A direction (eye coordinates) as east, north, up at a place.
  vec3 localOf(vec3 directionEC, vec3 p) {
    vec3 up = normalize(p * vec3(1.0, 1.0, 1.00674)), toEast = normalize(vec3(-p.y, p.x, 0.0));
    vec3 direction = czm_inverseViewRotation * directionEC;
    return vec3(dot(direction, toEast), dot(direction, cross(up, toEast)), dot(direction, up));
  }
  // Slope towards east and north of a plane with this normal (eye coordinates).
  vec2 slopeOf(vec3 normalEC, vec3 p) {
    vec3 normal = localOf(normalEC, p);
    return -normal.xy / max(normal.z, 0.02);
  }
  // Of the source where it is draped, else of the mesh's own normals.
  vec2 slopeAt(czm_materialInput given, vec3 p, vec4 draped, bool isDraped) {
    return isDraped ? unsqueezed(draped.rg) : slopeOf(given.normalEC, p);
  }
  // Of the source where it is draped, else of the mesh, without exaggeration.
  float heightAt(float meshHeight, vec4 draped, bool isDraped) {
    float t = 2.0 * (contours() ? (${GROUND_LOW}.0 - draped.b * 255.0) / ${GROUND_LOW - GROUND_HIGH}.0 : (draped.a * 255.0 - ${UNKNOWN_HEIGHT + 1}.0) / ${HEIGHT_STEPS}.0);
    if (contours()) t = clamp(t, 0.0, 2.0);
    return isDraped && t > -0.003 ? (t < 1.0 ? mix(low, knee, t) : mix(knee, high, t - 1.0)) : meshHeight;
  }
  vec3 tinted(float height, float share, float steepness) {
    if (deep < 0.0) share = clamp((height - seaLevel) / max(high - seaLevel, 1.0), 0.0, 1.0);
    vec3 ground = mix(scale(0.0, share), rock.rgb, smoothstep(0.6, 1.1, steepness) * (1.0 - 0.4 * share));
    return deep < 0.0 && height < seaLevel ? scale(3.0, 1.0 - (seaLevel - height) / (seaLevel - deep)) : ground;
  }
  vec3 washed(vec3 ground) {
    if (fromAllSides()) return mix(ground, ${glslOf(WASHES.multi)});
    return contours() ? mix(ground, ${glslOf(WASHES.contours)}) : ground;
  }
  vec3 lit(vec3 ground, vec3 normal, float much) {
    float facing = clamp(0.5 + 0.5 * shadeOf(normal), 0.0, 1.0);
    vec3 shade = mix(vec3(0.14, 0.20, 0.31), vec3(1.26, 1.21, 1.12), pow(facing, 1.9));
    float level = pow(0.5 + 0.5 * sin(sun.y), 1.9); // a low sun darkens no plain
    return ground * mix(vec3(1.0), shade * pow(0.887 / mix(0.14, 1.26, level), 0.75), much);
  }
  // How many contours are below: where the source is draped, by its wave (relief_tile.js), which is exact; its
  // height only says which contour it is.
  float linesAt(float height, vec4 draped, bool isDraped) {
    float about = height / interval, nearest = floor(about + 0.5);
    if (!isDraped) return about;
    float wave = (1.0 - 2.0 * mod(nearest, 2.0)) * (draped.a * 255.0 - ${WAVE_ZERO}) / ${WAVE_STEPS}.0;
    float beside = about > nearest ? nearest + 1.0 : nearest - 1.0;
    return abs(nearest + wave - about) < abs(beside - wave - about) ? nearest + wave : beside - wave;
  }
  // Of which a pixel has so many: "moved" is the ground that it moves over to the right and upwards. A ridge has no
  // slope, but a wave that changes ("waved").
  float linesAPixel(vec2 slope, mat2 moved, float waved) { return max(1.2 * length(slope * moved) / interval, max(waved, 1e-6)); }
  vec3 withContours(vec3 ground, float about, float lines, float wide) {
    float line = 1.0 - smoothstep(0.2, 0.9, abs(fract(lines - 0.5) - 0.5) / wide);
    lines = mix(lines, about, smoothstep(0.25, 0.4, wide)); // closer than the wave can tell them apart
    float fifth = 1.0 - smoothstep(0.5, 1.2, abs(fract(lines / 5.0 - 0.5) - 0.5) * 5.0 / wide);
    float ink = max(line * 0.5 * (1.0 - smoothstep(0.12, 0.35, wide)), fifth * 0.7 * (1.0 - smoothstep(0.5, 1.5, wide)));
    return mix(ground, vec3(0.36, 0.24, 0.13), ink);
  }
  vec3 errorColour(vec4 draped) {
    float t = (draped.r * 255.0 - 128.0) / 127.0;
    float metres = sign(t) * ${ERROR_STEP_M} * (exp(abs(t) * ${ERROR_REACH.toFixed(7)}) - 1.0);
    return scale(2.0, 0.5 + 0.5 * metres / reach) * mix(1.0, 0.45 + 0.72 * draped.g, light);
  }
  // Hatched: the dataset has no height here. Where the mesh leads a mountain on across a small hole, the
  // hatch lies on the ground that is drawn; where it is level, as over a large one, or a wall that no ground
  // is, on paper; so also where colours are not of heights: nobody has measured a slope there.
  vec3 nothing(czm_materialInput given, vec3 facet, vec3 p, float share) {
    float hatch = smoothstep(0.5, 0.9, abs(fract((gl_FragCoord.x + gl_FragCoord.y) / (9.0 * czm_pixelRatio)) - 0.5) * 2.0);
    vec2 slope = slopeOf(facet, p); // of the triangle: the normals at its corners are those of the ground around
    if (length(slope) > 12.0) slope = slopeOf(given.normalEC, p); // a tile's skirt, seen where two tiles leave a gap: as the ground beside
    slope /= exaggeration;
    float wall = smoothstep(1.2, 2.4, length(slope)), bridged = byHeight() ? smoothstep(0.03, 0.2, length(slope)) * (1.0 - wall) : 0.0;
    vec3 ground = mix(paper.rgb, washed(tinted((high - low) * share + low, share, atan(length(slope)))), 0.85 * bridged);
    return lit(mix(ground, vec3(0.62, 0.63, 0.62), 0.5 * hatch), normalize(vec3(-slope * exaggeration * (1.0 - wall) / max(length(slope), 1.0), 1.0)), mix(0.35, 0.6, bridged) * light);
  }
  vec3 groundAt(czm_materialInput given, vec3 p, vec3 facet, mat2 moved, float waved, vec2 bent, vec4 draped) {
    bool errors = mode > 4.5 && measured > 0.5;
    bool isDraped = measured > 0.5 && !errors && draped.r > 0.002;
    vec2 slope = slopeAt(given, p, draped, isDraped);
    vec3 normal = normalize(vec3(-slope * exaggeration, 1.0));
    float steepness = atan(length(slope));
    float meshHeight = (given.height - low) / exaggeration + low;
    float height = heightAt(meshHeight, draped, isDraped);
    float share = clamp((height - low) / (high - low), 0.0, 1.0);
    float water = max(measured < 0.5 ? 0.0 : contours() ? smoothstep(0.945, 0.97, draped.b) : smoothstep(0.53, 0.6, draped.b), given.waterMask);

    vec3 ground;
    if (errors) ground = errorColour(draped);
    else if (mode > 2.5 && mode < 3.5) {
      // Level ground has no aspect. On a ridge there is none for a pixel either, which would be a chain of pale dots.
      float level = length(slope) + (isDraped ? length(bent) : 0.0);
      vec3 facing = mix(vec3(0.93, 0.92, 0.89), facingColour(slope), smoothstep(0.004, 0.06, level));
      ground = lit(facing, normal, 0.5 * light);
    } else if (mode > 1.5 && mode < 2.5) ground = lit(scale(1.0, steepness / 1.5708), normal, 0.25 * light);
    else {
      ground = washed(tinted(height, share, steepness));
      if (deep >= 0.0 || given.waterMask > 0.0) ground = mix(ground, sea.rgb, water);
      ground = lit(ground, normal, light * (1.0 - 0.5 * water));
      if (contours()) ground = withContours(ground, (height - shift) / interval, linesAt(height - shift, draped, isDraped), linesAPixel(slope, moved, isDraped ? waved : 0.0));
    }
    if (measured < 0.5) return ground;
    if (draped.a < ${((UNKNOWN_HEIGHT + 0.5) / 255).toFixed(5)} && (errors || draped.a < 0.002)) return errors ? paper.rgb : ground; // not drawn yet, or not worth it
    float there = smoothstep(0.4, 0.47, draped.b); // between a void and the sea there is hardly any ground
    return there > 0.99 ? ground : mix(nothing(given, facet, p, clamp((meshHeight - low) / (high - low), 0.0, 1.0)), ground, there);
  }
  czm_material picture(czm_materialInput given, vec4 draped) {
    czm_material material = czm_getDefaultMaterial(given);
    vec3 p = (czm_inverseView * vec4(-given.positionToEyeEC, 1.0)).xyz;
    float within = bounded > 0.5 ? inside(p) : 1e9;
    // Beside a skyline fwidth takes two places that lie far from each other.
    float apart = max(czm_metersPerPixel(vec4(-given.positionToEyeEC, 1.0), czm_pixelRatio), 1e-6);
    float pixel = clamp(fwidth(within), 0.2 * apart, 8.0 * apart);
    vec3 right = dFdx(given.positionToEyeEC), upwards = dFdy(given.positionToEyeEC), facet = normalize(cross(right, upwards));
    mat2 moved = mat2(localOf(right, p).xy, localOf(upwards, p).xy);
    facet *= sign(dot(facet, given.positionToEyeEC));
    float waved = 255.0 / ${WAVE_STEPS}.0 * fwidth(draped.a);
    vec2 bent = unsqueezed(128.0 / 255.0 + 0.5 * fwidth(draped.rg));
    vec3 ground = paper.rgb; // outside of the dataset
    bool isWall = length(slopeOf(facet, p)) > 20.0 && abs(within) < max(pixel, 3.0); // between the data and the ground around it
    if (within > 0.0 && !isWall) ground = mix(ground, groundAt(given, p, facet, moved, waved, bent, draped), clamp(within / pixel, 0.0, 1.0));
    // The outline lies inside: ground beside the data that ends where it does is coarser, and would have one of its own.
    float outline = isWall ? 0.0 : bounded * smoothstep(0.0, 0.5, within / pixel) * (1.0 - smoothstep(1.4, 2.2, within / pixel));
    ground = mix(ground, vec3(0.42, 0.45, 0.47), 0.7 * outline);
    bool plain = mode > 4.5 && measured > 0.5; // the scale of errors is read off as it is
    material.diffuse = plain ? ground : mix(ground, air.rgb, haze(length(given.positionToEyeEC), given.height));
    return material;
  }
  #define czm_getMaterial(given) picture(given, color)`;

export function groundMaterial(Cesium, dataset, measured) {
  const {low, high, extent, rectangle, seaLevel} = dataset;
  const colour = (css) => Cesium.Color.fromCssColorString(css);
  const bathymetry = hasDepths(dataset), {knee, top} = heightScale(dataset);
  return new Cesium.Material({
    translucent: false,
    fabric: {
      uniforms: {
        scales: scales(), low, knee, high: top, sight: Math.max(2.5 * extent, LEAST_SIGHT),
        light: 1, exaggeration: 1, mode: 0, measured: measured ? 1 : 0, reach: 1, interval: 100, shift: dataset.shift.middle,
        sun: new Cesium.Cartesian2(), seaLevel: seaLevel ?? 0, deep: bathymetry ? low : 0, bounded: rectangle.width > Math.PI ? 0 : 1,
        ...sidesOf(Cesium, rectangle, (low + high) / 2),
        rock: colour("#8d8379"), paper: colour(PAPER), sea: colour(SEA_COLOUR), air: colour("#dbe7ec"),
      },
      source: SOURCE,
    },
  });
}

/// {mode, flat, sun, exaggeration} of the looks, and the error at which the scale ends.
export function setLooks(uniforms, {mode, flat, sun, exaggeration}, {reach, interval}) {
  uniforms.mode = MODES.indexOf(mode);
  uniforms.light = flat ? 0 : 1;
  uniforms.exaggeration = exaggeration;
  uniforms.sun.x = (sun.azimuth * Math.PI) / 180;
  uniforms.sun.y = (sun.altitude * Math.PI) / 180;
  uniforms.reach = reach;
  uniforms.interval = interval;
}
