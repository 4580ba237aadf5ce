"""The default archives in every FMI host that can be had: one motion, one reaction, in processes of their own.

    tests/hosts/run          makes the environment, the archives and the program on fmi-rs, then runs this

Each host takes the jaw down by 1/1024 m a step, four steps of 1/64 s, and tells the reaction on it. FMPy's answer through
FMI 3.0 is what the others are held against. Prints the table of docs/hosts.md.
"""

import json
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

STEPS, DT = 4, 1 / 64
ARCHIVES = Path(sys.argv[1]).resolve()
FMI3, FMI2 = ARCHIVES / "cutis.fmu", ARCHIVES / "cutis_fmi2.fmu"
JAW, REACTIONS = "bone.translation[2,3]", [f"bone.reactionForce[2,{c}]" for c in (1, 2, 3)]


def heights():
    return [-(k + 1) / 1024 for k in range(STEPS)]


def fmpy_3():
    import fmpy
    from fmpy.fmi3 import FMU3Slave

    about = fmpy.read_model_description(str(FMI3))
    references = {v.name: v.valueReference for v in about.modelVariables}
    folder = fmpy.extract(str(FMI3))
    fmu = FMU3Slave(guid=about.instantiationToken, unzipDirectory=folder, modelIdentifier="cutis", instanceName="a")
    fmu.instantiate()
    fmu.enterInitializationMode()
    fmu.exitInitializationMode()
    for k, z in enumerate(heights()):
        fmu.setFloat64([references["bone.translation"]], [0, 0, 0, 0, 0, z])
        fmu.doStep(k * DT, DT)
    found = fmu.getFloat64([references["bone.reactionForce"]], 6)[3:]
    fmu.terminate()
    fmu.freeInstance()
    shutil.rmtree(folder)
    return found


def through_fmpy_2(path, jaw=JAW, reactions=REACTIONS):
    import fmpy
    from fmpy.fmi2 import FMU2Slave

    about = fmpy.read_model_description(str(path))
    references = {v.name: v.valueReference for v in about.modelVariables}
    folder = fmpy.extract(str(path))
    identifier = about.coSimulation.modelIdentifier
    fmu = FMU2Slave(guid=about.guid, unzipDirectory=folder, modelIdentifier=identifier, instanceName="a")
    fmu.instantiate()
    fmu.setupExperiment(startTime=0.0)
    fmu.enterInitializationMode()
    fmu.exitInitializationMode()
    for k, z in enumerate(heights()):
        fmu.setReal([references[jaw]], [z])
        fmu.doStep(k * DT, DT)
    found = fmu.getReal([references[name] for name in reactions])
    fmu.terminate()
    fmu.freeInstance()
    shutil.rmtree(folder)
    return found


def fmpy_2():
    return through_fmpy_2(FMI2)


def toolbox(path):
    """The checker of the FMU Manipulation Toolbox: schema and semantics."""
    told = subprocess.run(["fmutool", "-input", path, "-check"], capture_output=True, text=True)
    text = told.stdout + told.stderr
    assert told.returncode == 0 and "compliant with FMI" in text and "No semantic error" in text, text
    return "compliant, no semantic error"


def toolbox_3():
    return toolbox(FMI3)


def toolbox_2():
    return toolbox(FMI2)


def container():
    """The FMI 2.0 archive inside a container of the FMU Manipulation Toolbox, run by FMPy."""
    with tempfile.TemporaryDirectory() as folder:
        shutil.copy(FMI2, Path(folder) / "cutis.fmu")
        ports = [f"INPUT;;jaw;cutis.fmu;{JAW}"] + [f"OUTPUT;cutis.fmu;{r};;reaction{k}" for k, r in enumerate(REACTIONS)]
        rules = ["rule;from_fmu;from_port;to_fmu;to_port", "FMU;cutis.fmu;;;"] + ports
        (Path(folder) / "box.csv").write_text("\n".join(rules) + "\n")
        command = ["fmucontainer", "-fmu-directory", folder, "-container", f"box.csv:{DT}", "-no-auto-input", "-no-auto-output"]
        told = subprocess.run(command, capture_output=True, text=True)
        box = Path(folder) / "box.fmu"
        assert box.exists(), told.stdout + told.stderr
        return through_fmpy_2(box, "jaw", ["reaction0", "reaction1", "reaction2"])


