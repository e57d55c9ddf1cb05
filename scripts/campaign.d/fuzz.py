"""Every fuzz target under libFuzzer with ASan and UBSan, from the corpus of the repository (scripts/fuzz)."""
import os
import re
import subprocess

from common import figures
from common.programme import ROOT

TIERS = ("gate", "campaign")
SECONDS = {"gate": 300}  # 20 s for each of thirty targets on two cores, and the build
ASKED = "C: every reader of outside bytes, 0 crashes; 100 M to 500 M inputs a target in the end; corpus of 5 MB at most"
WHY_NOT = ("as many inputs as the seconds given allow: up to seed 81 about 2.9 M of an average target, not 100 M, and of slow ones (dem_fuzz) far fewer; no AFL++, no fuzzer of the whole daemon over sockets, no model "
           "beside HTTP's parser; of a target that crashes nothing is counted; what was found before lies in build/fuzz/found and is begun with; in ctest the seeds and "
           "300 mutations of each are replayed, and none may take more memory than 1 MiB and 256 bytes for each of its own (a raster 96 MiB)")
# What the programme asks for together.
GROUPS = {"C1": ("request",), "C2": ("request",), "C3": ("query",), "C4": ("quantized_mesh", "btg", "tpm", "refine_delta", "png", "webp"),
          "C5": ("archive", "pmtiles", "record", "residual_record", "shard_plan", "layer_json"), "C6": ("bounded", "collapse"), "C8": ("toml",), "C9": ("dem", "zip_entry")}


def REACHED(rows):
    every, targets = sum(row.tried for row in rows), figures.numbers(r"(\d+) targets of (\d+) s", rows)
    whole = figures.numbers(r"(\d+) without a crash", rows)
    counted = [row for row in rows if "least to most" in row.result]
    average, corpus = f"{every / targets[-1][0] / 1e6:.1f} M", figures.numbers(r"corpus ([\d.]+) MB", rows)[-1][0]
    found = {"C": f"{every:,} inputs of {targets[-1][0]} targets, {average} each on average; corpus {corpus} MB; {targets[-1][0] - whole[-1][0]} targets crashed in the last row"}
    for group, names in GROUPS.items():
        inputs = sum(n for name in names for n, in figures.numbers(rf"\b{name}_fuzz ([\d,]+)", counted))
        found[group] = f"{inputs:,} inputs after seed 81, when targets are counted apart" if counted else f"not counted apart up to seed 81: {average} of an average target"
    return found


def run(run):
    targets = sorted(path.stem for path in ROOT.glob("tests/**/*_fuzz.cpp"))
    run.rng.shuffle(targets)
    each = max(5, int(run.seconds * os.cpu_count() / len(targets)))  # one runs on each core
    done = subprocess.run([ROOT / "scripts/fuzz", str(each), *targets], capture_output=True, text=True, env={**os.environ, "SEED": str(run.seed)})
    inputs = {name: int(n) for name, n in re.findall(r"^=== (\w+): .*\n(?:stat::.*\n)*?stat::number_of_executed_units: *(\d+)", done.stdout, re.M)}
    run.executions += sum(inputs.values())
    run.note(f"{len(targets)} targets of {each} s each, {len(inputs)} without a crash")
    run.note("inputs from least to most: " + ", ".join(f"{name} {n:,}" for n, name in sorted((n, name) for name, n in inputs.items())))
    size = sum(p.stat().st_size for p in (ROOT / "testdata/fuzz").rglob("*") if p.is_file())
    run.note(f"corpus {size / 1e6:.2f} MB")
    if size > 5e6:
        run.fail("the corpus is larger than 5 MB")
    for line in re.findall(r"fuzz: .*FAILED.*", done.stderr):
        run.fail(line)
    if done.returncode and not run.wrong:
        run.fail(done.stderr.strip()[-500:])
