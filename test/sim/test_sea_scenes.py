"""Tables of the sea: dispersion, spectrum and spreading of what the seed makes, current tables, texts of the checks."""

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import trapezoid
from underway import cautioned, scene_with

from cable_sim_ros.io.scenes import yaml12
from cable_sim_ros.io.scenes.load import SceneError, SceneWarning, load_scene, scene_from_dict
from cable_sim_ros.physics.water import CurrentFrame, CurrentTable, CurrentVariation, Turbulence, Water, Waves
from cable_sim_ros.sim.tables.current import flow_of
from cable_sim_ros.sim.tables.sea_tables import eddy_table, jonswap, sea_of, wave_number, wave_table

pytestmark = pytest.mark.trust

G = 9.81


@pytest.mark.parametrize("depth", [0.5, 5.0, 40.0, 3000.0, np.inf])
def test_dispersion(depth):
    """w^2 = g k tanh(kd), from shallow water (w = k sqrt(g d)) to deep water (w^2 = g k)."""
    omega = np.geomspace(0.1, 12.0, 60)
    k = wave_number(omega, G, depth)
    finite = np.tanh(k * depth) if np.isfinite(depth) else 1.0
    np.testing.assert_allclose(G * k * finite, omega**2, rtol=1e-12)
    if depth == 0.5:
        assert k[0] == pytest.approx(omega[0] / np.sqrt(G * depth), rel=1e-3)


def test_a_wave_of_ten_seconds_is_156_m_long():
    (row,) = wave_table(Waves(kind="airy", height=2.0, period=10.0), G, np.inf)
    assert 2.0 * np.pi / row[1] == pytest.approx(156.13, abs=0.01) and row[0] == 1.0


SEA = Waves(kind="jonswap", height=3.0, period=9.0, seed=4)


def realised(table, seconds=7200.0, step=0.5):
    t = np.arange(0.0, seconds, step)
    return (table[:, 0, None] * np.cos(table[:, 3, None] - table[:, 2, None] * t)).sum(0), step


def test_a_long_realisation_has_the_height_and_the_peak_asked_for():
    eta, step = realised(wave_table(SEA, G, np.inf))
    assert 4.0 * eta.std() == pytest.approx(3.0, rel=0.03)
    f, power = np.fft.rfftfreq(len(eta), step), np.abs(np.fft.rfft(eta)) ** 2
    near = (f > 0.5 / 9.0) & (f < 2.0 / 9.0)
    smooth = np.convolve(power, np.ones(60) / 60.0, "same")
    assert 1.0 / f[near][np.argmax(smooth[near])] == pytest.approx(9.0, rel=0.06)
    # Goda: mean period from the zero crossings of gamma = 3.3 is 0.78 Tp
    crossings = int(((eta[:-1] < 0.0) & (eta[1:] >= 0.0)).sum())
    assert 7200.0 / crossings / 9.0 == pytest.approx(0.78, abs=0.03)
    half = len(eta) // 2
    assert np.abs(np.corrcoef(eta[:half], eta[half:])[0, 1]) < 0.15, "it does not repeat"


@pytest.mark.parametrize("gamma", [1.0, 3.3])
def test_the_moments_of_a_sea_hardly_hang_on_its_seed(gamma):
    """Energy exactly; the fourth moment, that of accelerations, within 10 % and unbiased (42 % by equal energy)."""
    waves = SEA.model_copy(update={"gamma": gamma})
    peak = 2.0 * np.pi / waves.period
    band = np.linspace(0.5 * peak, 6.0 * peak, 20001)
    density = jonswap(band, peak, gamma)
    found = []
    for seed in range(30):
        table = wave_table(waves.model_copy(update={"seed": seed}), G, np.inf)
        assert len(table) == 100 and 0.5 * (table[:, 0] ** 2).sum() == pytest.approx(3.0**2 / 16.0, rel=1e-12)
        found.append([(0.5 * table[:, 0] ** 2 * table[:, 2] ** n).sum() for n in (2, 4)])
    exact = [trapezoid(density * band**n, band) / trapezoid(density, band) * 3.0**2 / 16.0 for n in (2, 4)]
    of_mean = np.array(found) / exact
    assert np.abs(of_mean.mean(0) - 1.0).max() < 0.02
    assert of_mean[:, 0].std() < 0.01 and of_mean[:, 1].std() < 0.05 and np.abs(of_mean[:, 1] - 1.0).max() < 0.1


