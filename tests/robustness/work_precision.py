#!/usr/bin/env python3
"""`cohort study` of kind work_precision from its file to picture and measurements, and `accuracy:` that chooses from them.

Usage: work_precision.py COHORT SOURCE_DIR. Needs an OpenCL device. Prints one line for each case; exits 1 if one fails.
"""

import csv
import pathlib
import resource
import shutil
import signal
import subprocess
import sys
import tempfile

import h5py
import numpy

COHORT, SOURCE = sys.argv[1], pathlib.Path(sys.argv[2])
STUDY = f"""kind: work_precision
base: {SOURCE}/configs/circulation.yaml
set: {{campaign.members: 5, circulation.dt_ms: 0.5, time.beats.until_periodic: 0.0001, time.beats.at_most: 30}}
settings:
  - {{circulation.dt_ms: [8, 4, 2, 1]}}
  - {{label: double, circulation.dt_ms: [8, 4], precision: double}}
reference: {{circulation.dt_ms: 0.1}}
measures: [volume, LV_EF, lv_peak_mmHg]
repeats: 2
measurements: measured.yaml
store: study.h5
"""
failures = 0


def expect(name, ok, told=""):
    global failures
    failures += not ok
    print("ok  " if ok else "FAIL", name, "" if ok else told)


def cohort(folder, *arguments):
    return subprocess.run([COHORT, *arguments], cwd=folder, capture_output=True, text=True, timeout=200)


def factors(line):
    """Distance, times as slow, times the error, as printed."""
    return ["1.00"] * 3 if line.endswith("on the front") else [word for word in line.split() if word[0].isdigit()]


def check_front(device_s, rms, front, distance, slow, wrong):
    """By the definition in configs/studies/README.md, written once more."""
    time, spread = numpy.median(device_s, axis=1), numpy.ptp(device_s, axis=1)
    for m, error in enumerate(rms):
        for i in range(len(time)):
            ratios = []
            for j in range(len(time)):
                equal = abs(error[i] - error[j]) <= 1e-3 * max(error[i], error[j])
                if time[j] <= time[i] and (equal or error[j] < error[i]):
                    noise = abs(time[i] - time[j]) <= max(spread[i], spread[j])
                    ratios.append((1 if noise else time[i] / time[j], 1 if equal else error[i] / error[j]))
            want = max([1] + [min((r for r in pair if r != 1), default=1) for pair in ratios])
            found = (distance[m, i], slow[m, i], wrong[m, i])
            expect(f"distance of setting {i} from the front of measure {m}",
                   numpy.allclose(found, (want, *(max([1] + [pair[k] for pair in ratios]) for k in (0, 1)))) and front[m, i] == (want == 1),
                   f"{found} {ratios}")


def study(folder):
    (folder / "study.yaml").write_text(STUDY)
    result = cohort(folder, "study", "study.yaml")
    expect("the study ends", result.returncode == 0, result.stderr)
    with h5py.File(folder / "study.h5") as file:
        scene = file["000"]
        labels = [label.decode() for label in scene["settings/label"][:]]
        rms, errors = scene["measures/rms"][:], scene["measures/error"][:]
        device_s, default = scene["settings/device_s"][:], scene["settings/default"][:]
        expect("settings, and the default beside them", labels[-1] == "default" and len(labels) == 7, labels)
        expect("one default", default.sum() == 1 and default[-1] == 1)
        expect("a time for each repeat", device_s.shape == (7, 2) and (device_s > 0).all())
        expect("rms is that of the members", numpy.allclose(rms, numpy.sqrt((errors**2).mean(axis=2))))
        reference = scene["measures/reference"][:]
        expect("values of the reference, none of norms", numpy.isnan(reference[0]).all() and ((reference[1:] > 20) & (reference[1:] < 200)).all(),
               reference)
        expect("finer steps have smaller errors", (numpy.diff(rms[:, :4], axis=1) < 0).all(), rms)
        check_front(device_s, rms, *(scene[f"measures/{name}"][:] for name in ("front", "distance", "times_as_slow", "times_the_error")))
    rows = list(csv.DictReader(open(folder / "study.csv", newline="")))
    expect("a row of the CSV for each setting and measure", len(rows) == 21)
    expect("orders and rounding are told", "observed order" in result.stdout and "rounding of single" in result.stdout, result.stdout)
    expect("a picture", (folder / "study.png").read_bytes().startswith(b"\x89PNG"))
    for suffix in ("h5", "csv"):
        shutil.copyfile(folder / f"study.{suffix}", folder / f"study_loop.{suffix}")
    (folder / "study_loop.txt").write_text(result.stdout)
    (folder / "page").mkdir()
    page = subprocess.run([sys.executable, "-m", "analysis.studies", folder, folder / "page"], cwd=SOURCE, capture_output=True, text=True)
    text = (folder / "page" / "studies.md").read_text() if page.returncode == 0 else ""
    told = [factors(line) for line in result.stdout.splitlines() if line.startswith("the default is")]
    listed = [[cell.strip() for cell in line.split("|")[6:9]] for line in text.splitlines() if line.startswith("| -")]
    columns = [[f"{float(row[name]):.2f}" for name in ("distance", "times_as_slow", "times_the_error")] for row in rows if row["default"] == "1"]
    expect("page and CSV have the distances that are printed", len(told) == 3 and listed == told == columns and "observed order" in text,
           f"{page.stderr} {told} {listed} {columns}")
    return dict(zip(labels, rms[1]))


