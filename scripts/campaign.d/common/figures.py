"""The figures that the test programme asks for, one line each, beside what was reached.

A part may have REACHED(rows), which makes of its rows {id: what they come to}. What no part counts, the line itself says
in `shown`: what the tests that it names show whenever they run."""
import re
import subprocess
import sys
from typing import NamedTuple

from .programme import ROOT


class Figure(NamedTuple):
    id: str
    asked: str
    by: str     # parts; files of the repository and names of tests, in backticks
    short: str  # of it, and why
    shown: str = ""


def numbers(pattern, rows):
    """What the pattern's groups are in all results, as numbers where they are such."""
    def number(text):
        plain = text.replace(",", "")
        if not re.fullmatch(r"[+-]?\d+(\.\d+)?", plain):
            return text
        return float(plain) if "." in plain else int(plain)
    found = [match.groups() for row in rows for match in re.finditer(pattern, row.result)]
    return [tuple(number(group) if group else 0 for group in groups) for groups in found]


def span(values, form=",.0f"):
    low, high = format(min(values), form), format(max(values), form)
    return low if low == high else f"{low} to {high}"


def percent(share, form=".0f"):
    return f"{100 * share:{form}} %"


def beyond_ci(rows):
    return [row for row in rows if row.tier != "ci"]


def last_whole(rows):
    """The last of a gate or a campaign."""
    return (beyond_ci(rows) or rows)[-1]


SENDERS = ("http", "garden", "load", "soak")


# ---- the table ----

def threats():
    lines = [line for line in (ROOT / "docs/security.md").read_text().splitlines() if line.startswith("| ") and line.count(" | ") == 2]
    lines = [line for line in lines if not line.startswith(("| they could", "| what happens"))]
    return f"{len(lines)} lines, {sum(line.endswith('| - |') for line in lines)} of them without a test or a part"


