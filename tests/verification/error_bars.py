#!/usr/bin/env python3
"""The errors that a campaign tells of itself, against the errors that its members have. usage: error_bars.py COHORT

A share of the members is checked. What the model tells of the others is compared with their own fine runs; were the errors of
a feature normal and the same for all, a constant learned from n checks would miss them as Student's t with n - 1 degrees of
freedom says.
"""
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest
import zlib

import h5py
import numpy
from scipy.stats import t as student

SOURCE = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(SOURCE))
from analysis.store import Status, Store  # noqa: E402

COHORT = sys.argv.pop(1)
HEARTS = ["grid.dx_mm=6", "campaign.members=30"]
PERIODIC = ["time.beats.until_periodic=1e-6", "time.beats.at_most=200"]
OF_THE_RULE = ["beats", "beat_difference"]  # tell when beats ended, and have no error


def command(config, store, *overrides):
    line = [COHORT, "run", str(SOURCE / "configs" / config), "--device", "cpu", "--store", str(store)]
    for override in overrides:
        line += ["--set", override]
    return line


def run(config, store, *overrides):
    """The output; raises where a member is not done."""
    return subprocess.run(command(config, store, *overrides), check=True, capture_output=True, text=True).stdout


def expected_within(multiple, checks):
    """Share of members that a constant misses by at most `multiple` of its rms where each check is told from the others."""
    left_out = numpy.sqrt(checks / (checks - 1))  # in units of the sample's standard deviation
    return 1 - 2 * student.sf(multiple * left_out / numpy.sqrt(1 + 1 / checks), checks - 1)


class Folder(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp())
        cls.addClassCleanup(shutil.rmtree, cls.folder)