def test_the_seed_makes_the_sea():
    one, other = wave_table(SEA, G, np.inf), wave_table(SEA.model_copy(update={"seed": 5}), G, np.inf)
    assert one.tobytes() == wave_table(SEA, G, np.inf).tobytes() and one.tobytes() != other.tobytes()
    gusty = Turbulence(deviation=(0.03, 0.02, 0.01))
    assert eddy_table(gusty).tobytes() == eddy_table(gusty).tobytes()
    assert eddy_table(gusty).tobytes() != eddy_table(gusty.model_copy(update={"seed": 2})).tobytes()


@pytest.mark.parametrize("s", [2.0, 10.0, 75.0])
def test_spreading_is_cos_2s_of_half_the_angle(s):
    """First moment of cos^2s(a/2): s/(s+1)."""
    waves = SEA.model_copy(update={"spreading": s, "towards_deg": 50.0, "components": 1000})
    angle = wave_table(waves, G, np.inf)[:, 4] - np.radians(50.0)
    assert np.cos(angle).mean() == pytest.approx(s / (s + 1.0), abs=0.005)
    assert abs(np.sin(angle).mean()) < 0.02
    assert (wave_table(SEA, G, np.inf)[:, 4] == 0.0).all(), "long-crested without"


def test_turbulence_has_its_deviations_and_its_time_scale():
    table = eddy_table(Turbulence(deviation=(0.03, 0.0262, 0.0152), time_scale=2.0))
    t = np.arange(0.0, 4000.0, 0.05)
    for axis, deviation in enumerate((0.03, 0.0262, 0.0152)):
        rows = table[table[:, 0] == axis]
        u = (rows[:, 1, None] * np.cos(rows[:, 2, None] * t + rows[:, 3, None])).sum(0)
        assert u.std() == pytest.approx(deviation, rel=0.03)
        spectrum = np.abs(np.fft.rfft(u, 2 * len(u))) ** 2
        correlation = np.fft.irfft(spectrum)[:160] / len(u) / u.var()
        assert correlation.sum() * 0.05 == pytest.approx(2.0, rel=0.3), "integral of the correlation"
    assert not len(eddy_table(Turbulence())) and (table[:, 0] == 0).sum() == 100


def test_all_off_is_no_sea_at_all():
    assert sea_of(Water(), G, None).rests
    assert not sea_of(Water(waves=SEA), G, None).rests


def test_the_example_of_the_manual_is_a_scene():
    page = (Path(__file__).resolve().parents[2] / "docs" / "waves.md").read_text("utf-8")
    block = page.partition("```yaml\n")[2].partition("```")[0]
    data = load_scene("full_scale").model_dump(mode="json") | yaml12.parse(block)[0]
    with pytest.warns(SceneWarning, match="ship_motion"):
        scene = scene_from_dict(data, "waves.md")
    assert not sea_of(scene.water, G, None).rests and len(sea_of(scene.water, G, None).variation) == 4


TURNING = {"depth": [0.0, 20.0, 80.0], "speed": [1.0, 0.6, 0.2], "towards_deg": [0.0, 90.0, 180.0]}


