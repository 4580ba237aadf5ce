"""A real head through the whole line: CT -> tissue mesh -> component -> a host that opens the jaw.

The scene is the checked-in `examples/ct_head.toml`; the mesh is the lower face at a coarse edge. The data are not part of
the repository: their folder is `CUTIS_DATA`, or `../shared/data` beside it.
"""

import os
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from conftest import RELEASE, ROOT, Archive, Host3
from fmpy.validation import validate_fmu

DATA = Path(os.environ.get("CUTIS_DATA", ROOT.parent / "shared" / "data"))
CROP = [DATA / "cthead_face_bench.nii.gz", DATA / "cthead_face_bench_labels.nii.gz"]
EXAMPLE = ROOT / "examples" / "ct_head.toml"
DT = 1 / 8
STEPS = 4
DEGREES = 4.0
# Skin this high above the lips' line and this near the median plane lies on the upper jaw and the nose, m.
SKULL_SIDE = [0.020, 0.015]

pytestmark = pytest.mark.skipif(
    not all(p.exists() for p in CROP), reason=f"no CT data in {DATA} (set CUTIS_DATA): {', '.join(p.name for p in CROP)}"
)


def cutis(*arguments):
    done = subprocess.run([RELEASE / "cutis", *map(str, arguments)], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def line(tmp_path_factory):
    """What `cutis bake` printed, and the archive."""
    folder = tmp_path_factory.mktemp("ct")
    shutil.copy(EXAMPLE, folder)
    told = cutis("bake", CROP[0], "--labels", CROP[1], "--edge", 6, "-o", folder / "face.cutis")
    cutis("fmu", folder / EXAMPLE.name, "-o", folder)
    archive = Archive(folder / "cutis.fmu")
    yield told, archive
    shutil.rmtree(archive.folder, ignore_errors=True)


def turned(points, pivot, angle):
    """Points after a turn about the x axis through a pivot."""
    c, s = np.cos(angle), np.sin(angle)
    return (points - pivot) @ np.array([[1, 0, 0], [0, c, -s], [0, s, c]]).T + pivot


@pytest.fixture(scope="module")
def opened(line):
    """Rest and every step of an opening jaw: pivot and outputs."""
    host = Host3(line[1])
    host.initialise()
    names = ["skin.position", "marker.position", "bone.reactionForce", "quality.minDetF"]
    rows = [[host.get(name) for name in names]]
    rotation = np.zeros(host.shape("bone.rotation"))
    for k in range(STEPS):
        rotation[bones().index("mandible")] = [np.radians(DEGREES) * (k + 1) / STEPS, 0.0, 0.0]
        host.set("bone.rotation", rotation)
        host.step(k * DT, DT)
        rows.append([host.get(name) for name in names])
    pivot = host.get("bone.pivot")[bones().index("mandible")]
    host.close()
    return pivot, {name: np.array(column) for name, column in zip(names, zip(*rows))}


def names_of(table):
    return re.findall(rf'\[\[{table}\]\]\nname = "(\w+)"', EXAMPLE.read_text())


def bones():
    return names_of("bone")


def test_bake_tells_the_jaws_pivot(line):
    told = np.array(re.search(r"pivot = \[(.+), (.+), (.+)\]", line[0]).groups(), dtype=float)
    example = np.array(re.search(r"\npivot = \[(.+), (.+), (.+)\]", EXAMPLE.read_text()).groups(), dtype=float)
    # The jaw turns about a line along x: only its place in y and z matters.
    assert np.abs(told - example)[1:].max() < 0.004


def test_archive_is_valid(line):
    assert validate_fmu(str(line[1].path)) == []


def test_everything_is_finite_and_no_element_inside_out(opened):
    for name, values in opened[1].items():
        assert np.isfinite(values).all(), name
    assert opened[1]["quality.minDetF"].min() > 0.0


def test_skin_on_the_skull_is_still(opened):
    skin, markers = opened[1]["skin.position"], opened[1]["marker.position"]
    lips = markers[0][[i for i, n in enumerate(names_of("marker")) if n.startswith("lip")]].mean(axis=0)
    beside = np.abs(skin[0] - lips)
    high = (skin[0][:, 2] > lips[2] + SKULL_SIDE[0]) & (beside[:, 0] < SKULL_SIDE[1]) & (beside[:, 1] < 2 * SKULL_SIDE[1])
    moved = np.linalg.norm(skin[-1] - skin[0], axis=1)
    print(f"{high.sum()} vertices: {1e3 * moved[high].max():.2f} mm at most; of all {1e3 * moved.max():.2f} mm")
    assert high.sum() > 20
    assert moved[high].max() < 0.10 * moved.max()


def test_chin_follows_the_jaw(opened):
    pivot, outputs = opened
    chin = outputs["marker.position"][:, names_of("marker").index("pogonion")]
    for k in range(1, STEPS + 1):
        wanted = turned(chin[0], pivot, np.radians(DEGREES) * k / STEPS) - chin[0]
        found = chin[k] - chin[0]
        print(f"{DEGREES * k / STEPS:.0f} degrees: jaw {1e3 * wanted[1:].round(5)} mm, chin {1e3 * found[1:].round(5)} mm")
        assert np.linalg.norm(found - wanted) < 0.15 * np.linalg.norm(wanted)


def test_lips_part(opened):
    lips = opened[1]["marker.position"][:, [names_of("marker").index(f"lip_{w}") for w in ("upper", "lower")]]
    gap = np.linalg.norm(lips[:, 0] - lips[:, 1], axis=1)
    print(f"between the lips' markers: {1e3 * gap.round(5)} mm")
    assert (np.diff(gap) > 0.0).all() and gap[-1] > gap[0] + 1e-3


def test_reactions_sum_to_zero(opened):
    forces = opened[1]["bone.reactionForce"][-1]
    print(f"reactions: {forces.round(3)} N")
    assert np.abs(forces).max() > 0.1
    assert np.linalg.norm(forces.sum(axis=0)) < 1e-3 * np.abs(forces).max()
