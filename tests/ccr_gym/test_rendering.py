import math
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from gymnasium.error import DependencyNotInstalled

from ccr_gym.rendering import Frame, Renderer, banners, gauge, marks, planar, tile
from ccr_gym.rendering.camera import planar_bounds
from ccr_gym.rendering.canvas import Canvas, import_pygame
from ccr_gym.rendering.marks import scaled_force
from ccr_gym.rendering.page import Page
from ccr_gym.rendering.palette import LAYOUT, PALETTE, Color, contact_color
from ccr_gym.rendering.planar import planar_camera
from ccr_gym.rendering.units import force_unit, length_text, round_ticks
from ccr_gym.rendering.view import View
from solver import PRESETS, Cable, Circle, Equilibrium, HalfPlane, Obstacle, Robot, Scene, Solver
from solver.spatial import Box, HalfSpace, SpatialEquilibrium, SpatialRobot, SpatialSolver, Sphere

SIZE = (640, 640)
DATA = Path(__file__).parents[1] / "data" / "pictures"
PAGE = Page.divide(*SIZE, titled=False, charted=False)
FREE = Circle(center=(90, 40), radius=15)
PUSHED = Circle(center=(50, 150), radius=14)
OPPOSED = (Cable(angle=0.0), Cable(angle=math.pi))


def pulled(obstacles: tuple[Obstacle, ...], cable_mm: float, robot: Robot | None = None) -> Equilibrium:
    solver = Solver(robot or Robot.prototype(model="paper"), Scene(obstacles))
    equilibrium = solver.rest()
    for command in np.linspace(0, cable_mm, 1 + math.ceil(abs(cable_mm) / 0.25))[1:]:
        equilibrium = solver.step(equilibrium, float(command))
    return equilibrium


def bent(solver: Solver | SpatialSolver, cables_mm: list[float], steps: int = 24) -> Equilibrium | SpatialEquilibrium:
    equilibrium = solver.rest()
    for part in np.linspace(0, 1, steps + 1)[1:]:
        equilibrium = solver.step(equilibrium, (part * np.array(cables_mm)).tolist())
    return equilibrium


def frame_of(equilibrium: Equilibrium, force: tuple[float, float] = (0.0, 0.0), desired: float = 0.1) -> Frame:
    return Frame(equilibrium, np.array(force), 0.8 * np.array(force), desired, 0.2)


def full_frame(equilibrium: Equilibrium | SpatialEquilibrium, scale: float = 0.5, steps: int = 40) -> Frame:
    """A frame with all that a frame can show."""
    force = equilibrium.forces.sum(axis=0)
    ramp = np.linspace(0, 1, steps)
    size, desired = float(np.linalg.norm(force)), 0.3 * scale
    return Frame(
        equilibrium,
        force,
        0.7 * force,
        desired,
        scale,
        desired_history=desired * (1 + 0.5 * (ramp > 0.5)),
        true_history=size * ramp**2,
        estimate_history=0.7 * size * ramp**2,
        title="CCR/Picture-v1",
        step=steps,
        reward=-0.25,
    )


def count(picture: np.ndarray, color: Color, tolerance: int = 3) -> int:
    return int((np.abs(picture.astype(int) - color).max(axis=-1) <= tolerance).sum())


def mask(picture: np.ndarray, color: Color) -> np.ndarray:
    return np.asarray(np.abs(picture.astype(int) - color).max(axis=-1) <= 3)


def pixel(equilibrium: Equilibrium, point_mm: tuple[float, float]) -> tuple[int, int]:
    x, y = planar_camera(equilibrium, PAGE.world)(point_mm)
    return round(y), round(x)


@pytest.fixture(scope="module")
def free() -> Equilibrium:
    return pulled((FREE,), 3.0)


@pytest.fixture(scope="module")
def touching() -> Equilibrium:
    equilibrium = pulled((PUSHED,), 8.0)
    assert equilibrium.contact.any()
    return equilibrium


@pytest.fixture
def renderer(monkeypatch: pytest.MonkeyPatch) -> Renderer:
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "SDL_VIDEODRIVER"):
        monkeypatch.delenv(name, raising=False)
    return Renderer(fps=1000, size=SIZE)


@pytest.mark.parametrize("size", [(640, 640), (320, 240), (200, 500), (1001, 333)])
def test_picture_is_height_by_width_rgb(free: Equilibrium, size: tuple[int, int]) -> None:
    for frame in (frame_of(free), full_frame(free)):
        picture = Renderer(fps=30, size=size).draw(frame)
        assert picture.shape == (size[1], size[0], 3)
        assert picture.dtype == np.uint8
        assert picture.flags.owndata
        assert picture.flags.c_contiguous
        assert picture.std() > 10


