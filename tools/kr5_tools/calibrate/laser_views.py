"""Views of a line scanner, of targets that a user names."""

import kr5
from kr5 import calibration

from kr5_tools.calibrate import laser_data


def named_targets(given: list[str], data: laser_data.ScanData) -> list[calibration.ScanTarget]:
    """The targets that the profiles name, each described by one of the texts of --target."""
    if not given:
        raise kr5.InvalidArgument("--target: is missing; what do the profiles show? tip, sphere:RADIUS or plane")
    targets = [laser_data.parse_target(text, k) for k, text in enumerate(given)]
    if not any(data.targets):
        if len(targets) > 1:
            raise kr5.InvalidArgument(
                "--target: several targets need a column target in profiles.csv, or in poses.csv beside profile"
            )
        data.targets = [targets[0].name] * len(data.profiles)
    elif len(targets) == 1 and len(set(data.targets)) == 1 and "=" not in given[0]:
        targets[0].name = data.targets[0]
    if unknown := sorted(set(data.targets) - {t.name for t in targets}):
        raise kr5.InvalidArgument(
            f"--target: the profiles show {', '.join(unknown)}, which is not given; expected NAME=KIND"
        )
    return targets


def find_views(
    data: laser_data.ScanData, targets: list[calibration.ScanTarget]
) -> tuple[list[calibration.ScannerView], list[tuple[str, str]]]:
    """What each profile shows of its target; the profiles that show nothing, and why."""
    by_name = {t.name: t for t in targets}
    views, missed = [], []
    for k, profile in enumerate(data.profiles):
        target = by_name[data.targets[k]]
        options = calibration.ProfileFeatureOptions(radius=target.radius)
        feature = calibration.find_profile_feature(profile, target.kind, options)
        if not feature.fit.usable:
            missed.append((data.names[k], feature.fit.message))
            continue
        view = calibration.ScannerView(
            name=data.names[k], target=target.name, T_base_flange=data.poses[k], feature=feature
        )
        if data.q:
            view.q = data.q[k]
        views.append(view)
    return views, missed
