#!/usr/bin/env python3
"""`cohort run --export vtk` and what reads it. usage: export.py COHORT

Where Debian's python3-vtk9 is installed, VTK reads the files too.
"""
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest
import zlib

import numpy

SOURCE = pathlib.Path(__file__).resolve().parents[2]
COHORT = sys.argv.pop(1)
sys.path.insert(0, str(SOURCE))

from analysis import activation, vti  # noqa: E402
from analysis.store import Store  # noqa: E402

# A scar, which holds no excitable cells, keeps the wave from what lies behind it.
SCENE = """
scene:
  geometry:
    shapes:
      block: {box: {centre_mm: [10, 2.5, 2], size_mm: [20, 5, 4]}}
      scarred: {box: {centre_mm: [13, 2.5, 2], size_mm: [2, 20, 20]}}
      core: {intersection: [block, scarred]}
    regions:
      scar: {shape: core, excitable: false}
      muscle: {shape: block, fibres: constant}
    fibres: {direction: [0, 1, 0]}
  grid: {dx_mm: 1}
  time: {end_ms: 60}
  electrophysiology:
    conductivity_longitudinal_mS_per_mm: 1
    conductivity_transverse_mS_per_mm: 1
  stimuli:
    left: {shape: box, lower_mm: [0, 0, 0], upper_mm: [2, 5, 4]}
outputs: {activation: {probes: {middle_mm: [10.5, 2.5, 2.5]}}}
parameters:
  electrophysiology.conductivity_longitudinal_mS_per_mm: {choice: [1, 2]}
  electrophysiology.conductivity_transverse_mS_per_mm: {choice: [1, 2]}
campaign: {members: 4, method: grid}
"""


