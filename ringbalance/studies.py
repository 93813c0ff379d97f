"""The longer studies as a Python user calls them: fit, trade, extremes, pictures, report and cases."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any, Literal

from ringbalance.identification.criticism import Review
from ringbalance.identification.documents import fit_document, fit_rows
from ringbalance.identification.fitting import FitResult, FittedParameter, Loss
from ringbalance.identification.fitting import fit as fit_scene
from ringbalance.identification.kinds.kind import Observations
from ringbalance.identification.next_measurement import NextMeasurement, next_measurement
from ringbalance.identification.parameters import FitError
from ringbalance.identification.reading import read_observations
from ringbalance.reports.cli import draw_pictures
from ringbalance.reports.report import Report
from ringbalance.reports.report import write_report as write_scene_report
from ringbalance.results.result import Result, Rows
from ringbalance.scene import AnyScene, SceneError
from ringbalance.scene.changes import checked_scene, document_of
from ringbalance.scene.narrowing import liquid_ring_scene
from ringbalance.scene.toml import toml_bytes
from ringbalance.verification.extremes.study import SIZES, Extremes, find_extremes
from ringbalance.verification.result import CaseResult
from ringbalance.verification.runner import run_cases as run_scene_cases
from ringbalance.verification.trade import TradeStudy, trade_study

Level = Literal["light", "heavy"]


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Fit(Result):
    """A fit with the tests of its residuals and the measurement that would help most.

    Example:
        >>> scene = rb.load_scene(rb.bundled_scene("liquid_ring_paper"))
        >>> data = rb.bundled_scene("liquid_ring_paper").parent / "measurements" / "trial_weight.csv"
        >>> print(rb.fit(scene, data))
        Pan's liquid-ring disc (liquid_ring_paper.toml), fitted to 7 measurements
          influence_coefficient (0.011226 ± 0.000060) um/(g mm)
          lag_angle (19.25 ± 0.31)°
          nothing in the residuals speaks against the fit (4 tests, 5 % level)
    """

    result: FitResult
    data: tuple[Observations, ...]
    review: Review
    next_measurement: NextMeasurement

    @property
    def parameters(self) -> tuple[FittedParameter, ...]:
        """Each with its value and its interval (95 %), SI, and whether the data identify it."""
        return self.result.parameters

    @property
    def succeeded(self) -> bool:
        """Whether the fit describes the data, as they are read."""
        return self.review.describes

    def to_dict(self) -> dict[str, Any]:
        """What `ringbalance fit --json` prints."""
        return fit_document(
            self.result, data=self.data, review=self.review, next_measurement=self.next_measurement
        )

    def rows(self) -> Rows:
        """Each parameter, whether the fit describes the data, and what else they say."""
        return fit_rows(
            self.result, data=self.data, review=self.review, next_measurement=self.next_measurement
        )


def fit(
    scene: AnyScene,
    data: str | PathLike[str] | Sequence[str | PathLike[str]],
    *,
    parameters: Sequence[str] | None = None,
    loss: Loss = "linear",
    next: str | None = None,
) -> Fit:
    """Fit parameters of a built disc to files of measurements, with intervals and what the data identify.

    Args: `data`: one file or several, one kind of measurement in each. `parameters`: names; default those
        that the kinds of data inform. `loss`: "soft_l1" counts outliers less. `next`: the parameter for which
        to find the next measurement; default the one that the data identify least.
    Raises: SceneError: a scene, a file or a parameter that cannot be used.

    Example:
        >>> scene = rb.load_scene(rb.bundled_scene("liquid_ring_paper"))
        >>> data = rb.bundled_scene("liquid_ring_paper").parent / "measurements" / "trial_weight.csv"
        >>> [parameter.name for parameter in rb.fit(scene, data).parameters]
        ['influence_coefficient', 'lag_angle']
    """
    scene = checked_scene(scene)
    files = [data] if isinstance(data, str | PathLike) else data
    observations = read_observations([Path(each) for each in files], scene=scene)
    try:
        result = fit_scene(scene, data=observations, parameters=parameters, loss=loss)
    except FitError as error:
        raise SceneError.of_file(scene.file, str(error)) from error
    if next is not None and next not in (names := [each.name for each in result.parameters]):
        problem = "this parameter is not fitted"
        raise SceneError.of_option(option="next", value=next, problem=problem, allowed=", ".join(names))
    return Fit(
        result=result,
        data=observations,
        review=Review.of(result),
        next_measurement=next_measurement(result, next),
    )


def trade(
    scene: AnyScene, *, level: Level = "heavy", progress: Callable[[str], None] | None = None
) -> TradeStudy:
    """Measure speed against accuracy on a scene: designs a second and error of every model.

    Args: `level`: "light" leaves out the meshes in three dimensions. `progress`: called with each title.
    Raises: SceneError: a scene that cannot be used.

    Example:
        >>> scene = rb.load_scene(rb.bundled_scene("liquid_ring_paper"))
        >>> study = rb.trade(scene, level="light")
        >>> len(study.to_dict()["models_used"]) > 10
        True
    """
    return trade_study(liquid_ring_scene(checked_scene(scene)), level=level, progress=progress)


def extremes(
    scene: AnyScene,
    *,
    level: Level = "light",
    workers: int = 1,
    progress: Callable[[str, int, int], None] | None = None,
) -> Extremes:
    """Find where results of a scene stop, what is said beyond, and whether the invariants hold inside.

    Args: `level`: "heavy" judges thousands of points. `workers`: processes. `progress`: called with what is
        being done, the points done and their number.
    Raises: SceneError: a scene that cannot be used, or whose chamber is imported.

    Example:
        >>> scene = rb.load_scene(rb.bundled_scene("liquid_ring_paper"))
        >>> study = rb.extremes(scene)
        >>> study.to_dict()["violations"]
        []
    """
    given = liquid_ring_scene(checked_scene(scene))
    return find_extremes(given, size=SIZES[level], workers=workers, progress=progress)


def plot(scene: AnyScene, out: str | PathLike[str]) -> tuple[Path, ...]:
    """Draw the 3-D pictures of a scene into a folder, and its fields for ParaView.

    Without OpenGL the fields alone are written, with a warning.
    Returns: The files.
    Raises: SceneError: a scene that cannot be used. OSError: the folder cannot be written.

    Example:
        >>> scene = rb.load_scene(rb.bundled_scene("liquid_ring_paper"))
        >>> files = rb.plot(scene, "pictures")
        >>> ".vtu" in {path.suffix for path in files}
        True
    """
    pictures = draw_pictures(liquid_ring_scene(checked_scene(scene)), Path(out))
    if not pictures["drawn"]:
        warnings.warn(pictures["text"], RuntimeWarning, stacklevel=2)
    folders = Path(out) / "figures", Path(out) / "fields"
    return tuple(path for folder in folders for path in sorted(folder.glob("*.*")))


def write_report(
    scene: AnyScene,
    out: str | PathLike[str],
    *,
    level: Level = "light",
    workers: int = 1,
    progress: Callable[[str], None] | None = None,
) -> Report:
    """Verify, calibrate, simulate and draw a scene into one folder.

    Args: `level`: "heavy" also runs the cases that take long. `workers`: processes, this one included.
        `progress`: called with what is being done.
    Raises: SceneError: a scene that cannot be used; nothing is written.
    Raises: OSError: the folder cannot be written.

    Example:
        >>> scene = rb.load_scene(rb.bundled_scene("liquid_ring_paper"))
        >>> report = rb.write_report(scene, "out")
        >>> report.page.name
        'report.html'
    """
    scene = checked_scene(scene)
    return write_scene_report(
        scene,
        Path(out),
        level=level,
        scene_text=toml_bytes(document_of(scene)).decode(),
        workers=workers,
        progress=progress,
    )


def run_cases(
    case_ids: Sequence[str] = (),
    *,
    scene: AnyScene,
    level: Level = "light",
    mutations: bool = False,
    workers: int = 1,
    progress: Callable[[CaseResult], None] | None = None,
) -> tuple[CaseResult, ...]:
    """Run several verification cases, or all, and return their results in the order asked for.

    Args: `level`: "light" leaves heavy cases `not run`. `mutations`: also with each case's mutations.
        `workers`: processes, this one included. `progress`: called with each result, in order.
    Raises: KeyError: an unknown case. SceneError: a balancer without liquid.

    Example:
        >>> scene = rb.load_scene(rb.bundled_scene("liquid_ring_paper"))
        >>> (case,) = rb.run_cases(["claim_01_volume"], scene=scene)
        >>> case.verdict.value
        'confirmed'
    """
    return run_scene_cases(
        case_ids,
        scene=checked_scene(scene),
        level=level,
        mutations=mutations,
        workers=workers,
        progress=progress,
    )
