"""The worked examples of docs/extending.md compile in a process of their own while other tests run."""

EARLY, LATE = "test_the_examples_apply_one_after_the_other", "test_the_examples_do_what_they_say"


def pytest_collection_modifyitems(items):
    """Start them first of all, ask for the result last of those that do not keep real time."""
    early, late = ([item for item in items if item.name == name] for name in (EARLY, LATE))
    if not (early and late):
        return
    others = [item for item in items if item not in early + late]
    timed = next((i for i, item in enumerate(others) if item.path.parent.name == "ros"), len(others))
    items[:] = early + others[:timed] + late + others[timed:]
