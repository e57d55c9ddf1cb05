// Lengths, areas and sight on WGS84. Places are [lon, lat], degrees.

const RADIUS = 6378137, FLATTENING = 1 / 298.257223563;
const RAD = Math.PI / 180;

/// Metres along the ellipsoid, and the azimuth at the start in degrees (Vincenty 1975). Where that does
/// not converge, near the antipodes, the length is that on a sphere, and there is no azimuth.
export function geodesic([lon1, lat1], [lon2, lat2]) {
  if (lon1 === lon2 && lat1 === lat2) return {metres: 0, azimuth: 0};
  const b = RADIUS * (1 - FLATTENING), L = (lon2 - lon1) * RAD;
  const U1 = Math.atan((1 - FLATTENING) * Math.tan(lat1 * RAD)), U2 = Math.atan((1 - FLATTENING) * Math.tan(lat2 * RAD));
  const [s1, c1, s2, c2] = [Math.sin(U1), Math.cos(U1), Math.sin(U2), Math.cos(U2)];
  let lambda = L;
  for (let turn = 0; turn < 100; ++turn) {
    const [sl, cl] = [Math.sin(lambda), Math.cos(lambda)];
    const sinSigma = Math.hypot(c2 * sl, c1 * s2 - s1 * c2 * cl), cosSigma = s1 * s2 + c1 * c2 * cl;
    const sigma = Math.atan2(sinSigma, cosSigma);
    const sinAlpha = sinSigma === 0 ? 0 : (c1 * c2 * sl) / sinSigma, cos2Alpha = 1 - sinAlpha ** 2;
    const cos2m = cos2Alpha === 0 ? 0 : cosSigma - (2 * s1 * s2) / cos2Alpha;
    const C = (FLATTENING / 16) * cos2Alpha * (4 + FLATTENING * (4 - 3 * cos2Alpha));
    const before = lambda;
    lambda = L + (1 - C) * FLATTENING * sinAlpha * (sigma + C * sinSigma * (cos2m + C * cosSigma * (2 * cos2m ** 2 - 1)));
    if (Math.abs(lambda - before) > 1e-12) continue;
    const u2 = cos2Alpha * ((RADIUS ** 2 - b ** 2) / b ** 2);
    const {A, delta} = series(u2, sinSigma, cosSigma, cos2m);
    return {metres: b * A * (sigma - delta), azimuth: (Math.atan2(c2 * sl, c1 * s2 - s1 * c2 * cl) / RAD + 360) % 360};
  }
  const cosine = Math.sin(lat1 * RAD) * Math.sin(lat2 * RAD) + Math.cos(lat1 * RAD) * Math.cos(lat2 * RAD) * Math.cos(L);
  return {metres: 6371008.8 * Math.acos(Math.min(Math.max(cosine, -1), 1)), azimuth: undefined};
}

/// Vincenty's A, and his difference of the arcs on the ellipsoid and on the sphere.
function series(u2, sinSigma, cosSigma, cos2m) {
  const A = 1 + (u2 / 16384) * (4096 + u2 * (-768 + u2 * (320 - 175 * u2)));
  const B = (u2 / 1024) * (256 + u2 * (-128 + u2 * (74 - 47 * u2)));
  const delta = B * sinSigma * (cos2m + (B / 4) * (cosSigma * (2 * cos2m ** 2 - 1) - (B / 6) * cos2m * (4 * sinSigma ** 2 - 3) * (4 * cos2m ** 2 - 3)));
  return {A, delta};
}

/// Where one is that many metres on, in an azimuth from a place (Vincenty 1975, the direct problem): [lon, lat].
function ahead([lon, lat], azimuth, metres) {
  const b = RADIUS * (1 - FLATTENING), tanU = (1 - FLATTENING) * Math.tan(lat * RAD);
  const cosU = 1 / Math.hypot(1, tanU), sinU = tanU * cosU;
  const [sa, ca] = [Math.sin(azimuth * RAD), Math.cos(azimuth * RAD)];
  const sinAlpha = cosU * sa, cos2Alpha = 1 - sinAlpha ** 2;
  const sigma1 = Math.atan2(tanU, ca), u2 = cos2Alpha * ((RADIUS ** 2 - b ** 2) / b ** 2);
  let sigma = metres / b, cos2m = 1;
  for (let turn = 0, before = Infinity; turn < 100 && Math.abs(sigma - before) > 1e-12; ++turn) {
    before = sigma;
    cos2m = Math.cos(2 * sigma1 + sigma);
    const {A, delta} = series(u2, Math.sin(sigma), Math.cos(sigma), cos2m);
    sigma = metres / (b * A) + delta;
  }
  cos2m = Math.cos(2 * sigma1 + sigma);
  const [ss, cs] = [Math.sin(sigma), Math.cos(sigma)];
  const flat = sinU * ss - cosU * cs * ca;
  const lambda = Math.atan2(ss * sa, cosU * cs - sinU * ss * ca);
  const C = (FLATTENING / 16) * cos2Alpha * (4 + FLATTENING * (4 - 3 * cos2Alpha));
  const L = lambda - (1 - C) * FLATTENING * sinAlpha * (sigma + C * ss * (cos2m + C * cs * (2 * cos2m ** 2 - 1)));
  return [lon + L / RAD, Math.atan2(sinU * cs + cosU * ss * ca, (1 - FLATTENING) * Math.hypot(sinAlpha, flat)) / RAD];
}