def test_a_table_by_speed_and_direction_turns_with_depth_and_with_the_heading():
    water = Water(current_table=TURNING)
    for z, value in ((0.0, (1.0, 0.0)), (-20.0, (0.0, 0.6)), (-80.0, (-0.2, 0.0)), (-200.0, (-0.2, 0.0))):
        assert flow_of(water, 0.4)(z) == pytest.approx(value, abs=1e-12)
    ahead = Water(current_table=TURNING, current_frame=CurrentFrame.HEADING)
    assert flow_of(ahead, 0.5 * np.pi)(0.0) == pytest.approx((0.0, 1.0), abs=1e-12)
    same = Water(current_table=CurrentTable(depth=(0.0, 50.0), east=(0.3, 0.1)))
    assert flow_of(same, 0.0)(-25.0) == pytest.approx((0.2, 0.0))


def test_the_start_has_the_current_of_its_time():
    late = Water(
        current=(1.0, 0.0),
        current_gradient=(0.01, 0.0),
        current_variation=CurrentVariation(time=(0.0, 3600.0), factor=(0.5, 1.0), turn_deg=(90.0, 0.0)),
    )
    assert flow_of(late, 0.0)(-10.0) == pytest.approx((0.0, 0.55))


WAVE = {"kind": "airy", "height": 1.0}
TABLE = {"depth": [0.0, 20.0]}
EAST = TABLE | {"east": [1.0, 0.5]}
FACTOR = {"time": [0.0, 10.0], "factor": [1.0, 2.0]}
FLOWS = {"current": [0.1, 0.0]}
SHALLOW, NO_G = {"seabed": {"depth": 5.0}}, {"gravity": 0.0}
SENSELESS = [  # of the water, what is said
    ({"waves": {"kind": "airy", "height": 6.0, "period": 5.0}}, "water.waves.height = 6 m is more than 5.543 m"),
    ({"waves": {"kind": "jonswap", "height": 6.0, "period": 5.0}}, "water.waves.height = 6 m is more than 5.576 m"),
    ({"waves": {"kind": "jonswap"}}, "but water.waves.kind = jonswap asks for waves"),
    ({"waves": {"height": 2.0}}, "water.waves.height = 2 m has no effect"),
    ({"waves": WAVE | {"spreading": 5.0}}, "water.waves.spreading = 5 has no effect: with water.waves.kind = airy"),
    ({"waves": WAVE | {"gamma": 5.0}}, "water.waves.gamma = 5 has no effect: with water.waves.kind = airy one wave"),
    ({"waves": WAVE | {"seed": 7}}, "water.waves.seed = 7 has no effect"),
    ({"waves": WAVE | {"components": 50}}, "water.waves.components = 50 has no effect"),
    ({"waves": WAVE | {"kind": "JONSWAP"}}, "water.waves.kind = 'JONSWAP' is none of its values"),
    ({"waves": WAVE | {"kind": "JONSWAP"}}, "Did you mean jonswap? Known: off, airy, jonswap"),
    ({"waves": {"hs": 2.0}}, "there is no such key; nothing was started. Did you mean water.waves.height?"),
    ({"waves": {"tp": 8.0}}, "there is no such key; nothing was started. Did you mean water.waves.period?"),
    ({"waves": {"from_deg": 270.0}}, "there is no such key; nothing was started. Known here: kind, height, "),
    ({"waves": {"spreading": "none"}}, "water.waves.spreading = 'none' is text"),
    ({"waves": {"ship_motion": "coupled"}}, "water.waves.ship_motion = 'coupled' is none of its values"),
    ({"turbulence": {"time_scale": 8.0}}, "water.turbulence.time_scale = 8 s has no effect"),
    ({"turbulence": {"seed": 8}}, "water.turbulence.seed = 8 has no effect: water.turbulence.deviation"),
    ({"current_table": {"depth": [0.0], "east": [1.0]}}, "depth has 1 row, needs 2 or more"),
    ({"current_table": EAST | {"depth": [0.0, 20.0, 20.0]}}, "is not ascending: row 3 with 20 m comes after 20 m"),
    ({"current_table": TABLE | {"east": [1.0, 0.5, 0.2]}}, "east has 3 numbers, water.current_table.depth has 2"),
    ({"current_table": TABLE | {"speed": [1.0, 0.5]}}, "not both pairs; here speed is given"),
    ({"current_table": EAST}, "not both pairs; here east is given"),
    ({"current_table": TABLE | {"north": [1.0, 0.5], "speed": [1.0, 0.5]}}, "here north and speed are given; nothing"),
    ({"current_table": TABLE}, "and not both pairs; here none is given; nothing was started"),
    ({"current_table": {"depth": [0.0, 20.0, 40.0], "speed": [1.0, "0,5", "0.2"]}}, "started. Entry 2 is '0,5', text:"),
    ({"current_table": {"east": [1.0, 0.5]}}, "east is given without water.current_table.depth"),
    ({"current_table": {"depth": 5.0}}, "depth = 5.0 is a number, expected a list of numbers or null in [0, 12000] m"),
    ({"current_variation": FACTOR}, "no current that it could change"),
    (FLOWS | {"current_table": EAST | {"north": [0.0, 0.0]}}, "is given beside water.current = [0.1, 0.0] m/s"),
    (FLOWS | {"current_variation": {"time": [0.0, 10.0]}}, "neither water.current_variation.factor nor water.current_"),
    (FLOWS | {"current_variation": {"factor": [1.0, 2.0]}}, "factor is given without water.current_variation.time"),
    (FLOWS | {"current_variation": FACTOR | {"time": [5.0, 1.0]}}, "time is not ascending: row 2 with 1 s comes after"),
]
BESIDE = [  # and of what is beside it
    ({"waves": WAVE | {"kind": "jonswap", "height": 4.0}}, "= 4 m is more than 3 m, 0.6 of seabed.depth", SHALLOW),
    ({"waves": WAVE | {"height": 5.0, "period": 12.0}}, "water.waves.height = 5 m is more than 4.2", SHALLOW),
    ({"current_table": EAST | {"depth": [0.0, 900.0]}}, "goes down to 900 m, more than seabed.depth = 5 m", SHALLOW),
    ({"waves": WAVE}, "gravity = 0 m/s^2, but there are no waves without it; nothing was started. Give gravity", NO_G),
]


