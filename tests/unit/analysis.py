#!/usr/bin/env python3
"""analysis/ reads what the program writes. usage: analysis.py COHORT"""
import contextlib
import io
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

import h5py
import numpy

SOURCE = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(SOURCE))
from analysis import ecg, pv  # noqa: E402
from analysis.store import Status, Store  # noqa: E402

COHORT = sys.argv.pop(1)
MEMBERS, PARAMETERS, LEADS, SAMPLES = 4, 7, 12, 30  # 60 ms at 500 Hz


def run(folder, config, *overrides):
    command = [COHORT, "run", str(SOURCE / "configs" / config), "--device", "cpu"]
    for override in overrides:
        command += ["--set", override]
    subprocess.run(command, cwd=folder, check=True, capture_output=True)


class ReadsTheProgramsFile(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp())
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        run(cls.folder, "ecg_campaign.yaml", "grid.dx_mm=6", "time.end_ms=60", f"campaign.members={MEMBERS}", "store=demo.h5")
        cls.path = cls.folder / "demo.h5"

    def setUp(self):
        self.copy = self.folder / "copy.h5"
        shutil.copy(self.path, self.copy)
        self.store = Store(self.copy)
        self.addCleanup(self.store.close)

    def write(self, dataset, index, value):
        """Changes a value as the program does: in place, with the file open elsewhere."""
        with h5py.File(self.path, "r", locking=False) as file:
            offset, item = file[dataset].id.get_offset(), file[dataset].dtype.itemsize
            data = numpy.array(value, file[dataset].dtype).tobytes()
        with open(self.copy, "r+b") as raw:
            raw.seek(offset + index * item)
            raw.write(data)

    def test_three_lines_of_the_readme(self):
        readme = (SOURCE / "README.md").read_text()
        code = next(block for block in readme.split("```python\n")[1:]).split("```")[0]
        names = {}
        exec(code.replace('"demo.h5"', repr(str(self.path))), names)
        self.assertEqual(names["theta"].shape, (MEMBERS, PARAMETERS))
        self.assertEqual(names["ecg"].shape, (MEMBERS, LEADS, SAMPLES))
        self.assertTrue(numpy.isfinite(names["ecg"]).all())

    def test_shapes(self):
        store = self.store
        self.assertEqual(store.members, MEMBERS)
        self.assertTrue(store.done.all() and store.finished)
        self.assertEqual(store.parameters.shape, (MEMBERS, PARAMETERS))
        self.assertEqual(store.unit_parameters.shape, (MEMBERS, PARAMETERS))
        self.assertEqual(store.ecg().shape, (MEMBERS, LEADS, SAMPLES))
        self.assertEqual(store.ecg(2).shape, (LEADS, SAMPLES))
        self.assertEqual(store.features.shape, (MEMBERS, len(store.feature_names)))
        self.assertEqual(len(store.feature_units), len(store.feature_names))
        self.assertEqual(store.leads, "I II III aVR aVL aVF V1 V2 V3 V4 V5 V6".split())
        numpy.testing.assert_allclose(numpy.diff(store.ecg_ms), 2)
        self.assertEqual(set(store.columns), {path.split("/")[-1] for path in h5py.File(self.path)["members"]})
        self.assertTrue((store.column("reason") == "").all())
        self.assertEqual(list(store.column("attempts")), [1] * MEMBERS)

    def test_states_have_the_names_of_the_file(self):
        self.assertEqual([status.name.lower() for status in Status], self.store.legend)

    def test_parameters_lie_within_their_bounds(self):
        lower, upper = self.store.bounds.T
        self.assertTrue((self.store.parameters >= lower).all() and (self.store.parameters <= upper).all())
        self.assertEqual(len(self.store.priors), PARAMETERS)
        self.assertEqual(self.store.parameter_units[0], "mm")
        self.assertIn("geometry.heart.lv_radius_mm", self.store.parameter_names)

    def test_limb_leads_are_combinations_of_two(self):
        one, two, three, r, l, f = numpy.moveaxis(self.store.ecg(), 1, 0)[:6]
        for lead, combination in ((three, two - one), (r, -(one + two) / 2), (l, one - two / 2), (f, two - one / 2)):
            numpy.testing.assert_allclose(lead, combination, atol=1e-6)

    def test_the_campaign_and_its_speed_are_told(self):
        self.assertIn("lv_radius_mm", self.store.campaign)
        self.assertEqual(len(self.store.sha256), 64)
        self.assertEqual(self.store.seed, 1)
        (process,) = self.store.performance
        self.assertEqual(process.simulated_ms, MEMBERS * 60)
        self.assertGreater(process.triad_GB_per_s, 0)
        step = next(kernel for kernel in process.kernels if kernel.name == "project_blocks")
        self.assertGreater(step.GB_per_s, 0)
        self.assertEqual(process.kernels, sorted(process.kernels, key=lambda kernel: -kernel.device_ms))

    def test_a_snapshot_lasts_until_it_is_refreshed(self):
        self.write("status", 1, Status.RUNNING)
        self.assertTrue(self.store.done.all())
        self.store.refresh()
        self.assertEqual(list(self.store.done), [True, False, True, True])
        self.assertFalse(self.store.finished)
        self.write("ecg", 0, 7)
        self.write("status", 1, Status.DONE)
        self.store.refresh()
        self.assertTrue(self.store.finished)
        self.assertEqual(self.store.ecg(0)[0, 0], 7)

    def test_niederers_benchmark_leaves_tracked_results_alone(self):
        tracked = {path: path.read_bytes() for path in (SOURCE / "tests" / "results").iterdir()}
        environment = {**os.environ, "COHORT": COHORT, "DEVICE": "cpu", "PYTHON": sys.executable}
        subprocess.run([SOURCE / "jobs" / "niederer.sh", "1"], cwd=self.folder, env=environment, check=True)
        page = (self.folder / "niederer-results" / "niederer.md").read_text()
        self.assertIn("## dx 1 mm", page)
        self.assertIn("| (20, 7, 3) |", page)
        self.assertEqual(tracked, {path: path.read_bytes() for path in (SOURCE / "tests" / "results").iterdir()})

    def test_without_ecg(self):
        run(self.folder, "slab.yaml", "grid.dx_mm=1", "time.end_ms=5")
        with Store(self.folder / "slab.h5") as store:
            self.assertEqual(store.leads, [])
        with self.assertRaisesRegex(SystemExit, "no ECG"):
            ecg.main([str(self.folder / "slab.h5")])

    def test_another_file_is_refused(self):
        with h5py.File(self.folder / "other.h5", "w"):
            pass
        self.assertRaises(ValueError, Store, self.folder / "other.h5")
        self.assertRaises(OSError, Store, self.folder / "missing.h5")

    def test_sheet(self):
        ecg.main([str(self.path), "--member", "1"])
        picture = (self.folder / "demo_ecg.png").read_bytes()
        self.assertTrue(picture.startswith(b"\x89PNG") and len(picture) > 10_000)
        self.write("status", 0, Status.FAILED)
        with self.assertRaisesRegex(SystemExit, "member 0 is not done"):
            ecg.main([str(self.copy), "--member", "0"])

    def test_sheet_has_25_mm_per_s_and_10_mm_per_mV(self):
        time_ms = numpy.arange(0, 1000, 4.0)
        waves = numpy.zeros((1, LEADS, len(time_ms)))
        waves[:, :, 100] = 1  # mV, at 400 ms
        figure = ecg.draw(self.store.leads, time_ms, waves, 0, 10, "", "")
        lines = [line.get_xydata() for line in figure.axes[0].lines if len(line.get_xydata()) == len(time_ms)]
        self.assertEqual(len(lines), LEADS + 1)
        for line in lines:
            self.assertAlmostEqual(numpy.ptp(line[:, 1]), 10)
            self.assertAlmostEqual(line[100, 0] - line[0, 0], 10)


