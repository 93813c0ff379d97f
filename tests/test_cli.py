"""The command line end to end: exit codes, one clear message, clean JSON, nothing half-written."""

from __future__ import annotations

import codecs
import json
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from cyclopts import CycloptsError, UnknownOptionError

from ringbalance import __version__, cli, streams
from ringbalance.commands import COMMANDS, ShellCommand
from ringbalance.running import TARGETS
from ringbalance.scene import Fault, SceneError, bundled_scene
from ringbalance.scene.narrowing import LIQUID_RING_ALONE

ROOT = Path(__file__).parents[1]
PAPER = str(bundled_scene("liquid_ring_paper"))
DRIVEN = str(bundled_scene("driven_masses_small"))
LAUNCH = [sys.executable, "-c", "import sys; from ringbalance.cli import main; sys.exit(main())"]

# A shell's background job is started with interrupts ignored, and its children inherit that.
READY = """
import signal, sys
from ringbalance.cli import main
signal.signal(signal.SIGINT, signal.default_int_handler)
print("ready", flush=True)
sys.exit(main())
"""
AT_WORK = """
import signal, sys
from ringbalance.cli import main
from ringbalance.reports import report
signal.signal(signal.SIGINT, signal.default_int_handler)
collect = report.collect_evidence
def begin(*given, **named):
    print("ready", flush=True)
    return collect(*given, **named)
report.collect_evidence = begin
sys.exit(main())
"""

Finished = subprocess.CompletedProcess[str]
Run = Callable[..., Finished]


def run(*words: str | Path) -> Finished:
    """One command line in a process of its own."""
    return subprocess.run(
        [*LAUNCH, *map(str, words)], capture_output=True, text=True, check=False, timeout=120
    )


@pytest.fixture
def run_in_process(capsys: pytest.CaptureFixture[str]) -> Run:
    """One command line in this process, which has loaded everything already."""

    def run_here(*words: str | Path) -> Finished:
        capsys.readouterr()
        code = cli.main([*map(str, words)])
        return Finished(words, code, *capsys.readouterr())

    return run_here


def assert_bad_input(finished: Finished, *messages: str) -> None:
    """Exit code 2, nothing on standard output, no traceback, and the words that tell what is wrong."""
    assert finished.returncode == 2
    assert finished.stdout == ""
    assert "Traceback" not in finished.stderr
    for word in messages:
        assert word in finished.stderr


@pytest.fixture
def broken_scene(tmp_path: Path) -> Path:
    """The paper's scene with three faults in it."""
    text = Path(PAPER).read_text()
    for old, new in [
        ("outer_radius", "outer_radiuss"),
        ('"10000 rpm"', '"10000 furlongs"'),
        ("chambers = 4", "chambers = 3"),
    ]:
        assert old in text
        text = text.replace(old, new, 1)
    path = tmp_path / "broken.toml"
    path.write_text(text)
    return path


@pytest.mark.parametrize(
    ("words", "messages"),
    [
        (["reprt"], ["reprt", '"report"']),
        (["calibrate", PAPER, "--jsn"], ["--jsn", "--json"]),
        (["calibrate"], ["SCENE is missing: ringbalance calibrate SCENE"]),
        (["compare", "a.toml"], ["SECOND is missing: ringbalance compare FIRST SECOND"]),
        (["verify", "--level", "extreme"], ["extreme", "light", "heavy"]),
        (["verify", "no_such_case"], ["no_such_case"]),
        (["simulate", PAPER, "--law", "no_such_law.json"], ["no_such_law.json"]),
        (["calibrate", "no_such_scene.toml"], ["no_such_scene.toml"]),
        (["calibrate", f"{PAPER}/"], [f"{PAPER}/ is a file, not a folder"]),
        (["sweep", PAPER, "--vary", "tube.bore=1mm,2mm", "--out", "a\nb"], ["--out", "control character"]),
        (["sweep", PAPER, "--vary", "tube.bore=1mm,2mm", "--out", "o", "--write"], ["--write", "at least 1"]),
    ],
)
def test_wrong_usage(words: list[str], messages: list[str], run_in_process: Run) -> None:
    assert_bad_input(run_in_process(*words), *messages)


