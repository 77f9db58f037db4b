"""The store of a campaign: the only place in Python that knows the paths inside the HDF5 file.

The row index is the member's id everywhere: N members, P parameters, L leads, T samples, F features. Values that have not
been written are NaN. Pressure and volume have C compartments (chambers and arteries), displacement D points. K members are
checked: run again at half the spacing and the step, which tells the error of each feature.
"""

import dataclasses
import enum
import os

import h5py
import numpy


class Status(enum.IntEnum):
    """What became of a member. From DONE on it has ended."""

    EMPTY = 0
    QUEUED = 1
    RUNNING = 2
    DONE = 3
    FAILED = 4
    TIMEOUT = 5
    UNSTABLE = 6
    REJECTED = 7


@dataclasses.dataclass(frozen=True)
class Kernel:
    """Times of one kernel in one process."""

    name: str
    calls: int
    device_ms: float
    bytes_per_call: float  # what the kernel has to move, not what it moved; NaN or 0 where none is declared

    @property
    def GB_per_s(self):
        return self.calls * self.bytes_per_call / (self.device_ms * 1e6) if self.device_ms > 0 else float("nan")


@dataclasses.dataclass(frozen=True)
class Performance:
    """What one process of a campaign did."""

    device: str
    triad_GB_per_s: float
    simulated_ms: float
    cell_updates: float
    wall_s: float
    kernels: list  # of Kernel, longest first


@dataclasses.dataclass(frozen=True)
class Checks:
    """The members that were run again at half the spacing and the step; a row is a check."""

    member: numpy.ndarray  # (K) whose check it is, ascending
    status: numpy.ndarray  # (K) u1, values of Status
    features: numpy.ndarray  # (K, F) f4
    columns: dict  # name: (K), as Store.column

    def column(self, name):
        return self.columns[name]


@dataclasses.dataclass(frozen=True)
class FeatureError:
    """Errors of one feature, over the members for which they were measured; left_out_rms: how far the model tells a check from
    the others, left_out_rms_constant: their mean likewise."""

    feature: str
    unit: str
    checks: int
    mean: float
    rms: float
    largest: float  # of their sizes
    left_out_rms: float
    left_out_rms_constant: float
    model: str  # none, constant or linear in the unit parameters


