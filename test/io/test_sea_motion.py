"""Ship motion from the waves of a scene: closed forms, sums over a spectrum, symmetry, what of a table is refused."""

import warnings
from math import cos, degrees, pi, radians, sin
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from test_motion_table import rows_of

from cable_sim_ros.io.scenes.load import load_scene
from cable_sim_ros.io.sources.motion_table import MotionError, MotionWarning
from cable_sim_ros.io.sources.rao_table import FREEDOMS, RaoTable, Wave
from cable_sim_ros.io.sources.sea_motion import SimpleHull, numbers_of_text, response_of, sea_motion, summed, waves_met
from cable_sim_ros.physics.water import CurrentFrame, WaveKind
from cable_sim_ros.sim.tables.sea_tables import BAND, FINE, jonswap

pytestmark = pytest.mark.check
G, SPEED, PERIOD, HEIGHT = 9.81, 2.0, 8.0, 2.0
OMEGA = 2.0 * pi / PERIOD
K = OMEGA**2 / G
BASE = load_scene("side_scan")


def scene_of(**keys):
    """`side_scan` with a regular wave that goes east as the ship does; keys are of water.waves, or of a block__key."""
    values = {"gravity": G, "water": {"ramp": 0.0}, "ship": {"tow_speed": SPEED}}
    waves = {"kind": WaveKind.AIRY, "height": HEIGHT, "period": PERIOD}
    for name, value in keys.items():
        block, _, key = name.rpartition("__")
        (values[block] if block else waves)[key] = value
    water = BASE.water.model_copy(update=values["water"] | {"waves": BASE.water.waves.model_copy(update=waves)})
    ship = BASE.ship.model_copy(update=values["ship"])
    return BASE.model_copy(update={"gravity": G, "water": water, "ship": ship})


IRREGULAR = {"kind": WaveKind.JONSWAP, "components": 400, "seed": 5}


@pytest.fixture
def table(tmp_path):
    """Write a table; rows: (period, heading) -> {freedom: (amplitude, phase)}, or text. Returns its path."""

    def write(rows):
        path = tmp_path / "ship.csv"
        path.write_text(rows if isinstance(rows, str) else text_of(rows), "utf-8")
        return path

    return write


def text_of(rows):
    names = list(next(iter(rows.values())))
    head = ["period_s", "heading_deg", *(f"{n}_{part}" for n in names for part in ("amplitude", "phase_deg"))]
    body = [[*key, *(x for name in names for x in row[name])] for key, row in rows.items()]
    return "\n".join([",".join(head), "# a comment", *(",".join(repr(float(x)) for x in row) for row in body)]) + "\n"


def flat(headings=(0.0, 90.0, 180.0), periods=(2.0, 30.0), **responses):
    """Rows with the same responses everywhere; those across vanish along the centre plane."""
    across = ("sway", "roll", "yaw")
    return {
        (p, h): {n: (0.0 if n in across and h in (0.0, 180.0) else a, f) for n, (a, f) in responses.items()}
        for p in periods
        for h in headings
    }


def moved(tow):
    """Times [s], coordinates [n, 6] less the mean track and rates [n, 6] less it, of a ship that heads east."""
    stamps, value, rate = rows_of(tow)
    t = stamps - 1.0
    value[:, 0] -= SPEED * t
    rate[:, 0] -= SPEED
    return t, value, rate


@pytest.mark.parametrize("towards", [0.0, 180.0], ids=["following", "head"])
def test_a_regular_wave_moves_the_ship_by_amplitude_phase_and_frequency_of_encounter(table, towards):
    """elevation at base_link (U t, 0): cos(k U t cos b - w t); a lead of 30 deg comes earlier."""
    tow = sea_motion(
        table(flat(heave=(0.8, 30.0), surge=(0.5, -90.0), pitch=(2.0, 0.0))), scene_of(towards_deg=towards), 40.0
    )
    t, value, rate = moved(tow)
    encounter = OMEGA - K * SPEED * cos(radians(towards))
    angle = encounter * t
    assert encounter == pytest.approx(OMEGA * (1.0 - 0.160125 * cos(radians(towards))), rel=1e-4)
    expected = {0: 0.5 * np.sin(angle), 2: 0.8 * np.cos(angle + pi / 6.0), 4: radians(2.0) * np.cos(angle)}
    for k in range(6):
        assert value[:, k] == pytest.approx(expected.get(k, 0.0 * t), abs=1e-9)
    assert rate[:, 2] == pytest.approx(-0.8 * encounter * np.sin(angle + pi / 6.0), abs=1e-9)
    assert rate[:, 4] == pytest.approx(-radians(2.0) * encounter * np.sin(angle), abs=1e-9)
    assert len(t) == 41 * 50 and tow.heading == 0.0