TABLE = [
    Figure("A1", "warnings are errors with GCC 12 and with clang 19; clang-tidy's bugprone, cert and concurrency: 0; cppcheck: 0",
           "part tidy; `CMakeLists.txt` (`TIND_WERROR`)",
           "clang 19 compiles the libraries and the fuzz targets (preset fuzz), not the tests; of concurrency only mt-unsafe, of cert what bugprone has under other "
           "names; cppcheck is not run",
           "every build by GCC 12 has -Werror"),
    Figure("A2", "all tests under ASan and UBSan, with integer and float-cast-overflow, and under TSan: 0 reports; suppressed are named frames of others only; valgrind's memcheck",
           "part sanitizers; `tests/support/tsan.supp`",
           "folders were looked at on different days and commits; UBSan is without integer and, under GCC, without float-cast-overflow (the fuzz targets, by clang, have that); "
           "vptr, null and alignment are off, `CMakeLists.txt` says why; valgrind is not run; without clients and some slow tests"),
    Figure("A3", "95 % of all lines, 90 % of the branches; every branch of HTTP's parser, the router, the tile codec, readers and writers of archives and the configuration",
           "part coverage", "branches are not counted; three rooms, not all; each room as of its last row"),
    Figure("A4", "of 500 seeded mutants in the files of which A3 asks every branch 80 % are noticed", "part mutants",
           "three runs together, not one of 500; six files: no router, no configuration; mutants that change nothing one could see count as not noticed"),
    Figure("A5", "checksec and blhc find nothing, lintian no error; systemd-analyze security: 1.5 at most",
           "`tests/server/cli/hardening_test.cpp`; `scripts/check_unit`",
           "there is no Debian package for lintian and blhc; checksec is not run: the test reads the program's ELF file itself",
           "movable, full RELRO, stack protector, _FORTIFY_SOURCE; the unit's exposure is 1.4"),
    Figure("B1", "250 probes for every MUST of RFC 9110 and 9112 and all kinds of smuggling: all of MUST and of malformed, 95 % of SHOULD; the same of nginx, h2o, haproxy, node",
           "part http; `testdata/http_probes.txt`, `RequestParser.EveryProbeGetsItsVerdict`",
           "a probe names its clause, not its level: shares of MUST and SHOULD are not counted; node is not compared with; tind's 3: the parser takes them, as the "
           "table says, and `/` answers their query with 400"),
    Figure("B2", "each probe byte by byte and at every split: the same verdict; 50,000 deliveries",
           "part http; `RequestParser.TheVerdictDoesNotDependOnHowBytesArrive`",
           "up to seed 81 probes of more than 300 bytes were split at every 97th; after that all of up to 10,000 bytes at every one"),
    Figure("B3", "ten front ends before the daemon, 200,000 payloads each: 0 requests that it saw and the front end did not answer", "part garden",
           "2,000 for each at the gate; a campaign goes up to 200,000 as far as its seconds do; the 3 of seed 71 were none: caddy, on a busy machine, "
           "sent a request on and closed before its answer"),
    Figure("B4", "1,000,000 pipelined, valid and not: count and order exact, nothing behind an invalid one", "part http", "-"),
    Figure("B5", "5,000 combinations of conditions, weights, HEAD against an oracle; http-cache-tests through nginx and varnish",
           "`Api.EveryCombinationOfConditionsAndEncodings`, `tests/server/http/negotiate_test.cpp`",
           "128, not 5,000: If-None-Match, Accept-Encoding, HEAD; no dates, as there is no Last-Modified; http-cache-tests are not run",
           "128 combinations: status, ETag, Vary, length and body as they must"),
    Figure("C", "fuzzing under ASan and UBSan by libFuzzer and AFL++, 5 MB of corpus at most: 0 crashes, hangs, leaks. By target:", "part fuzz",
           "AFL++ is not used; what crashed was mended after its row"),
    Figure("C1", "requests through parser, policy and router: 500 M; 10 us in the median, 16 KiB allocated at most", "`request_fuzz`",
           "as many as the seconds allow; the time of an input is not measured, its memory where the seeds are replayed (1 MiB and 256 bytes for each of its own at most)"),
    Figure("C2", "HTTP's parser beside a strict model: 100 M, 0 differences", "`request_fuzz`", "there is no model: it compares the parser with itself, whole and in pieces"),
    Figure("C3", "paths, queries, Accept-Encoding, Range, ETag: 200 M, round trip", "`query_fuzz`", "as many as the seconds allow; no round trip; fields of HTTP are in C1's target"),
    Figure("C4", "decoders of tiles and heightmaps, gzip, zstd: 100 M; what is encoded is decoded as it was",
           "`quantized_mesh_fuzz`, `btg_fuzz`, `tpm_fuzz`, `refine_delta_fuzz`, `png_fuzz`, `webp_fuzz`",
           "as many as the seconds allow; gzip only inside of archives; zstd is not used"),
    Figure("C5", "readers of packs, PMTiles, MBTiles, records, plans, layer.json: 100 M; nothing corrupt is served",
           "`archive_fuzz`, `pmtiles_fuzz`, `record_fuzz`, `residual_record_fuzz`, `shard_plan_fuzz`, `layer_json_fuzz`", "as many as the seconds allow"),
    Figure("C6", "meshers on degenerate grids with voids: 20 M meshes, valid, within their bound", "`bounded_fuzz`, `collapse_fuzz`", "as many as the seconds allow"),
    Figure("C7", "neighbouring tiles: 5 M pairs, the same border to the bit", "`Tiles.geographic_pyramid_is_valid_without_cracks_and_within_its_errors`",
           "no fuzz target: the tests compare all neighbours of some pyramids", "all pairs of the pyramids in `tests/terrain/pyramid/tiles_test.cpp` meet"),
    Figure("C8", "configuration of TOML, environment, flags: 50 M", "`toml_fuzz`; `tests/server/services/config_test.cpp`", "TOML alone is fuzzed, as long as the seconds allow"),
    Figure("C9", "GDAL in the sandbox with mutated rasters: 2 M; the daemon lives, at most one 5xx, 512 MB and 2 s each",
           "`dem_fuzz`, `zip_entry_fuzz`; `tests/terrain/raster/sandbox/sandbox_test.cpp`",
           "dem_fuzz reads in its own process, not in the sandbox, and a small part of the others' rate; a case of part rasters may take 60 s"),
    Figure("C10", "the whole daemon over sockets: 20 M requests", "parts http, garden, load, soak", "what they send is made up, not fuzzed; no coverage leads it"),
    Figure("D1", "every N-th allocation fails, once and from then on, at the start, in tiles, a reload, a batch: a right answer, 503 or 500, an honest end",
           "part memory; `Allocation.ThatFailsEndsTheProgramHonestly`",
           "a sample, as each point is a process of its own; once, not for good; operator new of the program's own code, not malloc of libraries; nlohmann-json 3.11.2 can "
           "crash, see the part"),
    Figure("D2", "every N-th of each call fails with EIO, ENOSPC, EDQUOT, EMFILE, EINTR, EAGAIN or does a part, in a batch and the daemon: 3,000 points; no false success; run again, "
           "the same bytes", "parts faults, shorts", "a sample of the points that there are, another one with each seed; EAGAIN is not for files; openat2 is not used"),
    Figure("D3", "a disk of 1, 2, 5, 10, 20 MB that fills up: a clear message, and it goes on when there is room", "part space",
           "builds and copies have outputs of a megabyte, so up to there; meshes up to 20 MB (after seed 81)"),
    Figure("D4", "fsync fails: reported, never taken for done", "part faults", "not counted apart",
           "fsync, fdatasync, syncfs are among the calls that fail; an exit code of 0 after that is wrong"),
    Figure("D5", "a server of DEMs that is cut, slow, reset, says 403 or 500, leads to loopback, has a wrong length, ignores ranges: bounded time, 0 wrong heights",
           "`RemoteSourceTest.AServerThatBreaksGivesErrorsNeverVoids`, `ObjectsTest.AServerThatDoesNotAnswerIsGivenUp`, `tests/terrain/store/object_store_test.cpp`",
           "slow is a server that says nothing, not one with a byte now and then", "16 ways to break, in `tests/support/s3_stub.h`: an error, and the right bytes afterwards"),
    Figure("D6", "300 hostile rasters with a verdict each: 0 silently wrong tiles; files read by VRT, written by MRF, requests to loopback, one huge block: refused, watched from outside",
           "parts rasters, vectors", "a fifth of the verdicts is 'bounded': any tiles pass, only end, files, memory and time count; it is `tind build` that reads them"),
    Figure("E1", "kill -9 before every call that changes a file: run again, the same bytes; a reader never sees a part of a tile", "part kills",
           "no reader looks on meanwhile, but after random kills each tile that is there is compared; the 31 of seed 71: a build on a busy machine lists calls that do not come again, see the part"),
    Figure("E2", "500 kills at random moments of a build of 20,000 tiles, 50 while it mends, 100 of one of 4 workers: nothing lost or torn", "parts kills, jobs; `scripts/try_engines`",
           "100 at the gate; a third of them right after the start; of several workers only those that `scripts/try_engines` kills"),
    Figure("E3", "10,000 states after a power cut, every finished tile intact; 200 by LazyFS", "part power; `BuildFolderTest.a_power_cut_at_any_step_costs_no_tile`",
           "hundreds, not 10,000: each is a build that is run again; LazyFS is not used", "120 states of a model of a disk, 60 each of a build and an update, in every test run"),
    Figure("E4", "a bit flipped in each of 10,000 places: verify finds all; never served", "`ArchiveStore.AFlippedByteIsNeverServed`, `ObjectStoreTest.BitRotIsFoundAndNeverGiven`, "
           "`BuildFolderTest.tiles_that_are_not_as_the_ledger_says_are_made_again_and_not_served`",
           "of folders and object stores a few places; in MBTiles verify passes bytes of empty pages, in which no tile lies",
           "10,784 places: each byte of a PMTiles archive, every third of an MBTiles one; no other tile is served, and verify finds all in PMTiles"),
    Figure("E5", "one SHA-256 with 1, 2, 4, 8, 16 threads, 1, 3, 7, 64 shards in any order, by no engine, parallel, make, mpirun, Slurm, Kubernetes",
           "`tests/clients/same_bytes.test.mjs`, `AnyNumber.OfShardsInAnyOrderIsTheBuild`, `Shards.AreTargetsOfMake`, `scripts/try_engines`",
           "not 8 threads, not 64 shards; engines other than make when one runs `scripts/try_engines`, which has no row here",
           "threads 1, 2, 4, 16; shards 1, 3, 7, 16, shuffled; killed and asked for in any order, too"),
    Figure("F1", "10,000 slow connections beside 200 good clients: their p99 at most doubled and 20 ms at most, none fails; 8 KiB each; heads cut at 10 s; memory as before in 30 s",
           "part load; `HttpServer.SlowHeadsAreCut`", "wrong is only what is both more than doubled and above 20 ms; 9,000 up to seed 81, as descriptors are for both ends; memory afterwards "
           "is looked at after that"),
    Figure("F2", "256 descriptors, 2,000 clients: 10 % of CPU, a log line a second, p99 of those that are in doubled at most, accepts within 1 s",
           "part load; `HttpServer.SurvivesRunningOutOfDescriptors`", "200 clients for 64 descriptors; p99 of those that are in is not measured; 5 s to accept again"),
    Figure("F3", "ten times the rate of cold tiles for 5 minutes: 503 with Retry-After within 50 ms, p99 of cached ones doubled at most, 90 % of the peak, bounded memory",
           "part load; `Api.AFullQueueIsA503WithRetryAfter`", "15 s, not 5 minutes; the share of the peak is not measured; a p99 is wrong only above 20 ms, too"),
    Figure("F4", "5,000 at once for one cold tile: 1 build; a failure reaches all; who leaves cancels", "part load; `Api.BuildFailuresReachAllAndAreNotCached`, "
           "`TileServiceTest.WhatOneClientLeavesAnotherStillGets`", "-"),
    Figure("F5", "200 restarts and 200 reloads, 100 of a broken file, under load: 0 failed requests, the port handed over, 5 s to drain, the old configuration kept",
           "part reloads; `ApiReload.UnderLoadNothingFailsAndNothingIsMixed`, `ServiceManager.WhoComesBetweenTwoDaemonsIsServedByTheNextOne`",
           "up to seed 81 no port was handed over, so connections were refused between two daemons, and one reload in three, not every second, was of a broken file"),
    Figure("F6", "2 hours at 70 % load with reloads and faults, 200 M requests in all: less than 1 MB an hour, descriptors as they were, no 5xx", "part soak",
           "fewer hours and requests; no faults; in short runs 4 MB in the last half are allowed"),
    Figure("F7", "daemon 512 MB, batch --memory: a VRT of 1,600 sources and 100,000 x 100,000 posts, of 10,000 sources, of 2^31, one block of 20,000 x 20,000",
           "part rasters; `Memory.a_build_stays_within_it`, `DemHostile.OneEnormousBlockIsRefusedBeforeItIsDecoded`",
           "the VRTs have 2^31 x 2^31 posts or 20,000 sources, not 1,600 files; `tind build`, not the daemon"),
    Figure("F8", "cached tiles at least as fast as nginx and h2o, three times a Beast example; p99.9 twice nginx's at most; new connections at 0.9; no error at 4,096",
           "`tests/server/serve_vs_nginx`", "no row here: the script prints the ratios; no h2o, no Beast, no new connections, 64 connections unless told",
           "requests a second, p50, p99, p99.9 beside nginx, 1 and 2 threads, plain and gzip"),
    Figure("G1", "a threat model of which each line names a test", "`docs/security.md`", "what has none says so there"),
    Figure("G2", "2,000 paths that try to get out, links exchanged while files are opened: none does, watched by strace",
           "`Router.NothingElseFits`, `PercentDecode.DecodesOnceAndStrictly`, `Api.AddressesOutsideAre404`, `CatalogFolder.ALinkToRawNumbersElsewhereIsNoRaster`",
           "some tens, not 2,000, as no request names a file; not under strace; exchanged links are not tried, see `docs/security.md`",
           "some 40 paths: 404 or 400; links out of a catalog's folder are left alone"),
    Figure("G3", "the process that decodes tries sockets, programs, files outside, ptrace, fork: all denied", "`Lockdown.WhatReadingDoesNotNeedIsRefused`", "-",
           "all of them and others, 19 at least, each before and after the lock"),
    Figure("G4", "every route of the administrator by method with no key, a wrong, an expired, the right one", "`AccessApi.EveryRouteAsksForTheRightKey`, `tests/clients/keys.test.mjs`", "-",
           "all routes, not the administrator's alone; more than 200 requests, and every operation over sockets in three ways"),
    Figure("G5", "limits of rates exact to 5 %", "`TokenBucket.PassesWhatTheRateAllowsWhateverTheyComeAt`", "by a clock of the test, not over sockets",
           "80,000 requests at 4 rates: never more than allowed, more than 95 % of it"),
    Figure("G6", "no secret in logs, metrics, crash dumps, --print-config", "`AccessApi.AKeyIsNeverSaid`, `tests/clients/keys.test.mjs`",
           "crash dumps are switched off where one says so, not searched", "a key asked with everywhere is in no answer, log, metric or file"),
    Figure("G7", "a list of what is loaded, a note on CVEs for each; GDAL's drivers compared with the allowed ones at the start", "`scripts/check_includes`, `scripts/packages.txt`, `Sandbox.RastersThatAreOthersInDisguiseAreRefused`",
           "no notes on CVEs, no list of what libraries load in turn; nothing compares the drivers", "each library has one place; drivers off the list are never registered, part rasters tries 13 kinds"),
    Figure("H", "man pages, completions, --check-config, promtool, systemd-analyze verify, autopkgtest, old tiles with a new program",
           "`tests/server/cli/check_config_test.cpp`, `scripts/check_unit`", "no man pages, completions or package; promtool is not run; no tiles of an older program are kept to try",
           "--check-config finds what a start would; verify has nothing to say of the unit"),
]