def campaign(folder, accuracy, *arguments):
    text = (SOURCE / "configs" / "circulation.yaml").read_text()
    (folder / "campaign.yaml").write_text(text + f"accuracy: {accuracy}\n")
    return cohort(folder, "plan", "campaign.yaml", "--set", "campaign.members=3", "--set", "time.beats.until_periodic=0.0001",
                  "--set", "time.beats.at_most=30", *arguments)


def interrupted(folder, begun, rows):
    """After the line that has `begun` in it; leaves `rows` settings."""
    (folder / "long.yaml").write_text(STUDY.replace("repeats: 2", "repeats: 1000").replace("measured.yaml", "long_measured.yaml"))
    process = subprocess.Popen([COHORT, "study", "long.yaml", "--store", "long.h5"], cwd=folder, stdout=subprocess.PIPE,
                               stderr=subprocess.STDOUT, text=True)
    told = []
    for line in process.stdout:
        told.append(line)
        if begun in line:
            break
    process.terminate()
    told += process.communicate(timeout=100)[0].splitlines(True)
    expect("an interrupted study ends as such", process.returncode == 3 and any("interrupted" in line for line in told),
           f"{process.returncode}: {told}")
    with h5py.File(folder / "long.h5") as file:
        labels, rms = file["000/settings/label"][:], file["000/measures/rms"][:]
        expect("and keeps what has run", len(labels) in rows and rms.shape == (3, len(labels)) and (rms > 0).all(), labels)
    expect("measured for accuracy where every setting has run", (folder / "long_measured.yaml").exists() == (len(labels) == 7))


def full_disk(folder):
    """As if the disk were: files may not grow once all kernels are built, whose cache is on the same disk."""
    (folder / "full").mkdir()
    process = subprocess.Popen([COHORT, "study", "study.yaml", "--store", "full/study.h5"], cwd=folder, stdout=subprocess.PIPE,
                               stderr=subprocess.STDOUT, text=True, preexec_fn=lambda: signal.signal(signal.SIGXFSZ, signal.SIG_IGN))
    told = ""
    for line in process.stdout:
        told += line
        if "(2 of 2)" in line:
            resource.prlimit(process.pid, resource.RLIMIT_FSIZE, (4000, 4000))
    process.wait(timeout=100)
    left = [file.name for file in (folder / "full").iterdir()]
    expect("a disk that is full is told, with nothing half written",
           process.returncode == 3 and "full/study.h5: " in told and "bytes cannot be written" in told and not left,
           f"{process.returncode}, {left}: {told[-300:]}")


