"""Every mistake in a scene is reported once: file, line, key, value, unit, bound, consequence, remedy."""

import re
from pathlib import Path

import pytest
import yaml
from hypothesis import example, given, settings
from hypothesis import strategies as st

from cable_sim_ros.io.scenes import document, yaml12
from cable_sim_ros.io.scenes.load import (
    SceneError,
    SceneWarning,
    dump_scene,
    load_scene,
    override,
    scene_from_dict,
    scene_from_text,
)

pytestmark = pytest.mark.check

SCENE = """\
name: short_tow
ship: {tow_speed: 2.0}
water: {density: 1026.0, viscosity: 1e-3}
cable:
  diameter: 0.010
  mass_per_length: 0.389
  axial_stiffness: 6.786e+6
  sections:
    drum: {length: 6.0, elements: 96}
    sheave: {length: 8.0, elements: 128}
    free: {length: 100, elements: 10, drag_law: ribbon}
winch: {drum: contact, position: [-28.8, 0.0, 3.1], drum_radius: 0.3, wrap: 6.0}
sheave: {position: [-36.8, 0.0, 3.7], radius: 0.25}
towbody: {mass: 250.0, net_weight: 445.0}
"""


COMPENSATED = SCENE + "setpoint: {algorithm: simplified_sheave}\n"


def changed(changes, text=SCENE):
    """A scene with changes: `old -> new`, & between them."""
    for one in changes.split(" & "):
        old, _, new = one.partition(" ->")
        assert old in text
        text = text.replace(old, new.strip().replace(r"\n", "\n"))
    return text


def rows(table):
    """Changes and what they lead to, of a text with a line for each in turn."""
    lines = table.strip().splitlines()
    return list(zip(lines[::2], map(str.strip, lines[1::2]), strict=True))


def problems(changes, count=1):
    with pytest.raises(SceneError) as caught:
        scene_from_text(changed(changes), "tow.yaml")
    assert len(caught.value.problems) == count, caught.value.problems
    assert str(caught.value) == "\n".join(caught.value.problems)
    return caught.value.problems if count > 1 else caught.value.problems[0]


@pytest.mark.filterwarnings("error")
def test_the_sample_loads_without_a_warning():
    scene = scene_from_text(SCENE, "tow.yaml")
    assert scene.cable.sections["free"].length == 100.0
    assert list(scene.cable.sections) == ["drum", "sheave", "free"]


