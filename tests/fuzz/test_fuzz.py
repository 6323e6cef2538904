"""A few inputs that are wrong at random, of every kind; `make fuzz` tries thousands."""

import json
import subprocess
import sys

from tests.fuzz.kinds import KINDS

PER_KIND = 8
BEHAVIOURS = """
import ctypes, json, sys, tempfile, time
from pathlib import Path
import tests.fuzz.attempt as fuzzing
from tests.fuzz.kinds import KINDS, Kind

def ends(words, code):
    print(*words, sep="\\n", file=sys.stderr)
    sys.exit(code)

def leaves_an_output():
    Path("out").mkdir()
    ends(["stribeck: it is wrong"], 2)

def asks_for_memory():
    return bytearray(1 << 40)

behaviours = {
    "accepted": [lambda: None],
    "refused": [lambda: ends(["stribeck: it is wrong"], 2), lambda: ends(["stribeck: note: odd", "stribeck: none"], 3)],
    "untidy": [lambda: ends(["no"], 2), lambda: ends([], 2), lambda: ends(["stribeck: a", "b"], 2), leaves_an_output],
    "traceback": [lambda: 1 / 0, lambda: ends(["?"], 1), asks_for_memory],
    "hang": [lambda: time.sleep(60), lambda: sum(iter(int, 1))],
    "crash": [lambda: ctypes.string_at(0)],
}
fuzzing.TIMEOUT, fuzzing.WAITING = 0.5, 5.0
KINDS["any"] = Kind(lambda *_: [], 1.0)
found = {}
for outcome, actions in behaviours.items():
    found[outcome] = []
    for action in actions:
        fuzzing.main = action
        found[outcome].append(fuzzing.attempt("any", 0, 0, Path()).outcome)
print(json.dumps(found))
"""


def run(*arguments):
    return subprocess.run([sys.executable, *arguments], capture_output=True, text=True, timeout=300)


def test_no_wrong_input_breaks_the_command_line():
    done = run("-m", "tests.fuzz", "--seed", "1", "--inputs", str(PER_KIND * len(KINDS)))
    assert done.returncode == 0, done.stdout + done.stderr
    rows = {words[0]: words[1:] for words in map(str.split, done.stdout.splitlines())}
    for kind in KINDS:
        inputs, accepted, refused, *broken, _ = map(int, rows[kind])
        assert inputs == accepted + refused > 0
        assert refused > 0 or kind.startswith("run")  # sound inputs, whose runs are disturbed
        assert broken == [0] * 5


def test_what_breaks_is_seen():
    done = run("-c", BEHAVIOURS)
    assert done.returncode == 0, done.stderr
    for outcome, found in json.loads(done.stdout).items():
        assert set(found) == {outcome}
