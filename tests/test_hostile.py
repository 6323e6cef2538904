"""Hostile inputs: whatever is damaged, the command line accepts it or refuses it in one sentence, without an output.

`make fuzz` tries thousands of inputs. To add a kind of input, add a function to `KINDS`: it writes the input into a
folder and returns the words of the command. Outputs are named `out` or `out.*`.
"""

import contextlib
import io
import json
import os
import re
import resource
import shutil
import signal
import tempfile
import tomllib
from collections.abc import Callable, Iterator
from copy import deepcopy
from functools import partial
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from tests.cli.test_cli import run
from tests.log.readers.formats import WRITERS, synthetic_log

from stribeck.app.cli import console
from stribeck.app.cli.options import FORMATS
from stribeck.app.report import write_report
from stribeck.core.base.checked_table import flat
from stribeck.core.errors import StribeckError
from stribeck.core.friction import get_law
from stribeck.core.result import read_result
from stribeck.core.robot import Robot
from stribeck.core.settings import Settings
from stribeck.io.readers import read_log
from stribeck.io.writers import write_log
from stribeck.service.fleet.store import compact, key_of, time_of, write_row
from stribeck.service.fleet.worker import rows_of
from stribeck.simulation import truth_table
from stribeck.simulation.prescribed.exact import exact_log
from stribeck.simulation.sensors.measure import with_noise

