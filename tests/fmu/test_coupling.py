"""The coupled jaw of examples/coupling, a few steps of it: stable where it should be, and the Jacobian is that of the reaction."""

import subprocess
import sys

import numpy as np
import pytest
from conftest import RELEASE, ROOT

sys.path.insert(0, str(ROOT / "examples" / "coupling"))
import jaw  # noqa: E402


@pytest.fixture(scope="module")
def tissue(tmp_path_factory):
    folder = tmp_path_factory.mktemp("coupling")
    scene = ROOT / "examples" / "coupling" / "scene.toml"
    subprocess.run([RELEASE / "cutis", "fmu", scene, "-o", folder], check=True)
    tissue = jaw.Tissue(str(folder / "cutis.fmu"))
    yield tissue
    tissue.close()


def test_the_jacobian_is_the_slope_of_the_reaction(tissue):
    q, d, h = np.array([0.0, -1e-3, -2e-3, 0.02, 0.0, 0.0]), np.array([1.0, 2.0, -1.0, 9.0, 5.0, -7.0]), 1e-5
    tissue.start()
    tissue.step(0.0, 0.01, q)
    K = tissue.jacobian()
    ahead, behind = tissue.step(0.01, 0.01, q + h * d), tissue.step(0.02, 0.01, q - h * d)
    slope = (ahead - behind) / (2 * h)
    assert np.abs(K @ d - slope).max() < 1e-3 * np.abs(slope).max()


def test_large_steps_are_stable_with_the_jacobian_only(tissue):
    table, _ = jaw.survey(tissue, steps=[0.004, 0.02], end=0.2, fine=0.002)
    (_, explicit_small, jacobian_small), (_, explicit_large, jacobian_large) = table
    assert explicit_small < 1e-3 and jacobian_small < 1e-3
    assert explicit_large is None, "20 ms were to be too much without the Jacobian"
    assert jacobian_large < 3e-3
