"""Scenes, span files and winch plans: text in, checked objects out."""
