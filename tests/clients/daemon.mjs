// `tind serve` on a free port of its own, for as long as a test needs it.
import {spawn} from "node:child_process";
import {once} from "node:events";
import {existsSync, readdirSync} from "node:fs";
import {createServer} from "node:net";
import {fileURLToPath} from "node:url";

export const ROOT = fileURLToPath(new URL("../..", import.meta.url));
process.env.TIND_AS_ROOT ??= "true";  // tests may run in a container that has no other user
export const PROGRAM = process.env.TIND_BINARY ?? `${ROOT}/build/release/tind`;

export async function freePort() {
  const probe = createServer().listen(0, "127.0.0.1");
  await once(probe, "listening");
  const {port} = probe.address();
  probe.close();
  await once(probe, "close");
  return port;
}

/// Everything below a folder, by its path there; of one that a program is at work in, too, where
/// what is listed may be gone before it is looked into.
export function filesNow(folder) {
  for (;;)
    try {
      return existsSync(folder) ? readdirSync(folder, {recursive: true}) : [];
    } catch (error) {
      if (error.code !== "ENOENT") throw error;
    }
}

/// {origin, pid, stop(), signal(name), said()}; resolves when the daemon says that it is ready.
export async function startDaemon(...args) {
  const address = `127.0.0.1:${await freePort()}`;
  const daemon = spawn(PROGRAM, ["serve", ...args, "--listen", address], {cwd: ROOT, stdio: ["ignore", "ignore", "pipe"]});
  let said = "";
  daemon.stderr.on("data", (data) => (said += data));
  const origin = `http://${address}`;
  for (let tries = 0; ; ++tries) {
    if (daemon.exitCode !== null || tries > 300) throw new Error(`tind serve did not start: ${said}`);
    const ready = await fetch(`${origin}/readyz`).then((reply) => reply.ok, () => false);
    if (ready) break;
    await new Promise((resolve) => setTimeout(resolve, 100));
  }
  const stop = async () => {
    const ended = once(daemon, "exit");
    daemon.kill("SIGTERM");
    const [code] = await ended;
    return code;
  };
  return {origin, pid: daemon.pid, stop, signal: (name) => daemon.kill(name), said: () => said};
}