class Store:
    """A campaign's file, open for reading; the campaign may be running meanwhile.

    A store is a snapshot of which members have ended: `status` and `done` are those of the last `refresh`, so that
    `parameters[done]` and `ecg(done)` have the same rows however fast the campaign goes on. Poll with `refresh`:

        store = Store("demo.h5")
        while not store.finished:
            time.sleep(2)
            store.refresh()

    Raises OSError where the file is missing or is not HDF5, ValueError where it is no store.
    """

    def __init__(self, path):
        self.path = os.fspath(path)
        self._file = None
        self.refresh()
        if self._file.attrs.get("format") != "cohort":
            self.close()
            raise ValueError(f"{self.path}: not a store of Cohort")

    def refresh(self):
        """Opens the file again, since HDF5 keeps what it has read, and takes the members' states of now."""
        self.close()
        # Without a lock: a reader never has to keep the campaign from writing.
        self._file = h5py.File(self.path, "r", locking=False)
        self._status = self._file["status"][:] if "status" in self._file else numpy.empty(0, numpy.uint8)

    def close(self):
        if self._file is not None:
            self._file.close()
            self._file = None

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    # The campaign

    @property
    def campaign(self):
        """The campaign file of the run that created the store, with what --set has changed: YAML."""
        return self._file.attrs["campaign"]

    @property
    def sha256(self):
        """Of what determines the results of the campaign, hexadecimal."""
        return self._file.attrs["sha256"]

    @property
    def seed(self):
        return int(self._file.attrs["seed"])

    @property
    def program_version(self):
        return self._file.attrs["program_version"]

    @property
    def created(self):
        """UTC, ISO 8601."""
        return self._file.attrs["created"]

    @property
    def run_dependent(self):
        """What two runs of one campaign may differ in: paths of datasets, and attributes of the root after an @."""
        return list(self._file.attrs["run_dependent"])

    # Members

    @property
    def members(self):
        """N."""
        return len(self._status)

    @property
    def status(self):
        """(N) u1, values of Status."""
        return self._status

    @property
    def legend(self):
        """The names of the status values in the file, by value."""
        return list(self._file["status"].attrs["legend"])

    @property
    def done(self):
        """(N) bool: members whose results stand in their rows."""
        return self._status == Status.DONE

    @property
    def finished(self):
        """Whether all members have ended, and all checks."""
        checks = self._file["checks/status"][:] if "checks" in self._file else self._status[:0]
        return bool((self._status >= Status.DONE).all() and (checks >= Status.DONE).all())

    @property
    def columns(self):
        """Names of the columns of `column`."""
        return list(self._file["members"])

    def column(self, name):
        """(N) of one of `columns`: reason, attempts, rank, wall_s, dt_ms, crc32, ...; text as str. KeyError where there is none."""
        return _column(self._file["members"][name])

    # What was sampled

    @property
    def parameter_names(self):
        """P paths, as in the campaign file."""
        return list(self._file["parameters"].attrs["names"])

    @property
    def parameter_units(self):
        return list(self._file["parameters"].attrs["units"])

    @property
    def priors(self):
        """P descriptions of the distributions."""
        return list(self._file["parameters"].attrs["prior"])

    @property
    def scales(self):
        """P of linear or log: how a parameter is best spaced."""
        return list(self._file["parameters"].attrs["scale"])

    @property
    def bounds(self):
        """(P, 2) f8: lower and upper bounds, in the parameters' units."""
        attributes = self._file["parameters"].attrs
        return numpy.stack([attributes["lower"], attributes["upper"]], axis=1)

    @property
    def parameters(self):
        """(N, P) f8 in `parameter_units`."""
        return self._file["parameters"][:]

    @property
    def unit_parameters(self):
        """(N, P) f8: the sampler's points in [0, 1]."""
        return self._file["unit_parameters"][:]

    # Results

    @property
    def leads(self):
        """L names; none where the campaign records no ECG."""
        return list(self._file["ecg"].attrs["leads"]) if "ecg" in self._file else []

    @property
    def ecg_ms(self):
        """(T) f8: times of the samples, ms."""
        return self._file["time/ecg_ms"][:]

    def ecg(self, members=slice(None)):
        """(N, L, T) f4, mV, of all members, or of those that an index, a slice or a mask selects."""
        return self._file["ecg"][members]

    @property
    def compartments(self):
        """C names: LV, RV, LA, RA, aorta, pulmonary_artery or some of them, or cavities; none without pressure and volume."""
        return list(self._file["pv/pressure"].attrs["compartments"]) if "pv" in self._file else []

    @property
    def pv_ms(self):
        """(T) f8: times of the samples of pressure and volume, ms, from the start of what is recorded."""
        return self._file["time/pv_ms"][:]

    def pressure(self, members=slice(None)):
        """(N, C, T) f4, mmHg, of all members, or of those that an index, a slice or a mask selects."""
        return self._file["pv/pressure"][members]

    def volume(self, members=slice(None)):
        """(N, C, T) f4, mL, likewise; of an artery the stressed volume."""
        return self._file["pv/volume"][members]

    @property
    def points(self):
        """D names of the points whose displacement is recorded; none where it is not."""
        return list(self._file["displacement"].attrs["points"]) if "displacement" in self._file else []

    @property
    def displacement_ms(self):
        """(T) f8: times of the samples of displacement, ms."""
        return self._file["time/displacement_ms"][:]

    def displacement(self, members=slice(None)):
        """(N, D, 3, T) f4, mm, along x, y and z, likewise."""
        return self._file["displacement"][members]

    @property
    def feature_names(self):
        return list(self._file["features"].attrs["names"])

    @property
    def feature_units(self):
        return list(self._file["features"].attrs["units"])

    @property
    def features(self):
        """(N, F) f4 in `feature_units`; NaN where a feature is not defined."""
        return self._file["features"][:]

    def feature(self, name):
        """(N) f4 of one feature; ValueError where there is none of that name."""
        return self._file["features"][:, self.feature_names.index(name)]

    # Errors

    @property
    def checks(self):
        """Checks, or None where the campaign has none."""
        if "checks" not in self._file:
            return None
        group = self._file["checks"]
        return Checks(group["member"][:], group["status"][:], group["features"][:],
                      {name: _column(dataset) for name, dataset in group["members"].items()})

    @property
    def errors(self):
        """F FeatureError once all members and checks have ended; else none."""
        if "errors" not in self._file or self._file["errors/state"][0] != 1:
            return []
        group = self._file["errors"]
        numbers = zip(*(group[name][:] for name in ("checks", "mean", "rms", "largest", "left_out_rms", "left_out_rms_constant")))
        models = [group["model"].attrs["legend"][kind] for kind in group["model"][:]]
        return [FeatureError(feature, unit, int(checks), *map(float, rest), model)
                for feature, unit, (checks, *rest), model in zip(group.attrs["names"], group.attrs["units"], numbers, models)]

    @property
    def error_estimate(self):
        """(N, F) f4, errors of the features from spacing, step and the last beat: their size, with the sign as measured.
        Measured for members that were checked (`error_measured`), modelled over the parameters for the others; `errors` tells
        how well. NaN until all members and checks have ended, for members that are not done, and where too few were checked."""
        # A store of before checks has a number of each member there, which was never written.
        if not self.errors:
            return numpy.full(self._file["features"].shape, numpy.nan, numpy.float32)
        return self._file["members/error_estimate"][:]

    @property
    def error_measured(self):
        """(N) bool: members whose errors were measured."""
        return self._file["members/error_measured"][:] == 1 if self.errors else numpy.zeros(self.members, bool)

    # A study of stability

    @property
    def study_groups(self):
        """(N) why each member is run; None where the store is not one of a study."""
        return numpy.char.decode(self._file["study/group"][:], "utf-8") if "study/group" in self._file else None

    @property
    def study_inside(self):
        """(N) bool: whether all values of the member lie within their documented ranges."""
        return self._file["study/inside"][:].astype(bool)

    @property
    def study_outcomes(self):
        """(N) what each member came to: done, or a cause with "#" for its numbers; empty before the study has ended."""
        return numpy.char.decode(self._file["study/outcome"][:], "utf-8")

    # Speed

    @property
    def performance(self):
        """Performance of each process that has ended, in the order of their slots in the file."""
        group = self._file["performance"]
        return [_performance(group, slot) for slot, wall_s in enumerate(group["wall_s"][:]) if wall_s > 0]


def _column(dataset):
    values = dataset[:]
    return numpy.char.decode(values, "utf-8") if values.dtype.kind == "S" else values


def _performance(group, slot):
    names = numpy.char.decode(group["kernels"][slot], "utf-8")
    kernels = [
        Kernel(str(name), int(calls), float(device_ms), float(bytes_per_call))
        for name, calls, device_ms, bytes_per_call in zip(
            names, group["calls"][slot], group["device_ms"][slot], group["bytes_per_call"][slot])
        if name and calls > 0
    ]
    return Performance(
        device=group["device"][slot].decode("utf-8"),
        triad_GB_per_s=float(group["triad_GB_per_s"][slot]),
        simulated_ms=float(group["simulated_ms"][slot]),
        cell_updates=float(group["cell_updates"][slot]),
        wall_s=float(group["wall_s"][slot]),
        kernels=sorted(kernels, key=lambda kernel: -kernel.device_ms),
    )