@pytest.mark.parametrize("water, text, beside", [*((*one, {}) for one in SENSELESS), *BESIDE])
def test_water_that_makes_no_sense_stops_the_load(water, text, beside):
    data = load_scene("full_scale").model_dump(mode="json") | beside
    data["water"] |= water
    with pytest.raises(SceneError) as error:
        scene_from_dict(data, "x")
    assert text in str(error.value) and all(problem.remedy for problem in error.value.problems)


def test_waves_bring_their_cautions():
    told = cautioned(scene_with, water__waves__kind="jonswap", water__waves__height=5.0, water__waves__period=6.5)
    assert "water.waves.ship_motion = independent: waves act on cable and bodies; a ship that is given" in str(told)
    assert "take the figures of many seeds (water.waves.seed), or give the waves alone (--motion none)" in str(told)
    regular = str(cautioned(scene_with, water__waves__kind="airy", water__waves__height=2.0))
    assert "figures of several water.waves.period some percent apart (a regular wave has no seed)," in regular
    assert "seeds" not in regular
    assert [(one.key, one.unit) for one in told[-2:]] == [("water.waves.height", "m")] * 2
    assert [x for one in told[-2:] for x in (one.value, one.bound)] == pytest.approx([5.0, 4.4, 4.65, 3.45], rel=1e-3)
    assert "water.waves" not in str(cautioned(scene_with))


def test_turbulence_faster_than_the_ticks_brings_a_caution():
    fast = {"water.turbulence.deviation": [0.1, 0.0, 0.0], "water.turbulence.time_scale": 0.04}
    (told,) = cautioned(scene_with, **fast)
    assert (told.key, told.value, told.bound) == ("water.turbulence.time_scale", 0.04, 0.05)
    assert "turbulence" not in str(cautioned(scene_with, **(fast | {"water.turbulence.time_scale": 0.05})))