@pytest.mark.parametrize("command", ["calibrate", "simulate", "report", "plot"])
def test_a_broken_scene_is_reported_in_one_message(
    command: str, broken_scene: Path, tmp_path: Path, run_in_process: Run
) -> None:
    more: list[str | Path] = ["--out", tmp_path / "out"] if command in {"report", "plot"} else []
    finished = run_in_process(command, broken_scene, *more)
    assert_bad_input(finished, "broken.toml", "outer_radiuss", "outer_radius", "furlongs", "chambers = 3")
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("words", [["reprt"], ["calibrate"], ["verify", "no_such_case"], ["calibrate", None]])
def test_a_process_ends_as_its_command_does(
    words: list[Any], broken_scene: Path, run_in_process: Run
) -> None:
    command_line = [word or broken_scene for word in words]
    finished, expected = run(*command_line), run_in_process(*command_line)
    assert (finished.returncode, finished.stdout, finished.stderr) == (2, "", expected.stderr)
    assert expected.returncode == 2


def test_the_list_of_cases_is_clean_json(run_in_process: Run) -> None:
    finished = run_in_process("verify", "--list", "--json")
    assert finished.returncode == 0
    assert {"id", "kind"} <= set(json.loads(finished.stdout)[0])


@pytest.mark.parametrize("words", [["calibrate", PAPER, "--save"], ["plot", PAPER, "--out"]])
def test_a_file_where_a_folder_should_be(words: list[str], tmp_path: Path, run_in_process: Run) -> None:
    (tmp_path / "in_the_way").touch()
    finished = run_in_process(*words, tmp_path / "in_the_way" / "law.json")
    assert finished.returncode == 2
    assert "Traceback" not in finished.stderr
    assert "in_the_way" in finished.stderr


@pytest.mark.parametrize(("program", "delay"), [(READY, 0.2), (AT_WORK, 1.0)], ids=["loading", "at work"])
def test_an_interrupted_report_leaves_nothing_half_written(
    tmp_path: Path, program: str, delay: float
) -> None:
    """Interrupted while modules are loaded, and in the middle of the work."""
    command = [sys.executable, "-c", program, "report", PAPER, "--out", str(tmp_path / "out")]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as child:
        assert child.stdout is not None
        child.stdout.readline()
        time.sleep(delay)
        assert child.poll() is None
        child.send_signal(signal.SIGINT)
        _, messages = child.communicate(timeout=60)
    assert child.returncode == 130
    assert "Traceback" not in messages
    assert not (tmp_path / "out" / "report.html").exists()
    assert [path for path in tmp_path.rglob(".*") if path.is_file()] == []


