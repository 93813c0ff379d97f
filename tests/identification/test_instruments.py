"""Rig data as instruments write them: the same measurements in another form are the same observations."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from ringbalance.cli import main
from ringbalance.identification.kinds.kind import Observations
from ringbalance.identification.misreadings import SENSES
from ringbalance.identification.reading import observations_of
from ringbalance.scene import AnyScene, bundled_scene, load_scene
from ringbalance.scene.faults import SceneError
from ringbalance.scene.models import Scene

OMEGA = 10000 * 2 * math.pi / 60
"""Speed of the paper's rotor, rad/s."""
ROWS = ((0, 0, 10.0, 90.0), (200, 0, 9.5, 77.0), (200, 120, 12.25, 91.5), (400, 180, 12.5, 110.0))
"""Unbalance, g mm, its angle, deg, amplitude, um zero to peak, and phase, deg."""
FIRST = '# kind = "trial_weight"\n# source = "rig 4"\n'


def text(
    heads: str = "unbalance [g*mm],angle [deg],amplitude [um],phase [deg]",
    *,
    first: str = '# amplitude = "zero_to_peak"\n',
    size: float = 1.0,
    turn: float = 0.0,
    weight: float = 1.0,
) -> str:
    """The rows below heads. Args: `size`, `weight`: factors; `turn`: added to the phases, deg."""
    lines = (f"{u * weight!r},{w!r},{a * size!r},{p + turn!r}" for u, w, a, p in ROWS)
    return FIRST + first + heads + "\n" + "\n".join(lines) + "\n"


def read(content: str | bytes, scene: AnyScene | None) -> Observations:
    raw = content.encode() if isinstance(content, str) else content
    observations, faults = observations_of(raw, file="rig.csv", scene=scene)
    if observations is None:
        raise SceneError(faults)
    return observations


def assert_same(content: str | bytes, scene: AnyScene | None, *, rel: float = 1e-12) -> Observations:
    """Observations of a file, equal to the plain ones up to rounding of the numbers that were written."""
    observations, plain = read(content, scene), read(text(), scene)
    assert observations.columns.keys() == plain.columns.keys()
    for name, column in plain.columns.items():
        turned = observations.columns[name] - column
        if name in ("phase", "angle"):
            turned = np.angle(np.exp(1j * turned))
        assert np.abs(turned) == pytest.approx(0.0, abs=rel * max(1e-6, float(np.abs(column).max()))), name
    return observations


@pytest.mark.parametrize(
    ("unit", "size", "turn"),
    [
        # The peak of a velocity is omega a, and it leads displacement by a quarter of a turn.
        ("mm/s peak", OMEGA * 1e-3, 90),
        ("mm/s rms", OMEGA * 1e-3 / math.sqrt(2), 90),
        ("in/s pk", OMEGA * 1e-6 / 0.0254, 90),
        ("ips pk", OMEGA * 1e-6 / 0.0254, 90),
        ("m/s^2 rms", OMEGA**2 * 1e-6 / math.sqrt(2), 180),
        ("g pk", OMEGA**2 * 1e-6 / 9.80665, 180),
        ("mil pp", 2e-6 / 25.4e-6, 0),
        ("um p-p", 2.0, 0),
    ],
)
def test_any_quantity_of_a_vibration_is_its_displacement(
    unit: str, size: float, turn: float, paper_scene: Scene
) -> None:
    heads = f"unbalance [g*mm],angle [deg],amplitude [{unit}],phase [deg]"
    said = assert_same(text(heads, first="", size=size, turn=turn), paper_scene).remarks
    assert any(f"phase is turned back by {turn} deg" in each for each in said) == bool(turn)
    assert any("as their units say" in each for each in said)


@pytest.mark.parametrize(("unit", "turn"), [("um", 0), ("mm/s", 90), ("m/s^2", 180)])
def test_a_phase_counted_against_the_rotation_is_reversed_as_the_file_has_it(
    unit: str, turn: float, paper_scene: Scene
) -> None:
    """-(p + turn) in the file of a phase p of displacement; read the other way, it is p again."""
    lines = text(f"unbalance [g*mm],angle [deg],amplitude [{unit}],phase [deg]").splitlines()
    rows = [f"{u},{w},{a},{-(p + turn)}" for u, w, a, p in ROWS]
    observations = read("\n".join([*lines[: -len(ROWS)], *rows]) + "\n", paper_scene)
    reversed_phases = SENSES[0].change(observations, paper_scene)
    assert reversed_phases is not None
    turned = reversed_phases.columns["phase"] - np.radians([p for *_, p in ROWS])
    assert np.exp(1j * turned) == pytest.approx(np.ones(len(ROWS)))


