"""The command `ringbalance fit`."""

from __future__ import annotations

from pathlib import Path

from ringbalance.identification.cli import DONE, keep_inputs, run_fit
from ringbalance.identification.documents import against_fit
from ringbalance.identification.fitting import Loss
from ringbalance.identification.reading import template as template_of
from ringbalance.reports.simulate_cli import check_output
from ringbalance.scene.platform.files import write_whole


def fit(
    scene: Path | None = None,
    *data: Path,
    parameters: str | None = None,
    loss: Loss = "linear",
    next: str | None = None,
    save: Path | None = None,
    plot: Path | None = None,
    json: bool = False,
    template: str | None = None,
) -> int:
    """Fit parameters of a built disc to measurements, with intervals and what the data identify.

    Args:
        scene: the scene file of the disc as it was designed.
        data: files of measurements (docs/fit.md), one kind in each.
        parameters: names with commas between, such as "bore,extra_loss"; default those that the kinds of data
            tell most about.
        loss: "soft_l1" counts outliers less, and says which rows they are.
        next: the parameter for which to say what to measure next; default the one that the data identify
            least.
        save: also write the fitted scene to this file, for all other commands.
        plot: also draw the data against the fit on one sheet, an SVG file.
        json: print one JSON document instead of tables.
        template: print an empty file of measurements of this kind, with explanations, and do nothing else.

    Returns:
        Exit code: 1 when the fit does not describe the data.

    Raises:
        SceneError: a scene, a file of measurements or a parameter that cannot be used.
        OSError: the fitted scene or the plot cannot be written.
    """
    if template is not None:
        print(template_of(template), end="")
        return DONE
    check_output("--plot", plot, ".svg")
    if plot is not None and scene is not None:
        keep_inputs(plot, (scene, *data))
    code, result = run_fit(scene, data, parameters=parameters, loss=loss, next=next, save=save, json=json)
    if plot is not None:
        # Loading what draws takes as long as a short fit.
        from ringbalance.reports.figure import sheet  # noqa: PLC0415
        from ringbalance.reports.pages.measured import fit_figures  # noqa: PLC0415

        write_whole(plot, sheet(fit_figures(against_fit(result))))
    return code
