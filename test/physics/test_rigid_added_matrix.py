"""Added mass of a rigid body as a matrix: the motion of the spheroid it is that of, files, and what is refused."""

from __future__ import annotations

import json
from contextlib import contextmanager

import numpy as np
import pytest
from scipy.io import netcdf_file

from cable_sim_ros.io.scenes.load import SceneError, SceneWarning, load_scene, override
from cable_sim_ros.physics.fluid import Fluid
from cable_sim_ros.physics.towbody import Towbody
from cable_sim_ros.sim.rig.rig import Rig, cable_of
from cable_sim_ros.sim.tables.rigid_tables import added_of, moved

pytestmark = pytest.mark.check
BODY = {
    "model": "rigid",
    "mass": 250.0,
    "net_weight": 445.0,
    "inertia": (2.81, 188.9, 188.9),
    "centre_of_gravity": (-0.1, 0.02, -0.3),
    "centre_of_buoyancy": (-0.1, 0.0, -0.25),
    "length": 3.0,
    "diameter": 0.3,
}
POINT = np.array([0.7, -0.4, 0.2])  # from the tow point, where the matrix is given
DOFS = ["Surge", "Sway", "Heave", "Roll", "Pitch", "Yaw"]


def spheroid() -> np.ndarray:
    """Added mass of the built-in spheroid, moved from its centre to POINT."""
    return moved(added_of(Towbody(**BODY), 9.81, 1026.0), np.array(BODY["centre_of_buoyancy"]) - POINT)


def flown(**numbers) -> np.ndarray:
    """Places and attitude of a body let go on a line in a flow across it, 2 s."""
    cable = cable_of([{"length": 10.0, "elements": 2}], mass_per_length=0.1, axial_stiffness=1e6, diameter=0.01)
    water = Fluid(density=1026.0, current=(-1.0, 1.5))
    rig = Rig(cable, held={0: "r"}, bodies={-1: Towbody(**(BODY | numbers))}, tension=445.0, water=water, gravity=9.81)
    rig.straight((0.0, 0.0, -20.0), (-0.5, 0.0, -1.0))
    rig.balance()
    run = rig.run(2.0, 0.01)
    return np.hstack([run.q[:, -1, :3], run.attitude[:, 0, :4]])


def test_a_matrix_about_another_point_moves_the_body_as_its_spheroid_does():
    own = flown()
    given = flown(added_matrix=spheroid().ravel().tolist(), added_matrix_point=POINT.tolist())
    misplaced = flown(added_matrix=spheroid().ravel().tolist())
    assert abs(own[-1] - own[0]).max() > 0.2
    assert abs(given - own).max() < 1e-8
    assert abs(misplaced - own).max() > 1e-3


def capytaine(path, added, omega, names=DOFS, rho=1000.0, engine="netcdf"):
    """A result as capytaine writes it: added_mass(omega, radiating_dof, influenced_dof) and rho."""
    if engine == "h5":
        xarray = pytest.importorskip("xarray")
        pytest.importorskip("h5netcdf")
        coords = {"omega": omega, "radiating_dof": names, "influenced_dof": names, "rho": rho}
        data = xarray.Dataset({"added_mass": (("omega", "radiating_dof", "influenced_dof"), added)}, coords)
        data.to_netcdf(path, engine="h5netcdf")
        return path
    with netcdf_file(path, "w") as file:
        file.createDimension("omega", len(omega))
        file.createDimension("letters", max(map(len, names)))
        for name in ("radiating_dof", "influenced_dof"):
            file.createDimension(name, len(names))
            labels = file.createVariable(name, "c", (name, "letters"))
            labels[:] = np.array([list(one.ljust(labels.shape[1])) for one in names], "S1")
        file.createVariable("omega", "d", ("omega",))[:] = omega
        file.createVariable("rho", "d", ())[...] = rho
        file.createVariable("added_mass", "d", ("omega", "radiating_dof", "influenced_dof"))[:] = added
    return path