def test_a_wave_that_the_ship_overtakes_keeps_the_place_on_it(table):
    """Fast ship in a short following sea: pitch of the slope stays that of the slope, whichever comes first."""
    scene = scene_of(period=4.0, height=0.3, ship__tow_speed=8.0)
    ((wave, amplitude, _),) = waves_met(scene)
    assert wave.encounter < 0.0
    tow = sea_motion(table(flat(heave=(1.0, 0.0), pitch=(degrees(wave.number), 90.0))), scene, 10.0)
    t, value, _ = moved(tow)
    x = value[:, 0] + SPEED * t  # = 8 t
    theta = wave.number * x - wave.omega * t
    assert value[:, 2] == pytest.approx(amplitude * np.cos(theta), abs=1e-7)
    slope = -amplitude * wave.number * np.sin(theta)
    assert value[:, 4] == pytest.approx(-slope, abs=1e-7), "bow down is positive"
    assert tow.sea_motion["overtaken"] == 1.0


def test_the_motion_grows_with_the_sea(table):
    path = table(flat(heave=(1.0, 0.0)))
    t, value, rate = moved(sea_motion(path, scene_of(water__ramp=20.0), 40.0))
    _, full, _ = moved(sea_motion(path, scene_of(), 40.0))
    x = np.minimum(t / 20.0, 1.0)
    assert value[:, 2] == pytest.approx(x * x * (3.0 - 2.0 * x) * full[:, 2], abs=1e-12)
    between = 0.5 * (t[1:] + t[:-1])
    mean = 0.5 * (rate[1:, 2] + rate[:-1, 2])
    assert np.diff(value[:, 2]) / np.diff(t) == pytest.approx(mean, abs=1e-4), between[-1]


def test_variances_are_those_of_the_spectrum(table):
    """Heave: integral of |RAO|^2 S by the shape of the spectrum; the sea's parts have the energy exactly, and one
    frequency drawn from each: 400 of them are within 1 %."""
    rows = {
        (p, h): {"heave": (1.0 / (1.0 + (4.0 / p) ** 4), 0.0), "roll": (0.0 if h in (0.0, 180.0) else 3.0, 40.0)}
        for p in (*np.linspace(1.2, 8.0, 60), 10.0, 12.0, 16.0, 20.0)
        for h in (0.0, 90.0, 180.0)
    }
    scene = scene_of(**IRREGULAR, towards_deg=-135.0, ship__tow_speed=SPEED)
    path = table(rows)
    tow = sea_motion(path, scene, 60.0)
    answer, peak = RaoTable(path), OMEGA
    omega = np.linspace(BAND[0] * peak, BAND[1] * peak, FINE)
    density = jonswap(omega, peak, 3.3)
    density *= HEIGHT**2 / 16.0 / np.trapezoid(density, omega)
    gain = np.array([abs(answer.response(Wave(w, w * w / G, radians(-135.0), w))[2]) for w in omega])
    expected = np.trapezoid(gain**2 * density, omega) ** 0.5
    found = tow.sea_motion["deviations"]
    assert found["heave"] == pytest.approx(expected, rel=0.01) and 0.3 < found["heave"] < 0.5
    assert found["roll"] == pytest.approx(1.5 * HEIGHT / 4.0, rel=1e-6), "half way to beam seas, in deg"
    met = waves_met(scene)
    value, _ = summed(np.arange(0.0, 8000.0, 0.5), met, [answer.response(wave) for wave, _, _ in met])
    assert value[:, 2].std() == pytest.approx(found["heave"], rel=0.02), "over some 1000 waves"


@pytest.mark.parametrize("kind", ["table", "simple:length=40,beam=9"])
def test_waves_from_the_other_side_give_the_mirror_image(table, kind):
    everything = {name: (1.0 + 0.1 * k, 20.0 * k) for k, name in enumerate(FREEDOMS)}
    rao = table(flat(headings=(0.0, 45.0, 90.0, 135.0, 180.0), **everything)) if kind == "table" else kind
    port, starboard = (
        moved(sea_motion(rao, scene_of(towards_deg=side * 60.0, frame=CurrentFrame.HEADING), 20.0))
        for side in (1.0, -1.0)
    )
    signs = np.array([1.0, -1.0, 1.0, -1.0, 1.0, -1.0])
    assert np.abs(port[1][:, 3]).max() > 0.005
    assert starboard[1] == pytest.approx(signs * port[1], abs=1e-12)