def test_the_speed_of_the_file_precedes_that_of_the_scene(paper_scene: Scene) -> None:
    heads = "unbalance [g*mm],angle [deg],amplitude [mm/s],phase [deg]"
    first = '# amplitude = "zero_to_peak"\n# speed = "5000 rpm"\n'
    said = assert_same(text(heads, first=first, size=OMEGA / 2 * 1e-3, turn=90), paper_scene).remarks
    assert "5000 rpm" in said[-1]
    for speed, told in (("0 rpm", "displacements at a known speed"), ("fast", "not a number")):
        with pytest.raises(SceneError, match=rf"speed: .*{told}"):
            read(text(heads, first=first.replace("5000 rpm", speed)), paper_scene)


def test_each_row_of_a_run_up_has_a_speed_of_its_own() -> None:
    scene = load_scene(bundled_scene("driven_masses_small"))
    first = '# kind = "run_up"\n# source = "rig 4"\n'
    rows = "speed [rpm],amplitude [mm/s rms],phase [deg]\n300,1.5,100\n600,4,150\n"
    observations = read(first + rows, scene)
    speeds = np.array([300, 600]) * 2 * math.pi / 60
    assert observations.columns["amplitude"] == pytest.approx(
        np.array([1.5e-3, 4e-3]) * math.sqrt(2) / speeds
    )
    assert observations.columns["phase"] == pytest.approx(np.radians([10, 60]))


def test_uncertainties_are_in_the_unit_of_the_instrument(paper_scene: Scene) -> None:
    heads = "unbalance [g*mm],angle [deg],amplitude [mm/s rms],phase [deg]"
    for first in ('# uncertainty = { amplitude = "0.1 mm/s" }\n', ""):
        content = text(heads, first=first, size=OMEGA * 1e-3 / math.sqrt(2), turn=90)
        if not first:
            content = content.replace("phase [deg]", "phase [deg],uncertainty_amplitude [mm/s rms]")
            content = content.replace(".0\n", ".0,0.1\n").replace(".5\n", ".5,0.1\n")
        width = assert_same(content, paper_scene).uncertainty["amplitude"]
        assert width == pytest.approx(1e-4 * math.sqrt(2) / OMEGA)


def test_weights_in_ounces_and_inches_and_as_mass_and_radius(paper_scene: Scene) -> None:
    """An ounce is 28.349523125 g, an inch 25.4 mm."""
    heads = "unbalance [oz*in],angle [deg],amplitude [um],phase [deg]"
    assert_same(text(heads, weight=1 / (28.349523125 * 25.4)), paper_scene)
    lines = (f"{u / 70!r},70,{w},{a},{p}" for u, w, a, p in ROWS)
    heads = "mass [g],radius [mm],angle [deg],amplitude [um],phase [deg]\n"
    content = FIRST + '# amplitude = "zero_to_peak"\n' + heads + "\n".join(lines)
    assert "unbalance [g*mm] is mass [g] times radius [mm]" in assert_same(content, paper_scene).remarks


def test_a_table_as_an_instrument_exports_it(paper_scene: Scene) -> None:
    """UTF-16, decimal commas, units in a row, time stamps, no angle without a weight, a missed reading."""
    lines = [
        f"12.03.2024;10:0{i}:22;{u / 70!r};70;{w if u else ''};{a!r};{p!r};".replace(".", ",")
        for i, (u, w, a, p) in enumerate(ROWS)
    ]
    lines = [line.replace("12,03,2024", "12.03.2024") for line in lines]
    lines.insert(2, "12.03.2024;10:09:22;2,857;70;240;;;missed")
    heads = "Date;Time;Mass;Radius;Angle;Amplitude;Phase;Note\n;;g;mm;deg;um pk;deg;\n"
    content = (FIRST + heads + "\n".join(lines)).encode("utf-16")
    observations = assert_same(content, paper_scene)
    assert observations.lines.tolist() == [5, 6, 8, 9]
    for each in ("commas in numbers", "line 4", "date, time", "zero_to_peak", "lines 7, which"):
        assert any(each in remark for remark in observations.remarks), each


def test_commas_that_may_part_thousands_are_refused(paper_scene: Scene) -> None:
    rows = text().replace(",", ";").replace("90.0", "90,000").replace("77.0", "77,125")
    rows = (
        rows.replace("91.5", "91,500").replace("110.0", "110,000").replace(".0;", ";").replace("9.5;", "9;")
    )
    with pytest.raises(SceneError, match=r"decimal comma|parted"):
        read(rows.replace("12.25", "12").replace("12.5", "13"), paper_scene)
    with pytest.raises(SceneError, match="decimal comma"):
        read(text().replace(",", ";").replace("90.0", "90,04"), paper_scene)