def with_file(name):
    return override(load_scene("side_scan_fish"), {"towbody.added_matrix": str(name)}).towbody.added_matrix


@contextmanager
def refused(*parts):
    """What is done is refused, with these parts of a text."""
    with pytest.raises(SceneError) as error:
        yield error
    for part in parts:
        assert part in str(error.value)


def test_files_give_the_matrix_that_is_in_them(tmp_path):
    """As rows, as JSON, of capytaine in both kinds of NetCDF: names in any order, by the density of the scene."""
    pytest.importorskip("xarray")
    matrix = np.round(spheroid(), 6)
    rows = tmp_path / "added.csv"
    rows.write_text("# kg, kg m, kg m^2\n" + "\n".join(", ".join(map(repr, row)) for row in matrix.tolist()) + "\n")
    (tmp_path / "plain.json").write_text(json.dumps(matrix.tolist()))
    (tmp_path / "keyed.json").write_text(json.dumps({"added_mass": matrix.tolist()}))
    for name in ("added.csv", "plain.json", "keyed.json"):
        assert np.array_equal(np.reshape(with_file(tmp_path / name), (6, 6)), matrix)
    turned = [5, 3, 1, 0, 2, 4]
    result = np.stack([0.5 * matrix, matrix])[:, turned][:, :, turned]
    names = [f"fish__{DOFS[k]}" for k in turned]
    for engine in ("netcdf", "h5"):
        path = capytaine(tmp_path / f"{engine}.nc", result, [1.0, np.inf], names, engine=engine)
        assert np.allclose(np.reshape(with_file(path), (6, 6)), 1.026 * matrix, rtol=1e-12)
    alike = capytaine(tmp_path / "deep.nc", np.stack([0.999 * matrix, matrix]), [1.0, 3.0], rho=1026.0)
    assert np.allclose(np.reshape(with_file(alike), (6, 6)), matrix, rtol=1e-12)
    text = load_scene("side_scan_fish").model_dump_json()
    assert "added_matrix" in text


def test_a_scene_finds_the_file_beside_itself_and_keeps_what_is_in_it(tmp_path):
    from cable_sim_ros.io.scenes.document import find_scene
    from cable_sim_ros.io.scenes.load import dump_scene

    text = find_scene("side_scan_fish").read_text()
    matrix = np.round(spheroid(), 6).tolist()
    (tmp_path / "fish.json").write_text(json.dumps(matrix))
    line = "  model: rigid\n"
    (tmp_path / "mine.yaml").write_text(text.replace(line, f"{line}  added_matrix: fish.json\n"))
    scene = load_scene(tmp_path / "mine.yaml")
    (tmp_path / "fish.json").unlink()
    (tmp_path / "kept.yaml").write_text(dump_scene(scene))
    assert load_scene(tmp_path / "kept.yaml") == scene
    rows = ", ".join(str(row) for row in matrix)
    (tmp_path / "rows.yaml").write_text(text.replace(line, f"{line}  added_matrix: [{rows}]\n"))
    assert load_scene(tmp_path / "rows.yaml") == scene
    with pytest.raises(SceneError, match=r"mine.yaml:\d+: towbody.added_matrix = .*fish.json, a file.*nothing was st"):
        load_scene(tmp_path / "mine.yaml")


def changed(**entries) -> list[float]:
    """The matrix with other numbers, by name and row and column from 1."""
    matrix = spheroid()
    for name, value in entries.items():
        matrix[int(name[1]) - 1, int(name[2]) - 1] = value
    return matrix.ravel().tolist()


