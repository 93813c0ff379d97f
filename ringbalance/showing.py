"""The panel of a scene, for Python and as a command."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from types import SimpleNamespace

from ringbalance.controller.eccentric_mass.scene_records import EccentricScene
from ringbalance.interface import checked
from ringbalance.panels.content import content_of
from ringbalance.panels.document import Panel, document_of
from ringbalance.panels.masses import masses_document
from ringbalance.scene import AnyScene, load_scene
from ringbalance.scene.faults import SceneError
from ringbalance.scene.narrowing import liquid_ring_scene
from ringbalance.scene.platform.terminal import activity, print_message

_NO_DESIGNS = "the page of eccentric masses has one design"


@checked
def panel(
    scene: AnyScene, *, vary: Sequence[str] = (), progress: Callable[[str], None] | None = None
) -> Panel:
    """Page on which one watches the scene's rotor being balanced, in one file that loads nothing.

    The exported controller and disc, or rotor with eccentric masses, run in the browser, with the scene's
    drawn devices.
    Args: `vary`: axes of designs that a slider moves through, such as "tube.bore=1mm:2mm:5", as in `sweep`.
        `progress`: called with a text.
    Returns: The page; `save(path)` writes it, a notebook shows it.
    Raises: SceneError: another balancer, a disc that cannot be exported, or axes that cannot be used.

    Example:
        >>> scene = rb.load_scene(rb.bundled_scene("liquid_ring_paper"))
        >>> panel = rb.panel(scene)
        >>> "<script" in panel.html
        True
    """
    show = progress or (lambda _: None)
    if isinstance(scene, EccentricScene):
        if vary:
            allowed, value = "a scene of a liquid ring", ", ".join(vary)
            raise SceneError.of_option(option="--vary", value=value, problem=_NO_DESIGNS, allowed=allowed)
        return Panel(name=scene.name, html=masses_document(scene, progress=show))
    content = content_of(liquid_ring_scene(scene), vary=vary, progress=show)
    return Panel(name=scene.name, html=document_of(content))


def panel_file(options: SimpleNamespace) -> int:
    """Run the command `panel`: write the page."""
    scene = load_scene(options.scene)
    with activity("panel", "reading") as shown:
        page = panel(scene, vary=options.vary or (), progress=shown.show)
    page.save(options.out)
    print(options.out)
    print_message(f"{len(page.html.encode()) / 1000:.0f} kB; open it in a browser, it loads nothing")
    return 0
