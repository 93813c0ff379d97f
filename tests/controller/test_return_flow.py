"""A tube without a siphon crest, or with one too shallow: what the gas moves runs back when it is off."""

from __future__ import annotations

import json
import math
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from quantities import by_key
from scipy.integrate import solve_ivp

import ringbalance as rb
from ringbalance.cli import main
from ringbalance.controller.algorithms.algorithm import Command, Measurement, ValveCommand
from ringbalance.controller.balancer import AS_GIVEN, balancer_of
from ringbalance.controller.judging.judge import judged_all
from ringbalance.controller.loop import simulate
from ringbalance.controller.simulation import Outcome, Simulation
from ringbalance.reduced_model.calibration import calibrated_model
from ringbalance.reduced_model.law.flow_law import CALIBRATED, BalancerModel
from ringbalance.reduced_model.law.paper_law import paper_model
from ringbalance.reduced_model.terms import INERTIA
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.loader import load_scene
from ringbalance.scene.models import HumpGas, Scene
from ringbalance.scene.narrowing import liquid_ring_scene
from scenes import with_tables

STRAIGHT = """
[disc]
outer_radius = "44.5 mm"
inner_radius = "20.5 mm"
axial_width = "62 mm"
central_angle = "90 deg"
plate_thickness = "0 mm"
[liquid]
name = "water"
temperature = "20 degC"
[tube]
bore = "1.5 mm"
length = "120 mm"
drag_coefficient = 2
[gas]
pressure = "0.7 MPa"
[rotor]
speed = "10000 rpm"
[run]
time_limit = "{time_limit} s"
"""
GAS_TIME = 0.2
"""s."""


def scene_of(folder: Path, *, crest: str = "", time_limit: float = 2.7, more: str = "") -> Scene:
    text = STRAIGHT.format(time_limit=time_limit) + more
    if crest:
        text = text.replace("[tube]\n", f'[tube]\nhump_radius = "{crest}"\n')
    (folder / "scene.toml").write_text(text)
    return liquid_ring_scene(load_scene(folder / "scene.toml"))


@dataclass(frozen=True)
class Once:
    """Gas into chamber A for a time, at the first sample alone."""

    gas_time: float = GAS_TIME
    rises_tolerated: int = 10**6

    def start(self) -> bool:
        return True

    def step(self, state: bool, _: Measurement | None, /) -> tuple[bool, Command]:
        valves = (ValveCommand(chamber=0, duration=self.gas_time),) if state else ()
        return False, Command(valves=valves, reason="once")


def once(scene: Scene, model: BalancerModel, *, inertia: bool, gas_time: float = GAS_TIME) -> Simulation:
    """One injection into chamber A and what follows until the time limit."""
    return simulate(
        scene,
        model,
        controller=Once(gas_time),
        modelled=[INERTIA] if inertia else [],
        residual_fill=0.0,
    )


@dataclass(frozen=True)
class Column:
    """Newton's law of the column, L du/dt = (c (p + b w) - u |u|) (k + 1)/2, w = x_A - x_C = 2 x_A - 1/2.

    A chamber without plates is a sector, so with a^2 = R2^2 - x (R2^2 - R1^2) its levels differ by
    b w = rho omega^2 (R2^2 - R1^2) w/2, and c = 2/(rho (k + 1)).
    """

    scene: Scene
    k: float = 2.0

    @property
    def rate(self) -> float:
        """S/V, 1/m."""
        disc = self.scene.disc
        squares = disc.outer_radius**2 - disc.inner_radius**2
        return math.pi / 4 * self.scene.tube.bore**2 / (disc.central_angle / 2 * squares * disc.axial_width)

    @property
    def per_fill(self) -> float:
        """b, Pa."""
        disc, rho = self.scene.disc, self.scene.liquid.density
        squares = disc.outer_radius**2 - disc.inner_radius**2
        return rho * self.scene.rotor.speed**2 * squares / 2

    @property
    def c(self) -> float:
        return 2 / (self.scene.liquid.density * (self.k + 1))

    def without_mass(self, time: FloatArray) -> FloatArray:
        """x_A: u is linear in time in either direction, so w = (u^2/c - p)/b, and back w = -u^2/(c b)."""
        slowing, fastest = self.c * self.per_fill * self.rate, math.sqrt(self.c * self.scene.gas.pressure)
        ahead = fastest - slowing * np.minimum(time, GAS_TIME)
        driven = (ahead**2 / self.c - self.scene.gas.pressure) / self.per_fill
        lowest = float(driven[np.argmin(np.abs(time - GAS_TIME))])
        back = np.maximum(math.sqrt(-self.c * self.per_fill * lowest) - slowing * (time - GAS_TIME), 0.0)
        returned = -(back**2) / (self.c * self.per_fill)
        return np.asarray((np.where(time <= GAS_TIME, driven, returned) + 0.5) / 2)

    def with_mass(self, time: FloatArray) -> FloatArray:
        """x_A by scipy's integrator, gas on and gas off."""
        y, result = np.array([0.25, 0.0]), np.empty(time.size)
        for start, end, gas in (
            (0.0, GAS_TIME, self.scene.gas.pressure),
            (GAS_TIME, float(time[-1]), 0.0),
        ):
            here = (time >= start) & (time <= end)
            solved = solve_ivp(
                self._rates, (start, end), y, args=(gas,), t_eval=time[here], rtol=1e-10, atol=1e-12
            )
            result[here], y = solved.y[0], solved.y[:, -1]
        return result

    def _rates(self, _: float, y: FloatArray, gas: float) -> tuple[float, float]:
        x, u = y
        driven = self.c * (gas + self.per_fill * (2 * x - 0.5))
        return -self.rate * u, (driven - u * abs(u)) * (self.k + 1) / 2 / self.scene.tube.length


