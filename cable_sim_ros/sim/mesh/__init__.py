"""The mesh of a scene, made from an accuracy."""
