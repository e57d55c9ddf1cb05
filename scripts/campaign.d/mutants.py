"""Mistakes put into parsers, the checker and the certificate, one at a time: do the tests notice?"""
import concurrent.futures
import itertools
import os
import re
import subprocess
from pathlib import Path

from common import figures, programme
from common.programme import ROOT

TIERS = ("campaign",)
ASKED = "A4: of 500 seeded mutants in the parsers, the checker and the certificate at least 80 % are noticed"
WHY_NOT = ("as many as the seconds allow, of six files: up to seed 52 304 in three runs together, not 500 in one; mutants that change nothing one could see (equivalent ones) count as not "
           "noticed")
BUILD = ROOT / "build/release"
# source: the test program that holds it, and which of its tests
TARGETS = {"server/http/message/request_parser.cpp": ("server_http_test", "RequestParser.*:ValidAuthority.*"),
           "proto/tile/quantized_mesh.cpp": ("proto_tile_test", "*"),
           "proto/tile/layer_json.cpp": ("proto_tile_test", "*"),
           "proto/tile/pmtiles.cpp": ("proto_tile_test", "*"),
           "terrain/check/check_decode.cpp": ("terrain_check_test", "*"),
           "terrain/mesh/vertical_error.cpp": ("terrain_mesh_test", "*Error*")}
SWAPS = [(r" < ", " <= "), (r" <= ", " < "), (r" > ", " >= "), (r" >= ", " > "), (r" == ", " != "), (r" != ", " == "), (r" && ", " || "), (r" \|\| ", " && "),
         (r" \+ ", " - "), (r" - ", " + "), (r" \+ 1\b", " + 2"), (r"\btrue\b", "false"), (r"\bfalse\b", "true"), (r"\+\+(\w)", r"--\1"), (r"\b(\d+)\b", lambda m: str(int(m[1]) + 1)),
         (r"^(\s*)if \(.*\) return .*;$", r"\1;"), (r" \* ", " + "), (r"!(\w)", r"\1"), (r"std::min", "std::max"), (r"std::max", "std::min")]


def REACHED(rows):
    of_files = [figures.numbers(r"(\S+\.cpp) (\d+) of (\d+)", [row]) for row in rows if ".cpp" in row.result]
    noticed, tried = (sum(one[k] for files in of_files for one in files) for k in (1, 2))
    least = min((one for one in of_files[-1] if one[2]), key=lambda one: one[1] / one[2])
    return {"A4": f"{noticed:,} of {tried:,} noticed ({figures.percent(noticed / tried)}) in {len(of_files)} rows together, {sum(n for _, n, _ in of_files[-1])} of {sum(n for *_, n in of_files[-1])} in the "
                  f"last; of its files least: {least[0].split('/')[-1]}, {least[1]} of {least[2]}"}


def mutants(text):
    """(line number, new line) of all mistakes that could be made."""
    found = []
    for number, line in enumerate(text.splitlines()):
        code = line.split("//")[0]
        if code.lstrip().startswith(("#", "/", "*", "namespace", "static_assert", "assert", "template")) or '"' in code or not code.strip():
            continue
        for pattern, by in SWAPS:
            for match in re.finditer(pattern, code):
                changed = code[:match.start()] + re.sub(pattern, by, match[0], count=1) + code[match.end():]
                if changed != code:
                    found.append((number, changed))
    return found


def commands(target):
    said = subprocess.run(["ninja", "-C", str(BUILD), "-t", "commands", target], capture_output=True, text=True, check=True).stdout
    return said.splitlines()


def unit_of(source, lines):
    """What the compiler is given for a source: itself, or, with TIND_UNITY, a file that includes it and its neighbours."""
    units = [Path(line.rsplit(" -c ", 1)[1]) for line in lines if " -c " in line]
    if ROOT / source in units:
        return ROOT / source
    return next(unit for unit in units if "unity" in unit.parts and f'#include "{source}"' in unit.read_text())


