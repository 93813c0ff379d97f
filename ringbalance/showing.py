"""The panel of a scene, for Python and as a command."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from types import SimpleNamespace

from ringbalance.interface import checked
from ringbalance.panels.content import content_of
from ringbalance.panels.document import Panel, document_of
from ringbalance.scene import AnyScene, load_scene
from ringbalance.scene.narrowing import liquid_ring_scene
from ringbalance.scene.platform.terminal import activity, print_message


@checked
def panel(
    scene: AnyScene, *, vary: Sequence[str] = (), progress: Callable[[str], None] | None = None
) -> Panel:
    """Page on which one watches the scene's rotor being balanced, in one file that loads nothing.

    The exported disc and controller run in the browser, with the scene's drawn devices beside them.
    Args: `vary`: axes of designs that a slider moves through, such as "tube.bore=1mm:2mm:5", as in `sweep`.
        `progress`: called with a text.
    Returns: The page; `save(path)` writes it, a notebook shows it.
    Raises: SceneError: no liquid ring, a disc that cannot be exported, or axes that cannot be used.

    Example:
        >>> scene = rb.load_scene(rb.bundled_scene("liquid_ring_paper"))
        >>> panel = rb.panel(scene)
        >>> "<script" in panel.html
        True
    """
    content = content_of(liquid_ring_scene(scene), vary=vary, progress=progress or (lambda _: None))
    return Panel(name=scene.name, html=document_of(content))


def panel_file(options: SimpleNamespace) -> int:
    """Run the command `panel`: write the page."""
    scene = liquid_ring_scene(load_scene(options.scene))
    with activity("panel", "reading") as shown:
        page = panel(scene, vary=options.vary or (), progress=shown.show)
    page.save(options.out)
    print(options.out)
    print_message(f"{len(page.html.encode()) / 1000:.0f} kB; open it in a browser, it loads nothing")
    return 0
