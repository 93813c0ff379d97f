"""Commands one after the other, as the documents have them: what one saves, the others take.

An exit code of 1 is an answer: not met, not settled, the fit does not describe its data.
"""

from __future__ import annotations

import re
import shlex
from pathlib import Path
from types import MappingProxyType
from typing import Final

import pytest

from ringbalance import cli

ROOT: Final = Path(__file__).resolve().parents[1]
DATA: Final = {
    "WEIGHTS": ROOT / "scenes/measurements/trial_weight.csv",
    "INJECTIONS": ROOT / "scenes/measurements/injection.csv",
    "RUN_UP": ROOT / "scenes/measurements/run_up.csv",
}
SEQUENCES: Final = MappingProxyType(
    {
        "fitted": """
            fit SCENE WEIGHTS --save fitted.toml
            calibrate fitted.toml --save law.json
            simulate fitted.toml
            simulate fitted.toml --law law.json
            export fitted.toml --to c
            export fitted.toml --to c --block disc
            tune fitted.toml --save tuned.toml
            calibrate tuned.toml
            simulate tuned.toml --csv run.csv
            export tuned.toml --to st --block controller
            sweep tuned.toml --vary rotor.lag_angle=10deg,20deg --check 0 --no-figures --out swept --write 1
            calibrate swept/scenes/row-1.toml""",
        "injected": """
            fit SCENE INJECTIONS --parameters lambda_factor --save fitted.toml
            calibrate fitted.toml""",
        "built": """
            fit SCENE INJECTIONS WEIGHTS --parameters lambda_factor,bore,extra_loss --save built.toml
            calibrate built.toml
            simulate built.toml""",
        "prescribed": """
            calibrate SCENE
            simulate SCENE
            tune SCENE --save tuned.toml
            simulate tuned.toml""",
        "reported": """
            fit SCENE WEIGHTS --save fitted.toml
            report fitted.toml --out fitted
            tune SCENE --save tuned.toml
            report tuned.toml --out tuned
            compare fitted.toml tuned.toml
            plot fitted.toml --out pictures""",
        "designed": """
            design SCENE --save designed.toml
            calibrate designed.toml
            simulate designed.toml
            tune designed.toml
            export designed.toml --to c --block controller
            report designed.toml --out designed""",
        "masses": """
            fit SCENE RUN_UP --save fitted.toml
            simulate fitted.toml
            tune fitted.toml --save tuned.toml
            simulate tuned.toml
            report tuned.toml --out tuned""",
    }
)
OFTEN: Final = {
    ("fitted", "liquid_ring_paper"),
    ("injected", "liquid_ring_paper"),
    ("prescribed", "README"),
}
"""Sequences that run with every change; all others are heavy."""
RINGS: Final = sorted(
    path.stem
    for path in (ROOT / "scenes").glob("*.toml")
    if 'balancer = "liquid_ring"' in path.read_text(encoding="utf-8") and path.stem != "spindle_design"
)
RUNS: Final = [
    *((name, scene) for name in ("fitted", "reported") for scene in RINGS),
    *((each, "liquid_ring_paper") for each in ("injected", "built")),
    *(("prescribed", "README"), ("reported", "README")),
    ("designed", "spindle_design"),
    *(("masses", each) for each in ("driven_masses_small", "eccentric_mass_paper", "washing_machine")),
]
_COMMAND: Final = re.compile(r"^ *(?:\.venv/bin/)?ringbalance (.*)$", re.MULTILINE)


def prescribed() -> str:
    """README's disc with a prescribed k and a liquid by its density: nothing of the tube's head varies."""
    page = (ROOT / "README.md").read_text(encoding="utf-8")
    text = re.search(r"```toml\n(.*?)```", page, re.DOTALL)
    assert text
    liquid = (
        '[liquid]\ndensity = "1000 kg/m^3"\nkinematic_viscosity = "1 mm^2/s"\n\n[tube]\ndrag_coefficient = 50'
    )
    return re.sub(r"(?s)\[liquid\].*?\[tube\]", liquid, text[1])


@pytest.mark.parametrize(
    ("sequence", "scene"),
    [pytest.param(*each, marks=() if each in OFTEN else pytest.mark.heavy) for each in RUNS],
)
def test_commands_take_what_earlier_ones_save(
    sequence: str, scene: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    path = ROOT / "scenes" / f"{scene}.toml"
    if scene == "README":
        path = tmp_path / "my_disc.toml"
        path.write_text(prescribed(), encoding="utf-8")
    for line in SEQUENCES[sequence].strip().splitlines():
        words = [str({**DATA, "SCENE": path}.get(word, word)) for word in shlex.split(line)]
        assert cli.main([*words, "--quiet"]) in {0, 1}, line


def followed(commands: list[str]) -> set[tuple[str, str]]:
    """Which command takes a file that which one before it has saved."""
    pairs, saved = set(), dict[str, str]()
    for words in map(shlex.split, commands):
        split = words.index("--save") if "--save" in words else len(words)
        pairs |= {(saved[word], words[0]) for word in words[:split] if word in saved}
        saved |= dict.fromkeys(words[split + 1 : split + 2], words[0])
    return pairs


def test_every_sequence_of_a_document_is_run() -> None:
    pages = (ROOT / "README.md", *(ROOT / "docs").rglob("*.md"))
    documented = set()
    for page in pages:
        text = page.read_text(encoding="utf-8").replace("\\\n", " ")
        documented |= followed([re.sub(r"[#>|&].*", "", line) for line in _COMMAND.findall(text)])
    assert {("fit", "calibrate"), ("design", "report")} <= documented
    assert documented <= set.union(*(followed(each.strip().splitlines()) for each in SEQUENCES.values()))
