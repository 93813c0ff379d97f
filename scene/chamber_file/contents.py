"""What a mesh file holds, in its own numbers and unit, whatever its format; and what is wrong with it."""

from __future__ import annotations

import warnings
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from ringbalance.scene.arrays import FloatArray, IntArray
from ringbalance.scene.rules.check import Finding


class MeshFileError(Exception):
    """A mesh that cannot be used. Args: `findings`: what is wrong, at least one."""

    def __init__(self, findings: Iterable[Finding]) -> None:
        self.findings = tuple(findings)
        super().__init__("; ".join(each.problem for each in self.findings))

    @classmethod
    def of(cls, problem: str, allowed: str = "") -> MeshFileError:
        """The error of a file in which nothing further can be looked at."""
        return cls([Finding(problem=problem, allowed=allowed)])


@dataclass(frozen=True, kw_only=True)
class Elements:
    """Elements of one kind that have the same names."""

    kind: str
    """Name of meshio; of a kind that no chamber has, what its format calls it."""
    numbers: IntArray
    """As the file has them."""
    nodes: IntArray
    """Numbers of their nodes as the file has them, in meshio's order, shape (elements, nodes)."""
    names: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Contents:
    """What a mesh file holds."""

    node_numbers: IntArray
    """As the file has them."""
    coordinates: FloatArray
    """In the file's unit, shape (nodes, 3)."""
    blocks: tuple[Elements, ...]
    other_names: tuple[str, ...] = ()
    """Names that no element has, for messages."""


def numbers_in(body: bytes, what: str) -> FloatArray:
    """The numbers of a text between spaces and line ends. Raises: MeshFileError: it holds anything else."""
    if not body.strip():
        return np.empty(0)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            return np.fromstring(body, dtype=np.float64, sep=" ")
        except (DeprecationWarning, ValueError) as error:
            raise MeshFileError.of(
                f"{what} holds something other than numbers: the file is damaged"
            ) from error


def whole(values: FloatArray, what: str) -> IntArray:
    """The same numbers as integers. Raises: MeshFileError: one of them is none."""
    with np.errstate(invalid="ignore"):
        found = values.astype(np.int64)
        exact = (found == values) & (np.abs(values) < 2**53)
    if not exact.all():
        raise MeshFileError.of(f"{what} has a fraction where a whole number belongs: the file is damaged")
    return found
