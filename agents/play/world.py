"""The robot, its obstacles and forces as objects of the page's scene."""

from collections.abc import Callable

import numpy as np
import viser

from agents.play.frame import Contacts, Frame
from agents.play.meshes import disk, grid, mesh_of, middle_of, sizes_of
from solver import HalfPlane, Obstacle

Color = tuple[int, int, int]
Dragged = Callable[[int, np.ndarray], None]  # index of an obstacle, its middle (3,) [L]

BACKBONE: Color = (33, 60, 114)
CABLE: Color = (128, 72, 28)
SLACK: Color = (214, 190, 166)
DISK: Color = (132, 150, 184)
GRID: Color = (224, 229, 237)
CLAMP: Color = (74, 85, 108)
OBSTACLE: Color = (178, 190, 206)
TOUCHED: Color = (240, 170, 160)
FORCE_TRUE: Color = (0, 140, 126)
FORCE_EST: Color = (244, 146, 30)
CONTACT = np.array([(252, 150, 166), (208, 24, 66), (98, 0, 30)], float)  # from a small multiplier to a large one

MARKERS = 16  # contact points that are shown at most
MARKER, THICK, THIN = 0.016, 0.016, 0.006  # radius of a marker, thickness of backbone and cables [L]
BEFORE = -0.075  # where contacts and arrows of the plane are shown, before obstacles [L]
FLAT = 0.18  # of the disks of a planar robot across the plane, over their radius
SEEN_THROUGH = 0.5  # opacity in space of an obstacle that is touched: the arrows of forces point into it
CAMERA_FOV = 0.6  # [rad]