# the text of a problem without its file and consequence; …: what is left out here
TEXTS = r"""
density: 1026.0 -> density: 12.0
  :3: water.density = 12.0 kg/m^3 is outside [900, 1100] kg/m^3 (density of the water). Give a value in [900, 1100] …
elements: 10, -> elements: 0,
  :11: cable.sections.free.elements = 0 is outside [1, 4000] (number of equal elements … Give a value in [1, 4000]
[-28.8, 0.0, 3.1] -> [-28.8, 0.0, 3100]
  :12: winch.position = [-28.8, 0.0, 3100] m, component 2, is outside [-200, 200] m … Give a value in [-200, 200] m
tow_speed: 2.0 -> tow_sped: 2.0
  :2: ship.tow_sped = 2.0: there is no such key. Did you mean ship.tow_speed?
tow_speed: 2.0 -> tow_speed: 2.0, lift_area: 1.0
  :2: ship.lift_area = 1.0: there is no such key. Did you mean towbody.lift_area?
tow_speed: 2.0 -> qqqqq: 2.0
  :2: ship.qqqqq = 2.0: there is no such key. Known here: tow_speed, heading_deg, reference_height, start_blend, …
drag_law: ribbon -> drag_lay: ribbon
  :11: cable.sections.free.drag_lay = 'ribbon': there is no such key. Did you mean cable.sections.free.drag_law?
density: 1026.0 -> density: '1026'
  :3: water.density = '1026' is text, expected a number in [900, 1100] kg/m^3 … A number is written without quotes. …
6.786e+6 -> 6.786 MN
  :7: cable.axial_stiffness = '6.786 MN' is text, expected a number in [1, 1e+11] N (EA). A number … without its unit. …
radius: 0.25 -> radius: '0,25'
  :13: sheave.radius = '0,25' is text, expected a number in [0.005, 10] m … The decimal sign is a point. …
6.786e+6 -> 6_786_000
  :7: cable.axial_stiffness = '6_786_000' is text, expected a number in … YAML numbers have no _. Write for example …
tow_speed: 2.0 -> tow_speed: true
  :2: ship.tow_speed = true is true or false, expected a number in [-15, 15] m/s (mean speed … example `tow_speed: 0.0`
elements: 10, -> elements: 2.5,
  :11: cable.sections.free.elements = 2.5 is a number, expected a whole number or null in [1, 4000] … `elements: 60`
radius: 0.25 -> radius: null
  :13: sheave.radius = null is empty, expected a number in [0.005, 10] m … Write for example `radius: 0.2`
[-28.8, 0.0, 3.1] -> [-28.8, 3.1]
  :12: winch.position = [-28.8, 3.1] is a list of 2, expected 3 numbers in [-200, 200] m … `position: [1.0, 1.0, 1.0]`
[-28.8, 0.0, 3.1] -> [-28.8, 0.0, 3.1, 1]
  :12: winch.position = [-28.8, 0.0, 3.1, 1] is a list of 4, expected 3 numbers in … `position: [1.0, 1.0, 1.0]`
[-28.8, 0.0, 3.1] -> 3
  :12: winch.position = 3 is a number, expected 3 numbers in [-200, 200] m (drum centre … `position: [1.0, 1.0, 1.0]`
radius: 0.25 -> radius: {m: 1}
  :13: sheave.radius = {'m': 1} is a block of keys, expected a number in [0.005, 10] m … Write for example `radius: 0.2`
ship: {tow_speed: 2.0} -> ship: 2.0
  :2: ship = 2.0 is a number, expected a block of keys (ship). Write for example `ship: {tow_speed: 0.0, ...}`
free: {length: 100, elements: 10, drag_law: ribbon} -> free: 100
  :11: cable.sections.free = 100 is a number, expected a block of keys. Write for example `free: {length: 10.0}`
name: short_tow -> name: 12
  :1: name = 12 is a number, expected text (name of the scene). Write for example `name: my_tow`
mass_per_length: 0.389 -> mass_per_length: .nan
  :6: cable.mass_per_length = nan kg/m is not finite (dry mass per length). Give a number in [1e-05, 1000] kg/m, for …
[-28.8, 0.0, 3.1] -> [-28.8, -.inf, 3.1]
  :12: winch.position = [-28.8, -inf, 3.1] m is not finite (drum … Give 3 numbers in [-200, 200] m, for example `pos…
drag_law: ribbon -> drag_law: ribbons
  :11: cable.sections.free.drag_law = 'ribbons' is none of its values … Did you mean ribbon? Known: off, driscoll_n…
, net_weight: 445.0 ->
  :14: towbody.net_weight is missing (weight less buoyancy in water). Give a number … N, for example `net_weight: 1.0`
towbody: {mass: 250.0, net_weight: 445.0} ->
  : towbody is missing (towbody). Give a block of keys, for example `towbody: {mass: 1.0, ...}`
water: {density: 1026.0 -> water: {density: 1000.0, density: 1026.0
  :3: water.density is given twice, first on line 3. Correct the YAML
ship: {tow_speed: 2.0} -> ship: {[1, 2]: 2.0}
  :2: ship has a key that is not a plain word. Correct the YAML
ship: {tow_speed: 2.0} -> ship: &a {tow_speed: *a}
  :2: ship.tow_speed contains itself through an alias. Correct the YAML
ship: {tow_speed: 2.0} -> ship: {tow_speed: 2.0
  :3: expected ',' or '}', but got ':'. Correct the YAML
ship: {tow_speed: 2.0} -> ---\nship: {tow_speed: 2.0}
  :2: but found another document. Correct the YAML
drum: {l -> # {l & sheave: {l -> # {l & free: {l -> # {l & sections: -> sections: {}
  :8: cable.sections has no section… from the drum end outward…
free: { -> Free Part: {
  :11: cable.sections.Free Part … is not a … Use lower-case…
wrap: 6.0 -> wrap: 600.0
  :8: cable.sections … add up to 114 m, but 191 m are needed … Make the cable longer than 191 m…
mass_per_length: 0.389 -> mass_per_length: 389
  :6: cable.mass_per_length … 4.953e+06 kg/m^3, outside 10 to 23000 kg/m^3… Is it in kg/km…
mass: 250.0 -> mass: 25.0
  :14: towbody.net_weight = 445 N is more than the dry weight 245.25 N… Check the units of both…
"""


@pytest.mark.parametrize("changes, text", rows(TEXTS))
def test_text_of_a_mistake(changes, text):
    found = problems(changes)
    pattern = ".*".join(re.escape(part.strip()) for part in text.split("…"))
    assert re.fullmatch(f"tow.yaml{pattern}", found.replace("; nothing was started. ", ". ")), found
    assert found.count("; nothing was started. ") == 1