def test_same_frame_gives_same_pixels(renderer: Renderer, touching: Equilibrium) -> None:
    frame = frame_of(touching, (-0.05, 0.05))
    first = renderer.draw(frame)
    np.testing.assert_array_equal(renderer.draw(frame), first)
    np.testing.assert_array_equal(Renderer(fps=30, size=SIZE).draw(frame), first)


def test_pictures_are_separate_arrays(renderer: Renderer, free: Equilibrium, touching: Equilibrium) -> None:
    first = renderer.draw(frame_of(free))
    kept = first.copy()
    renderer.draw(frame_of(touching))
    np.testing.assert_array_equal(first, kept)


# ---------------------------------------------------------------------------------------------------- scaling law


def planar_scene(s: float) -> Equilibrium:
    robot = Robot(length_mm=180 * s, segments=18, offset_mm=8 * s, rigidity=5000 * s**2, cables=OPPOSED)
    obstacles = [
        Circle(center=(50 * s, 130 * s), radius=14 * s, spring=0.02 / s),
        HalfPlane(point=(70 * s, 120 * s), normal=(-1, 0), nodes=(17,)),
    ]
    return bent(Solver(robot, Scene(obstacles)), [9 * s, -9 * s])


def inserted_scene(s: float) -> Equilibrium:
    lengths = (140 * s, 180 * s)
    robot = Robot(
        length_mm=160 * s, segments=18, offset_mm=8 * s, rigidity=5000 * s**2, length_range_mm=lengths, model="paper"
    )
    return bent(Solver(robot, Scene([HalfPlane(point=(40 * s, 90 * s), normal=(-1, 0.2))])), [8 * s])


def spatial_scene(s: float) -> SpatialEquilibrium:
    robot = SpatialRobot.preset("three_cables", length_mm=180 * s, offset_mm=8 * s, rigidity=5000 * s**2)
    obstacles = [
        Sphere(center=(50 * s, -10 * s, 120 * s), radius=15 * s),
        HalfSpace(point=(0, 60 * s, 0), normal=(0, -1, 0.1)),
    ]
    return bent(SpatialSolver(robot, Scene(obstacles)), [9 * s, -4.5 * s, -4.5 * s])


@pytest.mark.parametrize("s", [2.0, 0.125, 0.1, 10.0])
@pytest.mark.parametrize("scene", [planar_scene, inserted_scene, spatial_scene])
def test_scaled_robot_gives_the_same_pixels_but_for_the_lengths_written(
    renderer: Renderer,
    monkeypatch: pytest.MonkeyPatch,
    scene: Callable[[float], Equilibrium | SpatialEquilibrium],
    s: float,
) -> None:
    one, other = scene(1.0), scene(s)
    assert one.contact.any()
    assert (renderer.draw(full_frame(one)) != renderer.draw(full_frame(other))).any()
    for module in (banners, marks, planar):
        monkeypatch.setattr(module, "length_text", lambda *_, **__: "")
    np.testing.assert_array_equal(renderer.draw(full_frame(one)), renderer.draw(full_frame(other)))


# --------------------------------------------------------------------------------------------------------- units


@pytest.mark.parametrize(
    ("length_mm", "text"), [(18, "18 mm"), (1800, "1800 mm"), (0.3, "0.3 mm"), (-2.5, "−2.5 mm"), (1e-5, "1.00e−05 mm")]
)
def test_lengths_are_written_with_digits_for_their_size(length_mm: float, text: str) -> None:
    assert length_text(length_mm) == text


def test_displacements_are_written_to_a_resolution() -> None:
    assert length_text(3.14159, 0.01) == "3.14 mm"
    assert length_text(-0.001, 0.01, unit=False) == "0.00"
    assert banners.cables_text(np.array([0.5, -0.25]), banners.displacement_digits(0.7)) == "cables 0.500, −0.250 mm"
    assert (
        banners.cables_text(np.linspace(-3, 3, 8), banners.displacement_digits(8)) == "8 cables from −3.00 to 3.00 mm"
    )


@pytest.mark.parametrize(("scale", "name"), [(5.0, "N"), (2.0, "N"), (0.5, "mN"), (0.01, "mN"), (1e-4, "µN")])
def test_unit_of_force_follows_the_scale(scale: float, name: str) -> None:
    assert force_unit(scale).name == name


