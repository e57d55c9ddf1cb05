// How far a dataset's heights are above those that its DEM counts itself: mostly the geoid's height above the
// ellipsoid. Smooth, so that a lattice of places tells it everywhere. Pure; degrees and metres.

const APART = 0.5, FEWEST = 5, MOST = 33; // degrees between two places at most, where so many are enough

const across = (degrees) => Math.min(Math.max(Math.ceil(degrees / APART) + 1, FEWEST), MOST);
const withinTurn = (lon) => (lon > 180 ? lon - 360 : lon);

/// Of a dataset's box, which may go on beyond 180 degrees: {columns, rows, places}, rows from the south. None on its
/// sides, where a DEM that stands askew in it has no post.
export function shiftLattice({west, south, east, north}) {
  const columns = across(east - west), rows = across(north - south);
  const places = [];
  for (let j = 0; j < rows; ++j)
    for (let i = 0; i < columns; ++i)
      places.push({lon: withinTurn(west + ((i + 0.5) / columns) * (east - west)), lat: south + ((j + 0.5) / rows) * (north - south)});
  return {columns, rows, places};
}

/// Of unknown values (undefined, as in voids) each the nearest that is known; nothing where none is.
function filled({columns, rows}, values) {
  const known = values.flatMap((value, k) => (value === undefined ? [] : [[k % columns, Math.floor(k / columns), value]]));
  if (known.length === 0) return undefined;
  return values.map((value, k) => {
    if (value !== undefined) return value;
    const far = ([i, j]) => (i - (k % columns)) ** 2 + (j - Math.floor(k / columns)) ** 2;
    return known.reduce((best, one) => (far(one) < far(best) ? one : best))[2];
  });
}

/// {at(lon, lat), middle}: metres at a place, linear between the lattice's and on to the sides of the box, and those
/// half-way between the least and the most; undefined where no value is known.
export function shiftOf(box, lattice, values) {
  const metres = filled(lattice, values);
  if (!metres) return undefined;
  const {west, south, east, north} = box, {columns, rows} = lattice;
  const step = (share, count) => {
    const at = Math.min(Math.max(share, 0), 1) * count - 0.5, first = Math.min(Math.max(Math.floor(at), 0), count - 2);
    return [first, at - first];
  };
  const at = (lon, lat) => {
    const [i, x] = step(((lon < west && east > 180 ? lon + 360 : lon) - west) / (east - west), columns);
    const [j, y] = step((lat - south) / (north - south), rows);
    const k = j * columns + i;
    return (metres[k] * (1 - x) + metres[k + 1] * x) * (1 - y) + (metres[k + columns] * (1 - x) + metres[k + columns + 1] * x) * y;
  };
  return {at, middle: (Math.min(...metres) + Math.max(...metres)) / 2};
}

/// Of a dataset whose heights are those that its DEM counts, or where nobody knows.
export const NO_SHIFT = {at: () => 0, middle: 0};
