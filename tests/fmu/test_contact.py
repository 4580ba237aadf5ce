"""A finger that a host moves: the components feel what `cutis run` feels, and tell by what it would change."""

import csv
import shutil
import subprocess

import numpy as np
import pytest
from conftest import RELEASE, ROOT, Archive, Host2, Host3
from fmpy.validation import validate_fmu

SCENE = ROOT / "tests" / "scenes" / "contact.toml"
STEPS, DT = 4, 0.25


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("contact")
    for command in ["fmu", "run"]:
        done = subprocess.run([RELEASE / "cutis", command, SCENE, "-o", folder], capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
    return folder


def drive(host):
    """The scene's programme; the force on the finger after each step."""
    host.initialise()
    force = []
    for k in range(1, STEPS + 1):
        host.set("bone.translation", [0, 0, 0, 0.002 * k / STEPS, 0, -0.004 * k / STEPS])
        host.set("bone.rotation", [0, 0, 0, 0, 0.1 * k / STEPS, 0])
        host.step((k - 1) * DT, DT)
        force.append(np.asarray(host.get("contact.force")).ravel())
    return np.array(force)


@pytest.mark.parametrize("name, host", [("cutis.fmu", Host3), ("cutis_fmi2.fmu", Host2)])
def test_a_component_feels_what_the_programme_feels(folder, name, host):
    assert validate_fmu(str(folder / name)) == []
    archive = Archive(folder / name)
    host = host(archive)
    force = drive(host)
    with open(folder / "ports.csv") as file:
        rows = list(csv.DictReader(file))[1:]
    wanted = np.array([[float(row[f"contact.force.tip.{c}"]) for c in "xyz"] for row in rows])
    assert np.array_equal(force, wanted)
    assert force[-1, 2] > 1.0 and np.all(np.diff(force[:, 2]) > 0.0)
    assert 0.0 < np.asarray(host.get("contact.depth")).item() < 1e-3
    host.close()
    shutil.rmtree(archive.folder, ignore_errors=True)


def test_the_stiffness_that_a_finger_feels_is_a_directional_derivative(folder):
    archive = Archive(folder / "cutis.fmu")
    host = Host3(archive)
    drive(host)
    reference = {name: v.valueReference for name, v in host.variables.items()}
    seed = [0.0, 0.0, 0.0, 0.0, 0.0, 1.0]
    stiffness = host.fmu.getDirectionalDerivative(
        [reference["bone.reactionForce"]], [reference["bone.translation"]], seed, 6
    )
    state, before = host.fmu.getFMUState(), host.get("contact.force").ravel()
    host.set("bone.translation", [0, 0, 0, 0.002, 0, -0.004 - 2e-5])
    host.step(STEPS * DT, DT)
    difference = (host.get("contact.force").ravel() - before) / -2e-5
    assert stiffness[5] < 0.0, "pushed further in, it is pushed back harder"
    assert np.allclose(stiffness[3:], difference, atol=0.05 * abs(stiffness[5]))
    host.fmu.freeFMUState(state)
    host.close()
    shutil.rmtree(archive.folder, ignore_errors=True)
