"""What goes wrong in a test with a node."""

from ..errors import RunError


class TowError(RunError):
    """The node or a process beside it did not do what the test asked for; the text has its last lines."""
