"""Registers a change of one stage of a truth."""

from .truth import Truth


def at_stage(stage: str):
    """Registers what a maker returns, a function of the state, at a stage."""

    def wrap(make):
        def bend(truth: Truth, target: str, m: float, rng) -> None:
            truth.hooks[stage].append(make(truth, target, m, rng))

        return bend

    return wrap