def ecos():
    import ctypes
    import glob

    # Its library wants TBB, which lies elsewhere in the environment.
    ctypes.CDLL(glob.glob(f"{sys.prefix}/lib/libtbb.so.12")[0], ctypes.RTLD_GLOBAL)
    from ecospy import EcosSimulation, EcosSimulationStructure

    with EcosSimulationStructure() as structure:
        structure.add_model("head", str(FMI2))
        with EcosSimulation(structure=structure, step_size=DT) as simulation:
            simulation.init()
            for z in heights():
                simulation.set_real(f"head::{JAW}", z)
                simulation.step()
            return [simulation.get_real(f"head::{name}") for name in REACTIONS]


def cosim():
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimManipulator import CosimManipulator
    from libcosimpy.CosimObserver import CosimObserver
    from libcosimpy.CosimSlave import CosimLocalSlave

    execution = CosimExecution.from_step_size(step_size=int(DT * 1e9))
    slave = execution.add_local_slave(CosimLocalSlave(fmu_path=str(FMI2), instance_name="head"))
    variables = {v.name.decode(): v.reference for v in execution.slave_variables(slave)}
    observer, manipulator = CosimObserver.create_last_value(), CosimManipulator.create_override()
    execution.add_observer(observer)
    execution.add_manipulator(manipulator)
    for z in heights():
        manipulator.slave_real_values(slave, [variables[JAW]], [z])
        assert execution.step(), "a step failed"
    return list(observer.last_real_values(slave, [variables[name] for name in REACTIONS]))


def fmi_rs():
    program = Path(__file__).parent / "fmi_rs" / "target" / "release" / "cutis-host-fmi-rs"
    told = subprocess.run([program, FMI3], capture_output=True, text=True)
    assert told.returncode == 0, told.stdout + told.stderr
    return json.loads(told.stdout.strip().splitlines()[-1])


HOSTS = {
    "FMPy 0.3.32, FMI 3.0": fmpy_3,
    "FMPy 0.3.32, FMI 2.0": fmpy_2,
    "fmi-rs 0.3.4, FMI 3.0": fmi_rs,
    "FMU Manipulation Toolbox 2.0, check of FMI 3.0": toolbox_3,
    "FMU Manipulation Toolbox 2.0, check of FMI 2.0": toolbox_2,
    "FMU Manipulation Toolbox 2.0, container of FMI 2.0, run by FMPy": container,
    "Ecos (ecospy 0.7.2), FMI 2.0": ecos,
    "libcosim (libcosimpy 0.0.6), FMI 2.0": cosim,
}


def apart(name):
    """A host in a process of its own: what it answers, or why it does not."""
    told = subprocess.run([sys.executable, __file__, ARCHIVES, name], capture_output=True, text=True, timeout=300)
    answers = re.findall(r"^ANSWER (.*)$", told.stdout, re.MULTILINE)
    if told.returncode == 0 and answers:
        return json.loads(answers[-1]), None
    return None, (told.stderr.strip().splitlines() or [f"exit code {told.returncode}"])[-1]


def main():
    reference, why = apart("FMPy 0.3.32, FMI 3.0")
    assert reference, why
    failed = 0
    print("| host | result | difference to FMPy, FMI 3.0 |\n| --- | --- | --- |")
    for name in HOSTS:
        answer, why = apart(name)
        if why:
            failed += 1
            print(f"| {name} | **fails**: {why} | - |")
        elif isinstance(answer, str):
            print(f"| {name} | {answer} | - |")
        else:
            worst = max(abs(a - b) for a, b in zip(answer, reference, strict=True))
            failed += worst > 1e-9
            print(f"| {name} | runs | {'none, bit for bit' if answer == reference else f'{worst:.1e} N'} |")
    return 1 if failed else 0


if __name__ == "__main__":
    if len(sys.argv) > 2:
        print("ANSWER", json.dumps(HOSTS[sys.argv[2]]()))
    else:
        sys.exit(main())
