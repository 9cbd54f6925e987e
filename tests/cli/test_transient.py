"""The command etc-engine transient: a study file in, a netCDF file out, one-line refusals."""

import pytest
import xarray
from click.testing import CliRunner

from etc_engine.cli.transient import transient_command
from etc_engine.engines.meshless import Dirichlet, HeatProblem, solve_transient
from etc_engine.errors import EtcError, OutputError, StudyError

STUDY = """
schema = 2
kind = "meshless"
name = "cooled square"

[body]
vertices = [[0, 0], [3, 0], [3, 3], [0, 3]]
conductivity = 1.25
heat_capacity = 1.0
initial = 30.0

[[boundary]]
type = "fixed"
value = 0.0
[[boundary]]
type = "fixed"
value = 0.0
[[boundary]]
type = "fixed"
value = 0.0
[[boundary]]
type = "fixed"
value = 0.0

[output]
times = [0.6, 1.2]
points = [[1.5, 1.5], [2.4, 2.4]]

[solver]
steps = 24
boundary_nodes = 60
interior_nodes = 120
"""
CONTACTS = """
schema = 2
kind = "meshless"
name = "ramp through a contact"
[body]
disk = {radius = 1.0}
conductivity = 1.0
heat_capacity = 1.0
initial = 0.0
[[contact]]
angle = 90
half_angle = 30
heat = {times = [0.0, 1.0], values = [0.0, 1.0]}
[output]
times = [1.0]
grid = 6
[solver]
steps = 50
"""


def run(tmp_path, text, *options):
    study, output = tmp_path / "study.toml", tmp_path / "out.nc"
    study.write_text(text)
    command = [str(study), "-o", str(output), *options]
    return CliRunner().invoke(transient_command, command, standalone_mode=False), output


def test_a_polygon_study_is_solved(tmp_path):
    result, output = run(tmp_path, STUDY)
    assert result.exception is None
    problem = HeatProblem(
        vertices=[(0, 0), (3, 0), (3, 3), (0, 3)],
        conductivity=1.25,
        heat_capacity=1.0,
        initial=30.0,
        boundary=[Dirichlet(0.0)] * 4,
    )
    points = [(1.5, 1.5), (2.4, 2.4)]
    with xarray.open_dataset(output) as found:
        assert found.temperature.dims == ("time", "point")
        assert found.attrs["study_file"] == STUDY
        reference = solve_transient(problem, [0.6, 1.2], points, scheme="laplace").temperature.values
        assert abs(found.temperature.values / reference - 1.0).max() < 0.02
    assert [path.name for path in tmp_path.iterdir() if path.suffix == ".tmp"] == []


def test_a_contact_study_follows_its_table(tmp_path):
    result, output = run(tmp_path, CONTACTS)
    assert result.exception is None
    with xarray.open_dataset(output) as found:
        # heat t over [0, 1]: mean rise 1/(2 pi)
        assert float(found.mean_temperature[0]) == pytest.approx(0.5 / 3.141592653589793, rel=5e-3)
        assert found.arc_temperature.shape == (1, 1)


def test_an_existing_output_is_kept_without_overwrite(tmp_path):
    (tmp_path / "out.nc").write_text("precious")
    result, output = run(tmp_path, STUDY)
    assert isinstance(result.exception, OutputError) and output.read_text() == "precious"
    result, output = run(tmp_path, STUDY, "--overwrite")
    assert result.exception is None and output.read_bytes() != b"precious"


@pytest.mark.parametrize(
    "old, new, message",
    [
        ("schema = 2", "schema = 3", "schema: found 3, allowed: 2"),
        ("schema = 2", "schema = true", "schema: found true, allowed: 2"),
        ('kind = "meshless"', 'kind = "magic"', "kind: found 'magic', allowed: meshless, network"),
        ("steps = 24", "steps = 0", "solver.steps"),
        ("steps = 24", "stepps = 24", "solver.stepps"),
        ("conductivity = 1.25", "conductivity = -1.0", "body.conductivity"),
        ("initial = 30.0", "initial = [", "is not valid TOML"),
        ("heat_capacity = 1.0", "heat_capacity = 1e300", "body.heat_capacity: found 1e+300, allowed: a positive"),
        ("heat_capacity = 1.0", "heat_capcity = 1.0", "body.heat_capcity: unknown key, did you mean 'heat_capacity'?"),
        ("times = [0.6, 1.2]", "times = [1e-320]", "times: the first must be 0 or at least 1e-100 s"),
        ("times = [0.6, 1.2]", "times = [0.6, '1']", "output.times[1]: found '1', allowed: a list of times"),
        ("steps = 24", "steps = 1_000_000_000_000", "solver.steps: found 1000000000000, allowed"),
        (
            "value = 0.0",
            "value = {times = [0.0, 1.0]}",
            "boundary[0].value.values: missing, expected a list",
        ),
        ('type = "fixed"\nvalue = 0.0', 'type = "convective"\nvalue = 0.0', "coefficient"),
        ("points = [[1.5, 1.5], [2.4, 2.4]]", "points = []", "points or a grid"),
        ("points = [[1.5, 1.5], [2.4, 2.4]]", "points = [[5, 5]]", "outside the body"),
        ("[3, 3], [0, 3]]", "[0, 3], [3, 3]]", "cross"),
    ],
)
def test_refused_studies(tmp_path, old, new, message):
    assert old in STUDY
    result, output = run(tmp_path, STUDY.replace(old, new, 1))
    assert isinstance(result.exception, EtcError)
    assert message in str(result.exception) and "\n" not in str(result.exception)
    assert not output.exists()


def test_a_missing_study_and_a_missing_folder(tmp_path):
    command = [str(tmp_path / "none.toml"), "-o", str(tmp_path / "out.nc")]
    result = CliRunner().invoke(transient_command, command, standalone_mode=False)
    assert isinstance(result.exception, StudyError)
    (tmp_path / "study.toml").write_text(STUDY)
    command = [str(tmp_path / "study.toml"), "-o", str(tmp_path / "none" / "out.nc")]
    result = CliRunner().invoke(transient_command, command, standalone_mode=False)
    assert isinstance(result.exception, OutputError)


def test_the_study_itself_is_no_output(tmp_path):
    study = tmp_path / "study.toml"
    study.write_text(STUDY)
    result = CliRunner().invoke(transient_command, [str(study), "-o", str(study), "--overwrite"], standalone_mode=False)
    assert isinstance(result.exception, OutputError) and "the input itself" in str(result.exception)
    assert study.read_text() == STUDY


@pytest.mark.filterwarnings("ignore::etc_engine.engines.meshless.DiscretizationWarning")
@pytest.mark.parametrize(
    "changes",
    [
        {"heat_capacity = 1.0": "heat_capacity = 1e100"},
        {"heat_capacity = 1.0": "heat_capacity = 1e-100", "conductivity = 1.25": "conductivity = 1e100"},
        {"initial = 30.0": "initial = 1e100", "conductivity = 1.25": "conductivity = 1e-100"},
    ],
)
@pytest.mark.parametrize("scheme", ["sdirk2", "laplace"])
def test_extreme_values_are_solved_or_refused(tmp_path, changes, scheme):
    """Warnings are errors here, and so is what a library raises."""
    text = STUDY.replace("steps = 24", f'steps = 24\nscheme = "{scheme}"')
    for old, new in changes.items():
        text = text.replace(old, new)
    result, output = run(tmp_path, text)
    assert result.exception is None or isinstance(result.exception, EtcError)
    assert output.exists() == (result.exception is None)
