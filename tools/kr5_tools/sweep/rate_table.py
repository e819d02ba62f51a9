"""What comes of the trials of a sweep: rates with exact intervals, times, and which places fall short."""

from typing import Any

from kr5 import uncertainty

from kr5_tools.sweep.trials import ATTEMPTS, Grid, Trial

WANTED = 0.95  # success at the first attempt, below which a place is named
LEVEL = 0.05


def success_rate(successes: int, trials: int) -> dict[str, Any]:
    """A share with its exact (Clopper and Pearson) two-sided 95 % interval and one-sided lower bound."""
    if not trials:
        return {"count": 0, "rate": None, "low": None, "high": None, "min_rate": None}
    found = uncertainty.success_rate(uncertainty.Count(successes=successes, trials=trials))
    return {
        "count": successes,
        "rate": found.rate,
        "low": found.interval.low,
        "high": found.interval.high,
        "min_rate": found.min_rate,
    }


def median_time(times: list[float]) -> dict[str, Any]:
    """Median with its interval from order statistics (at least 95 %; none of fewer than six), and the 90 % quantile
    [s]."""
    if not times:
        return {"median": None, "low": None, "high": None, "q90": None}
    found = uncertainty.sample_median(times)
    low, high = (found.interval.low, found.interval.high) if found.interval else (None, None)
    return {"median": found.median, "low": low, "high": high, "q90": found.quantile_90}


def reason_text(reason: object) -> str:
    """The reason for which a peg is not in; its controller may believe it is."""
    return "wrongly assumed inserted" if str(reason) == "inserted" else str(reason)


def summarise_trials(trials: list[Trial]) -> dict[str, Any]:
    """Of any set of trials: success by each attempt, times of the successes, why the others failed."""
    reasons = [f"{t.phase}: {reason_text(t.reason)}" for t in trials if not t.inserted]
    return {
        "trials": len(trials),
        "by_attempt": [
            success_rate(sum(1 for t in trials if t.inserted and t.attempts <= k), len(trials))
            for k in range(1, ATTEMPTS + 1)
        ],
        "time": median_time([t.time for t in trials if t.inserted]),
        "failures": {r: reasons.count(r) for r in sorted(set(reasons))},
    }


def rate_tables(trials: list[Trial], grid: Grid) -> list[dict[str, Any]]:
    """One per orientation and strategy: a row for each tilt and clearance, all of them pooled, and those that fall
    short."""
    out = []
    for orientation in grid.orientations:
        for strategy in grid.strategies:
            mine = [t for t in trials if (t.orientation, t.strategy) == (orientation, strategy)]
            places = [
                {
                    "tilt": tilt,
                    "clearance": clearance,
                    **summarise_trials([t for t in mine if (t.tilt, t.clearance) == (tilt, clearance)]),
                }
                for tilt in grid.tilts
                for clearance in grid.clearances
            ]
            places = [p for p in places if p["trials"]]
            mark_short(places)
            out.append(
                {"orientation": orientation, "strategy": strategy, "rows": places, "pooled": summarise_trials(mine)}
            )
    return [t for t in out if t["rows"]]


def mark_short(places: list[dict[str, Any]]) -> None:
    """Marks the places whose first attempt is below 95 %: exact one-sided binomial tests, corrected by Holm over the
    table."""
    counts = [uncertainty.Count(successes=p["by_attempt"][0]["count"], trials=p["trials"]) for p in places]
    for place, test in zip(places, uncertainty.test_rates(counts, WANTED, LEVEL), strict=True):
        place |= {"p_below": test.p, "below": test.below}


COLUMNS = [
    "tilt [deg]",
    "clearance [mm]",
    "first attempt (interval [%])",
    "by second (interval [%])",
    "by third (interval [%])",
    "median [s]",
    "90 % [s]",
]
COLUMNS_TEXT = (
    "Successes of trials, in brackets the exact 95 % interval of their share; median and 90 % quantile of the times of"
    " the successes."
)


def display_rows(table: dict[str, Any]) -> list[list[str]]:
    """The rows for people; the last one is all of them together."""
    rows = [
        [f"{p['tilt']:g}" + ("*" if p["below"] else ""), f"{p['clearance']:g}", *display_row(p)] for p in table["rows"]
    ]
    return [*rows, ["all", "", *display_row(table["pooled"])]]


def display_row(place: dict[str, Any]) -> list[str]:
    rates = [
        f"{r['count']}/{place['trials']} ({100 * r['low']:.0f}–{100 * r['high']:.0f})" for r in place["by_attempt"]
    ]
    return [
        *rates,
        *("–" if place["time"][name] is None else f"{place['time'][name]:.1f}" for name in ("median", "q90")),
    ]


def _nothing_below(places: list[dict[str, Any]], test: str) -> str:
    """What it means that no place is significantly below the wanted rate, by the fewest trials of one."""
    fewest = min(p["trials"] for p in places)
    shown = success_rate(fewest, fewest)["min_rate"]
    if shown < WANTED:
        return (
            f"{fewest} trials of a place cannot show that the rate is {100 * WANTED:g} % or more: if all succeed, it"
            f" is at least {100 * shown:.0f} % (exact one-sided bound, 95 %)."
        )
    return f"Nowhere does the first attempt succeed significantly less often than in {100 * WANTED:g} % {test}."


def table_texts(table: dict[str, Any]) -> list[str]:
    """What is to be said of a table."""
    first = table["pooled"]["by_attempt"][0]
    said = [
        COLUMNS_TEXT,
        (
            f"First attempt, all trials: {first['count']} of {table['pooled']['trials']}, {100 * first['rate']:.1f}"
            f" %, at least {100 * first['min_rate']:.1f} % (exact one-sided bound, 95 %)."
        ),
    ]
    below = [f"{p['tilt']:g} deg and {p['clearance']:g} mm" for p in table["rows"] if p["below"]]
    test = f"(exact one-sided tests, Holm-corrected for {len(table['rows'])} places, at {LEVEL:g})"
    said.append(
        f"* The first attempt succeeds in less than {100 * WANTED:g} % {test}: {', '.join(below)}."
        if below
        else _nothing_below(table["rows"], test)
    )
    if failures := table["pooled"]["failures"]:
        said.append(
            f"Not inserted, phase and reason: {', '.join(f'{name} ({count})' for name, count in failures.items())}."
        )
    return said
