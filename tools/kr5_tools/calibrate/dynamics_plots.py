"""Plots of designed motions and of gravity models."""

import numpy as np
from kr5.files.result_types import ResultData
from matplotlib.figure import Figure

from kr5_tools.pages.plot_style import BEHIND, BLUE, GREEN, GREY, RED, WIDE, WIDTH, plt

UNITS = {"rad": (180 / np.pi, "deg"), "m": (1e3, "mm")}


def excitation_motion(data: ResultData) -> Figure | None:
    """Joint values of a designed motion over time."""
    result = data.get("result", {})
    if data.get("format") != "kr5-excitation/1":
        return None
    t, q = (np.array(result.get(key, []), float) for key in ("t", "q"))
    if q.ndim != 2 or len(t) != len(q) or not q.size:
        return None
    units = list(result.get("units") or ["rad"] * q.shape[1])
    figure, axes = plt.subplots(figsize=(WIDE, 3.4))
    for k, unit in enumerate(units):
        axes.plot(t, UNITS[unit][0] * q[:, k], linewidth=1.2, label=f"{k + 1}")
    shown = " or ".join(UNITS[unit][1] for unit in UNITS if unit in units)
    axes.set(xlabel="time [s]", ylabel=f"joint value [{shown}]")
    axes.legend(title="joint", ncols=min(6, len(units)), fontsize=8.5)
    return figure


def limit_use(data: ResultData) -> Figure | None:
    """How much of each limit a designed motion uses, joint by joint."""
    result = data.get("result", {})
    parts = [
        (name, np.array(result.get(f"{name}_use") or [], float), colour)
        for name, colour in (("position", GREY), ("speed", BLUE), ("acceleration", GREEN), ("torque", RED))
    ]
    parts = [part for part in parts if part[1].size]
    if data.get("format") != "kr5-excitation/1" or not parts:
        return None
    figure, axes = plt.subplots(figsize=(WIDTH, 3.2))
    joints = np.arange(1, len(parts[0][1]) + 1)
    width = 0.8 / len(parts)
    for k, (name, values, colour) in enumerate(parts):
        axes.bar(joints + (k - (len(parts) - 1) / 2) * width, 100 * values, width, color=colour, label=name)
    axes.axhline(100, color=RED, linewidth=1, linestyle="--")
    axes.set(xlabel="joint", ylabel="of the limit [%]", xticks=joints)
    axes.legend(fontsize=8.5)
    return figure


def condition_history(data: ResultData) -> Figure | None:
    """The condition number over the improvements of a design."""
    values = [v for v in data.get("result", {}).get("condition_after", ()) if v is not None]
    if data.get("format") != "kr5-excitation/1" or len(values) < 2:
        return None
    figure, axes = plt.subplots(figsize=(WIDTH, 3.2))
    axes.step(np.arange(1, len(values) + 1), values, where="post", color=BLUE)
    axes.set(xlabel="improvement", ylabel="condition number [-]", yscale="log")
    return figure


def gravity_overlay(data: ResultData) -> Figure | None:
    """Measured torques of slow motion, those that the model says with friction, and gravity alone; a panel a joint."""
    result = data.get("result", {})
    if data.get("format") != "kr5-gravity/1":
        return None
    t, tau, predicted, gravity = (
        np.array(result.get(key, []), float) for key in ("t", "tau", "predicted", "gravity_torque")
    )
    if tau.ndim != 2 or tau.shape != predicted.shape or tau.shape != gravity.shape or len(t) != len(tau):
        return None
    joints = tau.shape[1]
    figure, panels = plt.subplots(joints, 1, figsize=(WIDE, 1.0 + 1.3 * joints), sharex=True, squeeze=False)
    for k, axes in enumerate(panels[:, 0]):
        axes.plot(t, tau[:, k], label="measured", **BEHIND)
        axes.plot(t, predicted[:, k], color=BLUE, linewidth=1.2, label="predicted")
        axes.plot(t, gravity[:, k], color=RED, linewidth=1.2, linestyle="--", label="gravity")
        axes.set_ylabel(f"{k + 1}")
    panels[0, 0].legend(ncols=3, fontsize=8.5)
    panels[-1, 0].set_xlabel("time [s]")
    figure.supylabel("torque of joint [N m or N]", fontsize=10.5)
    return figure


def joint_springs(data: ResultData) -> Figure | None:
    """Motor minus link angle over the torque, with the law that was found; a panel for each joint that gives way."""
    result = data.get("result", {})
    if data.get("format") != "kr5-elasticity/1":
        return None
    lead, torque = (np.array(result.get(key, []), float) for key in ("lead", "torque"))
    told = [s for s in result.get("joints", ()) if s.get("told") and s.get("joint", 0) <= lead.shape[-1]]
    if lead.ndim != 2 or lead.shape != torque.shape or not told:
        return None
    figure, panels = plt.subplots(1, len(told), figsize=(WIDE, 3.2), squeeze=False)
    for spring, axes in zip(told, panels[0], strict=True):
        k = spring["joint"] - 1
        x = np.linspace(np.nanmin(torque[:, k]), np.nanmax(torque[:, k]), 201)
        law = spring["offset"] + spring["compliance"] * x + 0.5 * spring["gap"] * np.sign(x)
        axes.plot(torque[:, k], 1e3 * lead[:, k], ".", color=GREY, markersize=3)
        axes.plot(x, 1e3 * law, color=BLUE, linewidth=1.2)
        axes.set(title=f"joint {spring['joint']}", xlabel="torque [N m or N]")
    panels[0, 0].set_ylabel("motor minus link [mrad or mm]")
    return figure
