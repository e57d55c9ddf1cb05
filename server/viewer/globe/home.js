// The camera that has a box of terrain fill the frame. Pure; all in a local frame: east, north, up.

import {localFrame} from "./geodesy.js";

const LARGE_M = 2e6; // seen from straight above: the earth bends too much to be seen from a side
const MOST_DEGREES = 120; // wider or higher, it is on a globe that is seen whole
const LEAST_ROOM = 0.3; // of 2, the whole picture: in less, nothing is seen
const STEPS = 24; // along each side, at which the ground is to be in the picture

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const plus = (a, b, s) => [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]];

/// Axes of a camera that looks `heading` from north towards east and `pitch` up, radians.
export function axes(heading, pitch) {
  const [sh, ch, sp, cp] = [Math.sin(heading), Math.cos(heading), Math.sin(pitch), Math.cos(pitch)];
  return {ahead: [sh * cp, ch * cp, sp], right: [ch, -sh, 0], up: [-sh * sp, -ch * sp, cp]};
}

/// Where on the picture the points are: {left, right, bottom, top} from -1 to 1.
export function extentOf(points, eye, {ahead, right, up}, tanX, tanY) {
  const box = {left: Infinity, right: -Infinity, bottom: Infinity, top: -Infinity};
  for (const point of points) {
    const to = plus(point, eye, -1), depth = Math.max(dot(to, ahead), 1e-9);
    const [x, y] = [dot(to, right) / depth / tanX, dot(to, up) / depth / tanY];
    box.left = Math.min(box.left, x), box.right = Math.max(box.right, x);
    box.bottom = Math.min(box.bottom, y), box.top = Math.max(box.top, y);
  }
  return box;
}

/// The eye from which the points just fill `frame` (as extentOf counts), in the middle of what room is
/// left. A point at (x, depth) is left of the frame's right side where x - eye.x <= right (depth - eye.depth):
/// of all points only the largest x - right depth counts, and so on. Two sides leave a range of eye.x for
/// each eye.depth; the nearest eye is where one of the ranges is a single place.
export function eyeThatFits(points, {ahead, right, up}, tanX, tanY, frame) {
  const most = (f) => Math.max(...points.map(f));
  const range = (axis, low, high) => ({
    low, high,
    least: most((p) => dot(p, axis) - high * dot(p, ahead)),
    most: -most((p) => low * dot(p, ahead) - dot(p, axis)),
  });
  const x = range(right, frame.left * tanX, frame.right * tanX), y = range(up, frame.bottom * tanY, frame.top * tanY);
  const depth = Math.min(...[x, y].map(({low, high, least, most}) => (most - least) / (high - low)));
  const middle = ({low, high, least, most}) => (least + high * depth + most + low * depth) / 2;
  return plus(plus(plus([0, 0, 0], ahead, depth), right, middle(x)), up, middle(y));
}

const within = ({x, y}, {left, right, bottom, top}) => x > left && x < right && y > bottom && y < top;

/// The eye that `fit` finds for the largest part of `frame` in which no point lies behind one of `corners`:
/// rectangles at the corners of the picture, counted as the frame is. What cannot pass beside one passes above or
/// below it, whichever leaves the eye nearer. `fit(frame)` is an eye from which the points fill the frame.
export function eyeClearOf(corners, points, fit, {ahead, right, up}, tanX, tanY, frame) {
  const isClear = (eye) => points.every((point) => {
    const to = plus(point, eye, -1), depth = Math.max(dot(to, ahead), 1e-9);
    const seen = {x: dot(to, right) / depth / tanX, y: dot(to, up) / depth / tanY};
    return !corners.some((corner) => within(seen, corner));
  });
  const full = fit(frame);
  if (isClear(full)) return full;
  let rooms = [frame];
  for (const {left, right: east, bottom, top} of corners)
    rooms = rooms.flatMap((room) => [
      left + east > 0 ? {...room, right: Math.min(room.right, left)} : {...room, left: Math.max(room.left, east)},
      bottom + top > 0 ? {...room, top: Math.min(room.top, bottom)} : {...room, bottom: Math.max(room.bottom, top)}]);
  const near = (eye) => -dot(eye, ahead);
  const best = rooms.filter(({left, right: east, bottom, top}) => east - left > LEAST_ROOM && top - bottom > LEAST_ROOM)
    .map((room) => {
      let [taken, clear] = [0, 1]; // of the way from the frame to the room: as little as is needed
      const between = (share) => fit(Object.fromEntries(Object.keys(frame).map((side) => [side, frame[side] + share * (room[side] - frame[side])])));
      for (let i = 0; i < 7; ++i) {
        const middle = (taken + clear) / 2;
        if (isClear(between(middle))) clear = middle;
        else taken = middle;
      }
      return between(clear);
    }).sort((a, b) => near(a) - near(b))[0];
  return best ?? full;
}

/// The eye straight above the origin, from which the points fit into a frame that has its middle there. It looks
/// straight down: from beside the origin, it would not see north above.
function eyeAbove(points, tanX, tanY, {left, right, bottom, top}) {
  const [wide, high] = [tanX * Math.min(-left, right), tanY * Math.min(-bottom, top)].map((room) => Math.max(room, 1e-6)); // none: from infinitely far
  return [0, 0, Math.max(...points.map(([x, y, z]) => z + Math.max(Math.abs(x) / wide, Math.abs(y) / high)))];
}

/// Metres that the shorter side of a box (degrees) is long, at most about that of a continent.
export function acrossOf({west, south, east, north}) {
  const rad = Math.PI / 180, lat = ((south + north) / 2) * rad;
  return 6371000 * Math.min((east - west) * rad * Math.cos(lat), (north - south) * rad, 2);
}

/// Whether it is seen from straight above. Its middle is then that of the picture.
export const isLarge = (box) => acrossOf(box) > LARGE_M;

/// {middle: {lon, lat, height}, eye, look}: `look` are axes(); eye and look are in the local frame of the
/// middle of `box` (degrees; it may go on beyond 180). Its ground lies within [low, top]. It is seen from the
/// south-west; from higher where it is steep for its size or the frame is upright, and from straight above,
/// north up, where it is large. `free` is the frame, `corners` are what lies over it (eyeClearOf).
export function homeOf(box, {low, high, top}, {upright, tanX, tanY, free, corners = []}) {
  const {west, south, east, north} = box, across = acrossOf(box);
  const middle = {lon: (west + east) / 2, lat: (south + north) / 2, height: (low + high) / 2};
  const large = isLarge(box), whole = east - west > MOST_DEGREES || north - south > MOST_DEGREES;
  const seen = large && whole ? {west: middle.lon - 180, south: -90, east: middle.lon + 180, north: 90} : box;
  const local = localFrame(middle.lon, middle.lat, middle.height);
  const points = [];
  for (let i = 0; i <= STEPS; ++i)
    for (let j = 0; j <= STEPS; ++j)
      for (const height of [low, (low + top) / 2, top])
        points.push(local(seen.west + (i / STEPS) * (seen.east - seen.west), seen.south + (j / STEPS) * (seen.north - seen.south), height));
  const pitch = -Math.max(upright ? 0.85 : 0.6, Math.min(1.2 * Math.atan((high - low) / across), 1));
  const look = large ? axes(0, -Math.PI / 2) : axes(0.35, pitch);
  const fit = (frame) => (large ? eyeAbove(points, tanX, tanY, frame) : eyeThatFits(points, look, tanX, tanY, frame));
  return {middle, eye: eyeClearOf(corners, points, fit, look, tanX, tanY, free), look};
}