@pytest.mark.parametrize(
    ("values", "parts"),
    [
        ({"added_matrix": [1.0] * 35}, ("35 numbers", "six rows of six")),
        ({"added_matrix": changed(a15=900.0)}, ("not symmetric", "row 1, column 5", "limit 0.05", "kg m^2")),
        ({"added_matrix": changed(a33=-50.0)}, ("eigenvalue -", "kg", "infinite frequency")),
        ({"added_matrix": changed(a33=2e9)}, ("component 14", "[-1e+09, 1e+09] kg")),
        ({"added_matrix": changed(), "added_inertia": [0.0, 1.0, 1.0]}, ("beside added_mass", "Leave one")),
        ({"added_matrix_point": [0.0, 0.0, 0.0]}, ("added_matrix_point", "do nothing", "Give both")),
        ({"model": "level", "added_matrix": changed()}, ("level", "added_matrix")),
        (
            {"added_matrix": np.diag([1.0, 1.0, 1.0, -0.004, 1.0, 1.0]).ravel().tolist(), "inertia": [1e-3, 1e-3, 1e-3]}
            | {"centre_of_gravity": [-0.1, 0.0, 0.0], "added_matrix_point": [0.0, 0.0, 0.0]},
            ("with mass and inertia", "eigenvalue -", "the other way"),
        ),
    ],
)
def test_what_is_no_added_mass_is_refused(values, parts):
    with refused(*parts):
        override(load_scene("side_scan_fish"), {f"towbody.{key}": value for key, value in values.items()})


def test_a_matrix_of_few_panels_is_made_symmetric_and_said():
    matrix = changed()
    matrix[6 * 1 + 5] *= 1.01
    with pytest.warns(
        SceneWarning, match=r"added_matrix is taken as the mean.*differ by up to 0\.\d+ .*row 2, column 6"
    ):
        body = override(load_scene("side_scan_fish"), {"towbody.added_matrix": matrix}).towbody
    added = added_of(body, 9.81, 1026.0)
    assert np.array_equal(added, added.T) and added[1, 5] == pytest.approx(1.005 * spheroid()[1, 5])


@pytest.mark.parametrize(
    ("name", "content", "parts"),
    [
        ("a.csv", "1 2 3\n" * 6, ("3 numbers in line 1", "six rows of six")),
        ("b.csv", "1,2,3,4,5,6\n" * 5, ("5 rows",)),
        ("c.csv", "1,2,3,4,5,nan\n" * 6, ("'nan' in line 1, no finite number",)),
        ("d.json", "[" * 100_000, ("no JSON",)),
        ("e.json", '{"added": []}', ("no six rows",)),
        ("f.json", "[[true, 0, 0, 0, 0, 0], 1, 2, 3, 4, 5]", ("'True' in row 1",)),
        ("g.csv", b"\xff\xfe\x00", ("neither text in UTF-8 nor NetCDF",)),
        ("h.csv", "1\n" * 600_000, ("1200000 bytes, above 1000000",)),
        ("i.nc", b"CDF\x01" + b"\xff" * 40, ("damaged NetCDF",)),
        ("j.nc", b"\x89HDF\r\n\x1a\n" + b"\x00" * 40, ("damaged NetCDF",)),
        ("k.csv", None, ("cannot be read", "No such file")),
    ],
)
def test_files_that_give_no_matrix_are_refused_in_one_line(tmp_path, name, content, parts):
    pytest.importorskip("xarray")
    if content is not None:
        (tmp_path / name).write_bytes(content if isinstance(content, bytes) else content.encode())
    with refused("towbody.added_matrix", name, "nothing was started", *parts) as error:
        with_file(tmp_path / name)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("result", "parts"),
    [
        ({"omega": [0.5, 2.0]}, ("differs by 0.5", "omega=inf", "free_surface=inf")),
        ({"omega": [1.0, np.inf], "names": [*DOFS[:5], "Flap"]}, ("Flap", "of one body")),
        ({"omega": [1.0, np.inf], "rho": 0.0}, ("density rho",)),
        ({"omega": [np.nan, np.nan]}, ("no frequency",)),
    ],
)
def test_results_of_another_kind_are_refused(tmp_path, result, parts):
    pytest.importorskip("xarray")
    path = capytaine(tmp_path / "result.nc", np.stack([0.5 * spheroid(), spheroid()]), **result)
    with refused(*parts):
        with_file(path)
