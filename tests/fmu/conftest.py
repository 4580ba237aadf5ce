"""Where the archives, the library and the command line are, and hosts that drive them."""

import os
import shutil
import sys
from ctypes import POINTER, c_double, c_uint32
from pathlib import Path

import fmpy
import numpy as np
import pytest
from fmpy.fmi2 import FMU2Slave
from fmpy.fmi3 import FMU3Slave

sys.path.insert(0, str(Path(__file__).parent))
from clib import Library  # noqa: E402

ROOT = Path(__file__).resolve().parents[2]
RELEASE = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")) / "release"
SCENE = ROOT / "fmu" / "scene.toml"
ARCHIVES = Path(os.environ.get("CUTIS_FMU", ROOT / "target" / "fmu"))


def newest(*places):
    found = [p for p in places if p.exists()]
    assert found, f"none of {', '.join(map(str, places))}: run ./test"
    return max(found, key=lambda p: p.stat().st_mtime)


def library_path():
    return newest(RELEASE / "libcutis.so", RELEASE / "deps" / "libcutis.so")


class Host3:
    """FMI 3.0, low level."""

    def __init__(self, archive, logging=False):
        self.about, self.log = archive.description, []
        self.fmu = FMU3Slave(
            guid=self.about.instantiationToken, unzipDirectory=str(archive.folder), modelIdentifier="cutis", instanceName="host3"
        )
        keep = lambda environment, status, category, message: self.log.append(message.decode())  # noqa: E731
        self.fmu.instantiate(loggingOn=logging, logMessage=keep)
        self.variables = {v.name: v for v in self.about.modelVariables}

    def shape(self, name):
        return tuple(self.variables[name].shape) if self.variables[name].dimensions else ()

    def set(self, name, values):
        values = np.asarray(values, dtype=np.float64).ravel()
        self.fmu.setFloat64([self.variables[name].valueReference], values.tolist())

    def get(self, name):
        shape = self.shape(name)
        out = np.zeros(shape)
        reference = (c_uint32 * 1)(self.variables[name].valueReference)
        self.fmu.fmi3GetFloat64(self.fmu.component, reference, 1, out.ctypes.data_as(POINTER(c_double)), out.size)
        return out

    def initialise(self, start=0.0):
        self.fmu.enterInitializationMode(startTime=start)
        self.fmu.exitInitializationMode()

    def step(self, t, dt):
        self.fmu.doStep(t, dt)

    def close(self):
        self.fmu.freeInstance()


class Host2:
    """FMI 2.0, low level; arrays are put together from scalars."""

    def __init__(self, archive):
        self.about = archive.description
        self.fmu = FMU2Slave(guid=self.about.guid, unzipDirectory=str(archive.folder), modelIdentifier="cutis", instanceName="host2")
        self.fmu.instantiate()
        self.references = {v.name: v.valueReference for v in self.about.modelVariables}

    def _scalars(self, name):
        if name in self.references:
            return [self.references[name]]
        return [reference for scalar, reference in self.references.items() if scalar.startswith(name + "[")]

    def set(self, name, values):
        self.fmu.setReal(self._scalars(name), np.asarray(values, dtype=np.float64).ravel().tolist())

    def get(self, name):
        return np.array(self.fmu.getReal(self._scalars(name)))

    def initialise(self, start=0.0):
        self.fmu.setupExperiment(startTime=start)
        self.fmu.enterInitializationMode()
        self.fmu.exitInitializationMode()

    def step(self, t, dt):
        self.fmu.doStep(t, dt)

    def close(self):
        self.fmu.freeInstance()


class Archive:
    def __init__(self, path):
        self.path = path
        # Names are checked once, in test_archive_is_valid: milliseconds for each of thousands of scalars.
        self.description = fmpy.read_model_description(str(path), validate_variable_names=False)
        self.folder = fmpy.extract(str(path))


@pytest.fixture(scope="session")
def archive3():
    archive = Archive(ARCHIVES / "cutis.fmu")
    yield archive
    shutil.rmtree(archive.folder, ignore_errors=True)


@pytest.fixture(scope="session")
def archive2():
    archive = Archive(ARCHIVES / "cutis_fmi2.fmu")
    yield archive
    shutil.rmtree(archive.folder, ignore_errors=True)


@pytest.fixture(scope="session")
def archive2_full():
    archive = Archive(ARCHIVES / "cutis_fmi2_full.fmu")
    yield archive
    shutil.rmtree(archive.folder, ignore_errors=True)


@pytest.fixture(scope="session")
def library():
    return Library(library_path())


@pytest.fixture
def host3(archive3):
    host = Host3(archive3)
    yield host
    host.close()


@pytest.fixture
def host2(archive2):
    host = Host2(archive2)
    yield host
    host.close()