# of one value against others: line, key, bound: the way out
LIMITS = """
position: [-28.8, 0.0, 3.1], drum_radius: 0.3, wrap: 6.0 -> position: [-36.7, 0.0, 0.1], drum_radius: 0.3, wrap: 1.0
  12 winch.wrap 1.529: half a turn or more
tow_speed: 2.0 -> tow_speed: 2.0, reference_height: -3.2
  12 winch.position 0: z is up from base_link
[-36.8, 0.0, 3.7] -> [-20.0, 0.0, 3.7]
  13 sheave.position -28.8: the smaller x
[-36.8, 0.0, 3.7] -> [-29.2, 0.0, 3.1]
  13 sheave.position 0.55: Move them apart
speed: 2.0 -> speed: 0.0 & 445.0 -> -445.0
  14 towbody.net_weight 0: or give ship.tow_speed
"""


def assert_told(told, parts):
    place, _, remedy = parts.partition(": ")
    line, key, bound = place.split()
    assert (told.where, told.key) == (f"tow.yaml:{line}", key) and remedy in told.remedy
    assert told.bound == pytest.approx(float(bound), rel=1e-3)


@pytest.mark.parametrize("changes, parts", rows(LIMITS))
def test_parts_of_a_problem(changes, parts):
    found = problems(changes)
    assert_told(found, parts)
    assert found == f"{found.where}: {found.key} {found.what}; nothing was started. {found.remedy}"


def test_all_problems_of_a_file_are_told_in_its_order():
    found = problems(r"winch: -> winch: {position: 1}\nwinsch:", 3)
    places = [f"tow.yaml:{place}" for place in ("12: winch.drum_radius", "12: winch.position", "13: winsch")]
    assert [re.match(r"[\w.]+:\d+: [\w.]+", problem)[0] for problem in found] == places


def test_several_duplicates_are_all_told():
    found = problems(r"tow_speed: 2.0} -> tow_speed: 2.0, tow_speed: 3.0}\nname: again", 2)
    assert "ship.tow_speed is given twice" in found[0] and "name is given twice, first on line 1" in found[1]


# --- YAML 1.2 ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "written, value",
    [("1e-3", 1e-3), ("1E-3", 1e-3), ("1.2e-3", 1.2e-3), ("2E-03", 2e-3), (".002", 0.002), ("+1.2e-3", 1.2e-3)],
)
def test_floats_are_read_as_yaml_1_2_reads_them(written, value):
    scene = scene_from_text(SCENE.replace("viscosity: 1e-3", f"viscosity: {written}"), "tow.yaml")
    assert scene.water.viscosity == value
    assert isinstance(yaml.safe_load("1e-3"), str), "PyYAML has changed: the trap is gone"


@pytest.mark.parametrize("written", ["010", "10", "0xA", "0o12", "+10", "10.0"])
def test_integers_are_read_as_yaml_1_2_reads_them(written):
    scene = scene_from_text(SCENE.replace("elements: 10,", f"elements: {written},"), "tow.yaml")
    assert scene.cable.sections["free"].elements == 10


@pytest.mark.parametrize(
    "written, value",
    [
        ("1:30", "1:30"),
        ("1_000", "1_000"),
        ("0b11", "0b11"),
        ("+_", "+_"),
        ("2026-11-23", "2026-11-23"),
        ("=", "="),
        ("'12'", "12"),
        ("!!int word", "word"),
        ("!!binary aGE=", "aGE="),
        ("on", "on"),
        ("True", True),
        (".5e3", 500.0),
        ("'.5e3'", ".5e3"),
        ("!!str 12", "12"),
        ("~", None),
        ("-.Inf", float("-inf")),
        ("1" * 300, int("1" * 300)),
        ("1" * 301, float("1" * 301)),
        ("9" * 5000, float("inf")),
    ],
)
def test_values_of_the_core_schema_and_no_others_are_more_than_text(written, value):
    found = yaml12.parse(f"{{a: {written}}}")[0]["a"]
    assert found == value and type(found) is type(value)


@pytest.mark.filterwarnings("error")
def test_an_anchor_may_be_set_again():
    assert yaml12.parse("[&a 1, *a, &a 2, *a]")[0] == [1, 1, 2, 2]


def test_keys_are_text_and_merge_nothing():
    assert yaml12.parse("{1: a, on: b, <<: {c: d}}")[0] == {"1": "a", "on": "b", "<<": {"c": "d"}}


def test_off_is_a_law_and_not_a_boolean():
    scene = scene_from_text(SCENE.replace("drag_law: ribbon", "drag_law: off"), "tow.yaml")
    assert scene.cable.sections["free"].drag_law == "off"


