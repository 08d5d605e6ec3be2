"""Route over drum and sheave, and the static shape of a tow."""