class Export(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.path = pathlib.Path(cls.folder.name)
        (cls.path / "block.yaml").write_text(SCENE)
        cls.run_cohort("--store", "block.h5", check=True)
        cls.run_cohort("--store", "block.h5", "--export", "vtk", "--member", "3", "--export-every", "4", check=True)
        cls.image = vti.read(cls.path / "block_vtk" / "tissue.vti")

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    @classmethod
    def run_cohort(cls, *arguments, check=False):
        result = subprocess.run([COHORT, "run", "block.yaml", "--device", "cpu", *arguments], cwd=cls.path,
                                capture_output=True, text=True)
        if check and result.returncode != 0:
            raise AssertionError(result.stderr)
        return result

    @property
    def x(self):
        """Of the centres of tissue cells."""
        return numpy.broadcast_to(self.image.centres(0), self.image.tissue.shape)[self.image.tissue]

    def field(self, name):
        return self.image.fields[name][self.image.tissue]

    def test_the_box_holds_the_tissue_in_its_place(self):
        """20 x 5 x 4 mm from the origin."""
        for axis, length in enumerate((20, 5, 4)):
            centres = self.image.centres(axis)
            used = centres[self.image.tissue.any(axis=tuple(2 - a for a in range(3) if a != axis))]
            numpy.testing.assert_allclose([used[0], used[-1]], [0.5, length - 0.5])
        # The scar lies from x = 12 to 14 mm, all across y and z.
        numpy.testing.assert_array_equal(numpy.unique(self.x), [0.5 + k for k in range(20) if k not in (12, 13)])
        self.assertAlmostEqual(float(self.field("fraction").sum()), 18 * 5 * 4, places=3)
        self.assertTrue((self.field("region") == 1).all())
        numpy.testing.assert_array_equal(self.field("fibre"), numpy.broadcast_to([0, 1, 0], (18 * 20, 3)))
        self.assertTrue((self.image.fields["region"][~self.image.tissue] == 255).all())

    def test_activation_is_that_of_the_campaign(self):
        with Store(self.path / "block.h5") as store:
            features = dict(zip(store.feature_names, store.features[3]))
            other = dict(zip(store.feature_names, store.features[0]))
        times = self.field("activation_ms")
        self.assertAlmostEqual(numpy.nanmin(times), features["activation_first_muscle_ms"], places=5)
        self.assertAlmostEqual(numpy.nanmax(times), features["activation_last_muscle_ms"], places=5)
        self.assertNotAlmostEqual(features["activation_last_muscle_ms"], other["activation_last_muscle_ms"], places=1)
        numpy.testing.assert_array_equal(numpy.isnan(times), self.x > 14)
        self.assertTrue(numpy.isnan(self.image.fields["activation_ms"][~self.image.tissue]).all())
        middle = [int((at - corner) // self.image.dx_mm) for at, corner in zip((10.5, 2.5, 2.5), self.image.origin_mm)]
        self.assertAlmostEqual(self.image.fields["activation_ms"][tuple(middle[::-1])], features["activation_middle_ms"], delta=0.1)

    def test_potentials_cross_the_threshold_when_activation_says(self):
        """At each sample a cell is above 0 mV if it was activated and not long ago."""
        series = vti.series(self.path / "block_vtk" / "potential.pvd")
        self.assertEqual([time for time, _ in series], list(range(0, 61, 4)))
        first = vti.read(series[0][1])
        numpy.testing.assert_array_equal(first.fields["potential_mV"][first.tissue], -85)
        times = self.field("activation_ms")
        margin, plateau = 0.2, 40
        for time, path in series:
            potential = vti.read(path).fields["potential_mV"][self.image.tissue]
            self.assertTrue((potential[(times < time - margin) & (times > time - plateau)] > 0).all(), time)
            self.assertTrue((potential[~(times < time + margin)] < 0).all(), time)

    def test_a_shorter_export_leaves_no_potentials_of_the_one_before(self):
        with tempfile.TemporaryDirectory() as folder:
            target = pathlib.Path(folder) / "other.h5"
            for every, count in ((10, 7), (0, 0)):
                self.run_cohort("--store", str(target), "--export", "vtk", "--export-every", str(every), check=True)
                self.assertEqual(len(list(target.with_name("other_vtk").glob("potential_*.vti"))), count)
            self.assertFalse(target.exists(), "an export is no campaign")

    def test_the_folder_is_named_by_the_store_or_by_the_argument(self):
        with tempfile.TemporaryDirectory() as folder:
            target = pathlib.Path(folder)
            for argument, expected in (("vtk", "store_vtk"), (str(target / "mine_vtk"), "mine_vtk")):
                self.run_cohort("--store", str(target / "store.h5"), "--export", argument, "--export-every", "0", check=True)
                self.assertEqual([path.name for path in target.iterdir()], [expected])
                self.assertTrue((target / expected / "tissue.vti").exists())
                shutil.rmtree(target / expected)

    def test_what_cannot_be_exported_is_refused(self):
        for arguments, message in ((("--export", "vtx"), "vtx"), (("--export", "vtk", "--member", "4"), "members 0 to 3"),
                                   (("--export", "vtk", "--export-every", "0.3"), "multiple of 1 ms"), (("--member", "1"), "--export")):
            result = self.run_cohort("--store", "no.h5", *arguments)
            self.assertEqual(result.returncode, 1, arguments)
            self.assertIn(message, result.stderr + result.stdout)
        self.assertFalse((self.path / "no.h5").exists())
        result = subprocess.run([COHORT, "run", str(SOURCE / "configs" / "circulation.yaml"), "--export", "vtk"],
                                cwd=self.path, capture_output=True, text=True)
        self.assertEqual(result.returncode, 1)
        self.assertIn("there is no tissue to show", result.stderr)

    def test_damaged_files_are_told(self):
        good = (self.path / "block_vtk" / "tissue.vti").read_bytes()
        bad = self.path / "bad.vti"
        bad.write_bytes(good[:-len(good) // 3])
        with self.assertRaises((ValueError, zlib.error)):
            vti.read(bad)
        bad.write_text("<VTKFile/>")
        with self.assertRaises(ValueError):
            vti.read(bad)

    def test_isochrones_are_drawn(self):
        output = self.path / "block.png"
        activation.main([str(self.path / "block_vtk"), "-o", str(output)])
        self.assertGreater(output.stat().st_size, 20000)
        steps = numpy.diff(activation.isochrones(numpy.array([3.2, numpy.nan, 41]), None))
        self.assertTrue((steps == steps[0]).all() and len(steps) <= 21)

    def test_labels_of_the_colour_bar_stay_apart(self):
        for step, at_least in ((None, 10), (0.5, 10), (0.1, 5)):
            figure = activation.draw(self.image, (5, 2.5, 2), step, "block")
            self.addCleanup(activation.plt.close, figure)
            figure.draw_without_rendering()
            labels = sorted((label.get_window_extent() for label in figure.axes[-1].get_yticklabels() if label.get_text()),
                            key=lambda box: box.y0)
            self.assertGreaterEqual(len(labels), at_least)
            for below, above in zip(labels, labels[1:]):
                self.assertLess(below.y1, above.y0)

    def test_vtk_reads_the_same(self):
        try:
            from vtkmodules.util.numpy_support import vtk_to_numpy
            from vtkmodules.vtkIOXML import vtkXMLImageDataReader
        except ImportError:
            self.skipTest("python3-vtk9 is not installed")
        reader = vtkXMLImageDataReader()
        reader.SetFileName(str(self.path / "block_vtk" / "tissue.vti"))
        reader.Update()
        image = reader.GetOutput()
        self.assertEqual(tuple(n - 1 for n in image.GetDimensions()), self.image.cells)
        numpy.testing.assert_allclose(image.GetOrigin(), self.image.origin_mm)
        data = image.GetCellData()
        for name, values in self.image.fields.items():
            numpy.testing.assert_array_equal(vtk_to_numpy(data.GetArray(name)).ravel(), values.ravel(), err_msg=name)
        self.assertTrue(image.HasAnyBlankCells())


if __name__ == "__main__":
    unittest.main()
