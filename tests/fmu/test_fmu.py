"""The component from outside: valid archives, one trajectory through every door, and physics that a host can check.

Motions are multiples of a power of two and so are the times: an importer that interpolates inputs or adds up steps then
reaches exactly the numbers of one that does not, and "identical" may mean identical bits.
"""

import csv
import os
import subprocess
import sys
import textwrap
import threading
import time
import zipfile
from ctypes import POINTER, c_double, c_uint32

import fmpy
import numpy as np
import pytest
from conftest import ARCHIVES, RELEASE, ROOT, SCENE, Archive, Host2, Host3
from fmpy.validation import validate_fmu
from lxml import etree

DT = 1 / 64
STEPS = 6
# What both versions of the archive have.
COMMON = ["marker.position", "bone.reactionForce", "bone.reactionTorque", "energy.elastic", "solver.residual"]


def moving_row(sim):
    """The jaw where there is one, else the last bone."""
    rows = sim.rows("bone.translation")
    return rows.index("mandible") if "mandible" in rows else len(rows) - 1


@pytest.fixture(scope="session")
def jaw(library):
    """`bone.translation` for every step: nothing at first, then down (z) and back (y), m."""
    sim = library.from_file(SCENE)
    d = np.zeros((STEPS,) + sim.shape("bone.translation"))
    for k in range(STEPS):
        d[k, moving_row(sim)] = [0.0, k * 2.0**-13, -k * 2.0**-12]
    return d


def drive(host, d, names, c=False):
    """Steps a host through the motion `d`; returns what `names` read after each step."""
    host.initialise()
    rows = []
    for k in range(len(d)):
        host.set("bone.translation", d[k])
        host.step(DT) if c else host.step(k * DT, DT)
        rows.append([np.asarray(host.get(name)).ravel() for name in names])
    return [np.array(column) for column in zip(*rows)]


@pytest.fixture(scope="session")
def through_c(library, jaw):
    sim = library.from_file(SCENE)
    return dict(zip(["skin.position"] + COMMON, drive(sim, jaw, ["skin.position"] + COMMON, c=True)))


# ------------------------------------------------------------------ archives


@pytest.mark.parametrize("name", ["cutis.fmu", "cutis_fmi2.fmu"])
def test_archive_is_valid(name):
    assert validate_fmu(str(ARCHIVES / name)) == []


@pytest.mark.parametrize("name", ["cutis.fmu", "cutis_fmi2.fmu"])
def test_archive_is_small(name):
    assert (ARCHIVES / name).stat().st_size < 20e6


def test_token_is_that_of_the_scene(archive3, archive2, library):
    token = library.from_file(SCENE).token()
    assert archive3.description.instantiationToken == archive2.description.guid == token
    assert library.default().token() == token


def test_an_instance_is_ready_in_two_seconds(archive3):
    start = time.perf_counter()
    host = Host3(archive3)
    seconds = time.perf_counter() - start
    host.close()
    print(f"instantiate: {seconds:.3f} s")
    assert seconds < 2.0


def test_get_is_a_copy(archive3):
    host = Host3(archive3)
    host.initialise()
    start = time.perf_counter()
    for _ in range(100):
        x = host.get("skin.position")
    seconds = (time.perf_counter() - start) / 100
    host.close()
    print(f"get skin.position ({x.size} values): {1e6 * seconds:.1f} us")
    assert seconds < 1e-3


def test_terminals_and_icons_are_valid(archive3):
    """Against the standard's schema; every member is a variable, and bones, skin and markers have a terminal each."""
    with zipfile.ZipFile(archive3.path) as archive:
        tree = etree.fromstring(archive.read("terminalsAndIcons/terminalsAndIcons.xml"))
        icon = archive.read("terminalsAndIcons/icon.png")
    etree.XMLSchema(etree.parse(os.path.join(os.path.dirname(fmpy.__file__), "schema/fmi3/fmi3TerminalsAndIcons.xsd"))).assertValid(tree)
    names = {v.name for v in archive3.description.modelVariables}
    members = {t.get("name"): {m.get("memberName"): m.get("variableName") for m in t} for t in tree.iter("Terminal")}
    assert all(variable in names for terminal in members.values() for variable in terminal.values())
    assert members["bones"]["translation"] == "bone.translation" and "reactionForce" in members["bones"]
    assert {"position", "restPosition", "triangles"} <= set(members["skin"]) and "position" in members["markers"]
    assert icon[:4] == b"\x89PNG"


