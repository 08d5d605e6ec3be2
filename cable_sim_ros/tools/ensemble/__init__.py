"""Copies of a tow whose uncertain numbers differ, beside a node or over a recording, and the band that they give."""
