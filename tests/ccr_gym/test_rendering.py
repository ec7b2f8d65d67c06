import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from gymnasium.error import DependencyNotInstalled

from ccr_gym.rendering import Frame, Renderer
from ccr_gym.rendering.camera import Camera
from ccr_gym.rendering.palette import LAYOUT, PALETTE
from ccr_gym.rendering.planar import reaction_arrow
from solver import Circle, Equilibrium, HalfPlane, Obstacle, Robot, Scene, Solver

SIZE = (640, 640)
FREE = Circle(center=(90, 40), radius=15)
PUSHED = Circle(center=(50, 150), radius=14)


def pulled(obstacles: tuple[Obstacle, ...], cable_mm: float) -> Equilibrium:
    solver = Solver(Robot.prototype(model="paper"), Scene(obstacles))
    equilibrium = solver.rest()
    for command in np.arange(0.25, cable_mm + 1e-9, 0.25):
        equilibrium = solver.step(equilibrium, float(command))
    return equilibrium


def frame_of(equilibrium: Equilibrium, force: tuple[float, float] = (0.0, 0.0), desired: float = 0.1) -> Frame:
    return Frame(equilibrium, np.array(force), 0.8 * np.array(force), desired, 0.2)


def count(picture: np.ndarray, color: tuple[int, int, int], tolerance: int = 3) -> int:
    return int((np.abs(picture.astype(int) - color).max(axis=-1) <= tolerance).sum())


def pixel(point_mm: tuple[float, float]) -> tuple[int, int]:
    x, y = Camera.fit(SIZE[0] - LAYOUT.panel, SIZE[1] - LAYOUT.footer)(point_mm)
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
    picture = Renderer(fps=30, size=size).draw(frame_of(free))
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


def test_circle_is_drawn_at_its_position(renderer: Renderer, free: Equilibrium) -> None:
    picture = renderer.draw(frame_of(free))
    (x, y), radius = FREE.center, FREE.radius
    for across, up in ((0, 0), (0.8, 0), (-0.8, 0), (0, 0.8), (0, -0.8)):
        assert tuple(picture[pixel((x + across * radius, y + up * radius))]) == PALETTE.obstacle
    assert tuple(picture[pixel((x + 1.3 * radius, y + 3))]) != PALETTE.obstacle
    scale = Camera.fit(SIZE[0] - LAYOUT.panel, SIZE[1] - LAYOUT.footer).scale
    area = np.pi * (radius * scale - LAYOUT.outline) ** 2
    assert count(picture, PALETTE.obstacle) == pytest.approx(area, rel=0.05)


def test_backbone_runs_through_its_nodes(renderer: Renderer, free: Equilibrium) -> None:
    picture = renderer.draw(frame_of(free))
    for x, y in free.nodes[1:-1, :2]:
        assert tuple(picture[pixel((x, y))]) == PALETTE.backbone


def test_wall_fills_its_side_only(renderer: Renderer) -> None:
    wall = HalfPlane(point=(80, 100), normal=(-1, 0))
    picture = renderer.draw(frame_of(pulled((wall,), 1.0)))
    column = pixel((80, 0))[1]
    assert count(picture[:, column + 4 :], PALETTE.obstacle) > 20_000
    assert count(picture[:, : column - 4], PALETTE.obstacle, 0) == 0
    assert count(picture, PALETTE.hatch, 12) > 1000


def test_load_cell_is_a_plate_at_the_height_of_its_node(renderer: Renderer) -> None:
    cell = HalfPlane(point=(26, 127), normal=(-1, 0), nodes=(14,))
    equilibrium = pulled((cell,), 3.0)
    picture = renderer.draw(frame_of(equilibrium))
    height = equilibrium.nodes[14, 1]
    assert tuple(picture[pixel((27.5, height + 13))]) == PALETTE.clamp
    assert tuple(picture[pixel((27.5, height - 13))]) == PALETTE.clamp
    assert tuple(picture[pixel((38, height))]) == PALETTE.cell
    assert tuple(picture[pixel((27.5, height - 18))]) != PALETTE.clamp


def test_markers_and_arrows_only_in_contact(renderer: Renderer, free: Equilibrium, touching: Equilibrium) -> None:
    world = np.s_[: SIZE[1] - int(LAYOUT.footer), : SIZE[0] - int(LAYOUT.panel)]
    force = (-0.05, 0.05)
    apart, together = renderer.draw(frame_of(free, force))[world], renderer.draw(frame_of(touching, force))[world]
    for color in (PALETTE.contact, PALETTE.force_true, PALETTE.force_est):
        assert count(together, color) > count(apart, color) + 10


def test_arrow_is_the_reaction_on_the_obstacle(renderer: Renderer, touching: Equilibrium) -> None:
    def middle(force: tuple[float, float]) -> np.ndarray:
        frame = replace(frame_of(touching, force), force_est=np.zeros(2))
        around = renderer.draw(frame)[:300, 200:500]
        return np.asarray(np.argwhere(np.abs(around.astype(int) - PALETTE.force_true).max(axis=-1) <= 3).mean(axis=0))

    (right_row, right_column), (left_row, left_column) = middle((-0.1, 0.0)), middle((0.1, 0.0))
    assert right_column > left_column + 20
    assert right_row == pytest.approx(left_row, abs=2)
    assert middle((0.0, 0.1))[0] > middle((0.0, -0.1))[0] + 20


@pytest.mark.parametrize(
    ("force", "length"), [(0.1, 0.5), (0.2, 1.0), (5.0, LAYOUT.arrow_reach), (np.inf, 0), (0.0, 0)]
)
def test_arrow_length_follows_the_scale_and_is_limited(force: float, length: float) -> None:
    camera = Camera.fit(500, 500)
    vector = reaction_arrow(camera, np.array([0.0, force]), 0.2)
    np.testing.assert_allclose(vector, [0, length * LAYOUT.arrow_mm * camera.scale], atol=1e-12)


def test_gauge_follows_the_desired_force(renderer: Renderer, free: Equilibrium) -> None:
    def goal_row(desired: float) -> float:
        gauge = renderer.draw(frame_of(free, desired=desired))[: int(LAYOUT.gauge_height) + 60, -50:]
        return float(np.flatnonzero((np.abs(gauge.astype(int) - PALETTE.desired).max(axis=-1) <= 3).any(axis=1)).mean())

    low, middle, full, beyond = (goal_row(force) for force in (0.0, 0.1, 0.2, 9.0))
    assert low - middle == pytest.approx(LAYOUT.gauge_height / 2, abs=1)
    assert low - full == pytest.approx(LAYOUT.gauge_height, abs=1)
    assert beyond == full


def test_gauge_bars_follow_the_forces(renderer: Renderer, free: Equilibrium) -> None:
    def bars(force: float) -> list[int]:
        gauge = renderer.draw(frame_of(free, (force, 0.0), desired=0.2))[: int(LAYOUT.gauge_height) + 60, -60:]
        return [count(gauge, color) for color in (PALETTE.force_true, PALETTE.force_est)]

    full = LAYOUT.gauge_bar * LAYOUT.gauge_height
    assert bars(0.0) == [0, 0]
    assert bars(0.1) == [pytest.approx(0.5 * full, rel=0.1), pytest.approx(0.4 * full, rel=0.1)]


def test_non_finite_forces_are_not_drawn(renderer: Renderer, touching: Equilibrium) -> None:
    frame = frame_of(touching, (-0.05, 0.05))
    for value in (np.nan, np.inf):
        renderer.draw(replace(frame, force_est=np.array([value, 0.0])))


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
