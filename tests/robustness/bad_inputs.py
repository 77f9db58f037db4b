#!/usr/bin/env python3
"""The program refuses what the reader of campaign files cannot see: exit code 1, the message, and no store left behind.

Usage: bad_inputs.py COHORT SOURCE_DIR [KILL_AT_CALL]: the library gives write errors. Needs an OpenCL device. Prints one line for each case; exits 1 if one fails.
"""

import gzip
import os
import pathlib
import stat
import struct
import subprocess
import sys
import tempfile

import h5py
import numpy as np

COHORT, SOURCE = sys.argv[1], pathlib.Path(sys.argv[2])
SMALL = """scene:
  geometry: {box: {size_mm: [6, 4, 4]}}
  grid: {dx_mm: 1}
  time: {end_ms: 2}
outputs: {activation: {}}
campaign: {seed: %d}
store: small.h5
"""

failures = 0


def cohort(folder, *arguments, mpirun=(), environment=None):
    return subprocess.run(
        [*mpirun, COHORT, *arguments], cwd=folder, capture_output=True, text=True, timeout=120,
        env={**os.environ, **(environment or {})})


def expect(name, result, code, *messages):
    """Fails the case unless the program ended with `code` and each message stands in what it wrote to standard error."""
    global failures
    missing = [message for message in messages if message not in result.stderr]
    good = result.returncode == code and not missing
    print(f"{'ok    ' if good else 'FAILED'} {name}")
    if not good:
        failures += 1
        print(f"  exit code {result.returncode}, expected {code}; missing {missing}; wrote:\n{result.stderr}{result.stdout}")


def check(name, good, found):
    """Fails the case unless `good`."""
    global failures
    print(f"{'ok    ' if good else 'FAILED'} {name}")
    if not good:
        failures += 1
        print(f"  found {found}")


def write(folder, name, text):
    (folder / name).write_text(text)
    return name


def files_for_the_program(folder):
    """Files of tests/bad_configs with a "# program:" line: what they expect only a device can tell."""
    files = [f for f in sorted((SOURCE / "tests/bad_configs").glob("*.yaml")) if "# program:" in f.read_text()]
    assert len(files) >= 3, "files with a '# program:' line are gone"
    for file in files:
        lines = file.read_text().splitlines()
        expected = [line.removeprefix("# expect: ") for line in lines if line.startswith("# expect: ")]
        overrides = [part for line in lines if line.startswith("# set: ") for part in ("--set", line.removeprefix("# set: "))]
        for command in ("plan", "run"):
            result = cohort(folder, command, str(file), *overrides, *(["--store", "refused.h5"] if command == "run" else []))
            expect(f"{command} {file.name}", result, 1, *expected)
            if (folder / "refused.h5").exists():
                expect(f"{command} {file.name} leaves no store", result, None)


def stores(folder):
    small = write(folder, "small.yaml", SMALL % 1)
    other = write(folder, "other.yaml", SMALL % 2)
    expect("a good campaign runs", cohort(folder, "run", small), 0)
    before = (folder / "small.h5").read_bytes()
    expect("the store of another campaign", cohort(folder, "run", other), 1, "small.h5", "another campaign")
    assert (folder / "small.h5").read_bytes() == before, "a refused store was changed"
    (folder / "small.h5").rename(folder / "moved.h5")
    result = cohort(folder, "run", small, "--store", "moved.h5")
    expect("a store that was moved is the campaign's own", result, 0, "resuming moved.h5")

    late = ["--store", "late.h5", "--set", "campaign.timeout_s=1e-6"]
    expect("members time out", cohort(folder, "run", small, *late), 2)
    more = ["--store", "late.h5", "--set", "campaign.timeout_s=600", "--set", "campaign.retries=1"]
    expect("a campaign that timed out is finished with more time", cohort(folder, "run", small, *more), 0, "resuming late.h5")

    write(folder, "text.h5", "no HDF5")
    expect("a store that is no HDF5 file", cohort(folder, "run", small, "--store", "text.h5"), 1, "text.h5", "not a cohort file")
    expect("a store in no folder", cohort(folder, "run", small, "--store", "nowhere/a.h5"), 1, "nowhere/a.h5: ",
           "folder nowhere does not exist")
    if os.geteuid() != 0:  # root writes everywhere
        locked = folder / "locked"
        locked.mkdir()
        locked.chmod(stat.S_IRUSR | stat.S_IXUSR)
        expect("a folder that cannot be written", cohort(folder, "run", small, "--store", "locked/a.h5"), 1, "locked/a.h5")
    expect("a folder in place of a store", cohort(folder, "run", small, "--store", "."), 1, ".")
    expect("status of a store that is not there", cohort(folder, "status", "absent.h5"), 1, "absent.h5")
    expect("verify of what is no store", cohort(folder, "verify", "text.h5"), 1, "text.h5")


