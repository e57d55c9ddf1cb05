"""Mistakes put into parsers, the checker and the certificate, one at a time: do the tests notice?"""
import re
import subprocess

from common import programme
from common.programme import ROOT

TIERS = ("campaign",)
ASKED = "A4: of 500 seeded mutants in the parsers, the checker and the certificate at least 80 % are noticed"
WHY_NOT = "mutants that change nothing one could see (equivalent ones) count as not noticed"
BUILD = ROOT / "build/release"
# source: the test program that holds it, and which of its tests
TARGETS = {"server/http/message/request_parser.cpp": ("server_http_test", "RequestParser.*"),
           "proto/tile/quantized_mesh.cpp": ("proto_tile_test", "*"),
           "proto/tile/layer_json.cpp": ("proto_tile_test", "*"),
           "proto/tile/pmtiles.cpp": ("proto_tile_test", "*"),
           "terrain/check/check_decode.cpp": ("terrain_check_test", "*"),
           "terrain/mesh/vertical_error.cpp": ("terrain_mesh_test", "*Error*")}
SWAPS = [(r" < ", " <= "), (r" <= ", " < "), (r" > ", " >= "), (r" >= ", " > "), (r" == ", " != "), (r" != ", " == "), (r" && ", " || "), (r" \|\| ", " && "),
         (r" \+ ", " - "), (r" - ", " + "), (r" \+ 1\b", " + 2"), (r"\btrue\b", "false"), (r"\bfalse\b", "true"), (r"\+\+(\w)", r"--\1"), (r"\b(\d+)\b", lambda m: str(int(m[1]) + 1)),
         (r"^(\s*)if \(.*\) return .*;$", r"\1;"), (r" \* ", " + "), (r"!(\w)", r"\1"), (r"std::min", "std::max"), (r"std::max", "std::min")]


def mutants(text):
    """(line number, new line) of all mistakes that could be made."""
    found = []
    for number, line in enumerate(text.splitlines()):
        code = line.split("//")[0]
        if code.lstrip().startswith(("#", "/", "*", "namespace", "static_assert", "template")) or '"' in code or not code.strip():
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


class Bench:
    """Compiles one changed source and links the test program with it in front of the libraries."""

    def __init__(self, run, source, program):
        self.folder, self.source = run.work, ROOT / source
        lines = commands(f"tests/{program}")
        self.compile = next(line for line in lines if line.endswith(f" -c {self.source}"))
        self.link = lines[-1].replace(f"-o tests/{program} ", f"-o {self.folder}/mutant {self.folder}/mutant.o ")
        # It stands in its own folder, so that its includes are found.
        self.compile = re.sub(r"-MD -MT \S+ -MF \S+", "", self.compile)
        self.compile = re.sub(r"-o \S+ -c \S+$", f"-o {self.folder}/mutant.o -c {self.folder}/mutant.cpp", self.compile)

    def notices(self, text, tests):
        """None where it does not compile."""
        (self.folder / "mutant.cpp").write_text(text)
        if subprocess.run(self.compile, shell=True, cwd=BUILD, capture_output=True).returncode:
            return None
        subprocess.run(self.link, shell=True, cwd=BUILD, capture_output=True, check=True)
        try:
            return subprocess.run([self.folder / "mutant", f"--gtest_filter={tests}", "--gtest_fail_fast"], cwd=BUILD, capture_output=True, timeout=120).returncode != 0
        except subprocess.TimeoutExpired:
            return True


def run(run):
    programme.needs("ninja", "g++")
    for source, (program, tests) in TARGETS.items():
        if run.only not in source:
            continue
        if not (BUILD / "tests" / program).exists():
            run.note(f"{source}: build {program} first")
            continue
        bench, text = Bench(run, source, program), (ROOT / source).read_text()
        if bench.notices(text, tests):
            run.fail(f"{source}: the tests fail without a mistake")
            continue
        every, end = mutants(text), run.time_left() - run.time_left() / len(TARGETS)
        run.rng.shuffle(every)
        noticed, missed = 0, []
        for number, line in every:
            if run.time_left() < end:
                break
            lines = text.splitlines()
            lines[number] = line
            verdict = bench.notices("\n".join(lines) + "\n", tests)
            if verdict is None:
                continue
            run.executions += 1
            noticed += verdict
            if not verdict:
                missed.append(f"{number + 1}: {line.strip()}")
        tried = noticed + len(missed)
        for one in missed:
            print(f"  not noticed: {source}:{one}")
        run.note(f"{source} {noticed} of {tried}")
        if tried >= 10 and noticed < 0.8 * tried:
            run.fail(f"{source}: {noticed} of {tried} noticed")
