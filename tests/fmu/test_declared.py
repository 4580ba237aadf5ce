"""What the descriptions declare holds: derivatives of every output by its dependencies in every mode, ranges, terminals, references;
and what a host may ask and cannot have is a Discard that leaves it its run."""

import shutil
import subprocess
import sys
import textwrap
import zipfile
from ctypes import c_double, c_int32, c_size_t, c_uint32, c_void_p

import fmpy
import numpy as np
import pytest
from conftest import ARCHIVES, RELEASE, ROOT, Archive, Host2, Host3
from fmpy.validation import validate_fmu
from lxml import etree

SCENES = ["contact", "contact_friction", "bone_force", "inertia_bdf2", "inertia_modes", "viscous", "muscle", "pressure", "gravity"]
OK, DISCARD = 0, 2


@pytest.fixture(scope="module", params=SCENES)
def packed(request, tmp_path_factory):
    folder = tmp_path_factory.mktemp(request.param)
    scene = ROOT / "tests" / "scenes" / f"{request.param}.toml"
    done = subprocess.run([RELEASE / "cutis", "fmu", scene, "--full", "-o", folder], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert not list(folder.glob("*.part"))
    archives = [Archive(folder / name) for name in ("cutis.fmu", "cutis_fmi2.fmu", "cutis_fmi2_full.fmu")]
    yield archives
    for archive in archives:
        shutil.rmtree(archive.folder, ignore_errors=True)


def raw(host, function, unknown, known, seed, n):
    """Status and answer of a derivative between two variables."""
    out = (c_double * n)()
    one, two, v = (c_uint32 * 1)(unknown), (c_uint32 * 1)(known), (c_double * len(seed))(*seed)
    status = host.fmu.dll[function](c_void_p(host.fmu.component), one, c_size_t(1), two, c_size_t(1), v, c_size_t(len(seed)), out, c_size_t(n))
    return status, np.array(out)


def size(variable):
    return int(np.prod(variable.shape)) if variable.dimensions else 1


def pairs(host):
    for output in host.about.outputs:
        for known in output.dependencies or []:
            if output.variable.type.startswith("Float") and known.type.startswith("Float"):
                yield output.variable, known


def answer_all(host):
    asked = 0
    for unknown, known in pairs(host):
        n, m = size(unknown), size(known)
        seed = np.zeros(m)
        seed[-1] = float(known.nominal or 1.0)
        what = f"{unknown.name} by {known.name}"
        status, Jv = raw(host, "fmi3GetDirectionalDerivative", unknown.valueReference, known.valueReference, seed, n)
        assert status == OK and np.isfinite(Jv).all(), what
        w = np.linspace(1.0, 2.0, n)
        status, JTw = raw(host, "fmi3GetAdjointDerivative", unknown.valueReference, known.valueReference, w, m)
        assert status == OK and np.isfinite(JTw).all(), what
        nominal = float(unknown.nominal or 1.0)
        assert abs(w @ Jv - JTw @ seed) <= 1e-4 * np.abs(w * Jv).sum() + 1e-7 * nominal, what
        asked += 1
    return asked


def test_every_declared_derivative_is_answered_in_every_mode(packed):
    assert validate_fmu(str(packed[0].path)) == []
    host = Host3(packed[0])
    host.fmu.enterInitializationMode(startTime=0.0)
    asked = answer_all(host)
    host.fmu.exitInitializationMode()
    assert answer_all(host) == asked > 3
    host.step(0.0, 0.01)
    host.step(0.01, 0.01)
    assert answer_all(host) == asked
    state = host.fmu.getFMUState()
    host.step(0.02, 0.01)
    host.fmu.setFMUState(state)
    assert answer_all(host) == asked
    bytes_ = host.fmu.serializeFMUState(state)
    other = Host3(packed[0])
    other.fmu.setFMUState(other.fmu.deserializeFMUState(bytes_))
    assert answer_all(other) == asked
    other.step(0.02, 0.01)
    host.fmu.terminate()
    assert answer_all(host) == asked
    host.close()
    other.close()


def test_fmi2_answers_all_of_its_outputs_too(packed):
    host = Host2(packed[1])
    host.initialise()
    host.step(0.0, 0.01)
    outputs = [v for v in packed[1].description.modelVariables if v.causality == "output" and v.type == "Real"]
    knowns = [v for v in packed[1].description.modelVariables if v.causality == "input" and v.type == "Real"]
    for known in knowns[:: max(1, len(knowns) // 8)]:
        answer = host.fmu.getDirectionalDerivative([v.valueReference for v in outputs], [known.valueReference], [1.0])
        assert len(answer) == len(outputs) and np.isfinite(answer).all(), known.name
    host.close()


def test_output_derivatives_of_all_that_moves_and_a_run_after_the_rest(packed):
    host = Host3(packed[0])
    host.initialise()
    host.step(0.0, 0.01)
    order = packed[0].description.coSimulation.maxOutputDerivativeOrder
    moving = {"skin.position", "skin.velocity", "marker.position", "bone.poseTranslation", "bone.poseRotation"}
    for output in host.about.outputs:
        n = size(output.variable)
        values = (c_double * n)()
        one = (c_uint32 * 1)(output.variable.valueReference)
        status = host.fmu.dll["fmi3GetOutputDerivatives"](c_void_p(host.fmu.component), one, c_size_t(1), (c_int32 * 1)(1), values, c_size_t(n))
        assert status == (OK if order and output.variable.name in moving else DISCARD), output.variable.name
    host.step(0.01, 0.01)
    host.close()


def test_the_small_archive_answers_to_what_it_declares_alone(packed):
    _, small, full = packed
    assert small.description.guid != full.description.guid
    references = [{v.valueReference for v in archive.description.modelVariables} for archive in (small, full)]
    host = Host2(small)
    host.initialise()
    extra = sorted(references[1] - references[0])
    assert extra
    with pytest.raises(Exception, match="fmi2Get"):
        host.fmu.getReal([extra[0]])
    host.close()
    host = Host2(full)
    host.initialise()
    names = {v.name: v for v in full.description.modelVariables}
    corners = [v for v in full.description.modelVariables if v.name.startswith("skin.triangles[")]
    assert len(corners) % 3 == 0 and names["skin.triangles[1,1]"].causality == "calculatedParameter"
    values = host.fmu.getInteger([v.valueReference for v in corners])
    rows = len([name for name in names if name.startswith("skin.position[") and name.endswith(",1]")])
    assert min(values) == 0 and max(values) == rows - 1
    host.close()


def test_terminals_and_types_of_every_archive(packed):
    schema = etree.XMLSchema(etree.parse(f"{fmpy.__path__[0]}/schema/fmi3/fmi3TerminalsAndIcons.xsd"))
    for archive in packed:
        with zipfile.ZipFile(archive.path) as inside:
            tree = etree.fromstring(inside.read("terminalsAndIcons/terminalsAndIcons.xml"))
        schema.assertValid(tree)
        names = {v.name for v in archive.description.modelVariables}
        members = [m.get("variableName") for m in tree.iter("TerminalMemberVariable")]
        assert members and set(members) <= names and len(set(members)) == len(members)
        quantities = [(t.quantity, t.type) for t in archive.description.typeDefinitions]
        assert len(set(quantities)) == len(quantities), "one type a quantity"
        assert archive.description.defaultExperiment.tolerance is not None
    # FMPy does not read the attribute.
    with zipfile.ZipFile(packed[0].path) as inside:
        variables = etree.fromstring(inside.read("modelDescription.xml")).find("ModelVariables")
    flagged = {v.get("name") for v in variables if v.get("intermediateUpdate") == "true"}
    assert {o.variable.name for o in packed[0].description.outputs} <= flagged


def test_values_out_of_range_and_held_rows_are_discarded(tmp_path):
    scene = tmp_path / "scene.toml"
    scene.write_text("[mesh.block]\nsize = [0.06, 0.04, 0.02]\ncells = [6, 4, 2]\n[[tissue]]\nE = 15e3\nnu = 0.45\n"
                     "[[bone]]\nname = \"skull\"\nnodes = \"x_min\"\ndrive = \"held\"\n[[bone]]\nname = \"mandible\"\nnodes = \"x_max\"\n")
    subprocess.run([RELEASE / "cutis", "fmu", scene, "-o", tmp_path], check=True, capture_output=True)
    archive = Archive(tmp_path / "cutis.fmu")
    host = Host3(archive)
    host.initialise()
    bones = host.variables["bone.translation"]
    rows = bones.description.split("rows: ")[1].split(", ")
    d = np.zeros(host.shape("bone.translation"))

    def put(values):
        flat = np.asarray(values, dtype=np.float64).ravel()
        one, data = (c_uint32 * 1)(bones.valueReference), (c_double * flat.size)(*flat)
        return host.fmu.dll["fmi3SetFloat64"](c_void_p(host.fmu.component), one, c_size_t(1), data, c_size_t(flat.size))

    held = d.copy()
    held[rows.index("skull")] = 1e-3
    far = d.copy()
    far[rows.index("mandible"), 0] = 2.0 * float(bones.max)
    nan = d.copy()
    nan[rows.index("mandible"), 0] = np.nan
    assert [put(held), put(far), put(nan), put(d)] == [DISCARD, DISCARD, DISCARD, OK]
    host.step(0.0, 0.01)
    # The work of a step is bounded, and the bound can be set.
    most = host.variables["solver.mostSolves"]
    host.fmu.setInt32([most.valueReference], [2])
    d[rows.index("mandible"), 2] = -0.01
    assert put(d) == OK
    with pytest.raises(Exception, match="fmi3DoStep"):
        host.step(0.01, 0.01)
    host.fmu.setInt32([most.valueReference], [int(most.start)])
    host.step(0.01, 0.01)
    host.close()
    shutil.rmtree(archive.folder, ignore_errors=True)


def test_endless_and_empty_experiments_are_legal():
    archive = Archive(ARCHIVES / "cutis.fmu")
    for stop in (float("inf"), 0.0):
        host = Host3(archive)
        host.fmu.enterInitializationMode(startTime=0.0, stopTime=stop)
        host.fmu.exitInitializationMode()
        if stop > 0.0:
            host.step(0.0, 0.01)
        host.fmu.terminate()
        host.close()
    shutil.rmtree(archive.folder, ignore_errors=True)


def test_runs_in_a_loop_leave_no_library_behind(tmp_path):
    """Each run unpacks the archive into a new folder and loads the library from there."""
    script = f"""
        import sys; sys.path.insert(0, {str(ROOT / "tests" / "fmu")!r})
        import bars, fmpy
        archive, _ = bars.packed("small", {str(tmp_path)!r})
        path = str(archive.path)
        run = lambda: fmpy.simulate_fmu(path, stop_time=0.02, output_interval=0.01)
        for _ in range(5):
            run()
        before = bars.resident()
        for _ in range(25):
            run()
        grown = bars.resident() - before
        images = sum("cutis.so" in line for line in open("/proc/self/maps"))
        assert images == 0, f"{{images}} parts of old libraries"
        assert grown < 20e6, grown
    """
    done = subprocess.run([sys.executable, "-c", textwrap.dedent(script)], capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.parametrize("mesh", [
    'mesh = { file = "blk.vtu" }\n',
    'mesh.file = "blk.vtu"\n',
    '[mesh]\nfile = """blk.vtu"""\n',
    '[mesh.block]\nsize = [0.06, 0.04, 0.02]\ncells = [6, 4, 2]\nlayers = [\n  ["skin", 0.3],\n  ["fat", 0.3],\n]\n',
])
def test_every_spelling_of_a_mesh_is_packed(tmp_path, mesh):
    tissue = '[[tissue]]\nE = 15e3\nnu = 0.45\n[[bone]]\nname = "a"\nnodes = "x_min"\ndrive = "held"\n[[bone]]\nname = "b"\nnodes = "x_max"\n'
    block = tmp_path / "block.toml"
    block.write_text("[mesh.block]\nsize = [0.06, 0.04, 0.02]\ncells = [6, 4, 2]\n" + tissue)
    model = subprocess.run([RELEASE / "cutis", "fmu", block, "-o", tmp_path / "plain"], capture_output=True, text=True)
    assert model.returncode == 0, model.stderr
    with zipfile.ZipFile(tmp_path / "plain" / "cutis.fmu") as archive:
        (tmp_path / "blk.cutis").write_bytes(archive.read("resources/model.cutis"))
    scene = tmp_path / "scene.toml"
    scene.write_text(mesh.replace("blk.vtu", "blk.cutis") + tissue)
    done = subprocess.run([RELEASE / "cutis", "fmu", scene, "-o", tmp_path], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    for name in ("cutis.fmu", "cutis_fmi2.fmu"):
        fmpy.simulate_fmu(str(tmp_path / name), stop_time=0.02, output_interval=0.01)