export function pathMetres(places) {
  let sum = 0;
  for (let i = 1; i < places.length; ++i) sum += geodesic(places[i - 1], places[i]).metres;
  return sum;
}

/// The same longitude, or difference of two, from -180 to 180.
const withinTurn = (degrees) => degrees - 360 * Math.round(degrees / 360);

/// `count` places along a path, evenly by length, both ends included; [{lon, lat, metres}]. Between two
/// corners on the geodesic, as the daemon has it; between antipodes, where each way is as good, straight in degrees.
export function along(places, count) {
  const legs = places.slice(1).map((place, i) => geodesic(places[i], place));
  const lengths = legs.map(({metres}) => metres);
  const all = lengths.reduce((sum, length) => sum + length, 0);
  const result = [];
  let leg = 0, before = 0;
  for (let i = 0; i < count; ++i) {
    const metres = (all * i) / (count - 1);
    while (leg < lengths.length - 1 && metres > before + lengths[leg]) before += lengths[leg++];
    const share = lengths[leg] > 0 ? Math.min((metres - before) / lengths[leg], 1) : 0;
    const [from, to] = [places[leg], places[leg + 1]], {azimuth} = legs[leg];
    const [lon, lat] = share === 0 ? from : share === 1 ? to
      : azimuth !== undefined ? ahead(from, azimuth, share * lengths[leg])
      : [from[0] + share * withinTurn(to[0] - from[0]), from[1] + share * (to[1] - from[1])];
    result.push({lon: withinTurn(lon), lat, metres});
  }
  return result;
}

/// Square metres on the ellipsoid inside a polygon that crosses itself nowhere: edges are straight in
/// longitude and the sine of the authalic latitude, in which areas are those of the plane. One that goes around a pole
/// holds the nearer one.
export function polygonArea(places) {
  const e2 = FLATTENING * (2 - FLATTENING), e = Math.sqrt(e2);
  const q = (lat) => {
    const s = Math.sin(lat * RAD);
    return (1 - e2) * (s / (1 - e2 * s * s) + Math.atanh(e * s) / e);
  };
  let sum = 0, turned = 0;
  places.forEach(([lon, lat], i) => {
    const [lon2, lat2] = places[(i + 1) % places.length], across = withinTurn(lon2 - lon);
    sum += across * RAD * (q(lat) + q(lat2));
    turned += across;
  });
  // What the sum has of a ring around the axis is the belt between it and the equator.
  const area = Math.abs(turned) > 180 ? 4 * Math.PI * q(90) - Math.abs(sum) : Math.abs(sum);
  return area * (RADIUS ** 2 / 4);
}

/// Which places along a line an eye sees: [{metres, height}] with height undefined where none is known.
/// The eye is `eye` metres above the first, looks at what is `target` metres above each other place;
/// refraction bends light by 0.13 of the earth's curvature.
export function sightLine(profile, eye = 1.7, target = 0) {
  const drop = (metres) => (0.87 * metres * metres) / (2 * 6371000);
  const start = profile[0].height + eye;
  let highest = -Infinity;
  return profile.map(({metres, height}, i) => {
    if (i === 0) return true;
    if (height === undefined) return undefined;
    const angle = (up) => (height + up - drop(metres) - start) / metres;
    const seen = angle(target) >= highest;
    highest = Math.max(highest, angle(0));
    return seen;
  });
}

// ---- in space

const ECCENTRICITY2 = FLATTENING * (2 - FLATTENING);

function earthCentred(lon, lat, height) {
  const [sp, cp] = [Math.sin(lat * RAD), Math.cos(lat * RAD)], n = RADIUS / Math.sqrt(1 - ECCENTRICITY2 * sp * sp);
  return [(n + height) * cp * Math.cos(lon * RAD), (n + height) * cp * Math.sin(lon * RAD), (n * (1 - ECCENTRICITY2) + height) * sp];
}

/// Of places (lon, lat, height): metres east, north and up of one.
export function localFrame(lon, lat, height) {
  const origin = earthCentred(lon, lat, height);
  const [sl, cl, sp, cp] = [Math.sin(lon * RAD), Math.cos(lon * RAD), Math.sin(lat * RAD), Math.cos(lat * RAD)];
  return (...place) => {
    const [x, y, z] = earthCentred(...place).map((value, k) => value - origin[k]);
    return [-sl * x + cl * y, -sp * cl * x - sp * sl * y + cp * z, cp * cl * x + cp * sl * y + sp * z];
  };
}
