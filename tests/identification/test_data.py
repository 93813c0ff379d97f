"""Files of measurements for a fit: what they become, what a spreadsheet may do to them, what is refused."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest

import ringbalance as rb
from ringbalance.identification import tables
from ringbalance.identification.kinds.kind import Observations
from ringbalance.identification.reading import KINDS, observations_of, read_observations, template
from ringbalance.scene import AnyScene, SceneError
from ringbalance.scene.models import Scene
from scenes import with_tables


@pytest.fixture(scope="session")
def scenes(paper_scene: Scene) -> Mapping[str, AnyScene | None]:
    """A scene by balancer; none of a test bench."""
    other = rb.load_scene(rb.bundled_scene("washing_machine"))
    return {"liquid_ring": paper_scene, "eccentric_mass": other, "": None}


def read(text: str, scene: AnyScene | None) -> Observations:
    found, faults = observations_of(text.encode(), file="x.csv", scene=scene)
    assert [str(fault) for fault in faults] == []
    assert found is not None
    return found


def refused(text: str, scene: AnyScene | None) -> list[str]:
    """Lines of the message, in the order of the file."""
    found, faults = observations_of(text.encode(), file="x.csv", scene=scene)
    assert found is None
    return [str(fault) for fault in tables.in_order(faults)]


@pytest.mark.parametrize("kind", KINDS)
def test_a_filled_template_is_read(
    kind: str, sound_files: Mapping[str, str], scenes: Mapping[str, AnyScene | None]
) -> None:
    text, declared = sound_files[kind], KINDS[kind]
    found = read(text, scenes[declared.balancer])
    assert found.kind == kind
    assert found.source == "rig 4, 12 March"
    assert set(found.columns) <= {column.name for column in declared.columns}
    assert any(column.name in found.columns for column in declared.measured)
    rows = text.splitlines()
    assert [rows[line - 1].endswith(",a") for line in found.lines] == [True] * len(found)
    assert bool(found.uncertainty) == (not declared.balancer)


@pytest.mark.parametrize("kind", KINDS)
def test_an_empty_template_asks_for_what_it_lacks(kind: str, scenes: Mapping[str, AnyScene | None]) -> None:
    (line,) = refused(template(kind), scenes[KINDS[kind].balancer])
    assert "there is no row of data" in line


def test_numbers_become_si_and_amplitudes_zero_to_peak(
    sound_files: Mapping[str, str], paper_scene: Scene
) -> None:
    text = sound_files["injection"]
    found = read(text, paper_scene)
    assert found.columns["gas_time"] == pytest.approx([0.05, 0.05, 0.08], rel=1e-15)
    assert found.columns["pressure"] == pytest.approx([7e5] * 3, rel=1e-15)
    assert found.columns["phase_before"][0] == pytest.approx(math.pi / 2, rel=1e-15)
    assert list(found.chamber) == ["A", "C", "B"]
    for convention, factor in (("zero_to_peak", 1.0), ("peak_to_peak", 0.5), ("rms", math.sqrt(2))):
        stated = '# uncertainty = { amplitude_before = "0.2 um", amplitude_after = "1 %" }\n'
        other = stated + text.replace('"zero_to_peak"', f'"{convention}"')
        one = read(other, paper_scene)
        assert one.columns["amplitude_after"] == pytest.approx(factor * found.columns["amplitude_after"])
        assert one.uncertainty["amplitude_before"] == pytest.approx(factor * np.full(3, 0.2e-6))
        assert one.uncertainty["amplitude_after"] == pytest.approx(0.01 * one.columns["amplitude_after"])
    minutes = (
        text.replace("gas_time [ms]", "gas_time [min]").replace(",50,", ",0.001,").replace(",80,", ",1,")
    )
    assert read(minutes, paper_scene).columns["gas_time"] == pytest.approx([0.06, 0.06, 60.0])


def test_a_relative_uncertainty_of_a_vibration_is_that_of_both_its_components(
    sound_files: Mapping[str, str], paper_scene: Scene
) -> None:
    found = read("# uncertainty = 0.02\n" + sound_files["trial_weight"], paper_scene)
    percent = read('# uncertainty = "2 %"\n' + sound_files["trial_weight"], paper_scene)
    assert found.uncertainty["amplitude"] == pytest.approx(0.02 * found.columns["amplitude"])
    assert found.uncertainty["phase"] == pytest.approx([0.02] * 3)
    assert percent.uncertainty["phase"].tolist() == found.uncertainty["phase"].tolist()


def test_the_uncertainty_of_a_row_comes_before_that_of_the_file(
    sound_files: Mapping[str, str], paper_scene: Scene
) -> None:
    text = "# uncertainty = 0.5\n" + sound_files["flow"].replace("series\n", "series,uncertainty\n")
    text = text.replace(",a\n", ",a,0.1\n")
    assert read(text, paper_scene).uncertainty["flow_rate"] == pytest.approx([0.41e-6, 0.69e-6, 1.02e-6])
    own = text.replace("series,uncertainty\n", "series,uncertainty_flow_rate [l/min]\n")
    assert read(own, paper_scene).uncertainty["flow_rate"] == pytest.approx([0.1e-3 / 60] * 3)


def spreadsheet(text: str, separator: str) -> str:
    """A file as a spreadsheet saves it again: quotation marks, empty cells at the end, its own line ends."""
    lines = [
        f'"{line.replace(chr(34), 2 * chr(34))}"' + separator * 4
        if line.startswith("#")
        else line.replace(",", separator)
        for line in text.splitlines()
    ]
    return f"\ufeffsep={separator}\r\n" + "\r\n".join(lines) + f"\r\n{separator * 5}\r\n\r\n"


@pytest.mark.parametrize("separator", [";", ",", "\t"])
@pytest.mark.parametrize("kind", ["trial_weight", "injection", "transfer"])
def test_what_a_spreadsheet_does_to_a_file_is_undone(
    kind: str, separator: str, sound_files: Mapping[str, str], paper_scene: Scene, tmp_path: Path
) -> None:
    plain, again = tmp_path / "plain.csv", tmp_path / "again.csv"
    plain.write_text(sound_files[kind], encoding="utf-8")
    again.write_text(spreadsheet(sound_files[kind], separator), encoding="utf-8", newline="")
    (first,), (second,) = (read_observations([path], scene=paper_scene) for path in (plain, again))
    assert second.source == first.source
    for name, values in first.columns.items():
        np.testing.assert_array_equal(second.columns[name], values)
    np.testing.assert_array_equal(second.lines, first.lines + 1)


def test_capitals_of_a_table_s_words_do_not_matter(
    sound_files: Mapping[str, str], paper_scene: Scene
) -> None:
    """A spreadsheet begins a head with one, and RMS is written so."""
    plain = sound_files["trial_weight"].replace('"zero_to_peak"', '"rms"')
    spelled = (
        plain.replace('"rms"', '"RMS"').replace("amplitude [", "Amplitude [").replace("angle [", "ANGLE [")
    )
    assert spelled != plain.replace('"rms"', '"RMS"')
    found, own = read(spelled, paper_scene), read(plain, paper_scene)
    np.testing.assert_array_equal(found.columns["amplitude"], own.columns["amplitude"])


@pytest.mark.parametrize("written", ["[µm]", "[μm]", "[um]", " [um]"])
def test_both_characters_for_micro_and_the_degree_sign_are_known(
    written: str, sound_files: Mapping[str, str], paper_scene: Scene
) -> None:
    text = sound_files["trial_weight"]
    plain = read(text, paper_scene)
    other = text.replace(" [um]", written).replace("[deg]", "[°]").replace("[g*mm]", "[g·mm]")
    assert read(other, paper_scene).columns["amplitude"] == pytest.approx(plain.columns["amplitude"])
    assert read(other, paper_scene).columns["phase"] == pytest.approx(plain.columns["phase"])


@pytest.mark.parametrize(
    ("kind", "old", "new", "told"),
    [
        ("injection", '# amplitude = "zero_to_peak"', "#", ["amplitude is missing", "peak_to_peak", "rms"]),
        ("injection", '"zero_to_peak"', '"peak"', ['amplitude = "peak"', "rms"]),
        ("flow", '# kind = "flow"', '# kind = "flo"', ['kind = "flo"', 'did you mean "flow"']),
        ("flow", "# kind", "# sort", ['"kind" is missing']),
        ("flow", '# kind = "flow"', "# kind = flow", ["marked #, are not TOML", "line 1"]),
        ("flow", 'source = "rig 4, 12 March"', 'source = ""', ["source", "empty"]),
        ("flow", 'source = "rig 4, 12 March"', "source = 4", ["source = 4", "not text"]),
        ("flow", "20,4.1,a", "20,4,1,a", ["line 11", "4 values", "columns are 3", "decimal comma"]),
        ("flow", "20,4.1,a", '20,"4,1",a', ["line 11", 'column "flow_rate [ml/s]"', "decimal comma"]),
        ("flow", "20,4.1,a", ",4.1,a", ["line 11", "pressure_difference [kPa]", "empty"]),
        ("flow", "20,4.1,a", "20,NaN,a", ["line 11", '"NaN"', "finite"]),
        ("flow", "20,4.1,a", "20,1_0,a", ["line 11", '"1_0"']),
        ("flow", "20,4.1,a", "20,4.1 ml/s,a", ["line 11", "not a number alone"]),
        ("flow", "20,4.1,a", "20,-4.1,a", ["line 11", '"-4.1"', "not above zero"]),
        ("flow", "20,4.1,a", "20,1e308,a", ["line 11", "1e308", "size"]),
        ("flow", "20,4.1,a", '20,4.1,"a', ["line 11", "quotation marks"]),
        ("flow", "20,4.1,a", "20,4.1," + "a" * 200_000, ["line 11", "a cell is longer"]),
        ("flow", "[ml/s]", "[g/s]", ["line 10", "flow_rate [g/s]", "ml/s"]),
        ("flow", "[ml/s]", "[bar]", ["line 10", "unit of pressure", "volume flow"]),
        ("flow", "flow_rate [ml/s],s", "flow_rate,s", ["line 10", "unit is missing"]),
        ("flow", "flow_rate [ml/s],s", "flow_rates [ml/s],s", ['"flow_rate', "did you mean"]),
        ("flow", ",series", ",series [mm]", ["series [mm]", "text has no unit"]),
        ("flow", "## unc", "# uncertainty = 2 #", ["uncertainty = 2", "below 1"]),
        ("flow", "## unc", "# uncertainty = 0 #", ["uncertainty = 0", "above 0"]),
        ("flow", "## unc", '# uncertainty = "5 mm" #', ['"5 mm"', '"2 %"']),
        ("flow", "## unc", '# uncertainty = {flow="5 %"} #', ["uncertainty.flow", "flow_rate"]),
        ("flow", "## unc", '# uncertainty = {flow_rate="5 g"} #', ["flow_rate", "unit of mass"]),
        ("flow", "## unc", '# uncertainty = {flow_rate="0 %"} #', ["flow_rate", "above zero"]),
        ("flow", "## unc", "# amplitude = 'rms' #", ['"amplitude"', "not known"]),
        ("transfer", "mass [g]", "mass [mm]", ["mass [mm]", "unit of length"]),
        ("transfer", "mass [g]", "note", ["0 of the columns", "volume [ml]"]),
        ("transfer", "0.25,0.7,200", "25,0.7,200", ["fill_ratio", '"25"', "too large"]),
        ("transfer", "0.25,0.7,200", "0.7,0.7,200", ["fill_ratio", '"0.7"', "hold 0.5 together"]),
        ("flow", "20,4.1,a", '# kind = "transfer"\n20,4.1,a', ["line 11", "one kind of data"]),
        ("injection", "A,50", "a,50", ["chamber", '"a"', 'did you mean "A"', "A, B, C, D"]),
        ("injection", "A,50", "E,50", ["chamber", '"E"', "A, B, C, D"]),
        ("injection", "A,50,0.7,10", "A,50,0.7,-10", ["amplitude_before", "negative"]),
        ("injection", "phase_before [deg]", "phase_before [rad]", ['"90"', "is [deg] meant?"]),
        ("injection", "## unc", '# uncertainty = {phase_after="2 %"} #', ["an angle has no percentage"]),
        ("injection", "## unc", '# uncertainty = {phase_after="2 deg"} #', ["not of amplitude_before"]),
        ("trial_weight", "0,0,10,90", "0,0,0,90", ["relative"]),
        ("trial_weight", "amplitude [um]", "amplitude [m]", ['"11.5"', "is [um] meant?", "to 0.2 m"]),
        ("transfer", "0.25,0.7,400", "0.25,2e4,400", ['"2e4"', "is [MPa] meant?"]),
    ],
)
def test_what_is_wrong_is_told_with_its_place(
    kind: str, old: str, new: str, told: list[str], sound_files: Mapping[str, str], paper_scene: Scene
) -> None:
    text = sound_files[kind]
    if told == ["relative"]:
        text = "# uncertainty = 0.02\n" + text
    assert old in text
    # The last place: names of columns stand in the explanations too.
    lines = refused(new.join(text.rsplit(old, 1)), paper_scene)
    assert all(line.startswith("x.csv: ") for line in lines)
    assert [word for word in told if not any(word in line for line in lines)] == []
    assert len(lines) <= 3


def test_all_errors_of_all_files_are_reported_together(
    sound_files: Mapping[str, str], paper_scene: Scene, tmp_path: Path
) -> None:
    one, two = tmp_path / "one.csv", tmp_path / "two.csv"
    one.write_text(sound_files["flow"].replace("20,4.1", "20,x").replace("50,6.9", "y,6.9,9"))
    two.write_text(sound_files["transfer"].replace("0.25,", "-0.25,", 1))
    with pytest.raises(SceneError) as error:
        read_observations([one, two, tmp_path / "three.csv", tmp_path], scene=paper_scene)
    told = [str(fault).removeprefix(str(tmp_path)).split(": ")[:2] for fault in error.value.faults]
    assert told == [
        ["/one.csv", 'line 11, column "flow_rate [ml/s]" = "x"'],
        ["/one.csv", "line 12"],
        ["/two.csv", 'line 14, column "fill_ratio" = "-0.25"'],
        ["/three.csv", "there is no such file"],
        ["", "this is a folder, not a file of measurements"],
    ]


def test_a_file_of_the_other_balancer_is_refused(
    sound_files: Mapping[str, str], scenes: Mapping[str, AnyScene | None]
) -> None:
    (line,) = refused(sound_files["injection"], scenes["eccentric_mass"])
    assert 'kind = "injection"' in line
    assert "run_up" in line
    (line,) = refused(sound_files["run_up"], scenes["liquid_ring"])
    assert "trial_weight" in line


def test_the_same_file_counts_once(
    sound_files: Mapping[str, str], paper_scene: Scene, tmp_path: Path
) -> None:
    for name in ("a.csv", "b.csv"):
        (tmp_path / name).write_text(sound_files["flow"])
    with pytest.raises(SceneError, match=r"b\.csv: it has the same content as .*a\.csv"):
        read_observations([tmp_path / "a.csv", tmp_path / "b.csv"], scene=paper_scene)


@pytest.mark.parametrize(
    ("content", "told"),
    [
        (b"", "no line with the names of the columns"),
        (b"\n\n  \n", "no line with the names of the columns"),
        (b"\x00\x01\x02\xff", "binary"),
        (b"# kind = 'flow'\nab\x00c\n1\n", "line 2, character 3: this is not text but binary"),
        (b"# source = '20 \x81C'\n", "line 1, character 16: this is neither UTF-8 nor Windows-1252 text"),
        ("kind".encode("utf-16-le"), "line 1, character 2: this is not text but binary"),
        ("kind".encode("utf-16"), "no row of data below"),
        (b"PK\x03\x04rest", "workbook"),
        (b"a" * (tables.LARGEST_FILE + 1), "up to 8 MiB"),
        (b"a,b\n" + b"1,2\n" * (tables.MOST_ROWS + 1), "up to 2000 rows"),
    ],
)
def test_what_is_no_table_is_refused(content: bytes, told: str, paper_scene: Scene, tmp_path: Path) -> None:
    path = tmp_path / "x.csv"
    path.write_bytes(content)
    with pytest.raises(SceneError) as error:
        read_observations([path], scene=paper_scene)
    (fault,) = error.value.faults
    assert told in str(fault)


def test_chambers_are_those_of_the_scene(sound_files: Mapping[str, str], paper_scene: Scene) -> None:
    pair = with_tables(paper_scene, disc={"chambers": 2})
    lines = refused(sound_files["injection"], pair)
    assert [line.split(": ")[1] for line in lines] == ['line 19, column "chamber" = "C"']