def test_the_direction_is_relative_to_the_heading(table):
    path = table(flat(headings=(0.0, 60.0, 120.0, 180.0, 240.0, 300.0), heave=(1.0, 0.0)))
    ahead = scene_of(ship__heading_deg=70.0, towards_deg=250.0)
    ((wave, *_),) = waves_met(ahead)
    assert degrees(wave.heading) % 360.0 == pytest.approx(180.0)
    ((turned, *_),) = waves_met(scene_of(ship__heading_deg=70.0, towards_deg=180.0, frame=CurrentFrame.HEADING))
    assert turned.encounter == pytest.approx(wave.encounter) and wave.encounter > wave.omega
    assert sea_motion(path, ahead, 5.0).heading == radians(70.0)


def test_the_same_seed_gives_the_same_bytes_and_longer_runs_begin_alike(table):
    path, scene = table(flat(heave=(1.0, 0.0), roll=(2.0, 10.0))), scene_of(**IRREGULAR, spreading=10.0)
    first, again, longer = (sea_motion(path, scene, seconds).events for seconds in (7.0, 7.0, 33.3))
    assert first == again and longer[: len(first)] == first
    assert sea_motion(path, scene_of(**(IRREGULAR | {"seed": 6}), spreading=10.0), 7.0).events[200:] != first[200:]


def test_interpolation_is_by_amplitude_and_phase_in_frequency_and_linear_in_heading(table):
    rows = {(p, h): {"heave": (a, f)} for (p, h, a, f) in ((5.0, 90.0, 1.0, 0.0), (10.0, 90.0, 1.0, 90.0))}
    rows |= {(p, 180.0): {"heave": (2.0, 180.0)} for p in (5.0, 10.0)}
    answer = RaoTable(table(rows))

    def heave(period, heading):
        omega = 2.0 * pi / period
        wave = Wave(omega, omega**2 / G, radians(heading), omega)
        return answer.response(wave)[2], answer.covers(wave)

    middle = 2.0 * pi / (0.5 * (2.0 * pi / 5.0 + 2.0 * pi / 10.0))
    assert heave(middle, 90.0)[0] == pytest.approx((1.0 + 1.0j) / 2.0**0.5), "no amplitude is lost between phases"
    assert heave(5.0, 135.0)[0] == pytest.approx(-0.5) and heave(5.0, -135.0)[0] == pytest.approx(-0.5)
    assert heave(10.0, 90.0) == (pytest.approx(1j), True)
    assert heave(3.0, 90.0) == (pytest.approx(1.0), False) and heave(20.0, 90.0) == (pytest.approx(1j), False)
    assert heave(5.0, 30.0) == (pytest.approx(1.0), False)


@pytest.mark.parametrize("step, loss", [(90.0, 29.0), (45.0, 7.6), (30.0, 0.0)])
def test_headings_far_apart_say_what_is_lost_between_them(table, step, loss):
    """Of a roll that goes with the sine of the heading."""
    headings = [step * k for k in range(round(180.0 / step) + 1)]
    roll = {h: round(abs(sin(radians(h))), 12) for h in headings}
    answer = RaoTable(table({(p, h): {"roll": (roll[h], 90.0)} for p in (5.0, 40.0) for h in headings}))
    found = abs(answer.response(Wave(1.0, 0.1, radians(90.0 - 0.5 * step), 1.0))[3]) / radians(1.0)
    exact = sin(radians(90.0 - 0.5 * step))
    said = [note for note in answer.notes() if "deg apart: half-way" in note]
    assert 100.0 * (1.0 - found / exact) <= max(loss, 3.5) + 0.5
    assert bool(said) == (loss > 0.0) and (not said or f"up to {loss:.2g} % too small" in said[0])


def test_phases_that_are_a_change_of_sign_are_interpolated_through_zero_and_said(table):
    rows = {(p, 90.0): {"heave": (1.0, f)} for p, f in ((5.0, 0.0), (10.0, 170.0))}
    rows |= {(p, 0.0): {"heave": (1.0, f)} for p, f in ((5.0, -30.0), (10.0, 30.0))}
    answer = RaoTable(table(rows))
    middle = 0.75 * 2.0 * pi / 5.0
    through, turned = (abs(answer.response(Wave(middle, 0.1, radians(h), middle))[2]) for h in (90.0, 0.0))
    assert through == pytest.approx(cos(radians(85.0))) and turned == pytest.approx(1.0), "60 deg apart lost 13 %"
    assert any("heave: phases of neighbouring periods up to 170 deg apart" in note for note in answer.notes())


