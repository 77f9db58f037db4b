#!/usr/bin/env python3
"""What the READMEs name exists: files, commands and their options, campaigns. usage: documentation.py COHORT"""
import functools
import pathlib
import re
import shlex
import subprocess
import sys
import tempfile
import unittest

SOURCE = pathlib.Path(__file__).resolve().parents[2]
COHORT = sys.argv.pop(1)
SPACING = {"slab": 1, "bidomain": 1, "niederer": 1, "reentry": 2, "restitution": 0.5, "land_inflation": 2, "land_contraction": 2, "electromechanics": 1}  # mm, where the tissue is too thin for 6 mm
FOLDERS = "solver|kernels|ensemble|configs|jobs|tests|analysis"


def coarse(config, spacing_mm=6):
    """Arguments that plan a campaign file on a coarse grid, where it has tissue."""
    text = (SOURCE / config).read_text()
    tissue = re.search(r"^ *geometry:(?! *none)", text, re.MULTILINE) or "circulation:" not in text
    return ["--device", "cpu"] + (["--set", f"grid.dx_mm={spacing_mm}"] if tissue else [])


def documents():
    """The texts of all READMEs, CHANGELOG and CONTRIBUTING."""
    return [path.read_text() for path in sorted([*SOURCE.glob("*.md"), *SOURCE.glob("*/README.md"), *SOURCE.glob("*/*/README.md")])]


def blocks(text, language):
    return re.findall(rf"^```{language}\n(.*?)^```", text, re.MULTILINE | re.DOTALL)


def commands(text):
    """Lines of shell blocks, without comments."""
    for block in blocks(text, "sh"):
        yield from filter(None, (shlex.split(line, comments=True) for line in block.splitlines()))


def cohort(*arguments):
    return subprocess.run([COHORT, *arguments], cwd=SOURCE, capture_output=True, text=True)


@functools.cache
def options(command):
    """The options of a command, from its own help."""
    result = cohort(command, "--help")
    return set(re.findall(r"--[a-z][a-z-]*", result.stdout)) if result.returncode == 0 else None


def values(config):
    """{path: the rest of its line}, what is sampled left out, of `cohort parameters`."""
    result = cohort("parameters", config)
    rows = [line.split(maxsplit=1) for line in result.stdout.splitlines()]
    return {path: " ".join(rest.split()) for path, rest in rows if not re.search(r"(uniform|normal|choice) \[", rest)}


