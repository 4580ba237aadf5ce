"""Promised times and memory of the component, by hand: `.venv/bin/python tests/fmu/bars.py`, after ./test has built it.

    set + step + get     10,000 vertices through FMPy, inputs unchanged: at most twice a copy in memory and FMPy's own calls;
                         a finer skin, whose vertices are sums over four nodes each, is told beside it
    instantiate          from the folder of an archive of 50,000 tetrahedra: 1 s
    state                saved and restored, 10,000 nodes: 2 ms
    cycles               instantiate, initialise, step, free: no growth over thousands (the number is the first argument)

Medians of processor time, so that a busy machine counts for little; the copy and FMPy's calls are measured beside the
exchange, in the same loop.
"""

import ctypes
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from ctypes import POINTER, c_double, c_uint32
from pathlib import Path

import numpy as np
from conftest import RELEASE, Archive, Host3

BONES = '[[bone]]\nname = "skull"\nnodes = "x_min"\ndrive = "held"\n[[bone]]\nname = "jaw"\nnodes = "x_max"\n'
TISSUE = "[[tissue]]\nE = 15e3\nnu = 0.45\n"
SCENES = {
    "skin": f"[mesh.block]\nsize = [0.1, 0.1, 0.002]\ncells = [100, 100, 1]\n{TISSUE}{BONES}",
    "fine": f"[mesh.block]\nsize = [0.1, 0.1, 0.01]\ncells = [25, 25, 2]\n[skin]\nsubdivisions = 2\n{TISSUE}{BONES}",
    "nodes": f"[mesh.block]\nsize = [0.1, 0.1, 0.05]\ncells = [27, 27, 13]\n{TISSUE}{BONES}",
    "head": '[mesh.head]\nedge = 0.0058\n[[tissue]]\nE = 15e3\nnu = 0.45\n[[bone]]\nname = "skull"\n[[bone]]\nname = "mandible"\n',
    "small": f"[mesh.block]\nsize = [0.06, 0.04, 0.02]\ncells = [3, 2, 1]\n{TISSUE}{BONES}",
}
REPEATS = 300


def packed(name, folder):
    """The archive of a scene, unpacked."""
    place = Path(folder) / name
    place.mkdir()
    (place / "scene.toml").write_text(SCENES[name])
    subprocess.run([RELEASE / "cutis", "fmu", place / "scene.toml", "-o", place], check=True, capture_output=True)
    said = subprocess.run([RELEASE / "cutis", "check", place / "scene.toml"], check=True, capture_output=True, text=True).stdout
    return Archive(place / "cutis.fmu"), said


def seconds(body):
    start = time.process_time()
    body()
    return time.process_time() - start


def exchange(folder, name):
    archive, _ = packed(name, folder)
    host = Host3(archive)
    host.initialise()
    d = np.zeros(host.shape("bone.translation"))
    d[1] = [2e-3, 0.0, 1e-3]
    host.set("bone.translation", d)
    host.step(0.0, 1 / 64)
    x, y = np.zeros(host.shape("skin.position")), np.zeros(host.shape("skin.position"))
    pointer = lambda a: a.ctypes.data_as(POINTER(c_double))  # noqa: E731
    bones, skin = ((c_uint32 * 1)(host.variables[n].valueReference) for n in ("bone.translation", "skin.position"))
    fmu, c = host.fmu, host.fmu.component
    t = [1 / 64]

    def whole():
        fmu.fmi3SetFloat64(c, bones, 1, pointer(d), d.size)
        fmu.doStep(t[0], 1 / 64)
        fmu.fmi3GetFloat64(c, skin, 1, pointer(x), x.size)
        t[0] += 1 / 64

    def calls():
        # As many calls and arguments through FMPy, of which the component has nothing to do.
        fmu.fmi3SetFloat64(c, bones, 0, pointer(d), 0)
        fmu.fmi3GetFloat64(c, skin, 0, pointer(x), 0)
        fmu.fmi3SetDebugLogging(c, False, 0, None)

    def copy():
        ctypes.memmove(y.ctypes.data, x.ctypes.data, x.nbytes)

    times = [(seconds(whole), seconds(calls), seconds(copy)) for _ in range(REPEATS)]
    whole, calls, copy = (statistics.median(column) for column in zip(*times))
    host.close()
    print(f"set + step + get     {len(x)} vertices, {name}: {1e6 * whole:.1f} us; a copy {1e6 * copy:.1f} us, FMPy's calls {1e6 * calls:.1f} us")
    return whole <= 2 * copy + calls


def instantiation(folder):
    archive, said = packed("head", folder)
    times = []
    for _ in range(5):
        hosts = []
        times.append(seconds(lambda: hosts.append(Host3(archive))))
        hosts[0].close()
    n = next(line for line in said.splitlines() if "tet" in line)
    print(f"instantiate          {statistics.median(times):.3f} s ({n.strip()})")
    return statistics.median(times) < 1.0


def state(folder):
    archive, said = packed("nodes", folder)
    host = Host3(archive)
    host.initialise()
    host.step(0.0, 1 / 64)
    kept = host.fmu.getFMUState()
    get = statistics.median(seconds(lambda: host.fmu.fmi3GetFMUState(host.fmu.component, ctypes.byref(kept))) for _ in range(REPEATS))
    restore = statistics.median(seconds(lambda: host.fmu.setFMUState(kept)) for _ in range(REPEATS))
    host.fmu.freeFMUState(kept)
    host.close()
    n = next(line for line in said.splitlines() if "node" in line)
    print(f"state                save {1e3 * get:.3f} ms, restore {1e3 * restore:.3f} ms ({n.strip()})")
    return max(get, restore) < 2e-3


def cycle(archive):
    host = Host3(archive)
    host.initialise()
    host.set("bone.translation", 1e-3 * np.ones(host.shape("bone.translation")) * [[0], [1]])
    host.step(0.0, 0.1)
    host.close()


def resident():
    """Peak memory of this process, bytes."""
    return 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


def cycles(folder, n):
    archive, _ = packed("small", folder)
    for _ in range(n // 10):
        cycle(archive)
    before = resident()
    for _ in range(n - n // 10):
        cycle(archive)
    grown = (resident() - before) / 1e6
    print(f"cycles               {n}: {grown:.2f} MB more than after the first {n // 10}")
    return grown < 2.0


def main():
    n = int(sys.argv[1]) if len(sys.argv) > 1 else 3000
    with tempfile.TemporaryDirectory() as folder:
        exchange(folder, "fine")
        kept = [exchange(folder, "skin"), instantiation(folder), state(folder), cycles(folder, n)]
    print("all bars are met" if all(kept) else f"missed: {[i for i, k in enumerate(kept) if not k]}")
    return 0 if all(kept) else 1


if __name__ == "__main__":
    sys.exit(main())
