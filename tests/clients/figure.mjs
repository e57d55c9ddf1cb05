// A row of the table of clients that scripts/client_figures prints: who read, and what came of it.
import {readFileSync} from "node:fs";

/// `client`: a package here, which gets its version, or another program's name.
export function figure(client, text) {
  let version = "";
  try {
    version = ` ${JSON.parse(readFileSync(new URL(`node_modules/${client}/package.json`, import.meta.url))).version}`;
  } catch {}
  console.log(`figure | ${client}${version} | ${text}`);
}