class PressureAndVolume(unittest.TestCase):
    COMPARTMENTS = ["LV", "RV", "LA", "RA", "aorta", "pulmonary_artery"]

    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp())
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        run(cls.folder, "circulation.yaml", f"campaign.members={MEMBERS}", "outputs.pv.rate_hz=500")
        cls.path = cls.folder / "circulation.h5"

    def setUp(self):
        self.store = Store(self.path)
        self.addCleanup(self.store.close)

    def series(self, name):
        c = self.store.compartments.index(name)
        return self.store.pressure()[:, c], self.store.volume()[:, c]

    def test_shapes(self):
        store = self.store
        self.assertTrue(store.done.all())
        self.assertEqual(store.compartments, self.COMPARTMENTS)
        self.assertEqual(store.pressure().shape, (MEMBERS, 6, 400))
        self.assertEqual(store.volume().shape, (MEMBERS, 6, 400))
        self.assertEqual(store.pressure(2).shape, (6, 400))
        numpy.testing.assert_allclose(store.pv_ms, 2 * numpy.arange(400))
        self.assertTrue(numpy.isfinite(store.pressure()).all() and numpy.isfinite(store.volume()).all())
        self.assertEqual(store.leads, [])
        self.assertEqual(store.points, [])

    def test_features_are_those_of_the_series(self):
        pressure, volume = self.series("LV")
        numpy.testing.assert_allclose(self.store.feature("lv_edv_mL"), volume.max(axis=1), rtol=1e-4)
        numpy.testing.assert_allclose(self.store.feature("lv_esv_mL"), volume.min(axis=1), rtol=1e-4)
        numpy.testing.assert_allclose(self.store.feature("lv_peak_mmHg"), pressure.max(axis=1), rtol=1e-6)
        aorta = self.series("aorta")[0]
        numpy.testing.assert_allclose(self.store.feature("aorta_diastolic_mmHg"), aorta.min(axis=1), rtol=1e-6)
        # The area of the loop, by the shoelace formula: volume falls at high pressure.
        following = [numpy.roll(series, -1, axis=1) for series in (pressure, volume)]
        area = (volume * following[0] - following[1] * pressure).sum(axis=1) / 2 * 0.133322
        numpy.testing.assert_allclose(self.store.feature("lv_stroke_work_mJ"), area, rtol=1e-4)

    def test_in_a_periodic_beat_both_ventricles_eject_as_much(self):
        numpy.testing.assert_allclose(self.store.feature("lv_sv_mL"), self.store.feature("rv_sv_mL"), rtol=5e-3)
        phases = ["isovolumic_contraction", "ejection", "isovolumic_relaxation", "filling"]
        for side in ("lv", "rv"):
            total = sum(self.store.feature(f"{side}_{phase}_ms") for phase in phases)
            numpy.testing.assert_allclose(total, 800, atol=1e-3)

    def test_unknown_features_are_refused(self):
        self.assertRaises(ValueError, self.store.feature, "lv_edv")

    def test_loops(self):
        pv.main([str(self.path), "--member", "2"])
        picture = (self.folder / "circulation_pv.png").read_bytes()
        self.assertTrue(picture.startswith(b"\x89PNG") and len(picture) > 50_000)
        with self.assertRaisesRegex(SystemExit, "no member 9 among 4"):
            pv.main([str(self.path), "--member", "9"])

    def test_the_bold_loop_is_that_of_the_member(self):
        pressure, volume = self.store.pressure(), self.store.volume()
        figure = pv.draw(self.COMPARTMENTS, self.store.pv_ms, pressure, volume, 2)
        self.assertEqual(len(figure.axes), 7)  # four loops, both sides' pressures, volumes
        (loop,) = figure.axes[3].lines
        numpy.testing.assert_array_equal(loop.get_xdata()[:-1], volume[2, 3])
        numpy.testing.assert_array_equal(loop.get_ydata()[:-1], pressure[2, 3])
        self.assertEqual(len(figure.axes[3].collections[0].get_segments()), MEMBERS - 1)
        pv.plt.close(figure)

    def test_cavities_without_a_circulation_are_drawn_too(self):
        figure = pv.draw(["hollow"], self.store.pv_ms, self.store.pressure()[:, :1], self.store.volume()[:, :1], 0)
        self.assertEqual(len(figure.axes), 3)
        pv.plt.close(figure)

    def test_features_beside_healthy_ranges(self):
        ranges = pv.read_ranges(pv.RANGES)
        self.assertGreater(len(ranges), 20)
        self.assertEqual(set(ranges) - set(self.store.feature_names), set())
        edv = self.store.feature("lv_edv_mL")
        around = {"lv_edv_mL": (edv[1] - 1e-3, edv[1] + 1e-3), "lv_esv_mL": (0, 1)}
        rows = pv.check(self.store, 1, around)
        self.assertEqual([(row[0], row[4]) for row in rows], [("lv_edv_mL", True), ("lv_esv_mL", False)])
        self.assertEqual([row[5] for row in rows], [1 / MEMBERS, 0])
        file = self.folder / "ranges.yaml"
        for text, code in ((f"lv_edv_mL: [{edv[1] - 1}, {edv[1] + 1}]  # mL\n", 0), ("lv_esv_mL: [0, 1]\n", 2)):
            file.write_text("# ranges\n\n" + text)
            told = io.StringIO()
            with contextlib.redirect_stdout(told), self.assertRaises(SystemExit) as ended:
                pv.main([str(self.path), "--member", "1", "--check", str(file)])
            self.assertEqual(ended.exception.code, code)
            self.assertIn("OUTSIDE" if code else "1 of 1 within", told.getvalue())
        file.write_text("lv_edv_mL: 3 to 4\n")
        self.assertRaisesRegex(ValueError, "ranges.yaml:1: expected", pv.read_ranges, file)

    def test_without_pressure_and_volume(self):
        run(self.folder, "slab.yaml", "grid.dx_mm=1", "time.end_ms=5")
        with Store(self.folder / "slab.h5") as store:
            self.assertEqual(store.compartments, [])
        with self.assertRaisesRegex(SystemExit, "no pressure and volume"):
            pv.main([str(self.folder / "slab.h5")])


if __name__ == "__main__":
    unittest.main()
