"""Commands, settings and files of earlier versions are answered with their replacement."""

from __future__ import annotations

import tomllib

import pytest
import runs
import tomli_w

from shadowpuppet.errors import CalibrationError, SettingsError
from shadowpuppet.io.calibration.calibration_files import read_calibration
from shadowpuppet.pipeline.options import make_options, read_options
from shadowpuppet.removed import COMMANDS, SETTINGS, of_earlier_run


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize("more", [(), ("--help",), ("--quick", "--json", "b.json")])
def test_a_removed_command_names_its_replacement(shell, command, more):
    code, out, err = shell(command, *more)
    assert (code, out) == (2, "")
    assert err == f"error: {COMMANDS[command]}\n"


def test_bench_is_in_the_source_repository(shell):
    assert shell("bench")[2] == "error: bench has moved: python -m benchmarks.bench in the source repository\n"


@pytest.mark.parametrize("flags", [("--silhouette.maintain",), ("--silhouette.method", "knn"), ("--silhouette.method=knn",)])
def test_a_removed_flag_or_value_names_its_replacement(shell, flags):
    code, out, err = shell("track", "here", *flags)
    assert (code, out) == (2, "")
    sentence = SETTINGS.get(flags[0][2:]) or SETTINGS["silhouette.method = knn"]
    assert err == f"error: {flags[0].partition('=')[0]}: {sentence}\n"


@pytest.mark.parametrize(("command", "flag"), [("synthesize", ("--like", "humaneva_walking")), ("evaluate", ("--joints", "humaneva"))])
def test_what_served_humaneva_alone_names_its_replacement(shell, command, flag):
    code, out, err = shell(command, "here", *flag)
    assert (code, out) == (2, "")
    assert err == f"error: {flag[0]}: {SETTINGS[f'{flag[0][2:]} = {flag[1]}']}\n"


@pytest.mark.parametrize(("table", "name"), [({"maintain": True}, "maintain"), ({"method": "knn"}, "method")])
def test_a_removed_setting_in_a_file_names_its_replacement(table, name):
    with pytest.raises(SettingsError, match=rf"^old\.toml: silhouette\.{name}: .*(shadowpuppet masks|mog2)"):
        make_options({"silhouette": table}, "old.toml")


def test_a_removed_setting_that_changed_nothing_is_left_out(tmp_path):
    """Every run.toml of an earlier version holds it, and is a file of settings."""
    (tmp_path / "run.toml").write_text("versions = {}\n[settings]\nseed = 3\n[settings.silhouette]\nmaintain = false\nfactor = 3.0\n")
    read = make_options(read_options(tmp_path / "run.toml"), "run.toml")
    assert (read.seed, read.silhouette.factor) == (3, 3.0)


def test_a_weight_in_its_former_unit_is_left_out_as_its_default_was():
    assert make_options({"multiview": {"keypoints": 0.25}}).multiview.keypoints == make_options({}).multiview.keypoints
    assert make_options({"multiview": {"keypoints": 2e-4}}).multiview.keypoints == 2e-4


def test_what_is_not_removed_is_kept():
    values = {"seed": 3, "silhouette": {"method": "mog2", "factor": 3.0}, "tracker": {"arm": {"particles": 300}}}
    assert of_earlier_run(values) == values
    assert of_earlier_run({"silhouette": {"method": "knn", "maintain": True}}) == {"silhouette": {}}


@pytest.mark.parametrize("table", [{"maintain": False}, {"maintain": True, "method": "knn"}])
def test_a_run_of_an_earlier_version_is_shown_measured_and_exported(shell, recording, tmp_path, table):
    folder = runs.make_run(tmp_path / "run", "rounded", frames=8)
    info = tomllib.loads((folder / "run.toml").read_text("utf-8"))
    info |= {"recording": str(recording), "settings": {"seed": 3, "silhouette": table}}
    (folder / "run.toml").write_text(tomli_w.dumps(info), encoding="utf-8")
    truth = folder / "joints.csv"
    for tokens in (("view", folder, "--html", tmp_path / "page.html"), ("evaluate", folder, truth, "--report", tmp_path / "report.html"),
                   ("export", folder, "--to", "bvh")):
        code, _, err = shell(*tokens)
        assert code == 0, err


@pytest.mark.parametrize("name", ["C1.cal", "Calib_Results.m", "Calib_Results.mat", "lab/C1.cal"])
def test_a_calibration_of_bouguets_toolbox_names_its_replacement(tmp_path, name):
    path = tmp_path / name
    path.parent.mkdir(exist_ok=True)
    path.write_text("1 2 3")
    path = path.parent if name.startswith("lab") else path
    with pytest.raises(CalibrationError, match=r"Bouguet's toolbox, which is not read any more.* papers\.humaneva"):
        read_calibration(path)
