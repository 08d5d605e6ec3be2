"""Spans for the tests: a small cable like that of the source, in SI."""

from cable_sim_ros.tools.spans.in_frequency.files import span_from_dict

INCH = 0.0254


def data(**blocks):
    """Plain data of a small cable; blocks are merged into it."""
    out = {
        "name": "small",
        "cable": {"length": 17.0, "diameter": 0.03, "mass_per_length": 0.9},
        "tension": {"start": 1500.0},
        "water": {"density": 1000.0},
        "flow": {"arc": [0.0, 17.0], "speed": [0.65, 0.0], "turbulence": 0.07},
        "response": {"segments": 20, "points": 20, "frequency_step": 0.2, "frequencies": 60},
    }
    for name, values in blocks.items():
        out[name] = {**out.get(name, {}), **values}
    return out


def span(**blocks):
    """The Span of `data`."""
    return span_from_dict(data(**blocks), "test")