def choices(folder, rms):
    told = campaign(folder, "{LV_EF: %g, measurements: measured.yaml}" % (20 * rms["circulation 4 ms"])).stdout
    expect("a wide wish takes a cheap setting", "accuracy: circulation 8 ms" in told or "accuracy: circulation 4 ms" in told
           or "accuracy: double" in told, told)
    told = campaign(folder, "{LV_EF: %g, measurements: measured.yaml}" % (6 * rms["circulation 1 ms"])).stdout
    expect("a narrow one a finer step, and says what is too coarse",
           "accuracy: circulation 1 ms" in told and "too coarse is circulation 8 ms" in told, told)
    told = cohort(folder, "parameters", "campaign.yaml", "--set", "campaign.members=3", "--set", "time.beats.until_periodic=0.0001",
                  "--set", "time.beats.at_most=30").stdout
    expect("which the campaign then has", [line.split()[2] for line in told.splitlines() if line.startswith("circulation.dt_ms")] == ["1"], told)
    for name, accuracy, arguments, message in [
            ("nothing is good enough", "{LV_EF: 1e-12, measurements: measured.yaml}", [], "no setting measured in measured.yaml is as accurate"),
            ("a feature that nobody measured", "{QRS: 3 ms, measurements: measured.yaml}", [], "QRS: no such feature"),
            ("another unit", "{LV_EF: 3 ms, measurements: measured.yaml}", [], "is in ms"),
            ("no error", "{LV_EF: -1 %, measurements: measured.yaml}", [], "is an error above 0"),
            ("no number", "{LV_EF: small, measurements: measured.yaml}", [], "is an error above 0"),
            ("no feature", "{measurements: measured.yaml}", [], "names no feature"),
            ("no such file", "{LV_EF: 1 %, measurements: nowhere.yaml}", [], "nowhere.yaml: cannot be read"),
            ("what is chosen is set", "{LV_EF: 1 %, measurements: measured.yaml}", ["--set", "circulation.dt_ms=3"], "is chosen by accuracy")]:
        result = campaign(folder, accuracy, *arguments)
        expect(name, result.returncode == 1 and message in result.stderr, result.stderr)
    text = (folder / "measured.yaml").read_text()
    (folder / "measured.yaml").write_text(text.replace("geometry none", "geometry heart"))
    result = campaign(folder, "{LV_EF: 1 %, measurements: measured.yaml}")
    expect("measurements of another scene", result.returncode == 1 and "is of another scene" in result.stderr, result.stderr)
    (folder / "measured.yaml").write_text(text.replace("version: 2", "version: 99"))
    result = campaign(folder, "{LV_EF: 1 %, measurements: measured.yaml}")
    expect("measurements of another version", result.returncode == 1 and "version 99" in result.stderr, result.stderr)


def bad_studies(folder):
    for name, before, after, message in [
            ("no kind", "kind: work_precision\n", "", '"kind" is missing'),
            ("no such kind", "kind: work_precision", "kind: speed", "kind"),
            ("no base", "base: ", "basis: ", '"base" is missing'),
            ("no such base", "circulation.yaml", "nowhere.yaml", "cannot be read"),
            ("no settings", "settings:\n", "setings:\n", '"settings" is missing'),
            ("a setting that is no key", "circulation.dt_ms: [8, 4, 2, 1]", "circulation.dt_sm: [8, 4]", 'unknown key "dt_sm"'),
            ("a setting out of range", "[8, 4, 2, 1]", "[8, -4]", "circulation.dt_ms"),
            ("a setting twice", "[8, 4, 2, 1]", "[8, 8]", "two settings are called"),
            ("no reference", "reference: ", "ref: ", '"reference" is missing'),
            ("a reference that is no map", "{circulation.dt_ms: 0.1}", "0.1", "reference is"),
            ("too few members for measurements", "campaign.members: 5", "campaign.members: 3", "measurements need 4 members"),
            ("measurements of what is no setting", "settings:\n", "settings:\n  - {circulation.lv.contraction_ms: 200}\n", "not of circulation.lv.contraction_ms"),
            ("no repeats", "repeats: 2", "repeats: 0", "repeats"),
            ("too many repeats", "repeats: 2", "repeats: 5000000", "at most 1000"),
            ("one value twice", "[8, 4, 2, 1]", "[4, 4.0]", "are the same"),
            ("no alternatives", "[8, 4, 2, 1]", "[]", "is an empty list"),
            ("no alternatives beside others", "circulation.dt_ms: [8, 4], precision", "circulation.dt_ms: [], precision", "bad.yaml:6:"),
            ("no scenes", "repeats: 2", "repeats: 2\nfor_each: {circulation.dt_ms: []}", "is an empty list"),
            ("more members in a setting", "precision: double", "campaign.members: 7", "bad.yaml:6:48: setting"),
            ("other points in a setting", "precision: double", "campaign.seed: 7", "has other members"),
            ("another range in the reference", "dt_ms: 0.1}", "dt_ms: 0.1, parameters: {circulation.lv.active_elastance_mmHg_per_mL: {uniform: [2, 3]}}}",
             "the reference has other members"),
            ("more members in the reference", "dt_ms: 0.1}", "dt_ms: 0.1, campaign.members: 9}", "the reference has other members"),
            ("no such measure", "LV_EF", "LV_EFF", "no such feature"),
            ("no measures", "[volume, LV_EF, lv_peak_mmHg]", "[]", "nothing would be compared"),
            ("a measure twice", "lv_peak_mmHg]", "lv_ef_percent]", "lv_ef_percent stands there twice"),
            ("an ECG of no scene", "[volume,", "[ecg,", "ecg is no output of the scene"),
            ("a norm against values", "reference: {circulation.dt_ms: 0.1}", "reference: {values: {LV_EF: 55}}", "volume needs a reference that is run"),
            ("a value of no measure", "reference: {circulation.dt_ms: 0.1}\nmeasures: [volume, LV_EF, lv_peak_mmHg]",
             "reference: {values: {lv_ef_percent: 55, LV_EDV: 120}}\nmeasures: [LV_EF]", "LV_EDV is none of the measures"),
            ("a measure without its value", "reference: {circulation.dt_ms: 0.1}\nmeasures: [volume, ", "reference: {values: {LV_EF: 55}}\nmeasures: [",
             "has no lv_peak_mmHg"),
            ("measurements in no folder", "measured.yaml", "nowhere/measured.yaml", "is no folder"),
            ("measurements over the study", "measured.yaml", "./bad.yaml", "written over"),
            ("measurements over the table", "measured.yaml", "bad.csv", "written over")]:
        text = STUDY.replace(before, after, 1)
        if "values:" in after:
            text = text.replace("measurements: measured.yaml\n", "")
        (folder / "bad.yaml").write_text(text)
        result = cohort(folder, "study", "bad.yaml", "--store", "bad.h5")
        expect(name, result.returncode == 1 and message in result.stderr and not (folder / "bad.h5").exists()
               and (folder / "bad.yaml").read_text() == text, f"{result.returncode}: {result.stderr}")
    for store in ("bad.csv", "bad.png", "bad.yaml", ""):
        (folder / "bad.yaml").write_text(STUDY.replace("study.h5", store or '""'))
        result = cohort(folder, "study", "bad.yaml")
        expect(f'a store called "{store}"', result.returncode == 1 and "store" in result.stderr, f"{result.returncode}: {result.stderr}")