def test_a_reader_that_goes_away_is_no_error() -> None:
    command = [*LAUNCH, "verify", "--list", "--json"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as child:
        assert child.stdout is not None
        assert child.stderr is not None
        child.stdout.close()
        assert child.stderr.read() == b""
    assert child.returncode == 141


@pytest.fixture
def command(monkeypatch: pytest.MonkeyPatch) -> Callable[[BaseException | int], int]:
    """Runs a command that gives back a number or raises."""

    def run_it(outcome: BaseException | int) -> int:
        def act(_: object) -> int:
            if isinstance(outcome, BaseException):
                raise outcome
            return outcome

        module = ModuleType("acting_command")
        module.act = act  # type: ignore[attr-defined]
        monkeypatch.setitem(sys.modules, "acting_command", module)
        monkeypatch.setitem(COMMANDS, "act", ShellCommand("acts", {}))
        monkeypatch.setitem(TARGETS, "act", "acting_command:act")
        return cli.main(["act"])

    return run_it


def fault(key: str) -> Fault:
    return Fault(
        file="a.toml", table="disc", key=key, value='"1 mm"', problem="too small", allowed="above 2 mm"
    )


@pytest.mark.parametrize("code", [0, 1])
def test_a_command_s_exit_code_is_passed_on(command: Callable[[BaseException | int], int], code: int) -> None:
    assert command(code) == code


def test_every_fault_stands_on_its_line(
    command: Callable[[BaseException | int], int], capsys: pytest.CaptureFixture[str]
) -> None:
    assert command(SceneError((fault("bore"), fault("length")))) == 2
    messages = capsys.readouterr()
    assert messages.out == ""
    assert len(messages.err.strip().splitlines()) == 2


@pytest.mark.parametrize(
    ("outcome", "code", "messages"),
    [
        (KeyboardInterrupt(), 130, "interrupted"),
        (PermissionError(13, "Permission denied", "law.json"), 2, "law.json"),
        (OSError(28, "No space left on device"), 2, "No space left on device (in act"),
    ],
)
def test_what_ends_a_command_is_said(
    command: Callable[[BaseException | int], int],
    outcome: BaseException,
    code: int,
    messages: str,
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert command(outcome) == code
    assert messages in capsys.readouterr().err


def test_a_fault_of_the_program_is_not_hidden(command: Callable[[BaseException | int], int]) -> None:
    with pytest.raises(ZeroDivisionError):
        command(ZeroDivisionError())


def test_the_package_runs_as_a_module() -> None:
    command = [sys.executable, "-m", "ringbalance", "--version"]
    printed = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    assert printed.strip() == __version__


@pytest.mark.parametrize(
    ("text", "encoding", "written"),
    [
        ("λ ± 3 µm", "ascii", "lambda +/- 3 um"),
        ("λ ± 3 µm", "cp1252", "lambda ± 3 µm"),
        ("ρω²", "ascii", "rho omega^2"),
        ("10⁻⁹ m²", "ascii", "10^-9 m^2"),
        ("90°, 20 ℃, −1 – 2", "ascii", "90deg, 20 degC, -1 - 2"),
        ("λₘ ≤ √2 · Ω", "ascii", "lambda_m <= sqrt2 * Omega"),
        ("▁▃█ Kä漢", "ascii", "138 Ka?"),
    ],
)
def test_characters_that_an_encoding_lacks_are_replaced(text: str, encoding: str, written: str) -> None:
    codecs.register_error(streams.ERRORS, streams.in_ascii)
    assert text.encode(encoding, streams.ERRORS).decode(encoding) == written


def test_an_interrupt_while_the_command_is_loaded_ends_it_in_silence() -> None:
    code = """
import runpy, sys

class Interrupted:
    def find_spec(self, name, *_):
        if name == "ringbalance.cli":
            raise KeyboardInterrupt

sys.meta_path.insert(0, Interrupted())
runpy.run_module("ringbalance", run_name="__main__")
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "")


def test_brief_prints_a_title_main_numbers_and_the_verdict(run_in_process: Run) -> None:
    full, brief = run_in_process("calibrate", PAPER), run_in_process("calibrate", "--brief", PAPER)
    assert brief.returncode == 0
    assert brief.stdout.splitlines()[0] == full.stdout.splitlines()[0]
    assert len(brief.stdout.splitlines()) <= 7 < len(full.stdout.splitlines())
    assert "lambda per transferred mass" in brief.stdout
    assert "usable moment in any direction" in brief.stdout


def test_quiet_silences_messages_and_not_errors(run_in_process: Run, tmp_path: Path) -> None:
    law = tmp_path / "law.json"
    assert str(law) in run_in_process("calibrate", PAPER, "--save", law).stderr
    assert run_in_process("calibrate", PAPER, "--save", law, "--quiet").stderr == ""
    assert_bad_input(run_in_process("--quiet", "calibrate", "absent.toml"), "absent.toml")


def test_a_log_has_command_lines_messages_and_errors_with_their_times(
    run_in_process: Run, tmp_path: Path
) -> None:
    log, law = tmp_path / "log.txt", tmp_path / "law.json"
    run_in_process("calibrate", PAPER, "--save", law, "--log", log, "--quiet")
    run_in_process("calibrate", "absent.toml", "--log", log)
    lines = log.read_text(encoding="utf-8").splitlines()
    assert all(re.match(r"\d{4}-\d\d-\d\d \d\d:\d\d:\d\d,\d{3} (INFO|ERROR) ", line) for line in lines)
    assert [line for line in lines if f"law written to {law}" in line]
    assert [line for line in lines if " ERROR absent.toml" in line]
    assert len([line for line in lines if re.search(r"INFO ringbalance [\d.]+ calibrate ", line)]) == 2


def test_a_log_that_cannot_be_written_is_refused(run_in_process: Run, tmp_path: Path) -> None:
    assert_bad_input(run_in_process("calibrate", PAPER, "--log", tmp_path / "absent" / "log.txt"), "log.txt")


@pytest.mark.parametrize("name", COMMANDS)
def test_help_has_an_example_and_the_exit_codes_of_its_command(run_in_process: Run, name: str) -> None:
    shown = " ".join(run_in_process(name, "--help").stdout.split())
    assert f"Example: ringbalance {name}" in shown
    assert ("0 done; 1 " in shown) == bool(COMMANDS[name].failure)
    assert "Commands, exit codes and JSON" in shown
    # An installed program has no pages beside it.
    assert "docs/" not in shown


@pytest.mark.parametrize("name", COMMANDS)
def test_every_documented_option_is_accepted(run_in_process: Run, name: str) -> None:
    """By the page of commands and by `--help`; a value that lacks is another error."""
    page = (ROOT / "docs" / "commands.md").read_text(encoding="utf-8")
    row = re.search(rf"^\| `ringbalance {name}\b[^`]*`", page, re.MULTILINE)
    assert row is not None
    listed = re.findall(r"^│[ *]+((?:--[a-z-]+ )+)", run_in_process(name, "--help").stdout, re.MULTILINE)
    assert listed
    elsewhere = {"--help", "--version", "--install-completion", "--brief", "--quiet", "--log"}
    options = {*re.findall(r"--[a-z][a-z-]*", f"{row[0]} {listed}")} - elsewhere
    app = cli._build_app()
    refused = []
    for option in options:
        try:
            app.parse_args([name, PAPER, PAPER, option], exit_on_error=False, print_error=False)
        except UnknownOptionError:
            refused.append(option)
        except CycloptsError:
            continue
    assert not refused


def test_the_shell_s_completion_is_written(
    run_in_process: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setenv("SHELL", "/bin/bash")
    assert run_in_process("--install-completion").returncode == 0
    (script,) = tmp_path.rglob("completions/ringbalance")
    assert {"calibrate", "--tolerance"} <= set(script.read_text().replace("'", " ").split())


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (("simulate", PAPER, "--tolerance", "-5 %"), "it must be at least 0 and below 1"),
        (("simulate", PAPER, "--law", "noise"), "noise: this is not UTF-8 text; allowed: a file written by"),
        (("sweep", PAPER, "--plan", "noise", "--out", "o"), "noise: this is not UTF-8 text; allowed: a TOML"),
        (("sweep", PAPER, "--vary", "tube.bore=1mm:2mm:0", "--out", "o"), "must be whole and above 0"),
        (("simulate", "absent"), "a scene that comes with the program: driven_masses_small, "),
        (("plot", DRIVEN, "--out", "o"), f"all commands but {LIQUID_RING_ALONE} take any"),
    ],
)
def test_one_sentence_says_what_is_allowed(
    words: tuple[str, ...],
    sentence: str,
    run_in_process: Run,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    (tmp_path / "noise").write_bytes(bytes(range(128, 256)))
    monkeypatch.chdir(tmp_path)
    assert_bad_input(run_in_process(*words), sentence)


@pytest.mark.parametrize("page", ["README.md", "docs/commands.md"])
def test_pages_name_the_commands_of_a_liquid_ring_as_the_error_does(page: str) -> None:
    listed = re.findall("All commands but (.*?) take", (ROOT / page).read_text(encoding="utf-8"))
    assert [each.replace("`", "") for each in listed] == [LIQUID_RING_ALONE]
