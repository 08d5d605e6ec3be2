"""The command line as a test calls it: in this process, its output kept."""

from click.testing import CliRunner, Result

from cable_sim_ros.cli.commands import main


def cable_sim(*words: object, code: int | None = None) -> Result:
    """Call `cable-sim` with these words; code: that it has to leave with, None: any."""
    result = CliRunner().invoke(main, [str(word) for word in words])
    assert code is None or result.exit_code == code, result.output
    return result
