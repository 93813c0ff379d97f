"""Registry of the kinds of balancers and of the paths of their parts.

`scene` contains no kind by itself.  `ringbalance/__init__.py` registers each kind with paths "module:name"
of its parts, which are imported for the first scene of the kind: lower packages import no higher one, and a
calibration never loads modules of eccentric masses.

Another package brings a kind by an entry point of the group `ringbalance.balancers`, whose name is the word
of the scene's key `balancer` and whose value is a function without arguments that calls `register`.  It is
loaded for the first scene of that word, so that no other command depends on it.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any, Final, Literal

from ringbalance.scene.faults import SceneError

Part = Literal["scene", "balancer", "sentences", "report", "function"]
GROUP: Final = "ringbalance.balancers"
"""Group of the entry points."""

_PATHS: dict[tuple[Part, str], str] = {}
"""Path by part and name of a kind of balancer, or by name of a function; the first kind is the default."""
_PACKAGES: dict[str, str] = {}
"""Name and version of the package that brought a kind, by the kind's name; none for the program's own."""


def register(name: str, *, scene: str, balancer: str, sentences: str = "", report: str = "") -> None:
    """Make a kind of balancer known to every command.

    Args: `name`: word of the scene's key `balancer`. `scene`: path "module:name" of its
        `ringbalance.scene.kinds.SceneKind`. `balancer`: path of its class, of the shape of
        `ringbalance.controller.balancer.Balancer`. `sentences`: path of a mapping from the codes of its
        findings to their severity, text and change, as in `results/sentences.toml`; a finding has the code
        "name.code" then. `report`: path of the sections of its report (`ringbalance.reports.section`), or
        default those of any balancer.
    Raises: ValueError: the name is taken.

    Example:
        >>> kind, balancer = "ball_balancer.scene_keys:KIND", "ball_balancer.balancer:BallBalancer"
        >>> rb.register("ball", scene=kind, balancer=balancer)
    """
    paths = {"scene": scene, "balancer": balancer, "sentences": sentences, "report": report}
    parts: dict[tuple[Part, str], str] = {(part, name): path for part, path in paths.items() if path}  # type: ignore[misc]
    if ("scene", name) in _PATHS and any(_PATHS.get(key) != path for key, path in parts.items()):
        raise ValueError(f'the name "{name}" is taken by another balancer')
    _PATHS.update(parts)


def register_function(name: str, *, path: str) -> None:
    """Register a function by its path "module:name", which is imported at first use.

    For functions of a higher package, or of one that is slow to load.
    """
    _PATHS["function", name] = path


def known_balancers() -> tuple[str, ...]:
    """Words of the key `balancer` for which nothing more is to be loaded, the default first."""
    return tuple(name for part, name in _PATHS if part == "scene")


def installed_balancers() -> dict[str, str]:
    """Name and version of the package of every balancer that another package brings, by the balancer's name.

    Two packages that bring one name are both named.  No package is loaded.
    """
    packages: dict[str, str] = {}
    for each in sorted(_entry_points(), key=lambda each: (each.name, each.dist.name)):
        package = f"{each.dist.name} {each.dist.version}"
        packages[each.name] = f"{packages[each.name]} and {package}" if each.name in packages else package
    return packages


def has_balancer(name: str) -> bool:
    """True if a name is that of a balancer; packages are searched for a name that is not known alone."""
    return name in known_balancers() or name in installed_balancers()


def registered(part: Part, name: str) -> Any:
    """Object registered under a name.

    Raises: KeyError: nothing was. SceneError: the package that brings the balancer cannot be used.
    """
    if part != "function" and ("scene", name) not in _PATHS:
        _load(name)
    path = _PATHS[part, name]
    try:
        return imported(path)
    except (Exception, SystemExit) as error:
        if part == "function" or name not in _PACKAGES:
            raise
        raise unusable(name, f"{path}: {_reason(error)}") from error


def registered_or_none(part: Part, name: str) -> Any:
    """Object registered under a name; None if the balancer of that name brings none."""
    try:
        return registered(part, name)
    except KeyError:
        return None


def unusable(name: str, problem: str) -> SceneError:
    """Error of a balancer that cannot be used, which names its package."""
    file = f"package {_PACKAGES[name]}" if name in _PACKAGES else "balancer"
    allowed = "scenes of other balancers until that is mended"
    return SceneError.of_file(file, f'its balancer "{name}" cannot be used: {problem}', allowed)


def imported(path: str) -> Any:
    """Import the object at a path "module:name"."""
    module, _, attribute = path.partition(":")
    return getattr(import_module(module), attribute)


def _entry_points() -> list[Any]:
    # The reader of metadata takes longer to load than the rest of `import ringbalance`.
    return list(imported("importlib.metadata:entry_points")(group=GROUP))


def _load(name: str) -> None:
    """Let the package that brings a balancer register it; what a broken one has registered is taken back."""
    points, before = [each for each in _entry_points() if each.name == name], dict(_PATHS)
    if not points:
        return
    _PACKAGES[name] = installed_balancers()[name]
    try:
        if len(points) > 1:
            raise ValueError("each of these packages brings a balancer of that name; uninstall the others")
        points[0].load()()
        if ("scene", name) not in _PATHS:
            raise LookupError(f"{points[0].value} registers no balancer of that name")
    except (Exception, SystemExit) as error:
        _PATHS.clear()
        _PATHS.update(before)
        raise unusable(name, _reason(error)) from error


def _reason(error: BaseException) -> str:
    """Type and text of an error, on one line."""
    return f"{type(error).__name__}: {' '.join(str(error).split())}"