def test_a_full_circle_is_closed(table):
    rows = {(p, h): {"sway": (h / 100.0, 0.0)} for p in (5.0, 10.0) for h in (30.0, 120.0, 210.0, 300.0)}
    answer = RaoTable(table(rows))
    omega = 2.0 * pi / 6.0
    found = [answer.response(Wave(omega, 0.1, radians(h), omega))[1].real for h in (120.0, 165.0, 345.0, 0.0, -60.0)]
    assert found == pytest.approx([1.2, 1.65, 1.65, 1.2, 3.0])


GRIDS = [{45, 90, 135}, {60, 120}, {0, 90, 180}, {0, 80, 160, 240, 320}, {0, 90, 180, 270, 360}, {10, 100, 190, 280}]


@settings(max_examples=60)
@given(
    periods=st.lists(st.floats(0.5, 200.0), min_size=1, max_size=4, unique=True),
    headings=st.one_of(st.sets(st.integers(0, 360), min_size=1, max_size=6), st.sampled_from(GRIDS)),
    names=st.lists(st.sampled_from(FREEDOMS), min_size=1, max_size=6, unique=True),
    seed=st.integers(0, 1000),
    where=st.tuples(st.integers(0, 3), st.integers(0, 5)),
)
def test_any_table_reads_back_at_its_own_points(tmp_path_factory, periods, headings, names, seed, where):
    """Or is refused in one line with the file; rows in any order."""
    rng = np.random.default_rng(seed)
    rows = {
        (p, float(h)): {n: (rng.uniform(0.0, 50.0), rng.uniform(-720.0, 720.0)) for n in names}
        for p in periods
        for h in headings
    }
    rows = dict([list(rows.items())[i] for i in rng.permutation(len(rows))])
    path = tmp_path_factory.mktemp("rao") / "ship.csv"
    path.write_text(text_of(rows), "utf-8")
    with warnings.catch_warnings(action="ignore", category=MotionWarning):
        try:
            answer = RaoTable(path)
        except MotionError as error:
            assert str(error).startswith(str(path)) and "\n" not in str(error) and "nothing was simulated" in str(error)
            wide = sorted(headings)
            gaps = np.diff([*wide, *([wide[0] + 360] if wide[-1] > 180 else [])])
            on_plane = {0, 180} & set(headings) and {"sway", "roll", "yaw"} & set(names)
            assert (len(gaps) and gaps.max() > 90) or on_plane
            return
    p, h = periods[where[0] % len(periods)], sorted(headings)[where[1] % len(headings)]
    if h == 360 and 0 in headings:
        return  # the same direction twice
    found = answer.response(Wave(2.0 * pi / p, 0.1, radians(h), 1.0))
    for k, name in enumerate(FREEDOMS):
        amplitude, phase = rows[p, float(h)].get(name, (0.0, 0.0))
        if answer.symmetric and h in (0, 180) and name in ("sway", "roll", "yaw"):
            amplitude = 0.0
        x = amplitude * (cos(radians(phase)) + 1j * sin(radians(phase))) * (radians(1.0) if k > 2 else 1.0)
        assert found[k] == pytest.approx(x, abs=1e-6)