# --- files ------------------------------------------------------------------------------------------------------


def report(path):
    with pytest.raises(SceneError) as caught:
        load_scene(path)
    (problem,) = caught.value.problems
    return problem


def test_missing_file_lists_the_shipped_scenes():
    assert report("no_such_tow") == (
        "no_such_tow: no such scene file; nothing was started. Give the path of a scene, or "
        f"the name of a shipped one: {', '.join(document.shipped_scenes())}"
    )


IN_YAML = "; nothing was started. Correct the YAML"
EXPECTED = (
    ", expected keys and values such as `name: my_tow`; nothing was started. "
    "Begin with a copy of a shipped scene: {names}"
)


@pytest.mark.parametrize(
    "content, text",
    [
        (b"", "{path}: is empty" + EXPECTED),
        (b"# only a comment\n", "{path}: is empty" + EXPECTED),
        (b"- 1\n", "{path}:1: is a list of 1" + EXPECTED),
        (b"name: \xff\n", "{path}: is not UTF-8 text (byte 6); nothing was started. Save the scene as UTF-8"),
        (b"name: \x07\n", "{path}: unacceptable character #x0007: special characters are not allowed" + IN_YAML),
    ],
)
def test_file_that_is_no_scene(tmp_path, content, text):
    path = tmp_path / "tow.yaml"
    path.write_bytes(content)
    assert report(path) == text.format(path=path, names=", ".join(document.shipped_scenes()))


def test_a_folder_is_no_scene(tmp_path):
    assert report(tmp_path).startswith(f"{tmp_path}: no such scene file; nothing was started.")


def test_shipped_scenes_are_found_by_name_and_by_file_name():
    assert document.find_scene("full_scale") == document.find_scene("full_scale.yaml")
    assert load_scene("full_scale").name == "full_scale"


# --- there and back ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", document.shipped_scenes())
def test_dumped_scene_is_read_back_the_same(name):
    scene = load_scene(name)
    assert scene_from_text(dump_scene(scene), "again.yaml") == scene


@pytest.mark.parametrize("name", ["1e-3", "off", "null", "12", "a: b", "", "~", "with space", "0x10", "\u00fc"])
def test_odd_names_survive_the_dump(name):
    scene = override(scene_from_text(SCENE, "tow.yaml"), {"name": name})
    assert scene_from_text(dump_scene(scene), "again.yaml").name == name


PLAIN = st.none() | st.booleans() | st.integers(-(2**63), 2**63) | st.floats(allow_nan=False) | st.text()
DATA = st.dictionaries(
    st.text(),
    st.recursive(PLAIN, lambda some: st.lists(some, max_size=4) | st.dictionaries(st.text(), some, max_size=4)),
)


@settings(derandomize=True, max_examples=10)
@given(DATA)
@example({"a": "0" * 130 + "\x1f0 0"})
def test_what_is_dumped_is_read_alike_by_yaml_1_1_and_1_2(data):
    text = yaml12.dump(data)
    assert yaml12.parse(text)[0] == data, "by the rules of 1.2"
    assert yaml.safe_load(text) == data, "by those of 1.1"


@settings(derandomize=True, max_examples=4)
@given(
    st.text(),
    st.floats(900.0, 1100.0),
    st.floats(1e-4, 1e-2),
    st.tuples(st.floats(-40.0, -37.0), st.floats(-1.0, 1.0), st.floats(3.0, 4.0)),
)
def test_a_scene_survives_the_dump(name, density, viscosity, place):
    values = {"name": name, "water.density": density, "water.viscosity": viscosity, "sheave.position": place}
    scene = override(scene_from_text(SCENE, "tow.yaml"), values)
    text = dump_scene(scene)
    assert scene_from_text(text, "again.yaml") == scene
    assert scene_from_dict(yaml.safe_load(text), "again") == scene


def test_override_sets_values_by_dotted_key():
    scene = scene_from_text(SCENE, "tow.yaml")
    other = override(scene, {"water.density": 1000.0, "cable.sections.free.length": 50.0, "gravity": 9.8})
    assert (other.water.density, other.cable.sections["free"].length, other.gravity) == (1000.0, 50.0, 9.8)
    assert scene.water.density == 1026.0