def test_forces_are_written_with_digits_for_their_scale() -> None:
    assert force_unit(0.5).text(0.0957, 0.5) == "95.7"
    assert force_unit(0.05).text(0.0257, 0.05) == "25.70"
    assert force_unit(10.0).text(5.083, 10.0) == "5.08"
    assert force_unit(10.0).text(math.nan, 10.0) == "?"


@pytest.mark.parametrize("scale", [1.0, 150.0, 738.0, 0.23, 3.0e-4])
def test_ticks_are_round_and_within_the_scale(scale: float) -> None:
    ticks = round_ticks(scale, 6)
    assert 3 <= len(ticks) <= 7
    assert ticks[0] == 0
    assert ticks[-1] <= scale * (1 + 1e-9)
    mantissa = ticks[1] / 10 ** math.floor(math.log10(ticks[1]) + 1e-9)
    assert min(abs(mantissa - step) for step in (1, 2, 5)) < 1e-9


# -------------------------------------------------------------------------------------------------------- camera


def test_view_is_of_one_side_or_both() -> None:
    one, both = planar_bounds(Robot.prototype()), planar_bounds(Robot.prototype(cables=OPPOSED))
    left = planar_bounds(Robot.prototype(cables=(Cable(angle=math.pi),)))
    assert both.left == -both.right
    assert one.right == both.right
    assert one.left > both.left
    assert (left.left, left.right) == (-one.right, -one.left)