class OfUncheckedMembers(Folder):
    def missed(self, told, true):
        """(members, features) what the model misses, in units of its left-out rms; of features that have an error."""
        others = ~told.error_measured
        scale = numpy.array([summary.left_out_rms for summary in told.errors])
        with numpy.errstate(divide="ignore", invalid="ignore"):
            missed = (true[others] - told.error_estimate[others]) / scale
        return missed[:, (scale > 0) & numpy.isfinite(missed).any(axis=0)]

    def holds(self, campaigns, checks, members):
        """campaigns: what `missed` gave of each, with so many checks of so many members"""
        finite = numpy.concatenate([missed[numpy.isfinite(missed)] for missed in campaigns])
        rms = numpy.concatenate([numpy.sqrt(numpy.nanmean(missed**2, axis=0)) for missed in campaigns])
        print(f"{checks} checks of {members}: the median feature is missed by {numpy.median(rms):.2f} of its left-out rms;")
        for multiple in (2, 3):
            share = numpy.mean(numpy.abs(finite) <= multiple)
            print(f"  {100 * share:.1f} % within {multiple}, {100 * expected_within(multiple, checks):.1f} by Student's t")
            self.assertGreater(share, expected_within(multiple, checks) - 0.05)
        self.assertTrue(0.5 < numpy.median(rms) < 2)

    def test_hearts(self):
        told_path, all_path = self.folder / "hearts.h5", self.folder / "all.h5"
        run("ecg_campaign.yaml", told_path, *HEARTS, "campaign.check_fraction=0.1")
        run("ecg_campaign.yaml", all_path, *HEARTS, "campaign.check_fraction=1")
        with Store(told_path) as told, Store(all_path) as everything:
            self.assertTrue(everything.error_measured.all())
            numpy.testing.assert_array_equal(told.features, everything.features)
            # A check is the same whoever else is checked.
            same = told.error_measured
            numpy.testing.assert_array_equal(told.error_estimate[same], everything.error_estimate[same])
            self.assertEqual(same.sum(), 3)
            self.holds([self.missed(told, everything.error_estimate)], 3, told.members)

    def test_circulations_against_a_quarter_of_the_step_until_periodic(self):
        # Features of one circulation err together, by its step and its last beat: several campaigns for a share of members.
        missed, ratio = [], []
        for seed in range(4, 8):
            told_path, fine_path = self.folder / f"told{seed}.h5", self.folder / f"fine{seed}.h5"
            of_seed = f"campaign.seed={seed}"
            run("circulation.yaml", told_path, "campaign.check_fraction=0.1", "circulation.dt_ms=1", of_seed)
            run("circulation.yaml", fine_path, "campaign.check_fraction=0", "circulation.dt_ms=0.25", of_seed, *PERIODIC)
            with Store(told_path) as told, Store(fine_path) as fine:
                true = told.features - fine.features
                measured = told.error_measured
                self.assertEqual(measured.sum(), 6)
                missed.append(self.missed(told, true))
                with numpy.errstate(invalid="ignore"):
                    ratio += [numpy.linalg.norm(told.error_estimate[measured, i]) / numpy.linalg.norm(true[measured, i])
                              for i, name in enumerate(told.feature_names) if numpy.any(true[measured, i]) and name not in OF_THE_RULE]
        self.holds(missed, 6, 64)
        # What is measured is an error, not only a difference: the order that it assumes is that of the method.
        print(f"estimated errors of checked members over true ones: median {numpy.median(ratio):.2f}")
        self.assertTrue(0.8 < numpy.median(ratio) < 1.25)

    def test_beats_that_ended_early(self):
        told_path, periodic_path = self.folder / "early.h5", self.folder / "periodic.h5"
        run("circulation.yaml", told_path, "campaign.members=16", "campaign.check_fraction=1", "time.beats.until_periodic=0.01")
        run("circulation.yaml", periodic_path, "campaign.members=16", "campaign.check_fraction=0", *PERIODIC)
        with Store(told_path) as told, Store(periodic_path) as periodic:
            for name in ("lv_edv_mL", "lv_ef_percent", "aorta_systolic_mmHg"):
                i = told.feature_names.index(name)
                true = numpy.sqrt(numpy.mean((told.features - periodic.features)[:, i] ** 2))
                estimated = numpy.sqrt(numpy.mean(told.error_estimate[:, i] ** 2))
                print(f"{name}: rms {true:.3g}, estimated {estimated:.3g}")
                self.assertTrue(true / 3 < estimated < 3 * true)
            # When beats end is a rule of each run.
            self.assertTrue(numpy.isnan(told.error_estimate[:, told.feature_names.index("beats")]).all())

    def test_a_finer_grid_is_of_the_same_model(self):
        # Of this slab automatic takes reaction_eikonal, and at half the spacing would take monodomain.
        campaign = ["grid.dx_mm=0.4", "time.end_ms=80", "campaign.check_fraction=1"]
        for activation in ("automatic", "reaction_eikonal"):
            run("slab.yaml", self.folder / f"{activation}.h5", *campaign, f"electrophysiology.activation={activation}")
        with Store(self.folder / "automatic.h5") as automatic, Store(self.folder / "reaction_eikonal.h5") as given:
            numpy.testing.assert_array_equal(automatic.features, given.features)
            numpy.testing.assert_array_equal(automatic.error_estimate, given.error_estimate)
            self.assertTrue(automatic.error_measured.all())