# ------------------------------------------------------------------ one trajectory


def test_fmi3_low_level_has_the_bits_of_the_c_library(host3, jaw, through_c):
    names = list(through_c)
    for name, values in zip(names, drive(host3, jaw, names)):
        assert np.array_equal(values, through_c[name]), name
    assert np.ptp(through_c["skin.position"], axis=0).max() > 1e-4


def test_fmi2_low_level_has_the_bits_of_the_c_library(host2, jaw, through_c):
    for name, values in zip(COMMON, drive(host2, jaw, COMMON)):
        assert np.array_equal(values, through_c[name]), name


def test_fmi3_high_level_has_the_bits_of_the_c_library(archive3, jaw, through_c):
    inputs = [v for v in archive3.description.modelVariables if v.causality == "input" and v.name.startswith("bone.")]
    signals = np.zeros(STEPS, dtype=[("time", "f8")] + [(v.name, "f8", tuple(v.shape)) for v in inputs])
    signals["time"] = DT * np.arange(STEPS)
    signals["bone.translation"] = jaw
    names = ["skin.position"] + COMMON
    result = fmpy.simulate_fmu(
        str(archive3.path), stop_time=STEPS * DT, output_interval=DT, input=signals, output=names, set_stop_time=False
    )
    for name in names:
        values = np.array([np.ravel(row) for row in result[name]])[1:]
        assert np.array_equal(values, through_c[name].reshape(values.shape)), name


def test_fmi2_high_level_has_the_bits_of_the_c_library(archive2, jaw, through_c):
    inputs = [v.name for v in archive2.description.modelVariables if v.causality == "input"]
    signals = np.zeros(STEPS, dtype=[("time", "f8")] + [(name, "f8") for name in inputs])
    signals["time"] = DT * np.arange(STEPS)
    for i, j in np.ndindex(*jaw.shape[1:]):
        signals[f"bone.translation[{i + 1},{j + 1}]"] = jaw[:, i, j]
    names = [v.name for v in archive2.description.modelVariables if v.name.startswith("marker.position")]
    result = fmpy.simulate_fmu(
        str(archive2.path), stop_time=STEPS * DT, output_interval=DT, input=signals, output=names, set_stop_time=False
    )
    values = np.stack([result[name] for name in names], axis=1)[1:]
    assert np.array_equal(values, through_c["marker.position"])


def test_the_full_fmi2_archive_has_the_skin_of_the_c_library(archive2_full, jaw, through_c):
    host = Host2(archive2_full)
    (skin,) = drive(host, jaw, ["skin.position"])
    host.close()
    assert np.array_equal(skin, through_c["skin.position"])


