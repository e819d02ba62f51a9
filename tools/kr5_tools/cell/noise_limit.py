"""The limit above which a gap is not noise."""


def noise_limit(rows: int) -> float:
    """The gap of so many rows that noise alone exceeds once in a thousand columns [-]."""
    from kr5.uncertainty import chi_square_quantile

    return float((chi_square_quantile(0.999, rows) / rows) ** 0.5) if rows else float("inf")
