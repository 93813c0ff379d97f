"""Tables and executors of other packages, where they are installed; one clear error where they are not."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import ringbalance as rb
from ringbalance.scene.models import Scene

VARY = {"tube.bore": [1e-3, 2e-3], "gas.pressure": np.linspace(0.4e6, 0.8e6, 3)}


@pytest.fixture
def sweep(paper_scene: Scene) -> rb.Sweep:
    return rb.sweep(paper_scene, VARY, intervals=False)


@pytest.mark.parametrize(("package", "method"), [("pandas", "to_pandas"), ("xarray", "to_xarray")])
def test_a_missing_package_is_named(
    sweep: rb.Sweep, monkeypatch: pytest.MonkeyPatch, package: str, method: str
) -> None:
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(ModuleNotFoundError, match=rf"{package}: pip install .*sweep-tables"):
        getattr(sweep, method)()


def test_a_frame_goes_through_parquet(sweep: rb.Sweep, tmp_path: Path) -> None:
    pandas = pytest.importorskip("pandas")
    pytest.importorskip("pyarrow")
    frame = sweep.to_pandas()
    frame.to_parquet(tmp_path / "sweep.parquet")
    pandas.testing.assert_frame_equal(pandas.read_parquet(tmp_path / "sweep.parquet"), frame)
    assert frame["velocity [m/s]"][5] == sweep.static[5]["values"]["velocity"][0]


def test_a_dataset_has_axes_and_units(sweep: rb.Sweep) -> None:
    pytest.importorskip("xarray")
    data = sweep.to_xarray()
    assert data["gas.pressure"].attrs["units"] == "Pa"
    assert data["velocity"].attrs["units"] == "m/s"
    assert data["velocity"].dims == ("tube.bore", "gas.pressure")
    assert data["velocity"].values[1, 2] == sweep.static[5]["values"]["velocity"][0]


@pytest.fixture
def executor(monkeypatch: pytest.MonkeyPatch) -> Iterator[object]:
    distributed = pytest.importorskip("distributed")
    # Workers find what this process finds.
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(sys.path))
    with (
        distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster,
        distributed.Client(cluster) as client,
    ):
        yield client.get_executor()


@pytest.mark.heavy
@pytest.mark.filterwarnings("default")
def test_two_dask_workers_give_the_same_table(paper_scene: Scene, executor: object) -> None:
    vary = {"tube.bore": "1mm:2mm", "gas.pressure": "0.5MPa:0.9MPa"}
    serial = rb.sweep(paper_scene, vary, sample="latin:8", runs=16)
    spread = rb.sweep(paper_scene, vary, sample="latin:8", runs=16, executor=executor, workers=2)  # type: ignore[arg-type]
    assert spread.to_csv() == serial.to_csv()
