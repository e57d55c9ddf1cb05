"""Parts that are scripts of their own: run, their last lines kept, their figures taken."""
import re
import subprocess

from .programme import ROOT


def run_script(run, words, count, seconds=None):
    """`count`: the pattern of the number that it says it has tried. True when it ended well."""
    try:
        done = subprocess.run([str(ROOT / "scripts" / words[0]), *map(str, words[1:])], capture_output=True, text=True, timeout=seconds)
    except subprocess.TimeoutExpired as late:
        run.note(f"stopped after {seconds:.0f} s")
        run.executions += len((late.stdout or b"").splitlines())
        return False
    found = [int(n.replace(",", "")) for n in re.findall(count, done.stdout, re.M)]
    run.executions += sum(found)
    last = (done.stdout.strip().splitlines() or ["nothing said"])[-1]
    run.note(last.replace(";", ","))
    if done.returncode:
        print(done.stdout + done.stderr, flush=True)  # all of it, for the log
        run.fail(f"{words[0]} ended with {done.returncode}: {(done.stdout + done.stderr).strip()[-600:]}")
    return done.returncode == 0
