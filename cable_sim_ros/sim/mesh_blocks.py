"""What a scene says about its mesh: an accuracy, from which the mesh is made, or numbers written by hand."""

from __future__ import annotations

from enum import Enum

from ..physics.parameter import Block, choice, quantity


class SheaveAnswer(str, Enum):
    """What is wanted of the contact on the sheave; each next one needs shorter elements."""

    RESULTANT = "resultant"  # its resultant, tension and angle
    DISTRIBUTION = "distribution"  # and the line load along it
    ENDS = "ends"  # and the reactions at the ends of the contact


class Accuracy(Block):
    """Errors that the mesh may add, against a mesh and a step refined until nothing changes."""

    tension: float = quantity(
        0.005,
        "1",
        1e-5,
        0.2,
        "largest relative error of mean and standard deviation of the tension at the sheave, each over its own value",
        "docs/mesh.md",
    )
    position: float | None = quantity(
        None,
        "m",
        1e-6,
        100.0,
        "largest distance of the towbody from where it is on a refined mesh; none: 0.01 m, but not below "
        "1e-5 nor above 1e-3 of the largest scope",
        "docs/mesh.md",
    )
    slack: float = quantity(
        0.0,
        "m",
        0.0,
        100.0,
        "slack cable that may come onto the sheave from outboard, and the whole span from inboard: elements there as "
        "at the sheave's coarsest; 0: the cable stays taut",
        "docs/mesh.md",
    )
    sheave: SheaveAnswer = choice(
        SheaveAnswer.RESULTANT, "what is wanted of the contact on the sheave", "docs/accuracy.md"
    )


class Outboard(Block):
    """Mesh of one section outboard of the sheave."""

    elements: int | None = quantity(None, "1", 1, 1000, "elements of the section; none: made from accuracy")
    grading: float | None = quantity(
        None, "1", 1e-3, 1e3, "length of the last element over that of the first; none: made from accuracy"
    )


class Mesh(Block):
    """Numbers for the mesh of a winch that feeds cable; what is left out is made from accuracy."""

    inboard: int | None = quantity(
        None, "1", 1, 200, "elements between drum and the fine mesh at the sheave; none: made from accuracy"
    )
    sheave: int | None = quantity(None, "1", 1, 1000, "elements of the fine mesh at the sheave; none: from accuracy")
    before: float | None = quantity(
        None, "m", 0.0, 100.0, "fine mesh inboard of where the cable meets the sheave; none: made from accuracy"
    )
    after: float | None = quantity(
        None,
        "m",
        0.0,
        100.0,
        "fine mesh outboard of where the cable leaves the sheave at the start; none: from accuracy",
    )
    sections: dict[str, Outboard] = choice({}, "outboard elements by the name of a section of the cable")