@pytest.mark.parametrize("name", PRESETS)
@pytest.mark.parametrize("ways", [(1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)])
def test_planar_presets_stay_in_frame(name: str, ways: tuple[float, float]) -> None:
    robot = Robot.preset(name, max_tension=math.inf)
    sections = (len(robot.cables) + 1) // 2
    pulls = [
        0.5
        * robot.offset_mm
        * math.pi
        * ways[min(index // 2, sections - 1)]
        * math.copysign(1, math.cos(cable.angle))
        * (1 if cable.offset_mm is None else cable.offset_mm / robot.offset_mm)
        / sections
        for index, cable in enumerate(robot.cables)
    ]
    pulls = [max(pull, robot.least_cable_mm) for pull in pulls]
    equilibrium = bent(Solver(robot, Scene([])), pulls)
    world = PAGE.world
    points = planar_camera(equilibrium, world)(equilibrium.pulled.reshape(-1, 2))
    assert (points.min(axis=0) >= (world.left, world.top)).all()
    assert (points.max(axis=0) <= (world.right, world.bottom)).all()


@pytest.mark.parametrize("turn", range(8))
@pytest.mark.parametrize("name", ["three_cables", "snake_arm", "guidewire"])
def test_robot_and_obstacle_stay_in_frame_in_all_directions(name: str, turn: int) -> None:
    robot = SpatialRobot.preset(name, max_tension=math.inf)
    azimuth, length = turn * math.pi / 4, robot.longest_mm
    pulls = [0.9 * robot.offset_mm * math.cos(cable.angle - azimuth) for cable in robot.cables]
    center = (0.4 * length * math.cos(azimuth), 0.4 * length * math.sin(azimuth), 0.6 * length)
    sphere = Sphere(center=center, radius=0.12 * length)
    equilibrium = bent(SpatialSolver(robot, Scene([sphere])), pulls)
    world = Page.divide(*SIZE, titled=True, charted=True).world
    shown = View.fit(equilibrium, world)(np.vstack([equilibrium.nodes, sphere.outline().reshape(-1, 3)]))
    assert (shown.min(axis=0) >= (world.left, world.top)).all()
    assert (shown.max(axis=0) <= (world.right, world.bottom)).all()


def test_view_grows_for_an_obstacle_that_can_be_reached_only() -> None:
    def width(x: float) -> float:
        equilibrium = pulled((Circle(center=(x, 60), radius=20),), 0.5)
        return 1 / planar_camera(equilibrium, PAGE.world).scale

    assert width(150.0) > width(60.0)
    assert width(400.0) == width(60.0)


# --------------------------------------------------------------------------------------------------------- plane


def test_circle_is_drawn_at_its_position(renderer: Renderer, free: Equilibrium) -> None:
    picture = renderer.draw(frame_of(free))
    (x, y), radius = FREE.center, FREE.radius
    for across, up in ((0, 0), (0.8, 0), (-0.8, 0), (0, 0.8), (0, -0.8)):
        assert tuple(picture[pixel(free, (x + across * radius, y + up * radius))]) == PALETTE.obstacle
    assert tuple(picture[pixel(free, (x + 1.3 * radius, y + 3))]) != PALETTE.obstacle
    area = np.pi * (radius * planar_camera(free, PAGE.world).scale - LAYOUT.outline) ** 2
    assert count(picture, PALETTE.obstacle) == pytest.approx(area, rel=0.05)


def test_backbone_runs_through_its_nodes(renderer: Renderer, free: Equilibrium) -> None:
    picture = renderer.draw(frame_of(free))
    for x, y in free.nodes[1:-1, :2]:
        assert tuple(picture[pixel(free, (x, y))]) == PALETTE.backbone


def test_backbone_of_a_rod_is_drawn_as_arcs(renderer: Renderer) -> None:
    robot = Robot(length_mm=100, segments=2, offset_mm=10)
    equilibrium = pulled((), 15.0, robot)
    turn = -equilibrium.nodes[1, 2]
    radius = 50 / turn
    middle = radius * (1 - math.cos(turn / 2)), radius * math.sin(turn / 2)
    picture = renderer.draw(frame_of(equilibrium))
    assert tuple(picture[pixel(equilibrium, middle)]) == PALETTE.backbone
    assert tuple(picture[pixel(equilibrium, tuple(0.5 * equilibrium.nodes[1, :2]))]) != PALETTE.backbone


def test_wall_fills_its_side_only(renderer: Renderer) -> None:
    equilibrium = pulled((HalfPlane(point=(80, 100), normal=(-1, 0)),), 1.0)
    picture = renderer.draw(frame_of(equilibrium))
    column = pixel(equilibrium, (80, 0))[1]
    assert count(picture[:, column + 4 :], PALETTE.obstacle) > 20_000
    assert count(picture[:, : column - 4], PALETTE.obstacle, 0) == 0
    assert count(picture, PALETTE.hatch, 12) > 1000


def test_load_cell_is_a_short_pad_at_what_it_stops(renderer: Renderer) -> None:
    cell = HalfPlane(point=(26, 127), normal=(-1, 0), nodes=(14,))
    equilibrium = pulled((cell,), 1.0)
    height = equilibrium.cable_nodes[14, 1]  # the cable's point is nearer to the load cell than the backbone's
    pad = mask(renderer.draw(frame_of(equilibrium)), PALETTE.clamp)[:, pixel(equilibrium, (27.5, height))[1]]
    rows = np.flatnonzero(pad)
    assert rows.mean() == pytest.approx(pixel(equilibrium, (27.5, height))[0], abs=1.5)
    assert np.ptp(rows) / planar_camera(equilibrium, PAGE.world).scale < 1.5 * equilibrium.robot.segment_mm


def test_notes_say_what_is_stopped_and_how_far_a_spring_gave_way() -> None:
    assert marks.obstacle_notes(FREE, 0.0) == []
    assert marks.obstacle_notes(replace(FREE, nodes=(14,)), 0.0) == ["stops node 14 only"]
    assert marks.obstacle_notes(replace(FREE, nodes=(3, 4, 5, 6)), 0.0) == ["stops nodes 3–6 only"]
    assert marks.obstacle_notes(replace(FREE, nodes=(3, 4, 5, 9)), 0.0) == ["stops 4 nodes only"]
    assert marks.obstacle_notes(replace(FREE, spring=0.1), 2.5) == ["on a spring, moved 2.5 mm"]


def test_spring_and_rest_place_of_a_sprung_obstacle(renderer: Renderer) -> None:
    soft, hard = (pulled((replace(PUSHED, spring=spring),), 8.0) for spring in (0.004, None))
    pictures = [renderer.draw(frame_of(equilibrium)) for equilibrium in (soft, hard)]
    assert np.linalg.norm(soft.displacements[0]) > 3
    assert count(pictures[0], PALETTE.spring) > 100
    assert count(pictures[1], PALETTE.spring) == 0
    (x, y), radius = soft.scene_now.obstacles[0].center, PUSHED.radius
    assert tuple(pictures[0][pixel(soft, (x + 0.9 * radius, y))]) == PALETTE.obstacle


@pytest.mark.parametrize("spatial", [False, True])
def test_way_of_an_obstacle_that_has_moved_since_the_start(renderer: Renderer, spatial: bool) -> None:
    if spatial:
        scenes = [Scene([Sphere(center=(60, y, 120), radius=14)]) for y in (-30, 40)]
        equilibrium = SpatialSolver(SpatialRobot.prototype(), scenes[0]).rest()
    else:
        scenes = [Scene([Circle(center=(x, 130), radius=14)]) for x in (60, 100)]
        equilibrium = Solver(Robot.prototype(), scenes[0]).rest()
    frame = frame_of(equilibrium, (0.0, 0.0))
    same, moved = (renderer.draw(replace(frame, start_scene=scene)) for scene in scenes)
    np.testing.assert_array_equal(same, renderer.draw(frame))
    assert 50 < (moved != same).any(axis=2).sum() < 3000


def test_inserted_length_is_shown_at_the_base(renderer: Renderer) -> None:
    robot = Robot(length_mm=150, segments=18, offset_mm=8, length_range_mm=(140.0, 180.0))
    below = []
    for length in (145.0, 175.0):
        equilibrium = Solver(robot.at(length), Scene([])).rest()
        row, column = pixel(equilibrium, (0.0, 0.0))
        below.append(int(mask(renderer.draw(frame_of(equilibrium))[row:], PALETTE.backbone)[:, column].sum()))
    assert below[0] > below[1] + 50


def test_taut_cables_are_darker_than_slack_ones_and_end_at_their_disks(renderer: Renderer) -> None:
    robot = Robot.prototype(cables=(Cable(), Cable(angle=math.pi, end=9)))
    equilibrium = bent(Solver(robot, Scene([])), [6.0, -9.0])
    assert equilibrium.tensions[0] > 0
    assert equilibrium.tensions[1] == 0
    picture = renderer.draw(frame_of(equilibrium))
    world = picture[int(PAGE.world.top) : int(PAGE.world.bottom), : int(PAGE.world.right)]
    taut, slack = (np.argwhere(mask(world, color))[:, 0] for color in (PALETTE.cable, PALETTE.slack))
    top, ends = PAGE.world.top, (18, 9)
    for rows, end in zip((taut, slack), ends, strict=True):
        assert rows.min() + top == pytest.approx(
            pixel(equilibrium, tuple(equilibrium.pulled[ends.index(end), end]))[0], abs=5
        )


# ------------------------------------------------------------------------------------------- contacts and forces


def test_markers_and_arrows_only_in_contact(renderer: Renderer, free: Equilibrium, touching: Equilibrium) -> None:
    world = np.s_[int(PAGE.world.top) : int(PAGE.world.bottom), : int(PAGE.world.right)]
    force = (-0.05, 0.05)
    apart, together = renderer.draw(frame_of(free, force))[world], renderer.draw(frame_of(touching, force))[world]
    for color in (PALETTE.force_true, PALETTE.force_est):
        assert count(together, color) > count(apart, color) + 10


def test_contact_is_darker_the_larger_its_force(renderer: Renderer, touching: Equilibrium) -> None:
    force = float(touching.energy_scale * touching.multipliers.max())
    frame = frame_of(touching)
    for scale in (0.3 * force, 4 * force):
        picture = renderer.draw(replace(frame, force_scale=scale))
        world = picture[int(PAGE.world.top) : int(PAGE.world.bottom), : int(PAGE.world.right)]
        assert count(world, contact_color(force / scale), 1) > 20
    brightness = [sum(contact_color(part)) for part in (0.0, 0.1, 0.3, 0.7, 1.0)]
    assert brightness == sorted(brightness, reverse=True)


def test_arrow_is_the_reaction_on_the_obstacle(renderer: Renderer, touching: Equilibrium) -> None:
    def middle(force: tuple[float, float]) -> np.ndarray:
        frame = replace(frame_of(touching, force), force_est=np.zeros(2))
        around = renderer.draw(frame)[60:, : int(PAGE.world.right)]
        return np.asarray(np.argwhere(mask(around, PALETTE.force_true)).mean(axis=0))

    (right_row, right_column), (left_row, left_column) = middle((-0.1, 0.0)), middle((0.1, 0.0))
    assert right_column > left_column + 20
    assert right_row == pytest.approx(left_row, abs=8)
    assert middle((0.0, 0.1))[0] > middle((0.0, -0.1))[0] + 20


def test_both_arrows_can_be_read_where_they_are_parallel(renderer: Renderer, touching: Equilibrium) -> None:
    frame = replace(frame_of(touching, (-0.1, 0.0)), force_est=np.array([-0.1, 0.0]))
    world = renderer.draw(frame)[60 : int(PAGE.world.bottom), : int(PAGE.world.right)]
    true, estimate = (np.argwhere(mask(world, color)) for color in (PALETTE.force_true, PALETTE.force_est))
    for pixels in (true, estimate):
        assert np.ptp(pixels[:, 1]) > 0.35 * LAYOUT.arrow_part * 180 * planar_camera(touching, PAGE.world).scale
    assert abs(true[:, 0].mean() - estimate[:, 0].mean()) > 3


def test_arrow_starts_at_the_target(renderer: Renderer) -> None:
    obstacles = (Circle(center=(24, 85), radius=13), Circle(center=(60, 138), radius=14))
    equilibrium = pulled(obstacles, 10.0)
    assert equilibrium.contact.any(axis=(1, 2)).all()
    rows = []
    for target in (0, 1):
        frame = replace(frame_of(equilibrium, (-0.1, 0.0)), target=target)
        world = renderer.draw(frame)[60 : int(PAGE.world.bottom), : int(PAGE.world.right)]
        rows.append(60 + np.argwhere(mask(world, PALETTE.force_true))[:, 0].mean())
    touched = [equilibrium.points[equilibrium.contact[target]].mean(axis=0) for target in (0, 1)]
    for row, point in zip(rows, touched, strict=True):
        assert row == pytest.approx(pixel(equilibrium, tuple(point))[0], abs=20)


@pytest.mark.parametrize(
    ("force", "length"), [(0.1, 0.5), (0.2, 1.0), (5.0, LAYOUT.arrow_reach), (np.inf, 0), (0.0, 0)]
)
def test_arrow_length_follows_the_scale_and_is_limited(force: float, length: float) -> None:
    np.testing.assert_allclose(scaled_force(np.array([0.0, force]), 0.2), [0, length], atol=1e-12)


def test_non_finite_forces_are_not_drawn(renderer: Renderer, touching: Equilibrium) -> None:
    frame = full_frame(touching)
    for value in (np.nan, np.inf):
        history = np.full(5, value)
        renderer.draw(replace(frame, force_est=np.array([value, 0.0]), estimate_history=history))


# ------------------------------------------------------------------------------------------------ gauge and chart


def test_gauge_follows_the_desired_force(renderer: Renderer, free: Equilibrium) -> None:
    region = gauge.gauge_region(PAGE.panel)

    def goal_row(desired: float) -> float:
        picture = renderer.draw(frame_of(free, desired=desired))[: int(region.bottom) + 6, -50:]
        return float(np.flatnonzero(mask(picture[int(PAGE.panel.top) :], PALETTE.desired).any(axis=1)).mean())

    low, middle, full, beyond = (goal_row(force) for force in (0.0, 0.1, 0.2, 9.0))
    assert low - middle == pytest.approx(region.height / 2, abs=1)
    assert low - full == pytest.approx(region.height, abs=1)
    assert beyond == full


def test_gauge_bars_follow_the_forces(renderer: Renderer, free: Equilibrium) -> None:
    region = gauge.gauge_region(PAGE.panel)

    def bars(force: float) -> list[int]:
        picture = renderer.draw(frame_of(free, (force, 0.0), desired=0.2))[: int(region.bottom) + 1, -60:]
        return [count(picture[int(region.top) :], color) for color in (PALETTE.force_true, PALETTE.force_est)]

    full = LAYOUT.gauge_bar * region.height
    assert bars(0.0) == [0, 0]
    assert bars(0.1) == [pytest.approx(0.5 * full, rel=0.1), pytest.approx(0.4 * full, rel=0.1)]


@pytest.mark.parametrize("limit", [15.0, math.inf])
def test_tension_of_every_cable_is_shown(renderer: Renderer, limit: float) -> None:
    robot = Robot.prototype(cables=OPPOSED, max_tension=limit)
    equilibrium = bent(Solver(robot, Scene([])), [6.0, -6.0])
    panel = renderer.draw(frame_of(equilibrium))[int(PAGE.panel.bottom - gauge.TENSIONS) :, int(PAGE.panel.left) :]
    assert count(panel, PALETTE.cable) > 100
    assert 5 < count(panel, PALETTE.slack) < 100
    assert (count(panel, PALETTE.contact) > 50) == math.isfinite(limit)


def test_chart_is_drawn_only_if_a_history_is_given(renderer: Renderer, touching: Equilibrium) -> None:
    assert Page.divide(*SIZE, titled=False, charted=False).chart.height == 0
    plain = frame_of(touching, (-0.05, 0.05))
    np.testing.assert_array_equal(renderer.draw(replace(plain, true_history=np.empty(0))), renderer.draw(plain))
    chart = Page.divide(*SIZE, titled=False, charted=True).chart
    rows = np.s_[int(chart.top) + 2 : int(chart.bottom) - 2, : int(chart.right)]
    for name, color in (
        ("desired_history", PALETTE.desired),
        ("true_history", PALETTE.force_true),
        ("estimate_history", PALETTE.force_est),
    ):
        picture = renderer.draw(replace(plain, **{name: np.linspace(0, 0.2, 50)}))[rows]
        lines = np.argwhere(mask(picture, color))
        assert np.ptp(lines[:, 1]) > 0.7 * (chart.width - 110)
        assert np.ptp(lines[:, 0]) > 0.8 * (chart.height - 36)


@pytest.mark.parametrize("steps", [1, 64, 200])
def test_chart_holds_histories_of_any_length(renderer: Renderer, touching: Equilibrium, steps: int) -> None:
    renderer.draw(full_frame(touching, steps=steps))


# --------------------------------------------------------------------------------------------------------- space


def test_what_is_behind_an_obstacle_is_hidden(renderer: Renderer) -> None:
    robot = SpatialRobot.prototype()
    pictures = []
    for azimuth in (-60, 120):  # towards the viewer, and away
        x, y = 35 * math.cos(math.radians(azimuth)), 35 * math.sin(math.radians(azimuth))
        equilibrium = SpatialSolver(robot, Scene([Sphere(center=(x, y, 90), radius=22)])).rest()
        view = View.fit(equilibrium, PAGE.world)
        hidden = view.hidden_by(equilibrium.nodes)
        pictures.append(hidden.any())
    assert pictures == [True, False]


def test_colors_fade_with_distance() -> None:
    equilibrium = SpatialSolver(SpatialRobot.prototype(), Scene([])).rest()
    view = View.fit(equilibrium, PAGE.world)
    near, far = (view.faded(PALETTE.backbone, point) for point in ((50, -80, 0), (-50, 80, 0)))
    assert sum(near) < sum(far)


def test_labels_are_not_cut() -> None:
    pygame = import_pygame()
    blank = Canvas(pygame, SIZE).finish()
    background = pygame.surfarray.array3d(blank)
    for at in ((-50, -50), (700, 700), (640, 0)):
        canvas = Canvas(pygame, SIZE)
        canvas.label("inserted", at, PALETTE.ink, within=canvas.region)
        pixels = (pygame.surfarray.array3d(canvas.finish()) != background).any(axis=2)
        columns = np.flatnonzero(pixels.any(axis=1))
        assert np.ptp(columns) == pytest.approx(canvas.text_width("inserted"), abs=4)


# ---------------------------------------------------------------------------------------------------- golden images


def golden_frames() -> dict[str, Frame]:
    snake = Robot.preset("snake_arm")
    arm = bent(Solver(snake, Scene([Circle(center=(300, 720), radius=70)])), [10.0, -10.0, 4.0, -4.0])
    endoscope = SpatialRobot.preset("neuroendoscope")
    pulls = [0.35 * math.cos(cable.angle + 0.8) for cable in endoscope.cables]
    sphere, box = Sphere(center=(13, -13, 42), radius=5), Box(center=(-15, 8, 20), sizes=(8, 8, 12), edge=1)
    scope = bent(SpatialSolver(endoscope, Scene([sphere, box])), pulls)
    return {
        "load_cell": full_frame(pulled((HalfPlane(point=(30, 127), normal=(-1, 0), nodes=(14,)),), 6.5), 0.1),
        "spring_two_cables": full_frame(planar_scene(1.0)),
        "insertion": full_frame(inserted_scene(1.0)),
        "snake_arm": full_frame(arm, 5.0),
        "neuroendoscope_in_space": full_frame(scope, 0.5),
    }


def golden_picture(name: str) -> np.ndarray:
    return Renderer(fps=30, size=(360, 360)).draw(golden_frames()[name])


@pytest.mark.parametrize("name", [path.stem for path in sorted(DATA.glob("*.png"))])
def test_picture_is_as_recorded(name: str) -> None:
    """Letters and rims may differ with the versions of SDL and FreeType; a part that is missing or moved may not."""
    pygame = import_pygame()
    golden = pygame.surfarray.array3d(pygame.image.load(DATA / f"{name}.png")).transpose(1, 0, 2)
    difference = np.abs(golden_picture(name).astype(int) - golden).max(axis=-1)
    assert difference.mean() < 1.0
    assert (difference > 48).mean() < 0.005


def test_every_picture_is_recorded() -> None:
    assert {path.stem for path in DATA.glob("*.png")} == set(golden_frames())


# ----------------------------------------------------------------------------------------------------------- grid


def test_tile_puts_the_first_nine_in_a_grid() -> None:
    pictures = [np.full((20, 30, 3), index, np.uint8) for index in range(12)]
    grid = tile(pictures)
    assert grid.dtype == np.uint8
    assert grid.shape == (3 * 20 + 4, 3 * 30 + 4, 3)
    assert [int(grid[22 * row + 10, 32 * column + 10, 0]) for row in range(3) for column in range(3)] == list(range(9))
    assert tile(pictures[:5]).shape == (2 * 20 + 2, 3 * 30 + 4, 3)
    np.testing.assert_array_equal(tile(pictures[:1]), pictures[0])


def test_tile_needs_pictures_of_one_size() -> None:
    for pictures in ([], [np.zeros((4, 4, 3), np.uint8), np.zeros((4, 5, 3), np.uint8)]):
        with pytest.raises(ValueError, match="at least one picture"):
            tile(pictures)


# --------------------------------------------------------------------------------------------------------- window


def test_window_shows_the_picture(monkeypatch: pytest.MonkeyPatch, free: Equilibrium) -> None:
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    import pygame

    renderer = Renderer(fps=1000, size=SIZE)
    frame = frame_of(free)
    for _ in range(2):
        renderer.show(frame)
    window = pygame.display.get_surface()
    assert window is not None
    np.testing.assert_array_equal(pygame.surfarray.array3d(window).transpose(1, 0, 2), renderer.draw(frame))
    renderer.close()
    renderer.close()
    assert not pygame.display.get_init()
    renderer.show(frame)
    renderer.close()


def test_window_closes_when_the_user_closes_it(monkeypatch: pytest.MonkeyPatch, free: Equilibrium) -> None:
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    import pygame

    renderer = Renderer(fps=1000, size=(64, 64))
    frame = frame_of(free)
    renderer.show(frame)
    pygame.event.post(pygame.event.Event(pygame.QUIT))
    for _ in range(3):
        renderer.show(frame)
        assert not pygame.display.get_init()
    assert renderer.draw(frame).shape == (64, 64, 3)
    renderer.close()
    renderer.show(frame)
    assert pygame.display.get_init()
    renderer.close()


def test_closing_one_renderer_keeps_the_others(monkeypatch: pytest.MonkeyPatch, free: Equilibrium) -> None:
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    first, second = Renderer(fps=1000, size=SIZE), Renderer(fps=1000, size=(300, 300))
    first.show(frame_of(free))
    second.show(frame_of(free))
    first.close()
    second.show(frame_of(free))
    second.close()
    assert first.draw(frame_of(free)).shape == (640, 640, 3)


def test_window_keeps_its_frame_rate(monkeypatch: pytest.MonkeyPatch, free: Equilibrium) -> None:
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    from time import perf_counter

    renderer = Renderer(fps=10, size=(64, 64))
    renderer.show(frame_of(free))
    start = perf_counter()
    for _ in range(3):
        renderer.show(frame_of(free))
    renderer.close()
    assert perf_counter() - start > 0.25


def test_drawing_opens_no_display(renderer: Renderer, free: Equilibrium) -> None:
    import pygame

    renderer.draw(frame_of(free))
    assert not pygame.display.get_init()
    renderer.close()


def test_importing_the_module_does_not_import_pygame() -> None:
    code = "import sys, ccr_gym.rendering; sys.exit('pygame' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_first_import_is_silent_with_warnings_as_errors() -> None:
    code = "from ccr_gym.rendering import Renderer; Renderer(30)"
    done = subprocess.run([sys.executable, "-W", "error", "-c", code], check=False, capture_output=True, text=True)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


def test_missing_pygame_names_the_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pygame", None)
    with pytest.raises(DependencyNotInstalled, match=r'pip install "ccr-gym\[render\]"'):
        Renderer(fps=30)


if __name__ == "__main__":  # records the pictures anew
    for recorded in golden_frames():
        surface = import_pygame().surfarray.make_surface(golden_picture(recorded).transpose(1, 0, 2))
        import_pygame().image.save(surface, DATA / f"{recorded}.png")