def a_write_error(folder):
    """A campaign that has begun can be resumed whatever goes wrong: exit code 3."""
    small = write(folder, "small.yaml", SMALL % 1)
    if len(sys.argv) > 3:
        broken_disk = {"LD_PRELOAD": sys.argv[3], "COHORT_FAIL_COMMITS": "small.h5"}
        expect("a write error while members run", cohort(folder, "run", small, environment=broken_disk), 3,
               "small.h5: cannot be written")
        expect("the same command goes on", cohort(folder, "run", small), 0, "resuming small.h5")


def devices(folder):
    small = write(folder, "small.yaml", SMALL % 1)
    nothing = folder / "no_vendors"
    nothing.mkdir(exist_ok=True)
    empty = {"OCL_ICD_VENDORS": str(nothing) + "/"}
    for arguments in (["run", small, "--store", "none.h5"], ["plan", small], ["devices"]):
        result = cohort(folder, *arguments, environment=empty)
        expect(f"no device: {arguments[0]}", result, 1, "no OpenCL device: ", "install pocl-opencl-icd")
    assert not (folder / "none.h5").exists(), "a store was created without a device"
    expect("a device that does not exist", cohort(folder, "plan", "--quick", small, "--device", "99"), 1,
           "no OpenCL device 99; there are: 0 = ")
    expect("a device that is no number", cohort(folder, "plan", "--quick", small, "--device", "fast"), 1, "cpu, gpu or an index")


def command_line(folder):
    small = write(folder, "small.yaml", SMALL % 1)
    expect("no command", cohort(folder), 1)
    expect("an unknown command", cohort(folder, "rum", small), 1)
    expect("a file that is not there", cohort(folder, "run", "absent.yaml"), 1, "absent.yaml: cannot be read")
    result = cohort(folder, "run", small, "--set", "time.dt_us=5", "--set", "grid.dx_mm=0")
    expect("mistakes in --set", result, 1, '--set:1: unknown key "dt_us" in time; did you mean "dt_ms"?',
           "--set:2: grid.dx_mm is 0 mm")


VENTRICLE = """scene:
  geometry:
    shapes:
      outer: {ellipsoid: {semi_axes_mm: [10, 10, 16]}}
      inner: {ellipsoid: {semi_axes_mm: [6, 6, 12]}}
      below_base: {half_space: {point_mm: [0, 0, 0], normal: [0, 0, 1]}}
      shell: {subtract: [outer, inner]}
      wall: {intersection: [shell, below_base]}
      blood: {intersection: [inner, below_base]}
    regions: {wall: {shape: wall, fibres: transmural}}
  grid: {dx_mm: 2}
  time: {end_ms: 20}
  mechanics:
    law: neo_hookean
    cavities: {lv: {shape: blood}}
    boundary: {base: {surface: below_base, clamp: all}}
outputs: {pv: {}}
campaign: {members: 4}
parameters:
  mechanics.cavities.lv.pressure_kPa: {log_uniform: [0.1, 5000]}
store: ventricle.h5
"""


def mechanics(folder):
    """What is odd about tissue that deforms is told; what bursts is unstable at a time and a place."""
    file = write(folder, "ventricle.yaml", VENTRICLE)
    expect("free tissue is told", cohort(folder, "plan", "--quick", file, "--set", "mechanics.boundary={}"), 0,
           "no clamp and no spring resists 6 of the six rigid motions")
    expect("a thin wall is told", cohort(folder, "plan", "--quick", file, "--set", "grid.dx_mm=4"), 0,
           "mechanics.cavities.lv: a quarter of the wall is thinner than 1.")
    expect("members that burst", cohort(folder, "run", file), 2)
    with h5py.File(folder / "ventricle.h5") as store:
        calm, broken = (store["status"][:] == code for code in (3, 6))  # done, unstable: solver/simulation.hpp
        pressures = store["parameters"][:, 0]
        places = all(b" at (" in reason and b"region wall" in reason for reason in store["members/reason"][broken])
        times = store["members/failed_at_ms"][broken]
        good = (calm | broken).all() and broken.any() and calm.any() and pressures[broken].min() > pressures[calm].max() and places and (times > 0).all() and (times < 20).all()
        good = good and not np.isnan(store["pv/volume"][calm]).any() and not np.isnan(store["pv/pressure"][calm]).any()
        check("the calm members are done, the others are unstable with time and place", good,
              f"{store['status'][:]} {store['members/reason'][:]} {store['members/failed_at_ms'][:]}")


LABELS = """scene:
  geometry: {labels: %s, convention: cohort}
  grid: {dx_mm: 6}
  time: {end_ms: 5}
outputs: {activation: {}}
"""