# The runs' own steps are to 1e-9 and end an injection within 1e-8 in fill, tables are right to 1e-9, and the
# reference is to 1e-10.
@pytest.mark.parametrize(("law", "inertia"), [("calibrated", True), ("calibrated", False), ("paper", False)])
def test_levels_run_back_as_newton_says(tmp_path: Path, law: str, inertia: bool) -> None:
    scene = scene_of(tmp_path)
    run = once(scene, calibrated_model(scene) if law == "calibrated" else paper_model(scene), inertia=inertia)
    x, column = run.fill_ratio["A"], Column(scene)
    expected = column.with_mass(run.time) if inertia else column.without_mass(run.time)
    assert np.max(np.abs(x - expected)) < 1e-7
    assert np.min(x) < 0.19
    assert x[-1] == pytest.approx(0.25, abs=1e-3)
    np.testing.assert_allclose(x + run.fill_ratio["C"], 0.5, rtol=0, atol=1e-15)
    assert run.fill_ratio["B"] == pytest.approx(0.25, abs=0)
    assert run.outcome is Outcome.DRIFTING


@pytest.mark.parametrize("gas", ["vented", "trapped"])
@pytest.mark.parametrize("inertia", [True, False])
def test_no_crest_is_the_limit_of_a_crest_at_the_port(tmp_path: Path, inertia: bool, gas: HumpGas) -> None:
    runs = []
    for crest in ("", "44.4 mm"):
        scene = scene_of(tmp_path, crest=crest)
        scene = with_tables(scene, tube={"hump_gas": gas})
        runs.append(once(scene, calibrated_model(scene), inertia=inertia))
    ours, limit = (np.interp(np.linspace(0, 2, 200), run.time, run.fill_ratio["A"]) for run in runs)
    assert np.max(np.abs(ours - limit)) < 1e-8


@pytest.mark.parametrize("inertia", [True, False])
def test_a_chamber_that_has_run_dry_is_filled_again(tmp_path: Path, inertia: bool) -> None:
    scene = scene_of(tmp_path, time_limit=5.0)
    run = once(scene, calibrated_model(scene), inertia=inertia, gas_time=1.5)
    assert np.min(run.fill_ratio["A"]) == 0.0
    assert run.fill_ratio["A"][-1] == pytest.approx(0.25, abs=1e-3)


def test_a_crest_inside_the_level_holds_under_both_laws(tmp_path: Path) -> None:
    scene = scene_of(tmp_path, crest="31.5 mm")
    for model in (calibrated_model(scene), paper_model(scene)):
        run = once(scene, model, inertia=False)
        closed = run.time >= GAS_TIME
        assert np.ptp(run.fill_ratio["A"][closed]) == 0.0


LOOP = """
[controller]
kind = "{kind}"
limit = "0.5 um"
proportional = "0.03 s/um"
"""