@pytest.mark.parametrize(
    "key, value, text",
    [
        ("water.densty", 1000.0, ": there is no such key; nothing was started. Did you mean water.density?"),
        ("density", 1000.0, ": there is no such key; nothing was started. Did you mean air.density?"),
        ("cable.sections.fre.length", 1.0, ": there is no such key; .* Did you mean cable.sections.free.length?"),
        ("water.density", 1.0, " kg/m^3 is outside [900, 1100] kg/m^3 (density of the water); nothing was started. "),
    ],
)
def test_override_is_checked_like_a_file(key, value, text):
    with pytest.raises(SceneError) as caught:
        override(scene_from_text(SCENE, "tow.yaml"), {key: value})
    (told,) = caught.value.problems
    begin, _, end = text.partition(".* ")
    assert told.startswith(f"override of short_tow: {key} = {value}{begin}") and told.endswith(end)


# --- cautions ---------------------------------------------------------------------------------------------------

WARNINGS = r"""
sheave: {length: 8.0, elements: 128} -> sheave: {length: 8.0, elements: 16}
  10 cable.sections.sheave 0.1: more elements
axial_stiffness: 6.786e+6 -> axial_stiffness: 6.786e+6\n  bending_stiffness: 1.4
  11 cable.sections.sheave 0.02806: shorter elements
sheave: {length: 8.0, elements: 128} -> sheave: {length: 4.0, elements: 64}\n    rest: {length: 4, elements: 2}
  8 cable.sections 1: longer outboard
drum: {length: 6.0, elements: 96} -> drum: {length: 9.0, elements: 16}
  8 cable.sections 1: longer inboard
wrap: 6.0 -> wrap: 2.0
  12 winch.wrap 1: Make winch.wrap larger
net_weight: 445.0 -> net_weight: -1000.0
  14 towbody.net_weight 0: heavier or its lift_area negative
tow_speed: 2.0 -> tow_speed: 2.0, reference_height: -2.9
  12 winch.position 0: Check the sign of z
"""


@pytest.mark.parametrize("changes, parts", rows(WARNINGS))
def test_caution(changes, parts):
    with pytest.warns(SceneWarning) as caught:
        scene_from_text(changed(changes, COMPENSATED), "tow.yaml")
    (told,) = [item.message.args[0] for item in caught]
    assert_told(told, parts)


def test_a_caution_names_the_line_that_loads_the_scene(tmp_path):
    path = tmp_path / "tow.yaml"
    path.write_text(changed("wrap: 6.0 -> wrap: 2.0", COMPENSATED), "utf-8")
    with pytest.warns(SceneWarning, match="winch.wrap = 2 rad") as caught:
        load_scene(path)
    assert [item.filename for item in caught] == [__file__]


@pytest.mark.filterwarnings("error")
def test_what_its_author_accepts_is_not_warned_of_in_that_line_alone():
    """An override of the scene has no lines, and is warned of."""
    text = re.sub(r"wrap: 6\.0(.*)", r"wrap: 2.0\1  # accepted: a test", COMPENSATED)
    scene = scene_from_text(text, "tow.yaml")
    for other in (text.replace("accepted: a test", "accepted:"), text.replace("accepted: a test", "a test")):
        with pytest.warns(SceneWarning, match="winch.wrap = 2 rad"):
            scene_from_text(other, "tow.yaml")
    with pytest.warns(SceneWarning, match="winch.wrap = 2 rad"):
        override(scene, {})


@pytest.mark.filterwarnings("error")
def test_elements_that_resolve_the_bending_length_and_a_held_winch_are_no_caution():
    stiff = SCENE.replace("axial_stiffness: 6.786e+6", "axial_stiffness: 6.786e+6\n  bending_stiffness: 7.0")
    scene_from_text(stiff, "tow.yaml")  # 1.5 sqrt(7 / 4000) = 0.0627 m
    scene_from_text(SCENE.replace("wrap: 6.0", "wrap: 2.0"), "tow.yaml")


def test_scene_from_dict_names_its_origin_without_lines():
    with pytest.raises(SceneError, match=r"^parameters: water.density = 1.0 kg/m\^3 is outside"):
        data = yaml.safe_load(SCENE) | {"water": {"density": 1.0}}
        scene_from_dict(data, "parameters")


def test_data_beside_the_code_wins_and_the_ament_index_is_the_last_resort(tmp_path):
    code = tmp_path / "prefix" / "lib" / "python3" / "site-packages" / document.PACKAGE
    other = tmp_path / "other" / "share" / document.PACKAGE
    for folder in (code, other / "config"):
        folder.mkdir(parents=True)
    (other / "package.xml").touch()
    index = {"AMENT_PREFIX_PATH": str(tmp_path / "other")}
    assert document.share_folder(code, index) == other
    own = tmp_path / "prefix" / "share" / document.PACKAGE
    (own / "config").mkdir(parents=True)
    (own / "package.xml").touch()
    assert document.share_folder(code, index) == own
    assert document.share_folder() == Path(__file__).resolve().parents[2]
