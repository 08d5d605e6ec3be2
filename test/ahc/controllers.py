"""Controllers that fail or cheat, for tests of the AHC benchmark."""

import gc
import os
import time

from cable_sim_ros import WinchCommand


def raises_later(scene, period):
    def controller(row):
        raise RuntimeError("out of ideas")

    return controller


def refuses(scene, period):
    raise ValueError(f"not for {scene.name}")


def makes_nothing(scene, period):
    return None


def writes_the_row(scene, period):
    def controller(row):
        row["tension"] = 0.0

    return controller


def reads_the_truth(rig, period):
    return lambda heard: heard.tension


def never_answers(scene, period):
    def controller(row):
        while True:
            time.sleep(0.01)

    return controller


def dies(scene, period):
    return lambda row: os._exit(3)


def returns_words(scene, period):
    return lambda row: "out"


def looks_for_the_simulator(scene, period):
    """The rate says how many simulators and records with the truth it can reach."""

    def controller(heard):
        print("standard output belongs to the figures")
        found = [one for one in gc.get_objects() if type(one).__name__ in ("Simulator", "recarray", "record")]
        return WinchCommand(rate=float(len(found)))

    return controller


def echoes(rig, period):
    return lambda heard: [WinchCommand(rate=heard.heave_rate), WinchCommand(payout=rig.payout, rate=period)]