@pytest.mark.parametrize("law", ["calibrated", "paper"])
@pytest.mark.parametrize("crest", ["", "44 mm"])
def test_runs_and_draws_refuse_to_call_it_settled(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], law: str, crest: str
) -> None:
    scene_of(tmp_path, crest=crest, time_limit=20.0, more=LOOP.format(kind="target_vector"))
    file = str(tmp_path / "scene.toml")
    assert main(["simulate", file, "--law", law, "--json"]) == 1
    result = json.loads(capsys.readouterr().out)
    assert (result["settled"], result["outcome"], result["settling_time_s"]) == (False, "drifting", None)
    assert result["gas_line"]["holds"] is False
    assert all(end["smallest_correction_m"] is None for end in result["gas_line"]["ends"])
    balancer = balancer_of(load_scene(tmp_path / "scene.toml"), flow_law=None if law == CALIBRATED else law)
    drawn = judged_all(balancer, [{}], most=16)[0]
    assert drawn.fraction.count == 0
    assert set(drawn.outcomes.ended) == {"drifting"}


@pytest.mark.parametrize("kind", ["trial", "law_based"])
def test_other_algorithms_lose_the_correction_too(tmp_path: Path, kind: str) -> None:
    scene = scene_of(tmp_path, time_limit=20.0, more=LOOP.format(kind=kind))
    assert simulate(scene, calibrated_model(scene)).outcome is Outcome.DRIFTING


def test_a_vibration_within_its_limit_needs_no_crest(tmp_path: Path) -> None:
    scene = scene_of(tmp_path, time_limit=20.0, more=LOOP.format(kind="target_vector"))
    small = with_tables(scene, rotor={"initial_amplitude": 0.4e-6})
    assert simulate(small, calibrated_model(scene)).settled


@pytest.mark.parametrize("crest", ["", "36 mm", "44 mm"])
def test_an_untraced_run_is_the_traced_one(tmp_path: Path, crest: str) -> None:
    loop = LOOP.format(kind="target_vector")
    scene = scene_of(tmp_path, crest=crest, time_limit=6.0, more=loop)
    if crest != "44 mm":
        scene = with_tables(scene, rotor={"initial_amplitude": 4e-6})
    model = calibrated_model(scene)
    run = simulate(scene, model)
    result = balancer_of(scene).run({}, AS_GIVEN)
    assert result.settled[0] == run.settled
    assert (result.ended[0] == "drifting") == (run.outcome is Outcome.DRIFTING)
    # An untraced run's injection ends within 1e-6 in fill of a single run's; a fill of 1e-6 is 1e-10 m here.
    assert result.final_amplitude[0] == pytest.approx(run.amplitude[-1], abs=1e-9)


def test_calibrate_says_what_holds(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    # Ambient pressure less that of vapour holds a column up to r^2 = a^2 - 2 p/(rho omega^2).
    expected = {"": False, "44 mm": False, "31.5 mm": True}
    for crest, holds in expected.items():
        scene = scene_of(tmp_path, crest=crest)
        assert main(["calibrate", str(tmp_path / "scene.toml"), "--json"]) == 0
        document = json.loads(capsys.readouterr().out)
        known, result = by_key(document), document["holding"]
        assert result["holds"] is holds
        codes = {each["code"] for each in document["findings"]}
        assert bool(codes & {"no_crest_holds", "no_crest", "crest_too_low", "crest_undecided"}) is not holds
        level = 0.0445**2 - known["largest_fill_ratio"]["value"] * (0.0445**2 - 0.0205**2)
        pull = scene.liquid.density * scene.rotor.speed**2 / 2
        spare = (scene.gas.ambient_pressure - scene.liquid.vapour_pressure) / pull
        assert result["largest_hump_radius_m"] == pytest.approx(math.sqrt(level - spare), rel=1e-9)


def printed_scene(page: str) -> str:
    text = (Path(__file__).parents[2] / page).read_text(encoding="utf-8")
    shown = re.search(r"```toml\n(.*?)```", text, re.DOTALL)
    assert shown is not None
    return shown.group(1)


def test_the_scene_that_the_readme_prints_settles(tmp_path: Path) -> None:
    (tmp_path / "my_disc.toml").write_text(printed_scene("README.md"))
    assert main(["simulate", str(tmp_path / "my_disc.toml")]) == 0


@pytest.mark.parametrize("page", ["README.md", "docs/scene-file.md"])
def test_the_scenes_that_documents_print_hold(page: str, tmp_path: Path) -> None:
    (tmp_path / "my_disc.toml").write_text(printed_scene(page))
    assert rb.calibrate(rb.load_scene(tmp_path / "my_disc.toml")).holding.holds


def test_fit_refuses_injections_that_leave_nothing_behind(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    data = Path(__file__).parents[2] / "scenes" / "measurements" / "transfer.csv"
    scene_of(tmp_path)
    assert main(["fit", str(tmp_path / "scene.toml"), str(data)]) == 2
    assert "tube.hump_radius" in capsys.readouterr().err