class OfOneCampaign(Folder):
    def test_a_check_that_does_not_fit_leaves_the_campaign_complete(self):
        store = self.folder / "small.h5"
        overrides = ["grid.dx_mm=6", "campaign.members=4", "campaign.check_fraction=0.3"]  # of which three are checked, the least
        plans = [subprocess.run([COHORT, "plan", str(SOURCE / "configs/ecg_campaign.yaml"), "--device", "cpu", "--set", f"grid.dx_mm={dx}"],
                                check=True, capture_output=True, text=True).stdout for dx in (6, 3)]
        megabytes = [float(line.split()[1]) for plan in plans for line in plan.splitlines() if line.startswith("memory  ")]
        self.assertLess(megabytes[0], megabytes[1] - 4)
        limit = f"campaign.memory_limit_GB={(megabytes[0] + megabytes[1]) / 2000}"
        run("ecg_campaign.yaml", store, *overrides, limit)
        with Store(store) as refused:
            self.assertTrue(refused.done.all() and refused.finished)
            self.assertEqual(list(refused.checks.status), [Status.FAILED] * 3)
            for reason in refused.checks.column("reason"):
                self.assertRegex(reason, "^at half the spacing and the step: too little device memory: .* bytes")
            self.assertTrue(numpy.isnan(refused.error_estimate).all())
        # With room, and retries for what has failed, the same store gets its errors.
        run("ecg_campaign.yaml", store, *overrides, "campaign.retries=3")
        with Store(store) as resumed:
            self.assertEqual(list(resumed.checks.status), [Status.DONE] * 3)
            self.assertTrue(numpy.isfinite(resumed.error_estimate[:, resumed.feature_names.index("ecg_QRS_ms")]).all())

    def test_the_report_and_the_status_tell_the_errors(self):
        store = self.folder / "told.h5"
        output = run("circulation.yaml", store, "campaign.members=20", "campaign.check_fraction=0.2")
        status = subprocess.run([COHORT, "status", str(store)], check=True, capture_output=True, text=True).stdout
        for text in (output, status):
            self.assertRegex(text, r"error of +unit +checks +mean +rms +largest +left out +model")
            self.assertRegex(text, r"lv_edv_mL +mL +4 ")
        self.assertIn("4 checks at half the spacing and the step", status)


class OfVersion1(Folder):
    """A store of before checks: /members/error_estimate is a number of each member, never written and in its checksum."""

    CHECKSUMMED = ["members/seed", "parameters", "unit_parameters", "pv/pressure", "pv/volume", "features", "members/reason",
                   "members/failed_at_ms", "members/dt_ms", "members/dx_mm", "members/error_estimate", "status"]
    CAMPAIGN = ["campaign.members=4", "campaign.check_fraction=0", "outputs.pv.rate_hz=100"]

    def setUp(self):
        self.store = self.folder / f"{self.id()}.h5"
        run("circulation.yaml", self.store, *self.CAMPAIGN)
        with h5py.File(self.store, "r+") as file:
            properties = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
            properties.set_alloc_time(h5py.h5d.ALLOC_TIME_EARLY)
            properties.set_fill_value(numpy.array(numpy.nan))
            h5py.h5d.create(file["members"].id, b"error_estimate", h5py.h5t.IEEE_F64LE, h5py.h5s.create_simple((4,)), properties)
            file.attrs["version"] = 1
            del file["members/step_factor"]
            for row in range(4):
                contents = b"".join(numpy.ascontiguousarray(file[name][row]).tobytes().ljust(file[name].dtype.itemsize, b"\0")
                                    for name in self.CHECKSUMMED)
                file["members/crc32"][row] = zlib.crc32(contents)

    def test_is_verified_and_read(self):
        self.assertEqual(subprocess.run([COHORT, "verify", str(self.store)], capture_output=True).returncode, 0)
        with Store(self.store) as old:
            self.assertTrue(old.finished)
            self.assertIsNone(old.checks)
            self.assertTrue(numpy.isnan(old.error_estimate).all())
        with h5py.File(self.store, "r+") as file:
            file["features"][2, 0] += 1
        self.assertEqual(subprocess.run([COHORT, "verify", str(self.store)], capture_output=True).returncode, 3)

    def test_is_not_finished_by_this_version(self):
        refused = subprocess.run(command("circulation.yaml", self.store, *self.CAMPAIGN, "campaign.seed=5"), capture_output=True, text=True)
        self.assertEqual(refused.returncode, 1)
        self.assertIn("finish it with the version of cohort that began it", refused.stderr)


if __name__ == "__main__":
    unittest.main()
