"""The words of a report, for somebody who has never seen the product."""

WORDS = (
    ("Scene", "the description of a tow that was simulated: water, cable, winch, sheave, towbody, with their numbers"),
    ("Sheave", "the grooved wheel over which the cable leaves the ship"),
    ("Towbody", "the body at the end of the cable, also called the fish"),
    ("Effective tension", "pull of the cable plus the water pressure on its cross-section: what bends and breaks it"),
    ("Pay-out", "unstretched cable that has left the drum, in metres; positive is cable out"),
    ("Scope", "unstretched cable outboard of the sheave"),
    ("Layback", "horizontal distance from the sheave to the towbody"),
    ("Heave", "motion up and down; heave compensation turns the winch so that the towbody feels less of it"),
    ("Standard deviation", "how far a quantity swings about its mean; of a sine, its amplitude divided by 1.41"),
    (
        "Verdict",
        "ok: no check objects; doubtful: some figures cannot be taken as they are; failed: the run did not end",
    ),
)
