"""The tow that the tests of the ensemble follow: 60 s of heave, the winch at work from 25 s on.

Its tick is 50 ms: what a copy computes costs a fifth.
"""

TICK = 0.05  # s
HEAVE, SECONDS, WINCH = (0.6, 6.0), 60.0, "0 hold, 25 rate 0.5, 45 hold"
