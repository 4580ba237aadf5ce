"""Muscles through the components: single-precision activations beside double-precision bones, in one input table."""

import shutil
import subprocess

import fmpy
import numpy as np
import pytest
from conftest import RELEASE, ROOT, Archive, Host3
from fmpy.validation import validate_fmu

SCENE = ROOT / "examples" / "smile.toml"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("smile")
    done = subprocess.run([RELEASE / "cutis", "fmu", SCENE, "-o", folder], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return folder


def activations(description, wanted):
    """The vector of activations; the rows stand in the variable's description."""
    muscle = next(v for v in description.modelVariables if v.name == "muscle.activation")
    rows = muscle.description.split("rows: ")[1].split(", ")
    return np.array([wanted.get(row, 0.0) for row in rows])


SMILE = {"zygomaticus_major_left": 0.5, "zygomaticus_major_right": 0.5}


def test_both_archives_are_valid(folder):
    for name in ["cutis.fmu", "cutis_fmi2.fmu"]:
        assert validate_fmu(str(folder / name)) == []


def test_a_host_activates_muscles_and_bones_in_one_run(folder):
    archive = folder / "cutis.fmu"
    description = fmpy.read_model_description(str(archive))
    smile = activations(description, SMILE)
    kinds = [("time", float), ("bone.rotation", float, (2, 3)), ("muscle.activation", np.float32, (len(smile),))]
    table = np.zeros(2, dtype=kinds)
    table["time"] = [0.0, 0.5]
    table["muscle.activation"][1] = smile
    result = fmpy.simulate_fmu(
        str(archive), input=np.array(table), output=["marker.position"], stop_time=0.6, output_interval=0.1, step_size=0.1
    )
    moved = result["marker.position"][-1] - result["marker.position"][0]
    assert moved[0, 2] > 0.002 and moved[1, 2] > 0.002, "both corners of the mouth go up"


def test_an_activation_reads_back_and_its_range_is_kept(folder):
    archive = Archive(folder / "cutis.fmu")
    host = Host3(archive, logging=True)
    reference = host.variables["muscle.activation"].valueReference
    smile = activations(host.about, SMILE).tolist()
    host.initialise()
    host.fmu.setFloat32([reference], smile)
    assert host.fmu.getFloat32([reference], nValues=len(smile)) == smile
    with pytest.raises(Exception):
        host.fmu.getFloat64([reference], nValues=len(smile))
    with pytest.raises(Exception):
        host.fmu.setFloat32([reference], [2.0] * len(smile))
    host.close()
    shutil.rmtree(archive.folder, ignore_errors=True)
