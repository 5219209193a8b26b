"""The scene in viser: tissue, attachments, target region, points, instruments, path."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final

import numpy as np
import viser
from numpy.typing import NDArray

from fras_common.messages import RobotState, TissueState
from fras_log.colours import ATTACHMENT, ROI, rgb
from fras_log.export.instruments import instrument
from fras_monitor.commands import Colouring, Place
from fras_monitor.page.door import PAGE, WHO
from fras_monitor.picture import Picture
from fras_monitor.shapes import FloatArray, Mesh, ball, instrument_mesh, name_place_m, ring
from fras_monitor.stage import (
    ABOVE_M,
    CLEAR_M,
    BlockKind,
    Blocks,
    Ground,
    blocks_of,
    ground_of,
    kinds_of,
    magnitudes_n,
    path_of,
)
from fras_monitor.surface import BANDS, bands, share_of
from fras_monitor.words import ARMS

# Okabe and Ito's palette: distinct under every common colour vision.
BLOCK_COLOURS: Final = {
    "free": rgb("#56b4e9"),
    "fixed": rgb(ATTACHMENT),
    "chosen": rgb("#e69f00"),
    "held": rgb("#009e73"),
    "out_of_reach": rgb("#b8bec6"),
}
VISIBLE: Final = rgb("#009e73")
COVERED: Final = rgb(ROI)
PATH: Final = rgb("#cc79a7")
ARM_COLOURS: Final = {"psm1": rgb("#8d99a8"), "psm2": rgb("#b3a48e")}
BLOCK_RADIUS_M: Final = 0.0016
TUBE_M: Final = 0.0006
# From each of them the right instrument, psm1, is seen on the right.
EYE_M: Final = (-0.055, -0.075, 0.115)
LOOK_AT_M: Final = (0.05, 0.055, 0.012)
PLACES: Final[Mapping[Place, tuple[float, float, float]]] = {
    "overview": EYE_M,
    "above": (0.049, 0.055, 0.27),
    "side": (-0.16, 0.055, 0.05),
}
# Colour, width [m] and height, in ABOVE_M, of the lines that an edge is drawn with.
EDGES: Final = {
    "/attachments/ground": (rgb("#ffffff"), 0.0016, 0.6),
    "/attachments/edge": (rgb(ATTACHMENT), 0.0008, 1.0),
}
SEEN_M: Final = 5e-5
FALLBACK_LIMIT_N: Final = 0.5
FACES: Final = np.zeros((0, 3), dtype=np.uint32)
VERTICES: Final = np.zeros((0, 3), dtype=np.float32)


class Scene:
    """Draws pictures; everyone who looks sees the same scene, each from where they like.

    What is told to viser and has not changed is sent to nobody.

    Parameters
    ----------
    server : viser.ViserServer
    on_block : callable
        Told the name of a block that a surgeon clicked, on the server's own thread.
    """

    def __init__(self, server: viser.ViserServer, on_block: Callable[[str], None]) -> None:
        self._server = server
        self._on_block = on_block
        self.colouring: Colouring = "force"
        self._ground: Ground | None = None
        self._blocks: Blocks | None = None
        self._nodes: dict[str, Any] = {}
        self._drawn: tuple[object, ...] = ()
        self._stand: dict[str, tuple[object, ...]] = {}
        self._eyes: dict[str, viser.ClientHandle] = {}
        self._prepare()

    def _prepare(self) -> None:
        server = self._server
        server.gui.configure_theme(show_logo=False, show_share_button=False)
        # The usual light is a photograph of a room; nothing here needs one.
        server.scene.configure_environment_map(None)
        server.scene.configure_default_lights(enabled=True, cast_shadow=False)
        server.scene.add_light_ambient("/light", intensity=0.9)
        server.initial_camera.position = EYE_M
        server.initial_camera.look_at = LOOK_AT_M
        server.initial_camera.near = 0.002
        server.initial_camera.far = 5.0

        @server.on_client_connect
        async def _(client: viser.ClientHandle) -> None:  # pyright: ignore[reportUnusedFunction]
            if page := PAGE.get():
                self._eyes[page] = client

        @server.on_client_disconnect
        async def _(client: viser.ClientHandle) -> None:  # pyright: ignore[reportUnusedFunction]
            self._eyes = {page: one for page, one in self._eyes.items() if one is not client}

    def look(self, page: str, place: Place) -> None:
        """Let one page look from another place; on the server's own thread."""
        if (client := self._eyes.get(page)) is not None:
            client.camera.position = PLACES[place]
            client.camera.look_at = LOOK_AT_M

    def draw(self, picture: Picture) -> None:
        """Show what has changed since the last time."""
        model = picture.of_trial(picture.model)
        with self._server.atomic():
            if model is None:
                if self._ground is not None:
                    self._clear()
                return
            tissue, robot = picture.of_trial(picture.tissue), picture.of_trial(picture.robot)
            if self._ground is None or self._ground.trial != model.trial:
                self._clear()
                self._set_up(ground_of(model))
            if tissue is not None:
                self._draw_tissue(picture, tissue)
            if robot is not None:
                self._draw_instruments(robot)

    def _clear(self) -> None:
        for handle in self._nodes.values():
            handle.remove()
        self._nodes.clear()
        self._ground, self._blocks, self._drawn = None, None, ()
        self._stand.clear()

    def _set_up(self, ground: Ground) -> None:
        self._ground = ground
        scene = self._server.scene
        colour = (255, 255, 255)
        for number in range(BANDS):
            self._nodes[f"/tissue/{number}"] = scene.add_mesh_simple(
                f"/tissue/{number}", VERTICES, FACES, color=colour, side="double",
                cast_shadow=False, receive_shadow=False, visible=False,
            )  # fmt: skip
        # Not filled, and dark on light: so the colours under it can be read, and it on all of them.
        edges = _edges(ground, ground.rest_m)
        for name, (colour, width_m, above) in EDGES.items():
            self._nodes[name] = scene.add_line_segments(
                name, edges + above * ABOVE_M.astype(np.float32), colour, thickness=width_m
            )
        over = (*ground.roi_m[:2].tolist(), ground.top_m + 0.001)
        self._mesh("/target/ring", ring(over, CLEAR_M, TUBE_M), COVERED)
        self._mesh("/target/centre", ring(ground.roi_m.tolist(), 0.003, 0.0009), COVERED)

    def _draw_tissue(self, picture: Picture, tissue: TissueState) -> None:
        ground = self._ground
        verdict, context = picture.of_trial(picture.verdict), picture.of_trial(picture.context)
        nodes_m = tissue.nodes_m.floats()
        if ground is None or nodes_m.shape != ground.rest_m.shape:
            return
        state = (tissue, self.colouring)
        if self._drawn != state:
            self._drawn = state
            top_n = verdict.hard_limit_n if verdict is not None else 2.0 * FALLBACK_LIMIT_N
            share = share_of(self.colouring, nodes_m, ground.rest_m, magnitudes_n(tissue), top_n)
            for number, band in enumerate(bands(nodes_m, ground.surface, share, self.colouring)):
                handle = self._nodes[f"/tissue/{number}"]
                handle.visible = len(band.faces) > 0
                if len(band.faces):
                    handle.vertices, handle.faces = band.vertices_m, band.faces
                    handle.color = band.colour
            edges = _edges(ground, nodes_m)
            for name, (_, _, above) in EDGES.items():
                handle, places = self._nodes[name], edges + above * ABOVE_M.astype(np.float32)
                if np.abs(handle.points - places).max(initial=0.0) > SEEN_M:
                    handle.points = places
        if verdict is not None:
            self._mark_target(verdict.visible)
        if context is not None:
            plan = picture.plan
            kinds = kinds_of(context, plan.target if plan is not None else "")
            # Of a context that was heard in mid-trial only the middles of the cells are known.
            is_better = context.tick == tissue.tick
            if self._blocks is None or (is_better and not self._blocks.exact):
                self._blocks = blocks_of(context, ground, tissue)
            places_m = self._blocks.carried.places_m(nodes_m)
            self._draw_blocks(places_m, kinds)
            self._draw_path(path_of(picture, dict(zip(self._blocks.names, places_m, strict=True))))

    def _draw_instruments(self, robot: RobotState) -> None:
        for name, arm in robot.arms.items():
            stands = (arm.tip_in_world, arm.joints, arm.jaw_rad)
            if self._stand.get(name) != stands:
                self._stand[name] = stands
                colour = ARM_COLOURS.get(name, COVERED)
                drawn = instrument(arm)
                self._mesh(f"/instruments/{name}", instrument_mesh(drawn), colour)
                self._name(name, name_place_m(drawn))

    def _name(self, arm: str, place_m: tuple[float, float, float]) -> None:
        """Write beside an instrument which it is."""
        key = f"/instruments/{arm}/name"
        if (handle := self._nodes.get(key)) is not None:
            handle.position = place_m
            return
        self._nodes[key] = self._server.scene.add_label(
            key, ARMS.get(arm, arm), position=place_m, font_size_mode="screen",
            font_screen_scale=0.8, depth_test=False, anchor="center-left",
        )  # fmt: skip

    def _draw_blocks(self, places_m: FloatArray, kinds: Sequence[BlockKind]) -> None:
        places = (places_m + ABOVE_M).astype(np.float32)
        colours = np.array([BLOCK_COLOURS[one] for one in kinds], dtype=np.uint8).reshape(-1, 3)
        handle = self._nodes.get("/points")
        if handle is None or len(handle.batched_positions) != len(places):
            shape = ball(BLOCK_RADIUS_M)
            handle = self._server.scene.add_batched_meshes_simple(
                "/points", shape.vertices_m, shape.faces,
                np.tile(np.array([1.0, 0.0, 0.0, 0.0], dtype=np.float32), (len(places), 1)),
                places, batched_colors=colours, lod="off", cast_shadow=False,
                receive_shadow=False,
            )  # fmt: skip
            handle.on_click(self._clicked)
            self._nodes["/points"] = handle
            return
        handle.batched_positions, handle.batched_colors = places, colours

    async def _clicked(self, event: viser.SceneNodePointerEvent[Any]) -> None:
        blocks, number = self._blocks, event.instance_index
        surgeon = WHO.get() == "surgeon"
        if surgeon and blocks is not None and number is not None and number < len(blocks.names):
            self._on_block(blocks.names[number])

    def _draw_path(self, dashes_m: FloatArray) -> None:
        dashes = dashes_m.astype(np.float32)
        handle = self._nodes.get("/path")
        if handle is None:
            self._nodes["/path"] = self._server.scene.add_line_segments(
                "/path", dashes, PATH, thickness=0.0008
            )
        else:
            handle.points = dashes

    def _mark_target(self, visible: bool) -> None:
        colour = VISIBLE if visible else COVERED
        for name in ("/target/ring", "/target/centre"):
            self._nodes[name].color = colour

    def _mesh(self, name: str, mesh: Mesh, colour: tuple[int, int, int]) -> None:
        handle = self._nodes.get(name)
        if handle is None:
            self._nodes[name] = self._server.scene.add_mesh_simple(
                name, mesh.vertices_m, mesh.faces, color=colour, cast_shadow=False,
                receive_shadow=False,
            )  # fmt: skip
        else:
            handle.vertices = mesh.vertices_m


def _edges(ground: Ground, nodes_m: FloatArray) -> NDArray[np.float32]:
    """Where the attachments end on the tissue as it is, shape (n, 2, 3) [m]."""
    return ground.edges.places_m(nodes_m).astype(np.float32).reshape(-1, 2, 3)
