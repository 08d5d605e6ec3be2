"""Controllers that fail, for tests of the AHC benchmark."""


def raises_later(scene, period):
    def controller(row):
        raise RuntimeError("out of ideas")

    return controller


def refuses(scene, period):
    raise ValueError(f"not for {scene.name}")


def makes_nothing(scene, period):
    return None