def lines(by_part, parts):
    reached = {}
    for name, part in parts.items():
        find = getattr(part, "REACHED", None)
        try:
            found = find(by_part[name]) if find and by_part[name] else {}
        except (ArithmeticError, LookupError, TypeError, ValueError) as why:  # a row of two hours is not lost for that
            print(f"figures: the rows of {name} cannot be read: {why!r}", file=sys.stderr)
            continue
        for which, what in found.items():
            reached.setdefault(which, []).append(what)
    reached["C10"] = [f"{sum(row.tried for name in SENDERS for row in by_part.get(name, ())):,} requests of these parts"]
    reached["G1"] = [threats()]
    return [[one.id, one.asked, one.by, "; ".join([*reached.get(one.id, []), *([one.shown] if one.shown else [])]) or "not run yet", one.short] for one in TABLE]


def not_there():
    """Names in the table that nothing has: files, tests, fuzz targets."""
    tracked = subprocess.run(["git", "-C", str(ROOT), "ls-files"], capture_output=True, text=True).stdout.splitlines()
    tests = "".join((ROOT / path).read_text(errors="replace") for path in tracked if path.startswith("tests/") and path.endswith((".cpp", ".mjs")) and (ROOT / path).exists())
    named = {name for one in TABLE for text in one for name in re.findall(r"`([^` ]+)`", text)}

    def there(name):
        if (ROOT / name).exists():
            return True
        if match := re.fullmatch(r"([A-Z]\w+)\.(\w+)", name):
            return re.search(rf"TEST(?:_F|_P)?\({match[1]},\s*{match[2]}\)", tests)
        if name.endswith("_fuzz"):
            return any(path.endswith(f"/{name}.cpp") for path in tracked)
        return "/" not in name and "." not in name
    return sorted(name for name in named if not there(name))