HEAD = "period_s,heading_deg,heave_amplitude,heave_phase_deg\n"
ROLL = HEAD.replace("heave", "roll")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "ship.csv: is empty; nothing was simulated. The first line names the columns, such as period_s"),
        (HEAD, "ship.csv: has no row below its names"),
        (HEAD.replace("heave_a", "heav_a"), "there is no column 'heav_amplitude'; .* mean heave_amplitude?"),
        ("period_s,heave_amplitude,heave_phase_deg\n", "there is no column heading_deg; .* a period and a heading"),
        ("period_s,heading_deg\n5,90\n", "has no response beside period_s and heading_deg; .* Known: period_s"),
        ("period_s,heading_deg,roll_amplitude\n", "roll_amplitude has no roll_phase_deg beside it; .* Give both"),
        ("period_s,period_s,heading_deg\n", "there are two columns period_s; .* Keep one"),
        (HEAD + "5,90,1\n", "ship.csv:2: 3 cells under 4 columns"),
        (HEAD + "\n5,90,1,x\n", "ship.csv:3: heave_phase_deg = x is no finite number"),
        (HEAD + "5,90,inf,0\n", "ship.csv:2: heave_amplitude = inf is no finite number"),
        (HEAD + "0.1,90,1,0\n", r"period_s = 0.1 s is outside \[0.3, 1000\] s; .* not its frequency"),
        (HEAD + "5,-90,1,0\n", r"heading_deg = -90 deg is outside \[0, 360\] deg; .* add 360 to negative"),
        (HEAD + "5,90,-1,0\n", r"heave_amplitude = -1 m/m is outside \[0, 50\] m/m; .* a metre of wave amplitude"),
        (ROLL + "5,90,60,0\n", r"roll_amplitude = 60 deg/m is outside \[0, 50\] deg/m"),
        (HEAD + "5,90,1,900\n", r"heave_phase_deg = 900 deg is outside \[-720, 720\] deg; .* in degrees"),
        (HEAD + "5,90,1,0\n6,90,1,0\n5,90,2,0\n", "csv:4: period_s = 5 s at heading_deg = 90 deg stands in line 2"),
        (HEAD + "5,90,1,0\n6,120,1,0\n", "has no row of period_s = 6 s at heading_deg = 90 deg, of 2 periods"),
        (HEAD + "5,0,1,0\n5,180,1,0\n", "goes from 0 to 180 deg in one step of 180 deg, above 90 deg"),
        (HEAD + "5,90,1,0\n5,181,1,0\n", "goes from 90 to 181 deg in one step of 91 deg"),
        (ROLL + "5,90,5,0\n5,180,1,0\n", "goes up to 1 at heading_deg = 180 deg, above 1 % of its largest, 5: .* 360"),
    ],
)
def test_what_of_a_table_is_refused(table, text, said):
    with pytest.raises(MotionError, match=said) as caught:
        RaoTable(table(text))
    assert "nothing was simulated" in str(caught.value) and "\n" not in str(caught.value)


def test_a_file_that_cannot_be_read_is_refused(tmp_path):
    with pytest.raises(MotionError, match="none.csv: no such file; .* Give the path"):
        RaoTable(tmp_path / "none.csv")
    (tmp_path / "x.csv").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(MotionError, match="cannot be read as UTF-8"):
        RaoTable(tmp_path / "x.csv")


def test_angles_in_radians_are_said_to_be_too_small(table):
    k = (2.0 * pi / 30.0) ** 2 / G
    with pytest.warns(MotionWarning, match="pitch_amplitude = 0.00447 deg/m in the longest wave, 30 s, .* in rad/m?"):
        RaoTable(table(flat(pitch=(round(k, 6), 90.0))))
    with warnings.catch_warnings(action="error"):
        RaoTable(table(flat(pitch=(degrees(k), 90.0))))


@pytest.mark.parametrize(
    ("rao", "keys", "seconds", "said"),
    [
        ("flat", {"kind": WaveKind.OFF, "height": 0.0}, 9.0, "side_scan: --rao moves the .*kind = off; .* --set water"),
        ("flat", {}, 0.0, r"a duration of 0 s is outside \(0, 86400\] s"),
        ("flat", {"period": 1.5, "height": 0.1}, 9.0, r"100 % of the energy of the sea \(1.5 to 1.5 s, 0 to 0 deg\)"),
        ("high", {}, 9.0, "heave reaches 2[0-9.]+ m after [0-9.]+ s, above 20 m; .* Check the units of the table"),
        ("simple:length=0.5", {}, 9.0, r"--rao simple: length = 0.5 m is outside \[1, 500\] m; .*:length=VALUE"),
        ("simple:size=5", {}, 9.0, "--rao simple: 'size=5' is no number of the hull; .* Known: length, beam, draft"),
        ("simple:beam=x", {}, 9.0, "--rao simple: 'beam=x' is no number; .* for example"),
        ("simple:beam=nan", {}, 9.0, "--rao simple: 'beam=nan' is no number"),
        ("simple:beam=5,beam=6", {}, 9.0, "--rao simple: 'beam=6' gives beam twice"),
    ],
)
def test_what_of_a_sea_and_a_hull_is_refused(table, rao, keys, seconds, said):
    path = table(flat(heave=(1.0 if rao == "flat" else 25.0, 0.0)))
    with pytest.raises(MotionError, match=said) as caught:
        sea_motion(path if rao in ("flat", "high") else rao, scene_of(**keys), seconds)
    assert "nothing was simulated" in str(caught.value)


