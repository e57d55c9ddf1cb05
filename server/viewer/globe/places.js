// What somebody may write to find a place.

const PART = String.raw`([+-]?\d+(?:\.\d+)?)\s*(?:[°d]\s*(?:(\d+(?:\.\d+)?)\s*['′m]\s*(?:(\d+(?:\.\d+)?)\s*(?:["″s]|''))?)?)?\s*([NSEWnsew])?`;
const TWO = new RegExp(String.raw`^\s*([NSEWnsew])?\s*${PART}\s*[,;\s]\s*([NSEWnsew])?\s*${PART}\s*$`);

function degrees(sign, whole, minutes, seconds) {
  const value = Math.abs(Number(whole)) + Number(minutes ?? 0) / 60 + Number(seconds ?? 0) / 3600;
  return (whole.startsWith("-") ? -value : value) * (/[SWsw]/.test(sign ?? "") ? -1 : 1);
}

/// {lon, lat} of two numbers: "46.85, -121.76" (latitude first, as on paper), "121.76 W 46.85 N",
/// "46°51'10"N 121°45'37"W"; undefined where it is none, or not on earth.
export function placeOf(text) {
  const found = TWO.exec(text.replace(/[−–]/g, "-"));
  if (!found) return undefined;
  const [, before1, d1, m1, s1, after1, before2, d2, m2, s2, after2] = found;
  const [first, second] = [before1 ?? after1, before2 ?? after2];
  const values = [degrees(first, d1, m1, s1), degrees(second, d2, m2, s2)];
  const eastFirst = /[EWew]/.test(first ?? "");
  if (eastFirst ? /[EWew]/.test(second ?? "") : /[NSns]/.test(second ?? "")) return undefined; // twice the same axis
  const [lat, lon] = eastFirst ? values.reverse() : values;
  return Math.abs(lat) <= 90 && Math.abs(lon) <= 180 ? {lon, lat} : undefined;
}

/// What a search leads to, best first: {kind: "place"|"highest"|"lowest"|"dataset", ...}.
export function matches(text, datasets) {
  const asked = text.trim().toLowerCase();
  if (!asked) return [];
  const place = placeOf(text);
  if (place) return [{kind: "place", ...place, label: `${place.lat.toFixed(5)}, ${place.lon.toFixed(5)}`}];
  const found = [];
  const says = (...words) => words.some((word) => word.startsWith(asked) || asked.startsWith(`${word} `));
  if (says("summit", "highest", "top", "peak")) found.push({kind: "highest", label: "Highest post of this dataset"});
  if (says("lowest", "bottom")) found.push({kind: "lowest", label: "Lowest post of this dataset"});
  const rank = ({name}) => (name.toLowerCase().startsWith(asked) ? 0 : 1);
  const named = datasets.filter(({name}) => name.toLowerCase().includes(asked)).sort((a, b) => rank(a) - rank(b));
  return [...found, ...named.slice(0, 8).map(({name}) => ({kind: "dataset", name, label: name}))];
}
