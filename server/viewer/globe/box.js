// Rectangles on the globe: a dataset's box goes on beyond 180 degrees east where it crosses the
// antimeridian (179 to 181), what it is compared with stays within a turn. Pure; in degrees or, with
// `turn` 2 pi, in radians.

/// What a rectangle has in common with a box, counted as the box does; undefined for nothing, or a side.
export function shared(box, {west, south, east, north}, turn = 360) {
  for (const by of [0, turn, -turn]) {
    const part = {west: Math.max(box.west, west + by), south: Math.max(box.south, south), east: Math.min(box.east, east + by), north: Math.min(box.north, north)};
    if (part.west < part.east && part.south < part.north) return part;
  }
  return undefined;
}

/// The whole rectangle, counted as the box does where they meet.
export function inTurnOf(box, rectangle, turn = 360) {
  const part = shared(box, rectangle, turn);
  const by = part ? turn * Math.round(((part.west + part.east) / 2 - (rectangle.west + rectangle.east) / 2) / turn) : 0;
  return {...rectangle, west: rectangle.west + by, east: rectangle.east + by};
}