def test_two_copies_with_time_stamps_are_two_measurements(paper_scene: Scene) -> None:
    heads = "unbalance [g*mm],angle [deg],amplitude [um],phase [deg]"
    content = (
        text().replace(heads, f"{heads},time").replace(".0\n", ".0,10:01\n").replace(".5\n", ".5,10:02\n")
    )
    assert len(read(content + "400.0,180,12.5,110.0,10:07:30\n", paper_scene)) == 5
    copied = read(content + "400.0,180,12.5,110.0,10:01\n", paper_scene)
    assert len(copied) == 4
    assert "line 9 is the same as line 8 and counts once" in copied.remarks


def test_a_copied_row_changes_no_answer(paper_scene: Scene) -> None:
    """Counted twice, it would narrow the intervals."""
    assert_same(text() + "400.0,180,12.5,110.0\n", paper_scene)


@pytest.mark.parametrize(
    ("heads", "said"),
    [
        ("imbalance [g*mm],weight angle [deg],Displacement [um],Phase Angle [deg]", "displacement [um]"),
        ("unbalance [g*mm],position [deg],vibration (um),phase [deg]", "vibration [um]"),
        ("Unbalance [g*mm],trial_angle [deg],overall [um 0-p],phase angle [deg]", "overall [um 0-p]"),
    ],
)
def test_usual_names_of_columns_are_understood_and_said(heads: str, said: str, paper_scene: Scene) -> None:
    remarks = assert_same(text(heads), paper_scene).remarks
    assert f"{said} is taken as amplitude [um" in str(remarks)


def test_a_velocity_by_its_name_and_times_in_seconds(paper_scene: Scene) -> None:
    heads, rows = text().split("unbalance", 1)[0], text().splitlines()[-4:]
    size = OMEGA * 1e-3
    lines = [line.split(",") for line in rows]
    cells = "\n".join(
        f"{u},{w},{float(a) * size!r},{float(p) + 90!r},{60 * at}" for at, (u, w, a, p) in enumerate(lines)
    )
    read_as = assert_same(
        f"{heads}unbalance [g*mm],angle [deg],velocity [mm/s],phase [deg],time [s]\n{cells}\n", paper_scene
    )
    assert "velocity [mm/s] is taken as amplitude [mm/s]" in read_as.remarks
    assert "times in time [s] are taken as notes" in read_as.remarks
    heads = "unbalance [g*mm],angle [deg],amplitude [um],phase [deg],rpm"
    turning = text(heads).replace(".0\n", ".0,10000\n")
    assert_same(turning.replace(".5\n", ".5,10000\n"), paper_scene)
    # Of an injection `time` is the valve's; a name that fits nothing is named with what is looked for.
    with pytest.raises(SceneError, match=r'"loudness \[um\]".* no such column') as error:
        read(text().replace("amplitude [um]", "loudness [um]"), paper_scene)
    assert 'the column "amplitude [um]" is missing' in str(error.value)


def test_a_text_of_windows_is_read_and_said(paper_scene: Scene) -> None:
    written = text().replace("rig 4", "Prüfstand 4").replace("[um]", "[µm]").replace("[deg]", "[°]")
    observations = assert_same(written.encode("cp1252"), paper_scene)
    assert observations.source == "Prüfstand 4"
    assert "the text is read as Windows-1252, as it is not UTF-8" in observations.remarks


@pytest.mark.parametrize(
    "heads",
    [
        "unbalance [g*mm],angle [deg],amplitude_1 [um],phase_1 [deg]",
        "unbalance [g*mm],angle [deg],amplitude_left [um],phase_left [deg]",
        "plane,angle [deg],amplitude [um],phase [deg]",
    ],
)
def test_data_of_two_planes_are_refused_in_one_sentence(heads: str, paper_scene: Scene) -> None:
    with pytest.raises(SceneError, match="two planes: a disc corrects one plane") as error:
        read(text(heads), paper_scene)
    assert len(error.value.faults) == 1
    assert "the fit tells its influence coefficient" in str(error.value)


def test_what_was_understood_is_shown_before_anything_is_fitted(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "rig.csv"
    heads = "unbalance [g*mm],angle [deg],amplitude [mm/s rms],phase [deg]"
    file.write_text(text(heads, first="", size=OMEGA * 1e-3 / math.sqrt(2), turn=90), encoding="utf-8")
    scene = str(bundled_scene("liquid_ring_paper"))
    assert main(["fit", scene, str(file), "--preview"]) == 0
    shown = capsys.readouterr()
    for line in (
        "(trial_weight)",
        "4 rows, 1 series; rig 4",
        "unbalance: 0 g*mm to 400 g*mm",
        "amplitude: 9.5 um to 12.5 um, zero to peak",
        "phase: 77 deg to 110 deg",
        "amplitude [mm/s] is divided by the speed, 10000 rpm; its phase is turned back by 90 deg",
    ):
        assert line in shown.out
    assert "influence_coefficient" not in shown.out