def label_maps(folder):
    """A heart is written as labels, read and run; what is wrong with such a file is told before a store is made."""
    heart = write(folder, "heart.yaml", (SMALL % 1).replace("{box: {size_mm: [6, 4, 4]}}", "{heart: {lv_radius_mm: 25}}").replace("dx_mm: 1", "dx_mm: 6"))
    expect("a heart as labels", cohort(folder, "run", heart, "--export", "map.nii.gz", "--export-spacing", "2"), 0, "map.nii.gz: ")
    assert not (folder / "small.h5").exists(), "--export ran the campaign"
    expect("an export of no known kind", cohort(folder, "run", heart, "--export", "map.txt"), 1, "--export map.txt")
    expect("a member that is not there", cohort(folder, "run", heart, "--export", "a.nii", "--member", "7"), 1, "--member 7")
    expect("an export into no folder", cohort(folder, "run", heart, "--export", "nowhere/a.nii"), 1, "nowhere/a.nii: cannot be written")
    for option in ("--export-spacing", "--export-every"):
        for value in ("nan", "inf", "-1"):
            expect(f"{option} {value}", cohort(folder, "run", heart, "--export", "b.nii", option, value), 1, option)
    assert not (folder / "b.nii").exists()
    labels = write(folder, "labels.yaml", LABELS % "map.nii.gz")
    expect("labels run", cohort(folder, "run", labels), 0)
    whole = (folder / "map.nii.gz").read_bytes()
    (folder / "short.nii.gz").write_bytes(whole[:len(whole) // 2])
    (folder / "text.nii.gz").write_text("no image")
    header = bytearray(gzip.decompress(whole))
    header[108:112] = struct.pack("<f", -1.0)
    (folder / "offset.nii").write_bytes(header)
    header = bytearray(gzip.decompress(whole))
    header[280:284] = struct.pack("<f", float("nan"))
    (folder / "nan.nii").write_bytes(header)
    header = bytearray(gzip.decompress(whole))
    header[-1] = 99
    (folder / "unknown.nii").write_bytes(header)
    for name, message in (("short.nii.gz", "cut short or damaged"), ("text.nii.gz", "no NIfTI-1 file"), ("offset.nii", "begins its voxels"),
                          ("nan.nii", "its sform holds nan"), ("unknown.nii", "99 (1 voxels)")):
        result = cohort(folder, "run", write(folder, "wrong.yaml", LABELS % name), "--store", "wrong.h5")
        expect(f"labels: {name}", result, 1, name + ": ", message)
        if result.stderr.count("wrong.yaml:") != 1 or (folder / "wrong.h5").exists():
            expect(f"labels: {name}: one message, no store", result, None)
    # Another image under the same name is another campaign.
    (folder / "map.nii.gz").rename(folder / "old.nii.gz")
    expect("a changed image", cohort(folder, "run", heart, "--export", "map.nii.gz", "--export-spacing", "2.5"), 0)
    expect("the store of another image", cohort(folder, "run", labels), 1, "another campaign")


def outside_the_tissue(folder):
    """A stimulus or a probe that no tissue holds is told by the plan, and of each member that runs."""
    small = write(folder, "small.yaml", SMALL % 1)
    stimulus = ["--set", "stimuli={pace: {shape: sphere, centre_mm: [%d, 2, 2], radius_mm: 1.5}}"]
    probe = ["--set", "outputs={activation: {probes: {here_mm: [%d, 2, 2]}}}"]
    inside = [text.replace("%d", "3") for text in stimulus + probe]
    result = cohort(folder, "plan", "--quick", small, *inside)
    expect("a stimulus and a probe in the tissue", result, 0)
    if "outside" in result.stderr:
        expect("no warning of what lies inside", result, None)
    outside = [text.replace("%d", "50") for text in stimulus + probe]
    of_stimulus, of_probe = 'stimulus "pace" lies outside the tissue', 'probe "here" lies outside the tissue'
    expect("a plan of a stimulus and a probe outside", cohort(folder, "plan", "--quick", small, *outside), 0, of_stimulus, of_probe)
    expect("a run of them", cohort(folder, "run", small, *outside), 2, of_stimulus, of_probe, 'stimulus "pace" reaches no tissue')
    expect("a run of a probe outside", cohort(folder, "run", small, *[text.replace("%d", "3") for text in stimulus],
                                              *[text.replace("%d", "50") for text in probe], "--store", "b.h5"), 0,
           f"member 0: {of_probe} and reads NaN")


def ranks(folder):
    """All ranks end alike, and the mistake is told once."""
    bad = write(folder, "bad.yaml", (SMALL % 1).replace("dx_mm", "dx_nm"))
    mpirun = ["mpirun", "--oversubscribe", "-n", "2"] + (["--allow-run-as-root"] if os.geteuid() == 0 else [])
    result = cohort(folder, "run", bad, mpirun=mpirun)
    expect("two ranks refuse alike", result, 1, 'bad.yaml:3:10: unknown key "dx_nm" in grid; did you mean "dx_mm"?')
    if result.stderr.count("unknown key") != 1:
        expect("a mistake is told once", result, None)


with tempfile.TemporaryDirectory() as temporary:
    for number, group in enumerate((files_for_the_program, stores, a_write_error, devices, command_line, label_maps, outside_the_tissue, mechanics, ranks)):
        place = pathlib.Path(temporary) / str(number)
        place.mkdir()
        group(place)
print(f"{failures} failed")
sys.exit(1 if failures else 0)
