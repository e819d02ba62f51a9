"""Emptying of a simulated bin: scan, find, plan, pick, look whether the scene moved, and decide what to do next.

The controller knows what a real one would: clouds, images, and poses with the errors of the cell. The truth is used
only to say what its motions did."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import kr5
import kr5.picking
import numpy as np
from kr5 import picking, sim

from kr5_tools.picking.image_refinement import REFINED_ABOVE, CameraView, refine
from kr5_tools.picking.simulated_bin import CAMERA

CUP = sim.GripOptions()
REPEATS = 6  # images from which the noise is learnt
MOST_CYCLES = 60


@dataclass
class EmptyingOptions:
    """What the cell is like."""

    pose_error: float = 3e-4  # [m] standard deviation of the cell's calibration, in each direction, one draw a bin
    pick_error: float = 1e-4  # [m] of each pick
    camera_height: float = 0.36  # [m]
    image_scale: float = 0.5  # of the book's camera
    camera_rotation_error: float = 5e-4  # [rad] standard deviation about each axis, one draw a bin
    refine: bool = True  # by the image what the cloud does not tell
    friction: float = 0.4


@dataclass
class Step:
    """One decision and what came of it; indices of cylinders are those of the truth."""

    action: str
    text: str
    cycle: int
    target: int | None = None  # of the truth: what was picked or hit
    tip: list[float] | None = None
    approach: list[float] | None = None
    clearance: float | None = None
    success: bool | None = None
    moved: int = 0
    left: int = 0
    found: list[dict[str, Any]] = field(default_factory=list)  # after a scan: what was found
    truth: list[list[float]] = field(default_factory=list)  # centre, axis, radius, height of what is in the bin


@dataclass
class Emptying:
    """A bin emptied as far as it went."""

    seed: int
    pellets: int
    steps: list[Step] = field(default_factory=list)
    picked: int = 0
    attempts: int = 0
    failures: dict[str, int] = field(default_factory=dict)
    scans: int = 0
    shakes: int = 0
    wall_touches: int = 0
    min_clearance: float = np.inf
    vision_time: float = 0.0
    found: int = 0
    refined: int = 0  # cylinders that the image refined
    scan_seconds: list[float] = field(default_factory=list)  # of the moving arm, both passes, a cycle
    vision_seconds: list[float] = field(default_factory=list)  # to find, refine and plan, a cycle
    left: int = 0
    ended: str = ""


class BinRun:
    """One bin with its cell."""

    def __init__(
        self,
        seed: int,
        pile: sim.PelletScene,
        pellets: picking.PelletOptions,
        grasp: picking.GraspOptions,
        scanner: sim.BinScannerOptions,
        options: EmptyingOptions,
    ) -> None:
        self.random = np.random.default_rng(seed)
        self.scene, self.pellets, self.grasp, self.scanner, self.options = pile, pellets, grasp, scanner, options
        self.out = Emptying(seed, len(pile.pellets))
        shape = pile.bin
        self.bin = picking.Bin(T_base_bin=shape.T_base_bin, size=shape.size, wall_thickness=shape.wall)
        self.T_base_camera = np.asarray(sim.camera_above(shape, options.camera_height))
        self.camera = _camera_on(shape, options)
        self.bias = self.random.normal(0, options.pose_error, 3)
        self.T_camera_base = self._believed_camera()
        self.images = 0

    def _believed_camera(self) -> Any:
        """What the calibration says of the camera, with its uncertainty."""
        sigma = np.array([self.options.pose_error] * 3 + [self.options.camera_rotation_error] * 3)
        believed = self.T_base_camera @ np.asarray(kr5.to_pose(self.random.normal(0, 1, 6) * sigma))
        return kr5.UncertainPose(T=believed, covariance=np.diag(np.maximum(sigma, 1e-9) ** 2)).inverse()

    def run(self, progress: Callable[[float], None] | None = None) -> Emptying:
        """Until the bin is empty or a person is needed."""
        idle = 0
        for cycle in range(1, MOST_CYCLES + 1):
            before = self.out.picked
            decision = self._cycle(cycle, idle, progress)
            idle = 0 if self.out.picked > before else idle + 1
            action = str(decision.action)
            if action in ("done", "ask"):
                self.out.ended = decision.reason
                break
            if action == "shake":
                self._shake(cycle, decision.reason)
            else:
                self._note("rescan", decision.reason, cycle)
        self.out.left = len(self.scene.pellets)
        return self.out

    def _cycle(self, cycle: int, idle: int, progress: Callable[[float], None] | None) -> Any:
        """From one scan to the decision that ends it."""
        import time

        cloud = self._scan()
        began = time.perf_counter()
        result = picking.find_pellets(cloud, self.bin, self.pellets)
        found = self._refined(list(result.pellets))
        plan = picking.plan_picks(found, cloud, self.bin, self.grasp)
        self.out.vision_seconds.append(time.perf_counter() - began)
        self.out.vision_time += self.out.vision_seconds[-1]
        self.out.scans += 1
        self.out.found += len(found)
        state = picking.CycleState(
            segmented=len(found),
            graspable=sum(_ready(g) for g in plan),
            empty=str(result.check.finding) == "no_pellets",
            trusted=str(result.check.finding) in ("good", "no_pellets"),
            idle_cycles=idle,
        )
        listed = [
            {
                "centre": p.centre.tolist(),
                "axis": p.axis.tolist(),
                "radius": p.radius,
                "height": p.height,
                "ready": _ready(g),
            }
            for g in plan
            for p in [found[g.pellet]]
        ]
        self._note("scan", f"{len(found)} cylinders found, {state.graspable} can be picked", cycle, found=listed)
        noise = self._image_noise()
        before = self._image()
        while True:
            decision = picking.decide_cycle(state)
            if str(decision.action) != "continue":
                return decision
            best = next(g for g in plan if _ready(g))
            success = self._pick(best, cycle)
            after = self._image()
            change = picking.find_changes(before, after, noise)
            state.trusted = change.usable
            gone = {best.pellet}
            if change.usable:
                T_camera_base = np.asarray(self.T_camera_base.T)
                gone |= set(picking.disturbed_pellets(found, change.changed, self.camera, T_camera_base))
                cloud = picking.remove_changed(cloud, change.changed, self.camera, T_camera_base).cloud
            before = after
            found = [p for i, p in enumerate(found) if i not in gone]
            plan = picking.plan_picks(found, cloud, self.bin, self.grasp)
            state.picked += success
            state.failed += not success
            state.failed_in_row = 0 if success else state.failed_in_row + 1
            state.graspable = state.picked + state.failed + sum(_ready(g) for g in plan)
            state.segmented = max(state.segmented, state.graspable)
            if progress:
                progress(1 - len(self.scene.pellets) / self.out.pellets)

    def _refined(self, found: list[picking.Pellet]) -> list[picking.Pellet]:
        if not self.options.refine or not found:
            return found
        view = CameraView(self._image(), self.camera, self.T_camera_base)
        out, said = refine(found, view, REFINED_ABOVE)
        self.out.refined += sum(s.status == "refined" for s in said)
        return out

    def _scan(self) -> Any:
        """Both passes, there and back with the receiver on the other side, so that no wall hides a strip."""
        points, origins, seconds = [], [], 0.0
        for baseline in (self.scanner.baseline, -self.scanner.baseline):
            scanner = sim.BinScannerOptions(**{**self.scanner.to_dict(), "baseline": baseline})
            scanner.seed = int(self.random.integers(1, 1 << 30))
            scan = sim.scan_bin(self.scene, sim.scan_path(self.scene.bin, scanner), scanner)
            points.append(scan.cloud()[0])
            origins.append(scan.origins())
            seconds += float(np.ptp(scan.times))
        self.out.scan_seconds.append(seconds)
        out = picking.Cloud()
        out.points = kr5.points_from_rows(np.vstack(points))
        out.origins = kr5.points_from_rows(np.vstack(origins))
        return out

    def _image(self) -> np.ndarray:
        self.images += 1
        options = sim.BinImageOptions(seed=self.out.seed * 10_000 + self.images)
        return np.asarray(sim.render_bin(self.scene, self.camera, self.T_base_camera, options)[0])

    def _image_noise(self) -> Any:
        return picking.learn_image_noise([self._image() for _ in range(REPEATS)])

    def _pick(self, g: kr5.picking.Grasp, cycle: int) -> bool:
        """Moves the gripper to where the controller believes the cylinder, and sees what it meets there."""
        T = np.asarray(g.T_base_gripper)
        outwards = -T[:3, 2]
        tip = T[:3, 3] + self.bias + self.random.normal(0, self.options.pick_error, 3)
        clearance = picking.gripper_clearance(tip, outwards, self.grasp.gripper, self.bin)
        self.out.attempts += 1
        self.out.min_clearance = min(self.out.min_clearance, clearance)
        self.out.wall_touches += clearance <= 0
        T_bin_base = np.linalg.inv(np.asarray(self.bin.T_base_bin))
        T_bin_cup = T_bin_base @ np.vstack([np.column_stack([T[:3, :3], tip]), T[3]])
        seat = sim.nearest_cup_seat(self.scene, T_bin_cup)
        common = {"target": seat.pellet, "tip": tip.tolist(), "approach": outwards.tolist(), "clearance": clearance}
        if not seat.sealed(CUP):
            cause = "not sealed" if seat.within_reach(CUP) else "missed"
            self.out.failures[cause] = self.out.failures.get(cause, 0) + 1
            text = f"{cause}: nearest surface {1e3 * seat.distance:.1f} mm from the cup"
            self._note("pick", text, cycle, success=False, **common)
            return False
        pile = sim.PileOptions(friction=self.options.friction)
        removal = sim.remove_pellet(self.scene, seat.pellet, T_bin_base[:3, :3] @ outwards, options=pile)
        self.scene = removal.scene
        moved = len(removal.moved)
        if not removal.removed:
            self.out.failures["slipped"] = self.out.failures.get("slipped", 0) + 1
            self._note("pick", "slipped off the cup", cycle, success=False, moved=moved, **common)
            return False
        self.out.picked += 1
        text = "picked by its end face" if g.on_face else "picked by its side"
        self._note("pick", f"{text}; {moved} others moved", cycle, success=True, moved=moved, **common)
        return True

    def _shake(self, cycle: int, reason: str) -> None:
        """What is left is thrown up and settles anew."""
        self.out.shakes += 1
        size, cell = (
            np.asarray(self.scene.bin.size),
            2.6 * max(np.hypot(p.radius, p.height / 2) for p in self.scene.pellets),
        )
        across = np.maximum((size[:2] // cell).astype(int), 1)
        order = self.random.permutation(len(self.scene.pellets))
        pellets = list(self.scene.pellets)
        for k, i in enumerate(order):
            layer, place = divmod(k, int(across.prod()))
            u, v = divmod(place, int(across[1]))
            centre = (np.array([u, v]) + 0.5) * size[:2] / across - size[:2] / 2
            T = kr5.to_pose(np.array([*centre, (layer + 0.6) * cell, *self.random.normal(0, 1.5, 3)]))
            pellets[i].T_bin_pellet = T
        scene = sim.PelletScene()
        scene.bin, scene.pellets = self.scene.bin, pellets
        self.scene = sim.settle(scene, sim.PileOptions(friction=self.options.friction)).scene
        self._note("shake", reason, cycle)

    def _note(self, action: str, text: str, cycle: int, **more: Any) -> None:
        T = np.asarray(self.scene.bin.T_base_bin)
        truth = []
        for p in self.scene.pellets:
            P = T @ np.asarray(p.T_bin_pellet)
            truth.append([round(float(v), 5) for v in (*P[:3, 3], *P[:3, 2], p.radius, p.height)])
        self.out.steps.append(Step(action, text, cycle, left=len(truth), truth=truth, **more))


def _camera_on(shape: sim.BinShape, options: EmptyingOptions) -> kr5.Pinhole:
    """The book's camera above the middle of the bin; of its image the part that shows the bin, within the rim."""
    scale, size = options.image_scale, np.asarray(shape.size)
    fx, fy, cx, cy = (scale * CAMERA[key] for key in ("fx", "fy", "cx", "cy"))
    half = size[:2] / 2 / (options.camera_height - size[2]) * (fx, fy)
    left, top = max(0, int(cx - half[0])), max(0, int(cy - half[1]))
    right, bottom = min(CAMERA["width"] * scale, cx + half[0]), min(CAMERA["height"] * scale, cy + half[1])
    return kr5.Pinhole(
        width=int(right) - left, height=int(bottom) - top, fx=fx, fy=fy, cx=cx - left, cy=cy - top, k1=CAMERA["k1"]
    )


def _ready(g: kr5.picking.Grasp) -> bool:
    return bool(g.finding == picking.GraspFinding.Graspable)