class World:
    """What is shown of one environment; another environment has a world of its own.

    Args:
        server: The server.
        frame: The first frame.
        length_mm: Length of the robot [mm].
        radius_mm: Radius of its disks [mm].
        dragged: Called where the user drags an obstacle.
    """

    def __init__(
        self, server: viser.ViserServer, frame: Frame, length_mm: float, radius_mm: float, dragged: Dragged
    ) -> None:
        self._scene, self._length_mm = server.scene, length_mm
        self._planar = frame.obstacles[0].space == 2
        self._held: set[int] = set()  # obstacles whose handles are in the user's hand
        self._sizes = [sizes_of(obstacle) for obstacle in frame.obstacles]
        self._tints = [False] * len(frame.obstacles)
        self._scene.reset()
        self._place_camera(server)
        self._add_ground(radius_mm / length_mm)
        self._add_robot(frame, radius_mm / length_mm)
        self._add_contacts()
        self._meshes = [self._add_mesh(index, obstacle) for index, obstacle in enumerate(frame.obstacles)]
        self._handles = [self._add_handle(index, obstacle, dragged) for index, obstacle in enumerate(frame.resting)]

    def show(self, frame: Frame) -> None:
        """Show a frame."""
        shape = frame.shape
        self._backbone.points = shape.nodes
        self._cables.points = shape.cables
        self._cables.colors = np.where(shape.taut[:, None, None], CABLE, SLACK).repeat(2, axis=1).astype(np.uint8)
        self._disks.batched_positions, self._disks.batched_wxyzs = shape.nodes, shape.disks
        self._show_contacts(frame.contacts)
        for index, obstacle in enumerate(frame.obstacles):
            self._show_obstacle(index, obstacle, index in frame.contacts.touched)
        for index, obstacle in enumerate(frame.resting):
            if index not in self._held:
                self._put(self._handles[index], middle_of(obstacle, self._length_mm))

    def release(self) -> None:
        """Put the handles back to their obstacles, also those in the user's hand."""
        self._held.clear()

    def _place_camera(self, server: viser.ViserServer) -> None:
        position, target = ((0.25, -2.1, 0.55), (0.25, 0.0, 0.52)) if self._planar else ((1.35, -1.6, 1.0), (0, 0, 0.5))
        for client in server.get_clients().values():
            client.camera.up_direction, client.camera.position, client.camera.look_at = (0, 0, 1), position, target
            client.camera.fov = CAMERA_FOV
        server.initial_camera.position, server.initial_camera.look_at = position, target
        server.initial_camera.fov = CAMERA_FOV

    def _add_ground(self, radius: float) -> None:
        self._scene.add_light_ambient("/ambient", intensity=1.6)
        self._scene.add_mesh_simple(
            "/grid", *grid(self._planar), color=GRID, material="toon3", side="double", cast_shadow=False
        )
        self._scene.add_box("/clamp", CLAMP, dimensions=(3.2 * radius, 3.2 * radius, 0.04), position=(0, 0, -0.02))

    def _add_robot(self, frame: Frame, radius: float) -> None:
        shape = frame.shape
        self._backbone = self._scene.add_spline_catmull_rom(
            "/robot/backbone", shape.nodes, thickness=THICK, color=BACKBONE, segments=2 * len(shape.nodes)
        )
        self._cables = self._scene.add_line_segments("/robot/cables", shape.cables, CABLE, thickness=THIN)
        mesh = disk(radius, min(0.012, 0.25 / len(shape.nodes)))
        self._disks = self._scene.add_batched_meshes_simple(
            "/robot/disks", *mesh, shape.disks, shape.nodes, batched_colors=DISK, lod="off",
            batched_scales=np.tile([1.0, FLAT if self._planar else 1.0, 1.0], (len(shape.nodes), 1)), material="toon5",
            cast_shadow=False,
        )  # fmt: skip

    def _add_contacts(self) -> None:
        before = (0.0, BEFORE, 0.0) if self._planar else (0.0, 0.0, 0.0)
        ball, none = _ball(), np.zeros((MARKERS, 3))
        self._markers = self._scene.add_batched_meshes_simple(
            "/contacts", *ball, np.tile([1.0, 0, 0, 0], (MARKERS, 1)), none, batched_scales=np.full(MARKERS, 1e-6),
            batched_colors=np.zeros((MARKERS, 3), np.uint8), lod="off", cast_shadow=False, position=before,
            visible=False, material="toon5",
        )  # fmt: skip
        self._arrows = [
            self._scene.add_arrows(
                f"/forces/{name}", np.zeros((1, 2, 3)), color, shaft_radius=0.008, head_radius=0.02, head_length=0.045,
                position=before, visible=False,
            )
            for name, color in (("true", FORCE_TRUE), ("estimate", FORCE_EST))
        ]  # fmt: skip

    def _add_mesh(self, index: int, obstacle: Obstacle) -> viser.MeshHandle:
        wall = isinstance(obstacle, HalfPlane) or not np.isfinite(obstacle.extent.radius)
        return self._scene.add_mesh_simple(
            f"/obstacles/{index}", *mesh_of(obstacle, self._length_mm), color=OBSTACLE, flat_shading=wall,
            position=middle_of(obstacle, self._length_mm), side="double", cast_shadow=False, material="toon5",
        )  # fmt: skip

    def _add_handle(self, index: int, obstacle: Obstacle, dragged: Dragged) -> viser.TransformControlsHandle:
        handle = self._scene.add_transform_controls(
            f"/handles/{index}", 0.22, disable_rotations=True, depth_test=False, line_width=3.0,
            active_axes=(True, not self._planar, True), position=middle_of(obstacle, self._length_mm),
        )  # fmt: skip

        @handle.on_update
        async def _(event: viser.TransformControlsEvent) -> None:
            if event.phase == "end":
                self._held.discard(index)
            else:
                self._held.add(index)
            if event.phase != "start":
                dragged(index, np.array(event.target.position))

        return handle

    def _show_contacts(self, contacts: Contacts) -> None:
        if len(contacts.points):
            self._place_markers(contacts)
        _set_visible(self._markers, bool(len(contacts.points)))
        for arrow, ends in zip(self._arrows, (contacts.arrow_true, contacts.arrow_est), strict=True):
            visible = bool((ends[0] != ends[1]).any())
            if visible:
                arrow.points = ends[None]
            _set_visible(arrow, visible)

    def _place_markers(self, contacts: Contacts) -> None:
        shown = np.argsort(-contacts.levels)[:MARKERS]
        positions, scales = np.zeros((MARKERS, 3), np.float32), np.full(MARKERS, 1e-6, np.float32)
        colors = np.zeros((MARKERS, 3), np.uint8)
        positions[: len(shown)], scales[: len(shown)] = contacts.points[shown], 1.0
        colors[: len(shown)] = contact_colors(contacts.levels[shown])
        self._markers.batched_positions, self._markers.batched_scales = positions, scales
        self._markers.batched_colors = colors

    def _show_obstacle(self, index: int, obstacle: Obstacle, touched: bool) -> None:
        mesh, sizes = self._meshes[index], sizes_of(obstacle)
        if sizes != self._sizes[index]:
            self._sizes[index] = sizes
            mesh.vertices = mesh_of(obstacle, self._length_mm).vertices
        self._put(mesh, middle_of(obstacle, self._length_mm))
        if touched != self._tints[index]:
            self._tints[index] = touched
            mesh.color = TOUCHED if touched else OBSTACLE
            mesh.opacity = SEEN_THROUGH if touched and not self._planar else None

    @staticmethod
    def _put(handle: viser.SceneNodeHandle, middle: np.ndarray) -> None:
        if not np.array_equal(handle.position, middle):
            handle.position = middle


def _set_visible(handle: viser.SceneNodeHandle, visible: bool) -> None:
    if handle.visible != visible:
        handle.visible = visible


def contact_colors(levels: np.ndarray) -> np.ndarray:
    """Return the colour of contacts, darker the larger their multiplier, ``(k, 3)`` uint8."""
    shade = np.clip(2 * levels, 0.0, 2.0)
    return np.stack([np.interp(shade, range(3), channel) for channel in CONTACT.T], axis=-1).astype(np.uint8)


def _ball() -> tuple[np.ndarray, np.ndarray]:
    """Return vertices and faces of a marker: a sphere of rings."""
    rings, around = 6, 10
    polar, angles = np.linspace(0, np.pi, rings + 1)[:, None], np.linspace(0, 2 * np.pi, around, endpoint=False)
    points = [np.sin(polar) * np.cos(angles), np.sin(polar) * np.sin(angles), np.cos(polar) * np.ones(around)]
    index = np.arange((rings + 1) * around).reshape(rings + 1, around)
    after = np.roll(index, -1, axis=1)
    faces = [(index[:-1], index[1:], after[1:]), (index[:-1], after[1:], after[:-1])]
    return MARKER * np.stack(points, axis=-1).reshape(-1, 3), np.concatenate(
        [np.stack(corners, axis=-1).reshape(-1, 3) for corners in faces]
    )