def test_command_line_has_the_bits_of_fmi3(archive3, tmp_path):
    """`cutis run` follows the scene's own programme; its table says which inputs it set."""
    done = subprocess.run([RELEASE / "cutis", "run", SCENE, "-o", tmp_path, "--table-only"], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    with open(tmp_path / "ports.csv", newline="") as file:
        rows = [{k: float(v) for k, v in row.items()} for row in csv.DictReader(file)]
    assert len(rows) > 2

    def array(row, name):
        return np.array([v for k, v in row.items() if k == name or k.startswith(name + ".")])

    host = Host3(archive3)
    inputs = [v.name for v in archive3.description.modelVariables if v.causality == "input"]
    for name in inputs:
        host.set(name, array(rows[0], name))
    host.initialise(rows[0]["time"])
    dt = rows[1]["time"] - rows[0]["time"]
    for before, row in zip(rows, rows[1:]):
        for name in inputs:
            host.set(name, array(row, name))
        host.step(before["time"], dt)
        for name in COMMON:
            assert np.array_equal(host.get(name).ravel(), array(row, name)), (name, row["time"])
    host.close()


# ------------------------------------------------------------------ physics


def quiet(sim):
    """Takes the weight away, so that only the bones act."""
    sim.set("gravity", np.zeros(3))
    return sim


@pytest.fixture(scope="session")
def free_sim(library):
    """A new simulation of the scene without weight (but a port for it), all bones driven by pose."""
    text = SCENE.read_text().replace('drive = "held"', 'drive = "pose"')
    text += "" if "[gravity]" in text else "\n[gravity]\n"
    return lambda: quiet(library.from_text(text, SCENE.parent))


def moved(sim, translation, rotation=None):
    sim.initialise()
    sim.set("bone.translation", translation)
    if rotation is not None:
        sim.set("bone.rotation", rotation)
    sim.step(DT)
    return sim.get("skin.position")


def test_rigid_motion_of_all_bones_moves_the_skin_rigidly(free_sim):
    sim = free_sim()
    rest, pivots = sim.get("skin.restPosition"), sim.get("bone.pivot")
    angle, shift = 0.1, np.array([0.01, -0.02, 0.005])
    turn = np.array([[1, 0, 0], [0, np.cos(angle), -np.sin(angle)], [0, np.sin(angle), np.cos(angle)]])
    translation = pivots @ turn.T + shift - pivots
    rotation = np.tile([angle, 0.0, 0.0], (len(pivots), 1))
    x = moved(sim, translation, rotation)
    assert np.abs(x - (rest @ turn.T + shift)).max() < 1e-6
    assert np.abs(sim.get("bone.reactionForce")).max() < 1e-3


def test_reactions_balance(free_sim):
    sim = free_sim()
    d = np.zeros(sim.shape("bone.translation"))
    d[moving_row(sim)] = [1e-3, 1e-3, -2e-3]
    moved(sim, d)
    forces = sim.get("bone.reactionForce")
    assert np.abs(forces).max() > 1e-3
    assert np.linalg.norm(forces.sum(axis=0)) < 1e-4 * np.abs(forces).max()


def test_reactions_carry_the_weight(free_sim):
    sim = free_sim()
    def carried(g):
        sim.reset()
        sim.set("gravity", [0.0, 0.0, -g])
        sim.initialise()
        return sim.get("bone.reactionForce").sum(axis=0)

    one, two = carried(1.0), carried(2.0)
    assert one[2] < 0 and np.abs(one[:2]).max() < 1e-3 * -one[2]
    assert np.allclose(two, 2 * one, rtol=1e-3, atol=1e-6)


def test_small_motion_scales_linearly(free_sim):
    def skin(scale):
        sim = free_sim()
        d = np.zeros(sim.shape("bone.translation"))
        d[moving_row(sim)] = [0.0, scale, -scale]
        return moved(sim, d) - sim.get("skin.restPosition")

    one, two = skin(1e-5), skin(2e-5)
    assert np.abs(two - 2 * one).max() < 2e-3 * np.abs(two).max()


def mirror_twins(x, triangles):
    """Index of each vertex's mirror image about x = 0, or None. Lips touch, so vertices may share a place: the normals
    then tell the upper from the lower one."""
    normal = np.zeros_like(x)
    face = np.cross(x[triangles[:, 1]] - x[triangles[:, 0]], x[triangles[:, 2]] - x[triangles[:, 0]])
    for corner in triangles.T:
        np.add.at(normal, corner, face)
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    mark = np.hstack([x, 1e-4 * normal])
    mirrored = mark * [-1, 1, 1, -1, 1, 1]
    twin = np.array([np.linalg.norm(mark - m, axis=1).argmin() for m in mirrored])
    return twin if np.abs(mark[twin] - mirrored).max() < 1e-6 else None


def test_symmetric_pull_gives_symmetric_skin(free_sim):
    sim = free_sim()
    rest = sim.get("skin.restPosition")
    twin = mirror_twins(rest, sim.get("skin.triangles"))
    if twin is None:
        pytest.skip("the skin is not symmetric about x = 0")
    d = np.zeros(sim.shape("bone.translation"))
    d[moving_row(sim)] = [0.0, 1e-3, -2e-3]
    u = moved(sim, d) - rest
    error = np.abs(u[twin] * [-1, 1, 1] - u).max() / np.abs(u).max()
    print(f"asymmetry {error:.1e}")
    assert error < 0.01


# ------------------------------------------------------------------ state, reset, instances


def finish(host, jaw, first):
    for k in range(first, STEPS):
        host.set("bone.translation", jaw[k])
        host.step(k * DT, DT)
    return host.get("marker.position")


@pytest.mark.parametrize("kind", ["fmi3", "fmi2"])
def test_state_goes_back_and_survives_another_process(kind, archive3, archive2, jaw, tmp_path):
    archive = archive3 if kind == "fmi3" else archive2
    host = (Host3 if kind == "fmi3" else Host2)(archive)
    fmu = host.fmu
    save = fmu.getFMUState if kind == "fmi3" else fmu.getFMUstate
    restore = fmu.setFMUState if kind == "fmi3" else fmu.setFMUstate
    free = fmu.freeFMUState if kind == "fmi3" else fmu.freeFMUstate
    serialize = fmu.serializeFMUState if kind == "fmi3" else fmu.serializeFMUstate
    host.initialise()
    for k in range(2):
        host.set("bone.translation", jaw[k])
        host.step(k * DT, DT)
    state = save()
    data = serialize(state)
    want = finish(host, jaw, 2)
    for _ in range(2):
        restore(state)
        assert np.array_equal(finish(host, jaw, 2), want)
    free(state)
    host.close()

    (tmp_path / "state").write_bytes(data)
    np.save(tmp_path / "jaw.npy", jaw)
    script = f"""
        import sys; sys.path.insert(0, {str(ROOT / "tests" / "fmu")!r})
        import numpy as np
        from conftest import Archive, Host2, Host3
        from test_fmu import finish
        host = {"Host3" if kind == "fmi3" else "Host2"}(Archive({str(archive.path)!r}))
        state = host.fmu.{"deserializeFMUState" if kind == "fmi3" else "deSerializeFMUstate"}(open({str(tmp_path / "state")!r}, "rb").read())
        host.fmu.{"setFMUState" if kind == "fmi3" else "setFMUstate"}(state)
        np.save({str(tmp_path / "there.npy")!r}, finish(host, np.load({str(tmp_path / "jaw.npy")!r}), 2))
    """
    done = subprocess.run([sys.executable, "-c", textwrap.dedent(script)], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert np.array_equal(np.load(tmp_path / "there.npy"), want)


def test_reset_is_like_new(host3, jaw, through_c):
    host3.set("bone.translation", np.full(host3.shape("bone.translation"), 1e-3))
    host3.initialise(5.0)
    host3.step(5.0, DT)
    host3.fmu.reset()
    (skin,) = drive(host3, jaw, ["skin.position"])
    assert np.array_equal(skin, through_c["skin.position"])


def test_outputs_in_initialization_mode_do_not_change_the_bits(host3, jaw, through_c):
    host3.fmu.enterInitializationMode(startTime=0.0)
    host3.set("bone.translation", jaw[-1])
    far = host3.get("marker.position")
    host3.set("bone.translation", jaw[0])
    near = host3.get("marker.position")
    assert np.abs(far - near).max() > 1e-4
    host3.fmu.exitInitializationMode()
    for k in range(STEPS):
        host3.set("bone.translation", jaw[k])
        host3.step(k * DT, DT)
    assert np.array_equal(host3.get("skin.position").ravel(), through_c["skin.position"][-1])


def test_directional_derivatives_meet_differences(host3, jaw):
    host = host3
    drive(host, jaw[:3], ["skin.position"])
    seed = np.zeros(host.shape("bone.translation"))
    seed[-1] = [0.5, -1.0, 0.25]
    known, unknown = (host.variables[name].valueReference for name in ("bone.translation", "skin.position"))
    n = int(np.prod(host.shape("skin.position")))
    slope = np.array(host.fmu.getDirectionalDerivative([unknown], [known], list(seed.ravel()), n))
    twice = np.array(host.fmu.getDirectionalDerivative([unknown], [known], list(2 * seed.ravel()), n))
    assert np.abs(twice - 2 * slope).max() < 1e-6 * np.abs(slope).max()
    here, state, h = np.asarray(host.get("bone.translation")).copy(), host.fmu.getFMUState(), 2.0**-12
    sides = []
    for sign in (1, -1):
        host.fmu.setFMUState(state)
        host.set("bone.translation", here + sign * h * seed)
        host.step(3 * DT, DT)
        sides.append(np.asarray(host.get("skin.position")).ravel().copy())
    host.fmu.freeFMUState(state)
    difference = (sides[0] - sides[1]) / (2 * h)
    assert np.abs(difference - slope).max() < 2e-3 * np.abs(slope).max()


def adjoint(host, unknowns, knowns, seed):
    """`fmi3GetAdjointDerivative`; variables by name, values one after another."""
    n = sum(int(np.prod(host.shape(name))) for name in knowns)
    out, seed = np.zeros(n), np.ascontiguousarray(seed, dtype=np.float64)
    references = [(c_uint32 * len(names))(*(host.variables[name].valueReference for name in names)) for names in (unknowns, knowns)]
    pointer = lambda a: a.ctypes.data_as(POINTER(c_double))  # noqa: E731
    host.fmu.fmi3GetAdjointDerivative(
        host.fmu.component, references[0], len(unknowns), references[1], len(knowns), pointer(seed), seed.size, pointer(out), n
    )
    return out


def test_adjoint_is_the_transpose_of_the_directional_derivative(host3, jaw):
    drive(host3, jaw[:3], ["skin.position"])
    unknowns = ["skin.position", "marker.position", "bone.reactionTorque"]
    knowns = ["bone.translation", "bone.rotation", "load.force"]
    rng = np.random.default_rng(3)
    v = rng.standard_normal(sum(int(np.prod(host3.shape(name))) for name in knowns))
    n = sum(int(np.prod(host3.shape(name))) for name in unknowns)
    references = lambda names: [host3.variables[name].valueReference for name in names]  # noqa: E731
    Jv = np.array(host3.fmu.getDirectionalDerivative(references(unknowns), references(knowns), list(v), n))
    w = Jv + 0.3 * np.abs(Jv).max() * rng.standard_normal(n)
    JTw = adjoint(host3, unknowns, knowns, w)
    assert abs(w @ Jv - JTw @ v) < 1e-7 * (np.abs(w) @ np.abs(Jv))
    assert not adjoint(host3, unknowns, knowns, np.zeros(n)).any()


def test_directional_derivatives_are_those_of_fmi3(host3, host2, jaw):
    names = ["marker.position", "bone.reactionForce"]
    n = [int(np.prod(host3.shape(name))) for name in names]
    for host in (host3, host2):
        drive(host, jaw[:3], names)
    seed = np.zeros(host3.shape("bone.translation")).ravel()
    seed[-3:] = [0.5, -1.0, 0.25]
    wanted = host3.fmu.getDirectionalDerivative(
        [host3.variables[name].valueReference for name in names],
        [host3.variables["bone.translation"].valueReference], list(seed), sum(n))
    unknowns = [r for name in names for r in host2._scalars(name)]
    found = host2.fmu.getDirectionalDerivative(unknowns[::-1], host2._scalars("bone.translation"), list(seed))
    assert np.array_equal(np.array(found)[::-1], np.array(wanted))


@pytest.mark.parametrize("kind", ["fmi3", "fmi2"])
def test_stiffness_can_be_set_between_steps(kind, host3, host2, library, jaw):
    host = host3 if kind == "fmi3" else host2
    variable = next(v for v in host.about.modelVariables if v.name == "material.fat.E")
    assert (variable.causality, variable.variability) == ("parameter", "tunable")
    drive(host, jaw, ["marker.position"])
    before = np.asarray(host.get("bone.reactionForce")).copy()
    host.set("material.fat.E", [2e4])
    host.step(STEPS * DT, DT)
    stiffer = np.asarray(host.get("bone.reactionForce"))
    assert np.linalg.norm(stiffer) > 1.05 * np.linalg.norm(before)
    sim = library.from_text(SCENE.read_text().replace("E = 5e3", "E = 2e4"), SCENE.parent)
    drive(sim, jaw, ["marker.position"], c=True)
    wanted = sim.get("bone.reactionForce").ravel()
    assert np.abs(stiffer.ravel() - wanted).max() < 1e-3 * np.abs(wanted).max()


def test_parallel_instances_do_not_meet(archive3, jaw, through_c):
    hosts = [Host3(archive3) for _ in range(3)]
    results = [None] * len(hosts)

    def work(i):
        results[i] = drive(hosts[i], jaw, ["skin.position"])[0]

    threads = [threading.Thread(target=work, args=(i,)) for i in range(len(hosts))]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for host, skin in zip(hosts, results):
        assert np.array_equal(skin, through_c["skin.position"])
        host.close()


def test_reset_after_everything_was_disturbed(host3, jaw, through_c):
    """Every settable variable elsewhere, a few steps, an error: reset gives start values and bits of a new instance."""
    settable = [v for v in host3.about.modelVariables if v.causality in ("input", "parameter") and v.type == "Float64"]
    start = {v.name: np.asarray(host3.get(v.name)).copy() for v in settable}
    host3.fmu.enterInitializationMode(startTime=7.0)
    for v in settable:
        host3.set(v.name, start[v.name] * 1.25 + (0.0 if v.name.startswith("material") else 1e-4))
    host3.fmu.exitInitializationMode()
    host3.step(7.0, DT)
    with pytest.raises(Exception, match="fmi3DoStep"):
        host3.step(99.0, DT)
    host3.fmu.reset()
    for v in settable:
        assert np.array_equal(host3.get(v.name), start[v.name]), v.name
    (skin,) = drive(host3, jaw, ["skin.position"])
    assert np.array_equal(skin, through_c["skin.position"])


def test_between_steps_inputs_are_new_and_outputs_old(host3, jaw):
    drive(host3, jaw[:2], ["skin.position"])
    before = host3.get("skin.position")
    host3.set("bone.translation", jaw[-1])
    assert np.array_equal(host3.get("skin.position"), before)
    assert np.array_equal(host3.get("bone.translation"), jaw[-1])


def test_references_may_repeat(host3):
    host3.initialise()
    marker = host3.variables["marker.position"].valueReference
    n = int(np.prod(host3.shape("marker.position")))
    twice = host3.fmu.getFloat64([marker, 0, marker], nValues=2 * n + 1)
    assert twice[:n] == twice[n + 1 :]


def test_ten_tenths_reach_the_stop_time(archive3):
    host = Host3(archive3)
    host.fmu.enterInitializationMode(startTime=0.0, stopTime=1.0)
    host.fmu.exitInitializationMode()
    for k in range(10):
        host.step(sum([0.1] * k), 0.1)
    host.close()


def test_categories_are_told_apart_and_silence_is_kept(archive3, jaw):
    host = Host3(archive3, logging=True)
    host.initialise()
    told = {}
    host.fmu.setDebugLogging(False, [])
    for names in (["logStatusError"], ["logNonlinearSystems"], []):
        host.fmu.setDebugLogging(True, names)
        host.log.clear()
        host.set("bone.translation", jaw[len(told) + 1])
        host.step(len(told) * DT, DT)
        told[" ".join(names)] = list(host.log)
    # One switched off, or on again, leaves the others as they are.
    host.fmu.setDebugLogging(False, ["logStatusDiscard"])
    host.log.clear()
    host.set("bone.translation", jaw[4])
    host.step(3 * DT, DT)
    assert len(host.log) == 1
    host.fmu.setDebugLogging(False, ["logNonlinearSystems"])
    host.fmu.setDebugLogging(True, ["logStatusDiscard"])
    with pytest.raises(Exception, match="fmi3SetFloat64"):
        host.set("bone.translation", 1e9 + jaw[4])
    assert len(host.log) == 2
    host.fmu.setDebugLogging(False, [])
    host.log.clear()
    with pytest.raises(Exception, match="fmi3DoStep"):
        host.step(99.0, DT)
    assert told["logStatusError"] == [] and len(told["logNonlinearSystems"]) == len(told[""]) == 1 and host.log == []
    host.close()


def test_instances_leave_nothing_behind(tmp_path):
    """Memory, threads, working folder and open files of the host after hundreds of instances are those after the first."""
    script = f"""
        import os, sys; sys.path.insert(0, {str(ROOT / "tests" / "fmu")!r})
        import bars
        archive, _ = bars.packed("small", {str(tmp_path)!r})
        seen = lambda: (os.getcwd(), len(os.listdir("/proc/self/task")), len(os.listdir("/proc/self/fd")), open("/proc/self/status").read().split("SigCgt")[1].split()[1])
        for _ in range(50):
            bars.cycle(archive)
        before, memory = seen(), bars.resident()
        for _ in range(250):
            bars.cycle(archive)
        assert seen() == before, (before, seen())
        assert bars.resident() - memory < 2e6, bars.resident() - memory
    """
    done = subprocess.run([sys.executable, "-c", textwrap.dedent(script)], capture_output=True, text=True, timeout=120)
    assert done.returncode == 0 and done.stdout == done.stderr == "", done.stdout + done.stderr


# ------------------------------------------------------------------ misuse, each in a process of its own

MISUSE = {
    "nothing": "host.fmu.fmi3GetFloat64(host.fmu.component, None, 0, None, 0)",
    "null values": "refused(lambda: host.fmu.fmi3GetFloat64(host.fmu.component, (c_uint32 * 1)(100), 1, None, 3))",
    "unknown reference": "refused(lambda: host.fmu.getFloat64([999]))",
    "one value of an array": "refused(lambda: host.fmu.getFloat64([100], nValues=1))",
    "set an output": "refused(lambda: host.set('marker.position', host.get('marker.position')))",
    "set NaN": "refused(lambda: host.set('bone.translation', np.full(host.shape('bone.translation'), np.nan)))",
    "set a fixed parameter after the start": "host.initialise(); refused(lambda: host.set('bone.pivot', host.get('bone.pivot')))",
    "a stiffness of nothing": "host.initialise(); refused(lambda: host.set('material.fat.E', [0.0]))",
    "output derivatives without inertia": "host.initialise(); refused(lambda: host.fmu.fmi3GetOutputDerivatives(host.fmu.component, (c_uint32 * 1)(110), 1, (c_int32 * 1)(1), (c_double * 27)(), 27))",
    "step after an error": "host.initialise(); refused(lambda: host.fmu.getFloat64([999])); refused(lambda: host.step(0.0, 0.125)); refused(lambda: host.set('bone.translation', 0 * host.get('bone.translation')))",
    "terminate after an error": "host.initialise(); refused(lambda: host.fmu.getFloat64([999])); refused(host.fmu.terminate)",
    "step past the stop time": "host.fmu.enterInitializationMode(startTime=0.0, stopTime=0.25); host.fmu.exitInitializationMode(); host.step(0.0, 0.25); refused(lambda: host.step(0.25, 0.01))",
    "set after terminate": "host.initialise(); host.fmu.terminate(); refused(lambda: host.set('bone.translation', 0 * host.get('bone.translation')))",
    "step after terminate": "host.initialise(); host.fmu.terminate(); refused(lambda: host.step(0.0, 0.1))",
    "exit before enter": "refused(host.fmu.exitInitializationMode)",
    "configuration mode": "refused(host.fmu.enterConfigurationMode)",
    "the type of another": "refused(lambda: host.fmu.getInt32([100], nValues=3)); host.fmu.reset(); refused(lambda: host.fmu.getFloat64([200]))",
    "set topology": "refused(lambda: host.fmu.setInt32([301], [0]))",
    "undeclared category": "refused(lambda: host.fmu.setDebugLogging(True, ['logMagic']))",
    "stop before start": "refused(lambda: host.fmu.enterInitializationMode(startTime=1.0, stopTime=0.5))",
    "clock": "refused(lambda: host.fmu.fmi3GetClock(host.fmu.component, (c_uint32 * 1)(0), 1, (c_bool * 1)()))",
    "step too early": "refused(lambda: host.step(0.0, 0.1))",
    "step of NaN": "host.initialise(); refused(lambda: host.step(0.0, float('nan')))",
    "step of infinity": "host.initialise(); refused(lambda: host.step(0.0, float('inf')))",
    "step back": "host.initialise(); refused(lambda: host.step(0.0, -0.1))",
    "step of nothing": "host.initialise(); refused(lambda: host.step(0.0, 0.0))",
    "step from elsewhere": "host.initialise(); refused(lambda: host.step(1.0, 0.1))",
    "terminate twice": "host.initialise(); host.fmu.terminate(); refused(host.fmu.terminate)",
    "initialise twice": "host.initialise(); refused(host.initialise)",
    "start at NaN": "refused(lambda: host.initialise(float('nan')))",
    "event mode": "host.initialise(); refused(host.fmu.enterEventMode)",
    "derivatives": "host.initialise(); refused(lambda: host.fmu.getDirectionalDerivative([100], [10], [1.0], 1))",
    "derivatives too early": "refused(lambda: host.fmu.getDirectionalDerivative([110], [10], [0.0] * host.variables['bone.translation'].shape[0] * 3, 27))",
    "adjoint of short seeds": "host.initialise(); one = (c_uint32 * 1)(100); two = (c_uint32 * 1)(10); a = (c_double * 6)(); refused(lambda: host.fmu.fmi3GetAdjointDerivative(host.fmu.component, one, 1, two, 1, a, 1, a, 6))",
    "adjoint by an output": "host.initialise(); one = (c_uint32 * 1)(110); a = (c_double * 27)(); refused(lambda: host.fmu.fmi3GetAdjointDerivative(host.fmu.component, one, 1, one, 1, a, 27, a, 27))",
    "adjoint of nothing at all": "host.initialise(); refused(lambda: host.fmu.fmi3GetAdjointDerivative(host.fmu.component, None, 1, None, 1, None, 1, None, 1))",
    "garbage as state": "refused(lambda: host.fmu.deserializeFMUState(b'x' * 1000))",
    "state cut short": "s = host.fmu.serializeFMUState(host.fmu.getFMUState()); refused(lambda: host.fmu.deserializeFMUState(s[:-1]))",
    "state of a flipped bit": "s = bytearray(host.fmu.serializeFMUState(host.fmu.getFMUState())); s[99] ^= 4; refused(lambda: host.fmu.deserializeFMUState(bytes(s)))",
    "foreign state": "refused(lambda: host.fmu.setFMUState(c_void_p(4096)))",
    "free nothing": "host.fmu.fmi3FreeInstance(None)",
    "a huge motion": "host.initialise(); host.set('bone.translation', 0.3 * np.ones(host.shape('bone.translation')) * [[i] for i in range(host.shape('bone.translation')[0])]); refused(lambda: host.step(0.0, 0.1), also_fine=True)",
}


@pytest.mark.parametrize("what", MISUSE)
def test_misuse_is_refused_and_survived(what, archive3):
    script = f"""
        import sys; sys.path.insert(0, {str(ROOT / "tests" / "fmu")!r})
        from ctypes import *
        import numpy as np
        from conftest import Archive, Host3
        archive = Archive({str(archive3.path)!r})
        host = Host3(archive, logging=True)
        def refused(body, also_fine=False):
            try:
                body()
            except Exception:
                assert host.log, "no message was logged"
                return
            assert also_fine, "not refused"
        {MISUSE[what]}
        host.fmu.reset()
        host.initialise()
        host.step(0.0, 0.125)
        assert np.isfinite(host.get("skin.position")).all()
        host.close()
    """
    environment = dict(os.environ, PYTHONFAULTHANDLER="1")
    done = subprocess.run([sys.executable, "-c", textwrap.dedent(script)], capture_output=True, text=True, timeout=120, env=environment)
    assert done.returncode == 0, done.stderr
    assert "panicked" not in done.stderr


def test_wrong_token_and_name_are_refused(archive3):
    class Wrong(Archive):
        def __init__(self, archive):
            self.description, self.folder = archive.description, archive.folder

    wrong = Wrong(archive3)
    token = wrong.description.instantiationToken
    try:
        wrong.description.instantiationToken = "{00000000}"
        with pytest.raises(Exception, match="instantiate"):
            Host3(wrong)
    finally:
        wrong.description.instantiationToken = token