EXAMPLES = max(6, settings.default.max_examples // 16)
"""Inputs per kind; the profile of `make fuzz` has more."""
SECONDS, MEMORY = 20.0, 4 << 30
"""Processor time [s] and additional memory [bytes] that one input may take."""
ODD = tomllib.loads((Path(__file__).parent / "hostile/values.toml").read_text())
NUMBERS, WORDS, VALUES = [*ODD["numbers"], "9" * 400], [*ODD["words"], "x" * 5000], [*ODD["values"], None]
CHECKED = ("npz", "parquet", "mcap", "mcap of ROS 1")
"""Formats whose checksums, as they are written here, cover all samples: other samples must never be read."""
(_, PIPE), (_, TERMINAL) = os.pipe(), os.openpty()
SAMPLES = (np.nan, np.inf, -np.inf, 1e300, -1e300, 1e-300, 5e-324, 0.0, 2.0**63, -1.0, 1e9, 1e5, 1e-5)
"""Values and factors of channels."""
Draw = Callable[..., Any]


@pytest.fixture(scope="module")
def seeds(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Make a folder with sound inputs: models, robot file, a log in every format, a result with its table, a store."""
    folder = tmp_path_factory.mktemp("seeds")
    shutil.copytree(Path(__file__).parent / "hostile", folder, dirs_exist_ok=True)
    robot = Robot.from_file(folder / "robot.toml")
    truth = {name: {"viscous": 0.2, "coulomb": 0.5, "offset": 0.1} for name in robot.joint_names}
    log = with_noise(exact_log(robot, get_law("coulomb-viscous"), truth, duration=8.0)[0], position=1e-5, torque=0.02)
    write_log(log.between(stop=1.0), folder / "log.npz")
    write_log(log, folder / "whole.npz")
    for name, write in WRITERS.items():
        (folder / "logs" / name).mkdir(parents=True)
        write(folder / "logs" / name, synthetic_log(200, joints=robot.joint_names))
    assert run("identify", folder / "whole.npz", "-r", folder / "robot.toml", "-o", folder / "saved", "--quiet") == 0
    watch = ["watch", folder / "saved", "-r", folder / "robot.toml", "--log", folder / "whole.npz", "--quiet"]
    assert run(*watch, "--state", folder / "state.json") == 0
    rows = rows_of(read_result(folder / "saved/result.json"))
    for name in ("R1", "R2"):
        about = {"key": key_of(name, "0"), "log": "log.npz", "sha256": name, "start": time_of(1.7e9), "note": ""}
        about |= {"finished": time_of(1.8e9), "version": "1.0", "status": "identified", "size": 1, "modified": 0.0}
        write_row(folder / "store", name, about | rows)
    compact(folder / "store")
    return folder


def damaged_channel(draw: Draw, values: Any) -> Any:
    """Overwrite, scale, hold, round or mix some samples of a channel; or convert or cut all of it."""
    if values.dtype.kind not in "bf":  # names
        long, numbers = np.repeat("x" * 3000, len(values)), np.arange(len(values))
        odd = [np.full_like(values, ""), long, numbers, values.astype(object)]
        return draw(st.sampled_from([values[:0], values[:1], *odd]))
    rows = draw(st.sampled_from([slice(None), slice(3, None, 7), slice(0, 1), slice(-50, None), slice(None, None, -1)]))
    sample, floats = draw(st.sampled_from(SAMPLES)), values.astype(float)
    with np.errstate(all="ignore"):
        part, kinds = floats[rows], [values.astype(kind) for kind in ("f2", "f4", "c16", "S9", "U9", "?", "O")]
        others = [np.full_like(part, sample), sample * part, 0 * part + part[:1], np.floor(5 * part) / 5]
        floats[rows] = draw(st.sampled_from([*others, 1e-9 * np.floor(5 * part), np.resize(SAMPLES, part.shape)]))
    cuts = [values[:0], values[:1], values[:-1], values[..., None], values.T, values[0]]
    return draw(st.sampled_from([*[floats] * 30, *kinds, *cuts]))


def damaged_bytes(draw: Draw, content: bytes) -> bytes:
    """Lose, double, insert, exchange or overwrite a part of some bytes."""
    places = st.integers(0, len(content)) | st.integers(0, min(512, len(content)))
    start, width = draw(places), draw(st.sampled_from([1, 2, 4, 8, 64, 4096]))
    inside, after = content[start : start + width], content[start + width :]
    changes = (b"", 2 * inside, inside[::-1], bytes(width), b"\xff" * width, inside + draw(st.binary(max_size=8)))
    return content[:start] + draw(st.sampled_from(changes)) + draw(st.sampled_from([after, after, b""]))


def damaged_text(draw: Draw, text: str) -> str:
    """Replace a number, a word, or what stands between quotes or tags."""
    pattern = draw(st.sampled_from([r"-?\d[\d.e+-]*", r'(?<=")[^"\n]*(?=")', r"(?<=>)[^<>]+(?=<)", r"\w+"]))
    places = list(re.finditer(pattern, text)) or [re.match("", text)]
    place = draw(st.sampled_from(places))
    return text[: place.start()] + draw(st.sampled_from([*NUMBERS, *WORDS])) + text[place.end() :]


def damaged_value(draw: Draw, document: Any) -> Any:
    """Lose, rename, exchange or replace one value of plain data, at any depth."""
    places, pending = [], [document]
    while pending:
        inner = pending.pop()
        keys = list(inner) if isinstance(inner, dict) else range(len(inner)) if isinstance(inner, list) else ()
        places += [(inner, key) for key in keys]
        pending += [inner[key] for key in keys]
    (holder, key), (other, place) = (draw(st.sampled_from(places)) for _ in range(2))
    change = draw(st.sampled_from(["lose", "rename", "exchange", "replace", "scale", "scale"]))
    if change == "lose":
        del holder[key]
    elif change == "rename" and isinstance(holder, dict):
        holder[draw(st.sampled_from(WORDS))] = holder.pop(key)
    elif change == "exchange":
        holder[key] = deepcopy(other[place])
    elif change == "scale" and isinstance(holder[key], int | float):
        holder[key] *= draw(st.sampled_from([0, -1, 1e6, 1e-9, 1e300, -1e300]))
    else:
        holder[key] = deepcopy(draw(st.sampled_from(VALUES)))
    return document


def damaged_xml(draw: Draw, text: str) -> str:
    """Lose, double, rename, nest or mix elements and attributes."""
    root = ElementTree.fromstring(text)
    parents = {child: parent for parent in root.iter() for child in parent}
    element, other = (draw(st.sampled_from(list(parents))) for _ in range(2))
    change = draw(st.sampled_from(["lose", "double", "tag", "mix", "nest", "value", "value"]))
    if change == "lose":
        parents[element].remove(element)
    elif change == "double":
        parents[element].append(element)
    elif change == "tag":
        element.tag = other.tag
    elif change == "mix":
        element.attrib.update(other.attrib)
    elif change == "nest":
        for _ in range(draw(st.sampled_from([1, 300]))):
            element = ElementTree.SubElement(element, element.tag, element.attrib)
    elif element.attrib:
        value = draw(st.sampled_from([*NUMBERS, *filter(str.isprintable, WORDS)]))
        element.set(draw(st.sampled_from(sorted(element.attrib))), value)
    return ElementTree.tostring(root, encoding="unicode")


def as_toml(document: Any, top: bool = True) -> str:
    """Write plain data as TOML; values that TOML lacks are written as in JSON."""
    if isinstance(document, dict):
        pairs = [f"{json.dumps(key)} = {as_toml(value, False)}" for key, value in document.items()]
        return "\n".join(pairs) if top else "{" + ", ".join(pairs) + "}"
    if isinstance(document, list):
        return "[" + ", ".join(as_toml(value, False) for value in document) + "]"
    return json.dumps(document)


def write_damaged(draw: Draw, text: str, path: Path) -> None:
    """Write a TOML, JSON or XML document that is damaged in up to three places, or nested deeply."""
    kind = draw(st.sampled_from(["bytes", "text", "structure", "structure", "deep"]))
    for _ in range(draw(st.integers(1, 3)) * (kind in ("text", "structure"))):
        if kind == "text":
            text = damaged_text(draw, text)
            continue
        with contextlib.suppress(ElementTree.ParseError, ValueError):
            match path.suffix:
                case ".toml":
                    text = as_toml(damaged_value(draw, tomllib.loads(text)))
                case ".json":
                    text = json.dumps(damaged_value(draw, json.loads(text)))
                case _:
                    text = damaged_xml(draw, text)
    if kind == "deep":
        inner = {".toml": "[{}]", ".json": '{{"a": {}}}'}.get(path.suffix, "<link>{}</link>").split("{}")
        depth = draw(st.sampled_from([50, 100_000]))
        text = inner[0].replace("{{", "{") * depth + "1" + inner[1].replace("}}", "}") * depth
        text = f"x = {text}" if path.suffix == ".toml" else text
    content = text.encode(errors="surrogatepass")
    path.write_bytes(damaged_bytes(draw, content) if kind == "bytes" else content)


def robot_file(draw: Draw, folder: Path, seeds: Path) -> list[object]:
    shutil.copy(seeds / "arm.urdf", folder)
    write_damaged(draw, (seeds / "robot.toml").read_text(), folder / "robot.toml")
    return ["inspect", seeds / "log.npz", "-r", "robot.toml"]


def model_file(draw: Draw, folder: Path, seeds: Path) -> list[object]:
    name = draw(st.sampled_from(["arm.urdf", "arm.xml", "actuators.xml", "actuators.xml"]))
    write_damaged(draw, (seeds / name).read_text(), folder / name)
    base = draw(st.sampled_from(["fixed", "floating"]))
    (folder / "robot.toml").write_text(f'[robot]\nmodel = "{name}"\nbase = "{base}"\ntorque_source = "command"\n')
    replay = ["replay", seeds / "log.npz", "-r", seeds / "robot.toml", "-m", name, "-o", "out"]
    export = ["export", seeds / "saved", "-r", "robot.toml", "-o", "out", "--to", draw(st.sampled_from([*FORMATS]))]
    init = ["init", name, *draw(st.sampled_from([[], [seeds / "log.npz"]])), "-o", "out.toml"]
    inspect = ["inspect", seeds / "log.npz", "-r", "robot.toml"]
    return draw(st.sampled_from([inspect, inspect, init, replay, export]))


def set_option(draw: Draw, folder: Path, seeds: Path) -> list[object]:
    for name in ("robot.toml", "arm.urdf"):
        shutil.copy(seeds / name, folder)
    key = draw(st.sampled_from([*flat(Settings()), *WORDS]))
    value = draw(st.sampled_from([*NUMBERS, *WORDS, *map(json.dumps, VALUES), "[" * 5000, "auto", "none", "fit"]))
    return ["inspect", seeds / "log.npz", "-r", "robot.toml", "--set", f"{key}={value}"]


def result_file(draw: Draw, folder: Path, seeds: Path) -> list[object]:
    write_damaged(draw, (seeds / "saved/result.json").read_text(), folder / "result.json")
    options = draw(st.sampled_from([["--include-weak"], ["--samples", "2"], ["--ranges"], ["--strict"]]))
    export = ["export", "result.json", "-r", seeds / "robot.toml", "-o", "out", "--to"]
    compare = ["compare", "result.json", *draw(st.sampled_from([[], [seeds / "saved"]]))]
    return draw(st.sampled_from([compare, compare, [*export, draw(st.sampled_from([*FORMATS])), *options]]))


def scenario_file(draw: Draw, folder: Path, seeds: Path) -> list[object]:
    write_damaged(draw, (seeds / "scenario.toml").read_text(), folder / "scenario.toml")
    return ["simulate", "scenario.toml", "-o", draw(st.sampled_from(["out.npz", "out", "out.csv"]))]


def store(draw: Draw, folder: Path, seeds: Path) -> list[object]:
    shutil.copytree(seeds / "store", folder / "store", symlinks=True)
    file = draw(st.sampled_from(sorted(folder.glob("store/robot=*/*.parquet"))))
    file.write_bytes(draw(st.sampled_from([damaged_bytes(draw, file.read_bytes()), b"", b"PAR1" * 40])))
    return draw(st.sampled_from([["trends", "store", "-o", "out"], ["fleet", "--compact", "store"]]))


def commands(seeds: Path) -> list[list[Any]]:
    """List sound commands with an output."""
    robot, log, result = ("-r", seeds / "robot.toml"), seeds / "log.npz", seeds / "saved"
    return [
        ["init", seeds / "arm.urdf", log, "-o", "out.toml"],
        ["inspect", log, *robot, "--from", "0.1", "--exclude", "0.1:0.2", "-o", "out.html"],
        ["identify", log, *robot, "-o", "out", "--method", "curve-fit", "--law", "stribeck"],
        ["convert", log, *robot, "-o", "out.npz"],
        ["export", result, *robot, "--to", "mjcf", "-o", "out", "--samples", "2", "--joints", "elbow"],
        ["compare", result, result, "--names", "a,b", "-o", "out.html"],
        ["plan", result, *robot, "--held", "x", "--joints", "elbow", "-o", "out"],
        ["fleet", "none.npz", *robot, "-o", "out", "--jobs", "1", "--timeout", "5"],
    ]


def command_line(draw: Draw, folder: Path, seeds: Path) -> list[object]:  # noqa: ARG001 - files are sound
    words = list(draw(st.sampled_from(commands(seeds))))
    place = draw(st.integers(1, len(words) - 1))
    values = [*NUMBERS, *(word for word in WORDS if "/" not in word and word.isprintable()), "--json", "-o", "1:2", ","]
    words[place : place + draw(st.integers(0, 1))] = [draw(st.sampled_from(values))][: draw(st.integers(0, 1))]
    return words


def damaged_log(name: str, draw: Draw, folder: Path, seeds: Path) -> list[object]:
    sound = next((seeds / "logs" / name).iterdir())
    path = folder / sound.name
    (shutil.copytree if sound.is_dir() else shutil.copy)(sound, path)
    file = draw(st.sampled_from(sorted(path.iterdir()))) if path.is_dir() else path
    if file.suffix in (".csv", ".yaml") and draw(st.booleans()):
        file.write_text(damaged_text(draw, file.read_text()), encoding="utf-8", errors="replace")
    else:
        file.write_bytes(damaged_bytes(draw, file.read_bytes()))
    return ["inspect", path.name, "-r", seeds / "robot.toml"]


def channels(draw: Draw, folder: Path, seeds: Path) -> list[object]:
    with np.load(seeds / draw(st.sampled_from(["log.npz", "whole.npz", "logs/npz/log.npz"]))) as sound:
        arrays = dict(sound)
    for name in draw(
        st.lists(st.sampled_from([name for name in arrays if arrays[name].ndim]), min_size=1, max_size=3, unique=True)
    ):
        arrays[name] = damaged_channel(draw, arrays[name])
    np.savez(folder / "log.npz", **arrays)
    robot = ["log.npz", "-r", seeds / "robot.toml"]
    identify = ["identify", *robot, "-o", "out", "--method", draw(st.sampled_from(["whole-log", "curve-fit"]))]
    others = (["init", seeds / "arm.urdf", "log.npz", "-o", "out.toml"], ["convert", *robot, "-o", "out.npz"])
    watch = ["watch", seeds / "saved", *robot[1:], "--log", "log.npz", "--json"]
    return draw(st.sampled_from([["inspect", *robot], identify, *others, watch]))


def stream(draw: Draw, folder: Path, seeds: Path) -> list[object]:
    """Damage a stream or a saved state of `watch`."""
    words, log = ["watch", seeds / "saved", "-r", seeds / "robot.toml", "--json"], (seeds / "logs/mcap/log.mcap")
    if draw(st.booleans()):
        (folder / "log.mcap").write_bytes(damaged_bytes(draw, log.read_bytes()))
        return [*words, "--mcap", "log.mcap"]
    write_damaged(draw, (seeds / "state.json").read_text(), folder / "state.json")
    return [*words, "--log", seeds / "log.npz", "--state", "state.json"]


def odd_output(draw: Draw, folder: Path, seeds: Path) -> list[object]:
    """Name a link, a pipe, a terminal, a folder, or a place below a file as the output."""
    words = [*draw(st.sampled_from(commands(seeds))), *draw(st.sampled_from([[], ["--overwrite"]]))]
    place = words.index("-o") + 1
    words[place] = words[place].replace("out", "odd")
    odd, kind = (
        folder / words[place],
        draw(st.sampled_from(["fifo", "folder", "below", "loop", "nowhere", "pipe", "tty", "file"])),
    )
    (folder / "target").touch()
    if kind == "fifo":
        os.mkfifo(odd)
    elif kind == "folder":
        odd.mkdir()
    elif kind == "below":
        odd.touch()
        words[place] += "/out"
    else:
        targets = {
            "loop": odd.name,
            "nowhere": "no/where",
            "pipe": f"/proc/self/fd/{PIPE}",
            "tty": os.ttyname(TERMINAL),
        }
        odd.symlink_to(targets.get(kind, "target"))
    return words


KINDS = {
    each.__name__: each
    for each in (
        *(robot_file, model_file, set_option, result_file, scenario_file, store, command_line),
        *(channels, stream, odd_output),
    )
} | {f"log {name}": partial(damaged_log, name) for name in WRITERS}


@contextlib.contextmanager
def limited() -> Iterator[tuple[io.StringIO, io.StringIO]]:
    """Limit processor time and memory; a violation ends the process or raises. Yield what is printed."""
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    before = resource.getrlimit(resource.RLIMIT_AS)
    said, shown = io.StringIO(), io.StringIO()
    resource.setrlimit(resource.RLIMIT_AS, (pages * resource.getpagesize() + MEMORY, before[1]))
    signal.setitimer(signal.ITIMER_PROF, SECONDS)
    try:
        wrong = np.errstate(all="raise", under="ignore")  # as NumPy warns
        with contextlib.redirect_stderr(said), contextlib.redirect_stdout(shown), wrong:
            yield said, shown
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        resource.setrlimit(resource.RLIMIT_AS, before)


def entries(folder: Path) -> dict[str, int]:
    """Map the names in a folder to the entries of the file system."""
    return {path.name: path.lstat().st_ino for path in folder.iterdir()}


def untidy(code: int, said: str, changed: bool) -> bool:
    """Tell whether an input was neither accepted, nor refused in one sentence and without an output."""
    sentence = re.fullmatch(r"(stribeck: note: .*\n)*stribeck: .+\n", said) or said.startswith(("Usage: ", "Error: "))
    if code == 3 and not said and changed:  # of a fleet, whose store has a row for each log without a result
        return False
    return bool(said) if code == 0 else code not in (2, 3) or not sentence or changed


@pytest.mark.parametrize("kind", KINDS)
@settings(max_examples=EXAMPLES, suppress_health_check=list(HealthCheck))
@given(data=st.data())
def test_a_hostile_input_is_accepted_or_refused_in_one_sentence(kind: str, seeds: Path, data: st.DataObject) -> None:
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        words = KINDS[kind](data.draw, folder, seeds)
        words = [str(word).replace("\0", "").encode(errors="replace").decode() for word in words]
        before = entries(folder)
        with contextlib.chdir(folder), limited() as (said, shown):
            code = run(*words)
        assert not untidy(code, said.getvalue(), entries(folder) != before), (words, said.getvalue())
        text, decoder = shown.getvalue() * ("--json" in words), json.JSONDecoder(parse_constant=pytest.fail)
        while text := text.lstrip():  # one or several values
            text = text[decoder.raw_decode(text)[1] :]
        name = kind.removeprefix("log ")
        if code == 0 and name in CHECKED:
            robot = Robot.from_file(seeds / "robot.toml")
            written, read = (read_log(each / words[1], robot).channels() for each in (seeds / "logs" / name, folder))
            for channel, values in read.items():
                np.testing.assert_array_equal(values, written[channel])


@settings(max_examples=EXAMPLES, suppress_health_check=list(HealthCheck))
@given(data=st.data())
def test_a_hostile_result_is_reported_and_printed_or_refused(seeds: Path, data: st.DataObject) -> None:
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        shutil.copy(seeds / "saved/friction_torque.parquet", folder)
        document = json.loads((seeds / "saved/result.json").read_text())
        for _ in range(data.draw(st.integers(1, 3))):
            document = damaged_value(data.draw, document)
        (folder / "result.json").write_text(json.dumps(document), encoding="utf-8", errors="replace")
        with limited(), contextlib.suppress(StribeckError):
            result = read_result(folder / "result.json")
            console.print_result(result)
            truth = {name: dict.fromkeys(own.parameters, 1.0) for name, own in result.joints.items()}
            console.print_table(truth_table(result, truth))
            write_report(folder / "result.json", folder / "out.html")
            assert "</html>" in (folder / "out.html").read_text(encoding="utf-8")


STAMPS = {
    "none": np.zeros(0),
    "subnormal": 5e-324 * np.arange(50),
    "infinite": np.where(np.arange(50) % 7 == 3, np.inf, 0.01 * np.arange(50)),
    "steps": np.repeat(np.arange(5.0), 10),
    "there and back": np.repeat([0.0, 1.0, 0.0], [20, 10, 20]),
}


@pytest.mark.parametrize("case", STAMPS)
def test_a_robot_file_is_drafted_whatever_the_stamps(case: str, seeds: Path, tmp_path: Path) -> None:
    signal = np.outer(np.sin(np.arange(len(STAMPS[case]))), [1.0, 2.0])
    np.savez(tmp_path / "log.npz", time=STAMPS[case], position=signal, torque=signal, joint_names=["shoulder", "elbow"])
    with limited() as (said, _):
        assert run("init", seeds / "arm.urdf", tmp_path / "log.npz", "-o", tmp_path / "out.toml", "--quiet") == 0
    assert said.getvalue() == ""