def test_a_simple_hull_of_a_sheave_forward_needs_its_length():
    with pytest.raises(MotionError, match="length .* is not known, as the sheave is -3 m aft .*simple:length=60"):
        SimpleHull({}, -3.0)


def test_energy_outside_the_table_is_held_noted_and_beyond_the_bound_doubtful(table):
    scene = scene_of(**IRREGULAR)
    narrow, wide = (sea_motion(table(flat(periods=(p, 30.0), heave=(1.0, 0.0))), scene, 5.0) for p in (5.0, 3.0))
    (reason,) = narrow.doubts
    assert reason.flag == "RAO_OUTSIDE" and "more than 5 %. Give a wider table" in reason.text
    assert narrow.sea_motion["outside"] > 0.05 > wide.sea_motion["outside"] > 0.0 and not wide.doubts
    assert "% of the energy of the sea" in wide.sea_motion["notes"][-1]
    assert "no columns of surge, sway, roll, pitch, yaw" in wide.sea_motion["notes"][0]
    assert narrow.sea_motion["deviations"]["heave"] == pytest.approx(HEIGHT / 4.0, rel=1e-9), "ends are held"


def wave_of(period, heading_deg, speed=0.0):
    omega = 2.0 * pi / period
    k = omega**2 / G
    return Wave(omega, k, radians(heading_deg), omega - k * speed * cos(radians(heading_deg)))


def test_the_simple_hull_rides_on_long_waves():
    """Heave is the elevation, pitch and roll its slope along and across, within what a wave of 2.5 km leaves."""
    hull = SimpleHull({"length": 40.0, "beam": 9.0}, 16.0)
    for heading in (0.0, 50.0, 130.0, 180.0, -70.0):
        wave = wave_of(40.0, heading, 3.0)
        _, _, heave, roll, pitch, _ = hull.response(wave)
        along, across = cos(wave.heading), sin(wave.heading)
        assert heave == pytest.approx(1.0, abs=0.02)
        assert pitch == pytest.approx(1j * wave.number * along, abs=0.02 * wave.number), "bow down is positive"
        assert roll == pytest.approx(-1j * wave.number * across, abs=0.08 * wave.number), "port side up is positive"


@pytest.mark.parametrize("speed", [0.0, 5.0])
def test_heave_and_pitch_of_the_simple_hull_are_the_closed_forms(speed):
    """Magnitudes as the paper has them: F, G, eta, written out with trigonometric functions of their own."""
    hull = SimpleHull({"length": 60.0, "beam": 12.0, "draft": 4.0}, 30.0)
    for period in (4.0, 6.0, 7.5, 9.0, 14.0):
        for heading in (0.0, 60.0, 150.0, 180.0):
            wave = wave_of(period, heading, speed)
            k, ke = wave.number, abs(wave.number * cos(wave.heading))
            a = wave.encounter / wave.omega
            radiated = 2.0 * np.sin(0.5 * k * 12.0 * a * a) * np.exp(-k * 4.0 * a * a)
            f = np.hypot(1.0 - k * 4.0, radiated**2 / (k * 12.0 * abs(a) ** 3))
            eta = 1.0 / np.hypot(1.0 - 2.0 * k * 4.0 * a * a, radiated**2 / (k * 12.0 * a * a))
            size, half = np.exp(-ke * 4.0) * f * eta, 0.5 * ke * 60.0
            found = hull.response(wave)
            assert abs(found[2]) == pytest.approx(size * abs(np.sin(half)) / half, rel=1e-9)
            pitch = size * 24.0 / ((2.0 * half) ** 2 * 60.0) * abs(np.sin(half) - half * np.cos(half))
            assert abs(found[4]) == pytest.approx(pitch, rel=1e-9)


def test_the_simple_hull_answers_a_ship_that_runs_with_the_wave_and_says_what_it_chose():
    still = wave_of(6.0, 0.0)
    with_it = Wave(still.omega, still.number, 0.0, 0.0)
    hull = response_of("simple", BASE)
    assert np.isfinite(hull.response(with_it)).all() and abs(hull.response(with_it)[2]) < 1.0
    (note,) = hull.notes()
    assert (
        "length 32 m (twice the distance" in note and "roll_damping 0.1 (a choice)" in note and "not your ship" in note
    )
    given = numbers_of_text("length=60, beam=12,draft=4,roll_period=9,roll_damping=0.2")
    assert "nothing chosen" in SimpleHull(given, 0.0).notes()[0]
    assert isinstance(response_of(Path("simple:length=30"), BASE), SimpleHull)