def no_foreign_files(folder):
    """Nothing that is no file of such a study is written over, and nothing runs before that is known."""
    with h5py.File(folder / "foreign.h5", "w") as file:
        file.attrs["format"] = "cohort"
    (folder / "table.csv").write_text("a,b\n")
    (folder / "other.yaml").write_text("kind: campaign\n")
    (folder / "folder.h5").mkdir()
    (folder / "measuring.yaml").write_text(STUDY.replace("measured.yaml", "other.yaml"))
    for store, file, message in [("foreign.h5", "study.yaml", "is no file of such a study"), ("table.h5", "study.yaml", "is no table of such a study"),
                                 ("folder.h5", "study.yaml", "it is a folder"), ("new.h5", "measuring.yaml", "is no file of measurements")]:
        before = {path: path.read_bytes() for path in folder.iterdir() if path.is_file()}
        result = cohort(folder, "study", file, "--store", store)
        expect(f"{store} of {file} is refused", result.returncode == 1 and message in result.stderr and "(1 of" not in result.stderr,
               f"{result.returncode}: {result.stderr}")
        expect("and all stays", before == {path: path.read_bytes() for path in folder.iterdir() if path.is_file()})
    result = cohort(folder, "plan", "study.yaml")
    expect("a study is no campaign", result.returncode == 1 and "this is a study, not a campaign" in result.stderr, result.stderr)
    result = cohort(folder, "study", "study.yaml", "--set", "repeats=3")
    expect("--set of the study's own keys is refused", result.returncode == 1 and "repeats is a key of the study itself" in result.stderr, result.stderr)


def values_by_any_name(folder):
    text = STUDY.replace("reference: {circulation.dt_ms: 0.1}\nmeasures: [volume, LV_EF, lv_peak_mmHg]",
                         "reference: {values: {LV_EF: 55}}\nmeasures: [lv_ef_percent]")
    text = text.replace("[8, 4, 2, 1]", "[8, 4]").replace("repeats: 2", "repeats: 1").replace("measurements: measured.yaml\n", "")
    (folder / "values.yaml").write_text(text)
    result = cohort(folder, "study", "values.yaml", "--store", "values.h5")
    expect("a known value is found by the feature's short name", result.returncode == 0, result.stderr)
    with h5py.File(folder / "values.h5") as file:
        expect("and is what errors are from", (file["000/measures/reference"][:] == 55).all())


with tempfile.TemporaryDirectory() as temporary:
    place = pathlib.Path(temporary)
    choices(place, study(place))
    interrupted(place, "circulation 4 ms (1 of", range(2, 7))
    interrupted(place, "circulation 8 ms (2 of", [7])
    full_disk(place)
    values_by_any_name(place)
    no_foreign_files(place)
    bad_studies(place)
sys.exit(1 if failures else 0)