class Bench:
    """Compiles one changed source and links the test program with it in front of the libraries. Several may at a time."""

    def __init__(self, run, source, program):
        self.folder, self.count = run.work, itertools.count()
        lines = commands(f"tests/{program}")
        unit = unit_of(source, lines)
        compile_line = next(line for line in lines if line.endswith(f" -c {unit}"))
        # Without optimization: it is run for a second. With assertions: what they find is noticed.
        compile_line = re.sub(r"-MD -MT \S+ -MF \S+|-DNDEBUG", "", compile_line).replace("_FORTIFY_SOURCE=2", "_FORTIFY_SOURCE=0")
        self.compile = re.sub(r" -o \S+ -c \S+$", " -O0 -o {0} -c {1}", compile_line)
        self.link = lines[-1].replace(f"-o tests/{program} ", "-o {0} {0}.o " + " ".join(self.neighbours(unit, source)) + " ")

    def neighbours(self, unit, source):
        """The objects of what a unit includes beside the source, each compiled once, so that a mutant is one file's work."""
        if unit == ROOT / source:
            return []
        others = [name for name in re.findall(r'#include "(.*)"', unit.read_text()) if name != source]
        objects = [self.folder / (name.replace("/", "_") + ".o") for name in others]
        with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
            for done in pool.map(lambda pair: subprocess.run(self.compile.format(pair[0], ROOT / pair[1]), shell=True, cwd=BUILD, capture_output=True, text=True),
                                 zip(objects, others)):
                if done.returncode:
                    raise RuntimeError(done.stderr[-500:])
        return [str(path) for path in objects]

    def notices(self, text, tests):
        """None where it does not compile."""
        mutant = self.folder / f"mutant{next(self.count)}"
        Path(f"{mutant}.cpp").write_text(text)
        try:
            if subprocess.run(self.compile.format(f"{mutant}.o", f"{mutant}.cpp"), shell=True, cwd=BUILD, capture_output=True).returncode:
                return None
            subprocess.run(self.link.format(mutant), shell=True, cwd=BUILD, capture_output=True, check=True)
            return subprocess.run([mutant, f"--gtest_filter={tests}", "--gtest_fail_fast"], cwd=BUILD, capture_output=True, timeout=120).returncode != 0
        except subprocess.TimeoutExpired:
            return True
        finally:
            for left in (mutant, Path(f"{mutant}.o"), Path(f"{mutant}.cpp")):
                left.unlink(missing_ok=True)


def run(run):
    programme.needs("ninja", "g++")
    noticed_in_all = 0
    for left, (source, (program, tests)) in zip(range(len(TARGETS), 0, -1), TARGETS.items()):
        if run.only not in source:
            continue
        if not (BUILD / "tests" / program).exists():
            run.note(f"{source}: build {program} first")
            continue
        bench, text = Bench(run, source, program), (ROOT / source).read_text()
        if bench.notices(text, tests):
            run.fail(f"{source}: the tests fail without a mistake")
            continue
        every, end = mutants(text), run.time_left() - run.time_left() / left
        run.rng.shuffle(every)

        def verdict(one):
            number, line = one
            if run.time_left() < end:
                return None
            lines = text.splitlines()
            lines[number] = line
            return bench.notices("\n".join(lines) + "\n", tests)
        with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
            verdicts = [(one, v) for one, v in zip(every, pool.map(verdict, every)) if v is not None]
        missed = [one for one, noticed in verdicts if not noticed]
        run.executions += len(verdicts)
        for number, line in missed:
            print(f"  not noticed: {source}:{number + 1}: {line.strip()}")
        noticed = len(verdicts) - len(missed)
        noticed_in_all += noticed
        run.note(f"{source} {noticed} of {len(verdicts)}")
        if len(verdicts) >= 10 and noticed < 0.8 * len(verdicts):
            run.fail(f"{source}: {noticed} of {len(verdicts)} noticed")
    run.note(f"{noticed_in_all} of {run.executions} noticed")
