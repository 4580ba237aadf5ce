"""The examples of docs/meshes.md as they stand there: the scripts write meshes, the scenes under them take them."""

import re
import subprocess
import sys

import pytest
from conftest import RELEASE, ROOT

BLOCKS = re.findall(r"```(python|toml)\n(.*?)```", (ROOT / "docs" / "meshes.md").read_text(), re.DOTALL)
PAIRS = list(zip(BLOCKS[::2], BLOCKS[1::2]))
NEEDS = ["gmsh", "meshio"]


@pytest.mark.parametrize("needs, pair", list(zip(NEEDS, PAIRS)), ids=NEEDS)
def test_examples_run(needs, pair, tmp_path):
    (script_kind, script), (scene_kind, scene) = pair
    assert (script_kind, scene_kind) == ("python", "toml") and f"import {needs}" in script
    if subprocess.run([sys.executable, "-c", f"import {needs}"], capture_output=True).returncode != 0:
        pytest.skip(f"{needs} is not installed, or lacks a library of this machine")
    subprocess.run([sys.executable, "-c", script], cwd=tmp_path, check=True, capture_output=True)
    (tmp_path / "scene.toml").write_text(scene)
    done = subprocess.run([RELEASE / "cutis", "check", "scene.toml"], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "bone skull" in done.stdout and "faces skin" in done.stdout, done.stdout
    regions = re.findall(r"region (\w+): (\d+) tets", done.stdout)
    assert len(regions) == 2 and all(int(n) > 50 for _, n in regions), done.stdout
    # Whatever winding the writer chose, nothing else may be wrong with its mesh.
    doubts = [line for line in done.stdout.splitlines() if line.startswith("warning") and f"{needs}." in line]
    assert all("wound inward" in line for line in doubts), doubts


def test_every_example_is_run():
    assert len(PAIRS) == len(NEEDS) and len(BLOCKS) == 2 * len(PAIRS)