class Documentation(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        """campaign.yaml is the first campaign of the README."""
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.campaign = pathlib.Path(folder.name) / "campaign.yaml"
        cls.campaign.write_text(blocks((SOURCE / "README.md").read_text(), "yaml")[0])

    def test_the_first_campaign_is_the_default_heart(self):
        ours, default = values(str(self.campaign)), values("configs/ecg.yaml")
        self.assertEqual(len(default) - len(ours), 4)
        self.assertEqual(ours, {path: default[path] for path in ours})

    def test_documented_ranges_are_those_that_are_studied(self):
        table = re.search(r"^## Documented ranges\n.*?(?=^## )", (SOURCE / "configs/README.md").read_text(), re.MULTILINE | re.DOTALL)[0]
        rows = re.findall(r"^\| `([\w.]+)` \| (\S+) \| (\S+) \| (\S+) \| (.+?) \|$", table, re.MULTILINE)
        study = (SOURCE / "configs/studies/heart_stability.yaml").read_text()
        section = re.search(r"^  ranges:\n((?:    \S+: \[.*\]\n)+)", study, re.MULTILINE)[1]
        studied = re.findall(r"^    ([\w.]+): \[(\S+), (\S+)\]$", section, re.MULTILINE)
        self.assertEqual([(path, low, high) for path, _, low, high, _ in rows], studied)
        self.assertGreater(len(rows), 30)
        heart = values("configs/heart.yaml")
        for path, value, _, _, unit in rows:
            self.assertTrue(heart[path].startswith(f"{unit} {value} ["), (path, heart[path]))

    def check_cohort(self, words):
        words = [str(self.campaign) if word == "campaign.yaml" else word for word in words]
        command, arguments = words[0], words[1:]
        self.assertIsNotNone(options(command), f"cohort {command} does not exist")
        unknown = {word for word in arguments if word.startswith("--")} - options(command)
        self.assertFalse(unknown, f"cohort {command} has no {unknown}")
        configs = [word for word in arguments if word.endswith(".yaml")]
        if command in ("run", "plan"):
            self.assertEqual(len(configs), 1)
            overrides = [part for i, word in enumerate(arguments) if word == "--set" for part in (word, arguments[i + 1])]
            result = cohort("plan", "--quick", *configs, *overrides, *coarse(configs[0]))
            self.assertEqual(result.returncode, 0, result.stderr)
        if command == "parameters":
            self.assertEqual(cohort(command, *arguments).returncode, 0)

    def test_there_is_a_readme_in_each_folder(self):
        for folder in FOLDERS.split("|"):
            self.assertTrue((SOURCE / folder / "README.md").exists(), folder)

    def test_paths_exist(self):
        found = 0
        for text in documents():
            for path in re.findall(rf"(?<![\w/.<-])((?:{FOLDERS})/[\w./]*)", text):
                path = path.rstrip(".")
                self.assertTrue((SOURCE / path).exists(), path)
                found += 1
        self.assertGreater(found, 20)

    def test_commands_exist(self):
        found = 0
        for text in documents():
            for words in commands(text):
                for i, word in enumerate(words):
                    if word == "cohort" or word.endswith("/cohort"):
                        self.check_cohort(words[i + 1:])
                        found += 1
                    elif word.endswith(".slurm"):
                        self.check_cohort(["run", *words[i + 1:]])
                    elif word == "-m":
                        result = subprocess.run([sys.executable, "-m", words[i + 1], "--help"], cwd=SOURCE, capture_output=True,
                                                text=True)
                        self.assertEqual(result.returncode, 0, words)
                        for option in (word for word in words[i + 2:] if word.startswith("-")):
                            self.assertIn(option, result.stdout)
            for command in re.findall(r"`cohort ([a-z]+)", text):
                self.assertIsNotNone(options(command), f"cohort {command} does not exist")
        self.assertGreater(found, 8)

    def test_campaigns_can_be_planned(self):
        found = 0
        for text in documents():
            for block in blocks(text, "yaml"):
                if block.startswith("kind: "):
                    self.check_study(block)
                    continue
                with tempfile.NamedTemporaryFile("w", suffix=".yaml") as file:
                    file.write(block)
                    file.flush()
                    result = cohort("plan", "--quick", file.name, *coarse(file.name))
                self.assertEqual(result.returncode, 0, result.stderr)
                found += 1
        self.assertGreater(found, 0)

    def check_study(self, block):
        """A mistake of the command line is the only one."""
        with tempfile.NamedTemporaryFile("w", suffix=".yaml", dir=SOURCE / "configs/studies") as file:
            file.write(block)
            file.flush()
            result = cohort("study", file.name, "--set", "stability.seed=-1")
        self.assertRegex(result.stderr, r"\A--set:1: stability.seed [^\n]*\n\Z")
        self.assertEqual(result.returncode, 1)

    def test_every_configuration_is_described(self):
        readme = (SOURCE / "configs/README.md").read_text()
        for config in (SOURCE / "configs").glob("*.yaml"):
            self.assertIn(f"configs/{config.name}", readme)

    def test_every_configuration_can_be_planned(self):
        for config in (SOURCE / "configs").glob("*.yaml"):
            with self.subTest(config.name):
                result = cohort("plan", "--quick", str(config), *coarse(config, SPACING.get(config.stem, 6)))
                self.assertEqual(result.returncode, 0, result.stderr)


if __name__ == "__main__":
    unittest.main()
